"""The validation's pictures: what is compared, in one look each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.arrays import Array
from catheter_sim.controllers.loop import ControlRun
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import Friction
from catheter_sim.robots.continuum.published import neuroendoscope_section
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import replaced_when_whole
from catheter_sim.validation.lines import (
    NO_GRAVITY,
    Against,
    Loop,
    Profiles,
    TermCurves,
    ValidatedMotion,
    given,
    tips_mm,
)

if TYPE_CHECKING:
    from catheter_sim.validation.chest_tube import Profile
    from catheter_sim.validation.chest_tube_measured import Repeats
    from catheter_sim.validation.mitral import JointLoops
    from catheter_sim.validation.neuroendoscope import Distances
    from catheter_sim.validation.spacer_disk import ModelScores

# ----------------------------------------------------------------------------------------------------
# The three bodies of Kato 2016, Figs 4 and 5: pulled sideways at the tip to 44 mm and back.
#
# Backbone alone; backbone with wire guides (pressed together by 4 N, free to roll); and with tendons that
# carry the 4 N as pretension and rub. Only the last may need another force on the way back.

PRETENSION_N = 4.0  # Kato 2016: axial compression of both bodies with guides, sum of the tendons
REACH_MM = 44.0  # Kato 2016: lateral tip position at which the motion turns
PLACES_MM = np.linspace(4.4, 39.6, 9)  # where the two ways are compared
_FORCE_STEP_N = 0.0025


@dataclass(frozen=True)
class BodyStage:
    """One body: the string's force on the way out and back.

    Attributes:
        name: which body.
        force_N, place_mm: the whole round trip, shape (r,).
        discrepancy_mN: force out less force back at `PLACES_MM`, shape (p,).
    """

    name: str
    force_N: Array
    place_mm: Array
    discrepancy_mN: Array


def body_stages() -> tuple[BodyStage, ...]:
    """Return the three stages, simulated."""
    mu = neuroendoscope_section().friction.mu
    return (
        _stage("backbone", 0.0, 0.0),
        _stage("backbone with wire guides", PRETENSION_N, 0.0),
        _stage("backbone with wire guides and tendons", PRETENSION_N, mu),
    )


def _stage(name: str, pretension_N: float, mu: float) -> BodyStage:
    robot = replace(neuroendoscope_section(), friction=Friction(mu))

    def tips(force: Array) -> Array:
        push = np.zeros((len(force), 3))
        push[:, 0] = force
        inputs = given(np.full((len(force), 2), pretension_N / 2.0), force_tip=push)
        return tips_mm(simulate(robot, inputs, NO_GRAVITY, ramp_s=0.5).postures)[:, 0]

    out = np.arange(0.0, 0.08, _FORCE_STEP_N)
    turn = int(np.argmax(tips(out) >= REACH_MM))
    force = np.concatenate([out[: turn + 1], out[:turn][::-1]])
    place = tips(force)
    there, back = slice(0, turn + 1), slice(turn, None)
    outward = np.interp(PLACES_MM, place[there], force[there])
    inward = np.interp(PLACES_MM, place[back][::-1], force[back][::-1])
    return BodyStage(name, force, place, (outward - inward) * 1e3)


# ----------------------------------------------------------------------------------------------------
# The validation's pictures: what is compared, in one look each.

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


def stages(items: Sequence[BodyStage], path: Path) -> None:
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


# ----------------------------------------------------------------------------------------------------
# The pictures of controlled catheters.

_STYLES = {"PK": (ORANGE, ":"), "PK+PID": (ORANGE, "-"), "TE": (BLUE, ":"), "TE+PID": (BLUE, "-")}


def joint_control(runs: Mapping[str, ControlRun], joints: Sequence[str], path: Path) -> None:
    """Draw bend and displacements over time by model and controller (as Nayar 2023, Fig. 6)."""
    figure = Figure(figsize=(5.0 * len(joints), 8.0), layout="constrained")
    columns = figure.subplots(3, len(joints), sharex=True, squeeze=False).T
    for k, (name, (bends, errors, parts)) in enumerate(zip(joints, columns, strict=True)):
        bends.set_title(name, fontsize=9)
        first = next(iter(runs.values()))
        bends.plot(
            first.times_s, np.degrees(first.desired[:, k]), color=GREY, lw=3, alpha=0.6, label="desired"
        )
        for label, run in runs.items():
            colour, style = _STYLES[label]
            bends.plot(run.times_s, np.degrees(run.reached[:, k]), style, color=colour, lw=1, label=label)
            error = np.degrees(run.reached[:, k] - run.desired[:, k])
            if label != "PK":
                errors.plot(run.times_s, error, style, color=colour, lw=1)
        errors.axhline(0.0, color=GREY, lw=0.8)
        for label, colour in (("PK+PID", ORANGE), ("TE+PID", BLUE)):
            run = runs[label]
            parts.plot(
                run.times_s, run.model_m[:, k] * 1e3, "--", color=colour, lw=1, label=f"{label}: model"
            )
            parts.plot(run.times_s, run.controller_m[:, k] * 1e3, color=colour, lw=1, label=f"{label}: PID")
        parts.set_xlabel("time [s]")
    for axes, text in zip(columns[0], ("bend [deg]", "error [deg]", "displacement [mm]"), strict=True):
        axes.set_ylabel(text)
    columns[0][0].legend(frameon=False, fontsize=7)
    columns[0][2].legend(frameon=False, fontsize=7)
    _save(figure, path)


def servo(runs: Mapping[str, ControlRun], path: Path) -> None:
    """Draw the error of the first joint over time, one curve a run."""
    figure = Figure(figsize=(5.5, 3.4), layout="constrained")
    axes = figure.subplots()
    for (label, run), colour in zip(runs.items(), (ORANGE, BLUE), strict=True):
        axes.plot(run.times_s, np.degrees(run.reached - run.desired)[:, 0], color=colour, label=label)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("error of the bend [deg]")
    axes.legend(frameon=False)
    _save(figure, path)


def whole_robot(runs: Mapping[str, tuple[ControlRun, ControlRun]], joints: Sequence[str], path: Path) -> None:
    """Draw every joint's angle and advance over time, a row for each motion (as Nayar 2023, Fig. 7).

    Args:
        runs: by what the advance does: by the model alone, and with the controller.
        joints: names of the first columns.
        path: of the PNG.
    """
    figure = Figure(figsize=(3.4 * (len(joints) + 1), 2.8 * len(runs)), layout="constrained")
    grid = figure.subplots(len(runs), len(joints) + 1, sharex=True, squeeze=False)
    for row, (title, (alone, controlled)) in zip(grid, runs.items(), strict=True):
        for k, (name, axes) in enumerate(zip(joints, row, strict=False)):
            axes.plot(
                alone.times_s, np.degrees(alone.desired[:, k]), color=GREY, lw=3, alpha=0.6, label="desired"
            )
            for label, run, colour in (("TE", alone, ORANGE), ("TE+PID", controlled, BLUE)):
                seen = run.reached if run.measured is None else run.measured
                axes.plot(
                    run.times_s, np.degrees(seen[:, k]), color=colour, lw=0.9, label=f"{label}, tracker"
                )
            axes.set_title(f"advance {title}: {name}", fontsize=8)
            axes.set_ylabel("angle [deg]")
        row[-1].plot(alone.times_s, alone.desired[:, len(joints)] * 1e3, color=GREY)
        row[-1].set_ylabel("advance [mm]")
        row[0].legend(frameon=False, fontsize=7)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    with replaced_when_whole(path, binary=True) as file:
        figure.savefig(file, format="png", dpi=130)


# ----------------------------------------------------------------------------------------------------
# Pictures of the transseptal catheter's checks.

_JOINT_COLOURS = ("#8a8f98", "#b79ad1", "#d1682a", "#3f8f5f", "#c23b5a")


def motions(items: Sequence[tuple[str, ValidatedMotion]], models: Sequence[str], path: Path) -> None:
    """Draw the tip's coordinates over time, simulated and by each model (Nayar 2022, Figs 9 and 11)."""
    figure = Figure(figsize=(10, 3.2 * len(items)), layout="constrained")
    grid = figure.subplots(len(items), 3, squeeze=False)
    for row, (title, item) in zip(grid, items, strict=True):
        for axis, axes in enumerate(row):
            axes.plot(item.time_s, item.tip_mm[:, axis], color="#1f5f99", lw=2.0, label="simulation")
            for name, colour in zip(models, _JOINT_COLOURS, strict=True):
                axes.plot(item.time_s, item.model_mm[name][:, axis], color=colour, lw=0.9, label=name)
            axes.set_title(f"{title}: {'xyz'[axis]}", fontsize=8)
            axes.set_xlabel("time [s]")
            axes.set_ylabel("tip [mm]")
    grid[0][0].legend(frameon=False, fontsize=7)
    with replaced_when_whole(path, binary=True) as file:
        figure.savefig(file, format="png", dpi=130)


