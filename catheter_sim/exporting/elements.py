"""The elements of MJCF with which plain MuJoCo does what causes and laws do beside the package's step."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Form, Stage, Timing, Values
from catheter_sim.core.inputs import Inputs, quantity_of
from catheter_sim.core.posture import Observed
from catheter_sim.core.robot import Marker, R, RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import with_effects
from catheter_sim.mjcf import names
from catheter_sim.mjcf.document import Element
from catheter_sim.simulation.simulator import Simulator

# ----------------------------------------------------------------------------------------------------
# Which of a robot's causes an MJCF file can carry, and how: asked of their forms, never by their names.
#
# A form in the specification is in the robot that is built. A command that is a matrix times the inputs
# plus a constant is actuators' gains and biases; so is a constant force on the tip. A memory with a
# `timing` is an actuator's lag, delay or creep. What else remembers without a clock (play, friction before
# the robot) is in the loops that joints are fitted to. A view that is a rigid motion, or late, is that of
# the file's sensors.

EXACT, FITTED, LEFT = "as it is", "fitted", "not in the file"
BUILT = "in the model that is built"
IN_LOOPS = "in the loops that the joints' springs are fitted to"
_FAR_OFF = 1e3  # inputs at which commands are probed, in file units: no tension is clamped there
_TOLERANCE = 1e-6
_NEAR, _NEAR_TOLERANCE = (0.1, 0.5, 2.0), 1e-4  # what levels off far out is no line near zero, in file units


@dataclass(frozen=True)
class CarriedCause:
    """A form of a cause that is in a robot.

    Attributes:
        effect, form: their names.
        values: what is given of the form's parameters.
        way: `EXACT`, `FITTED` or `LEFT`.
        how: by which elements, or why not.
        timed: whether it shows in motion, against a clock, alone.
    """

    effect: str
    form: str
    values: Values
    way: str
    how: str
    timed: bool


@dataclass(frozen=True)
class Affine:
    """What arrives of inputs u: matrix @ u + bias, and a force on the tip.

    Attributes:
        matrix: shape (t, t).
        bias: shape (t,), SI.
        force_tip: shape (3,) [N].
    """

    matrix: Array
    bias: Array
    force_tip: Array


@dataclass(frozen=True)
class SensorView:
    """What is seen: p' = R p + shift, late by a delay.

    Attributes:
        R: shape (3, 3).
        shift: shape (3,) [m].
        delay_s: [s].
    """

    R: Array
    shift: Array
    delay_s: float


def find_causes(robot: RobotSpec) -> tuple[CarriedCause, ...]:
    """Return the forms that are in `robot`, in the order in which they act."""
    found = []
    for name, effect in EFFECTS.items():
        for form in effect.forms if name in robot.effects else ():
            given = robot.effects[name]
            own = {item.name: given[item.name] for item in form.parameters(robot) if item.name in given}
            nulls = {item.name: item.null for item in form.parameters(robot)}
            if all(value == nulls[key] for key, value in own.items()):
                continue
            found.append(CarriedCause(name, form.name, own, *_carried(robot, form, own)))
    return tuple(found)


def without(robot: R, causes: tuple[CarriedCause, ...]) -> R:
    """Return `robot` without some of its causes' forms."""
    effects = {name: dict(values) for name, values in robot.effects.items()}
    for cause in causes:
        for key in cause.values:
            effects.get(cause.effect, {}).pop(key, None)
        if not effects.get(cause.effect):
            effects.pop(cause.effect, None)
    return with_effects(robot, effects)


def _carried(robot: RobotSpec, form: Form, values: Values) -> tuple[str, str, bool]:
    """Return way, how and whether a form is timed."""
    if form.remembers:
        return LEFT, "no joint of MJCF yields", False
    if form.specify is not None:
        return EXACT, BUILT, form.in_motion
    if form.command is not None:
        affine = _affine_of(robot, form, values)
        return (FITTED, IN_LOOPS, False) if affine is None else (EXACT, _by(affine), False)
    if form.shape is not None:
        return LEFT, "the file's elements are not turned between their faces", False
    if form.observe is not None:
        rigid = _rigid_of(form, values)
        return (
            (LEFT, "no turn and shift of a sensor", False)
            if rigid is None
            else (EXACT, "sensors' frame", False)
        )
    timed = form.memory is not None and form.memory.timed
    if form.timing is not None:
        timing = form.timing(values)
        element = "sensor" if form.stage is Stage.OBSERVATION else "actuator"
        kinds = {"lag": timing.lag_s, "delay": timing.delay_s, "creep": timing.creep}
        return EXACT, f"{element}s' {', '.join(name for name, value in kinds.items() if value)}", timed
    if timed or form.stage is Stage.OBSERVATION:
        what = "sensor" if form.stage is Stage.OBSERVATION else "actuator"
        return LEFT, f"no {what} of MJCF has a memory like it", timed
    return FITTED, IN_LOOPS, False


