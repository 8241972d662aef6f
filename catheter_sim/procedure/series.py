"""The procedure in many random anatomies: what happened in each, and the table of it."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from catheter_sim.errors import InputError
from catheter_sim.procedure.anatomy import Anatomy, random_anatomy
from catheter_sim.procedure.operate import ANGLE_DEG, POSITION_MM, Outcome, StepReport, operate
from catheter_sim.procedure.plan import plan
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.tables import replaced_when_whole

_COLUMNS = (
    "anatomy", "succeeded", "holds", "position_error_mm", "angle_error_deg", "wall_peak_N", "wall_peak_step",
    "wall_place_x_mm", "wall_place_y_mm", "wall_place_z_mm", "torsion_proximal_deg", "bend_deg",
    "advance_under_leaflets_mm", "torsion_distal_deg", "insertion_mm", "corrections", "failure",
)  # fmt: skip


@dataclass(frozen=True)
class Attempt:
    """One anatomy of a series.

    Attributes:
        number: of the anatomy in its series, from 0.
        anatomy: the anatomy.
        outcome: how it ended; None where it did not.
        failure: None, or the line that says why it did not.
    """

    number: int
    anatomy: Anatomy
    outcome: Outcome | None
    failure: str | None

    @property
    def succeeded(self) -> bool:
        """Whether the implant reached its target."""
        return self.outcome is not None and self.outcome.succeeded


def attempt(robot: CatheterRobot, known: CatheterRobot | None, seed: int, number: int) -> Attempt:
    """Plan and operate in anatomy `number` of the series `seed`; `known` as in `operate.operate`."""
    rng = np.random.default_rng([seed, number])
    anatomy = random_anatomy(rng)
    try:
        return Attempt(number, anatomy, operate(robot, plan(robot, anatomy), rng, known), None)
    except InputError as error:  # no plan, or a simulation that diverged
        return Attempt(number, anatomy, None, str(error))


def run_series(
    robot: CatheterRobot, count: int, seed: int, known: CatheterRobot | None = None, jobs: int = 1
) -> list[Attempt]:
    """Return the attempts of a series, in order; they do not depend on `jobs`, the number of processes."""
    one = partial(attempt, robot, known, seed)
    if jobs == 1:
        return [one(number) for number in range(count)]
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        return list(pool.map(one, range(count)))


def summary_text(robot: CatheterRobot, attempts: Sequence[Attempt]) -> str:
    """Return what a series came to, as lines of text."""
    done = [item.outcome for item in attempts if item.outcome is not None]
    good = sum(item.succeeded for item in attempts)
    lines = [
        f"{robot.name}: within {POSITION_MM:g} mm and {ANGLE_DEG:g} deg of the target in {good} of "
        f"{len(attempts)} anatomies; both leaflets held in {sum(end.holds for end in done)}"
    ]
    figures: dict[str, list[float]] = {
        "position error [mm]": [end.position_error_mm for end in done],
        "angle error [deg]": [end.angle_error_deg for end in done],
        "peak force on the atrium's wall [N]": [end.wall_peak_N for end in done],
        "corrections by the tracker": [float(sum(step.corrections for step in end.steps)) for end in done],
    }
    for name, values in figures.items():
        if values:
            lines.append(
                f"  {name}: median {np.median(values):.3g}, 95 % below {np.quantile(values, 0.95):.3g}, "
                f"largest {max(values):.3g}"
            )
    lines += [f"  anatomy {item.number}: {item.failure}" for item in attempts if item.failure]
    return "\n".join(lines)


def write_series(attempts: Sequence[Attempt], folder: Path) -> None:
    """Write `procedure.csv`, a row for each anatomy, and `procedure.json` with everything.

    Raises:
        InputError: the folder cannot be written.
    """
    with replaced_when_whole(folder / "procedure.csv") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_COLUMNS)
        writer.writerows(_row(item) for item in attempts)
    with replaced_when_whole(folder / "procedure.json") as file:
        json.dump([_document(item) for item in attempts], file, indent=1)
        file.write("\n")


def _row(item: Attempt) -> list[object]:
    end = item.outcome
    if end is None:
        return [item.number, False, False, *[""] * (len(_COLUMNS) - 4), item.failure]
    worst = max(end.steps, key=lambda step: step.wall_peak_N)
    q, below = end.plan.q, end.plan.below_m
    numbers = (
        end.position_error_mm,
        end.angle_error_deg,
        end.wall_peak_N,
    )
    joints = (*np.degrees(q[:2]), 1e3 * (q[2] + below), math.degrees(q[3]), 1e3 * end.plan.insertion_m)
    touched = end.wall_peak_N > 0.0
    return [
        item.number,
        end.succeeded,
        end.holds,
        *(f"{value:.4g}" for value in numbers),
        worst.name if touched else "",
        *(f"{value:.4g}" if touched else "" for value in worst.wall_place_mm),
        *(f"{value:.4g}" for value in joints),
        sum(step.corrections for step in end.steps),
        "",
    ]


def _document(item: Attempt) -> dict[str, object]:
    document: dict[str, object] = {"anatomy": item.number, "failure": item.failure, **asdict(item.anatomy)}
    end = item.outcome
    if end is not None:
        document["outcome"] = {
            "robot": end.robot,
            "succeeded": end.succeeded,
            "holds": end.holds,
            "position_error_mm": end.position_error_mm,
            "angle_error_deg": end.angle_error_deg,
            "arms_deg": list(end.arms_deg),
            "puncture_mm": (1e3 * end.plan.puncture).tolist(),
            "direction": end.plan.direction.tolist(),
            "steps": [_plain(step) for step in end.steps],
        }
    return document


def _plain(step: StepReport) -> dict[str, object]:
    """Return a step without NaN, which JSON does not have."""
    document = asdict(step)
    if math.isnan(step.wall_place_mm[0]):
        document["wall_place_mm"] = None
    return document
