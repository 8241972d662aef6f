"""A specimen with what is planted in it along a trial: commands, the MuJoCo simulation, what is seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.channels import posture_columns, tendon_inputs
from catheter_sim.core.inputs import Inputs, Quantity
from catheter_sim.core.posture import Posture, marker_points
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.lab.specimen import TRAINING, Course, Specimen, scaled, uncertain_of
from catheter_sim.robots import check_robot
from catheter_sim.simulation.replay import simulate

# ----------------------------------------------------------------------------------------------------
# Where the elements of a robot are, row by row, and shapes that are bent, turned or shortened otherwise.


@dataclass(frozen=True)
class Shapes:
    """Postures of a trial.

    Attributes:
        p: distal faces, base to tip, base frame, shape (r, n, 3) [m]; as they are seen, with the robot's
            markers behind them.
        R: their orientations, shape (r, n, 3, 3).
        angles: of the joints, shape (r, j) [rad].
        tension: at the actuators, shape (r, t) [N].
    """

    p: Array
    R: Array
    angles: Array
    tension: Array

    def __len__(self) -> int:
        return len(self.p)

    def at(self, rows: Sequence[int]) -> Shapes:
        """Return some rows."""
        index = list(rows)
        return Shapes(self.p[index], self.R[index], self.angles[index], self.tension[index])

    def postures(self) -> tuple[Posture, ...]:
        """Return them as the package's postures, for writing columns."""
        n = self.R.shape[1]
        nothing = np.zeros((self.tension.shape[1], n))
        rows = zip(self.p, self.R, self.angles, self.tension, strict=True)
        return tuple(
            Posture(p[:n], R, angles, tension, nothing, p[n:] if len(p) > n else None)
            for p, R, angles, tension in rows
        )


def shapes_of(postures: Sequence[Posture]) -> Shapes:
    """Return postures as arrays."""
    return Shapes(
        np.array([item.p_w for item in postures]),
        np.array([item.R_w for item in postures]),
        np.array([item.joint_angles for item in postures]),
        np.array([item.actuator_tension for item in postures]),
    )


def bends_of(shapes: Shapes) -> Array:
    """Return each element's turn against the one below it, as rotation vectors, shape (r, n, 3) [rad]."""
    below = np.concatenate([np.broadcast_to(np.eye(3), (len(shapes), 1, 3, 3)), shapes.R[:, :-1]], axis=1)
    relative = np.einsum("rnji,rnjk->rnik", below, shapes.R)
    return Rotation.from_matrix(relative.reshape(-1, 3, 3)).as_rotvec().reshape(*relative.shape[:2], 3)


def rebent(shapes: Shapes, change: Callable[[Array], Array]) -> Shapes:
    """Return shapes whose elements' turns are changed, stacked again from the base.

    An element that turns by more carries its step, from face to face, half as far: it bends in its middle.
    `change`: from turns as of `bends_of`, shape (r, n, 3), to others.
    """
    before = bends_of(shapes)
    turns = [Rotation.from_rotvec(part.reshape(-1, 3)) for part in (before, change(before))]
    half = [Rotation.from_rotvec(0.5 * turn.as_rotvec()) for turn in turns]
    count = before.shape[:2]
    below = np.concatenate([np.broadcast_to(np.eye(3), (len(shapes), 1, 3, 3)), shapes.R[:, :-1]], axis=1)
    foot = np.concatenate([np.zeros((len(shapes), 1, 3)), shapes.p[:, :-1]], axis=1)
    step = np.einsum("rnji,rnj->rni", below, shapes.p - foot)
    step = (half[1] * half[0].inv()).apply(step.reshape(-1, 3)).reshape(*count, 3)
    return _stacked(shapes, step, turns[1].as_matrix().reshape(*count, 3, 3))


def shortened(shapes: Shapes, share: Array) -> Shapes:
    """Return shapes whose elements are shorter by a share of their length, shape (r, n)."""
    foot = np.concatenate([np.zeros((len(shapes), 1, 3)), shapes.p[:, :-1]], axis=1)
    step = (shapes.p - foot) * (1.0 - share)[..., np.newaxis]
    return replace(shapes, p=np.cumsum(step, axis=1))


