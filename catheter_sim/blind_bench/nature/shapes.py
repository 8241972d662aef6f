"""Where the elements of a robot are, row by row, and shapes that are bent, turned or shortened otherwise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture


@dataclass(frozen=True)
class Shapes:
    """Postures of a trial.

    Attributes:
        p: distal faces, base to tip, base frame, shape (r, n, 3) [m]; as they are seen, with the robot's
            markers behind them.
        R: their orientations, shape (r, n, 3, 3).
        angles: of the joints, shape (r, j) [rad].
        tension: at the actuators, shape (r, t) [N].
    """

    p: Array
    R: Array
    angles: Array
    tension: Array

    def __len__(self) -> int:
        return len(self.p)

    def at(self, rows: Sequence[int]) -> Shapes:
        """Return some rows."""
        index = list(rows)
        return Shapes(self.p[index], self.R[index], self.angles[index], self.tension[index])

    def postures(self) -> tuple[Posture, ...]:
        """Return them as the package's postures, for writing columns."""
        n = self.R.shape[1]
        nothing = np.zeros((self.tension.shape[1], n))
        rows = zip(self.p, self.R, self.angles, self.tension, strict=True)
        return tuple(
            Posture(p[:n], R, angles, tension, nothing, p[n:] if len(p) > n else None)
            for p, R, angles, tension in rows
        )


def shapes_of(postures: Sequence[Posture]) -> Shapes:
    """Return postures as arrays."""
    return Shapes(
        np.array([item.p_w for item in postures]),
        np.array([item.R_w for item in postures]),
        np.array([item.joint_angles for item in postures]),
        np.array([item.actuator_tension for item in postures]),
    )


def bends_of(shapes: Shapes) -> Array:
    """Return each element's turn against the one below it, as rotation vectors, shape (r, n, 3) [rad]."""
    below = np.concatenate([np.broadcast_to(np.eye(3), (len(shapes), 1, 3, 3)), shapes.R[:, :-1]], axis=1)
    relative = np.einsum("rnji,rnjk->rnik", below, shapes.R)
    return Rotation.from_matrix(relative.reshape(-1, 3, 3)).as_rotvec().reshape(*relative.shape[:2], 3)


def rebent(shapes: Shapes, change: Callable[[Array], Array]) -> Shapes:
    """Return shapes whose elements' turns are changed, stacked anew from the base.

    An element that turns by more carries its step, from face to face, half as far: it bends in its middle.

    Args:
        shapes: to change.
        change: from turns as of `bends_of`, shape (r, n, 3), to others.
    """
    before = bends_of(shapes)
    turns = [Rotation.from_rotvec(part.reshape(-1, 3)) for part in (before, change(before))]
    half = [Rotation.from_rotvec(0.5 * turn.as_rotvec()) for turn in turns]
    count = before.shape[:2]
    below = np.concatenate([np.broadcast_to(np.eye(3), (len(shapes), 1, 3, 3)), shapes.R[:, :-1]], axis=1)
    foot = np.concatenate([np.zeros((len(shapes), 1, 3)), shapes.p[:, :-1]], axis=1)
    step = np.einsum("rnji,rnj->rni", below, shapes.p - foot)
    step = (half[1] * half[0].inv()).apply(step.reshape(-1, 3)).reshape(*count, 3)
    return _stacked(shapes, step, turns[1].as_matrix().reshape(*count, 3, 3))


def shortened(shapes: Shapes, share: Array) -> Shapes:
    """Return shapes whose elements are shorter by a share of their length, shape (r, n)."""
    foot = np.concatenate([np.zeros((len(shapes), 1, 3)), shapes.p[:, :-1]], axis=1)
    step = (shapes.p - foot) * (1.0 - share)[..., np.newaxis]
    return replace(shapes, p=np.cumsum(step, axis=1))


def _stacked(shapes: Shapes, step: Array, turn: Array) -> Shapes:
    p, R = np.empty_like(shapes.p), np.empty_like(shapes.R)
    place, frame = np.zeros((len(p), 3)), np.broadcast_to(np.eye(3), (len(p), 3, 3))
    for k in range(p.shape[1]):
        place = place + np.einsum("rij,rj->ri", frame, step[:, k])
        frame = frame @ turn[:, k]
        p[:, k], R[:, k] = place, frame
    return replace(shapes, p=p, R=R)
