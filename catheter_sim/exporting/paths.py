"""Bodies that a simulation's laws move with their hinges, as slides that a polynomial ties to the hinge.

Where a joint rolls, or a notch bends to an arc, the package moves the body at every step. What it does is
a shift of the body that depends on its own hinge's angle alone; MuJoCo has that as a slide and an equality
of two joints, a polynomial of the fourth order at most. The shift is worked out from the kinematics, not
fitted to a run, and what the polynomial leaves is said.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.simulation.simulator import Simulator

_ANGLES = 61  # at which a shift is looked at
_LEAST_SHARE = 1e-5  # of the robot's length: smaller shifts are left out
_POWERS = np.arange(1, 5)


@dataclass(frozen=True)
class Shift:
    """A body's shift by its hinge.

    Attributes:
        joint: the hinge's name.
        body: the body's.
        axis: 0, 1 or 2, of the parent's frame.
        coefficients: of the angle's powers 1 to 4, shape (4,) [m].
        left_m: the most that the polynomial leaves.
    """

    joint: str
    body: str
    axis: int
    coefficients: Array
    left_m: float

    @property
    def slide(self) -> str:
        """The name of the slide in the file."""
        return f"shift_{self.joint}_{'xyz'[self.axis]}"

    def at(self, angle: float) -> float:
        """Return the shift at an angle [m]."""
        return float(angle**_POWERS @ self.coefficients)

    def slope(self, angle: float) -> float:
        """Return by how much it grows with the angle [m/rad]."""
        return float(_POWERS * angle ** (_POWERS - 1) @ self.coefficients)


def find_shifts(
    simulator: Simulator, plain: mujoco.MjModel, least: Array, most: Array, length_m: float
) -> tuple[Shift, ...]:
    """Return the shifts that the laws of a simulation give to bodies of its model.

    Args:
        simulator: of the robot, at rest.
        plain: the same model without laws: the same joints in the same order.
        least, most: angles between which the hinges move, shape (njnt,) [rad].
        length_m: of the robot.
    """
    if not simulator.laws.place:
        return ()
    data = mujoco.MjData(plain)
    found: list[Shift] = []
    hinge = int(mujoco.mjtJoint.mjJNT_HINGE)
    for joint in range(plain.njnt):
        if plain.jnt_type[joint] != hinge or most[joint] - least[joint] < 1e-6:
            continue
        angles = np.linspace(least[joint], most[joint], _ANGLES)
        shift = _shifts(simulator, plain, data, joint, angles)
        powers = angles[:, np.newaxis] ** _POWERS
        for axis in range(3):
            if np.abs(shift[:, axis]).max() < _LEAST_SHARE * length_m:
                continue
            coefficients = np.asarray(np.linalg.lstsq(powers, shift[:, axis], rcond=None)[0], float)
            left = np.abs(powers @ coefficients - shift[:, axis]).max()
            body = plain.body(plain.jnt_bodyid[joint]).name
            found.append(Shift(plain.joint(joint).name, body, axis, coefficients, float(left)))
    simulator.reset()
    return tuple(found)


def _shifts(
    simulator: Simulator, plain: mujoco.MjModel, data: mujoco.MjData, joint: int, angles: Array
) -> Array:
    """Return how far the laws move the body of a hinge at angles, in its parent's frame, shape (a, 3) [m]."""
    body = int(plain.jnt_bodyid[joint])
    parent, place = int(plain.body_parentid[body]), int(plain.jnt_qposadr[joint])

    def relative(model: mujoco.MjModel, state: mujoco.MjData, angle: float, moved: bool) -> Array:
        state.qpos[:] = model.qpos_spring
        state.qpos[place] = angle
        if moved:
            for law in simulator.laws.place:
                law(state)
        mujoco.mj_kinematics(model, state)
        turn = state.xmat[parent].reshape(3, 3)
        return np.asarray(turn.T @ (state.xpos[body] - state.xpos[parent]))

    def shift(angle: float) -> Array:
        own = relative(simulator.model, simulator.data, angle, True)
        return own - relative(plain, data, angle, False)

    straight = shift(0.0)
    return np.array([shift(float(angle)) - straight for angle in angles])
