"""What friction needs to know of a robot's tendons: where they turn, and which hinge changes which span."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.catheter_layout import bent_by
from catheter_sim.robots.channels import body_count
from catheter_sim.robots.kinds import Robot, require_continuum
from catheter_sim.robots.layout import is_planar, last_disk, links
from catheter_sim.robots.posture import Array
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.rolling_layout import last_joint, rolling_joints
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.simulation import turns_kernel
from catheter_sim.simulation.rolling import RodTurns


class Turns:
    """The angles by which tendons turn at their holes."""

    def __init__(self, robot: ContinuumRobot, model: mujoco.MjModel) -> None:
        spans = body_count(robot)
        self.planar = is_planar(robot) and robot.links_per_subsegment == 1
        self._turn = np.zeros((len(robot.tendons), spans))
        self.joints = np.zeros(0, dtype=int)
        self.sites = np.zeros((len(robot.tendons), 0), dtype=int)
        if self.planar:
            self.joints = np.array([model.joint(f"x{k}").qposadr[0] for k in range(1, spans + 1)])
            return
        self._ends = np.array([last_disk(robot, tendon) for tendon in robot.tendons])
        self.sites = np.zeros((len(robot.tendons), spans + 1), dtype=int)
        for index, tendon in enumerate(robot.tendons):
            for k in range(self._ends[index] + 1):
                self.sites[index, k] = model.site(f"hole_{tendon.name}_{k}").id

    def __call__(self, data: mujoco.MjData, ends: turns_kernel.Index | None = None) -> Array:
        """Return the turn at the hole before each span, shape (t, n) [rad], in a reused array.

        Args:
            data: the state.
            ends: of each tendon the spans that matter, 0 where none does; default: all, shape (t,).
        """
        if self.planar:
            turns_kernel.planar_turns(data.qpos, self.joints, self._turn)
        else:
            turns_kernel.spatial_turns(
                data.site_xpos, self.sites, self._ends if ends is None else ends, self._turn
            )
        return self._turn

    def of_copies(self, copies: turns_kernel.Index, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Write the turns of some of m copies of the model.

        Args:
            copies: which of the m.
            qpos: their positions, shape (m, nq).
            site_xpos: their sites, shape (m, s, 3) [m].
            turn: out, zero at first, shape (m, t, n) [rad].
        """
        if self.planar:
            turns_kernel.planar_turns_of(copies, qpos, self.joints, turn)
        else:
            turns_kernel.spatial_turns_of(copies, site_xpos, self.sites, self._ends, turn)


class PairTurns:
    """The angles by which a catheter's bending tendons turn: on their way to the base, then at the gaps.

    Halfway through a ring a tendon has turned by half of each gap beside it. Before the first gap it has
    turned by the robot's `path_rad` and by the bends of the joints that it passes.

    Attributes:
        path_rad: the robot's.
        gaps: of each pair, where its joint's gaps are in the positions.
        before: of each pair, the pairs whose joints it passes.
    """

    def __init__(self, robot: CatheterRobot, model: mujoco.MjModel, spans: int) -> None:
        self.path_rad = robot.path_rad
        self.gaps = []
        for segment in bent_by(robot).values():
            names = [f"{segment.name}_{gap}" for gap in range(1, segment.rings + 2)]
            self.gaps.append(np.array([model.joint(name).qposadr[0] for name in names]))
        order = [robot.segments.index(segment) for segment in bent_by(robot).values()]
        self.before = [[other for other, k in enumerate(order) if k < own] for own in order]
        self._turn = np.zeros((2 * len(order), spans))

    def __call__(self, data: mujoco.MjData, ends: turns_kernel.Index | None = None) -> Array:
        """Return the turn before each span, shape (2 pairs, n) [rad], in a reused array."""
        bends = [data.qpos[gaps] for gaps in self.gaps]
        for row, own in enumerate(bends):
            passed = sum(abs(float(bends[other].sum())) for other in self.before[row])
            turn = 0.5 * np.abs(own + np.concatenate([[0.0], own[:-1]]))
            turn[0] += self.path_rad + passed
            self._turn[row, : len(own)] = self._turn[row + len(bends), : len(own)] = turn
        return self._turn


