"""What is in an exported file, how, and what it costs that the rest is not: as rows, as text, as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from catheter_sim.exporting.elements import FITTED, LEFT
from catheter_sim.exporting.judge import Distance, Judgement
from catheter_sim.exporting.write import ExportedModel

_NOT_SAID = "distances are those of the file in MuJoCo itself; it is not run in the other engine"


def text_of(model: ExportedModel, judgement: Judgement) -> str:
    """Return the report, a line for each thing that was measured or decided."""
    lines = [f"{model.robot.name} for {model.engine}"]
    lines += [f"  {line}" for line in _elements(model, judgement)]
    if model.engine != "mujoco":
        lines.append(f"  {_NOT_SAID}")
    lines.append("causes:")
    lines += [f"  {line}" for line in _causes(model, judgement)] or ["  none"]
    lines.append(
        f"file in MuJoCo alone against catheter-sim, length {judgement.length_mm:.4g} mm, not fitted:"
    )
    moving = () if judgement.moving is None else (judgement.moving,)
    for item in (*judgement.held, *moving):
        lines.append(f"  {item.loops}: {_said(item, judgement.length_mm)}")
    lines.append("controls (SI: N, m):")
    for control in model.controls:
        follows = f"{control.share:g} * {control.column}" if control.column else "none"
        lines.append(f"  {control.actuator} = {follows}")
    return "\n".join(lines) + "\n"


def _elements(model: ExportedModel, judgement: Judgement) -> list[str]:
    found = []
    if model.shifts:
        left = 1e3 * max(item.left_m for item in model.shifts)
        found.append(f"{len(model.shifts)} slides that hinges move: worked out, to within {left:.2g} mm")
    if model.laws:
        rubbing = sum(law.width + law.cubic + law.constant > 0.0 for law in model.laws)
        by = "plastic springs" if model.engine == "mujoco" else "tendons' friction loss"
        found.append(f"springs at {len(model.laws)} hinges, friction at {rubbing} by {by}: fitted")
    if found:
        bare = judgement.bare
        found.append(f"without these, one drive at a time: {_said(bare, judgement.length_mm)}")
    return found or ["nothing is fitted: no law runs beside the step, or its fit was no nearer"]


def _causes(model: ExportedModel, judgement: Judgement) -> list[str]:
    costs = {id(item.cause): item.distance for item in judgement.costs}
    found = []
    for cause in model.causes:
        name = f"{cause.effect} ({cause.form})"
        distance = costs.get(id(cause))
        if distance is None:
            found.append(f"{name}: {cause.how}")
            continue
        way = "not in the file" if cause.way == LEFT else "fitted"
        cost = f"without it up to {distance.largest_mm:.3g} mm {distance.loops}"
        found.append(f"{name}: {way}, {cause.how}; {cost}")
    return found


def _said(item: Distance, length_mm: float) -> str:
    if not np.isfinite(item.largest_mm):
        return "it diverges"
    percent = 100.0 * item.largest_mm / length_mm
    return f"up to {item.largest_mm:.3g} mm ({percent:.2g} % of the length), tip {item.rms_mm:.2g} mm rms"


def json_of(model: ExportedModel, judgement: Judgement) -> dict[str, Any]:
    """Return the report as what JSON holds; distances in mm, None where a replay diverges.

    `cost_mm`: what a cause moves on the loops, None where it is in the file as it is.
    """
    costs = {id(item.cause): item.distance for item in judgement.costs}
    moving = () if judgement.moving is None else (judgement.moving,)
    return {
        "robot": model.robot.name,
        "engine": model.engine,
        "length_mm": judgement.length_mm,
        "percent_of_length": _number(judgement.percent),
        "against_catheter_sim": [_distance(item) for item in (*judgement.held, *moving)],
        "without_what_is_fitted": _distance(judgement.bare),
        "fitted_hinges": [law.joint for law in model.laws],
        "slides": [shift.slide for shift in model.shifts],
        "causes": [
            {
                "name": cause.effect,
                "form": cause.form,
                "values": dict(cause.values),
                "carried": cause.way != LEFT,
                "fitted": cause.way == FITTED,
                "how": cause.how,
                "cost_mm": _number(costs[id(cause)].largest_mm) if id(cause) in costs else None,
            }
            for cause in model.causes
        ],
        "controls": [
            {"actuator": item.actuator, "input": item.column, "share": item.share} for item in model.controls
        ],
    }


def _distance(item: Distance) -> dict[str, Any]:
    return {
        "loops": item.loops,
        "largest_mm": _number(item.largest_mm),
        "tip_rms_mm": _number(item.rms_mm),
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
