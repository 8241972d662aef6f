"""Inputs within limits, and least squares that keep to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_inputs, drives_of
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.robots import face_of
from catheter_sim.units import si_factor

# ----------------------------------------------------------------------------------------------------
# Bounded least squares for a function that is slow, not quite smooth, and answers many questions at once.
#
# Levenberg and Marquardt's steps within bounds. The slopes are differences, taken once, then learned from
# every step (Broyden 1965), and taken again where a step does not help: of a robot that rubs they change
# where a tendon starts to slide.

Function = Callable[[Array], Array]  # points (B, d) to misses (B, m); NaN where there is none

_DIFFERENCES = (2e-3, 4e-2)  # of a coordinate for a slope; the longer one where the shorter moves nothing
_STUCK = 1e-3  # slope below which a coordinate moves nothing: tendons stick
_MOST_STEPS = 30
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 1e-9, 1e4
_AT_BOUND = 1e-6
_PULLS = 1e-3  # share of a coordinate's largest possible pull on the misses that holds it at a bound


@dataclass(frozen=True)
class BoundedFit:
    """A point, with its misses and slopes."""

    point: Array  # shape (d,)
    misses: Array  # there, shape (m,)
    slopes: Array  # of the misses, shape (m, d)

    @property
    def size(self) -> float:
        """Length of the misses."""
        return float(np.linalg.norm(self.misses))


def least_squares(
    function: Function,
    start: Array,
    least: Array,
    most: Array,
    enough: float,
    slopes: Array | None = None,
    steps: int = _MOST_STEPS,
) -> BoundedFit:
    """Return the point with the least misses that is found from `start`, shape (d,), with finite misses.

    It lies within `least` and `most`, shape (d,). The search ends at misses as short as `enough`, or after so
    many steps; `slopes` (m, d) are those at the start where they are known.
    """
    point = np.clip(start, least, most)
    misses = function(point[np.newaxis])[0]
    fresh = slopes is None
    known = differences(function, point, misses, least, most) if slopes is None else slopes
    damping, now = _FIRST_DAMPING, BoundedFit(point, misses, known)
    for _ in range(steps):
        if now.size <= enough:
            break
        step = _step(now, least, most, damping)
        there = now.point + step
        moved = float(np.abs(step).max(initial=0.0))
        found = function(there[np.newaxis])[0] if moved > 1e-9 else np.full_like(now.misses, np.nan)
        better = bool(np.isfinite(found).all()) and float(np.linalg.norm(found)) < now.size
        if np.isfinite(found).all():
            learned = now.slopes + np.outer(found - now.misses - now.slopes @ step, step) / (step @ step)
        else:
            learned = now.slopes
        if better:
            gained = 1.0 - float(np.linalg.norm(found)) / now.size
            now, fresh = BoundedFit(there, found, learned), False
            damping = max(damping / 10.0, _LEAST_DAMPING)
            if gained > 1e-4:
                continue
        if not fresh:  # the slopes may be stale: take them anew, once at each point
            now = BoundedFit(now.point, now.misses, differences(function, now.point, now.misses, least, most))
            fresh = True
            continue
        if better or damping >= _MOST_DAMPING or moved < 1e-7:
            break
        damping *= 30.0
    return now


def differences(function: Function, point: Array, misses: Array, least: Array, most: Array) -> Array:
    """Return the slopes of the misses at `point` by differences toward the farther bound, shape (m, d)."""
    toward = np.where(most - point >= point - least, 1.0, -1.0)
    slopes = np.zeros((len(misses), len(point)))
    stuck = np.arange(len(point))
    for length in _DIFFERENCES:
        step = toward * np.minimum(length, 0.5 * (most - least))
        there = function(point + np.diag(step)[stuck])
        found = (there - misses).T / step[stuck]
        slopes[:, stuck] = np.where(np.isfinite(found), found, 0.0)
        stuck = stuck[np.linalg.norm(slopes[:, stuck], axis=0) < _STUCK]
        if not len(stuck):
            break
    return slopes


def binding(found: BoundedFit, least: Array, most: Array) -> list[tuple[int, bool]]:
    """Return the coordinates that a bound keeps from lessening the misses, and whether it is the upper."""
    pull = -(found.slopes.T @ found.misses)
    strong = _PULLS * np.linalg.norm(found.slopes, axis=0) * found.size
    held = []
    for k in range(len(pull)):
        if found.point[k] >= most[k] - _AT_BOUND and pull[k] > strong[k]:
            held.append((k, True))
        elif found.point[k] <= least[k] + _AT_BOUND and pull[k] < -strong[k]:
            held.append((k, False))
    return held


def _step(now: BoundedFit, least: Array, most: Array, damping: float) -> Array:
    """Return the damped step within bounds, shape (d,); points at a bound may leave it."""
    size = np.sqrt(damping) * max(float(np.linalg.norm(now.slopes, axis=0).max()), 1e-12)
    matrix = np.vstack([now.slopes, size * np.eye(len(now.point))])
    wanted = np.concatenate([-now.misses, np.zeros(len(now.point))])
    room = np.minimum(least - now.point, -1e-12), np.maximum(most - now.point, 1e-12)
    step = lsq_linear(matrix, wanted, bounds=room, method="bvls").x
    return np.asarray(np.clip(now.point + step, least, most) - now.point)


# ----------------------------------------------------------------------------------------------------
# Inputs beyond what a robot can follow, said before they are simulated: its numbers mean nothing there.

_ROUNDING = 1e-6
_NAMED = 6  # columns that one line names


def beyond_limits(robot: RobotSpec, inputs: Inputs) -> str:
    """Return one line on the inputs that go beyond what the robot can follow, "" for none.

    It gives the first such row of the first such column, and names the other columns. A robot of which no
    limit is known gets "".
    """
    driven = replace(robot, actuation=inputs.actuation)
    try:
        limits = face_of(robot, "steering", "limit").input_limits(driven, inputs.actuation)
    except InputError:
        return ""
    values = channel_inputs(robot, inputs)
    above, below = values > limits.most * (1.0 + _ROUNDING), values < limits.least * (1.0 + _ROUNDING)
    drives = drives_of(robot, inputs.actuation)
    beyond = [column for column in range(len(drives)) if (above | below)[:, column].any()]
    if not beyond:
        return ""
    first, name = beyond[0], drives[beyond[0]].column
    row, unit = int((above | below)[:, first].argmax()), si_factor(name)
    value, end = values[row, first], (limits.most if above[row, first] else limits.least)[first]
    others = "".join(f", {drives[column].column}" for column in beyond[1:_NAMED])
    more = f" and {len(beyond) - _NAMED} more" if len(beyond) > _NAMED else ""
    return (
        f"{row_name(inputs, row)}: {name} = {value / unit:.4g} is beyond {end / unit:.4g}: {limits.why}"
        + (f"; beyond theirs, too: {others[2:]}{more}" if others else "")
    )
