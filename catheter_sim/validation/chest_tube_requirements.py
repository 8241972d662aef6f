"""Table I of chest_tube_2025 (doi 10.1109/LRA.2025.3597860): what is asked for, and what the robot gives.

Every figure is computed from the robot: its layout, the complete statics under one rod's pull, and
the simulation where a force acts. Unmet wishes are said, not failed: they are no errors of a model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from catheter_sim.robots.rolling import description as layout
from catheter_sim.robots.rolling.complete import complete
from catheter_sim.robots.rolling.published import chest_tube, chest_tube_section
from catheter_sim.robots.rolling.spec import Rod, RollingRobot
from catheter_sim.tables import replaced_when_whole
from catheter_sim.validation.chest_tube_bends import (
    MOST_TENSION_N,
    Bend,
    bending_planes,
    segment_bend,
    simulated_bend_deg,
)
from catheter_sim.validation.chest_tube_payload import HELD_SHARE, PAYLOAD_N, Pushed, pushed
from catheter_sim.validation.drives import NO_GRAVITY, given, tips_mm
from catheter_sim.validation.lines import Line, Validation

LENGTH_MM, OUTER_DIAMETER_MM, LUMEN_MM, RADIUS_MM = 375.0, 6.2, 3.0, 20.0
LEAST_TENSION_N = 10.0
_SMALL_FORCE_N = 1e-3  # for the compliance
# Segment and bending plane -> its name in Table I, the bend asked for [deg], essential or desirable.
_BENDS = {
    ("section", 0): (("Base", 90.0, "E"), ("Base", 180.0, "D")),
    ("base", 0): (("Base", 90.0, "E"), ("Base", 180.0, "D")),
    ("middle", 0): (("Mid", 90.0, "D"),),
    ("tip", 0): (("Tip X", 90.0, "E"),),
    ("tip", 1): (("Tip Y", 90.0, "D"),),
}


@dataclass(frozen=True)
class Requirement:
    """One line of Table I.

    Attributes:
        name: as the paper has it.
        wished: the value asked for.
        essential: whether the paper calls it essential; otherwise desirable.
        found: what the model or the simulation gives, in words and numbers.
        met: None where the model has no answer.
    """

    name: str
    wished: str
    essential: bool
    found: str
    met: bool | None


def requirements_table(robot: RollingRobot) -> tuple[Requirement, ...]:
    """Return Table I for `robot`, without weight.

    Args:
        robot: `chest_tube`, `chest_tube_section`, or one with the same segments.

    Raises:
        InputError: no posture balances a rod's pull.
    """
    bends = [segment_bend(robot, segment, axis) for segment, axis in bending_planes(robot)]
    base = bends[0]
    upright = base.tension_N(90.0)
    if not math.isfinite(upright):
        upright = MOST_TENSION_N
    table = [*_sizes(robot), _freedom(bends)]
    for bend in bends:
        table += [_range(robot, bend, *wish) for wish in _BENDS[(bend.segment, bend.axis)]]
    table += [_curvature(bends), _tension(bends)]
    table += _payload(robot, upright, pushed(robot, robot.tendons[base.rods[0]], upright))
    table.append(_compliance(robot, base.rods[0], upright))
    table.append(
        Requirement("Sterilizable/Disposable", "-", True, "a question of material: not modelled", None)
    )
    return tuple(table)


def table_markdown(title: str, table: Sequence[Requirement]) -> str:
    """Return the table as Markdown text."""
    rows = [f"# {title}", "", "| Requirement | Wished | E/D | Model and simulation | Met? |"]
    rows.append("|---|---|---|---|---|")
    for item in table:
        kind = "E" if item.essential else "D"
        rows.append(f"| {item.name} | {item.wished} | {kind} | {item.found} | {_verdict(item)} |")
    return "\n".join(rows) + "\n"


def validate_section_requirements(folder: Path) -> Validation:
    """Write Table I for the measured section into `folder`."""
    return _validate(chest_tube_section(), folder)


def validate_full_requirements(folder: Path) -> Validation:
    """Write Table I for the full robot into `folder`."""
    return _validate(chest_tube(), folder)


def _validate(robot: RollingRobot, folder: Path) -> Validation:
    table = requirements_table(robot)
    title = f"Table I of chest_tube_2025 for {robot.name}, without weight and outer tube"
    with replaced_when_whole(folder / f"table_1_{robot.name}.md") as file:
        file.write(table_markdown(title, table))
    met, unmet = ([item for item in table if item.met is wanted] for wanted in (True, False))
    text = (
        f"Table I for {robot.name} (table_1_{robot.name}.md). Met: "
        f"{'; '.join(f'{item.name} {item.wished}' for item in met)}. Not met: "
        f"{'; '.join(f'{item.name} {item.wished} ({item.found})' for item in unmet)}."
    )
    return Validation((_base_line(robot),), (text,))


def _base_line(robot: RollingRobot) -> Line:
    """Show what the paper reports of its prototype: the base reaches 90 deg within 10 to 100 N.

    Not judged: no robot that is wrong by a fifth leaves so wide a range (`scripts/perturb_validation.py`).
    """
    segment, axis = bending_planes(robot)[0]
    tension = segment_bend(robot, segment, axis).tension_N(90.0)
    return Line(
        robot.name,
        "base bent by 90 deg by either of its rods alone: tension; error: outside 10 to 100 N",
        "N",
        max(LEAST_TENSION_N - tension, tension - MOST_TENSION_N, 0.0) if math.isfinite(tension) else math.nan,
        None,
        "chest_tube_2025, Table I and Section IV-B; a range that a robot wrong by 20 % does not leave",
        ours=tension,
    )


def _verdict(item: Requirement) -> str:
    return {True: "yes", False: "no", None: "-"}[item.met]


def _sizes(robot: RollingRobot) -> list[Requirement]:
    length = sum(segment.length_m for segment in robot.segments) * 1e3
    outer = 2e3 * max(segment.outer_radius_m for segment in robot.segments)
    inner = 2e3 * robot.channel_radius_m
    free = 2e3 * min(_free_radius(robot, rod) for rod in layout.rods(robot))
    whole = "" if len(robot.segments) > 1 else "; the base section alone"
    return [
        Requirement(
            "Length", f"{LENGTH_MM:g} mm", True, f"{length:.1f} mm{whole}", length >= LENGTH_MM - 1e-6
        ),
        Requirement(
            "Outer diameter",
            f"{OUTER_DIAMETER_MM:g} mm",
            True,
            f"{outer:.2f} mm",
            outer <= OUTER_DIAMETER_MM + 1e-6,
        ),
        Requirement(
            "Inner diameter",
            f"{LUMEN_MM:g} mm",
            False,
            f"{inner:.2f} mm; the rod holes leave {free:.2f} mm, without a wall between",
            inner >= LUMEN_MM,
        ),
    ]


def _free_radius(robot: RollingRobot, rod: Rod) -> float:
    """Return the distance from the axis to the nearest edge of a rod's holes [m]."""
    hole = rod.rod_radius_m + robot.clearance_m
    return min(float(np.linalg.norm(layout.hole_position(rod, segment))) for segment in robot.segments) - hole


