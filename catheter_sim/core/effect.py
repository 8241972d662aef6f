"""The face that every effect shows: the forms in which one cause of error may act, and where each acts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Observed
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.variation import ALONG_ROWS, number_varied

# ----------------------------------------------------------------------------------------------------
# The face that every effect shows: the forms in which one cause of error may act, and where each acts.
#
# An effect never touches MuJoCo or a static model by itself. It changes the robot's specification (which
# both read), or the inputs on their way to the robot, or what is observed of it on the way to the user. So
# the simulation and its analytic twin carry the same effect by construction. Where in a specification a
# cause may act is the kind's to say (`Handle`): an effect asks for a role, never for a kind.

Values = Mapping[str, float]  # parameter name (with file unit) -> value in that unit


@dataclass(frozen=True)
class Parameter:
    """One number of an effect.

    Attributes:
        name: with its file unit ("width_mm").
        null: the value at which the effect does nothing.
        lower, upper: bounds of what is physically sensible.
        scale: a change that matters, for conditioning a fit.
        start: where a fit starts, away from `null` where the effect has no gradient there.
        inverse: fitted as 1 / value (a stiffness as a compliance), so that `null` may be infinite;
            `scale` is then a change of the inverse.
        likely: what a robot that was built to its specification may have, in the number's unit; None: all
            within the bounds. Beyond it a number is fitted, but its cause is not believed.
        of_shape: it says how the effect acts, not how much of it there is: alone it does nothing, and `null`
            is what it usually is.
        in_motion: scale and start for data that were taken while the robot moved; None: as for held rows.
    """

    name: str
    null: float
    lower: float
    upper: float
    scale: float
    start: float
    inverse: bool = False
    likely: tuple[float, float] | None = None
    in_motion: tuple[float, float] | None = None
    of_shape: bool = False

    def to_fit(self, value: float) -> float:
        """Return the coordinate in which `value` is fitted."""
        if not self.inverse:
            return value
        return 0.0 if np.isinf(value) else 1.0 / value

    def from_fit(self, coordinate: float) -> float:
        """Return the value at a fit's coordinate."""
        if not self.inverse:
            return coordinate
        return float("inf") if coordinate == 0.0 else 1.0 / coordinate

    @property
    def fit_bounds(self) -> tuple[float, float]:
        """The bounds of the fit's coordinate."""
        ends = sorted((self.to_fit(self.lower), self.to_fit(self.upper)))
        return ends[0], ends[1]


def amount_of(number: Parameter, name: str) -> Parameter:
    """Return by how much a number varies as `name` says, in the coordinate in which it is fitted."""
    low, high = number.fit_bounds
    return Parameter(name, 0.0, low - high, high - low, scale=number.scale, start=0.0)


class Stage(Enum):
    """Where a form acts, in the order in which the stages act, for every kind of robot."""

    COMMAND = "on the inputs"
    SPECIFICATION = "in the robot"
    LAW = "in the robot's motion"
    SHAPE = "in the shape that its bends make"
    OBSERVATION = "on what is observed"


class Role(Enum):
    """What a number of a specification is to a cause."""

    ELASTIC_SCALE = "factor on every elastic constant"
    ELASTIC_CONSTANT = "elastic constant"
    CUBIC = "cubic term of the elastic law"
    QUINTIC = "quintic term of the elastic law"
    PLASTIC_SHARE = "stiffness of a part that yields, over the elastic one"
    YIELD_CURVATURE = "bend per length at which that part yields"
    REST_CURVATURE = "curvature without load"
    REST_BEND = "bend of a joint without load"
    HOLE_TWIST = "turn of the holes along the robot"
    ELEMENT_TURN = "turn of each element between its faces"
    MOUNT = "stiffness of what holds the base"
    FRICTION = "coefficient of friction"
    PATH = "turns of the tendons' path before the robot"
    TENDON_STIFFNESS = "stiffness of a tendon that bends"
    DRIVE_STIFFNESS = "stiffness of another drive"
    TENDON_LENGTH = "length of a tendon that stretches by a measured law"
    DRIVE_PLAY = "dead-band of a drive"
    SLACK = "length by which a tendon is too long"
    TIP_FORCE = "force on the tip"
    TIP_MASS = "mass at the tip"
    DAMPING = "time constant of the material's damping"


