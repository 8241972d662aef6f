"""Several postures in one picture: what is nearer hides what is behind it, earlier ones are faded."""

from __future__ import annotations

import numpy as np

from catheter_sim.pictures.curves import FADED, overlaid

FAR = 10.0


def scene(columns: slice, colour: int, depth: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a picture and its depths: a band of one colour before a background of 200."""
    image = np.full((6, 12, 3), 200, dtype=np.uint8)
    depths = np.full((6, 12), FAR, dtype=np.float32)
    image[:, columns], depths[:, columns] = colour, depth
    return image, depths


def faded(colour: int) -> int:
    return round((1.0 - FADED) * colour + FADED * 200)


def test_the_last_is_in_full_colours_and_earlier_ones_are_faded() -> None:
    """Where nothing overlaps; the background stays."""
    first, last = scene(slice(0, 3), 40, 2.0), scene(slice(6, 9), 80, 2.0)
    image = overlaid([first[0], last[0]], [first[1], last[1]])
    assert (image[:, 0:3] == faded(40)).all()
    assert (image[:, 6:9] == 80).all()
    assert (image[:, 3:6] == 200).all()
    assert (image[:, 9:] == 200).all()


def test_what_is_nearer_hides_what_is_behind() -> None:
    """Whichever was first; of two that are behind nothing is seen where the last stands before them."""
    for depth, seen in ((1.0, faded(40)), (3.0, 80)):
        first, last = scene(slice(0, 6), 40, depth), scene(slice(3, 9), 80, 2.0)
        image = overlaid([first[0], last[0]], [first[1], last[1]])
        assert (image[:, 3:6] == seen).all()
    three = [scene(slice(0, 9), 40, 3.0), scene(slice(0, 9), 60, 2.0), scene(slice(6, 9), 80, 1.0)]
    image = overlaid([item[0] for item in three], [item[1] for item in three])
    assert (image[:, 0:6] == faded(60)).all()
    assert (image[:, 6:9] == 80).all()


def test_one_posture_is_its_own_picture() -> None:
    image, depth = scene(slice(2, 5), 40, 2.0)
    assert (overlaid([image], [depth]) == image).all()