def _freedom(bends: Sequence[Bend]) -> Requirement:
    names = [_BENDS[(bend.segment, bend.axis)][0][0] for bend in bends]
    return Requirement(
        "Degrees of freedom",
        "2 (Base, Tip); desirable 4 (Base, Tip x2, Mid)",
        True,
        f"{len(names)} ({', '.join(names)})",
        {"Base", "Tip X"} <= set(names),
    )


def _range(robot: RollingRobot, bend: Bend, name: str, wished_deg: float, kind: str) -> Requirement:
    tension = bend.tension_N(wished_deg)
    if math.isfinite(tension):
        simulated = [simulated_bend_deg(robot, bend, index, tension) for index in bend.rods]
        found = f"at {tension:.1f} N; simulated there {' and '.join(f'{item:.1f}' for item in simulated)} deg"
    else:
        most = float(np.degrees(bend.angle[:, -1].min()))
        found = f"{most:.1f} deg at {MOST_TENSION_N:g} N; {np.degrees(bend.closed):.0f} deg with closed gaps"
    return Requirement(
        f"Bending range ({name})", f"{wished_deg:g} deg", kind == "E", found, math.isfinite(tension)
    )


def _curvature(bends: Sequence[Bend]) -> Requirement:
    closed = {_BENDS[(bend.segment, bend.axis)][0][0]: bend.length_mm / bend.closed for bend in bends}
    pulled = [bend.length_mm / float(bend.angle[:, -1].min()) for bend in bends]
    found = "; ".join(
        f"{name} {least:.1f} mm with closed gaps, {radius:.0f} mm at {MOST_TENSION_N:g} N"
        for (name, least), radius in zip(closed.items(), pulled, strict=True)
    )
    return Requirement("Max radius of curvature", f"{RADIUS_MM:g} mm", True, found, min(pulled) <= RADIUS_MM)