def _by(affine: Affine) -> str:
    parts = {
        "actuators' gains": not np.allclose(np.diag(affine.matrix), 1.0, atol=_TOLERANCE),
        "actuators that pull another's tendon": bool(
            np.abs(affine.matrix - np.diag(np.diag(affine.matrix))).max(initial=0.0) > _TOLERANCE
        ),
        "actuators' biases": bool(affine.bias.any()),
        "an actuator of constant force on the tip": bool(affine.force_tip.any()),
    }
    return ", ".join(name for name, there in parts.items() if there) or "nothing: it does nothing"


def affine_of(robot: RobotSpec) -> Affine:
    """Return what the commands without memory in `robot` do to its inputs, one after the other."""
    tendons = len(robot.tendons)
    matrix, bias, force = np.eye(tendons), np.zeros(tendons), np.zeros(3)
    for name, effect in EFFECTS.items():
        for form in effect.forms if name in robot.effects else ():
            if form.command is None:
                continue
            own = _affine_of(robot, form, robot.effects[name])
            if own is not None:
                matrix, bias = own.matrix @ matrix, own.matrix @ bias + own.bias
                force = force + own.force_tip
    return Affine(matrix, bias, force)


def timing_of(robot: RobotSpec, stage: Stage) -> Timing:
    """Return the lag, delay and creep of `robot` at a stage: delays add up, of lags the longest counts."""
    found = Timing()
    for name, effect in EFFECTS.items():
        for form in effect.forms if name in robot.effects else ():
            if form.timing is None or form.stage is not stage:
                continue
            own = form.timing(robot.effects[name])
            found = Timing(
                max(found.lag_s, own.lag_s),
                found.delay_s + own.delay_s,
                own.creep or found.creep,
                own.creep_time_s if own.creep else found.creep_time_s,
            )
    return found


def view_of(robot: RobotSpec) -> SensorView:
    """Return how the robot is seen, as far as sensors can."""
    R, shift = np.eye(3), np.zeros(3)
    for name, effect in EFFECTS.items():
        for form in effect.forms if name in robot.effects else ():
            own = _rigid_of(form, robot.effects[name]) if form.observe is not None else None
            if own is not None:
                R, shift = own[0] @ R, own[0] @ shift + own[1]
    return SensorView(R, shift, timing_of(robot, Stage.OBSERVATION).delay_s)


def _affine_of(robot: RobotSpec, form: Form, values: Values) -> Affine | None:
    """Return what a command without memory does, if that is a matrix and a bias; probed far from zero."""
    assert form.command is not None
    tendons, unit = len(robot.tendons), quantity_of(robot.actuation).file_size
    levels = (
        _FAR_OFF
        * unit
        * np.concatenate([np.ones((1, tendons)), np.ones((tendons, tendons)) + np.eye(tendons)])
    )
    levels = np.concatenate(
        [levels, levels[:1] * np.linspace(1.3, 1.7, tendons), unit * np.outer(_NEAR, np.ones(tendons))]
    )
    nothing = np.zeros((len(levels), 3))
    probe = Inputs(np.arange(float(len(levels))), robot.actuation, levels, nothing, nothing)
    got = form.command(robot, probe, values)
    matrix = (got.tendon[1 : tendons + 1] - got.tendon[0]).T / (_FAR_OFF * unit)
    bias = got.tendon[0] - matrix @ levels[0]
    bias[np.abs(bias) < 1e-9 * _FAR_OFF * unit] = 0.0
    line = levels @ matrix.T + bias
    off = np.abs(line - got.tendon)
    straight = (off[tendons + 1] <= _TOLERANCE * _FAR_OFF * unit).all()
    near, asked = off[tendons + 2 :], line[tendons + 2 :] >= 0.0  # below, a tension may be clamped
    straight = bool(straight and (near[asked] <= _NEAR_TOLERANCE * unit).all())
    steady = np.allclose(got.force_tip, got.force_tip[0]) and not got.moment_tip.any()
    return Affine(matrix, bias, got.force_tip[0]) if straight and steady else None


