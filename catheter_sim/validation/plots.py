"""The validation's pictures: what is compared, in one look each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.tables import replaced_when_whole
from catheter_sim.validation.body_stages import Stage
from catheter_sim.validation.shown import Against, Loop, Profiles, TermCurves

BLUE, ORANGE, GREY = "#1f5f99", "#d1682a", "#8a8f98"


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a PNG file, whole or not at all."""
    with replaced_when_whole(path, binary=True) as file:
        figure.savefig(file, format="png", dpi=130)


def loops(items: Sequence[Loop], path: Path) -> None:
    """Draw tip x over the right tendon's tension for each loop."""
    figure = Figure(figsize=(4.2 * len(items), 3.6), layout="constrained")
    for axes, loop in zip(figure.subplots(1, len(items), squeeze=False)[0], items, strict=True):
        for postures, style, label in (
            (loop.printed, {"color": GREY, "ls": ":"}, "mapping as printed"),
            (loop.local, {"color": GREY, "lw": 1}, "exact arm, history rule"),
            (loop.analytic, {"color": ORANGE}, "exact arm, friction by sliding"),
            (loop.simulated, {"color": BLUE, "ls": "none", "marker": "o", "ms": 3}, "simulation"),
        ):
            axes.plot(
                loop.rows_N[:, 0], [posture.p_w[-1][0] * 1e3 for posture in postures], label=label, **style
            )
        axes.set_title(loop.name, fontsize=8)
        axes.set_xlabel("tension of the right tendon [N]")
        axes.set_ylabel("tip x [mm]")
    axes.legend(frameon=False, fontsize=8)
    save(figure, path)


def profiles(item: Profiles, path: Path) -> None:
    """Draw the tension along the tendon in arching and extending (as Kato 2016, Figs 14 and 15)."""
    figure = Figure(figsize=(10, 3.6), layout="constrained")
    cells = np.arange(1, item.arching.shape[1] + 1)
    both = zip(
        figure.subplots(1, 2, sharey=True),
        ("arching", "extending"),
        (item.arching, item.extending),
        (item.analytic_arching, item.analytic_extending),
        strict=True,
    )
    for axes, name, simulated, analytic in both:
        for letter, ours, theirs, constant in zip("ABC", simulated, analytic, item.constant, strict=True):
            axes.plot(cells, theirs, color=ORANGE, label="exact moment arm" if letter == "A" else None)
            axes.plot(cells, ours, "o", ms=3, color=BLUE, label="simulation" if letter == "A" else None)
            label = "constant curvature" if letter == "A" else None
            axes.plot(cells, constant, color=GREY, ls="-.", lw=1, label=label)
            axes.annotate(letter, (cells[0], ours[0]), xytext=(-10, 0), textcoords="offset points")
        axes.set_title(f"{name}: tension along the tendon", fontsize=9)
        axes.set_xlabel("cell, base to tip")
    figure.axes[0].set_ylabel("tension [N]")
    figure.axes[0].legend(frameon=False, fontsize=8)
    save(figure, path)


def stages(items: Sequence[Stage], path: Path) -> None:
    """Draw the string's force over the tip's place for the three bodies (as Kato 2016, Fig. 4)."""
    figure = Figure(figsize=(4.0 * len(items), 3.4), layout="constrained")
    for axes, stage in zip(figure.subplots(1, len(items), sharey=True), items, strict=True):
        axes.plot(stage.place_mm, stage.force_N * 1e3, "o-", ms=2.5, lw=1, color=BLUE)
        axes.set_title(stage.name, fontsize=9)
        axes.set_xlabel("lateral place of the tip [mm]")
    figure.axes[0].set_ylabel("force of the string [mN]")
    save(figure, path)


def shapes(simulated: Sequence[Posture], analytic: Sequence[Posture], path: Path) -> None:
    """Draw backbones in the xz plane, simulation over analytic model."""
    figure = Figure(figsize=(6, 5), layout="constrained")
    axes = figure.subplots()
    for ours, theirs in zip(simulated, analytic, strict=True):
        axes.plot(*_profile(theirs), color=ORANGE, lw=3, alpha=0.6)
        axes.plot(*_profile(ours), color=BLUE, lw=1)
    axes.plot([], [], color=ORANGE, lw=3, alpha=0.6, label="fkm_sliding")
    axes.plot([], [], color=BLUE, lw=1, label="simulation")
    axes.set_aspect("equal")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("z [mm]")
    axes.legend(frameon=False)
    save(figure, path)


def _profile(posture: Posture) -> tuple[np.ndarray, np.ndarray]:
    points = np.vstack([np.zeros(3), posture.p_w]) * 1e3
    return points[:, 0], points[:, 2]