def _stacked(shapes: Shapes, step: Array, turn: Array) -> Shapes:
    p, R = np.empty_like(shapes.p), np.empty_like(shapes.R)
    place, frame = np.zeros((len(p), 3)), np.broadcast_to(np.eye(3), (len(p), 3, 3))
    for k in range(p.shape[1]):
        place = place + np.einsum("rij,rj->ri", frame, step[:, k])
        frame = frame @ turn[:, k]
        p[:, k], R[:, k] = place, frame
    return replace(shapes, p=p, R=R)


# ----------------------------------------------------------------------------------------------------
# What a form of a cause is here: where it acts, what of it is drawn, and what a diagnosis should find.

Numbers = Mapping[str, Any]  # what a form has besides its size


@dataclass(frozen=True)
class Scale:
    """What is large in the data set, from the specimen with nothing planted.

    Attributes:
        bend_rad: largest turn of an element.
        curvature_per_m: largest bend per length.
        pull: largest sum of the channels' values that pull, SI.
        duration_s: of the longest trial.
        speed: median speed of the channels while they move, in shares of the reach per second.
        tip_m: furthest that the tip goes from where it is at rest.
    """

    bend_rad: float
    curvature_per_m: float
    pull: float
    duration_s: float
    speed: float
    tip_m: float


@dataclass(frozen=True)
class Acting:
    """A form at work on a specimen.

    `size` says how much of it, which does nothing at zero; `numbers`, what else was drawn.
    """

    specimen: Specimen
    scale: Scale
    size: float
    numbers: Numbers

    def mask(self) -> Array:
        """Return 1 for the channels on which it acts, 0 for others, shape (c,)."""
        channel = self.numbers.get("channel")
        if channel is None:
            return np.ones(len(self.specimen.reach))
        return np.asarray(np.arange(len(self.specimen.reach)) == channel, dtype=float)


Draw = Callable[[Specimen, Scale, np.random.Generator], Numbers]
Every = Callable[[Specimen, Scale], Sequence[Numbers]]
OnCommands = Callable[[Acting, Course, Array], Array]
OnShapes = Callable[[Acting, Course, Shapes], Shapes]


