"""What drives a simulated catheter: pairs of tendons on pulleys, and torsion joints' wrapped tendons."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.errors import InputError
from catheter_sim.mjcf.catheter_drive import tendon_stiffness
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.catheter_layout import bent_by, moved_segment
from catheter_sim.robots.channels import input_channels
from catheter_sim.robots.posture import Array
from catheter_sim.simulation import catheter_kernel
from catheter_sim.simulation.catheter_resistance import joint_resistances
from catheter_sim.simulation.catheter_stretch import StretchLaws
from catheter_sim.simulation.catheter_tube import tubes_of
from catheter_sim.statics.catheter.drive import input_range_m

_ROUNDING = 1e-9  # share of a range by which an input may lie beyond it


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


class CatheterDrive:
    """From the displacements of pairs to the model's controls, and back to the pairs' tensions.

    Play. What arrives at a pair follows its displacement with the pair's whole dead-band, centred at rest.
    It is taken step by step: inputs must pass through the points at which they turn.

    Stretch and resistance by the laws of Nayar 2023: `catheter_stretch`, `catheter_resistance`.

    Torsion. With the displacement d, the pair's stiffness k and Eq. 6 of Nayar 2022 as the odd function
    l(theta) of the angle, the pair turns the joint with the moment k (d - l) dl/dtheta. It holds the
    joint from both sides: the antagonist, which Eq. 6 leaves too short where the wrap has a height, is
    taken to give way by just what it lacks, and to be taut at the angle of Eq. 7. Before each step the
    joint's actuator is made the tangent of that law, so that the integrator knows its stiffness.

    Attributes:
        pulls: actuators of the bending joints' tendons, shape (k,).
        torsion: actuators of the torsion joints' pairs.
        stretching: the laws of tendons that stretch.
        resistances: the bending joints whose resistance was measured.
        tubes: the exposed tubes that bend.
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
        self._range = np.stack(input_range_m(robot), axis=1)
        self._play = np.array([pair.play_m for pair in robot.tendons])
        tendons = self.pulls = pulling_actuators(robot, model)
        self._pulling_pair = self._pair[tendons]
        # Stiff as they are, they would show the ninth digit, at which the model's text ends.
        bias = model.actuator_biasprm
        slack = np.array([robot.tendons[pair].slack_m for pair in self._pulling_pair])
        rest = model.tendon_lengthspring[model.actuator_trnid[tendons, 0], 0] + slack
        bias[tendons, 0] = -bias[tendons, 1] * rest
        self.stretching = StretchLaws(robot, model, tendons, self._pulling_pair)
        self.resistances = joint_resistances(robot, model)
        names = [f"tendon_{robot.tendons[index].name}" for index in turns]
        modules = [moved[index] for index in turns]
        self._turns = np.array(turns, dtype=int)
        self.torsion = np.array([model.actuator(name).id for name in names], dtype=int)
        self._qpos = np.array([model.joint(module.name).qposadr[0] for module in modules], dtype=int)
        self._radius = np.array([module.tendon_radius_m for module in modules])
        self._height = np.array([module.wrap_height_m for module in modules])
        self._wrap = np.array([module.wrap_rad for module in modules])
        self._home = np.hypot(self._radius * self._wrap, self._height)
        self._stiffness = np.array([tendon_stiffness(robot, robot.tendons[index]) for index in turns])
        self._gain = model.actuator_gainprm[self.torsion, 0].copy()
        self._law = np.stack(
            [self._radius, self._height, self._wrap, self._home, self._stiffness, self._gain], axis=1
        )
        self._arrived = np.zeros(len(robot.tendons))
        self.tubes = tubes_of(robot, model)

    @property
    def plain(self) -> bool:
        """Whether tendons and joints follow no measured law and no tube bends."""
        return not (self.stretching or self.resistances or self.tubes)

    @property
    def control_count(self) -> int:
        """How many controls there are, the model's first ones."""
        return len(self._pair)

    def reset(self) -> None:
        """Forget what happened: plays centred, tendons new, joints unbent."""
        self._arrived[:] = 0.0
        self.stretching.reset()
        for joint in self.resistances:
            joint.reset()
        for tube in self.tubes:
            tube.reset()

    def controls(self, displacement: Array) -> Array:
        """Return the model's controls for the displacements and advances of the pairs, shape (p,) [m].

        Raises:
            InputError: a displacement to which no angle belongs.
        """
        self.require_range(displacement)
        self._arrived = self.through_play(self._arrived, displacement)
        return self.driven(self._arrived)

    def require_range(self, displacement: Array) -> None:
        """Require that an angle belongs to every displacement, shape (..., p) [m].

        Raises:
            InputError: none does to one.
        """
        least, most = self._range.T * (1.0 + _ROUNDING)
        beyond = ((displacement < least) | (displacement > most)).reshape(-1, len(least)).any(axis=0)
        if beyond.any():
            index = int(np.argmax(beyond))
            name = input_channels(self._robot)[index]
            low, high = self._range[index] * 1e3
            raise InputError(
                f"{self._robot.name}: {name}: beyond its joint's range, {low:.4g} to {high:.4g} mm"
            )

    def through_play(self, arrived: Array, displacement: Array) -> Array:
        """Return what arrives at the pairs, shape (..., p) [m], where `arrived` did before."""
        half = 0.5 * self._play
        return np.clip(arrived, displacement - half, displacement + half)

    def driven(self, arrived: Array) -> Array:
        """Return the model's controls, the first ones, for what arrives at the pairs, (..., p) [m]."""
        return self._sign * arrived[..., self._pair]

    def resist(self, data: mujoco.MjData) -> bool:
        """Let the bending joints resist as measured at the present angles; to be called before a step.

        Returns whether the joints' stiffness in the model may have changed.
        """
        for joint in self.resistances:
            joint.update(data)
        return bool(self.resistances)

    def bend_tubes(self, data: mujoco.MjData) -> None:
        """Let the exposed tubes bend as beams of their present length; to be called before a step."""
        for tube in self.tubes:
            tube.bend(data)

    def stretch(self, data: mujoco.MjData, gain: Array, bias: Array, length_gain: Array) -> bool:
        """Let the tendons stretch by their law; see `StretchLaws.update`. Return whether any has one."""
        if not self.stretching:
            return False
        self.stretching.update(data, gain, bias, length_gain)
        return True

    def turn(self, data: mujoco.MjData) -> None:
        """Let the torsion joints' actuators be their pairs at the present angles and controls."""
        if not len(self._turns):
            return
        self._model.actuator_biasprm[self.torsion, :2] = self.tangent(data.qpos, data.ctrl)

    def torsion_arrays(self) -> TorsionArrays:
        """Return what `tangent` needs to know of the pairs."""
        return TorsionArrays(
            actuators=self.torsion,
            qpos=self._qpos,
            radius=self._radius,
            height=self._height,
            wrap=self._wrap,
            home=self._home,
            stiffness=self._stiffness,
            gain=self._gain,
        )

    def tangent(self, qpos: Array, ctrl: Array) -> Array:
        """Return bias and length gain of the actuators `torsion`, shape (..., k, 2).

        Args:
            qpos: positions, shape (..., nq).
            ctrl: controls, shape (..., nu).
        """
        angle, control = qpos[..., self._qpos], ctrl[..., self.torsion]
        short, arm = self._unwound(angle, control)
        moment, slope = self._stiffness * short * arm, self._stiffness * arm**2
        return np.stack([moment + slope * angle - self._gain * control, -slope], axis=-1)

    def turn_copies(self, copies: catheter_kernel.Index, qpos: Array, ctrl: Array, bias: Array) -> None:
        """`turn` in some of m copies.

        Args:
            copies: which.
            qpos, ctrl: positions and controls, shapes (m, nq) and (m, nu).
            bias: out: the actuators' parameters of bias, shape (m, nu, ...).
        """
        catheter_kernel.tangents_of(copies, self.torsion, self._qpos, self._law, qpos, ctrl, bias)

    def advance_copies(
        self,
        copies: catheter_kernel.Index,
        start: Array,
        change: Array,
        share: float,
        arrived: Array,
        ctrl: Array,
    ) -> None:
        """Set the controls of some of m copies, whose displacements move from `start` by a share of `change`.

        Args:
            copies: which, shape (k,).
            start, change: shape (k, p) [m].
            share: 0 to 1.
            arrived: in and out, of all: as in `through_play`, shape (m, p) [m].
            ctrl: out: shape (m, nu).
        """
        half = 0.5 * self._play
        catheter_kernel.advance_of(copies, start, change, share, half, self._pair, self._sign, arrived, ctrl)

    def pair_tension(self, qpos: Array, ctrl: Array, tendon_tension: Array) -> Array:
        """Return the tension of each pair's tauter tendon, shape (..., p) [N]; 0 of what is advanced.

        Args:
            qpos: positions, shape (..., nq).
            ctrl: controls, shape (..., nu).
            tendon_tension: of the bending joints' tendons, in the order of their actuators, (..., k) [N].
        """
        tension = np.zeros((*qpos.shape[:-1], len(self._robot.tendons)))
        for tendon, pair in enumerate(self._pulling_pair):
            tension[..., pair] = np.maximum(tension[..., pair], tendon_tension[..., tendon])
        short, _ = self._unwound(qpos[..., self._qpos], ctrl[..., self.torsion])
        tension[..., self._turns] = np.abs(self._stiffness * short)
        return tension

    def _unwound(self, angle: Array, displacement: Array) -> tuple[Array, Array]:
        """Return by how much each torsion pair is stretched [m], and its arm [m/rad]: Eq. 6, its slope."""
        around = self._radius * np.maximum(self._wrap - np.abs(angle), 0.0)
        wrapped = np.hypot(around, self._height)
        drawn = np.copysign(self._home - wrapped, angle)
        # On a drum wrapped and around are one; at the wrap's very end both are 0.
        arm = self._radius * np.where(self._height > 0.0, around / np.where(wrapped > 0.0, wrapped, 1.0), 1.0)
        return displacement - drawn, arm


def pulling_actuators(robot: CatheterRobot, model: mujoco.MjModel) -> np.ndarray:
    """Return the actuators of the tendons of `robot`'s bending joints, in the model's order, shape (k,)."""
    driving = len(robot.tendons) + len(bent_by(robot))
    return np.flatnonzero(model.actuator_trntype[:driving] == int(mujoco.mjtTrn.mjTRN_TENDON))
