"""The measured laws of all copies' catheters: joints that resist, tendons that stretch, tubes that bend."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from catheter_sim.kinds.catheter.forces.resistance import JointResistance
from catheter_sim.kinds.catheter.forces.stretch import StretchLaws
from catheter_sim.kinds.catheter.forces.tube import Tube
from catheter_sim.kinds.catheter.warp import resistance_kernel, stretch_kernel, tube_kernel
from catheter_sim.mechanics.device import Copies, DeviceLaw


class Resistance(DeviceLaw):
    """`kinds.catheter.forces.resistance` in every copy."""

    changes_joints = True

    def __init__(self, copies: Copies, joints: Sequence[JointResistance]) -> None:
        """Prepare; the joints must be new."""
        self._copies = copies
        each = [joint.arrays() for joint in joints]
        places, numbers = (
            [np.concatenate(column) for column in zip(*rows, strict=True)] for rows in zip(*each, strict=True)
        )
        gaps = len(places[0])
        self._shape = (gaps,)
        self._fixed = [copies.whole(item) for item in places] + [copies.real(item) for item in numbers]
        self._history = [copies.room(gaps), copies.room(gaps), copies.room(2, gaps)]
        self._springs = [copies.own("jnt_stiffness"), copies.own("qpos_spring")]
        self._home = [copies.wp.clone(item) for item in self._springs]

    def before(self) -> None:
        """Let the gaps' springs have the moments of the law."""
        data = self._copies.data
        state = data.qpos, data.qfrc_actuator, data.qfrc_applied
        kernel = resistance_kernel.update
        self._copies.launch(kernel, self._shape, *self._fixed, *state, *self._history, *self._springs)

    def reset(self) -> None:
        """Return to unbent gaps without history."""
        for item in self._history:
            item.zero_()
        for item, home in zip(self._springs, self._home, strict=True):
            item.assign(home)


class Stretching(DeviceLaw):
    """`kinds.catheter.forces.stretch` in every copy."""

    def __init__(self, copies: Copies, laws: StretchLaws) -> None:
        """Prepare; the tendons must be new."""
        self._copies = copies
        layout = laws.layout()
        self._shape = layout.actuators.shape
        law = [value for field in dataclasses.astuple(layout.law) for value in np.atleast_1d(field)]
        self._fixed = [stretch_kernel.Law(*law), copies.whole(layout.actuators), copies.whole(layout.tendons)]
        self._fixed += [copies.real(item) for item in (layout.rest, layout.length, layout.compliance)]
        self._states = copies.room(*self._shape, dtype=stretch_kernel.State)
        self._actuators = [copies.own("actuator_gainprm"), copies.own("actuator_biasprm")]
        self._home = [copies.wp.clone(item) for item in self._actuators]

    def between(self) -> None:
        """Make the actuators the tangents of the law."""
        data = self._copies.data
        state = data.ctrl, data.ten_length, self._states
        self._copies.launch(stretch_kernel.update, self._shape, *self._fixed, *state, *self._actuators)

    def reset(self) -> None:
        """Return to new tendons."""
        self._states.zero_()
        for item, home in zip(self._actuators, self._home, strict=True):
            item.assign(home)


class Tubes(DeviceLaw):
    """`kinds.catheter.forces.tube` in every copy."""

    def __init__(self, copies: Copies, tubes: Sequence[Tube]) -> None:
        self._copies, self._shape = copies, (len(tubes),)
        layouts = [tube.layout() for tube in tubes]
        self._fixed = [copies.whole(np.array([item.places for item in layouts]))]
        names = "curvature", "beyond_m", "springs", "drive_stiffness"
        self._fixed += [copies.real(np.array([getattr(item, name) for item in layouts])) for name in names]
        fields = "tendon_stiffness", "tendon_lengthspring", "qpos_spring"
        self._springs = [copies.own(name) for name in fields]
        self._springs += [copies.own("actuator_gainprm"), copies.own("actuator_biasprm")]

    def before(self) -> None:
        """Let springs and drives be those of the present lengths and angles."""
        data = self._copies.data
        forces = data.qfrc_smooth, data.qfrc_passive, data.qfrc_actuator, data.qfrc_constraint
        kernel = tube_kernel.update
        self._copies.launch(kernel, self._shape, *self._fixed, data.qpos, *forces, *self._springs)
