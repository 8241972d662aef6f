"""Which forces run beside a catheter's step: tubes that bend, joints, pairs and tendons as measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.optimize import brentq

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import CopiesLaw, CopyArrays, Law, RobotInModel, Step, TendonPaths
from catheter_sim.errors import InputError
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.hysteresis import play_step, played
from catheter_sim.robots.catheter.description import (
    ACTUATIONS,
    bending_tubes,
    bent_by,
    drives,
    moved_segments,
    tube_stiffness_N_m2,
)
from catheter_sim.robots.catheter.kinematics import (
    SKEW_STIFFNESS,
    chord_share,
    end_turn,
    end_twist_rad,
    input_range_m,
)
from catheter_sim.robots.catheter.measured import (
    LAWS,
    PRINTED,
    JointForce,
    TendonLaw,
    TendonState,
    permanent_set,
    stretched,
)
from catheter_sim.robots.catheter.model import tendon_stiffness, tube_joint_names, tube_spring
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment, TendonPair

# ----------------------------------------------------------------------------------------------------
# What drives one catheter or many copies, compiled: the torsion pairs' tangents and the pairs' plays.
#
# The tests hold the tangents to `TorsionPairs.tension` and its slope, and the plays to
# `PairControls.arriving`. Index i picks among the m copies.


@compiled
def tangents(actuators: Index, places: Index, law: Array, qpos: Array, ctrl: Array, bias: Array) -> None:
    """Make one catheter's torsion joints' actuators the tangents of their pairs' law.

    `actuators` and `places` of their angles in `qpos`, (k,); `law`: radius, wrap's height [m], wrap [rad],
    home length [m], stiffness, actuator's gain [N/m], (k, 6). Out: bias and length gain, at bias[:, :2].
    """
    for k in range(actuators.shape[0]):
        radius, height, wrap, home = law[k, 0], law[k, 1], law[k, 2], law[k, 3]
        stiffness, gain = law[k, 4], law[k, 5]
        angle, control = qpos[places[k]], ctrl[actuators[k]]
        around = radius * max(wrap - abs(angle), 0.0)
        wrapped = math.hypot(around, height)
        arm = radius
        if height > 0.0:  # on a drum wrapped and around are one; at the wrap's very end both are 0
            arm *= around / (wrapped if wrapped > 0.0 else 1.0)
        short = control - math.copysign(home - wrapped, angle)
        slope = stiffness * arm**2
        bias[actuators[k], 0] = stiffness * short * arm + slope * angle - gain * control
        bias[actuators[k], 1] = -slope


@compiled
def tangents_of(
    copies: Index, actuators: Index, places: Index, law: Array, qpos: Array, ctrl: Array, bias: Array
) -> None:
    """Do it for those of m copies that `copies` picks: an axis of m before those of all that changes."""
    for i in copies:
        tangents(actuators, places, law, qpos[i], ctrl[i], bias[i])


@compiled
def advance_of(
    copies: Index,
    start: Array,
    change: Array,
    share: float,
    half_play: Array,
    pair: Index,
    sign: Array,
    arrived: Array,
    ctrl: Array,
) -> None:
    """Set the controls for displacements that have moved by a share of their change.

    `start` and `change` of the chosen k copies, (k, p) [m]; `half_play` of each pair [m]; `pair` and `sign`
    of each driven actuator, the first ones in `ctrl`, (a,). In and out: what arrives at the pairs, (m, p)
    [m].
    """
    for row in range(copies.shape[0]):
        i = copies[row]
        for p in range(start.shape[1]):
            wanted = start[row, p] + change[row, p] * share
            arrived[i, p] = played(arrived[i, p], wanted, half_play[p])
        for a in range(pair.shape[0]):
            ctrl[i, a] = sign[a] * arrived[i, pair[a]]


# ----------------------------------------------------------------------------------------------------
# The pairs that turn a simulated catheter's torsion joints.


class TorsionPairs(Law):
    """The wrapped tendons of the torsion joints.

    With the displacement d, the pair's stiffness k and Eq. 6 of Nayar 2022 as the odd function
    l(theta) of the angle, the pair turns the joint with the moment k (d - l) dl/dtheta. It holds the joint
    from both sides. The antagonist, which Eq. 6 leaves too short where the wrap has a height, is
    taken to give way by just what it lacks, and to be taut at the angle of Eq. 7. Before each step the
    joint's actuator is made the tangent of that law, so that the integrator knows its stiffness.

    Attributes:
        pairs: their places among the robot's pairs, shape (k,).
        actuators, angles: their actuators, and where their angles are in the positions, shape (k,).
        law: their numbers, as `tangents` takes them, shape (k, 6).
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel) -> None:
        self._model = model = place.model
        moved = moved_segments(robot)
        turns = [index for index, segment in enumerate(moved) if segment.joint == "torsion"]
        modules = [moved[index] for index in turns]
        self.pairs = np.array(turns, dtype=int)
        names = [f"tendon_{robot.tendons[index].name}" for index in turns]
        self.actuators = np.array([place.actuator(name).id for name in names], dtype=int)
        self.angles = np.array([place.joint(module.name).qposadr[0] for module in modules], dtype=int)
        radius = np.array([module.tendon_radius_m for module in modules])
        height = np.array([module.wrap_height_m for module in modules])
        wrap = np.array([module.wrap_rad for module in modules])
        stiffness = np.array([tendon_stiffness(robot, robot.tendons[index]) for index in turns])
        gain = model.actuator_gainprm[self.actuators, 0]
        home = np.hypot(radius * wrap, height)
        self.law = np.stack([radius, height, wrap, home, stiffness, gain], axis=1)

    def actuate(self, step: Step) -> None:
        """Let the torsion joints' actuators be their pairs at the present angles and controls."""
        if len(self.pairs):
            data, bias = step.data, self._model.actuator_biasprm
            tangents(self.actuators, self.angles, self.law, data.qpos, data.ctrl, bias)

    def tension(self, qpos: Array, ctrl: Array) -> Array:
        """Return the tension of each pair's tauter tendon at qpos (..., nq), ctrl (..., nu), (..., k) [N]."""
        radius, height, wrap, home, stiffness, _ = self.law.T
        angle, displacement = qpos[..., self.angles], ctrl[..., self.actuators]
        around = radius * np.maximum(wrap - np.abs(angle), 0.0)
        drawn = np.copysign(home - np.hypot(around, height), angle)
        return np.abs(stiffness * (displacement - drawn))