def _rigid_of(form: Form, values: Values) -> tuple[Array, Array] | None:
    """Return the turn and shift (3, 3), (3,) of a view, if that is what it is."""
    assert form.observe is not None
    points = np.concatenate([np.zeros((1, 3)), np.eye(3), [[0.3, -0.2, 0.7]]])
    turns = np.tile(np.eye(3), (5, 1, 1))
    probe = Observed(
        np.arange(5.0), points[:, np.newaxis], turns[:, np.newaxis], np.zeros((5, 1)), np.zeros((5, 1))
    )
    seen = form.observe(probe, values)
    shift = seen.p_w[0, 0]
    R = (seen.p_w[1:4, 0] - shift).T
    rigid = np.allclose(R @ R.T, np.eye(3), atol=_TOLERANCE) and np.allclose(
        seen.R_w[0, 0], R, atol=_TOLERANCE
    )
    straight = np.allclose(R @ points[4] + shift, seen.p_w[4, 0], atol=_TOLERANCE)
    return (R, shift) if rigid and straight else None


def quasi_static(robot: R, causes: tuple[CarriedCause, ...]) -> R:
    """Return the robot with what bends it in held rows: without what only shows, or needs a clock."""
    late = tuple(
        cause for cause in causes if cause.timed or _stage(cause) in (Stage.SHAPE, Stage.OBSERVATION)
    )
    return without(robot, late)


def _stage(cause: CarriedCause) -> Stage:
    return next(form.stage for form in EFFECTS[cause.effect].forms if form.name == cause.form)


# ----------------------------------------------------------------------------------------------------
# Bodies that a simulation's laws move with their hinges, as slides that a polynomial ties to the hinge.
#
# Where a joint rolls, or a notch bends to an arc, the package moves the body at every step. What it does is
# a shift of the body that depends on its own hinge's angle alone; MuJoCo has that as a slide and an
# equality of two joints, a polynomial of the fourth order at most. The shift is worked out from the
# kinematics, not fitted to a run, and what the polynomial leaves is said.

_ANGLES = 61  # at which a shift is looked at
_LEAST_SHARE = 1e-5  # of the robot's length: smaller shifts are left out
_POWERS = np.arange(1, 5)


@dataclass(frozen=True)
class Shift:
    """A body's shift by its hinge.

    Attributes:
        joint: the hinge's name.
        body: the body's.
        axis: 0, 1 or 2, of the parent's frame.
        coefficients: of the angle's powers 1 to 4, shape (4,) [m].
        left_m: the most that the polynomial leaves.
    """

    joint: str
    body: str
    axis: int
    coefficients: Array
    left_m: float

    @property
    def slide(self) -> str:
        """The name of the slide in the file."""
        return f"shift_{self.joint}_{'xyz'[self.axis]}"

    def at(self, angle: float) -> float:
        """Return the shift at an angle [m]."""
        return float(angle**_POWERS @ self.coefficients)

    def slope(self, angle: float) -> float:
        """Return by how much it grows with the angle [m/rad]."""
        return float(_POWERS * angle ** (_POWERS - 1) @ self.coefficients)


def find_shifts(
    simulator: Simulator, plain: mujoco.MjModel, least: Array, most: Array, length_m: float
) -> tuple[Shift, ...]:
    """Return the shifts that the laws of a simulation give to bodies of its model.

    Args:
        simulator: of the robot, at rest.
        plain: the same model without laws: the same joints in the same order.
        least, most: angles between which the hinges move, shape (njnt,) [rad].
        length_m: of the robot.
    """
    if not simulator.laws.place:
        return ()
    data = mujoco.MjData(plain)
    found: list[Shift] = []
    hinge = int(mujoco.mjtJoint.mjJNT_HINGE)
    for joint in range(plain.njnt):
        if plain.jnt_type[joint] != hinge or most[joint] - least[joint] < 1e-6:
            continue
        angles = np.linspace(least[joint], most[joint], _ANGLES)
        shift = _shifts(simulator, plain, data, joint, angles)
        powers = angles[:, np.newaxis] ** _POWERS
        for axis in range(3):
            if np.abs(shift[:, axis]).max() < _LEAST_SHARE * length_m:
                continue
            coefficients = np.asarray(np.linalg.lstsq(powers, shift[:, axis], rcond=None)[0], float)
            left = np.abs(powers @ coefficients - shift[:, axis]).max()
            body = plain.body(plain.jnt_bodyid[joint]).name
            found.append(Shift(plain.joint(joint).name, body, axis, coefficients, float(left)))
    simulator.reset()
    return tuple(found)


