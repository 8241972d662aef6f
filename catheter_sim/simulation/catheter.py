"""What drives a simulated catheter: pairs of tendons on pulleys, and torsion joints' wrapped tendons."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from catheter_sim.errors import InputError
from catheter_sim.mjcf.catheter_drive import tendon_stiffness
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.catheter_layout import moved_segment
from catheter_sim.robots.channels import input_channels
from catheter_sim.robots.posture import Array
from catheter_sim.statics.catheter.tendons import largest_angle_rad, pulled_m

_ROUNDING = 1e-9  # share of a range by which an input may lie beyond it


class CatheterDrive:
    """From the displacements of pairs to the model's controls, and back to the pairs' tensions.

    Torsion. With the displacement d, the pair's stiffness k and Eq. 6 of Nayar 2022 as the odd function
    l(theta) of the angle, the pair turns the joint with the moment k (d - l) dl/dtheta. It holds the
    joint from both sides: the antagonist, which Eq. 6 leaves too short where the wrap has a height, is
    taken to give way by just what it lacks, and to be taut at the angle of Eq. 7. Before each step the
    joint's actuator is made the tangent of that law, so that the integrator knows its stiffness.
    """

    def __init__(self, robot: CatheterRobot, model: mujoco.MjModel) -> None:
        self._robot, self._model = robot, model
        moved = [robot.segments[moved_segment(robot, index)] for index in range(len(robot.tendons))]
        joints = [segment.joint for segment in moved]
        bending = [index for index, joint in enumerate(joints) if joint == "bending"]
        turns = [index for index, joint in enumerate(joints) if joint == "torsion"]
        # The order of the model's actuators: the pairs, then the antagonists.
        self._pair = np.array([*range(len(moved)), *bending], dtype=int)
        self._sign = np.array([1.0] * len(moved) + [-1.0] * len(bending))
        ranges = []
        for pair, segment in zip(robot.tendons, moved, strict=True):
            stretches = segment.joint == "bending" and math.isfinite(pair.stiffness_N_per_m)
            ends = segment.joint in ("torsion", "bending") and not stretches
            ranges.append(float(pulled_m(segment, largest_angle_rad(segment))) if ends else math.inf)
        self._range = np.array(ranges)
        tendons = np.flatnonzero(model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON))
        self._pulling_pair = self._pair[tendons]
        # Stiff as they are, they would show the ninth digit, at which the model's text ends.
        bias = model.actuator_biasprm
        bias[tendons, 0] = -bias[tendons, 1] * model.tendon_length0[model.actuator_trnid[tendons, 0]]
        names = [f"tendon_{robot.tendons[index].name}" for index in turns]
        modules = [moved[index] for index in turns]
        self._turns = np.array(turns, dtype=int)
        self._actuator = np.array([model.actuator(name).id for name in names], dtype=int)
        self._qpos = np.array([model.joint(module.name).qposadr[0] for module in modules], dtype=int)
        self._radius = np.array([module.tendon_radius_m for module in modules])
        self._height = np.array([module.wrap_height_m for module in modules])
        self._wrap = np.array([module.wrap_rad for module in modules])
        self._home = np.hypot(self._radius * self._wrap, self._height)
        self._stiffness = np.array([tendon_stiffness(robot, robot.tendons[index]) for index in turns])
        self._gain = model.actuator_gainprm[self._actuator, 0].copy()

    def controls(self, displacement: Array) -> Array:
        """Return the model's controls for the displacements and advances of the pairs, shape (p,) [m].

        Raises:
            InputError: a displacement to which no angle belongs.
        """
        beyond = np.abs(displacement) > self._range * (1.0 + _ROUNDING)
        if beyond.any():
            index = int(np.argmax(beyond))
            name = input_channels(self._robot)[index]
            most = self._range[index] * 1e3
            raise InputError(
                f"{self._robot.name}: {name}: beyond its joint's range, {-most:.4g} to {most:.4g} mm"
            )
        return self._sign * displacement[self._pair]

    def turn(self, data: mujoco.MjData) -> None:
        """Let the torsion joints' actuators be their pairs at the present angles and controls."""
        if not len(self._turns):
            return
        angle = data.qpos[self._qpos]
        short, arm = self._unwound(angle, data.ctrl[self._actuator])
        moment, slope = self._stiffness * short * arm, self._stiffness * arm**2
        bias = self._model.actuator_biasprm
        bias[self._actuator, 0] = moment + slope * angle - self._gain * data.ctrl[self._actuator]
        bias[self._actuator, 1] = -slope

    def pair_tension(self, data: mujoco.MjData, tendon_tension: Array) -> Array:
        """Return the tension of each pair's tauter tendon, shape (p,) [N]; 0 of what is advanced.

        Args:
            data: the state.
            tendon_tension: of the bending joints' tendons, in the order of their actuators [N].
        """
        tension = np.zeros(len(self._robot.tendons))
        np.maximum.at(tension, self._pulling_pair, tendon_tension)
        short, _ = self._unwound(data.qpos[self._qpos], data.ctrl[self._actuator])
        tension[self._turns] = np.abs(self._stiffness * short)
        return tension

    def _unwound(self, angle: Array, displacement: Array) -> tuple[Array, Array]:
        """Return by how much each torsion pair is stretched [m], and its arm [m/rad]: Eq. 6, its slope."""
        around = self._radius * np.maximum(self._wrap - np.abs(angle), 0.0)
        wrapped = np.hypot(around, self._height)
        drawn = np.copysign(self._home - wrapped, angle)
        # On a drum wrapped and around are one; at the wrap's very end both are 0.
        arm = self._radius * np.where(self._height > 0.0, around / np.where(wrapped > 0.0, wrapped, 1.0), 1.0)
        return displacement - drawn, arm


def require_frictionless(robot: CatheterRobot) -> None:
    """Raise `InputError` if the robot's tendons rub: no law for it runs beside the model yet."""
    if robot.friction.mu > 0.0:
        raise InputError(
            f"{robot.name}: friction.mu = {robot.friction.mu:g}: the simulation of robots of kind "
            f"{robot.kind!r} knows no friction yet; choices: 0"
        )
