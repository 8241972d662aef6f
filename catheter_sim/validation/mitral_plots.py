"""Pictures of the transseptal catheter's checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.arrays import Array
from catheter_sim.tables import replaced_when_whole
from catheter_sim.validation.shown import Motion

if TYPE_CHECKING:
    from catheter_sim.validation.mitral_loops import JointLoops

_COLOURS = ("#8a8f98", "#b79ad1", "#d1682a", "#3f8f5f", "#c23b5a")


def motions(items: Sequence[tuple[str, Motion]], models: Sequence[str], path: Path) -> None:
    """Draw the tip's coordinates over time, simulated and by each model (Nayar 2022, Figs 9 and 11)."""
    figure = Figure(figsize=(10, 3.2 * len(items)), layout="constrained")
    grid = figure.subplots(len(items), 3, squeeze=False)
    for row, (title, item) in zip(grid, items, strict=True):
        for axis, axes in enumerate(row):
            axes.plot(item.time_s, item.tip_mm[:, axis], color="#1f5f99", lw=2.0, label="simulation")
            for name, colour in zip(models, _COLOURS, strict=True):
                axes.plot(item.time_s, item.model_mm[name][:, axis], color=colour, lw=0.9, label=name)
            axes.set_title(f"{title}: {'xyz'[axis]}", fontsize=8)
            axes.set_xlabel("time [s]")
            axes.set_ylabel("tip [mm]")
    grid[0][0].legend(frameon=False, fontsize=7)
    with replaced_when_whole(path, binary=True) as file:
        figure.savefig(file, format="png", dpi=130)


def loops(items: Sequence[tuple[str, JointLoops, Mapping[str, Array]]], path: Path) -> None:
    """Draw angle over displacement, simulated and by models (Nayar 2022, Figs 6 and 8).

    Args:
        items: a title, the loops, and angles by the name of a model [rad].
        path: of the PNG.
    """
    figure = Figure(figsize=(4.0 * len(items), 3.4), layout="constrained")
    row = figure.subplots(1, len(items), squeeze=False)[0]
    for axes, (title, item, models) in zip(row, items, strict=True):
        way = item.displacement_m * 1e3
        axes.plot(way, np.degrees(item.angle_rad), color="#1f5f99", lw=2.0, label="simulation")
        for (name, angle), colour in zip(models.items(), _COLOURS, strict=False):
            axes.plot(way, np.degrees(angle), color=colour, lw=0.9, label=name)
        axes.set_title(title, fontsize=8)
        axes.set_xlabel("displacement [mm]")
        axes.set_ylabel("angle [deg]")
        axes.legend(frameon=False, fontsize=7)
    with replaced_when_whole(path, binary=True) as file:
        figure.savefig(file, format="png", dpi=130)


def elongations(items: Sequence[tuple[str, Array, Array]], path: Path) -> None:
    """Draw tension over elongation, ten cycles each (Nayar 2023, Fig. 3); items: name, [mm], [N]."""
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    for name, way, tension in reversed(items):
        axes.plot(way, tension, lw=0.8, label=name)
    axes.set_xlabel("elongation of 65 mm [mm]")
    axes.set_ylabel("tension [N]")
    axes.legend(frameon=False, fontsize=8)
    with replaced_when_whole(path, binary=True) as file:
        figure.savefig(file, format="png", dpi=130)