def _shifts(
    simulator: Simulator, plain: mujoco.MjModel, data: mujoco.MjData, joint: int, angles: Array
) -> Array:
    """Return how far the laws move the body of a hinge at angles, in its parent's frame, shape (a, 3) [m]."""
    body = int(plain.jnt_bodyid[joint])
    parent, place = int(plain.body_parentid[body]), int(plain.jnt_qposadr[joint])

    def relative(model: mujoco.MjModel, state: mujoco.MjData, angle: float, moved: bool) -> Array:
        state.qpos[:] = model.qpos_spring
        state.qpos[place] = angle
        if moved:
            for law in simulator.laws.place:
                law(state)
        mujoco.mj_kinematics(model, state)
        turn = state.xmat[parent].reshape(3, 3)
        return np.asarray(turn.T @ (state.xpos[body] - state.xpos[parent]))

    def shift(angle: float) -> Array:
        own = relative(simulator.model, simulator.data, angle, True)
        return own - relative(plain, data, angle, False)

    straight = shift(0.0)
    return np.array([shift(float(angle)) - straight for angle in angles])


# ----------------------------------------------------------------------------------------------------
# What moments a plain model lacks at its hinges, read from a simulation at rest, and a law that gives them.
#
# The package's simulation is at rest in a posture under inputs. Put into the plain model, posture and
# inputs leave at each hinge a moment without balance: what friction, rods or metal do there, which run
# beside the step. Over loops that moment M against the hinge's angle q is a curve with two branches,
#
# M(q) = -(s(q) + sign(dq) (c + w |x| + v |x|^3)), x = q / q_most, s: piecewise linear, c, w, v >= 0,
#
# fitted by least squares to the rows in which the hinge moves. Capstan friction of one tendon that bends
# springs of stiffness K gives s = K q (cosh(mu a) - 1) and a width K q sinh(mu a), with the tendon's turn a
# up to the hinge. Both are functions of the posture here, where the capstan's depend on the tension. That
# is good where one tendon at a time moves a robot of springs, and wrong under loads and where tendons share
# joints or pull against one another. The turn a grows with q, so that the width grows about as q^2, for
# which w |x| + v |x|^3 stands to within 4 % of its largest value.

KNOTS = 8  # of the piecewise linear part, evenly over the hinge's range
_MOVES_SHARE = 2e-3  # of its range: by less a hinge sticks between two rows
_LEAST_RANGE_RAD = 1e-4  # of a hinge that is fitted
_LEAST_MOMENT_SHARE = 1e-3  # of the largest moment of a tendon: smaller ones are left out
_RIDGE = 1e-4


@dataclass(frozen=True)
class HingeLaw:
    """What is added to a hinge.

    Attributes:
        joint: its name.
        range_rad: largest angle to either side on the loops.
        stiffness: of a spring about zero; may be negative [N m/rad].
        knots: angles beyond which springs act, away from zero, with their stiffness [rad, N m/rad].
        constant: of friction that is the same at all angles, to either side [N m].
        width: of friction that grows with the angle, as a moment at `range_rad` to either side [N m].
        cubic: of friction that grows with the angle's third power, likewise [N m].
        left: root mean square of the moment that the law leaves, over the largest one of the tendons.
    """

    joint: str
    range_rad: float
    stiffness: float
    knots: tuple[tuple[float, float], ...]
    constant: float
    width: float
    cubic: float
    left: float


@dataclass(frozen=True)
class ExportRows:
    """What is known at each row of the loops.

    Attributes:
        angle: of the hinges, shape (r, m) [rad].
        missing: the moment that is lacking at them, shape (r, m) [N m].
        pulled: what the actuators give there, shape (r, m) [N m].
    """

    angle: Array
    missing: Array
    pulled: Array


