"""Which forces run beside a continuum robot's step: the elastic law beyond its hinges' own, and friction."""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import (
    Controls,
    CopiesLaw,
    CopyArrays,
    FrictionLaw,
    Law,
    RobotInModel,
    Step,
    StraightControls,
    TendonPaths,
    Views,
)
from catheter_sim.mechanics import tendons
from catheter_sim.mechanics.capstan import add_pull
from catheter_sim.mechanics.tendons import TendonRows
from catheter_sim.robots.continuum.description import (
    axes_of,
    is_centred,
    is_planar,
    last_disk,
    links,
    outputs,
    winds_or_converges,
)
from catheter_sim.robots.continuum.friction_tails import SMALLEST_LIMIT
from catheter_sim.robots.continuum.spec import ContinuumRobot

# ----------------------------------------------------------------------------------------------------
# The part of the elastic law that a hinge's own polynomial in MJCF cannot hold.
#
# The law is M = EI (k + c3 k^3 + c5 k^5) of the curvature k, a vector in a robot that bends in space: M_x =
# EI k_x (1 + c3 |k|^2 + c5 |k|^4). MJCF holds c3 k_x^3 of each hinge by itself; the coupling of the two
# hinges and the fifth power are applied as forces.


class ElasticRemainder(Law):
    """Torques of the elastic law beyond what the model's joints have."""

    def __init__(self, robot: ContinuumRobot, place: RobotInModel) -> None:
        rows: list[tuple[int, int, int, int, float, float, float]] = []
        for link in links(robot):
            segment = link.segment
            coupled = segment.bending_axes == "xy" and segment.stiffness_cubic_m2 != 0.0
            if not coupled and segment.stiffness_quintic_m4 == 0.0:
                continue
            axes = axes_of(segment)
            if not axes:
                continue
            x = place.joint(f"{axes[0]}{link.index}")  # the one, where it bends in one plane
            y = place.joint(f"y{link.index}") if axes == "xy" else None
            rows.append(
                (
                    x.qposadr[0],
                    x.dofadr[0],
                    y.qposadr[0] if y is not None else -1,
                    y.dofadr[0] if y is not None else -1,
                    robot.stiffness_scale * segment.bending_stiffness_N_m2 / link.length_m,
                    segment.stiffness_cubic_m2 / link.length_m**2,
                    segment.stiffness_quintic_m4 / link.length_m**4,
                )
            )
        self.needed = bool(rows)
        table = np.array(rows or np.zeros((0, 7)))
        self._qx, self._dx, self._qy, self._dy = table[:, :4].astype(int).T
        self._stiffness, self._cubic, self._quintic = table[:, 4:].T
        self._spatial = self._qy >= 0
        self._rest = place.model.qpos_spring.copy()

    def arrays(self) -> tuple[list[np.ndarray], list[Array]]:
        """Return the law as plain arrays, for where it runs elsewhere.

        Returns:
            Places of the links' hinges in MuJoCo, positions and degrees of freedom about x, then about y
            (below zero: none), each of shape (k,). Stiffness [N m/rad], `cubic` and `quintic` of each, and
            all rest positions, shape (nq,).
        """
        places = [self._qx, self._dx, self._qy, self._dy]
        return places, [self._stiffness, self._cubic, self._quintic, self._rest]

    def between(self, step: Step) -> None:
        """Add the torques."""
        data = step.data
        on_x, on_y = self._torques(data.qpos)
        data.qfrc_applied[self._dx] -= on_x
        data.qfrc_applied[self._dy[self._spatial]] -= on_y

    def add_to_copies(self, copies: np.ndarray, qpos: Array, applied: Array) -> None:
        """`between` in some of m copies: positions (m, nq), applied forces (m, nv)."""
        on_x, on_y = self._torques(qpos[copies])
        applied[np.ix_(copies, self._dx)] -= on_x
        applied[np.ix_(copies, self._dy[self._spatial])] -= on_y

    def _torques(self, qpos: Array) -> tuple[Array, Array]:
        """Return what the hinges about x, and those about y that are there, lack at `qpos`, (..., nq)."""
        x = qpos[..., self._qx] - self._rest[self._qx]
        y = np.where(self._spatial, qpos[..., self._qy] - self._rest[self._qy], 0.0)
        square = x**2 + y**2
        fifth = self._quintic * square**2
        on_x = self._stiffness * x * (self._cubic * y**2 + fifth)
        on_y = self._stiffness * y * (self._cubic * x**2 + fifth)
        return on_x, on_y[..., self._spatial]


