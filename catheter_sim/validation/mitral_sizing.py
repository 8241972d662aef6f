"""Actuator sizing and preconditioning of the catheter of Nayar 2023, which the paper names and does not
print."""

from __future__ import annotations

import math
from pathlib import Path

from catheter_sim.controllers.lead_screw import ADVANCE_GEAR, BENDING_GEAR, LeadScrew
from catheter_sim.robots.catheter.measured import PRINTED, need, repeats_m, stretching_joints
from catheter_sim.robots.catheter.published import mitral_4dof
from catheter_sim.validation.lines import ASSUMED, READ_BACK, Line, Validation

NAME = "mitral_4dof"
BEND_DEG_PER_S = 30.0  # of a joint, at which its motor is sized; assumed
_LAWS = "Nayar 2023, Algorithms 1 and 2; the paper names the use and prints no figure"
_SCREW = "Nayar 2023, Section II-B: gears of 64 and 100 to 1; screw of 2 mm lead, friction 0.2 assumed"


def validate_sizing(folder: Path) -> Validation:
    """Show what the drives must give; nothing is written."""
    lines: list[Line] = []
    screw = LeadScrew(BENDING_GEAR)
    for name, joint in stretching_joints(mitral_4dof()).items():
        limit = math.degrees(joint.segment.limit_rad)
        found = need(joint, limit)
        where = f"{name} to {limit:g} deg"
        lines += [
            _shown(f"{where}: largest tension, and preconditioning's", "N", found.tension_N),
            _shown(f"{where}: displacement, tendons that do not stretch", "mm", found.pure_m * 1e3),
            _shown(f"{where}: displacement, new tendon", "mm", found.new_m * 1e3),
            _shown(f"{where}: displacement, preconditioned tendon", "mm", found.ready_m * 1e3),
        ]
        new, ready = (abs(repeats_m(joint, limit, PRINTED, item)) * 1e3 for item in (False, True))
        what = (
            f"{where}: displacement halfway, change from the first bend to the second, preconditioned over "
            "new"
        )
        lines += [
            _shown(what, "-", ready / new, kind=READ_BACK),
            _shown(f"{where}: motor's torque", "mN m", screw.torque_Nm(found.tension_N) * 1e3, _SCREW),
        ]
        speed = found.ready_m / limit * BEND_DEG_PER_S
        lines += [
            _shown(
                f"{where}: motor's speed at {BEND_DEG_PER_S:g} deg/s", "rpm", screw.speed_rpm(speed), _SCREW
            ),
        ]
    tube = LeadScrew(ADVANCE_GEAR)
    lines.append(_shown("advance by 1 mm/s: motor's speed", "rpm", tube.speed_rpm(1e-3), _SCREW))
    lines.append(
        _shown("bending drives: way of a holder a count of the encoder", "um", screw.step_m * 1e6, _SCREW)
    )
    return Validation(tuple(lines), (_finding(screw),))


def _shown(what: str, unit: str, ours: float, source: str = _LAWS, kind: str = ASSUMED) -> Line:
    return Line(NAME, what, unit, math.nan, None, source, ours=ours, kind=kind)


def _finding(screw: LeadScrew) -> str:
    locks = (
        "locks itself, so that a tendon's tension moves no motor" if screw.locks_itself else "does not lock"
    )
    return (
        f"{NAME}: a screw of {screw.lead_m * 1e3:g} mm lead on {screw.diameter_m * 1e3:g} mm {locks}: the "
        "control "
        "runs have their displacements exactly, and a motor's lag is of the catheter of 2022 alone."
    )
