"""What one more sensor would tell: a further marker, angles of the joints, tensions of the tendons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import output_channels
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.next_experiment.alive import Alive
from catheter_sim.diagnosis.next_experiment.predictives import told_by
from catheter_sim.diagnosis.next_experiment.programmes import Programme
from catheter_sim.diagnosis.thresholds import MARKER_NOISE, SENSOR_WORTH
from catheter_sim.theory.predict import twin_for


@dataclass(frozen=True)
class Sensor:
    """Something more to measure.

    Attributes:
        words: what it is.
        columns: the output columns that it gives.
        nats: information of the best programme with it.
    """

    words: str
    columns: tuple[str, ...]
    nats: float


def sizes_of(columns: Sequence[str], noise: Mapping[str, float]) -> Array:
    """Return the noise of each column, shape (o,), in its unit; of one that is not measured, a usual one."""
    units = [unit_of(name) for name in columns]
    return np.array([noise.get(unit) or MARKER_NOISE.get(unit, 1.0) for unit in units])


def further_sensors(
    problem: Problem,
    hypotheses: Sequence[Alive],
    programme: Programme,
    noise: Mapping[str, float],
    gravity_mps2: Array,
    before: float,
) -> tuple[Sensor, ...]:
    """Return the sensors that would tell more with a programme, most first."""
    found = []
    for words, columns in _sensors(problem).items():
        extended = _measuring(problem, (*problem.columns, *columns), gravity_mps2)
        size = sizes_of(extended.columns, noise)
        told = told_by(extended, hypotheses, programme, size)
        if told is not None and told.nats > before + SENSOR_WORTH:
            found.append(Sensor(words, columns, told.nats))
    return tuple(sorted(found, key=lambda item: -item.nats))


def _sensors(problem: Problem) -> dict[str, tuple[str, ...]]:
    """Return what may be measured besides, in words, with its columns."""
    known = output_channels(problem.robot)
    axes = sorted({name[-4] for name in problem.columns if name.startswith("tip_") and name.endswith("_mm")})
    bodies = max((int(name.split("_")[1]) for name in known if name.startswith("body_")), default=0)
    found = {}
    for place, share in (("a third of", 1 / 3), ("half", 1 / 2), ("two thirds of", 2 / 3)):
        body = max(1, round(share * bodies))
        columns = tuple(f"body_{body}_{axis}_mm" for axis in axes or "xyz")
        if bodies and not set(columns) & set(problem.columns):
            found[f"one more marker at body {body}, {place} the robot's length from its base"] = columns
    angles = tuple(name for name in known if name.startswith("angle_"))
    if angles and not set(angles) & set(problem.columns):
        found["an angle sensor at the joints"] = angles
    tensions = tuple(name for name in known if name.startswith("tension_"))
    if tensions and not set(tensions) & {*problem.columns}:
        found["a tension sensor at each tendon"] = tensions
    return found


def _measuring(problem: Problem, columns: tuple[str, ...], gravity_mps2: Array) -> Problem:
    """Return the problem with further outputs, which no trial so far has measured."""
    actuation = problem.trials[0].inputs.actuation
    twin = twin_for(problem.robot, actuation, columns, gravity_mps2)
    added = len(columns) - len(problem.columns)
    return replace(problem, columns=columns, weight=np.append(problem.weight, np.ones(added)), twin=twin)
