"""Curves and figures of runs."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from catheter_sim.channels import channel_inputs, input_channels
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, shown
from catheter_sim.pictures.images import INK, Picture
from catheter_sim.units import si_factor

# ----------------------------------------------------------------------------------------------------
# How figures are drawn: colours, letters, axes; and a figure as a PNG.

# Okabe and Ito 2008: two colours that the colour-blind tell apart.
COLOURS = {"measured": "#222222", "before": "#d55e00", "after": "#0072b2"}
LEGEND: dict[str, Any] = {"fontsize": 9, "frameon": False}
_FIGURE_DPI = 150
_COLOURS = 128  # of a PNG: two lines, letters and their edges need no more


def tidy_axes(axes: Any) -> None:
    axes.tick_params(labelsize=8)
    axes.grid(color="0.92", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def png_of(figure: Figure) -> bytes:
    """Return a figure of lines and words as a PNG of few colours: a third as large, and it looks the same."""
    figure.set_dpi(_FIGURE_DPI)
    canvas, stream = FigureCanvasAgg(figure), io.BytesIO()
    canvas.draw()  # `savefig` draws twice where there is a layout
    drawn = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    reduced = drawn.quantize(_COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    reduced.save(stream, "PNG", optimize=True)
    return stream.getvalue()


# ----------------------------------------------------------------------------------------------------
# Figures that a notebook shows by themselves, and axes that a user gives to be drawn into.

Panels = NDArray[Any]  # of axes, shape (rows, columns)


class OwnFigure(Figure):
    """A figure that a notebook shows where it is a cell's value, without pyplot."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png")
        return stream.getvalue()


def panels_of(
    ax: Any, rows: int, columns: int, size: tuple[float, float], sharex: bool = False
) -> tuple[Figure, Panels]:
    """Return the axes to draw into and their figure: a new one, or what a user gave.

    Args:
        ax: one of matplotlib's axes, or rows * columns of them, row by row; None: make a figure.
        rows, columns: of panels.
        size: of a new figure, width and height [inch].
        sharex: whether the panels of a new figure share their axis across.

    Raises:
        InputError: `ax` holds something else, fewer or more axes, or axes of several figures.
    """
    if ax is None:
        figure: Figure = OwnFigure(figsize=size, layout="constrained")
        return figure, figure.subplots(rows, columns, sharex=sharex, squeeze=False)
    given = np.array(ax, dtype=object).ravel()
    how = f"figure.subplots({rows}, {columns})" if rows * columns > 1 else "figure.subplots()"
    if not all(isinstance(item, Axes) for item in given):
        raise InputError(f"ax = {shown(ax)}: axes of matplotlib are needed, as {how} makes them")
    if len(given) != rows * columns:
        raise InputError(f"ax: {rows * columns} axes are needed, as {how} makes them; {len(given)} are given")
    figures = {item.figure.figure for item in given}
    if len(figures) > 1:
        raise InputError("ax: the axes belong to several figures; those of one are needed")
    return figures.pop(), given.reshape(rows, columns)


def entitle(figure: Figure, panels: Panels, text: str) -> None:
    """Write a title: above a figure of our own, else above the first of the axes that a user gave."""
    if isinstance(figure, OwnFigure):
        figure.suptitle(text, fontsize="medium")
    else:
        panels.flat[0].set_title(text, fontsize="medium")


# ----------------------------------------------------------------------------------------------------
# The inputs' curves beside a video: drawn once, with a line that runs along with the time.

WIDTH_SHARE = 0.3  # of a video's width
_DPI = 100
_MOST_PANELS = 6


class Curves:
    """The curves of a robot's inputs, as a strip to set beside the pictures of a video.

    Attributes:
        size: width and height [pixels].
    """

    def __init__(self, robot: RobotSpec, inputs: Inputs, width: int, height: int) -> None:
        """Draw the curves of the inputs that change, up to six; of all where none does."""
        self.size = width, height
        columns = input_channels(robot, inputs.actuation)
        values = channel_inputs(robot, inputs)
        moving = [k for k in range(len(columns)) if np.ptp(values[:, k]) > 0.0] or list(range(len(columns)))
        shown = moving[:_MOST_PANELS]
        figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
        for axes, k in zip(panels, shown, strict=True):
            name, _, unit = columns[k].rpartition("_")
            axes.plot(inputs.time_s, values[:, k] / si_factor(columns[k]), color="#1f5f8b", linewidth=1.4)
            axes.set_title(f"{name.replace('_', ' ')} [{unit}]", fontsize=8, loc="left")
            axes.tick_params(labelsize=7)
            axes.spines[["top", "right"]].set_visible(False)
        panels[-1].set_xlabel("time [s]", fontsize=8)
        canvas.draw()
        self._image = np.asarray(canvas.buffer_rgba())[:height, :width, :3].copy()
        boxes = [axes.get_window_extent() for axes in panels]
        self._rows = [(height - round(box.y1), height - round(box.y0)) for box in boxes]
        ends = panels[0].transData.transform([(at, 0.0) for at in (inputs.time_s[0], inputs.time_s[-1])])[
            :, 0
        ]
        self._times, self._places = inputs.time_s[[0, -1]], ends

    def place(self, time_s: float) -> int:
        """Return the column of the strip at which a time lies [pixels]."""
        if self._times[1] <= self._times[0]:
            return round(float(self._places[0]))
        return round(float(np.interp(time_s, self._times, self._places)))

    def beside(self, image: Picture, time_s: float) -> Picture:
        """Return `image` with the strip to its right, its line at `time_s`."""
        strip = self._image.copy()
        column = min(max(self.place(time_s), 0), self.size[0] - 2)
        for top, bottom in self._rows:
            strip[max(top, 0) : bottom, column : column + 2] = INK
        return np.concatenate([image, strip], axis=1)


def strip_width(width: int) -> int:
    """Return the width of the strip in a video so wide, even [pixels]."""
    return 2 * round(WIDTH_SHARE * width / 2.0)


# ----------------------------------------------------------------------------------------------------
# Several postures of a robot in one picture: what is nearer to the camera hides what is behind it.

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
        in_front = (depth < depth.max()) & (depth < nearest)
        result[in_front] = (1.0 - FADED) * image[in_front] + FADED * blank[in_front]
        nearest[in_front] = depth[in_front]
    return np.asarray(np.rint(result), dtype=np.uint8)


def _background(images: Sequence[Picture], depths: Sequence[NDArray[np.float32]]) -> NDArray[np.float64]:
    """Return the background: at each pixel of a picture that shows it there, else the mean of its row."""
    result = np.full(images[0].shape, np.nan)
    for image, depth in zip(images, depths, strict=True):
        free = depth >= depth.max()
        result[free] = image[free]
    rows = np.nanmean(np.where(np.isnan(result).all(axis=(1, 2), keepdims=True), 255.0, result), axis=1)
    return np.where(np.isnan(result), rows[:, np.newaxis], result)