class TorsionCopies(CopiesLaw):
    """The pairs in many copies."""

    def __init__(self, pairs: TorsionPairs, arrays: CopyArrays) -> None:
        self._pairs, self._arrays, self._bias = pairs, arrays, arrays.own("actuator_biasprm")

    def actuate(self, copies: Index) -> None:
        """Let the torsion joints' actuators be their pairs."""
        pairs, arrays = self._pairs, self._arrays
        if len(pairs.pairs):
            numbers = pairs.actuators, pairs.angles, pairs.law
            tangents_of(copies, *numbers, arrays.qpos, arrays.ctrl, self._bias)


# ----------------------------------------------------------------------------------------------------
# From the displacements of a catheter's pairs to the model's controls, and back to the pairs' tensions.

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
        moved = moved_segments(robot)
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

    def reset(self, copies: Index) -> None:
        """Centre the plays."""
        self._arrived[copies] = 0.0

    def set(self, copies: Index, start: Array, change: Array, share: float) -> None:
        """Set the controls for displacements that have moved by a share of their change, (k, p) [m]."""
        advance_of(
            copies, start, change, share, self._half, self._pair, self._sign, self._arrived, self._ctrl
        )


def pulling_actuators(robot: CatheterRobot, place: RobotInModel) -> np.ndarray:
    """Return the actuators of the tendons of `robot`'s bending joints, in the model's order, shape (k,)."""
    own = place.actuators()[: len(robot.tendons) + len(bent_by(robot))]
    return own[place.model.actuator_trntype[own] == int(mujoco.mjtTrn.mjTRN_TENDON)]


# ----------------------------------------------------------------------------------------------------
# Where the tendons of a catheter's bending joints rub: on their way to the base, and at the rings.


