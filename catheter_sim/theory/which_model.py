"""Which static model keeps a tolerance on a robot: every model is solved on that robot and compared.

The modelling benchmark gives its advice for one robot (Rao et al. 2021, Fig. 12). What a model neglects
grows with the length of a subsegment, the load and the softness, so that the advice is made here, for the
robot and the loads that it is asked about.

A clock is noisy: each model's time is the median of several rounds in which all models take turns, and models
within `TIED` of the fastest count as equally fast. What is timed are the solvers alone (a kind's face
`solvers`), row by row, where all models have one. What Python makes of inputs and answers is alike for all,
and would put models that differ a hundredfold side by side, where an answer hangs on the noise. Of these the
most accurate is chosen, and of equally accurate ones the simplest, the first in `CANDIDATES`.
"""

from __future__ import annotations

import itertools
import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import built_in
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots import kind_of
from catheter_sim.robots.continuum.cc import bend_per_tension
from catheter_sim.robots.continuum.rods import problem
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.theory.static_models import STATIC_MODELS

CANDIDATES = ("CC", "CC_sub", "PRB", "PRB_middle", "VC", "VC_ref", "VC_ref_noproj")  # the simplest first
REFERENCES = ("VC_ref", "VC_ref_noproj", "VC")
_MOST_SETS = 64  # of tensions, when none are given
TIED = 1.5  # times the fastest model's time: what is within is as fast
_ROUNDS = 7  # of timing, in each of which every model solves all rows once


@dataclass(frozen=True)
class ModelError:
    """What one model does on a robot.

    Attributes:
        model: its name.
        position_percent: largest distance of the tip from the reference's, over the rows [% of length].
        mean_percent: its mean over the rows.
        orientation_deg: largest angle between both tips' frames [deg].
        ms: a row's share of the time of all rows that the model solves, the median of several rounds [ms].
        failed: numbers of the rows, from 0, that it did not solve; none where it is usable.
        why: what it does not know of the robot or its inputs, where it refused all rows; "" otherwise.
    """

    model: str
    position_percent: float
    mean_percent: float
    orientation_deg: float
    ms: float
    failed: tuple[int, ...]
    why: str = ""


