"""Figures that a notebook shows by themselves, and axes that a user gives to be drawn into."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from catheter_sim.errors import InputError, shown

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