def _tension(bends: Sequence[Bend]) -> Requirement:
    at = {_BENDS[(bend.segment, bend.axis)][0][0]: bend.tension_N(90.0) for bend in bends}
    found = "90 deg: " + ", ".join(
        f"{name} {tension:.1f} N" if math.isfinite(tension) else f"{name} not within {MOST_TENSION_N:g} N"
        for name, tension in at.items()
    )
    essential = [tension for name, tension in at.items() if name in ("Base", "Tip X")]
    wished = f"{LEAST_TENSION_N:g} - {MOST_TENSION_N:g} N"
    met = all(LEAST_TENSION_N <= tension <= MOST_TENSION_N for tension in essential)
    return Requirement("Estimated Tension", wished, True, found, met)


def _payload(robot: RollingRobot, tension: float, answers: Sequence[Pushed]) -> list[Requirement]:
    """Return the payload by each meaning of "held": tensions, lengths, and the tip brought back."""
    allowed = HELD_SHARE * sum(segment.length_m for segment in robot.segments) * 1e3
    wished = f"> {PAYLOAD_N:g} N, tip within {allowed:.0f} mm"

    def line(name: str, parts: Sequence[str], moved: Sequence[float]) -> Requirement:
        found = "; ".join(f"{item.direction} {part}" for item, part in zip(answers, parts, strict=True))
        return Requirement(f"Payload at the tip, {name}", wished, True, found, max(moved) <= allowed)

    return [
        line(
            f"tensions held, base at {tension:.1f} N",
            [f"{item.yields_mm:.0f} mm ({allowed:.0f} mm at {item.carries_N:.3f} N)" for item in answers],
            [item.yields_mm for item in answers],
        ),
        line(
            "rods' lengths held",
            [f"{item.locked_mm:.0f} mm (up to {item.locked_N:.0f} N in a rod)" for item in answers],
            [item.locked_mm for item in answers],
        ),
        line(
            "one rod's tension raised",
            [f"{item.best_mm:.0f} mm ({item.rod} at {item.best_N:.0f} N)" for item in answers],
            [item.best_mm for item in answers],
        ),
    ]


def _compliance(robot: RollingRobot, rod: int, upright: float) -> Requirement:
    """Return how far a small force along x moves the tip, straight and with the base bent."""
    tension = np.zeros((1, len(robot.tendons)))
    found = []
    for name, pull in (("straight", 0.0), (f"base at {upright:.1f} N", upright)):
        tension[0, rod] = pull
        force = np.array([[_SMALL_FORCE_N, 0.0, 0.0]])
        tips = [
            tips_mm(complete(robot, given(tension, force_tip=share * force), NO_GRAVITY).postures)[0]
            for share in (0.0, 1.0)
        ]
        found.append(f"{name} {np.linalg.norm(tips[1] - tips[0]) / _SMALL_FORCE_N:.0f} mm/N")
    return Requirement("Compliance under load", "-", True, f"tip: {', '.join(found)}", None)
