"""Figures of the papers drawn again from the simulation and the models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.validation.plots import BLUE, GREY, ORANGE, save

if TYPE_CHECKING:
    from catheter_sim.validation.chest_tube_design import Profile
    from catheter_sim.validation.chest_tube_repeats import Repeats
    from catheter_sim.validation.neuroendoscope_figures import Distances


def kato_postures(items: Sequence[Distances], path: Path) -> None:
    """Draw the postures in arching and extending of each layout (as Kato 2016, Figs 10 and 11)."""
    figure = Figure(figsize=(4.0 * len(items), 6.4), layout="constrained")
    grid = figure.subplots(2, len(items), squeeze=False, sharex=True, sharey=True)
    for column, item in zip(grid.T, items, strict=True):
        count = len(item.case.inputs_N)
        ways = (
            ("arching", item.postures[1 : 1 + count], item.postures[0], BLUE),
            ("extending", item.postures[-count:][::-1], item.postures[count + 1], ORANGE),
        )
        for axes, (name, postures, first, colour) in zip(column, ways, strict=True):
            axes.plot(*_profile(first), color=GREY, ls=":")
            for tension, posture in zip(item.case.inputs_N, postures, strict=True):
                axes.plot(*_profile(posture), color=colour, marker="o", ms=1.5, lw=0.8)
                x, z = _profile(posture)
                axes.annotate(f"{tension:g} N", (x[-1], z[-1]), fontsize=7)
            axes.set_title(f"{item.case.layout}, {item.case.name}: {name}", fontsize=9)
            axes.set_aspect("equal")
            axes.set_xlabel("x [mm]")
            axes.set_ylabel("z [mm]")
    save(figure, path)


def kato_distances(items: Sequence[Distances], path: Path) -> None:
    """Draw the tip's distance from constant curvature's over the sequence of inputs (Kato 2016, Fig. 13)."""
    figure = Figure(figsize=(3.1 * len(items), 3.2), layout="constrained")
    for axes, item in zip(figure.subplots(1, len(items), sharey=True), items, strict=True):
        values = np.concatenate([item.arching_mm, item.extending_mm[::-1]])
        places, count = np.arange(len(values)), len(item.case.inputs_N)
        colours = [BLUE] * count + [ORANGE] * count
        axes.bar(places, values, color=colours)
        axes.axhline(5.0, color=GREY, ls=":", lw=1)
        axes.set_xticks(
            places, [f"{x:g}" for x in (*item.case.inputs_N, *item.case.inputs_N[::-1])], rotation=90
        )
        axes.set_title(f"{item.case.layout}, {item.case.name}\nfrom {item.case.start_N:.2f} N", fontsize=8)
        axes.set_xlabel("arching, extending: tension [N]", fontsize=8)
    figure.axes[0].set_ylabel("tip from constant curvature [mm]")
    save(figure, path)


def kato_tensions(item: Distances, even_N: Array, path: Path) -> None:
    """Draw the tension along the tendon beside constant curvature's, input by input (Kato 2016, Fig. 15)."""
    count = len(item.case.inputs_N)
    figure = Figure(figsize=(3.0 * count, 3.2), layout="constrained")
    cells = np.arange(1, even_N.shape[1] + 1)
    there, back = item.postures[1 : 1 + count], item.postures[-count:][::-1]
    rows = zip(figure.subplots(1, count), item.case.inputs_N, there, back, even_N, strict=True)
    for axes, tension, arching, extending, even in rows:
        axes.plot(cells, arching.tendon_tension[0], color=BLUE, label="arching")
        axes.plot(cells, extending.tendon_tension[0], color=ORANGE, ls="--", label="extending")
        axes.plot(cells, even, color=GREY, ls="-.", label="constant curvature")
        axes.set_title(f"{tension:g} N", fontsize=9)
        axes.set_xlabel("cell, base to tip")
    figure.axes[0].set_ylabel("tension [N]")
    figure.axes[0].legend(frameon=False, fontsize=7)
    save(figure, path)


def printed_shapes(wanted_mm: Array, simulated_mm: Array, pcc_mm: Array, path: Path) -> None:
    """Draw the printed balance's shapes, the fitted simulation's and constant curvature's, (r, n, 3) each."""
    figure = Figure(figsize=(9, 4.4), layout="constrained")
    both = (("simulation, @printed_shapes", simulated_mm), ("constant curvature, calibrated", pcc_mm))
    for axes, (name, shapes) in zip(figure.subplots(1, 2, sharey=True), both, strict=True):
        for wanted, found in zip(wanted_mm, shapes, strict=True):
            axes.plot(wanted[:, 0], wanted[:, 2], color=ORANGE, lw=3, alpha=0.6)
            axes.plot(found[:, 0], found[:, 2], color=BLUE, marker="o", ms=2, lw=0.8)
        axes.set_title(f"{name} (blue) on the printed balance (orange)", fontsize=9)
        axes.set_aspect("equal")
        axes.set_xlabel("x [mm]")
    figure.axes[0].set_ylabel("z [mm]")
    save(figure, path)


def design(
    tensions: Array, profiles: Mapping[str, Profile], pulled: Array, back: Mapping[float, Array], path: Path
) -> None:
    """Draw bend over tension by profile, and how far even joints bend back where both rods are tense."""
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    for (name, item), colour in zip(profiles.items(), (GREY, BLUE, ORANGE), strict=True):
        left.plot(tensions, item.toward_deg, color=colour, label=name)
        left.plot(tensions, item.away_deg, color=colour, ls="--")
    left.set_xlabel("tension of the pulled rod [N]")
    left.set_ylabel("bend of the section [deg]")
    left.set_title("toward the first larger arm; dashed: away from it", fontsize=9)
    left.legend(frameon=False, fontsize=8)
    for stiffness, bend in back.items():
        right.plot(pulled, bend, label=f"rods' stiffness x{stiffness:g}")
    right.axhline(0.0, color=GREY, lw=0.8)
    right.set_xlabel("tension of one rod, the other held [N]")
    right.set_ylabel("even joints, median [deg]")
    right.legend(frameon=False, fontsize=8)
    save(figure, path)


def repeats(found: Repeats, tensions: Array, path: Path) -> None:
    """Draw the errors along the section and over the tension (as chest_tube_2025, Fig. 14 b and c)."""
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    along, spread = found.over_distance.mean(axis=(0, 1)), found.over_distance.std(axis=(0, 1))
    links = np.arange(1, len(along) + 1)
    left.fill_between(links, along - spread, along + spread, color=GREY, alpha=0.3)
    left.plot(links, along, color="black")
    left.set_xlabel("link, base to tip")
    left.set_ylabel("error over the distance from the base [%]")
    by_tension = found.away_mm.mean(axis=2)
    mean, spread = by_tension.mean(axis=0), by_tension.std(axis=0)
    right.fill_between(tensions, mean - spread, mean + spread, color=GREY, alpha=0.3)
    right.plot(tensions, mean, color="black")
    right.set_xlabel("tension [N]")
    right.set_ylabel("error of the shape [mm]")
    save(figure, path)


def _profile(posture: Posture) -> tuple[np.ndarray, np.ndarray]:
    points = np.vstack([np.zeros(3), posture.p_w]) * 1e3
    return points[:, 0], points[:, 2]