@dataclass(frozen=True)
class ChosenModel:
    """The answer of `which_model`.

    Attributes:
        model: of the fastest models within the tolerance (`TIED`) the most accurate; the reference's own
            name where no other is within it.
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
    clock: Callable[[], float] = time.process_time,
) -> ChosenModel:
    """Return the fastest static model whose tip stays within a tolerance of the reference's.

    Args:
        robot: any robot that the rod models carry; such of its `effects` as act on it are built in.
        tolerance_percent: largest allowed distance of the tip [% of the robot's length].
        inputs: the loads to compare on; default: `pulled_sets`.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        tolerance_deg: largest allowed angle between the tips' frames [deg].
        reference: "VC_ref_noproj" (tendons straight between eyelets), "VC_ref" (Eq. 58), or "VC"
            (tendons in lumens).
        clock: read before and after each solve [s]; default: the processor's time, which other programs
            disturb less than the wall's.

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
    robot = built_in(robot)
    rows = pulled_sets(robot) if inputs is None else inputs
    gravity = np.asarray(gravity_mps2, dtype=float)
    exact = STATIC_MODELS[reference].law(robot, rows, gravity).postures
    length = sum(segment.length_m for segment in robot.segments)
    away = {model: _away(model, robot, rows, gravity, exact) for model in CANDIDATES}
    solved = {model: [row for row, found in enumerate(away[model]) if found] for model in CANDIDATES}
    calls = solver_calls(robot, rows, gravity, solved) or {
        model: _solves(model, robot, rows, kept, gravity) for model, kept in solved.items() if kept
    }
    spent = interleaved_s(calls, clock)
    found = [
        model_error(
            model, away[model], length, 1e3 * spent[model] / len(solved[model]) if solved[model] else math.inf
        )
        for model in CANDIDATES
    ]
    return chosen(found, reference, tolerance_percent, tolerance_deg)


def chosen(
    found: Sequence[ModelError], reference: str, tolerance_percent: float, tolerance_deg: float
) -> ChosenModel:
    """Return the answer of models that are found, in the order that decides between equally good ones."""
    within = accurate(found, tolerance_percent, tolerance_deg)
    best = best_of(within, [item.model for item in found]).model if within else reference
    return ChosenModel(best, reference, tuple(sorted(found, key=lambda item: item.ms)))


def accurate(found: Sequence[ModelError], tolerance_percent: float, tolerance_deg: float) -> list[ModelError]:
    """Return the models that solve every row within the tolerances."""
    return [
        item
        for item in found
        if not item.failed
        and item.position_percent <= tolerance_percent
        and item.orientation_deg <= tolerance_deg
    ]


def apart(posture: Posture, right: Posture) -> tuple[float, float]:
    """Return the distance of the tip from another's [m], and the angle between both tips' frames [rad]."""
    cosine = 0.5 * (float(np.trace(posture.R_w[-1] @ right.R_w[-1].T)) - 1.0)
    return float(np.linalg.norm(posture.p_w[-1] - right.p_w[-1])), math.acos(min(1.0, max(-1.0, cosine)))


def best_of(within: Sequence[ModelError], order: Sequence[str] = CANDIDATES) -> ModelError:
    """Return of the fastest models, within `TIED`, the most accurate, then the first in `order`."""
    fast = TIED * min(item.ms for item in within)
    tied = [item for item in within if item.ms <= fast]
    return min(tied, key=lambda item: (item.position_percent, order.index(item.model)))


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


def _away(
    model: str, robot: ContinuumRobot, rows: Inputs, gravity: Array, exact: Sequence[Posture]
) -> list[tuple[float, float] | None]:
    """Return each row's distance [m] and angle [rad] from the reference; None where it is not solved."""
    result: list[tuple[float, float] | None] = []
    for row, right in enumerate(exact):
        try:
            posture = STATIC_MODELS[model].law(robot, _rows(rows, [row]), gravity).postures[0]
        except InputError:
            result.append(None)
            continue
        result.append(apart(posture, right))
    return result


def _rows(inputs: Inputs, rows: Sequence[int]) -> Inputs:
    """Return some rows, a second apart."""
    chosen = list(rows)
    return Inputs(
        np.arange(len(chosen), dtype=float),
        inputs.actuation,
        inputs.tendon[chosen],
        inputs.force_tip[chosen],
        inputs.moment_tip[chosen],
    )


def solver_calls(
    robot: RobotSpec, inputs: Inputs, gravity: Array, solved: Mapping[str, Sequence[int]]
) -> dict[str, Callable[[], object]] | None:
    """Return what solves each model's rows one by one, solvers alone; None where a model has no such solver.

    Each has been called once: what is compiled at the first call is no part of a time.

    Args:
        robot: with its effects built in.
        inputs: rows.
        gravity: in the base frame, shape (3,) [m/s^2].
        solved: numbers of the rows that each model solves.
    """
    kind = kind_of(robot)
    if not kind.has("solvers"):
        return None
    face = kind.face("solvers", "solvers")
    calls: dict[str, Callable[[], object]] = {}
    for model, kept in solved.items():
        found = [face.solver_call(model, robot, _rows(inputs, [row]), gravity) for row in kept]
        solvers = [item for item in found if item is not None]
        if len(solvers) < len(kept):
            return None
        if solvers:
            calls[model] = partial(_each, solvers)
            _each(solvers)
    return calls


def _each(calls: Sequence[Callable[[], object]]) -> None:
    for call in calls:
        call()


def _solves(
    model: str, robot: ContinuumRobot, inputs: Inputs, rows: Sequence[int], gravity: Array
) -> Callable[[], object]:
    """Return what solves some rows at once, or one by one where friction's history gets no balance of them.

    It has been called once: what is compiled at the first call is no part of a time.
    """
    law = STATIC_MODELS[model].law
    together = _rows(inputs, rows)
    try:
        law(robot, together, gravity)
    except InputError:
        alone = [_rows(inputs, [row]) for row in rows]
        return lambda: [law(robot, one, gravity) for one in alone]
    return lambda: law(robot, together, gravity)


def interleaved_s(
    calls: Mapping[str, Callable[[], object]], clock: Callable[[], float], rounds: int = _ROUNDS
) -> dict[str, float]:
    """Return the median time of each call over rounds in which all take turns [s]."""
    spent: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            began = clock()
            call()
            spent[name].append(clock() - began)
    return {name: statistics.median(times) for name, times in spent.items()}


def model_error(
    model: str, away: Sequence[tuple[float, float] | None], length_m: float, ms: float, why: str = ""
) -> ModelError:
    """Return what a model does, from each row's distance [m] and angle [rad]; None: a row not solved."""
    found = [item for item in away if item is not None]
    failed = tuple(row for row, item in enumerate(away) if item is None)
    if not found:
        return ModelError(model, math.nan, math.nan, math.nan, math.inf, failed, why)
    distances = [distance for distance, _ in found]
    return ModelError(
        model,
        100.0 * max(distances) / length_m,
        100.0 * statistics.fmean(distances) / length_m,
        math.degrees(max(turned for _, turned in found)),
        ms,
        failed,
        why,
    )
