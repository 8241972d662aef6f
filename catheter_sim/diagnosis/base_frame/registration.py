"""How measured positions were moved into the robot's base frame, as a value, in JSON and in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.notes import Note


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
    """Return the motion as it stands in `diagnosis.json`, what was fitted of it included.

    Args:
        registration: the motion.
        fitted: values of its free numbers by name.
    """
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
