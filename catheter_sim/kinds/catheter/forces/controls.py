"""From the displacements of a catheter's pairs to the model's controls, and back to the pairs' tensions."""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import RobotInModel
from catheter_sim.core.law_copies import CopyArrays
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.drives import ACTUATIONS, drives
from catheter_sim.kinds.catheter.forces import drive_kernel
from catheter_sim.kinds.catheter.forces.torsion import TorsionPairs
from catheter_sim.kinds.catheter.layout import bent_by, moved_segment
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory.drive import input_range_m
from catheter_sim.mechanics.play import play_step

_ROUNDING = 1e-9  # share of a range by which an input may lie beyond it


class PairControls:
    """`core.law.Controls` of a catheter, whose inputs are its pairs' displacements and advances.

    Play. What arrives at a pair follows its displacement with the pair's whole dead-band, centred at rest.
    It is taken step by step: inputs must pass through the points at which they turn.

    Attributes:
        actuators: the pairs', then the antagonists', shape (c,).
        pulls: those of the bending joints' tendons, shape (k,).
        pulling_pair: the pair of each of `pulls`.
        pair, sign: of each of `actuators`.
        play: of each pair [m].
        spans: none of any pair, which is two tendons.
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel) -> None:
        self._robot, model = robot, place.model
        moved = [robot.segments[moved_segment(robot, index)] for index in range(len(robot.tendons))]
        bending = [index for index, segment in enumerate(moved) if segment.joint == "bending"]
        # The order of the model's actuators: the pairs, then the antagonists.
        self.pair = np.array([*range(len(moved)), *bending], dtype=int)
        self.sign = np.array([1.0] * len(moved) + [-1.0] * len(bending))
        self.play = np.array([pair.play_m for pair in robot.tendons])
        self.spans = np.zeros(len(robot.tendons), dtype=int)
        self._range = np.stack(input_range_m(robot), axis=1)
        self.actuators = place.actuators()[: len(self.pair)]
        self.pulls = tendons = pulling_actuators(robot, place)
        self.pulling_pair = self.pair[np.searchsorted(self.actuators, tendons)]
        # Stiff as they are, they would show the ninth digit, at which the model's text ends.
        bias = model.actuator_biasprm
        slack = np.array([robot.tendons[pair].slack_m for pair in self.pulling_pair])
        rest = model.tendon_lengthspring[model.actuator_trnid[tendons, 0], 0] + slack
        bias[tendons, 0] = -bias[tendons, 1] * rest
        self._torsion = TorsionPairs(robot, place)

    def arriving(self, before: Array, inputs: Array) -> Array:
        """Return what arrives at the pairs, shape (..., p) [m], where `before` did.

        Raises:
            InputError: a displacement to which no angle belongs.
        """
        self._require_range(inputs)
        return play_step(before, inputs, self.play)

    def controls(self, arriving: Array) -> Array:
        """Return the controls of `actuators` for what arrives at the pairs, (..., p) [m]."""
        return self.sign * arriving[..., self.pair]

    def tension(self, qpos: Array, ctrl: Array, pulled: Array) -> Array:
        """Return the tension of each pair's tauter tendon, shape (..., p) [N]; 0 of what is advanced."""
        tension = np.zeros((*qpos.shape[:-1], len(self._robot.tendons)))
        for tendon, pair in enumerate(self.pulling_pair):
            tension[..., pair] = np.maximum(tension[..., pair], pulled[..., tendon])
        tension[..., self._torsion.pairs] = self._torsion.tension(qpos, ctrl)
        return tension

    def _require_range(self, displacement: Array) -> None:
        """Require that an angle belongs to every displacement, shape (..., p) [m].

        Raises:
            InputError: none does to one.
        """
        least, most = self._range.T * (1.0 + _ROUNDING)
        beyond = ((displacement < least) | (displacement > most)).reshape(-1, len(least)).any(axis=0)
        if beyond.any():
            index = int(np.argmax(beyond))
            name = drives(self._robot, ACTUATIONS[0])[index].column
            low, high = self._range[index] * 1e3
            raise InputError(
                f"{self._robot.name}: {name}: beyond its joint's range, {low:.4g} to {high:.4g} mm"
            )


class PairCopies:
    """The controls of many copies, each with what arrived at its pairs."""

    def __init__(self, controls: PairControls, arrays: CopyArrays) -> None:
        self._half, self._ctrl = 0.5 * controls.play, arrays.ctrl
        self._pair, self._sign = controls.pair, controls.sign
        self._arrived = np.zeros((len(arrays.ctrl), len(controls.play)))

    def reset(self, copies: drive_kernel.Index) -> None:
        """Centre the plays."""
        self._arrived[copies] = 0.0

    def set(self, copies: drive_kernel.Index, start: Array, change: Array, share: float) -> None:
        """Set the controls for displacements that have moved by a share of their change, (k, p) [m]."""
        drive_kernel.advance_of(
            copies, start, change, share, self._half, self._pair, self._sign, self._arrived, self._ctrl
        )


def pulling_actuators(robot: CatheterRobot, place: RobotInModel) -> np.ndarray:
    """Return the actuators of the tendons of `robot`'s bending joints, in the model's order, shape (k,)."""
    own = place.actuators()[: len(robot.tendons) + len(bent_by(robot))]
    return own[place.model.actuator_trntype[own] == int(mujoco.mjtTrn.mjTRN_TENDON)]
