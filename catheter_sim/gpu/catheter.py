"""A catheter's laws on a Warp device."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from catheter_sim.core.law import RobotInModel
from catheter_sim.gpu.catheter_kernels import (
    GapsOnDevice,
    Law,
    State,
    TubesOnDevice,
    pair_turns_of_copies,
    turn_pairs,
    update_resistance,
    update_stretch,
    update_tubes,
)
from catheter_sim.gpu.device import DeviceCopies, DeviceLaw, DevicePulls, TurnsKernel
from catheter_sim.robots.catheter.description import bending_tubes
from catheter_sim.robots.catheter.laws import (
    JointResistance,
    JointResistances,
    PairControls,
    PairTurns,
    StretchLaws,
    TorsionPairs,
    Tube,
    measured_joints,
    stretching,
)
from catheter_sim.robots.catheter.laws import Tubes as OneTubes
from catheter_sim.robots.catheter.measured import PRINTED
from catheter_sim.robots.catheter.spec import CatheterRobot

# ----------------------------------------------------------------------------------------------------
# The pairs that turn the torsion joints of all copies' catheters.


class Torsion(DeviceLaw):
    """`robots.catheter.laws.TorsionPairs` in every copy."""

    def __init__(self, copies: DeviceCopies, torsion: TorsionPairs) -> None:
        self._copies, self._shape = copies, torsion.actuators.shape
        self._fixed = copies.whole(torsion.actuators), copies.whole(torsion.angles), copies.real(torsion.law)
        self._bias = copies.own("actuator_biasprm")

    def before(self) -> None:
        """Make the joints' actuators the tangents of their pairs."""
        data = self._copies.data
        self._copies.launch(turn_pairs, self._shape, *self._fixed, data.qpos, data.ctrl, self._bias)


# ----------------------------------------------------------------------------------------------------
# The measured laws of all copies' catheters: joints that resist, tendons that stretch, tubes that bend.


class Resistance(DeviceLaw):
    """`robots.catheter.laws` in every copy."""

    changes_joints = True

    def __init__(self, copies: DeviceCopies, joints: Sequence[JointResistance]) -> None:
        """Prepare; the joints must be new."""
        self._copies = copies
        each = [joint.arrays() for joint in joints]
        places, numbers = (
            [np.concatenate(column) for column in zip(*rows, strict=True)] for rows in zip(*each, strict=True)
        )
        gaps = len(places[0])
        self._shape = (gaps,)
        arrays = [copies.whole(item) for item in places] + [copies.real(item) for item in numbers]
        self._gaps = copies.filled(GapsOnDevice, *arrays)
        self._history = [copies.room(gaps), copies.room(gaps), copies.room(2, gaps)]
        self._springs = [copies.own("jnt_stiffness"), copies.own("qpos_spring")]
        self._home = [copies.wp.clone(item) for item in self._springs]

    def before(self) -> None:
        """Let the gaps' springs have the moments of the law."""
        data = self._copies.data
        state = data.qpos, data.qfrc_actuator, data.qfrc_applied
        kernel = update_resistance
        self._copies.launch(kernel, self._shape, self._gaps, *state, *self._history, *self._springs)

    def reset(self) -> None:
        """Return to unbent gaps without history."""
        for item in self._history:
            item.zero_()
        for item, home in zip(self._springs, self._home, strict=True):
            item.assign(home)


class DeviceStretching(DeviceLaw):
    """`robots.catheter.laws` in every copy."""

    def __init__(self, copies: DeviceCopies, laws: StretchLaws) -> None:
        """Prepare; the tendons must be new."""
        self._copies = copies
        self._shape = laws.actuators.shape
        law = [value for field in dataclasses.astuple(PRINTED) for value in np.atleast_1d(field)]
        lengths, compliances = zip(*((item.length, item.compliance) for item in laws.tendons), strict=True)
        self._fixed = [Law(*law), copies.whole(laws.actuators), copies.whole(laws.numbers)]
        self._fixed += [copies.real(item) for item in (laws.rest, lengths, compliances)]
        self._states = copies.room(*self._shape, dtype=State)
        self._actuators = [copies.own("actuator_gainprm"), copies.own("actuator_biasprm")]
        self._home = [copies.wp.clone(item) for item in self._actuators]

    def between(self) -> None:
        """Make the actuators the tangents of the law."""
        data = self._copies.data
        state = data.ctrl, data.ten_length, self._states
        self._copies.launch(update_stretch, self._shape, *self._fixed, *state, *self._actuators)

    def reset(self) -> None:
        """Return to new tendons."""
        self._states.zero_()
        for item, home in zip(self._actuators, self._home, strict=True):
            item.assign(home)


class DeviceTubes(DeviceLaw):
    """`robots.catheter.laws` in every copy."""

    def __init__(self, copies: DeviceCopies, tubes: Sequence[Tube]) -> None:
        self._copies, self._shape = copies, (len(tubes),)
        layouts = [tube.layout() for tube in tubes]
        places, *numbers = (np.array(column) for column in zip(*layouts, strict=True))
        self._tubes = copies.filled(
            TubesOnDevice, copies.whole(places), *(copies.real(item) for item in numbers)
        )
        fields = "tendon_stiffness", "tendon_lengthspring", "qpos_spring"
        self._springs = [copies.own(name) for name in fields]
        self._springs += [copies.own("actuator_gainprm"), copies.own("actuator_biasprm")]

    def before(self) -> None:
        """Let springs and drives be those of the present lengths and angles."""
        data = self._copies.data
        forces = data.qfrc_smooth, data.qfrc_passive, data.qfrc_actuator, data.qfrc_constraint
        self._copies.launch(update_tubes, self._shape, self._tubes, data.qpos, *forces, *self._springs)


# ----------------------------------------------------------------------------------------------------
# A catheter's laws on a Warp device.


def laws(
    robot: CatheterRobot, place: RobotInModel, copies: DeviceCopies, pulls: DevicePulls, tension: Any
) -> tuple[DeviceLaw, ...]:
    """Return the laws but friction; see `gpu.device.Gpu`."""
    result: list[DeviceLaw] = []
    if bending_tubes(robot):
        result.append(DeviceTubes(copies, OneTubes(robot, place).tubes))
    if measured_joints(robot):
        result.append(Resistance(copies, JointResistances(robot, place).joints))
    torsion = TorsionPairs(robot, place)
    if len(torsion.pairs):
        result.append(Torsion(copies, torsion))
    if stretching(robot):
        result.append(DeviceStretching(copies, StretchLaws(robot, place, PairControls(robot, place))))
    return tuple(result)


def turns(robot: CatheterRobot, place: RobotInModel, copies: DeviceCopies, ends: Any) -> TurnsKernel:
    """Return what finds the turns of the bending joints' tendons."""
    own = PairTurns(robot, place)
    pairs = len(own.gaps)
    gaps = np.zeros((pairs, max(len(each) for each in own.gaps)))
    passes = np.zeros((pairs, pairs))
    for pair, each in enumerate(own.gaps):
        gaps[pair, : len(each)] = each
        passes[pair, own.before[pair]] = 1
    path = copies.wp.float64(own.path_rad)
    arguments = [path, copies.data.qpos, copies.whole(gaps), ends, copies.whole(passes)]
    return pair_turns_of_copies, (pairs,), arguments
