"""Where a robot's tip can be: tips by its twin under inputs drawn all over their ranges, each from rest.

Draws are even in the inputs, so that tips crowd where the robot moves little; the cloud's edge is what
matters. Where tendons pull, a robot has antagonists: half of the draws leave each of them slack as often as
not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import QUATERNION
from catheter_sim.core.drive import Quantity, quantity_of
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import built_in
from catheter_sim.errors import InputError
from catheter_sim.planning.drives import PlanDrives, inputs_at
from catheter_sim.planning.targets import axis_of
from catheter_sim.progress import counted
from catheter_sim.theory.predict import twin_for

_SLACK_SHARE = 0.5  # of tensions, in every second draw
_TOGETHER = 200  # draws that are solved at once
_TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")


@dataclass(frozen=True)
class Workspace:
    """Reachable tips.

    Attributes:
        inputs: under which, a row each.
        tip_mm: shape (n, 3) [mm].
        direction: of the tip's axis there, shape (n, 3).
        rejected: how many draws had no balance.
    """

    inputs: Inputs
    tip_mm: Array
    direction: Array
    rejected: int


def random_levels(drives: PlanDrives, count: int, rng: np.random.Generator) -> Array:
    """Return levels all over the drives' ranges, shape (count, d); of tensions many are slack."""
    levels = rng.uniform(drives.least, drives.most, (count, len(drives.names)))
    if quantity_of(drives.actuation) is Quantity.TENSION:
        levels[1::2] *= rng.random(levels[1::2].shape) >= _SLACK_SHARE
    return levels


def workspace(
    robot: RobotSpec,
    drives: PlanDrives,
    gravity_mps2: Array,
    samples: int,
    seed: int = 0,
    progress: bool = False,
) -> Workspace:
    """Return where inputs drawn within their ranges bring the tip, each from rest.

    Args:
        robot: as it is specified, effects named.
        drives: what may be asked of the inputs.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        samples: how many draws.
        seed: of the draws.
        progress: show on standard error how many are done.

    Raises:
        InputError: no draw has a balance.
    """
    specified = replace(robot, actuation=drives.actuation)
    built_in(specified)
    twin = twin_for(specified, drives.actuation, (*_TIP, *QUATERNION), gravity_mps2)
    levels = random_levels(drives, samples, np.random.default_rng(seed))
    clock = np.zeros(1)
    parts = []
    blocks = range(0, samples, _TOGETHER)
    for first in counted(blocks, len(blocks), "workspace", f"block of {_TOGETHER} draws", progress):
        histories = [
            inputs_at(drives, level[np.newaxis], clock) for level in levels[first : first + _TOGETHER]
        ]
        parts.append(twin.of_histories(specified, histories)[:, 0])
    outputs = np.concatenate(parts)
    kept = np.isfinite(outputs).all(axis=1)
    if not kept.any():
        raise InputError(f"{robot.name}: none of {samples} draws of its inputs has a balance")
    rows = np.arange(float(kept.sum()))
    return Workspace(
        inputs_at(drives, levels[kept], rows),
        outputs[kept, :3],
        axis_of(outputs[kept, 3:]),
        int((~kept).sum()),
    )
