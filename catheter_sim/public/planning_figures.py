"""Figures of what is planned and sensed: targets, regions, workspaces, controlled motions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.pictures.figures import entitle, panels_of

if TYPE_CHECKING:
    from catheter_sim.public.controlled import Control
    from catheter_sim.public.inverse import InverseKinematics
    from catheter_sim.public.model_choice import ModelChoice
    from catheter_sim.public.reach import Workspace
    from catheter_sim.public.sensing import Sensing

BLUE, ORANGE, GREY = "#1f5fa8", "#d9822b", "#888888"


def inverse_figure(found: InverseKinematics, ax: Any = None) -> Figure:
    """Return targets and what is reached of them, panel by unit, above the inputs."""
    plan, table = found.plan, found.to_table()
    reached = plan.reached if plan.simulated is None else plan.simulated
    figure, panels = panels_of(ax, 2, 1, (8.0, 6.5), sharex=True)
    above, below = panels[:, 0]
    time_s = plan.targets.time_s
    for k, name in enumerate(plan.targets.names):
        (line,) = above.plot(time_s, reached[:, k], label=name)
        above.plot(time_s, plan.targets.asked[:, k], "o", mfc="none", ms=5, color=line.get_color())
    missed = ~plan.reachable
    if missed.any():
        for when in time_s[missed]:
            above.axvline(when, color=ORANGE, lw=0.8, alpha=0.5)
    above.set_ylabel("asked (rings), reached (lines)")
    above.legend(fontsize="small", frameon=False)
    for name, values in table.columns.items():
        below.plot(time_s, values, label=name)
    below.set_ylabel("inputs")
    below.set_xlabel("time [s]")
    below.legend(fontsize="small", frameon=False)
    unreached = f"; out of reach: {int(missed.sum())} (orange)" if missed.any() else ""
    entitle(figure, panels, f"{found.robot.name}: inverse kinematics{unreached}")
    return figure


def sensing_figure(found: Sensing, ax: Any = None) -> Figure:
    """Return every column over time, with its region."""
    sensed = found.sensed
    count = len(sensed.columns)
    figure, panels = panels_of(ax, count, 1, (8.0, 1.6 * count + 1.0), sharex=True)
    for k, (axes, name) in enumerate(zip(panels[:, 0], sensed.columns, strict=True)):
        axes.fill_between(sensed.time_s, sensed.low[:, k], sensed.high[:, k], color=BLUE, alpha=0.25, lw=0)
        axes.plot(sensed.time_s, sensed.value[:, k], color=BLUE, lw=1.2)
        axes.set_ylabel(name, fontsize="small")
    panels[-1, 0].set_xlabel("time [s]")
    entitle(figure, panels, f"{found.robot.name}: sensed, with 95 % regions")
    return figure


def workspace_figure(found: Workspace, ax: Any = None) -> Figure:
    """Return the tips in three views."""
    tip = found.tip_mm
    figure, panels = panels_of(ax, 1, 3, (12.0, 4.2))
    for axes, (across, up) in zip(panels[0], ((0, 2), (1, 2), (0, 1)), strict=True):
        axes.scatter(tip[:, across], tip[:, up], s=3, color=BLUE, alpha=0.4, lw=0)
        axes.plot(0.0, 0.0, "+", color=ORANGE, ms=8)
        axes.set_xlabel(f"{'xyz'[across]} [mm]")
        axes.set_ylabel(f"{'xyz'[up]} [mm]")
        axes.set_aspect("equal", adjustable="datalim")
    entitle(figure, panels, f"{found.robot.name}: {len(tip)} reachable tips (+: base)")
    return figure


def models_figure(found: ModelChoice, ax: Any = None) -> Figure:
    """Return every model's largest error over the time of a row, both by their logarithm."""
    figure, panels = panels_of(ax, 1, 1, (6.5, 4.5))
    axes = panels[0, 0]
    for row in found.to_table():
        if row["failed"] or not np.isfinite(row["ms"]):
            continue
        error = max(row["position_percent"], 1e-6)
        axes.loglog(row["ms"], error, "o", color=BLUE if row["within"] else GREY)
        axes.annotate(row["model"], (row["ms"], error), xytext=(4, 4), textcoords="offset points", fontsize=8)
    axes.axhline(found.tolerance_percent, color=ORANGE, lw=1.0)
    axes.set_xlabel("time of a row [ms]")
    axes.set_ylabel("largest distance of the tip [% of length]")
    axes.set_title(f"{found.robot.name}, against {found.result.reference}", fontsize="medium")
    return figure


def control_figure(found: Control, ax: Any = None) -> Figure:
    """Return angle, error and effort over time, a column for each joint that is asked to move."""
    first = next(iter(found.runs.values()))
    moved = [k for k in range(len(found.pairs)) if np.any(first.desired[:, k])] or [0]
    figure, panels = panels_of(ax, 3, len(moved), (5.0 * len(moved), 8.0), sharex=True)
    colours = [BLUE, ORANGE, "#3a8f4c", "#8a4fa3", GREY, "#b03a3a"]
    for k, (above, middle, below) in zip(moved, panels.T, strict=True):
        unit, size = ("mm", 1e3) if first.joints[k] == "prismatic" else ("deg", 180.0 / np.pi)
        above.plot(first.times_s, size * first.desired[:, k], color=GREY, lw=3, alpha=0.5, label="desired")
        for (name, run), colour in zip(found.runs.items(), colours * len(found.runs), strict=False):
            above.plot(run.times_s, size * run.reached[:, k], color=colour, lw=1, label=name)
            middle.plot(run.times_s, size * (run.reached - run.desired)[:, k], color=colour, lw=1)
            below.plot(run.times_s, 1e3 * run.model_m[:, k], "--", color=colour, lw=1)
            if np.any(run.controller_m[:, k]):
                below.plot(run.times_s, 1e3 * run.controller_m[:, k], color=colour, lw=1)
        above.set_title(found.pairs[k], fontsize="medium")
        above.set_ylabel(f"reached [{unit}]")
        middle.set_ylabel(f"error [{unit}]")
        below.set_ylabel("effort [mm]; dashed: model")
        below.set_xlabel("time [s]")
        above.legend(fontsize="small", frameon=False)
    return figure