class ElasticCopies(CopiesLaw):
    """The law in many copies."""

    compiled = False

    def __init__(self, law: ElasticRemainder, arrays: CopyArrays) -> None:
        self._law, self._arrays = law, arrays

    def between(self, copies: np.ndarray) -> None:
        """Add the torques."""
        self._law.add_to_copies(copies, self._arrays.qpos, self._arrays.applied)


# ----------------------------------------------------------------------------------------------------
# The part of a backbone that yields: it follows the bend of each link as far as it holds, then slips.

ALONE = np.zeros(1, dtype=np.int64)  # of copies, where there is one robot


class PlasticParts(Law):
    """Torques of the parts that yield (`spec.Segment.plastic_share`), by the way that each link has bent."""

    def __init__(self, robot: ContinuumRobot, place: RobotInModel) -> None:
        parts = [item for item in links(robot) if item.segment.plastic_share and axes_of(item.segment)]
        hinges = [[place.joint(f"{axis}{item.index}") for axis in "xy"] for item in parts]
        self.needed = bool(parts)
        self._qpos = np.array([[hinge.qposadr[0] for hinge in pair] for pair in hinges], int).reshape(-1, 2)
        self._dofs = np.array([[hinge.dofadr[0] for hinge in pair] for pair in hinges], int).reshape(-1, 2)
        self._rest = place.model.qpos_spring[self._qpos].copy()
        scale = robot.stiffness_scale
        self._stiffness = np.array(
            [
                item.segment.plastic_share * scale * item.segment.bending_stiffness_N_m2 / item.length_m
                for item in parts
            ]
        )
        self._most = np.array([item.segment.yield_curvature_per_m * item.length_m for item in parts])
        self._slipped = np.zeros((1, len(parts), 2))
        self._state = Views("qpos", "qfrc_applied", one_copy=True)

    def slipped(self, count: int) -> Array:
        """Return how far the parts of so many copies have slipped at rest, shape (m, k, 2) [rad]."""
        return np.zeros((count, *self._slipped.shape[1:]))

    def reset(self) -> None:
        """Let all parts stand where the links rest."""
        self._slipped[:] = 0.0

    def between(self, step: Step) -> None:
        """Add the torques."""
        qpos, applied = self._state(step.data)
        self.add_to_copies(ALONE, qpos, applied, self._slipped)

    def add_to_copies(self, copies: np.ndarray, qpos: Array, applied: Array, slipped: Array) -> None:
        """`between` in some of m copies: positions (m, nq), applied forces (m, nv), and as of `slipped`."""
        bent = qpos[np.ix_(copies, self._qpos.ravel())].reshape(-1, *self._qpos.shape) - self._rest
        held = bent - slipped[copies]
        size = np.sqrt((held**2).sum(axis=2))
        held *= np.minimum(1.0, self._most / np.maximum(size, 1e-300))[..., np.newaxis]
        slipped[copies] = bent - held
        torque = self._stiffness[:, np.newaxis] * held
        applied[np.ix_(copies, self._dofs.ravel())] -= torque.reshape(len(copies), -1)


class PlasticCopies(CopiesLaw):
    """The parts that yield in many copies, each with its own way."""

    compiled = False

    def __init__(self, law: PlasticParts, arrays: CopyArrays) -> None:
        self._law, self._arrays, self._slipped = law, arrays, law.slipped(len(arrays.qpos))

    def reset(self, copies: np.ndarray) -> None:
        """Let all parts stand where the links rest."""
        self._slipped[copies] = 0.0

    def between(self, copies: np.ndarray) -> None:
        """Add the torques."""
        self._law.add_to_copies(copies, self._arrays.qpos, self._arrays.applied, self._slipped)


