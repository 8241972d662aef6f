"""Several postures of a robot in one picture: what is nearer to the camera hides what is behind it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from catheter_sim.pictures.images import Picture

FADED = 0.55  # of an earlier posture's colours, that is the background's


def overlaid(images: Sequence[Picture], depths: Sequence[NDArray[np.float32]]) -> Picture:
    """Return pictures of one scene in one, the last in full colours, those before it faded.

    Args:
        images: of one size and one camera, the background alike in all.
        depths: distance of what each pixel shows, shape (height, width) [m]; largest: the background.
    """
    background = np.maximum.reduce([depth.max() for depth in depths])
    result = images[-1].astype(np.float64)
    nearest = np.where(depths[-1] < background, depths[-1], np.inf)
    blank = _background(images, depths)
    for image, depth in zip(images[-2::-1], depths[-2::-1], strict=True):
        seen = (depth < depth.max()) & (depth < nearest)
        result[seen] = (1.0 - FADED) * image[seen] + FADED * blank[seen]
        nearest[seen] = depth[seen]
    return np.asarray(np.rint(result), dtype=np.uint8)


def _background(images: Sequence[Picture], depths: Sequence[NDArray[np.float32]]) -> NDArray[np.float64]:
    """Return the background: at each pixel of a picture that shows it there, else the mean of its row."""
    result = np.full(images[0].shape, np.nan)
    for image, depth in zip(images, depths, strict=True):
        free = depth >= depth.max()
        result[free] = image[free]
    rows = np.nanmean(np.where(np.isnan(result).all(axis=(1, 2), keepdims=True), 255.0, result), axis=1)
    return np.where(np.isnan(result), rows[:, np.newaxis], result)