class TendonRows:
    """Where the nonzero entries of chosen tendons' d(length)/d(q) lie in MuJoCo's sparse rows.

    Attributes:
        entries, columns: place in `ten_J` and degree of freedom of each, shape (e,).
        starts: first of each tendon, and behind the last, shape (t + 1,).
    """

    def __init__(self, model: mujoco.MjModel, names: list[str], dofs: set[int]) -> None:
        entries: list[int] = []
        columns: list[int] = []
        starts = [0]
        for name in names:
            tendon = model.tendon(name).id
            start, count = int(model.ten_J_rowadr[tendon]), int(model.ten_J_rownnz[tendon])
            for entry in range(start, start + count):
                if int(model.ten_J_colind[entry]) in dofs:
                    entries.append(entry)
                    columns.append(int(model.ten_J_colind[entry]))
            starts.append(len(entries))
        self.entries = np.array(entries, dtype=np.uint64)
        self.columns = np.array(columns, dtype=np.uint64)
        self.starts = np.array(starts, dtype=np.uint64)

    def lines(self, span: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return which tendons are simple: of each its first degree of freedom, or -1, shape (t,).

        Each degree of freedom of a simple one changes the length of one span, one after another as the
        spans are.

        Args:
            span: whose length each entry changes, shape (e,).
            ends: number of spans of each tendon, shape (t,).
        """
        found = np.full(len(ends), -1, dtype=np.int64)
        for tendon, count in enumerate(ends):
            own = slice(int(self.starts[tendon]), int(self.starts[tendon + 1]))
            columns, order = self.columns[own].astype(np.int64), np.arange(count)
            if count and np.array_equal(span[own], order) and np.array_equal(columns, columns[:1] + order):
                found[tendon] = columns[0]
        return found


def span_counts(robot: Robot) -> np.ndarray:
    """Return how many spans between holes every tendon has, shape (t,); none of a catheter's pair."""
    if isinstance(robot, CatheterRobot):
        return np.zeros(len(robot.tendons), dtype=int)
    if isinstance(robot, RollingRobot):
        return np.array([last_joint(robot, rod) for rod in robot.tendons], dtype=int)
    disked = require_continuum(robot, "the tendons' spans")
    return np.array([last_disk(disked, tendon) for tendon in disked.tendons], dtype=int)


def hinge_spans(robot: ContinuumRobot, model: mujoco.MjModel) -> dict[int, int]:
    """Return, for each hinge's degree of freedom, the span (from 0) whose length it changes."""
    spans: dict[int, int] = {}
    span = 0
    for link in links(robot):
        for letter in "xyt":
            joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{letter}{link.index}")
            if joint >= 0:
                spans[int(model.jnt_dofadr[joint])] = span
        span += bool(link.disk)
    return spans


@dataclass(frozen=True)
class Layout:
    """What the law needs to know of a robot's tendons.

    Attributes:
        names: of the model's tendons.
        spans: n, the most that a tendon could have.
        ends: number of spans of each, shape (t,).
        span_of_dof: the span (from 0) whose length each hinge's degree of freedom changes.
        turns: at the holes before the spans.
    """

    names: list[str]
    spans: int
    ends: np.ndarray
    span_of_dof: dict[int, int]
    turns: Turns | RodTurns | PairTurns


def layout_of(robot: Robot, model: mujoco.MjModel) -> Layout:
    """Return the tendons that rub, in the order of the actuators that pull them."""
    if isinstance(robot, CatheterRobot):
        bent = bent_by(robot)
        names = [f"tendon_{pair}_{sign}" for sign in ("pos", "neg") for pair in bent]
        ends = np.array(2 * [segment.rings + 1 for segment in bent.values()])
        span_of_dof = {
            int(model.joint(f"{segment.name}_{gap}").dofadr[0]): gap - 1
            for segment in bent.values()
            for gap in range(1, segment.rings + 2)
        }
        spans = int(ends.max())
        return Layout(names, spans, ends, span_of_dof, PairTurns(robot, model, spans))
    names, spans = [f"tendon_{tendon.name}" for tendon in robot.tendons], body_count(robot)
    if isinstance(robot, RollingRobot):
        joints = {int(model.joint(j.name).dofadr[0]): j.index - 1 for j in rolling_joints(robot)}
        return Layout(names, spans, span_counts(robot), joints, RodTurns(robot, model))
    return Layout(names, spans, span_counts(robot), hinge_spans(robot, model), Turns(robot, model))
