"""A catheter's laws on a Warp device."""

from __future__ import annotations

from typing import Any

import numpy as np

from catheter_sim.core.law import RobotInModel
from catheter_sim.kinds.catheter.forces.controls import PairControls
from catheter_sim.kinds.catheter.forces.paths import pair_turns
from catheter_sim.kinds.catheter.forces.resistance import JointResistances, measured_joints
from catheter_sim.kinds.catheter.forces.stretch import StretchLaws
from catheter_sim.kinds.catheter.forces.torsion import TorsionPairs
from catheter_sim.kinds.catheter.forces.tube import Tubes as OneTubes
from catheter_sim.kinds.catheter.laws import stretching
from catheter_sim.kinds.catheter.layout import bending_tubes
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.warp import turns_kernel
from catheter_sim.kinds.catheter.warp.measured_laws import Resistance, Stretching, Tubes
from catheter_sim.kinds.catheter.warp.torsion import Torsion
from catheter_sim.mechanics.device import Copies, DeviceLaw, DevicePulls, TurnsKernel


def laws(
    robot: CatheterRobot, place: RobotInModel, copies: Copies, pulls: DevicePulls, tension: Any
) -> tuple[DeviceLaw, ...]:
    """Return the laws but friction; see `mechanics.device.Gpu`."""
    result: list[DeviceLaw] = []
    if bending_tubes(robot):
        result.append(Tubes(copies, OneTubes(robot, place).tubes))
    if measured_joints(robot):
        result.append(Resistance(copies, JointResistances(robot, place).joints))
    torsion = TorsionPairs(robot, place)
    if len(torsion.pairs):
        result.append(Torsion(copies, torsion))
    if stretching(robot):
        result.append(Stretching(copies, StretchLaws(robot, place, PairControls(robot, place))))
    return tuple(result)


def turns(robot: CatheterRobot, place: RobotInModel, copies: Copies, ends: Any) -> TurnsKernel:
    """Return what finds the turns of the bending joints' tendons."""
    own = pair_turns(robot, place)
    pairs = len(own.gaps)
    gaps = np.zeros((pairs, max(len(each) for each in own.gaps)))
    passes = np.zeros((pairs, pairs))
    for pair, each in enumerate(own.gaps):
        gaps[pair, : len(each)] = each
        passes[pair, own.before[pair]] = 1
    path = copies.wp.float64(own.path_rad)
    arguments = [path, copies.data.qpos, copies.whole(gaps), ends, copies.whole(passes)]
    return turns_kernel.pair_turns, (pairs,), arguments
