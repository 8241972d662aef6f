"""Dry friction of tendons at every hole, with stick and slip.

Over a hole at which a tendon turns by phi, its tension T changes to anything in
[T exp(-mu phi), T exp(+mu phi)] while it sticks there, and to one of the two ends while it slips
(capstan). Whether it slips at hole k is decided by the length of everything beyond hole k, not by
the bending next to it.

MuJoCo has friction loss (a force up to a limit against a velocity), but no capstan.

`CapstanFriction` (shipped, "capstan") computes the tension of every span itself, before each step,
and hands MuJoCo the difference to the actuators' tension as an applied force. With the velocities
that the coming step would give, it asks for the tensions that stop every span that friction can
stop. Per tendon that is a convex problem on a chain, which `capstan.span_tensions` solves exactly
in a few microseconds; tendons that share joints are passed over in turn. At rest the law leaves all
tensions as they are, so a held posture does not creep. Inertia enters through each degree of
freedom's own implicit inertia (armature, damping, stiffness) alone: a lower bound of what the
integrator uses, so that the law never overcorrects.

`NestedFriction` (reference, "nested") leaves the decision to MuJoCo's solver: one tendon per hole,
from the hole to the tendon's end, whose velocity is exactly the sliding speed there, with a friction
loss T sinh(mu phi) and a pull T (cosh(mu phi) - 1). Its cost grows with the square of the number of
holes. It takes the tensions from the previous step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np

from catheter_sim.mjcf.friction_tails import SMALLEST_LIMIT
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.catheter_layout import bent_by
from catheter_sim.robots.channels import body_count
from catheter_sim.robots.kinds import Robot, require_continuum
from catheter_sim.robots.layout import is_planar, last_disk, links
from catheter_sim.robots.posture import Array
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.rolling_layout import last_joint, rolling_joints
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.simulation import capstan
from catheter_sim.simulation.rolling import RodTurns

SWEEPS = 20  # most passes over tendons that share joints, in one step
SWEEP_TOLERANCE = 1e-4  # they end when no tension changed by more than this share of the largest


class Friction(Protocol):
    """Pulls a model's tendons as friction lets them."""

    def apply(self, data: mujoco.MjData, actuator_tension: Array) -> None:
        """Add to `data.qfrc_applied` what friction changes.

        To be called between `mj_step1` and `mj_step2`.

        Args:
            data: the state.
            actuator_tension: tensions now, below zero where a driven tendon is slack, shape (t,) [N].
        """

    def span_tension(self, data: mujoco.MjData, actuator_tension: Array) -> Array:
        """Return the tension of every tendon in every span after a step, shape (t, n) [N]."""

    def reset(self) -> None:
        """Forget the history."""


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

    def __call__(self, data: mujoco.MjData, ends: capstan.Index | None = None) -> Array:
        """Return the turn at the hole before each span, shape (t, n) [rad], in a reused array.

        Args:
            data: the state.
            ends: of each tendon the spans that matter, 0 where none does; default: all, shape (t,).
        """
        if self.planar:
            capstan.planar_turns(data.qpos, self.joints, self._turn)
        else:
            capstan.spatial_turns(
                data.site_xpos, self.sites, self._ends if ends is None else ends, self._turn
            )
        return self._turn

    def of_copies(self, copies: capstan.Index, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Write the turns of some of m copies of the model.

        Args:
            copies: which of the m.
            qpos: their positions, shape (m, nq).
            site_xpos: their sites, shape (m, s, 3) [m].
            turn: out, zero at first, shape (m, t, n) [rad].
        """
        if self.planar:
            capstan.planar_turns_of(copies, qpos, self.joints, turn)
        else:
            capstan.spatial_turns_of(copies, site_xpos, self.sites, self._ends, turn)


class TendonRows:
    """Where the nonzero entries of chosen tendons' d(length)/d(q) lie in MuJoCo's sparse rows."""

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
        self.entries = np.array(entries, dtype=int)
        self.columns = np.array(columns, dtype=int)
        self.starts = np.array(starts, dtype=int)


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

    def __call__(self, data: mujoco.MjData, ends: capstan.Index | None = None) -> Array:
        """Return the turn before each span, shape (2 pairs, n) [rad], in a reused array."""
        bends = [data.qpos[gaps] for gaps in self.gaps]
        for row, own in enumerate(bends):
            passed = sum(abs(float(bends[other].sum())) for other in self.before[row])
            turn = 0.5 * np.abs(own + np.concatenate([[0.0], own[:-1]]))
            turn[0] += self.path_rad + passed
            self._turn[row, : len(own)] = self._turn[row + len(bends), : len(own)] = turn
        return self._turn


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


@dataclass(frozen=True)
class LawArrays:
    """The law as plain arrays, for where it runs elsewhere.

    Attributes:
        mu: friction coefficient.
        turns: whence the turns follow.
        spans: n.
        ends, starts, entries, dofs, span, yielding: as in `capstan.confine`.
    """

    mu: float
    turns: Turns | RodTurns | PairTurns
    spans: int
    ends: np.ndarray
    starts: np.ndarray
    entries: np.ndarray
    dofs: np.ndarray
    span: np.ndarray
    yielding: Array


class CapstanFriction:
    """The shipped law; see the module's text."""

    def __init__(self, robot: Robot, model: mujoco.MjModel, drive_stiffness: Array) -> None:
        """Prepare the law.

        Args:
            robot: the robot.
            model: its model.
            drive_stiffness: of the actuators against the tendons' lengthening, 0 where the tension is
                given, shape (t,) [N/m].
        """
        layout = layout_of(robot, model)
        self._mu, self._turns, self._ends = robot.friction.mu, layout.turns, layout.ends
        spans, tendons = layout.spans, len(layout.names)
        self._inside = np.arange(1, spans + 1) <= self._ends[:, np.newaxis]  # (t, n)
        self._rows = TendonRows(model, layout.names, set(layout.span_of_dof))
        self._span = np.array([layout.span_of_dof[int(dof)] for dof in self._rows.columns])
        self._timestep = float(model.opt.timestep)
        self._drive = drive_stiffness * self._timestep
        self._model = model
        self.know_joints()
        self._tension = np.zeros((tendons, spans))
        self._busy = np.zeros(tendons, dtype=np.int64)
        self._holes = np.zeros((2, tendons, spans))
        self._pulls = np.zeros((2, len(self._span)))
        self._scratch = np.zeros((7, 2 * max(spans, model.nv, tendons)))

    def reset(self) -> None:
        """Forget the history."""
        self._tension[:] = 0.0

    def layout(self) -> LawArrays:
        """Return the law as plain arrays."""
        rows = self._rows
        return LawArrays(
            mu=self._mu,
            turns=self._turns,
            spans=self._tension.shape[1],
            ends=self._ends,
            starts=rows.starts,
            entries=rows.entries,
            dofs=rows.columns,
            span=self._span,
            yielding=self._yielding,
        )

    def know_joints(self) -> None:
        """Take over the stiffness of the model's joints; to be called where it has changed."""
        model = self._model
        stiffness = np.zeros(model.nv)
        stiffness[model.jnt_dofadr] = model.jnt_stiffness
        mass = model.dof_armature + self._timestep * (model.dof_damping + self._timestep * stiffness)
        self._yielding = self._timestep / mass

    def set_drive(self, stiffness: Array) -> None:
        """Set the actuators' stiffness against the tendons' lengthening, shape (t,) [N/m]."""
        self._drive = stiffness * self._timestep

    def apply(self, data: mujoco.MjData, actuator_tension: Array) -> None:
        """Find the tensions of the coming step and apply what they pull beyond the actuators."""
        rows, busy = self._rows, self._busy
        capstan.busy_spans(actuator_tension, self._drive, self._ends, self._tension, busy)
        capstan.confine(
            self._mu,
            actuator_tension,
            self._drive,
            self._turns(data, busy),
            busy,
            data.ten_J,
            rows.starts,
            rows.entries,
            rows.columns,
            self._span,
            data.qvel,
            data.qfrc_passive,
            data.qfrc_bias,
            data.qfrc_constraint,
            data.qfrc_applied,
            self._yielding,
            SWEEPS,
            SWEEP_TOLERANCE,
            self._tension,
            self._holes,
            self._pulls,
            self._scratch,
        )

    def span_tension(self, data: mujoco.MjData, actuator_tension: Array) -> Array:
        """Return the tension of every tendon in every span after a step, shape (t, n) [N].

        Where several tendons act on one hinge that sticks, statics fixes only one sum of them.
        """
        return np.where(self._inside, self._tension, np.nan)


def friction_rows(model: mujoco.MjModel, names: list[str]) -> np.ndarray:
    """Return the rows of the constraint forces that belong to the friction of the named tendons.

    The rows stay where they are, because no friction limit is ever set to zero.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    kind = int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON)
    row_of = {int(data.efc_id[row]): row for row in range(data.nefc) if int(data.efc_type[row]) == kind}
    return np.array([row_of[model.tendon(name).id] for name in names], dtype=int)


class NestedFriction:
    """The reference law, hole by hole; see the module's text."""

    def __init__(self, robot: ContinuumRobot, model: mujoco.MjModel) -> None:
        self._model = model
        self._mu = robot.friction.mu
        self._turns = Turns(robot, model)
        ends = np.array([last_disk(robot, tendon) for tendon in robot.tendons])
        self._inside = np.arange(1, body_count(robot) + 1) <= ends[:, np.newaxis]
        names = [
            f"tail_{tendon.name}_{k}" for tendon in robot.tendons for k in range(last_disk(robot, tendon))
        ]
        self._ids = np.array([model.tendon(name).id for name in names])
        self._rows = friction_rows(model, names)
        self._tails = TendonRows(model, names, set(hinge_spans(robot, model)))

    def reset(self) -> None:
        """Forget the history: all of it is in the model's state."""

    def _march(self, data: mujoco.MjData, tension: Array) -> tuple[Array, Array, Array]:
        """Return limits, pulls, and tensions behind each hole, each of shape (t, n)."""
        angle = self._mu * self._turns(data)
        force = np.zeros(self._inside.shape)
        force[self._inside] = data.efc_force[self._rows] if data.nefc else 0.0
        limit, pull, behind = (np.zeros(self._inside.shape) for _ in range(3))
        current = tension.copy()
        for k in range(self._inside.shape[1]):
            limit[:, k] = current * np.sinh(angle[:, k])
            pull[:, k] = current * (np.cosh(angle[:, k]) - 1.0)
            current = current + pull[:, k] - np.clip(force[:, k], -limit[:, k], limit[:, k])
            behind[:, k] = current
        return limit, pull, behind

    def apply(self, data: mujoco.MjData, actuator_tension: Array) -> None:
        """Set the friction limits of the tails and their pulls."""
        limit, pull, _ = self._march(data, np.maximum(actuator_tension, 0.0))
        tails = self._tails
        capstan.add_pull(
            data.ten_J, tails.starts, tails.entries, tails.columns, pull[self._inside], data.qfrc_applied
        )
        self._model.tendon_frictionloss[self._ids] = np.maximum(limit[self._inside], SMALLEST_LIMIT)

    def span_tension(self, data: mujoco.MjData, actuator_tension: Array) -> Array:
        """Return the tension of every tendon in every span, shape (t, n) [N]."""
        return np.where(self._inside, self._march(data, actuator_tension)[2], np.nan)
