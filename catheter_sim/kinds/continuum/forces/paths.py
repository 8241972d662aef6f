"""Where the tendons of a continuum robot rub: at the holes of its disks."""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import RobotInModel, TendonPaths
from catheter_sim.kinds.continuum.drives import outputs
from catheter_sim.kinds.continuum.layout import is_centred, is_planar, last_disk, links
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.mechanics import turns_kernel


def span_count(robot: ContinuumRobot) -> int:
    """Return the number of spans between holes from the base to the tip."""
    return outputs(robot).elements


def span_ends(robot: ContinuumRobot) -> np.ndarray:
    """Return how many spans between holes every tendon has, shape (t,)."""
    return np.array([last_disk(robot, tendon) for tendon in robot.tendons], dtype=int)


def hinge_spans(robot: ContinuumRobot, place: RobotInModel) -> dict[int, int]:
    """Return, for each hinge's degree of freedom, the span (from 0) whose length it changes."""
    spans: dict[int, int] = {}
    span = 0
    for link in links(robot):
        for letter in "xyt":
            name = f"{letter}{link.index}"
            if place.has_joint(name):
                spans[int(place.joint(name).dofadr[0])] = span
        span += bool(link.disk)
    return spans


class HoleTurns:
    """The angles by which tendons turn at their holes."""

    def __init__(self, robot: ContinuumRobot, place: RobotInModel) -> None:
        spans = span_count(robot)
        self.planar = is_planar(robot) and robot.links_per_subsegment == 1 and is_centred(robot)
        self._turn = np.zeros((len(robot.tendons), spans))
        self._base, self._axis = place.base, np.array([0.0, 0.0, 1.0])
        self.joints = np.zeros(0, dtype=int)
        self.sites = np.zeros((len(robot.tendons), 0), dtype=int)
        if self.planar:
            self.joints = np.array([place.joint(f"x{k}").qposadr[0] for k in range(1, spans + 1)])
            return
        self._ends = span_ends(robot)
        self.sites = np.zeros((len(robot.tendons), spans + 1), dtype=int)
        for index, tendon in enumerate(robot.tendons):
            for k in range(self._ends[index] + 1):
                self.sites[index, k] = place.site(f"hole_{tendon.name}_{k}").id

    def __call__(self, data: mujoco.MjData, ends: turns_kernel.Index | None = None) -> Array:
        """Return the turn at the hole before each span; see `core.law.Turns`."""
        if self.planar:
            turns_kernel.planar_turns(data.qpos, self.joints, self._turn)
        else:
            if self._base is not None:
                self._axis[:] = data.xmat[self._base, 2::3]
            last = self._ends if ends is None else ends
            turns_kernel.spatial_turns(data.site_xpos, self.sites, last, self._axis, self._turn)
        return self._turn

    def of_copies(self, copies: turns_kernel.Index, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Write the turns of some copies into `turn`; see `core.law.Turns`."""
        if self.planar:
            turns_kernel.planar_turns_of(copies, qpos, self.joints, turn)
        else:
            turns_kernel.spatial_turns_of(copies, site_xpos, self.sites, self._ends, self._axis, turn)


def paths(robot: ContinuumRobot, place: RobotInModel) -> TendonPaths:
    """Return where the tendons rub."""
    return TendonPaths(
        names=[f"{place.prefix}tendon_{tendon.name}" for tendon in robot.tendons],
        spans=span_count(robot),
        ends=span_ends(robot),
        span_of_dof=hinge_spans(robot, place),
        turns=HoleTurns(robot, place),
    )