class PairTurns:
    """The angles by which a catheter's bending tendons turn: on their way to the base, then at the gaps.

    Halfway through a ring a tendon has turned by half of each gap beside it. Before the first gap it has
    turned by the robot's `path_rad` and by the bends of the joints that it passes.

    Attributes:
        path_rad: the robot's.
        gaps: of each pair, where its joint's gaps are in the positions.
        before: of each pair, the pairs whose joints it passes.
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel) -> None:
        self.path_rad, self._name = robot.path_rad, robot.name
        self.gaps = []
        for segment in bent_by(robot).values():
            names = [f"{segment.name}_{gap}" for gap in range(1, segment.rings + 2)]
            self.gaps.append(np.array([place.joint(name).qposadr[0] for name in names]))
        order = [robot.segments.index(segment) for segment in bent_by(robot).values()]
        self.before = [[other for other, k in enumerate(order) if k < own] for own in order]
        self._turn = np.zeros((2 * len(order), max(len(gaps) for gaps in self.gaps)))

    def __call__(self, data: mujoco.MjData, ends: np.ndarray | None = None) -> Array:
        """Return the turn before each span, shape (2 pairs, n) [rad], in a reused array."""
        bends = [data.qpos[gaps] for gaps in self.gaps]
        for row, own in enumerate(bends):
            passed = sum(abs(float(bends[other].sum())) for other in self.before[row])
            turn = 0.5 * np.abs(own + np.concatenate([[0.0], own[:-1]]))
            turn[0] += self.path_rad + passed
            self._turn[row, : len(own)] = self._turn[row + len(bends), : len(own)] = turn
        return self._turn

    def of_copies(self, copies: np.ndarray, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Refuse: the turns of many copies are not known.

        Raises:
            InputError: always.
        """
        raise InputError(f"{self._name}: friction of a catheter's pairs: not for many copies at once")


def tendon_paths(robot: CatheterRobot, place: RobotInModel) -> TendonPaths:
    """Return where the bending joints' tendons rub, in the order of the actuators that pull them."""
    bent = bent_by(robot)
    ends = np.array(2 * [segment.rings + 1 for segment in bent.values()])
    return TendonPaths(
        names=[f"{place.prefix}tendon_{pair}_{sign}" for sign in ("pos", "neg") for pair in bent],
        spans=int(ends.max()),
        ends=ends,
        span_of_dof={
            int(place.joint(f"{segment.name}_{gap}").dofadr[0]): gap - 1
            for segment in bent.values()
            for gap in range(1, segment.rings + 2)
        },
        turns=PairTurns(robot, place),
    )


# ----------------------------------------------------------------------------------------------------
# Bending joints of a simulated catheter that resist by Nayar 2023, Algorithm 2.
#
# The law is of a whole joint: its tendon's tension over the bend, higher on the way out than back. Each of
# its gaps gets the moment of that tension at the tendon's arm at its own share of the bend. Between the two
# curves a gap sticks: it is held by a spring a thousand times stiffer than the joint, which slips at either
# curve. Before each step the gap's joint stiffness and rest angle are made the tangent of that, so that the
# integrator and the tendons' friction know it; the joint's wires are replaced. Which tangent, the curve's
# or the holding spring's, depends on where the coming step goes.

STICK_RATIO = 1e3  # stiffness of a gap that sticks over its law's
# Of the same, where the law asks for no moment: wires bring the joint back. At the 3.4 deg below which the
# proximal joint's law asks for none, it is 0.01 N at the tendon.
LEAST_RATIO = 0.02
DIFFERENCE_DEG = 1e-4
APART = 0.95  # of the outward moment the inward one is less where the two curves count as two


