"""The pairs that turn a simulated catheter's torsion joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import Law, RobotInModel, Step
from catheter_sim.core.law_copies import CopiesLaw, CopyArrays
from catheter_sim.kinds.catheter.forces import drive_kernel
from catheter_sim.kinds.catheter.layout import moved_segment
from catheter_sim.kinds.catheter.mjcf.drive import tendon_stiffness
from catheter_sim.kinds.catheter.spec import CatheterRobot


@dataclass(frozen=True)
class TorsionArrays:
    """The torsion joints' pairs as plain arrays, each of shape (k,), for where they are found elsewhere.

    Attributes:
        actuators, qpos: their actuators, and where their angles are in the positions.
        radius, height, wrap: of the wrapped tendons [m, m, rad].
        home: wrapped length at rest [m].
        stiffness: of each pair [N/m].
        gain: of the actuators [N m/m].
    """

    actuators: np.ndarray
    qpos: np.ndarray
    radius: Array
    height: Array
    wrap: Array
    home: Array
    stiffness: Array
    gain: Array


class TorsionPairs(Law):
    """The wrapped tendons of the torsion joints.

    With the displacement d, the pair's stiffness k and Eq. 6 of Nayar 2022 as the odd function
    l(theta) of the angle, the pair turns the joint with the moment k (d - l) dl/dtheta. It holds the
    joint from both sides: the antagonist, which Eq. 6 leaves too short where the wrap has a height, is
    taken to give way by just what it lacks, and to be taut at the angle of Eq. 7. Before each step the
    joint's actuator is made the tangent of that law, so that the integrator knows its stiffness.

    Attributes:
        pairs: their places among the robot's pairs, shape (k,).
        law: their numbers, as `drive_kernel.tangents` takes them, shape (k, 6).
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel) -> None:
        self._model = model = place.model
        moved = [robot.segments[moved_segment(robot, index)] for index in range(len(robot.tendons))]
        turns = [index for index, segment in enumerate(moved) if segment.joint == "torsion"]
        modules = [moved[index] for index in turns]
        self.pairs = np.array(turns, dtype=int)
        names = [f"tendon_{robot.tendons[index].name}" for index in turns]
        self._actuators = np.array([place.actuator(name).id for name in names], dtype=int)
        self._qpos = np.array([place.joint(module.name).qposadr[0] for module in modules], dtype=int)
        self._radius = np.array([module.tendon_radius_m for module in modules])
        self._height = np.array([module.wrap_height_m for module in modules])
        self._wrap = np.array([module.wrap_rad for module in modules])
        self._home = np.hypot(self._radius * self._wrap, self._height)
        self._stiffness = np.array([tendon_stiffness(robot, robot.tendons[index]) for index in turns])
        self._gain = model.actuator_gainprm[self._actuators, 0].copy()
        numbers = self._radius, self._height, self._wrap, self._home, self._stiffness, self._gain
        self.law = np.stack(numbers, axis=1)

    def arrays(self) -> TorsionArrays:
        """Return what their law needs to know of the pairs."""
        return TorsionArrays(
            actuators=self._actuators,
            qpos=self._qpos,
            radius=self._radius,
            height=self._height,
            wrap=self._wrap,
            home=self._home,
            stiffness=self._stiffness,
            gain=self._gain,
        )

    def actuate(self, step: Step) -> None:
        """Let the torsion joints' actuators be their pairs at the present angles and controls."""
        if len(self.pairs):
            data, bias = step.data, self._model.actuator_biasprm
            drive_kernel.tangents(self._actuators, self._qpos, self.law, data.qpos, data.ctrl, bias)

    def tension(self, qpos: Array, ctrl: Array) -> Array:
        """Return the tension of each pair's tauter tendon, shape (..., k) [N].

        Args:
            qpos: positions, shape (..., nq).
            ctrl: controls, shape (..., nu).
        """
        angle, displacement = qpos[..., self._qpos], ctrl[..., self._actuators]
        around = self._radius * np.maximum(self._wrap - np.abs(angle), 0.0)
        drawn = np.copysign(self._home - np.hypot(around, self._height), angle)
        return np.abs(self._stiffness * (displacement - drawn))


class TorsionCopies(CopiesLaw):
    """The pairs in many copies."""

    def __init__(self, pairs: TorsionPairs, arrays: CopyArrays) -> None:
        own = pairs.arrays()
        self._actuators, self._qpos = own.actuators, own.qpos
        self._law = pairs.law
        self._arrays, self._bias = arrays, arrays.own("actuator_biasprm")

    def actuate(self, copies: drive_kernel.Index) -> None:
        """Let the torsion joints' actuators be their pairs."""
        if len(self._actuators):
            arrays = self._arrays
            drive_kernel.tangents_of(
                copies, self._actuators, self._qpos, self._law, arrays.qpos, arrays.ctrl, self._bias
            )
