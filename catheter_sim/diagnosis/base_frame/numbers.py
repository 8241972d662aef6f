"""Numbers of the tracker's frame that are fitted with every hypothesis."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Parameter
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.base_frame.move import turned_quaternions
from catheter_sim.diagnosis.base_frame.registration import CAUSE, SHIFTS, TURNS, Registration
from catheter_sim.diagnosis.data.columns import QUATERNION, points_of
from catheter_sim.diagnosis.data.nuisance import Nuisance
from catheter_sim.diagnosis.thresholds import SLIGHT_SHIFT_MM


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