class JointResistance:
    """The gaps of one bending joint and their history."""

    def __init__(self, segment: CatheterSegment, place: RobotInModel) -> None:
        """Start unbent."""
        self._law: JointForce = LAWS[segment.resistance]
        self._gaps = segment.rings + 1
        joints = [place.joint(f"{segment.name}_{gap}") for gap in range(1, self._gaps + 1)]
        self._ids = np.array([joint.id for joint in joints])
        self._qpos = np.array([int(joint.qposadr[0]) for joint in joints])
        self._dofs = np.array([int(joint.dofadr[0]) for joint in joints])
        self._model = model = place.model
        # per radian of one gap: its moment is the joint's, its angle a share of the joint's bend
        self._scale = np.degrees(1.0) * self._law.loading[1] * segment.arm_m * self._gaps
        law = self._law
        arms = segment.arm_m, segment.half_gap_m
        self._numbers = [np.array(item) for item in (arms, law.loading, law.bounds_deg, law.c_1, law.c_2)]
        self._own = model.jnt_stiffness[self._ids].copy(), model.qpos_spring[self._qpos].copy()
        self.reset()

    def reset(self) -> None:
        """Return to unbent gaps without history."""
        self._model.jnt_stiffness[self._ids], self._model.qpos_spring[self._qpos] = self._own
        self._angle = np.zeros(self._gaps)
        self._moment = np.zeros(self._gaps)
        self._turn = np.zeros((2, self._gaps))  # toward + and toward - [deg]

    def arrays(self) -> tuple[list[np.ndarray], list[Array]]:
        """Return the law as plain arrays with a row for each of n gaps, for where it runs elsewhere.

        Places in MuJoCo: joints, positions, degrees of freedom. Numbers: gaps of the joint, moment per radian
        [N m/rad], arm and half gap, (n, 2) [m], and of Algorithm 2 `loading`, `bounds_deg`, `c_1` and `c_2`.
        """
        numbers = np.array(float(self._gaps)), np.array(self._scale), *self._numbers
        rows = [np.repeat(item[np.newaxis], self._gaps, axis=0) for item in numbers]
        return [self._ids, self._qpos, self._dofs], rows

    def update(self, data: mujoco.MjData) -> None:
        """Let the gaps' springs have the moments of the law at the present angles, before a step."""
        angle = data.qpos[self._qpos]
        stuck = self._moment + STICK_RATIO * self._scale * (angle - self._angle)
        low, high = self._bounds(angle)
        moment = np.clip(stuck, low, high)
        nudge = np.radians(DIFFERENCE_DEG) / self._gaps
        low_on, high_on = self._bounds(angle + nudge)
        # The forces of the step before say where the coming one goes.
        pulled = data.qfrc_actuator[self._dofs] + data.qfrc_applied[self._dofs]
        slope = np.where(
            (stuck > high) & (pulled >= moment), (high_on - high) / nudge, STICK_RATIO * self._scale
        )
        slope = np.where((stuck < low) & (pulled <= moment), (low_on - low) / nudge, slope)
        slope = np.maximum(slope, LEAST_RATIO * self._scale)
        bend = np.degrees(np.abs(angle)) * self._gaps
        side = np.where(angle >= 0.0, 0, 1)
        outward = np.where(angle >= 0.0, stuck >= high, stuck <= low)
        # Just below a turn both curves are one: a gap that trembles there has not turned again.
        apart = np.abs(np.where(angle >= 0.0, low, high)) < APART * np.abs(np.where(angle >= 0.0, high, low))
        own = np.arange(self._gaps)
        before = self._turn[side, own]
        self._turn[side, own] = np.where((outward & apart) | (bend > before), bend, before)
        self._angle, self._moment = angle.copy(), moment
        self._model.jnt_stiffness[self._ids] = slope
        self._model.qpos_spring[self._qpos] = angle - moment / slope

    def _bounds(self, angle: Array) -> tuple[Array, Array]:
        """Return the moments at which the gaps slip back and on, with the angle's sign, each (n,) [N m]."""
        low, high = np.empty(self._gaps), np.empty(self._gaps)
        _slipping(angle, self._turn, LEAST_RATIO * self._scale, *self._numbers, low, high)
        return low, high