def joint_loops(items: Sequence[tuple[str, JointLoops, Mapping[str, Array]]], path: Path) -> None:
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
        for (name, angle), colour in zip(models.items(), _JOINT_COLOURS, strict=False):
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


# ----------------------------------------------------------------------------------------------------
# Figures of the papers drawn again from the simulation and the models.


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


# ----------------------------------------------------------------------------------------------------
# The modelling benchmark's Figs 10 and 11, redrawn (Rao et al. 2021).

_MODEL_COLOURS = {
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


def scenario_1(table: Mapping[tuple[str, int], ModelScores], path: Path) -> None:
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
                axes.semilogy(disks, values, marker="o", ms=3, color=_MODEL_COLOURS[name], label=name)
    for axes, label in zip(grid, ("position error [%]", "orientation error [deg]", "time [ms]"), strict=True):
        axes.set_xlabel("disks a segment")
        axes.set_ylabel(label)
    grid[2].legend(frameon=False, fontsize=8)
    _save(figure, path)


def scenario_2(table: Mapping[tuple[str, str, float], ModelScores], path: Path) -> None:
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
                    axes.loglog(factors, values, marker="o", ms=3, color=_MODEL_COLOURS[name], label=name)
        for axes, label in zip(
            row, ("position error [%]", "orientation error [deg]", "time [ms]"), strict=True
        ):
            axes.set_xlabel("stiffness over nominal")
            axes.set_ylabel(label)
        row[0].set_title(f"tip force {where}", fontsize=9)
    grid[0][2].legend(frameon=False, fontsize=8)
    _save(figure, path)


def model_shapes(found: Mapping[int, Mapping[str, Mapping[str, Array]]], path: Path) -> None:
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
                    points[:, 1],
                    points[:, 2],
                    color=_MODEL_COLOURS[model],
                    lw=1.1,
                    marker=".",
                    ms=3,
                    label=label,
                )
            end = next(iter(models.values()))[-1]
            axes.annotate(name, (end[1], end[2]), fontsize=8)
        axes.set_aspect("equal")
        axes.set_title(f"{disks} disks a segment", fontsize=9)
        axes.set_xlabel("y [mm]")
        axes.set_ylabel("z [mm]")
    axes.legend(frameon=False, fontsize=7)
    _save(figure, path)
