"""What moments a plain model lacks at its hinges, read from a simulation at rest, and a law that gives
them.

The package's simulation is at rest in a posture under inputs. Put into the plain model, posture and inputs
leave at each hinge a moment without balance: what friction, rods or metal do there, which run beside the
step. Over loops that moment M against the hinge's angle q is a curve with two branches,

    M(q) = -(s(q) + sign(dq) (c + w |x| + v |x|^3)),  x = q / q_most,  s: piecewise linear,  c, w, v >= 0,

fitted by least squares to the rows in which the hinge moves. Capstan friction of one tendon that bends
springs of stiffness K gives s = K q (cosh(mu a) - 1) and a width K q sinh(mu a), with the tendon's turn a
up to the hinge. Both are functions of the posture here, where the capstan's depend on the tension. That is
good where one tendon at a time moves a robot of springs, and wrong under loads and where tendons share
joints or pull against one another. The turn a grows with q, so that the width grows about as q^2, for which
w |x| + v |x|^3 stands to within 4 % of its largest value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.optimize import lsq_linear

from catheter_sim.arrays import Array
from catheter_sim.exporting.paths import Shift

KNOTS = 8  # of the piecewise linear part, evenly over the hinge's range
_MOVES_SHARE = 2e-3  # of its range: by less a hinge sticks between two rows
_LEAST_RANGE_RAD = 1e-4  # of a hinge that is fitted
_LEAST_SHARE = 1e-3  # of the largest moment of a tendon: smaller ones are left out
_RIDGE = 1e-4


@dataclass(frozen=True)
class HingeLaw:
    """What is added to a hinge.

    Attributes:
        joint: its name.
        range_rad: largest angle to either side on the loops.
        stiffness: of a spring about zero; may be negative [N m/rad].
        knots: angles beyond which springs act, away from zero, with their stiffness [rad, N m/rad].
        constant: of friction that is the same at all angles, to either side [N m].
        width: of friction that grows with the angle, as a moment at `range_rad` to either side [N m].
        cubic: of friction that grows with the angle's third power, likewise [N m].
        left: root mean square of the moment that the law leaves, over the largest one of the tendons.
    """

    joint: str
    range_rad: float
    stiffness: float
    knots: tuple[tuple[float, float], ...]
    constant: float
    width: float
    cubic: float
    left: float


@dataclass(frozen=True)
class Rows:
    """What is known at each row of the loops.

    Attributes:
        angle: of the hinges, shape (r, m) [rad].
        missing: the moment that is lacking at them, shape (r, m) [N m].
        pulled: what the actuators give there, shape (r, m) [N m].
    """

    angle: Array
    missing: Array
    pulled: Array


def missing_moments(
    plain: mujoco.MjModel,
    joints: Sequence[str],
    shifts: Sequence[Shift],
    positions: Array,
    controls: Array,
) -> Rows:
    """Return the moments without balance in postures of a simulation at rest.

    Args:
        plain: with the slides of `shifts`, without constraints of its own; changed: they are switched off.
        joints: names of its hinges and slides whose positions are given.
        shifts: which slides hang on which hinge.
        positions: of `joints`, shape (r, m).
        controls: of all its actuators, shape (r, nu).
    """
    plain.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(plain)
    place = np.array([plain.joint(name).qposadr[0] for name in joints])
    dof = np.array([plain.joint(name).dofadr[0] for name in joints])
    index = {name: k for k, name in enumerate(joints)}
    slides = [
        (index[s.joint], plain.joint(s.slide).qposadr[0], plain.joint(s.slide).dofadr[0], s) for s in shifts
    ]
    missing, pulled = np.zeros_like(positions), np.zeros_like(positions)
    for row, own in enumerate(positions):
        data.qpos[place] = own
        for hinge, where, _, shift in slides:
            data.qpos[where] = shift.at(own[hinge])
        data.ctrl[:] = controls[row]
        mujoco.mj_forward(plain, data)
        acts = data.qfrc_actuator
        rest = data.qfrc_bias - data.qfrc_passive - acts
        missing[row], pulled[row] = rest[dof], acts[dof]
        for hinge, _, on, shift in slides:  # a slide's force acts on the hinge that moves it
            slope = shift.slope(own[hinge])
            missing[row, hinge] += slope * rest[on]
            pulled[row, hinge] += slope * acts[on]
    return Rows(positions, missing, pulled)


def fit_laws(rows: Rows, joints: Sequence[str], hinges: Sequence[bool]) -> tuple[HingeLaw, ...]:
    """Return the laws of the hinges that lack a moment.

    Args:
        rows: along loops from rest.
        joints: their names, shape (m,).
        hinges: which of them turn, shape (m,).
    """
    found = []
    for k, name in enumerate(joints):
        if not hinges[k] or np.ptp(rows.angle[:, k]) < _LEAST_RANGE_RAD:
            continue
        largest = float(np.abs(rows.pulled[:, k]).max())
        if np.abs(rows.missing[:, k]).max() < _LEAST_SHARE * largest:
            continue
        found.append(_fit(name, rows.angle[:, k], rows.missing[:, k], largest))
    return tuple(found)


def _fit(joint: str, angle: Array, moment: Array, largest: float) -> HingeLaw:
    """Return the law of one hinge along rows, shape (r,)."""
    span = float(np.abs(angle).max())
    step = np.diff(angle, prepend=0.0)
    moves = np.abs(step) > _MOVES_SHARE * span
    if not moves.any():
        return HingeLaw(joint, span, 0.0, (), 0.0, 0.0, 0.0, 0.0)
    knots = np.linspace(angle.min(), angle.max(), KNOTS + 2)[1:-1]
    knots = knots[np.abs(knots) > 0.02 * span]
    springs = [angle, *(np.sign(k) * np.maximum(0.0, np.sign(k) * (angle - k)) for k in knots)]
    share = np.abs(angle / span)
    columns = -np.array([*springs, *(np.sign(step) * width for width in (share**0, share, share**3))]).T
    size = np.abs(columns).max(axis=0) + 1e-30
    rows = np.concatenate([columns[moves] / size, _RIDGE * largest * np.eye(len(size))])
    target = np.concatenate([moment[moves], np.zeros(len(size))])
    least = np.array([-np.inf] * len(springs) + [0.0] * 3)
    values = lsq_linear(rows, target, (least, np.inf)).x / size
    left = float(np.sqrt(np.mean((columns[moves] @ values - moment[moves]) ** 2))) / max(largest, 1e-30)
    pairs = tuple((float(k), float(v)) for k, v in zip(knots, values[1 : len(springs)], strict=True))
    constant, width, cubic = (float(value) for value in values[-3:])
    return HingeLaw(joint, span, float(values[0]), pairs, constant, width, cubic, left)