def nothing_more(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    """Draw nothing besides the size."""
    return {}


def nothing_else(specimen: Specimen, scale: Scale) -> Sequence[Numbers]:
    """Return the one choice that a form has which draws nothing."""
    return ({},)


@dataclass(frozen=True)
class LabForm:
    """One form of a cause.

    Of the hooks a form has those at which it acts, in the order in which they stand.

    Attributes:
        cause: its name on the closed list; of a cause outside the list its own.
        name: of the form.
        law: what it does, in one line, with its source.
        purpose: "both" of a form whose law the diagnosis knows; of a foreign one "tune" or "judge".
        learnt: of a form that is drawn as foreign: the diagnosis has a form of its law by now.
        applies: whether it makes sense on a specimen.
        draw: what else it has.
        every: of a known form, all choices that `draw` has, of numbers that are no choice a typical one.
        start, most: first size tried, and the largest.
        signed: whether its size may be negative.
        also: other causes whose form says the same; to name one of them is right, too.
        outside: whether the cause is not on the list.
        command: what arrives instead of the commands, shape (r, c), SI.
        robot: the robot instead of the specimen.
        gravity: what acts besides the stated gravity, shape (3,) [m/s^2].
        tip_force: on the tip, constant, shape (3,) [N].
        tether: on the tip at each row, shape (r, 3) [N], by where the robot is without it.
        moments: on elements: their numbers from 1, and moments (r, b, 3) [N m].
        body_force: on one element: its number from 1, and forces (r, 3) [N].
        shape: where the robot is instead.
        seen: where it is seen instead.
        parameters: those of the diagnosis that mean the same number, with their true values, in file units.
    """

    cause: str
    name: str
    law: str
    purpose: str = "both"
    learnt: bool = False
    applies: Callable[[Specimen], bool] = lambda specimen: True
    draw: Draw = nothing_more
    every: Every = nothing_else
    start: float = 1.0
    most: float = 100.0
    signed: bool = False
    also: tuple[str, ...] = ()
    outside: bool = False
    command: OnCommands | None = None
    robot: Callable[[Acting, RobotSpec], RobotSpec] | None = None
    gravity: Callable[[Acting], Array] | None = None
    tip_force: Callable[[Acting], Array] | None = None
    tether: Callable[[Acting, Shapes], Array] | None = None
    moments: Callable[[Acting, Course, Array], tuple[tuple[int, ...], Array]] | None = None
    body_force: Callable[[Acting, Course], tuple[int, Array]] | None = None
    shape: OnShapes | None = None
    seen: OnShapes | None = None
    parameters: Callable[[Acting], Mapping[str, float]] = field(default=lambda acting: {})

    @property
    def key(self) -> str:
        """Its cause's name and its own."""
        return f"{self.cause}.{self.name}"

    @property
    def known(self) -> bool:
        """Whether the diagnosis has a form of this law."""
        return self.purpose == "both"

    @property
    def looks_only(self) -> bool:
        """Whether the simulation need not run again for it."""
        loads = (self.gravity, self.tip_force, self.tether, self.moments, self.body_force)
        others = (self.command, self.robot, *loads)
        return all(hook is None for hook in others)


@dataclass(frozen=True)
class Planted:
    """A form with what was drawn for it."""

    form: LabForm
    size: float
    numbers: Numbers

    def acting(self, specimen: Specimen, scale: Scale) -> Acting:
        """Return it at work."""
        return Acting(specimen, scale, self.size, self.numbers)


def one_channel(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    """Draw one of the channels that pull."""
    return {"channel": int(generator.choice(np.flatnonzero(specimen.pulls)))}


def each_channel(specimen: Specimen, scale: Scale) -> Sequence[Numbers]:
    """Return the choices of one of the channels that pull."""
    return [{"channel": int(index)} for index in np.flatnonzero(specimen.pulls)]


def several_channels(specimen: Specimen) -> bool:
    """Return whether more than one channel pulls."""
    return int(specimen.pulls.sum()) > 1


def of_cells(specimen: Specimen) -> bool:
    """Return whether it bends all along: cells, links, disks, no joints of their own channels."""
    return not specimen.jointed


def places_along(acting: Acting) -> Array:
    """Return each element's place along the robot, 0 to 1, shape (1, n, 1)."""
    count = acting.specimen.elements
    return np.asarray(((np.arange(count) + 0.5) / count)[np.newaxis, :, np.newaxis])


def channel_name(acting: Acting) -> str:
    """Return the name of the channel on which a form acts."""
    return acting.specimen.drives[acting.numbers["channel"]].channel


def in_unit(acting: Acting) -> float:
    """Return a size per tendon in the channels' file unit for a size of one: a hundredth of the reach."""
    specimen = acting.specimen
    pulled = specimen.reach[specimen.pulls]
    largest = float((pulled / specimen.per_tendon[specimen.pulls]).max())
    return float(f"{0.01 * largest / specimen.file_size:.2g}")


def per_channel(acting: Acting) -> Array:
    """Return that size on each channel on which a form acts, SI, shape (c,)."""
    specimen = acting.specimen
    return in_unit(acting) * specimen.file_size * specimen.per_tendon * acting.mask()


# ----------------------------------------------------------------------------------------------------
# A specimen with what is planted in it along a trial: commands, the MuJoCo simulation, what is seen.

RAMP_S = 0.3  # simulated time from row to row


class CannotMake(Exception):
    """The simulation finds no posture, or nothing that was drawn could be sized: another draw is needed."""


def possible(specimen: Specimen, u: Array) -> Array:
    """Return inputs that an actuator can give: no tension below zero, no advance beyond its stroke."""
    found = np.array(u)
    for index, drive in enumerate(specimen.drives):
        if drive.quantity is not Quantity.DISPLACEMENT:
            found[:, index] = np.clip(found[:, index], drive.least, drive.most)
    return found


def arriving(specimen: Specimen, scale: Scale, planted: Sequence[Planted], course: Course) -> Array:
    """Return what arrives at the robot's channels, shape (r, c)."""
    u = course.commands
    for item in planted:
        if item.form.command is not None:
            u = possible(specimen, item.form.command(item.acting(specimen, scale), course, u))
    return u


def changed_robot(specimen: Specimen, scale: Scale, planted: Sequence[Planted]) -> RobotSpec:
    """Return the robot that is simulated."""
    robot = specimen.robot
    for item in planted:
        if item.form.robot is not None:
            robot = item.form.robot(item.acting(specimen, scale), robot)
    return robot


def simulated(
    specimen: Specimen,
    scale: Scale,
    planted: Sequence[Planted],
    course: Course,
    rows: Sequence[int] | None = None,
    without: Shapes | None = None,
) -> Shapes:
    """Return where the robot is at some rows of a trial (default: all), before anybody looks.

    What arrives at `rows` is that of the whole trial. `without`: the same rows with nothing planted, for
    loads that depend on where the robot is.

    Raises:
        CannotMake: the simulation diverged, or an input goes beyond a joint's range.
    """
    index = list(range(len(course))) if rows is None else list(rows)
    u = arriving(specimen, scale, planted, course)
    try:
        robot = changed_robot(specimen, scale, planted)
        check_robot(robot, robot.name)
    except InputError as error:
        raise CannotMake(str(error)) from None
    gravity = np.array(specimen.gravity_mps2)
    force = np.zeros((len(index), 3))
    body_force: dict[int, Array] = {}
    body_moment: dict[int, Array] = {}
    for item in planted:
        acting, form = item.acting(specimen, scale), item.form
        if form.gravity is not None:
            gravity = gravity + form.gravity(acting)
        if form.tip_force is not None:
            force = force + form.tip_force(acting)
        if form.tether is not None and without is not None:
            force = force + form.tether(acting, without)
        if form.body_force is not None:
            place, on_body = form.body_force(acting, course)
            body_force[place] = body_force.get(place, np.zeros((len(index), 3))) + on_body[index]
        if form.moments is not None:
            places, moments = form.moments(acting, course, u)
            for number, place in enumerate(places):
                before = body_moment.get(place, np.zeros((len(index), 3)))
                body_moment[place] = before + moments[index, number]
    bodies = tuple(sorted({*body_force, *body_moment}))
    none = np.zeros((len(index), 3))
    inputs = Inputs(
        course.time_s[index],
        robot.actuation,
        tendon_inputs(robot, robot.actuation, u[index]),
        force,
        none,
        bodies,
        np.stack([body_force.get(k, none) for k in bodies], axis=1) if bodies else np.zeros((0, 0, 3)),
        np.stack([body_moment.get(k, none) for k in bodies], axis=1) if bodies else np.zeros((0, 0, 3)),
    )
    try:
        run = simulate(robot, inputs, gravity, ramp_s=RAMP_S)
    except InputError as error:
        raise CannotMake(str(error)) from None
    if run.failure:
        raise CannotMake(run.failure)
    return shapes_of(run.postures)


def looked_at(
    specimen: Specimen, scale: Scale, planted: Sequence[Planted], course: Course, shapes: Shapes
) -> Shapes:
    """Return what is seen of all rows of a trial: shapes that differ first, then a tracker that does."""
    for item in planted:
        if item.form.shape is not None:
            shapes = item.form.shape(item.acting(specimen, scale), course, shapes)
    if specimen.robot.markers:  # a tracker sees them as it sees any point
        points = marker_points(specimen.robot.markers, shapes.p, shapes.R)
        shapes = replace(shapes, p=np.concatenate([shapes.p, points], axis=1))
    for item in planted:
        if item.form.seen is not None:
            shapes = item.form.seen(item.acting(specimen, scale), course, shapes)
    return shapes


def columns_of(specimen: Specimen, shapes: Shapes) -> Array:
    """Return the measured columns, shape (r, o), in file units."""
    values = posture_columns(specimen.robot, shapes.postures(), specimen.columns)
    return np.stack([values[name] for name in specimen.columns], axis=1)


# ----------------------------------------------------------------------------------------------------
# A data set before anything is planted, on few rows: what is large there, and how much a form changes.
#
# Sizes are those that are left when a calibration has taken its part: the change of the outputs is
# projected on the changes by the robot's uncertain numbers, each within its range.

SMALLEST, LARGEST = 5.0, 30.0  # times the noise
_ROWS = 18  # of a trial that sizes are found on
_STEP = 0.5  # of half the range of an uncertain number
_TRIALS = 8
_ROOM = 1e-6  # beyond a range, so that no specimen lies on its end
_NOTHING = Scale(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Ground:
    """A specimen and its trials.

    Attributes:
        specimen: the robot.
        courses: its trials.
        calibrates: whether a calibration takes its part; not where another recording has shown the specimen.
        known_scale: what is large for its forms; None: what is large here.
    """

    specimen: Specimen
    courses: tuple[Course, ...]
    calibrates: bool = True
    known_scale: Scale | None = None

    @property
    def uncertain(self) -> tuple[Any, ...]:
        """The numbers that a calibration may take, with their ranges (`core.published.Uncertain`)."""
        return uncertain_of(self.specimen) if self.calibrates else ()

    @cached_property
    def picked(self) -> tuple[tuple[Course, tuple[int, ...]], ...]:
        """Training trials, the repeat left out, each with the rows that sizes are found on."""
        return tuple((course, _rows(course)) for course in self.courses[:TRAINING])

    @cached_property
    def few(self) -> tuple[Shapes, ...]:
        """Where the robot is at these rows."""
        return tuple(simulated(self.specimen, _NOTHING, (), course, rows) for course, rows in self.picked)

    @cached_property
    def plain(self) -> tuple[Shapes, ...]:
        """Where the robot is at all rows of all trials."""
        found: list[Shapes] = []
        for course in self.courses:
            known = course.repeats is not None
            found.append(
                found[course.repeats or 0] if known else simulated(self.specimen, _NOTHING, (), course)
            )
        return tuple(found)

    @cached_property
    def scale(self) -> Scale:
        """What is large in this data set."""
        if self.known_scale is not None:
            return self.known_scale
        bends = np.concatenate([np.linalg.norm(bends_of(shapes), axis=-1) for shapes in self.few])
        commands = np.concatenate([course.commands for course in self.courses[:TRAINING]])
        speeds = [
            np.abs(np.diff(course.commands / self.specimen.reach, axis=0)).max(axis=1)
            / np.diff(course.time_s)
            for course in self.courses[:TRAINING]
        ]
        moving = np.concatenate(speeds)
        tips = np.concatenate([shapes.p[:, -1] for shapes in self.few])
        rest = np.array([0.0, 0.0, self.specimen.length_m])
        largest = max(float(bends.max()), 1e-6)
        return Scale(
            bend_rad=largest,
            curvature_per_m=largest * self.specimen.elements / self.specimen.length_m,
            pull=max(float(np.abs(commands[:, self.specimen.pulls]).sum(axis=1).max()), 1e-12),
            duration_s=max(float(course.time_s[-1]) for course in self.courses),
            speed=float(np.median(moving[moving > 0.0])),
            tip_m=max(float(np.linalg.norm(tips - rest, axis=1).max()), 1e-6),
        )

    @cached_property
    def few_outputs(self) -> tuple[Array, ...]:
        """Outputs at these rows, with nothing planted."""
        return tuple(columns_of(self.specimen, shapes) for shapes in self.few)

    @cached_property
    def calibrations(self) -> Array:
        """Change of the outputs over their noise by half the range of each uncertain number, (n, k)."""
        found = []
        for item in self.uncertain:
            step = _STEP * item.half
            if self.specimen.factors[item.name] > 1.0:
                step = -step
            factor = 1.0 + step / self.specimen.factors[item.name]
            other = replace(self.specimen, robot=scaled(self.specimen.robot, item.keys, factor))
            shapes = [simulated(other, self.scale, (), course, rows) for course, rows in self.picked]
            change = self._over_noise([columns_of(other, item_shapes) for item_shapes in shapes])
            found.append(change / step * item.half)
        count = sum(len(rows) for _, rows in self.picked) * len(self.specimen.columns)
        return np.array(found).T if found else np.zeros((count, 0))

    def change(self, planted: Planted) -> Array:
        """Return the change of the outputs over their noise that a planted form makes, shape (n,).

        Raises:
            CannotMake: the robot finds no posture with it.
        """
        found = []
        for number, (course, rows) in enumerate(self.picked):
            if planted.form.looks_only:
                seen = looked_at(self.specimen, self.scale, [planted], course, self.plain[number])
                before = columns_of(self.specimen, self.plain[number].at(rows))
                found.append(columns_of(self.specimen, seen.at(rows)) - before)
            else:
                shapes = simulated(self.specimen, self.scale, [planted], course, rows, self.few[number])
                found.append(columns_of(self.specimen, shapes) - self.few_outputs[number])
        change = np.concatenate([part / self.specimen.noise for part in found]).ravel()
        if not np.isfinite(change).all():
            raise CannotMake(f"{planted.form.key}: no posture")
        return change

    def left(self, change: Array, others: Sequence[Array] = ()) -> Array:
        """Return what is left of a change when calibration, and any multiples of others, are taken off.

        Each uncertain number goes no further than its range, as seen from this specimen.
        """
        known = self.calibrations
        free = np.stack(others, axis=1) if len(others) else np.zeros((len(change), 0))
        directions = np.concatenate([known, free], axis=1)
        if not directions.shape[1]:
            return change
        factors = [self.specimen.factors[item.name] for item in self.uncertain]
        ranges = [item.half for item in self.uncertain]
        ends = [
            [(1.0 + side * half - factor) / half for factor, half in zip(factors, ranges, strict=True)]
            + [side * np.inf] * free.shape[1]
            for side in (-1.0, 1.0)
        ]
        found = lsq_linear(directions, change, (np.array(ends[0]) - _ROOM, np.array(ends[1]) + _ROOM))
        return np.asarray(change - directions @ found.x)

    def sized(
        self, form: LabForm, numbers: Numbers, target: float, sign: float
    ) -> tuple[Planted, Array] | None:
        """Return a form of a size that leaves about `target` times the noise, and its change.

        None where no possible size leaves `SMALLEST` to `LARGEST` times the noise.
        """
        size, most = form.start, form.most
        best: tuple[float, Planted, Array] | None = None
        for _ in range(_TRIALS):
            planted = Planted(form, sign * size, numbers)
            try:
                change = self.change(planted)
            except CannotMake:  # no posture, or no such robot
                most = 0.7 * size
                size = 0.5 * size
                continue
            reached = rms(self.left(change))
            off = abs(np.log(max(reached, 1e-9) / target))
            if SMALLEST <= reached <= LARGEST and (best is None or off < best[0]):
                best = (float(off), planted, change)
            if off < 0.25 or (size >= most and reached < target):
                break
            size = min(size * float(np.clip(target / max(reached, 1e-9), 0.15, 6.0)), most)
        return None if best is None else best[1:]

    def _over_noise(self, outputs: Sequence[Array]) -> Array:
        pairs = zip(outputs, self.few_outputs, strict=True)
        return np.concatenate([(one - other) / self.specimen.noise for one, other in pairs]).ravel()


def rms(values: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def _rows(course: Course) -> tuple[int, ...]:
    """Return rows of a trial, the first and the last ones and turning points among them."""
    ways = np.sign(np.diff(course.commands, axis=0))
    turns = np.flatnonzero((ways[1:] != ways[:-1]).any(axis=1)) + 1
    wanted = _spread(turns, max(2, _ROWS - 6))
    rows = {0, len(course) - 1, *wanted, *_spread(np.arange(len(course)), _ROWS - len(wanted))}
    return tuple(sorted(int(row) for row in rows))


def _spread(rows: np.ndarray, count: int) -> list[int]:
    if len(rows) <= count:
        return [int(row) for row in rows]
    return [int(rows[round(k)]) for k in np.linspace(0, len(rows) - 1, count)]
