"""Which of a robot's causes an MJCF file can carry, and how: asked of their forms, never by their names.

A form in the specification is in the robot that is built. A command that is a matrix times the inputs plus
a constant is actuators' gains and biases; so is a constant force on the tip. A memory with a `timing` is
an actuator's lag, delay or creep. What else remembers without a clock (play, friction before the robot) is
in the loops that joints are fitted to. A view that is a rigid motion, or late, is that of the file's
sensors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.drive import quantity_of
from catheter_sim.core.effect import Form, Stage, Timing, Values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Observed
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import with_effects

EXACT, FITTED, LEFT = "as it is", "fitted", "not in the file"
BUILT = "in the model that is built"
IN_LOOPS = "in the loops that the joints' springs are fitted to"
_FAR = 1e3  # inputs at which commands are probed, in file units: no tension is clamped there
_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Cause:
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
class View:
    """What is seen: p' = R p + shift, late by a delay.

    Attributes:
        R: shape (3, 3).
        shift: shape (3,) [m].
        delay_s: [s].
    """

    R: Array
    shift: Array
    delay_s: float


def find_causes(robot: RobotSpec) -> tuple[Cause, ...]:
    """Return the forms that are in `robot`, in the order in which they act."""
    found = []
    for name, effect in EFFECTS.items():
        for form in effect.forms if name in robot.effects else ():
            given = robot.effects[name]
            own = {item.name: given[item.name] for item in form.parameters(robot) if item.name in given}
            nulls = {item.name: item.null for item in form.parameters(robot)}
            if all(value == nulls[key] for key, value in own.items()):
                continue
            found.append(Cause(name, form.name, own, *_carried(robot, form, own)))
    return tuple(found)


def without(robot: R, causes: tuple[Cause, ...]) -> R:
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


def view_of(robot: RobotSpec) -> View:
    """Return how the robot is seen, as far as sensors can."""
    R, shift = np.eye(3), np.zeros(3)
    for name, effect in EFFECTS.items():
        for form in effect.forms if name in robot.effects else ():
            own = _rigid_of(form, robot.effects[name]) if form.observe is not None else None
            if own is not None:
                R, shift = own[0] @ R, own[0] @ shift + own[1]
    return View(R, shift, timing_of(robot, Stage.OBSERVATION).delay_s)


def _affine_of(robot: RobotSpec, form: Form, values: Values) -> Affine | None:
    """Return what a command without memory does, if that is a matrix and a bias; probed far from zero."""
    assert form.command is not None
    tendons, unit = len(robot.tendons), quantity_of(robot.actuation).file_size
    levels = (
        _FAR * unit * np.concatenate([np.ones((1, tendons)), np.ones((tendons, tendons)) + np.eye(tendons)])
    )
    levels = np.concatenate([levels, levels[:1] * np.linspace(1.3, 1.7, tendons)])
    nothing = np.zeros((len(levels), 3))
    probe = Inputs(np.arange(float(len(levels))), robot.actuation, levels, nothing, nothing)
    got = form.command(robot, probe, values)
    matrix = (got.tendon[1:-1] - got.tendon[0]).T / (_FAR * unit)
    bias = got.tendon[0] - matrix @ levels[0]
    bias[np.abs(bias) < 1e-9 * _FAR * unit] = 0.0
    straight = np.allclose(matrix @ levels[-1] + bias, got.tendon[-1], atol=_TOLERANCE * _FAR * unit)
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


def quasi_static(robot: R, causes: tuple[Cause, ...]) -> R:
    """Return the robot with what bends it in held rows: without what only shows, or needs a clock."""
    late = tuple(
        cause for cause in causes if cause.timed or _stage(cause) in (Stage.SHAPE, Stage.OBSERVATION)
    )
    return without(robot, late)


def _stage(cause: Cause) -> Stage:
    return next(form.stage for form in EFFECTS[cause.effect].forms if form.name == cause.form)