def joint_angles(tensions: np.ndarray, printed: np.ndarray, complete: np.ndarray, path: Path) -> None:
    """Draw all joints' angles over the tension, two balances (as chest_tube_2025, Fig. 13)."""
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    both = zip(figure.subplots(1, 2, sharey=True), ("printed", "complete"), (printed, complete), strict=True)
    for axes, name, angles in both:
        axes.plot(tensions, angles[:, 0::2], color=ORANGE, lw=1)
        axes.plot(tensions, angles[:, 1::2], color=BLUE, lw=1)
        axes.axhline(0.0, color=GREY, lw=0.8)
        axes.set_title(f"{name} balance", fontsize=9)
        axes.set_xlabel("tension of the active rod [N]")
    figure.axes[0].plot([], [], color=ORANGE, label="odd joints")
    figure.axes[0].plot([], [], color=BLUE, label="even joints")
    figure.axes[0].legend(frameon=False, fontsize=8)
    figure.axes[0].set_ylabel("joint angle [deg]")
    save(figure, path)


def histories(items: Sequence[Against], path: Path) -> None:
    """Draw tip x over the rows of histories with friction, simulation over statics."""
    figure = Figure(figsize=(4.6 * len(items), 3.4), layout="constrained")
    for axes, item in zip(figure.subplots(1, len(items), squeeze=False)[0], items, strict=True):
        for postures, style, label in (
            (item.by_tensions, {"color": GREY, "ls": "--"}, "each rod's own tensions"),
            (item.analytic, {"color": ORANGE}, "complete"),
            (item.simulated, {"color": BLUE, "ls": "none", "marker": "o", "ms": 3}, "simulation"),
        ):
            axes.plot([posture.p_w[-1][0] * 1e3 for posture in postures], label=label, **style)
        axes.set_title(item.name, fontsize=8)
        axes.set_xlabel("row")
        axes.set_ylabel("tip x [mm]")
    figure.axes[0].legend(frameon=False, fontsize=7)
    save(figure, path)


def missing_terms(
    items: Sequence[TermCurves], tensions: np.ndarray, simulated: np.ndarray, path: Path
) -> None:
    """Draw the even joints' median bend over the tension by choice of terms (chest_tube_2025, Fig. 13)."""
    figure = Figure(figsize=(5.2 * len(items), 4.4), layout="constrained")
    colours = (ORANGE, "#2f8f5b", "#8d5aa8", "#c2a32f", "#b03060", "black")
    for axes, item in zip(figure.subplots(1, len(items), sharey=True), items, strict=True):
        axes.plot(tensions, np.median(item.complete[:, 1::2], axis=1), color=BLUE, lw=5, alpha=0.35)
        for colour, (name, angles) in zip(colours, item.balances.items(), strict=True):
            style = "--" if name == "with all three" else "-"
            axes.plot(tensions, np.median(angles[:, 1::2], axis=1), style, color=colour, lw=1.2, label=name)
        axes.plot([], [], color=BLUE, lw=5, alpha=0.35, label="complete balance")
        at = simulated[: len(item.simulated)]
        axes.plot(at, np.median(item.simulated[:, 1::2], axis=1), "o", ms=4, color=BLUE, label="simulation")
        axes.axhline(0.0, color=GREY, lw=0.8)
        axes.set_title(item.weight, fontsize=9)
        axes.set_xlabel("tension of the active rod [N]")
    figure.axes[0].set_ylabel("bend of the even joints, median [deg]")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    save(figure, path)


def convergence(means: Mapping[int, float], path: Path) -> None:
    """Draw the chain's mean tip error over its links a subsegment."""
    figure = Figure(figsize=(4.5, 3.4), layout="constrained")
    axes = figure.subplots()
    axes.loglog(list(means), list(means.values()), "o-", color=BLUE)
    axes.set_xlabel("links a subsegment")
    axes.set_ylabel("mean tip error [% of length]")
    axes.set_xticks(list(means), [str(links) for links in means])
    axes.minorticks_off()
    save(figure, path)


def releases(errors_percent: Array, time_s: Array, path: Path) -> None:
    """Draw how far mid-length and tip of a rod that is let go are from the reference, shape (r, 2)."""
    figure = Figure(figsize=(6.0, 3.2), layout="constrained")
    axes = figure.subplots()
    for column, name, colour in zip(errors_percent.T, ("mid-length", "tip"), (ORANGE, BLUE), strict=True):
        axes.plot(time_s, column, color=colour, label=name)
    axes.set_xlabel("time since the release [s]")
    axes.set_ylabel("distance [% of the length]")
    axes.legend(frameon=False, fontsize=8)
    save(figure, path)
