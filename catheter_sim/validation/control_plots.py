"""The pictures of controlled catheters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.controllers.loop import ControlRun
from catheter_sim.tables import replaced_when_whole
from catheter_sim.validation.plots import BLUE, GREY, ORANGE

_STYLES = {"PK": (ORANGE, ":"), "PK+PID": (ORANGE, "-"), "TE": (BLUE, ":"), "TE+PID": (BLUE, "-")}


def joint_control(runs: Mapping[str, ControlRun], joints: Sequence[str], path: Path) -> None:
    """Draw bend and displacements over time by model and controller (as Nayar 2023, Fig. 6).

    Args:
        runs: "PK", "TE", "PK+PID" and "TE+PID".
        joints: names of the first columns.
        path: of the PNG.
    """
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