@dataclass(frozen=True)
class Handle:
    """A place at which a cause may act, given by the kind of a robot.

    Attributes:
        role: what the number there is.
        key: its dotted key in the robot's file ("segments.bending.rest_deg"); "": no number of it.
        parameter: the name that the place has under a cause, where the kind gives one.
        group: handles of one group are freed together.
        size: a change that matters, where the kind gives it, in the parameter's unit.
        lower, upper: bounds of such a change.
        along: what else is set with it, by key.
        tried: False where a diagnosis does not try it: it costs too much to search with.
    """

    role: Role
    key: str
    parameter: str = ""
    group: str = ""
    size: float = 0.0
    lower: float = 0.0
    upper: float = 0.0
    along: Mapping[str, str] = field(default_factory=dict)
    tried: bool = True


@dataclass(frozen=True)
class Mover:
    """An input channel as one that may move another one's part, too.

    Attributes:
        channel: its name.
        part: what it moves, as effects name it.
        toward: direction in the xy plane in which it bends its part; None: it moves the part either way.
        advances: its part is pushed out, and stands at its stop at rest.
    """

    channel: str
    part: str
    toward: tuple[float, float] | None = None
    advances: bool = False


@dataclass(frozen=True)
class Sizes:
    """What bends a robot of its softest part by a radian in all, and how sharply it is made to bend.

    Attributes:
        length_m: of the straight robot [m].
        tip_force_N: across the tip: F L^2 / 2 = EI [N].
        tension_N: of the tendon with the largest arm: T r L = EI [N].
        curvature_per_m: bend per length that such a robot is made for [1/m].
    """

    length_m: float
    tip_force_N: float
    tension_N: float
    curvature_per_m: float


def sizes_of_softest(length_m: float, stiffness_N_m2: float, arm_m: float, curvature_per_m: float) -> Sizes:
    """Return the sizes of a robot of one length that is all as soft as its softest part.

    Args:
        length_m: of the straight robot.
        stiffness_N_m2: the softest part's bending stiffness, a joint's over its link's length.
        arm_m: the largest one with which a tendon bends the straight robot.
        curvature_per_m: bend per length that such a robot is made for.
    """
    return Sizes(
        length_m,
        tip_force_N=2.0 * stiffness_N_m2 / length_m**2,
        tension_N=stiffness_N_m2 / (arm_m * length_m),
        curvature_per_m=curvature_per_m,
    )