# ----------------------------------------------------------------------------------------------------
# Where the tendons of a continuum robot rub: at the holes of its disks.


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
        self.planar &= not winds_or_converges(robot)
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

    def __call__(self, data: mujoco.MjData, ends: tendons.Index | None = None) -> Array:
        """Return the turn at the hole before each span; see `core.law.Turns`."""
        if self.planar:
            tendons.planar_turns(data.qpos, self.joints, self._turn)
        else:
            if self._base is not None:
                self._axis[:] = data.xmat[self._base, 2::3]
            last = self._ends if ends is None else ends
            tendons.spatial_turns(data.site_xpos, self.sites, last, self._axis, self._turn)
        return self._turn

    def of_copies(self, copies: tendons.Index, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Write the turns of some copies into `turn`; see `core.law.Turns`."""
        if self.planar:
            tendons.planar_turns_of(copies, qpos, self.joints, turn)
        else:
            tendons.spatial_turns_of(copies, site_xpos, self.sites, self._ends, self._axis, turn)


def paths(robot: ContinuumRobot, place: RobotInModel) -> TendonPaths:
    """Return where the tendons rub."""
    return TendonPaths(
        names=[f"{place.prefix}tendon_{tendon.name}" for tendon in robot.tendons],
        spans=span_count(robot),
        ends=span_ends(robot),
        span_of_dof=hinge_spans(robot, place),
        turns=HoleTurns(robot, place),
    )


# ----------------------------------------------------------------------------------------------------
# The reference law of friction: the decision at every hole is left to MuJoCo's solver.
#
# One tendon per hole, from the hole to the tendon's end, whose velocity is exactly the sliding speed there,
# with a friction loss T sinh(mu phi) and a pull T (cosh(mu phi) - 1). Its cost grows with the square of the
# number of holes. It takes the tensions from the previous step.


def friction_rows(model: mujoco.MjModel, names: list[str]) -> np.ndarray:
    """Return the rows of the constraint forces that belong to the friction of the named tendons.

    The rows stay where they are, because no friction limit is ever set to zero.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    kind = int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON)
    row_of = {int(data.efc_id[row]): row for row in range(data.nefc) if int(data.efc_type[row]) == kind}
    return np.array([row_of[model.tendon(name).id] for name in names], dtype=int)


class NestedFriction(Law):
    """The reference law, hole by hole; see the module's text."""

    def __init__(self, robot: ContinuumRobot, place: RobotInModel) -> None:
        self._model = model = place.model
        self._mu = robot.friction.mu
        self._turns = HoleTurns(robot, place)
        self._inside = np.arange(1, span_count(robot) + 1) <= span_ends(robot)[:, np.newaxis]
        names = [
            f"tail_{tendon.name}_{k}" for tendon in robot.tendons for k in range(last_disk(robot, tendon))
        ]
        self._ids = np.array([model.tendon(name).id for name in names])
        self._rows = friction_rows(model, names)
        self._tails = TendonRows(model, names, set(hinge_spans(robot, place)))

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

    def between(self, step: Step) -> None:
        """Set the friction limits of the tails and their pulls."""
        data = step.data
        limit, pull, _ = self._march(data, np.maximum(step.pulls.tension(data), 0.0))
        tails = self._tails
        add_pull(
            data.ten_J, tails.starts, tails.entries, tails.columns, pull[self._inside], data.qfrc_applied
        )
        self._model.tendon_frictionloss[self._ids] = np.maximum(limit[self._inside], SMALLEST_LIMIT)

    def span_tension(self, data: mujoco.MjData, actuator_tension: Array) -> Array:
        """Return the tension of every tendon in every span, shape (t, n) [N]."""
        return np.where(self._inside, self._march(data, actuator_tension)[2], np.nan)


# ----------------------------------------------------------------------------------------------------
# Which forces run beside a continuum robot's step: the elastic law beyond its hinges' own, and friction.


def controls(robot: ContinuumRobot, place: RobotInModel) -> Controls:
    """Return what stands between inputs and actuators: nothing."""
    return StraightControls(place, span_ends(robot))


def laws(robot: ContinuumRobot, place: RobotInModel) -> tuple[Law, ...]:
    """Return the laws but friction: none where the hinges hold the whole elastic law."""
    remainder, plastic = ElasticRemainder(robot, place), PlasticParts(robot, place)
    return tuple(law for law in (remainder, plastic) if law.needed)


def tendon_paths(robot: ContinuumRobot, place: RobotInModel) -> TendonPaths:
    """Return where the tendons rub: at the holes of the disks."""
    return paths(robot, place)


def sliding_joints(robot: ContinuumRobot) -> list[str]:
    """Return the joints that must stand still besides the hinges: none."""
    return []


def reference_friction(robot: ContinuumRobot, place: RobotInModel) -> FrictionLaw:
    """Return the reference law of friction; the model needs its tails (`mjcf.friction_tails`)."""
    return NestedFriction(robot, place)