def missing_moments(
    plain: mujoco.MjModel,
    joints: Sequence[str],
    shifts: Sequence[Shift],
    positions: Array,
    controls: Array,
) -> ExportRows:
    """Return the moments without balance in postures of a simulation at rest.

    Args:
        plain: with the slides of `shifts`, without constraints of its own; changed: they are switched off.
        joints: names of its hinges and slides whose positions are given.
        shifts: which slides hang on which hinge.
        positions: of `joints`, shape (r, m).
        controls: of all its actuators, shape (r, nu).
    """
    plain.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(plain)
    place = np.array([plain.joint(name).qposadr[0] for name in joints])
    dof = np.array([plain.joint(name).dofadr[0] for name in joints])
    index = {name: k for k, name in enumerate(joints)}
    slides = [
        (index[s.joint], plain.joint(s.slide).qposadr[0], plain.joint(s.slide).dofadr[0], s) for s in shifts
    ]
    missing, pulled = np.zeros_like(positions), np.zeros_like(positions)
    for row, own in enumerate(positions):
        data.qpos[place] = own
        for hinge, where, _, shift in slides:
            data.qpos[where] = shift.at(own[hinge])
        data.ctrl[:] = controls[row]
        mujoco.mj_forward(plain, data)
        acts = data.qfrc_actuator
        rest = data.qfrc_bias - data.qfrc_passive - acts
        missing[row], pulled[row] = rest[dof], acts[dof]
        for hinge, _, on, shift in slides:  # a slide's force acts on the hinge that moves it
            slope = shift.slope(own[hinge])
            missing[row, hinge] += slope * rest[on]
            pulled[row, hinge] += slope * acts[on]
    return ExportRows(positions, missing, pulled)


def fit_laws(rows: ExportRows, joints: Sequence[str], hinges: Sequence[bool]) -> tuple[HingeLaw, ...]:
    """Return the laws of the hinges that lack a moment.

    Args:
        rows: along loops from rest.
        joints: their names, shape (m,).
        hinges: which of them turn, shape (m,).
    """
    found = []
    for k, name in enumerate(joints):
        if not hinges[k] or np.ptp(rows.angle[:, k]) < _LEAST_RANGE_RAD:
            continue
        largest = float(np.abs(rows.pulled[:, k]).max())
        if np.abs(rows.missing[:, k]).max() < _LEAST_MOMENT_SHARE * largest:
            continue
        found.append(_fit(name, rows.angle[:, k], rows.missing[:, k], largest))
    return tuple(found)


def _fit(joint: str, angle: Array, moment: Array, largest: float) -> HingeLaw:
    """Return the law of one hinge along rows, shape (r,)."""
    span = float(np.abs(angle).max())
    step = np.diff(angle, prepend=0.0)
    moves = np.abs(step) > _MOVES_SHARE * span
    if not moves.any():
        return HingeLaw(joint, span, 0.0, (), 0.0, 0.0, 0.0, 0.0)
    knots = np.linspace(angle.min(), angle.max(), KNOTS + 2)[1:-1]
    knots = knots[np.abs(knots) > 0.02 * span]
    springs = [angle, *(np.sign(k) * np.maximum(0.0, np.sign(k) * (angle - k)) for k in knots)]
    share = np.abs(angle / span)
    columns = -np.array([*springs, *(np.sign(step) * width for width in (share**0, share, share**3))]).T
    size = np.abs(columns).max(axis=0) + 1e-30
    rows = np.concatenate([columns[moves] / size, _RIDGE * largest * np.eye(len(size))])
    target = np.concatenate([moment[moves], np.zeros(len(size))])
    least = np.array([-np.inf] * len(springs) + [0.0] * 3)
    values = lsq_linear(rows, target, (least, np.inf)).x / size
    left = float(np.sqrt(np.mean((columns[moves] @ values - moment[moves]) ** 2))) / max(largest, 1e-30)
    pairs = tuple((float(k), float(v)) for k, v in zip(knots, values[1 : len(springs)], strict=True))
    constant, width, cubic = (float(value) for value in values[-3:])
    return HingeLaw(joint, span, float(values[0]), pairs, constant, width, cubic, left)


# ----------------------------------------------------------------------------------------------------
# The elements of MJCF with which plain MuJoCo does what laws do beside the package's step.
#
# A hinge's springs are fixed tendons with a range in which they give no force. Its friction grows with its
# angle, which no friction loss of a joint does. It comes from a plastic spring (`springyield`) of a
# constant force F whose arm grows: a tendon from a site below the hinge to one above, each at the distance
# A, has the length 2 A cos(q / 2), and F times its slope is F A sin(|q| / 2). A second part of the tendon,
# between sites on one side of the hinge, takes that slope away but for the third power of q. A tendon
# yields after a turn by `TURN_SHARE` of the hinge's range, at that range. A constant part is a plastic
# fixed tendon. A friction loss of the same tendons does the same in engines that know no plastic springs, as
# MuJoCo before 4.

