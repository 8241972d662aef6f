"""Where the tracker stands: measured positions are moved into the robot's base frame before any fit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Parameter
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.nuisance import Nuisance
from catheter_sim.diagnosis.thresholds import ROUNDING_SHARE
from catheter_sim.diagnosis.trials import QUATERNION, Dataset, Trial, measured_of, points_of
from catheter_sim.theory.twins import Predict

FEWEST_POINTS = 8
"""[points] With fewer measured points, the tracker's frame is not looked for. Why: assumed. A rigid motion
has six numbers, and a model that errs needs more points than that."""
TURN_CONVINCING = 0.35
"""[error with a turn over the error without] Below this ratio the turn is taken. Why: assumed. A turn must
take most of the error."""
TURN_LIKELIER = 0.75
"""[error with a turn over the error without] If the points would otherwise lie farther off than a slight
shift, an exchange of axes is taken below this ratio. Why: measured on a model that errs by half its motion.
Exchanged axes must still show beside that error."""
TURN_EQUAL = 1.05
"""[times the least error] Turns within it do as well, and the least turn is taken. Why: points on a line
leave the turn about that line open, and only rounding and noise separate such turns."""
SLIGHT_DEG = 30.0
"""[deg beyond an exchange of axes] A turn up to it is left to the cause `measurement_frame`. Why: assumed. A
tracker that somebody set up in the base frame is turned by less."""
SLIGHT_SHIFT_MM = 50.0
"""[mm] A shift up to it is left to the cause `measurement_frame`. Why: it is the bound of that cause."""
UNSHIFTED_SHARE = 0.05
"""[share of the points] If the whole tracker is shifted, this many may still be off by less than a slight
shift. Why: assumed. Single outliers must not decide."""
METRES_SPREAD = (250.0, 4000.0)
"""[computed spread over measured] Between these two numbers the positions are taken for metres. Why: they are
1000 within a factor of four, by which a model may err."""
METRES_LEFT_SHARE = 0.5
"""[share of the computed spread] The error must remain below it with the positions taken as metres. Why:
assumed. A model that errs by more says nothing about units."""
LEAST_TURN_WEIGHT = 1e-9
"""[share of the points' product] No turn has this weight beside the points. Why: it decides only what the
points leave open, and stays above rounding."""
FLAT_SHARE = 0.02
"""[second extent of the points over the first] Below it the points lie on a line, and the turn about that
line cannot be known. Why: assumed. A tracker's noise is about a hundredth of the motion."""

# ----------------------------------------------------------------------------------------------------
# How measured positions were moved into the robot's base frame, as a value, in JSON and in words.


@dataclass(frozen=True)
class Registration:
    """How measured positions were moved into the robot's base frame: p_base = R_bt (factor p_file - shift).

    Attributes:
        axes: the coordinates that are measured of every point, of "xyz"; "": no positions.
        factor: 1, or 1000 where a file is in metres.
        R_bt: turn from the tracker's axes to the base's, shape (3, 3).
        shift_mm: the base's origin in the tracker's frame, shape (3,) [mm].
        free: names of the numbers of the frame that are fitted with every hypothesis.
        turn_known: whether the points show how the tracker is turned; those on a line do not.
        best_turn_deg: rotation vector, base to tracker, of the motion of least squares, shape (3,).
        best_shift_mm: its shift, shape (3,).
        extent_mm: of the computed points from their middle, at most.
    """

    axes: str
    factor: float
    R_bt: Array
    shift_mm: Array
    free: tuple[str, ...]
    turn_known: bool
    best_turn_deg: Array
    best_shift_mm: Array
    extent_mm: float

    @property
    def turned(self) -> bool:
        """Return whether the tracker's axes are not the base's."""
        return not np.array_equal(self.R_bt, np.eye(3))

    @property
    def applied(self) -> bool:
        """Return whether measured positions were changed at all."""
        return self.turned or self.factor != 1.0 or bool(self.shift_mm.any())


TURNS = ("frame_turn_x_deg", "frame_turn_y_deg", "frame_turn_z_deg")


SHIFTS = ("frame_shift_x_mm", "frame_shift_y_mm", "frame_shift_z_mm")


CAUSE = "measurement_frame"  # what stands for a tracker that is slightly off


def document(registration: Registration, fitted: Mapping[str, float]) -> dict[str, Any]:
    """Return the motion as it stands in `diagnosis.json`, what was fitted of it included."""
    turn_deg = [fitted.get(name, 0.0) for name in TURNS]
    rest = Rotation.from_euler("xyz", turn_deg, degrees=True)  # about x, then y, then z
    R_tb = registration.R_bt.T
    shift = registration.shift_mm + R_tb @ np.array([fitted.get(name, 0.0) for name in SHIFTS])
    turn = Rotation.from_matrix(R_tb) * rest
    return {
        "applied": registration.applied,
        "factor": registration.factor,
        "rotation_deg": turn.as_rotvec(degrees=True).tolist(),
        "translation_mm": shift.tolist(),
        "measured_axes": registration.axes,
        "rotation_identifiable": registration.turn_known,
        "fitted": dict(fitted),
        "least_squares": {
            "rotation_deg": registration.best_turn_deg.tolist(),
            "translation_mm": registration.best_shift_mm.tolist(),
        },
    }


def registration_notes(registration: Registration, fitted: Mapping[str, float]) -> list[Note]:
    """Return what a reader must know of the motion; nothing where none was needed."""
    if not registration.applied:
        return []
    told = document(registration, fitted)
    notes = []
    if registration.factor != 1.0:
        said = (
            "The positions in columns called mm are in metres: the measured points lie a thousand times "
            "closer together than the robot's. They were multiplied by 1000."
        )
        notes.append(Note("positions_in_metres", said))
    if registration.turned or registration.shift_mm.any():
        turn = np.array(told["rotation_deg"])
        angle = float(np.linalg.norm(turn))
        about = ", ".join(f"{part:.2g}" for part in turn / angle) if angle else ""
        parts = [f"turned by {angle:.4g} deg about ({about})"] if angle else []
        if np.any(told["translation_mm"]):
            where = ", ".join(f"{part:.4g}" for part in told["translation_mm"])
            parts.append(f"the robot's base at ({where}) mm in its frame")
        fitted_too = " The shift is fitted again with every hypothesis." if registration.free else ""
        said = (
            f"The tracker has its own frame: {'; '.join(parts)}.{fitted_too} Every position here and in the "
            "CSV files is in the robot's base frame."
        )
        notes.append(Note("tracker_frame", said))
    if registration.turned and not registration.turn_known:
        said = (
            "These points lie on a line, so they do not show how the tracker is turned. The smallest turn "
            "was taken."
        )
        notes.append(Note("turn_unknown", said))
    return notes


def unmoved(registration: Registration) -> Registration:
    """Return the registration that leaves the data where they are."""
    return replace(registration, factor=1.0, R_bt=np.eye(3), shift_mm=np.zeros(3), free=())


def not_registered(axes: str) -> Registration:
    zero = np.zeros(3)
    return Registration(axes, 1.0, np.eye(3), zero, (), False, zero, zero, 0.0)


# ----------------------------------------------------------------------------------------------------
# Measured positions, and the tip's orientation, moved into the robot's base frame.


def registered(dataset: Dataset, registration: Registration) -> Dataset:
    """Return the data set with its measured positions, and the tip's orientation, in the base frame."""
    if not registration.applied:
        return dataset
    trials = []
    for trial in dataset.trials:
        values = measured_of(trial, dataset.output_channels)
        moved = _moved_values(values, dataset.output_channels, registration)
        outputs = {name: moved[:, index] for index, name in enumerate(dataset.output_channels)}
        trials.append(replace(trial, outputs=replace(trial.outputs, columns=outputs)))
    return replace(dataset, trials=tuple(trials))


def _moved_values(values: Array, columns: Sequence[str], registration: Registration) -> Array:
    """Return measured outputs (r, o) in the base frame."""
    moved = np.array(values)
    for found in points_of(columns).values():
        from_file = {axis: registration.factor * values[:, index] for axis, index in found.items()}
        for axis, index in found.items():
            row = registration.R_bt["xyz".index(axis)]
            total = np.zeros(len(values))
            for other, weight in zip("xyz", row, strict=True):
                if weight != 0.0:  # a missing value of another axis must not spoil this one
                    total += weight * (from_file[other] - registration.shift_mm["xyz".index(other)])
            moved[:, index] = total
    places = [list(columns).index(name) for name in QUATERNION if name in columns]
    if registration.turned and len(places) == 4:
        moved[:, places] = turned_quaternions(values[:, places], Rotation.from_matrix(registration.R_bt))
    return moved


def turned_quaternions(values: Array, turn: Rotation) -> Array:
    """Return unit quaternions w, x, y, z turned, shape (r, 4), w never negative; NaN where one is missing."""
    turned = np.full_like(values, np.nan)
    known = np.isfinite(values).all(axis=1) & (np.linalg.norm(values, axis=1) > 0.0)
    if known.any():
        found = turn * Rotation.from_quat(values[known], scalar_first=True)
        turned[known] = found.as_quat(canonical=True, scalar_first=True)
    return turned


# ----------------------------------------------------------------------------------------------------
# Numbers of the tracker's frame that are fitted with every hypothesis.


def frame_numbers(registration: Registration) -> tuple[Nuisance, ...]:
    """Return the numbers of the frame that are fitted with every hypothesis: turns first, then shifts."""
    turns = any(name in TURNS for name in registration.free)
    found = []
    for index, name in enumerate((*TURNS, *SHIFTS)):
        if name not in registration.free:
            continue
        turn = name in TURNS
        bound = 180.0 if turn else SLIGHT_SHIFT_MM + 2.0 * registration.extent_mm
        found.append(
            Nuisance(
                Parameter(name, 0.0, -bound, bound, scale=1.0, start=0.0),
                _same_robot,
                superseded_by=() if turns else (CAUSE,),
                stands_for=(CAUSE,) if turns else (),
                change_outputs=partial(_turned_outputs if turn else _shifted_outputs, index % 3),
            )
        )
    return tuple(found)


def _same_robot(robot: RobotSpec, value: float) -> RobotSpec:
    return robot


def _shifted_outputs(axis: int, columns: tuple[str, ...], outputs: Array, values: Array) -> Array:
    """Return outputs (B, r, o) with every point shifted along one axis by `values` (B,) [mm]."""
    shifted = np.array(outputs)
    for found in points_of(columns).values():
        if "xyz"[axis] in found:
            shifted[..., found["xyz"[axis]]] += values[:, None]
    return shifted


def _turned_outputs(axis: int, columns: tuple[str, ...], outputs: Array, values: Array) -> Array:
    """Return outputs (B, r, o) with every point and the tip's orientation turned by `values` (B,) [deg]."""
    turned = np.array(outputs)
    first, second = "xyz"[(axis + 1) % 3], "xyz"[(axis + 2) % 3]
    cosine, sine = (part(np.radians(values))[:, None] for part in (np.cos, np.sin))
    for found in points_of(columns).values():
        if first in found and second in found:
            a, b = outputs[..., found[first]], outputs[..., found[second]]
            turned[..., found[first]] = cosine * a - sine * b
            turned[..., found[second]] = sine * a + cosine * b
    places = [columns.index(name) for name in QUATERNION if name in columns]
    if len(places) == 4:
        for index, value in enumerate(values):
            turn = Rotation.from_rotvec(np.radians(value) * np.eye(3)[axis])
            turned[index][:, places] = turned_quaternions(outputs[index][:, places], turn)
    return turned


# ----------------------------------------------------------------------------------------------------
# Where the tracker stands: measured positions are moved into the robot's base frame before any fit.
#
# A tracker has an origin and axes of its own, and its files may be in metres. Measured and computed
# positions of the training trials are laid over one another by the rigid motion of least squares (Kabsch
# 1976; Umeyama 1991). A model that errs lays them over one another wrongly, so that this motion is not
# taken as it is:
#
# - Turns. The base frame is wanted as it would be set up: the 24 turns that exchange axes are tried first,
# none   before the others. One is taken where it takes most of the error (`TURN_CONVINCING`); what a tracker
# is   turned beyond it, up to `SLIGHT_DEG`, is left to the cause `measurement_frame`. Only where a turn by
# any   angle does as much better again is that one taken, and its three numbers are fitted with every
# hypothesis. - Shifts. Where every point is off by more than that cause may be, the mean shift is taken out,
# and its   numbers are fitted with every hypothesis, since an erring model shows the wrong mean.
# - Metres: where the points' spread shows a factor of 1000.
#
# So a tracker placed anywhere leaves the same answer as one that stands in the base frame, and one that is
# slightly off is a cause, as ever. A mirror image is no motion of a tracker; `find_data_faults` names it.


def register(train: Sequence[Trial], columns: Sequence[str], robot: RobotSpec, twin: Predict) -> Registration:
    """Return the motion from the tracker's frame to the base's."""
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