@compiled
def _slipping(
    angle: Array,
    turn_deg: Array,
    least: float,
    arms: Array,
    loading: Array,
    bounds_deg: Array,
    c_1: Array,
    c_2: Array,
    low: Array,
    high: Array,
) -> None:
    """Write the moments at which the gaps of a joint slip back and on, low and high, (n,) [N m].

    As `joint_force` has them, at angles (n,) [rad]; `turn_deg`: to which each was last loaded, toward + and
    toward -, (2, n) [deg]; `least`: stiffness below which no moment falls [N m/rad].
    """
    gaps = len(angle)
    for k in range(gaps):
        size = abs(angle[k])
        bend, half = math.degrees(size) * gaps, 0.5 * size
        arm = arms[0] * math.cos(half) + arms[1] * math.sin(half)
        tension = loading[0] + bend * (loading[1] + bend * (loading[2] + bend * loading[3]))
        tension = max(tension, 0.0)
        turn = turn_deg[0 if angle[k] >= 0.0 else 1, k]
        piece = 0 if turn <= bounds_deg[0] else (1 if turn <= bounds_deg[1] else 2)
        back = 0.0
        if turn > 0.0:
            power = (min(bend, turn) / (turn + 0.01)) ** c_2[piece]
            back = min(tension / c_1[piece] * math.atanh(power), tension)
        on = max(tension * arm, least * size)
        back = max(back * arm, least * size)
        low[k], high[k] = (back, on) if angle[k] >= 0.0 else (-on, -back)


class JointResistances(Law):
    """The bending joints whose resistance was measured, in the order of their pairs.

    Attributes:
        joints: of each its gaps.
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel) -> None:
        self.joints = [JointResistance(segment, place) for segment in measured_joints(robot)]

    def reset(self) -> None:
        """Return to unbent gaps without history."""
        for joint in self.joints:
            joint.reset()

    def before(self, step: Step) -> None:
        """Let the joints resist as measured at the present angles."""
        for joint in self.joints:
            joint.update(step.data)
        step.joints_changed = True


def measured_joints(robot: CatheterRobot) -> list[CatheterSegment]:
    """Return the bending segments whose resistance was measured, in the order of their pairs."""
    return [segment for segment in bent_by(robot).values() if segment.resistance in LAWS]


# ----------------------------------------------------------------------------------------------------
# Simulated tendons of a catheter's bending joints that stretch by Nayar 2023, Algorithm 1.
#
# A pair whose `law` is "uhmwpe" stretches over its `length_m` by `elongation.PRINTED`, permanent set and
# cycles included, in series with its own stiffness. Before each step its actuator is made the tangent of
# that law at the present stretch, so that the integrator knows its stiffness.
#
# Every turn of the strain is a new cycle to the law. Strains that go back by less than `SHAKE` are not:
# they would be the settling of the simulation or the noise of a controller's sensor, far below any cycle
# that was measured, and are answered along the curve that is left.

SHAKE = 1e-4  # strain: 0.035 mm of 350 mm
DIFFERENCE = 1e-7  # strain, for a slope
LARGEST_STRAIN = 0.5  # no tendon comes near


@dataclass(frozen=True)
class Stretched:
    """A tendon at a stretch: its tension, below zero where it is slack [N], and its slope [N/m]."""

    tension_N: float
    stiffness_N_per_m: float


class StretchingTendon:
    """One tendon and its history: Algorithm 1 over `length` [m], in series with `compliance` [m/N]."""

    def __init__(self, length_m: float, stiffness_N_per_m: float, law: TendonLaw = PRINTED) -> None:
        """Start with a new tendon; a stiffness of inf: nothing is in series with it."""
        self.length, self.compliance, self._law = length_m, 1.0 / stiffness_N_per_m, law
        self.state = TendonState()

    def reset(self) -> None:
        """Return to a new tendon."""
        self.state = TendonState()

    def at(self, stretch_m: float) -> Stretched:
        """Return the tendon at a stretch [m], and remember that it was there."""
        law, before = self._law, self.state
        strain = self._strain(stretch_m)
        new = before.phase == "loading" and (before.strain <= 0.0 or strain > 0.0)
        slack = 0.0 if new else permanent_set(law, before)
        state = stretched(law, before, strain)
        forward = strain >= before.strain
        first_slope = law.envelope_N[2] / self.length
        soft = 1.0 / (1.0 / first_slope + self.compliance)
        if state.tension_N <= 0.0:
            # Below zero it says how far it is from being taut, as a slack spring does.
            result = Stretched(soft * min(stretch_m - slack * self.length, 0.0), soft)
        else:
            step = DIFFERENCE if forward else -DIFFERENCE
            slope = (stretched(law, before, strain + step).tension_N - state.tension_N) / step
            slope = max(slope, law.envelope_N[2]) / self.length
            result = Stretched(state.tension_N, 1.0 / (1.0 / slope + self.compliance))
        if _goes_on(before, strain) or abs(strain - before.strain) > SHAKE:
            self.state = state
        return result

    def _strain(self, stretch_m: float) -> float:
        """Return the strain of the law's part of a stretch in series with the spring."""
        if self.compliance == 0.0 or stretch_m <= 0.0:
            return stretch_m / self.length

        def excess(strain: float) -> float:
            tension = stretched(self._law, self.state, strain).tension_N
            return strain * self.length + tension * self.compliance - stretch_m

        return float(brentq(excess, 0.0, min(stretch_m / self.length, LARGEST_STRAIN), xtol=1e-14))