PLASTIC_SPRINGS = hasattr(mujoco.MjModel, "tendon_springyield")  # MuJoCo 4 has them
TURN_SHARE, STEEP_TURN_SHARE = 0.005, 0.003  # of a hinge's range: the turn after which all friction is there
LOSS_TURN_SHARE = 0.03  # of a hinge's range: by it a friction loss is turned, to have a slope at rest
_CUBIC_AS_LINE = 0.6  # w of the line w x that is nearest to x^3 from 0 to 1, by least squares
Chord = tuple[float, float]  # heights over a hinge of a site on its parent and of one on its body [m]
_ARM: tuple[Chord, ...] = ((-1.0, 1.0),)
# A chord on one side of the hinge, a = 0.43 and b = 0.23 m, has a slope of the same size as the other's,
# which it takes away but for the third power of the angle: a b / (a - b) = 1 / 2.
_GAP_M = 0.2
_MIDDLE_M = (0.5 * _GAP_M + 0.25 * _GAP_M**2) ** 0.5
_STEEP_ARM: tuple[Chord, ...] = (*_ARM, (_MIDDLE_M + 0.5 * _GAP_M, _MIDDLE_M - 0.5 * _GAP_M))
SLIDE_ARMATURE_KG = 0.01  # of a slide that follows a hinge
_FAR = 1e6
# As hard as a step allows: a tie, not a spring.
_TIE: Mapping[str, Any] = {"solref": (0.002, 1), "solimp": (0.9999, 0.9999, 0.001, 0.5, 2)}
_STICK = {"solreffriction": (0.001, 1), "solimpfriction": (0.999, 0.9999, 0.001, 0.5, 2)}
_HIDDEN = {"group": 5, "rgba": (0, 0, 0, 0)}


def add_shifts(root: Element, shifts: Sequence[Shift]) -> None:
    """Let bodies shift as their hinges turn."""
    if not shifts:
        return
    ties, option = root.part("equality"), root.part("option")
    option.part("flag").set(diagexact="enable")  # slides and hinges differ in size
    option.set(solver="CG")  # ten times as fast as Newton's on a hundred such joints
    for shift in shifts:
        body = root.find("body", shift.body)
        joints = [part for part in body.children if part.tag == "joint"]
        body.add(
            "joint",
            name=shift.slide,
            type="slide",
            axis=np.eye(3)[shift.axis],
            armature=SLIDE_ARMATURE_KG,
            stiffness=0,
        )
        for joint in joints:  # those of the robot come after the slide
            body.append(joint)
        ties.add(
            "joint",
            **_TIE,
            name=shift.slide,
            joint1=shift.slide,
            joint2=shift.joint,
            polycoef=(0.0, *shift.coefficients),
        )


def add_springs(root: Element, laws: Sequence[HingeLaw]) -> None:
    """Let hinges have the springs of their laws."""
    if not laws:
        return
    tendons = root.part("tendon")
    for law in laws:
        name = f"spring_{law.joint}"
        if law.stiffness != 0.0:
            _fixed(tendons, law.joint, name, stiffness=law.stiffness, springlength=0)
        for number, (knot, stiffness) in enumerate(law.knots, 1):
            free = (-_FAR, knot) if knot > 0.0 else (knot, _FAR)
            _fixed(tendons, law.joint, f"{name}_{number}", stiffness=stiffness, springlength=free)


def _fixed(tendons: Element, joint: str, name: str, **own: Any) -> None:
    tendons.add("fixed", **own, name=name).add("joint", joint=joint, coef=1)


def add_friction(
    root: Element, plain: mujoco.MjModel, laws: Sequence[HingeLaw], plastic: bool = True
) -> None:
    """Let hinges rub as their laws say, by plastic springs.

    A friction loss is regularised by the tendon's slope at rest, which is zero where the hinge is straight:
    it is turned a little, by `LOSS_TURN_SHARE` of the hinge's range. What grows with the third power of the
    angle would need more than single precision has; it becomes a part of what grows with the angle.

    Args:
        root: the model.
        plain: the same, loaded, without what laws add.
        laws: of its hinges.
        plastic: by plastic springs; otherwise by the tendons' friction loss.
    """
    tendons = root.part("tendon")
    bodies = {body.get("name", "world"): body for body in root.part("worldbody").every("worldbody", "body")}
    for law in laws:
        if law.constant > 0.0:
            own = _rubbing(law.constant, TURN_SHARE * law.range_rad, plastic)
            _fixed(tendons, law.joint, f"rub_{law.joint}_constant", springlength=0, **own)
        arms: Sequence[tuple[float, Sequence[Chord]]] = ((law.width, _ARM), (law.cubic, _STEEP_ARM))
        if not plastic:
            arms = ((law.width + _CUBIC_AS_LINE * law.cubic, _ARM),)
        for share, chords in arms:
            if share > 0.0:
                _add_arm(bodies, tendons, plain, law, share, chords, plastic)


