"""The modelling benchmark's Figs 10 and 11, redrawn (Rao et al. 2021)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from catheter_sim.tables import replaced_when_whole

if TYPE_CHECKING:
    from catheter_sim.arrays import Array
    from catheter_sim.validation.tdcr_tips import Scores

_COLOURS = {
    "CC": "#8a8f98",
    "CC_sub": "#d1682a",
    "PRB": "#3f8f5f",
    "PRB_middle": "#9ac29f",
    "VC": "#1f5f99",
    "VC_ref": "#222222",
    "VC_ref_noproj": "#8a6fb3",
    "PRB_printed": "#c9b458",
    "simulation": "#b3304a",
}


def scenario_1(table: Mapping[tuple[str, int], Scores], path: Path) -> None:
    """Draw the errors and the time over the number of disks (Fig. 10)."""
    figure = Figure(figsize=(10, 3.4), layout="constrained")
    grid = figure.subplots(1, 3)
    names = list(dict.fromkeys(model for model, _ in table))
    for name in names:
        own = sorted((n, found) for (model, n), found in table.items() if model == name)
        disks = [n for n, _ in own]
        for axes, values in zip(
            grid,
            (
                [found.position_percent for _, found in own],
                [found.orientation_deg for _, found in own],
                [found.ms for _, found in own],
            ),
            strict=True,
        ):
            if name != "VC_ref" or axes is grid[2]:
                axes.semilogy(disks, values, marker="o", ms=3, color=_COLOURS[name], label=name)
    for axes, label in zip(grid, ("position error [%]", "orientation error [deg]", "time [ms]"), strict=True):
        axes.set_xlabel("disks a segment")
        axes.set_ylabel(label)
    grid[2].legend(frameon=False, fontsize=8)
    _save(figure, path)


def scenario_2(table: Mapping[tuple[str, str, float], Scores], path: Path) -> None:
    """Draw the errors and the time over the stiffness, for both tip forces (Fig. 11)."""
    figure = Figure(figsize=(10, 6.4), layout="constrained")
    directions = list(dict.fromkeys(where for _, where, _ in table))
    grid = figure.subplots(len(directions), 3)
    for row, where in zip(grid, directions, strict=True):
        for name in dict.fromkeys(model for model, _, _ in table):
            own = sorted((k, found) for (model, w, k), found in table.items() if (model, w) == (name, where))
            factors = [k for k, _ in own]
            for axes, values in zip(
                row,
                (
                    [found.position_percent for _, found in own],
                    [found.orientation_deg for _, found in own],
                    [found.ms for _, found in own],
                ),
                strict=True,
            ):
                if name != "VC_ref" or axes is row[2]:
                    axes.loglog(factors, values, marker="o", ms=3, color=_COLOURS[name], label=name)
        for axes, label in zip(
            row, ("position error [%]", "orientation error [deg]", "time [ms]"), strict=True
        ):
            axes.set_xlabel("stiffness over nominal")
            axes.set_ylabel(label)
        row[0].set_title(f"tip force {where}", fontsize=9)
    grid[0][2].legend(frameon=False, fontsize=8)
    _save(figure, path)


def shapes(found: Mapping[int, Mapping[str, Mapping[str, Array]]], path: Path) -> None:
    """Draw the backbones of some configurations by every model, a panel for each number of disks (Fig. 9).

    Args:
        found: by disks, configuration and model, each (n + 1, 3) [mm].
        path: of the PNG.
    """
    figure = Figure(figsize=(4.6 * len(found), 4.6), layout="constrained")
    for axes, (disks, configurations) in zip(
        figure.subplots(1, len(found), squeeze=False)[0], found.items(), strict=True
    ):
        for number, (name, models) in enumerate(configurations.items()):
            for model, points in models.items():
                label = model if number == 0 else None
                axes.plot(
                    points[:, 1], points[:, 2], color=_COLOURS[model], lw=1.1, marker=".", ms=3, label=label
                )
            end = next(iter(models.values()))[-1]
            axes.annotate(name, (end[1], end[2]), fontsize=8)
        axes.set_aspect("equal")
        axes.set_title(f"{disks} disks a segment", fontsize=9)
        axes.set_xlabel("y [mm]")
        axes.set_ylabel("z [mm]")
    axes.legend(frameon=False, fontsize=7)
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    with replaced_when_whole(path, binary=True) as file:
        figure.savefig(file, format="png", dpi=130)
