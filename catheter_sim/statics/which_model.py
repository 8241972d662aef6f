"""Which static model keeps a tolerance on a robot: every model is solved on that robot and compared.

The modelling benchmark gives its advice for one robot (Rao et al. 2021, Fig. 12). What a model neglects
grows with the length of a subsegment, the load and the softness, so that the advice is made anew here, for
the robot and the loads that it is asked about.
"""

from __future__ import annotations

import itertools
import math
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.channels import Inputs, slice_inputs
from catheter_sim.robots.posture import Array, Posture
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.statics.models import STATIC_MODELS
from catheter_sim.statics.tdcr.cc import bend_per_tension
from catheter_sim.statics.tdcr.problem import problem

CANDIDATES = ("CC", "CC_sub", "PRB", "PRB_middle", "VC", "VC_ref", "VC_ref_noproj")
REFERENCES = ("VC_ref", "VC_ref_noproj", "VC")
_MOST_SETS = 64  # of tensions, when none are given
_REPEATS = 3  # of each row, for its time


@dataclass(frozen=True)
class ModelError:
    """What one model does on a robot.

    Attributes:
        model: its name.
        position_percent: largest distance of the tip from the reference's, over the rows [% of length].
        mean_percent: its mean over the rows.
        orientation_deg: largest angle between both tips' frames [deg].
        ms: median time of a row solved by itself [ms].
        failed: numbers of the rows, from 0, that it did not solve; none where it is usable.
    """

    model: str
    position_percent: float
    mean_percent: float
    orientation_deg: float
    ms: float
    failed: tuple[int, ...]


@dataclass(frozen=True)
class ModelChoice:
    """The answer of `which_model`.

    Attributes:
        model: the fastest model within the tolerance; the reference's own name where no other is.
        reference: with what all were compared.
        errors: of all models, the fastest first.
    """

    model: str
    reference: str
    errors: tuple[ModelError, ...]


def which_model(
    robot: ContinuumRobot,
    tolerance_percent: float,
    inputs: Inputs | None = None,
    gravity_mps2: ArrayLike = (0.0, 0.0, 0.0),
    tolerance_deg: float = math.inf,
    reference: str = "VC_ref_noproj",
) -> ModelChoice:
    """Return the fastest static model whose tip stays within a tolerance of the reference's.

    Args:
        robot: any robot that the rod models carry.
        tolerance_percent: largest allowed distance of the tip [% of the robot's length].
        inputs: the loads to compare on; default: `pulled_sets`.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        tolerance_deg: largest allowed angle between the tips' frames [deg].
        reference: "VC_ref_noproj" (tendons straight between eyelets), "VC_ref" (Eq. 58), or "VC"
            (tendons in lumens).

    Raises:
        InputError: a tolerance is not above zero, the reference is unknown, or it does not solve the
            robot under these inputs.
    """
    if not (tolerance_percent > 0.0 and tolerance_deg > 0.0):
        raise InputError(
            f"{robot.name}: tolerance {tolerance_percent:g} % and {tolerance_deg:g} deg: must be above zero"
        )
    if reference not in REFERENCES:
        raise unknown("reference model", reference, REFERENCES)
    rows = pulled_sets(robot) if inputs is None else inputs
    gravity = np.asarray(gravity_mps2, dtype=float)
    exact = STATIC_MODELS[reference].solve(robot, rows, gravity).postures
    length = sum(segment.length_m for segment in robot.segments)
    found = [_error(model, robot, rows, gravity, exact, length) for model in CANDIDATES]
    found.sort(key=lambda item: item.ms)
    within = [
        item
        for item in found
        if not item.failed
        and item.position_percent <= tolerance_percent
        and item.orientation_deg <= tolerance_deg
    ]
    return ModelChoice(within[0].model, reference, tuple(found))


def pulled_sets(robot: ContinuumRobot, turn_rad: float = 0.5 * math.pi) -> Inputs:
    """Return sets of tensions, each 0 or one same tension, in every combination of tendons.

    The tension is that which turns the tip by `turn_rad` at most if all tendons that help pull (Rao
    2021, Eq. 55, for any robot). Of more than six tendons, sixty-four sets drawn at random.

    Args:
        robot: any robot that the rod models carry.
        turn_rad: of the tip [rad].
    """
    rod = problem(robot)
    turns = bend_per_tension(rod)[:, :, :2].sum(axis=1)  # of the tip, per tension, (t, 2)
    angles = np.linspace(0.0, 2.0 * math.pi, 72, endpoint=False)
    toward = turns @ np.stack([np.cos(angles), np.sin(angles)])
    tension = turn_rad / np.maximum(toward, 0.0).sum(axis=0).max()
    tendons = len(robot.tendons)
    if 2**tendons <= _MOST_SETS:
        pulled = np.array(list(itertools.product((0.0, 1.0), repeat=tendons)))
    else:
        pulled = np.random.default_rng(0).integers(0, 2, (_MOST_SETS, tendons)).astype(float)
    nothing = np.zeros((len(pulled), 3))
    return Inputs(np.arange(len(pulled), dtype=float), "tension", tension * pulled, nothing, nothing)


def _error(
    model: str, robot: ContinuumRobot, rows: Inputs, gravity: Array, exact: Sequence[Posture], length_m: float
) -> ModelError:
    solve = STATIC_MODELS[model].solve
    away: list[float] = []
    turned: list[float] = []
    spent: list[float] = []
    failed: list[int] = []
    for row, right in enumerate(exact):
        one = slice_inputs(rows, slice(row, row + 1))
        try:
            if not spent:
                solve(robot, one, gravity)  # what is compiled at the first call is no part of the time
            taken = []
            for _ in range(_REPEATS):
                began = time.perf_counter()
                posture = solve(robot, one, gravity).postures[0]
                taken.append(time.perf_counter() - began)
        except InputError:
            failed.append(row)
            continue
        spent.append(min(taken))
        away.append(float(np.linalg.norm(posture.p_w[-1] - right.p_w[-1])))
        cosine = 0.5 * (float(np.trace(posture.R_w[-1] @ right.R_w[-1].T)) - 1.0)
        turned.append(math.degrees(math.acos(min(1.0, max(-1.0, cosine)))))
    if not spent:
        return ModelError(model, math.nan, math.nan, math.nan, math.inf, tuple(failed))
    return ModelError(
        model,
        100.0 * max(away) / length_m,
        100.0 * statistics.fmean(away) / length_m,
        max(turned),
        1e3 * statistics.median(spent),
        tuple(failed),
    )