def slope_of(chords: Sequence[Chord], angle: float) -> float:
    """Return by how much chords past a hinge lengthen with its angle, together [m/rad]."""
    lengths = [np.sqrt(a * a + b * b - 2.0 * a * b * np.cos(angle)) for a, b in chords]
    return float(sum(a * b * np.sin(angle) / own for (a, b), own in zip(chords, lengths, strict=True)))


def _add_arm(
    bodies: dict[str, Element],
    tendons: Element,
    plain: mujoco.MjModel,
    law: HingeLaw,
    moment: float,
    chords: Sequence[Chord],
    plastic: bool,
) -> None:
    """Add a tendon past a hinge that rubs by more the more it is turned, by `moment` at its range [N m]."""
    joint = plain.joint(law.joint)
    body = int(joint.bodyid[0])
    axis, hinge = plain.jnt_axis[joint.id], plain.jnt_pos[joint.id]
    along = np.array([0.0, 0.0, 1.0]) - axis[2] * axis  # the straight robot's axis, seen by the hinge
    along = along / np.linalg.norm(along) if np.linalg.norm(along) > 0.1 else np.array([1.0, 0.0, 0.0])
    turn = 0.0 if plastic else LOSS_TURN_SHARE * law.range_rad
    turned = np.cos(turn) * along + np.sin(turn) * np.cross(axis, along)
    places = (
        (bodies[plain.body(plain.body_parentid[body]).name], plain.body_pos[body] + hinge),
        (bodies[plain.body(body).name], hinge),
    )
    arm = abs(slope_of(chords, law.range_rad))
    steep = chords is _STEEP_ARM
    name = f"rub_{law.joint}{'_steep' if steep else ''}"
    yields = arm * law.range_rad * (STEEP_TURN_SHARE if steep else TURN_SHARE)
    tendon = tendons.add(
        "spatial",
        **_HIDDEN,
        **_rubbing(moment / arm, yields, plastic),
        name=name,
        width=1e-4,
        springlength=sum(abs(a - b) for a, b in chords),
    )
    for number, chord in enumerate(chords):
        if number:
            tendon.add("pulley", divisor=1)
        for side, (parent, middle), height in zip(("below", "above"), places, chord, strict=True):
            site = f"{name}_{side}_{number}"
            way = turned if side == "above" else along
            parent.add("site", **_HIDDEN, name=site, pos=middle + height * way, size=1e-4)
            tendon.add("site", site=site)


def _rubbing(force: float, yields: float, plastic: bool) -> dict[str, Any]:
    """Return the attributes of a tendon that resists with a force [N, N m] after so much motion [m, rad]."""
    if plastic:
        return {"stiffness": force / yields, "springyield": yields}
    return {"frictionloss": force, **_STICK}


# ----------------------------------------------------------------------------------------------------
# Commands' causes as actuators: gains, biases, couplings, a force on the tip, lag, delay and creep.
#
# A robot's actuators have MuJoCo's affine law, force = gain ctrl + bias + b1 length; a gain g and an offset
# o of the input make it gain g ctrl + (bias + gain o) + b1 length. Where one input reaches another's
# tendon, that tendon gets one more actuator; creep is one more with a lag of its own. All of them take
# inputs as they are commanded: `shares` says which.

_LEAST = 1e-9  # smaller numbers of a matrix are rounding
TIP_FORCE = "force_tip"
BASE = "base"


