"""Where the tracker stands: measured positions are moved into the robot's base frame before any fit.

A tracker has an origin and axes of its own, and its files may be in metres. Measured and computed positions
of the training trials are laid over one another by the rigid motion of least squares (Kabsch 1976; Umeyama
1991). A model that errs lays them over one another wrongly, so that this motion is not taken as it is:

- Turns. The base frame is wanted as it would be set up: the 24 turns that exchange axes are tried first, none
  before the others. One is taken where it takes most of the error (`TURN_CONVINCING`); what a tracker is
  turned beyond it, up to `SLIGHT_DEG`, is left to the cause `measurement_frame`. Only where a turn by any
  angle does as much better again is that one taken, and its three numbers are fitted with every hypothesis.
- Shifts. Where every point is off by more than that cause may be, the mean shift is taken out, and its
  numbers are fitted with every hypothesis, since an erring model shows the wrong mean.
- Metres: where the points' spread shows a factor of 1000.

So a tracker placed anywhere leaves the same answer as one that stands in the base frame, and one that is
slightly off is a cause, as ever. A mirror image is no motion of a tracker; `find_data_faults` names it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.base_frame.registration import SHIFTS, TURNS, Registration, not_registered
from catheter_sim.diagnosis.data.columns import QUATERNION, points_of
from catheter_sim.diagnosis.data.trials import Trial, measured_of
from catheter_sim.diagnosis.thresholds import (
    FEWEST_POINTS,
    FLAT_SHARE,
    LEAST_TURN_WEIGHT,
    METRES_LEFT_SHARE,
    METRES_SPREAD,
    ROUNDING_SHARE,
    SLIGHT_DEG,
    SLIGHT_SHIFT_MM,
    TURN_CONVINCING,
    TURN_EQUAL,
    TURN_LIKELIER,
    UNSHIFTED_SHARE,
)
from catheter_sim.theory.predict import Predict


def register(train: Sequence[Trial], columns: Sequence[str], robot: RobotSpec, twin: Predict) -> Registration:
    """Return the motion from the tracker's frame to the base's.

    Args:
        train: the training trials.
        columns: the data set's outputs.
        robot: as specified.
        twin: gives `columns`.
    """
    points = points_of(columns)
    axes = "".join(axis for axis in "xyz" if points and all(axis in found for found in points.values()))
    computed, measured = _pairs(train, columns, points, axes, robot, twin)
    if len(measured) < FEWEST_POINTS:
        return not_registered(axes)
    factor = _factor(computed, measured, axes)
    measured = factor * measured
    whole = set(QUATERNION) <= set(columns) or set(QUATERNION).isdisjoint(columns)
    best = _kabsch(computed, measured, axes)
    R_tb, free_turn = _turn(computed, measured, best, axes) if whole else (np.eye(3), False)
    extents = np.linalg.svd(computed - computed.mean(axis=0), compute_uv=False)
    apart = measured - computed @ R_tb.T
    shifted = _far(apart, axes)
    shift = apart.mean(axis=0) if shifted else np.zeros(3)
    free = [name for name, axis in zip(TURNS, "xyz", strict=True) if free_turn and _about(axis, axes)]
    free += [name for name, axis in zip(SHIFTS, "xyz", strict=True) if shifted and axis in axes]
    return Registration(
        axes=axes,
        factor=factor,
        R_bt=R_tb.T,
        shift_mm=shift,
        free=tuple(free),
        turn_known=len(axes) > 1 and bool(extents[1] > FLAT_SHARE * extents[0]),
        best_turn_deg=Rotation.from_matrix(best).as_rotvec(degrees=True),
        best_shift_mm=measured.mean(axis=0) - computed.mean(axis=0) @ best.T,
        extent_mm=float(np.abs(computed - computed.mean(axis=0)).max()),
    )


def _pairs(
    train: Sequence[Trial],
    columns: Sequence[str],
    points: Mapping[str, Mapping[str, int]],
    axes: str,
    robot: RobotSpec,
    twin: Predict,
) -> tuple[Array, Array]:
    """Return computed and measured points, shape (n, 3) each [mm]; a coordinate not measured is zero."""
    parts = []
    for trial in train if axes else ():
        computed, measured = twin([robot], trial.inputs, 1)[0], measured_of(trial, columns)
        for found in points.values():
            places = np.zeros((2, len(measured), 3))
            for axis in axes:
                places[:, :, "xyz".index(axis)] = computed[:, found[axis]], measured[:, found[axis]]
            parts.append(places[:, np.isfinite(places).all(axis=(0, 2))])
    stacked = np.concatenate(parts, axis=1) if parts else np.zeros((2, 0, 3))
    return stacked[0], stacked[1]


def _factor(computed: Array, measured: Array, axes: str) -> float:
    """Return 1000 where the measured points are the computed ones in metres, else 1."""
    spreads = [_spread(item) for item in (computed, measured)]
    if not METRES_SPREAD[0] * spreads[1] < spreads[0] < METRES_SPREAD[1] * spreads[1]:
        return 1.0
    metres = _MM_PER_M * measured
    left = _error(computed, metres, _kabsch(computed, metres, axes))
    return _MM_PER_M if left < METRES_LEFT_SHARE * spreads[0] else 1.0


def _spread(points: Array) -> float:
    """Return the root mean square distance of points (n, 3) from their middle."""
    return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _kabsch(computed: Array, measured: Array, axes: str, mirrored: bool = False) -> Array:
    """Return the turn of least squares from computed to measured points about their middles, shape (3, 3).

    Only the measured coordinates turn. What the points leave open, about the line on which they lie, is
    turned as little as can be. `mirrored`: a turn with a mirror image instead.
    """
    turn = np.eye(3)
    seen = ["xyz".index(axis) for axis in axes]
    product = (measured - measured.mean(axis=0)).T @ (computed - computed.mean(axis=0))
    product = product[np.ix_(seen, seen)]
    size = np.linalg.norm(product)
    if len(seen) < 2 or size == 0.0:
        return turn
    left, _, right = np.linalg.svd(product / size + LEAST_TURN_WEIGHT * np.eye(len(seen)))
    signs = np.ones(len(seen))
    signs[-1] = np.sign(np.linalg.det(left @ right)) * (-1.0 if mirrored else 1.0)
    turn[np.ix_(seen, seen)] = left @ np.diag(signs) @ right
    return turn


def _turn(computed: Array, measured: Array, best: Array, axes: str) -> tuple[Array, bool]:
    """Return the turn from the base's axes to the tracker's, and whether it is by any angle."""
    nearest = _error(computed, measured, best)
    mirrored = _error(computed, measured, _kabsch(computed, measured, axes, mirrored=True))
    if mirrored < TURN_CONVINCING * nearest and nearest > ROUNDING_SHARE * _spread(computed):
        return np.eye(3), False  # no motion of a tracker, but columns that are exchanged or turned in sign
    turns = _exchanges(axes)
    errors = [_error(computed, measured, R_tb) for R_tb in turns]
    taken, error, least = turns[0], errors[0], min(errors)
    offset = np.linalg.norm(measured.mean(axis=0) - computed.mean(axis=0))
    if least < (TURN_LIKELIER if offset > SLIGHT_SHIFT_MM else TURN_CONVINCING) * error:
        # Of turns that do as well the least one: points on a line leave the turn about it open.
        index = next(k for k, item in enumerate(errors) if item <= TURN_EQUAL * least)
        taken, error = turns[index], errors[index]
    beyond = math.degrees(Rotation.from_matrix(taken.T @ best).magnitude())
    if beyond > SLIGHT_DEG and nearest < TURN_CONVINCING * error:
        return best, True
    return taken, False


def _error(computed: Array, measured: Array, R_tb: Array) -> float:
    """Return the root mean square distance of computed points, turned, from measured ones; both centred."""
    apart = (measured - measured.mean(axis=0)) - (computed - computed.mean(axis=0)) @ R_tb.T
    return float(np.sqrt((apart**2).sum(axis=1).mean()))


def _exchanges(axes: str) -> list[Array]:
    """Return the turns that exchange measured axes, none first: 24 of three axes, four of two."""
    fixed = [index for index, axis in enumerate("xyz") if axis not in axes]
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0.0 and all(matrix[k, k] == 1.0 for k in fixed):
                found.append(matrix)
    return sorted(found, key=lambda matrix: -float(np.trace(matrix)))


def _far(apart: Array, axes: str) -> bool:
    """Return whether all points but a few are off by more than a slight shift, shape (n, 3)."""
    return bool(axes) and float(np.quantile(np.linalg.norm(apart, axis=1), UNSHIFTED_SHARE)) > SLIGHT_SHIFT_MM


def _about(axis: str, axes: str) -> bool:
    """Return whether a turn about `axis` shows in the measured coordinates."""
    return all(other in axes for other in "xyz" if other != axis)


_MM_PER_M = 1e3