class Memory(Protocol):
    """What depends on the way so far: written as a step, and as the series of all steps at once.

    A history begins at rest. Then comes a step of no time to the first row, and one from row to row; in
    between what goes in moves on a straight line. Arrays have any shape; all their numbers are treated alike,
    or those along the last axis each by its own values.
    """

    @property
    def timed(self) -> bool:
        """Whether time matters; without, only the order of the rows does."""

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> Any | None:
        """Return the state at rest, in which `rest` goes in and comes out; None: it does nothing."""

    def step(self, state: Any, before: Array, after: Array, dt_s: float) -> tuple[Any, Array]:
        """Return the state and what comes out when what goes in has moved from `before` to `after`."""

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what comes out at each row, same shape as `rows` (r, ...), from rest.

        `time_s`, shape (r,), counts from the first row.
        """


@dataclass(frozen=True)
class Timing:
    """What of a memory an actuator, or a sensor, of MJCF does by itself; zeros do nothing.

    Attributes:
        lag_s: time constant of a first-order lag [s].
        delay_s: [s].
        creep: what comes on after a step, as a share of it.
        creep_time_s: with which time constant [s].
    """

    lag_s: float = 0.0
    delay_s: float = 0.0
    creep: float = 0.0
    creep_time_s: float = 0.0


@dataclass(frozen=True)
class Form:
    """A way in which a cause may act.

    Of `specify`, `command`, `shape`, `observe` and `memory` it has the one that its stage needs. Each gets
    the values that are given, without those left at what does nothing. Forms with the same memory act in one.

    Attributes:
        name: in reports.
        equation: what it does, with its source where it has one.
        stage: where it acts.
        parameters: its parameters for a robot (whose channels may name them); none where it makes no sense.
        groups: which of them a diagnosis frees together, fewest first, beside another form's where the two
            go together; none: they are set, never fitted.
        specify: the specification with the form in it.
        command: what arrives at the robot instead of the inputs, each row for itself.
        shape: where all elements are, base to tip, each row for itself: from positions (..., n, 3) [m] and
            orientations (..., n, 3, 3) to others. Joints' angles and tensions stay, and what loads the robot
            loads it as it was.
        observe: what is observed, each row for itself.
        memory: what arrives at the robot, or is observed, where that depends on the rows before.
        in_place: a diagnosis tries it only in the place of a simpler form of its cause.
        further: a diagnosis tries it only where all forms that are not further leave structure.
        in_motion: it does nothing, or nothing that another form does not, where rows are held: a diagnosis
            tries it only on data that were taken while the robot moved.
        local: how an element moves relative to the one before it depends on the numbers there alone, so that
            they may vary along the robot.
        varies: what a diagnosis lets its numbers vary with, if not what its cause says.
        only_varies: its numbers do something else than those of another form only where they vary: a
            diagnosis fits by how much they do, and they stay at what does nothing.
        timing: of `memory` with these values, where MJCF has it; an exported file then carries it.
        remembers: what it puts into the specification depends on the way so far, as no element of MJCF does.
    """

    name: str
    equation: str
    stage: Stage
    parameters: Callable[[RobotSpec], tuple[Parameter, ...]]
    groups: Callable[[RobotSpec], tuple[tuple[str, ...], ...]] | None = None
    specify: Callable[[Any, Values], Any] | None = None
    command: Callable[[RobotSpec, Inputs, Values], Inputs] | None = None
    shape: Callable[[RobotSpec, Array, Array, Values], tuple[Array, Array]] | None = None
    observe: Callable[[Observed, Values], Observed] | None = None
    memory: Memory | None = None
    in_place: bool = False
    further: bool = False
    in_motion: bool = False
    local: bool = False
    varies: tuple[str, ...] | None = None
    only_varies: bool = False
    timing: Callable[[Values], Timing] | None = None
    remembers: bool = False

    def freed(self, robot: RobotSpec) -> tuple[tuple[str, ...], ...]:
        """Return the names of the parameters that a diagnosis frees together, fewest first."""
        if self.only_varies:
            return ()
        if self.groups is not None:
            return self.groups(robot)
        names = tuple(item.name for item in self.parameters(robot))
        return (names,) if names else ()


@dataclass(frozen=True)
class Effect:
    """A cause of error by its contract name.

    Attributes:
        name: from the closed list of cause names.
        summary: what it is, one line.
        trace: what a person would look for in data.
        forms: the ways in which it may act, in the order of their parameters.
        same_as: where a number of such a role is calibrated, the cause is not tried.
        advice: what to measure to tell the cause from others, by the others' names.
        least_trials: number of training trials below which a diagnosis cannot tell it from others.
        in_turn: the order in which a diagnosis tries the forms; by default that of `forms`.
        varies: what a diagnosis lets the numbers of its forms vary with, besides the place along the robot
            (`Form.local`): what is possible on a robot, and is not another form or cause.
        bench: what to look at or to measure on the robot itself, with a ruler, a weight, a spring scale.
    """

    name: str
    summary: str
    trace: str
    forms: tuple[Form, ...]
    same_as: frozenset[Role] = frozenset()
    advice: Mapping[frozenset[str], str] = field(default_factory=dict)
    least_trials: int = 1
    in_turn: Callable[[RobotSpec, tuple[Form, ...]], Iterable[Form]] | None = None
    varies: tuple[str, ...] = ALONG_ROWS
    bench: str = ""

    def parameters(self, robot: RobotSpec) -> tuple[Parameter, ...]:
        """Return the parameters of all forms; none where the effect makes no sense for the robot."""
        return tuple(item for form in self.forms for item in form.parameters(robot))

    def parameter(self, robot: RobotSpec, name: str) -> Parameter | None:
        """Return a parameter by its name, also that by which one varies; None: there is none."""
        own = (item for item in self.parameters(robot) if item.name == number_varied(name))
        number = next(own, None)
        return number if number is None or number.name == name else amount_of(number, name)

    def varies_with(self, form: Form) -> tuple[str, ...]:
        """Return what a diagnosis lets the numbers of one of its forms vary with, from row to row."""
        return self.varies if form.varies is None else form.varies

    def variants(
        self, robot: RobotSpec, moving: bool = False, further: bool = False
    ) -> tuple[tuple[str, ...], ...]:
        """Return which parameters a diagnosis frees together at first, simplest first.

        `moving`: of data that were taken while the robot moved. `further`: of the further forms instead.
        """
        forms = self.forms if self.in_turn is None else self.in_turn(robot, self.forms)
        tried = [form for form in forms if not form.in_place and (moving or not form.in_motion)]
        return tuple(names for form in tried if form.further is further for names in form.freed(robot))

    def form_of(self, robot: RobotSpec, names: Iterable[str]) -> Form:
        """Return the form that frees just `names`, else the first one that has most of them."""
        wanted = {number_varied(name) for name in names}
        exact = [form for form in self.forms if any(set(group) == wanted for group in form.freed(robot))]
        if exact:
            return exact[0]
        own = [(form, {item.name for item in form.parameters(robot)}) for form in self.forms]
        return max(own, key=lambda item: len(wanted & item[1]))[0]


# ----------------------------------------------------------------------------------------------------
# Where a cause acts on a robot of segments in a row: curvature without load, damping, loads on the tip.

_MOST_RAD = 2.0  # over the length; some 115 deg
_MATTERS_RAD = 0.02
DAMPING = Handle(Role.DAMPING, "dynamics.damping_time_s", "damping_time_s")  # of every kind's robots


def curvature_handle(key: str, parameter: str, group: str, length_m: float) -> Handle:
    """Return the place of a curvature that acts over a length."""
    most = _MOST_RAD / length_m
    return Handle(Role.REST_CURVATURE, key, parameter, group, _MATTERS_RAD / length_m, -most, most)


def curvature_handles(segments: Sequence[tuple[str, float, str]]) -> tuple[Handle, ...]:
    """Return the places of rest curvatures: of all segments alike, and of several also of each.

    Args:
        segments: name, length [m] and bending axes ("x", "y" or "xy") of each.
    """
    axes = _axes(segments)
    length_m = sum(length for _, length, _ in segments)
    common = [
        curvature_handle(_key(name, axis), f"curvature_{axis}_per_m", "all", length_m)
        for axis in axes
        for name, _, own in segments
        if axis in own
    ]
    if len(segments) == 1:
        return tuple(common)
    each = [
        curvature_handle(_key(name, axis), f"curvature_{name}_{axis}_per_m", "each", length)
        for name, length, own in segments
        for axis in own
    ]
    return (*common, *each)


def _axes(segments: Sequence[tuple[str, float, str]]) -> str:
    """Return the directions in which any of the segments bends."""
    return "".join(axis for axis in "xy" if any(axis in own for _, _, own in segments))


def _key(segment: str, axis: str) -> str:
    return f"segments.{segment}.rest_curvature_{axis}_per_m"


def tip_forces(segments: Sequence[tuple[str, float, str]]) -> tuple[Handle, ...]:
    """Return the directions of a force on the tip, in the plane of a planar robot, else in space, and a mass
    there."""
    forces = (Handle(Role.TIP_FORCE, "", f"force_{axis}_N") for axis in f"{_axes(segments)}z")
    return (*forces, Handle(Role.TIP_MASS, "tip_mass_g", "mass_g"))