class StretchLaws(Law):
    """The stretching tendons of a model, in the order of the actuators that pull them.

    Attributes:
        actuators, numbers: of each in MuJoCo, shape (k,).
        rest: unstretched lengths, shape (k,) [m].
        tendons: each with its history.
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel, controls: PairControls) -> None:
        """Find the pairs whose tendons follow the law among the bending joints' that `controls` knows."""
        model, actuators, pairs = place.model, controls.pulls, controls.pulling_pair
        chosen = [index for index, pair in enumerate(pairs) if stretches(robot.tendons[pair])]
        self._places = np.array(chosen, dtype=int)
        self.actuators = actuators[self._places]
        items = [robot.tendons[int(pairs[index])] for index in chosen]
        self.tendons = [StretchingTendon(item.length_m, item.stiffness_N_per_m, PRINTED) for item in items]
        self.numbers = model.actuator_trnid[self.actuators, 0]
        self.rest = model.tendon_lengthspring[self.numbers, 0] + np.array([item.slack_m for item in items])
        self._model = model
        self._own = (
            model.actuator_gainprm[self.actuators].copy(),
            model.actuator_biasprm[self.actuators].copy(),
        )

    def reset(self) -> None:
        """Return to new tendons."""
        gain, bias = self._model.actuator_gainprm, self._model.actuator_biasprm
        gain[self.actuators], bias[self.actuators] = self._own
        for tendon in self.tendons:
            tendon.reset()

    def actuate(self, step: Step) -> None:
        """Make the actuators the tangents of the law at the present lengths and controls."""
        data, pulls = step.data, step.pulls
        stretch = data.ctrl[self.actuators] + data.ten_length[self.numbers] - self.rest
        for place, actuator, tendon, own in zip(
            self._places, self.actuators, self.tendons, stretch, strict=True
        ):
            found = tendon.at(float(own))
            slope = found.stiffness_N_per_m
            rest = data.ctrl[actuator] + data.ten_length[self._model.actuator_trnid[actuator, 0]]
            pulls.gain[place] = pulls.length_gain[place] = -slope
            pulls.bias[place] = slope * rest - found.tension_N
            self._model.actuator_gainprm[actuator, 0] = -slope
            self._model.actuator_biasprm[actuator, :2] = pulls.bias[place], -slope
        step.pulls_changed = True


def stretches(pair: TendonPair) -> bool:
    """Return whether a pair's tendons follow the measured law."""
    return pair.law == "uhmwpe"


def _goes_on(state: TendonState, strain: float) -> bool:
    """Return whether a strain continues the tendon's phase."""
    onward = strain - state.strain
    return onward <= 0.0 if state.phase == "unloading" else onward >= 0.0 or not math.isfinite(onward)


# ----------------------------------------------------------------------------------------------------
# Lets a simulated catheter's exposed tubes bend as beams of their present length.

