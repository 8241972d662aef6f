"""Check of the transseptal procedure (Nayar 2022, Section IV-E) in random anatomies."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from catheter_sim.procedure.operate import ANGLE_DEG, POSITION_MM
from catheter_sim.procedure.series import Attempt, run_series
from catheter_sim.robots.catheter.published import mitral_transseptal
from catheter_sim.validation.lines import Line, Validation

ANATOMIES, SEED = 10, 0
_SOURCE = "target under the leaflets; requirement: in 95 of 100 anatomies"


def validate_procedure(folder: Path) -> Validation:
    """Check the nominal robot, driven open loop; nothing is written."""
    robot = mitral_transseptal()
    attempts = run_series(robot, ANATOMIES, SEED)
    where = f"procedure in {ANATOMIES} random anatomies (seed {SEED})"
    lines = (
        Line(robot.name, f"{where}: implant's position, largest", "mm", *_worst(attempts, 0), _SOURCE),
        Line(robot.name, f"{where}: implant's angle, largest", "deg", *_worst(attempts, 1), _SOURCE),
        Line(robot.name, f"{where}: wall's force, peak", "N", _worst(attempts, 2)[0], None, "for safety"),
    )
    return Validation(lines, (_finding(attempts),))


def _worst(attempts: list[Attempt], which: int) -> tuple[float, float]:
    """Return the largest error, infinite where there is no outcome, and what is allowed."""
    ends = [item.outcome for item in attempts]
    values = [
        (end.position_error_mm, end.angle_error_deg, end.wall_peak_N)[which] if end else np.inf
        for end in ends
    ]
    return float(max(values)), (POSITION_MM, ANGLE_DEG, np.inf)[which]


def _finding(attempts: list[Attempt]) -> str:
    plans = [item.outcome.plan for item in attempts if item.outcome]
    held = sum(item.outcome.holds for item in attempts if item.outcome)
    if not plans:
        return "transseptal procedure: no outcome"
    bends = np.degrees([plan.q[1] for plan in plans])
    ways = 1e3 * np.array([plan.q[2] + plan.below_m for plan in plans])
    return (
        f"transseptal procedure: bends of {bends.min():.0f} to {bends.max():.0f} deg (paper: about 60), "
        f"advances of {ways.min():.0f} to {ways.max():.0f} mm (paper: 25 to 35); both leaflets held in "
        f"{held} of {len(attempts)} anatomies"
    )