def command_actuators(root: Element, shares: Array, affine: Affine, timing: Timing, tensions: bool) -> Array:
    """Change the model's actuators, and add some; return the shares of all, shape (nu, t).

    Args:
        root: the model; its actuators are those of the robot as it was built, in their order.
        shares: ctrl = shares @ what arrives, shape (k, t); further actuators have none.
        affine: what arrives of inputs.
        timing: how late.
        tensions: whether controls are tensions: none is below zero.
    """
    block = root.part("actuator")
    own = list(block.children)
    for item in own:
        item.tag = "general"  # a `motor` has a gain of 1 and no dynamics
    rows = [np.zeros(shares.shape[1]) for _ in own]
    for k, item in enumerate(own[: len(shares)]):
        if not shares[k].any():  # no input's
            continue
        through, bias = shares[k] @ affine.matrix, float(shares[k] @ affine.bias)
        main = int(np.argmax(np.abs(shares[k])))
        gain = item.numbers("gainprm", 1.0)[0]
        main_gain = through[main] / shares[k][main]
        item.set(gainprm=gain * main_gain)
        if bias != 0.0:
            before = item.numbers("biasprm", 0.0)
            item.set(biastype="affine", biasprm=(before[0] + gain * bias, *before[1:]))
        if tensions:
            item.set(forcerange=(0.0, 1e9))
        rows[k][main] = shares[k][main]
        for other in np.flatnonzero(np.abs(through) > _LEAST):
            if int(other) == main:
                continue
            extra = _beside(
                block, item, f"coupled_{item.get('name')}_{other + 1}", gain * through[other], tensions
            )
            _late(extra, timing)
            rows.append(np.eye(shares.shape[1])[other])
        if timing.creep:
            slow = _beside(
                block, item, f"creep_{item.get('name')}", gain * main_gain * timing.creep, tensions
            )
            slow.set(dyntype="filterexact", dynprm=timing.creep_time_s)
            rows.append(rows[k])
    for k, item in enumerate(own[: len(shares)]):
        if shares[k].any():
            _late(item, timing)
    if affine.force_tip.any():
        _push_tip(root, block, affine.force_tip)
        rows.append(np.zeros(shares.shape[1]))
    return np.array(rows)


def _beside(block: Element, item: Element, name: str, gain: float, tensions: bool) -> Element:
    """Add an actuator that pulls what another one pulls, with a gain and nothing else."""
    kept = {key: item.get(key) for key in ("tendon", "joint", "gear")}
    forces = (0.0, 1e9) if tensions and gain > 0.0 else None
    return block.add("general", **kept, name=name, gainprm=gain, forcerange=forces)


def _late(item: Element, timing: Timing) -> None:
    """Let an actuator follow its control by a lag and a delay."""
    if timing.lag_s > 0.0:
        item.set(dyntype="filterexact", dynprm=timing.lag_s)
    if timing.delay_s > 0.0:
        # How many samples is known once the step is: see `count_samples`.
        item.set(delay=timing.delay_s, interp="linear", nsample=0)


def count_samples(root: Element, timestep_s: float) -> None:
    """Give what is late the samples that its delay needs."""
    for item in (*root.part("actuator").children, *root.part("sensor").children):
        for delay_s in item.numbers("delay"):
            item.set(nsample=math.ceil(delay_s / timestep_s) + 2)


def _push_tip(root: Element, block: Element, force: Sequence[float] | Array) -> None:
    """Push on the tip with a constant force [N] along axes that stand still; the control does nothing."""
    world = root.part("worldbody")
    if not any(site.get("name") == BASE for site in world.every("site")):
        world.add("site", name=BASE, group=5, size=1e-4)
    block.add(
        "general",
        name=TIP_FORCE,
        site="tip",
        refsite=BASE,
        gear=(*force, 0.0, 0.0, 0.0),
        gainprm=0,
        biastype="affine",
        biasprm=1,
    )


# ----------------------------------------------------------------------------------------------------
# Sensors of what a tracker sees: the place of every element's distal face, of the tip and of markers.

TRACKER = "tracker"


def add_sensors(root: Element, elements: int, view: SensorView, markers: Sequence[Marker] = ()) -> None:
    """Add `position_<k>` of every face, `tip_position`, `tip_quat` and `position_marker_<name>`.

    They are seen from the site `tracker`.

    Args:
        root: the model.
        elements: how many faces it has.
        view: p' = R p + shift: the tracker's axes are the columns of R^T, its zero lies at -R^T shift.
        markers: of which it has sites.
    """
    turn, zero = view.R.T, -view.R.T @ view.shift
    quat = Rotation.from_matrix(turn).as_quat(scalar_first=True)
    root.part("worldbody").add("site", name=TRACKER, group=5, size=1e-4, pos=zero, quat=quat)
    block = root.part("sensor")
    seen: dict[str, Any] = {"objtype": "site", "reftype": "site", "refname": TRACKER}
    if view.delay_s > 0.0:
        seen |= {"delay": view.delay_s, "nsample": 0, "interp": "linear"}
    for k in range(1, elements + 1):
        block.add("framepos", **seen, name=f"position_{k}", objname=names.face(k))
    for marker in markers:
        name = names.marker(marker.name)
        block.add("framepos", **seen, name=f"position_{name}", objname=name)
    block.add("framepos", **seen, name="tip_position", objname=names.TIP)
    seen["interp"] = None
    block.add("framequat", **seen, name="tip_quat", objname=names.TIP)