# A shorter tube bends like one of this length. At no advance the module then yields by M / EI times it,
# where it should not: 0.006 deg under 1 N mm at an EI of 100 N mm^2.
SHORTEST_M = 1e-5


class TubeArrays(NamedTuple):
    """A tube as plain arrays, for where it runs elsewhere.

    Attributes:
        places: in MuJoCo: the hinges' positions toward x and y, at the exit and at the inlet, the slide's,
            the twist's. The slide's degree of freedom, its actuator, the springs against the whole bend
            and against skew, two each, shape (12,).
        curvature: at rest, toward x and y, shape (2,) [1/m].
        beyond_m: length of what the tube carries.
        springs: stiffness against the whole bend times length, and its part that no length changes,
            shape (2,) [N m^2, N m].
        drive_stiffness: of the drive [N/m].
    """

    places: np.ndarray
    curvature: np.ndarray
    beyond_m: float
    springs: np.ndarray
    drive_stiffness: float


class Tube:
    """One exposed tube: what the model's springs and drive are made before each step.

    The springs are given the law's moments at the present angles (through their rest lengths) and, for
    the integrator, which takes it implicitly, its stiffness near straight. The axial load of the law is
    that of the step before. The drive holds the length of the tube, not of the chord: its spring is the
    tangent. What the drive would feel of the bending energy that changes with the length is left out.
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel, segment: CatheterSegment) -> None:
        self._robot, self._segment = robot, segment
        self._model = model = place.model
        own = robot.segments.index(segment)
        self._beyond_m = sum(part.length_m for part in robot.segments[own:])
        self._curvature = (segment.tube_curvature_x_per_m, segment.tube_curvature_y_per_m)
        hinges = [int(place.joint(name).qposadr[0]) for name in tube_joint_names(segment)]
        self._exit_x, self._exit_y, self._twist, self._inlet_y, self._inlet_x = hinges
        self._slide = int(place.joint(segment.name).qposadr[0])
        self._slide_dof = int(place.joint(segment.name).dofadr[0])
        self._bend = [int(place.tendon(f"bend_{segment.name}_{axis}").id) for axis in "xy"]
        self._skew = [int(place.tendon(f"skew_{segment.name}_{axis}").id) for axis in "xy"]
        pair = next(item for item in robot.tendons if item.moves == segment.name)
        self._drive = int(place.actuator(f"tendon_{pair.name}").id)
        self._drive_stiffness = float(model.actuator_gainprm[self._drive, 0])

    def layout(self) -> TubeArrays:
        """Return what `bend` needs to know of the tube."""
        hinges = [self._exit_x, self._exit_y, self._inlet_x, self._inlet_y, self._slide, self._twist]
        places = [*hinges, self._slide_dof, self._drive, *self._bend, *self._skew]
        # EI over the length, or a stiffness that is the same at every length
        elastic = math.isfinite(tube_stiffness_N_m2(self._robot, self._segment))
        spring = tube_spring(self._robot, self._segment, 1.0)
        return TubeArrays(
            places=np.array(places),
            curvature=np.array(self._curvature),
            beyond_m=self._beyond_m,
            springs=np.array([spring, 0.0] if elastic else [0.0, spring]),
            drive_stiffness=self._drive_stiffness,
        )

    def reset(self) -> None:
        """Make the unloaded tube of no length straight."""
        self._model.qpos_spring[self._twist] = 0.0

    def bend(self, data: mujoco.MjData) -> None:
        """Let springs and drive be those of the present length and angles; to be called before a step."""
        model, q = self._model, data.qpos
        exit_x, exit_y, inlet_x, inlet_y = (
            float(q[k]) for k in (self._exit_x, self._exit_y, self._inlet_x, self._inlet_y)
        )
        chord = float(q[self._slide])
        (ax, ay), (axx, axy, ayx, ayy) = end_turn(exit_x, exit_y)
        (bx, by), (bxx, bxy, byx, byy) = end_turn(inlet_x, inlet_y)
        bend, skew = (ax + bx, ay + by), (ax - bx, ay - by)
        share, on_bend, on_skew = chord_share(math.hypot(*bend), math.hypot(*skew))
        length = max(chord / share, 0.0)
        stiffness = tube_spring(self._robot, self._segment, max(length, SHORTEST_M))
        # what pushes the module outward, as of the last step
        dof = self._slide_dof
        load = data.qfrc_smooth[dof] - data.qfrc_passive[dof] - data.qfrc_actuator[dof]
        load = float(load + data.qfrc_constraint[dof])
        axial = load * length
        moment = [
            (
                axial * on_bend * bend[k] - stiffness * (bend[k] - self._curvature[k] * length),
                axial * on_skew * skew[k] - SKEW_STIFFNESS * stiffness * skew[k],
            )
            for k in (0, 1)
        ]
        (mx, nx), (my, ny) = moment
        # A pull at the end holds the tube straight, which the integrator cannot know by itself.
        held = max(load, 0.0) * (length + self._beyond_m)
        tangent = stiffness + held, SKEW_STIFFNESS * stiffness + held
        # on the hinges at either end
        exit_moment = axx * (mx + nx) + ayx * (my + ny), axy * (mx + nx) + ayy * (my + ny)
        inlet_moment = bxx * (mx - nx) + byx * (my - ny), bxy * (mx - nx) + byy * (my - ny)
        angles = ((exit_x, inlet_x), (exit_y, inlet_y))
        for k, (near, far) in enumerate(angles):
            whole = 0.5 * (exit_moment[k] + inlet_moment[k])
            half = 0.5 * (exit_moment[k] - inlet_moment[k])
            self._set(self._bend[k], near + far - self._curvature[k] * chord, whole, tangent[0])
            self._set(self._skew[k], near - far, half, tangent[1])
        model.qpos_spring[self._twist] = end_twist_rad(inlet_x, inlet_y) - end_twist_rad(exit_x, exit_y)
        model.actuator_gainprm[self._drive, 0] = self._drive_stiffness / share
        model.actuator_biasprm[self._drive, 1] = -self._drive_stiffness / share**2

    def _set(self, spring: int, length: float, moment: float, stiffness: float) -> None:
        """Give a spring its stiffness, and the rest at which it pulls with the moment at its length."""
        self._model.tendon_stiffness[spring] = stiffness
        self._model.tendon_lengthspring[spring] = length + moment / stiffness


class Tubes(Law):
    """The exposed tubes that bend, base to tip.

    Attributes:
        tubes: each of them.
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel) -> None:
        self.tubes = [Tube(robot, place, segment) for segment in bending_tubes(robot)]

    def reset(self) -> None:
        """Make the unloaded tubes of no length straight."""
        for tube in self.tubes:
            tube.reset()

    def before(self, step: Step) -> None:
        """Let the tubes bend as beams of their present length."""
        for tube in self.tubes:
            tube.bend(step.data)


