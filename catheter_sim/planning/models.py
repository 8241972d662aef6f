"""Which static model is accurate enough along a file of inputs, and fastest: any robot, history included.

`theory.which_model` answers for rods, each set of tensions from rest. Here rows follow one another, as in
the file, so that friction's history counts; the reference is the simulation, or a static model.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture, finite_rows
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.robots import kind_of
from catheter_sim.simulation.replay import simulate
from catheter_sim.theory.run import STATIC_MODELS
from catheter_sim.theory.which_model import (
    ModelChoice,
    ModelError,
    accurate,
    apart,
    best_of,
    interleaved_s,
    model_error,
    solver_calls,
)

SIMULATION = "simulation"
_LONGEST_S = 20.0  # of timing, all models together


def applying(robot: RobotSpec) -> list[str]:
    """Return the static models that know `robot`, its effects included, in the order of lists."""
    return [name for name, model in STATIC_MODELS.items() if model.applies_to(robot)]


def compare_models(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Array,
    tolerance_percent: float,
    tolerance_deg: float = math.inf,
    reference: str = SIMULATION,
    clock: Callable[[], float] = time.process_time,
    progress: bool = False,
) -> ModelChoice:
    """Return the fastest static model whose tip stays within a tolerance of the reference's, row after row.

    Args:
        robot: as it is specified, effects named.
        inputs: as commanded; their rows make the history.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        tolerance_percent: largest allowed distance of the tip [% of the robot's length].
        tolerance_deg: largest allowed angle between the tips' frames [deg].
        reference: "simulation", or a static model that knows the robot.
        clock: read before and after each solve [s].
        progress: show on standard error how far the simulation is.

    Raises:
        InputError: a tolerance is not above zero, or the reference is unknown or does not solve the rows.
        SimulationDiverged: the simulation did.
    """
    if not (tolerance_percent > 0.0 and tolerance_deg > 0.0):
        raise InputError(f"tolerance {tolerance_percent:g} % and {tolerance_deg:g} deg: must be above zero")
    names = applying(robot)
    if reference != SIMULATION and reference not in names:
        raise unknown("reference", reference, [SIMULATION, *names], robot.name)
    exact = _reference(robot, inputs, gravity_mps2, reference, progress)
    length_m = kind_of(robot).model.length_m(robot)
    away: dict[str, list[tuple[float, float] | None]] = {}
    why: dict[str, str] = {}
    spent_once = 0.0
    for name in names:
        began = clock()
        try:
            away[name] = _away(name, robot, inputs, gravity_mps2, exact)
        except InputError as error:
            away[name], why[name] = [None] * len(inputs), str(error)
        spent_once += clock() - began
    whole = {name: range(len(inputs)) for name in names if None not in away[name]}
    calls = solver_calls(robot, inputs, gravity_mps2, whole) or {
        name: partial(STATIC_MODELS[name].solve, robot, inputs, gravity_mps2) for name in whole
    }
    rounds = int(np.clip(_LONGEST_S / max(spent_once, 1e-9), 1, 7))
    spent = interleaved_s(calls, clock, rounds)
    found: list[ModelError] = [
        replace(
            model_error(
                name, away[name], length_m, 1e3 * spent[name] / len(inputs) if name in spent else math.inf
            ),
            why=why.get(name, ""),
        )
        for name in names
    ]
    within = accurate(found, tolerance_percent, tolerance_deg)
    found.sort(key=lambda item: item.ms)
    return ModelChoice(best_of(within, names).model if within else reference, reference, tuple(found))


def _reference(
    robot: RobotSpec, inputs: Inputs, gravity: Array, reference: str, progress: bool
) -> Sequence[Posture]:
    if reference != SIMULATION:
        return STATIC_MODELS[reference].solve(robot, inputs, gravity).postures
    run = simulate(robot, inputs, gravity, progress=progress)
    if run.failure is not None:
        raise SimulationDiverged(run.failure)
    return run.postures


def _away(
    model: str, robot: RobotSpec, inputs: Inputs, gravity: Array, exact: Sequence[Posture]
) -> list[tuple[float, float] | None]:
    """Return each row's distance [m] and angle [rad] from the reference; None where it is not solved.

    Raises:
        InputError: the model does not know the robot or its inputs.
    """
    postures = STATIC_MODELS[model].solve(robot, inputs, gravity).postures
    good = finite_rows(postures)
    return [apart(postures[row], right) if row < good else None for row, right in enumerate(exact)]
