"""A simulated robot's inputs on their way to its actuators, and the tensions that come of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.drive import Drive, Quantity
from catheter_sim.core.law import Controls, Pulls, RobotInModel
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, shown
from catheter_sim.mechanics.hysteresis import clamp_slack
from catheter_sim.simulation.divergence import LARGEST_INPUT

ROUNDING_N = 1e-9  # by which a tension may lie below zero


def checked_numbers(where: str, value: Any, shape: tuple[int, ...], needed: str) -> Array:
    """Return `value` as an array of numbers of `shape`, none of which MuJoCo would put a zero in place of.

    Raises:
        InputError: it is none; `needed` says what would be one.
    """
    try:
        numbers = np.asarray(value)
        real = numbers.dtype.kind in "iuf" and numbers.shape == shape
    except ValueError:  # rows of different lengths
        real = False
    if not real:
        raise InputError(f"{where} = {shown(value)}: {needed}")
    if not (np.abs(numbers) <= LARGEST_INPUT).all():  # false of what is not a number
        raise InputError(f"{where} = {shown(value)}: finite numbers within {LARGEST_INPUT:g} are needed")
    return np.asarray(numbers, dtype=float)


def checked_inputs(robot: RobotSpec, drives: Sequence[Drive], value: Any) -> Array:
    """Return inputs of a robot's tendons as an array, shape (t,), SI.

    Raises:
        InputError: other than one finite number for each tendon, or a tension below zero.
    """
    names = [item.name for item in robot.tendons]
    listed = f" ({', '.join(names)})" if names else ""
    needed = f"{len(names)} numbers are needed, one for each of its tendons{listed}"
    where = f"{robot.name}: set_inputs: tendon"
    numbers = checked_numbers(where, value, (len(names),), needed)
    for drive in drives:
        for place in drive.tendons:
            if drive.quantity is Quantity.TENSION and numbers[place] < -ROUNDING_N:
                raise InputError(f"{where} {names[place]}: {numbers[place]:g} N: a tendon cannot push")
    return numbers


class Actuation:
    """The actuators of a robot in a model.

    Attributes:
        controls: what stands between inputs and actuators.
        pulls: the actuators that pull tendons.
        arrived: what arrives at the tendons now, shape (t,).
    """

    def __init__(self, place: RobotInModel, data: mujoco.MjData, controls: Controls, given: bool) -> None:
        """Prepare; `given`: whether the inputs are tensions."""
        model = place.model
        self._model, self._data, self.controls = model, data, controls
        pulls = controls.pulls
        bias, length_gain = model.actuator_biasprm[pulls, :2].T.copy()
        self.pulls = Pulls(
            pulls,
            model.actuator_trnid[pulls, 0].astype(np.int64),
            given,
            model.actuator_gainprm[pulls, 0].copy(),
            bias,
            length_gain,
        )
        # Control ranges are for sliders; a simulation takes what it is given.
        model.actuator_ctrllimited[place.actuators()] = 0
        self.arrived = np.zeros(len(controls.spans))
        self._ctrl_before = np.zeros(len(pulls))

    def reset(self) -> None:
        """Return to inputs of zero that have always been so."""
        self.arrived = np.zeros(len(self.controls.spans))
        self.set(self.arrived)
        self._ctrl_before[:] = 0.0

    def set(self, inputs: Array) -> None:
        """Set the controls of the following steps, by inputs of shape (t,).

        Raises:
            InputError: an input that the robot cannot follow.
        """
        controls = self.controls
        self.arrived = controls.arriving(self.arrived, inputs)
        self._data.ctrl[controls.actuators] = controls.controls(self.arrived)

    def tension(self) -> Array:
        """Return the tension of each input at the actuator, shape (t,) [N]; of a pair the tauter one's."""
        data = self._data
        pulled = np.maximum(self.pulls.tension(data), 0.0)
        return self.controls.tension(data.qpos, data.ctrl, pulled)

    def let_taut_tendons_slacken(self) -> None:
        """Clamp at zero only the tensions of tendons that were slack before the command changed.

        See `mechanics.hysteresis`; to be called once a step, where tendons are driven.
        """
        pulls, data = self.pulls, self._data
        clamp_slack(
            pulls.actuators,
            pulls.tendons,
            pulls.gain,
            pulls.bias,
            pulls.length_gain,
            data.ten_length,
            data.ctrl,
            self._ctrl_before,
            self._model.actuator_forcerange,
        )