# ----------------------------------------------------------------------------------------------------
# Which forces run beside a catheter's step: tubes that bend, joints, pairs and tendons as measured.


def controls(robot: CatheterRobot, place: RobotInModel) -> PairControls:
    """Return what stands between the pairs' displacements and the actuators: plays and antagonists."""
    return PairControls(robot, place)


def laws(robot: CatheterRobot, place: RobotInModel) -> tuple[Law, ...]:
    """Return the laws but friction."""
    result: list[Law] = []
    if bending_tubes(robot):
        result.append(Tubes(robot, place))
    if measured_joints(robot):
        result.append(JointResistances(robot, place))
    result.append(TorsionPairs(robot, place))
    if stretching(robot):
        result.append(StretchLaws(robot, place, PairControls(robot, place)))
    return tuple(result)


def sliding_joints(robot: CatheterRobot) -> list[str]:
    """Return the joints that must stand still besides the hinges: what slides, and the bending tubes'."""
    names = [segment.name for segment in robot.segments if segment.joint == "prismatic"]
    return names + [name for segment in bending_tubes(robot) for name in tube_joint_names(segment)]


def stretching(robot: CatheterRobot) -> bool:
    """Return whether tendons of a bending joint follow the measured law."""
    return any(stretches(pair) for pair in robot.tendons if pair.name in bent_by(robot))
