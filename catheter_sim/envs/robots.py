"""Simulated robots as environments move them: one alone, or many on threads and batches."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np
from scipy.optimize import lsq_linear

from catheter_sim.arrays import Array, Index
from catheter_sim.channels import actuations
from catheter_sim.core.inputs import Quantity
from catheter_sim.core.posture import Posture
from catheter_sim.core.published import QuickModel
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import (
    ArrivingCommands,
    Sight,
    check_effects,
    remembers_what_was_seen,
    reshaping,
    with_built_in_effects,
)
from catheter_sim.envs.surroundings import Surround
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.mjcf.names import TIP
from catheter_sim.pictures.offscreen import DrawnState, state_of
from catheter_sim.robots import check_robot, face_of
from catheter_sim.simulation.copies import Copies, copied_together
from catheter_sim.simulation.simulator import Simulator

# ----------------------------------------------------------------------------------------------------
# The quick model of any robot that environments drive, as its kind gives it (`steering.py`).


def quick_model(robot: RobotSpec, actuation: str, largest_bend_rad: float | None = None) -> QuickModel:
    """Return the quick model of `robot`, whose `effects` are not read.

    `largest_bend_rad` is what one drive alone may ask of a segment, without friction; default
    `core.published.LARGEST_BEND_RAD`, none of a robot whose joints have limits of their own.

    Raises:
        InputError: no environment drives robots of this kind, the robot knows no such actuation, it has
            tendons that bend nothing, or a largest bend does not apply to it.
    """
    if actuation not in actuations(robot):
        raise unknown("action_type", actuation, actuations(robot))
    face = face_of(robot, "steering", "environment")
    model: QuickModel = face.quick_model(robot, actuation, largest_bend_rad)
    return model


def input_range(robot: RobotSpec) -> tuple[Array, Array]:
    """Return the least and largest input of each tendon that the simulation takes, each of shape (t,)."""
    low, high = face_of(robot, "steering", "environment").input_range(robot)
    return low, high


# ----------------------------------------------------------------------------------------------------
# By how much to move the drives so that the tip moves as wished, within their ranges.

# A change of a drive by its whole range weighs as much as a miss by this share of the robot's
# length: it keeps antagonists from working against each other, and steps small near a singularity.
_EFFORT = 0.02


def change_toward(way_m: Array, slopes: Array, length_m: float, least: Array, most: Array) -> Array:
    """Return the change of the drives' levels that moves the tip by `way_m`, or as near as they can.

    `way_m` is the wished motion, shape (m,) [m], by `slopes` of it by the levels, shape (m, d) [m]; `least`
    <= 0 <= `most`, shape (d,), bound the change.
    """
    effort = _EFFORT * length_m * np.eye(slopes.shape[1])
    # A drive at the end of its range: the solver wants room between the bounds.
    low, high = np.minimum(least, -1e-9), np.maximum(most, 1e-9)
    found = lsq_linear(
        np.concatenate([slopes, effort]), np.concatenate([way_m, np.zeros(len(effort))]), (low, high)
    )
    return np.clip(found.x, least, most)


# ----------------------------------------------------------------------------------------------------
# A simulated robot with all its effects, moved by its drives.

Generators = Sequence[np.random.Generator]
START_S = 1.0  # simulated time in which a load that acts at rest (an offset, a payload) comes on


class Plant:
    """A simulated robot, its effects included.

    Effects on the inputs go from command to command, one for each `move`, and those on what is seen from look
    to look. What they send beyond the end of a catheter's joint, where its gaps have closed or its tendon is
    unwound, stops there: the drive stands against it.

    Attributes:
        specified: the robot with its effects named.
        simulator: the robot with its effects built in.
        quick: the robot without its effects, friction and load.
        drives: what moves it.
        segment_length: shape (s,) [m].
        rest_bends: bends of the unloaded robot, as `quick` has them, shape (*b).
        level: of the drives now, shape (d,).
        sees_the_past: what is seen depends on what was.
        inertial: it moves as its masses and its own damping let it.
        carriage: where the base is held, from where it stands in the model: the joints of `Surroundings`,
            shape (c,) [m, rad].
    """

    def __init__(
        self,
        robot: RobotSpec,
        actuation: str | None,
        gravity_mps2: Sequence[float],
        largest_bend_rad: float | None = None,
        surround: Surround | None = None,
        inertial: bool = False,
    ) -> None:
        """Build the model.

        Effects on the inputs are in the unit of the `actuation`, "tension" or "displacement", by default the
        robot's own. Gravity is in the base frame, shape (3,) [m/s^2]. `surround` puts the robot into
        surroundings; by default it stands alone, its base at rest. Where it is not `inertial` it follows its
        inputs without overshoot, its masses have weight alone.

        Raises:
            InputError: the robot knows no such actuation, an effect is unknown or acts on the shape,
                there is nothing to drive, or it is inertial and in surroundings.
        """
        if inertial and surround is not None:
            raise InputError("dynamics = 'inertial': not in surroundings; choices there: quasi-static")
        self.inertial = inertial
        actuation = actuation or robot.actuation
        self.quick = quick_model(robot, actuation, largest_bend_rad)
        self.drives = self.quick.drives
        self.specified = replace(robot, actuation=actuation)
        check_effects(self.specified)
        outside = reshaping(self.specified)
        if outside:
            raise InputError(
                f"{robot.name}: {', '.join(f'effects.{name}' for name in outside)}: acts on the shape of the "
                "whole robot, which `simulate` shows and an environment does not; leave it out"
            )
        built_in = with_built_in_effects(self.specified)
        check_robot(built_in, robot.name)
        # By default without inertia, as in all checks against theory: dry friction remembers every overshoot,
        # and how far a robot of assumed mass and damping overshoots is not known.
        around = surround(built_in, actuation) if surround else None
        self.simulator = Simulator(
            built_in,
            actuation,
            gravity_mps2,
            inertia=False,
            model_text=around.text if around else None,
            tissue_N_per_m=around.tissue_N_per_m if around else None,
        )
        self._stream_N = around.stream_N if around else None
        names = around.carriage if around else ()
        self._carriage = np.array([self.simulator.model.actuator(name).id for name in names], dtype=int)
        self._range = input_range(built_in)
        self._arriving = ArrivingCommands(self.specified)
        self.sees_the_past = remembers_what_was_seen(self.specified)
        self.segment_length = self.quick.segment_length
        self._bend_of = np.zeros((*self.quick.bend_unit.shape, self.simulator.model.nq))
        for index in range(self.simulator.model.njnt):
            joint = self.simulator.model.joint(index)
            place = self.quick.bend_of(joint.name)
            if place is not None:
                self._bend_of[(*place, int(joint.qposadr[0]))] = 1.0
        self.rest_bends = self._bend_of @ self.simulator.model.qpos_spring
        self.reset()

    def reset(self) -> None:
        """Return to rest: drives at zero, weight and constant loads acting, no history.

        `SimulationDiverged` is raised where it does not stand, as where a motion ends in no finite state.
        """
        self.simulator.reset()
        self.level = np.zeros(len(self.drives.names))
        self.carriage = np.zeros(len(self._carriage))
        self._time_s = 0.0
        self._arriving.reset()
        self._sights: dict[str, tuple[Sight, float]] = {}
        self._wrench = np.zeros(len(self.specified.tendons) + 6)
        loaded = self._arrived(0.0)
        if loaded.any():
            self._ramp(loaded, START_S)
        self.settle()

    def move(self, level: Array, duration_s: float, carriage: Array | None = None) -> None:
        """Move the drives linearly to `level`, shape (d,), in `duration_s` of simulated time.

        With them the base goes to `carriage`, shape (c,) [m, rad]; by default it stays.
        """
        self.level = np.array(level)
        self._time_s += duration_s
        self._ramp(self._arrived(duration_s), duration_s, carriage)

    def settle(self) -> None:
        """Wait under the present inputs until the robot is at rest, 5 simulated seconds at most.

        Aids for coming to rest act meanwhile, also where it is inertial.
        """
        if self.inertial:
            self.simulator.hold()
        self.simulator.settle()
        if self.inertial:
            self.simulator.let_go()

    def posture(self) -> Posture:
        """Return where the robot is."""
        return self.simulator.posture()

    def measured(self, p_w: Array, R_w: Array, what: str = "tip") -> tuple[Array, Array]:
        """Return what is measured now of positions (..., 3) [m] and orientations (..., 3, 3) of something."""
        sight, last_s = self._sights.get(what, (None, self._time_s))
        sight = sight or Sight(self.specified)
        self._sights[what] = sight, self._time_s
        return sight.look(p_w, R_w, self._time_s - last_s)

    def segment_bends(self) -> Array:
        """Return the robot's bends, sums of its joints, shape (*b)."""
        return self._bend_of @ self.simulator.data.qpos

    def bends_at(self, qpos: Array) -> Array:
        """Return the bends at many positions (m, nq), shape (m, *b)."""
        return np.moveaxis(np.tensordot(self._bend_of, qpos, axes=(-1, -1)), -1, 0)

    def inputs_at(self, level: Array) -> Array | None:
        """Return the tendons' inputs, shape (m, t), that levels (m, d) become whatever came before them.

        None where an effect changes inputs: it may remember earlier ones, or loads the tip.
        """
        if self._arriving.change:
            return None
        return np.clip(np.matmul(self.drives.tendon, level[..., np.newaxis])[..., 0], *self._range)

    def _arrived(self, duration_s: float) -> Array:
        """Return the tendons' inputs and the tip's wrench that the present levels become, (t + 6,)."""
        tendon, force, moment = self._arriving.step(self.drives.tendon @ self.level, duration_s)
        return np.concatenate([np.clip(tendon, *self._range), force, moment])

    def _ramp(self, wrench: Array, duration_s: float, carriage: Array | None = None) -> None:
        simulator, tendons = self.simulator, len(self.specified.tendons)
        steps = max(1, round(duration_s / simulator.model.opt.timestep))
        before, base_before = self._wrench, self.carriage
        if carriage is not None:
            self.carriage = np.array(carriage)
        for step in range(1, steps + 1):
            now = before + (wrench - before) * (step / steps)
            base = base_before + (self.carriage - base_before) * (step / steps)
            simulator.data.ctrl[self._carriage] = base
            force = now[tendons : tendons + 3]
            if self._stream_N is not None:
                time_s = self._time_s - duration_s * (1.0 - step / steps)
                force = force + self._stream_N(time_s, simulator.data.site(TIP).xpos)
            simulator.put_inputs(now[:tendons], force, now[tendons + 3 :])
            simulator.step()
        self._wrench = wrench
        simulator.require_finite()


# ----------------------------------------------------------------------------------------------------
# Equal robots that one thread moves: one alone, or many together on a batch.
#
# Robots are chosen by their numbers from 0, rising, an array of shape (k,). Those that have diverged stay so
# until they are reset; nothing is raised.
#
# Both ways give the same numbers, but for rounding, which friction amplifies over an episode
# (`vector.vector_env`). `together` says which it can be; what it cannot be for,
# `simulation.copies.copied_together` names.


class RobotAlone:
    """A plant as the only robot of its group, number 0."""

    native_s = 0.0  # time of the processor spent outside Python since the beginning [s]; not known

    def __init__(self, plant: Plant) -> None:
        self._plant, self._finite = plant, np.ones(1, dtype=bool)

    def reset(self, chosen: Index) -> None:
        """Return to rest, as `Plant.reset`."""
        self._finite[chosen] = True
        self._try(self._plant.reset)

    def move(self, chosen: Index, level: Array, duration_s: float) -> None:
        """Move the drives to `level`, shape (k, d), as `Plant.move`."""
        self._try(lambda: self._plant.move(level[0], duration_s))

    def settle(self, chosen: Index) -> None:
        """Wait until each is at rest, as `Plant.settle`."""
        self._try(self._plant.settle)

    def finite(self, chosen: Index) -> np.ndarray:
        """Return which have not diverged, shape (k,)."""
        return self._finite[chosen]

    def tips(self, chosen: Index) -> tuple[Array, Array, Array]:
        """Return the tips' places (k, 3) [m] and orientations (k, 3, 3), and tensions (k, t) [N]."""
        now = self._plant.posture()
        return np.array([now.p_w[-1]]), np.array([now.R_w[-1]]), np.array([now.actuator_tension])

    def bends(self, chosen: Index) -> Array:
        """Return their bends, shape (k, *b), as `Plant.segment_bends`."""
        return self._plant.segment_bends()[np.newaxis]

    def state(self, one: int) -> DrawnState:
        """Return what a picture of one of them needs."""
        return state_of(self._plant.simulator)

    def _try(self, act: Callable[[], None]) -> None:
        if self._finite[0]:
            try:
                act()
            except SimulationDiverged:
                self._finite[0] = False


class Together:
    """Copies of a plant on a batch, where `together` affirms it; methods as of `RobotAlone`."""

    def __init__(self, plant: Plant, count: int) -> None:
        self._plant, self._copies = plant, Copies(plant.simulator, count)
        self._inputs = np.zeros((count, len(plant.specified.tendons)))
        plant.reset()  # its simulator has been reset alone
        rest = plant.inputs_at(np.zeros((1, len(plant.drives.names))))
        assert rest is not None
        self._rest = rest[0]
        self._state = state_of(plant.simulator)

    @property
    def native_s(self) -> float:
        return self._copies.native_s

    def reset(self, chosen: Index) -> None:
        self._copies.reset(chosen)
        self._inputs[chosen] = 0.0
        if self._rest.any():
            self._ramp(chosen, np.tile(self._rest, (len(chosen), 1)), START_S)
        self.settle(chosen)

    def move(self, chosen: Index, level: Array, duration_s: float) -> None:
        inputs = self._plant.inputs_at(level)
        assert inputs is not None
        self._ramp(chosen, inputs, duration_s)

    def settle(self, chosen: Index) -> None:
        self._copies.settle(chosen)

    def finite(self, chosen: Index) -> np.ndarray:
        return self._copies.finite(chosen)

    def tips(self, chosen: Index) -> tuple[Array, Array, Array]:
        return self._copies.tips(chosen)

    def bends(self, chosen: Index) -> Array:
        return self._plant.bends_at(self._copies.qpos[chosen])

    def state(self, one: int) -> DrawnState:
        return DrawnState(self._copies.qpos[one].copy(), {**self._state.moved, **self._copies.moved(one)})

    def _ramp(self, chosen: Index, inputs: Array, duration_s: float) -> None:
        self._copies.ramp(chosen, self._inputs[chosen], inputs, duration_s)
        self._inputs[chosen] = inputs


RobotGroup = RobotAlone | Together


def together(plant: Plant) -> bool:
    """Whether copies of `plant` can be moved `Together`."""
    plain = plant.inputs_at(plant.level[np.newaxis]) is not None and not plant.sees_the_past
    return plain and not plant.inertial and copied_together(plant.simulator)


# ----------------------------------------------------------------------------------------------------
# Random points and ways of a robot's tip, for many robots at once.
#
# Whoever draws for many gets of each what its generator alone would have given: each robot goes on with its
# own generator until it has what it needs.

RAMP_S = 1.0  # simulated time from rest to the drives' goal, before the robot settles
PULLED_SHARE = 0.5  # of the tension drives in a random draw: single tendons and antagonists alike
PATH_LEGS = 2  # random levels that a way goes through
_MOST_DRAWS = 100


@dataclass(frozen=True)
class DrawnPoints:
    """A posture that was looked for."""

    level: Array  # of the drives, shape (d,)
    tip_m: Array  # where the tip comes to rest under them, shape (3,) [m]


@dataclass(frozen=True)
class Path:
    """A way that the tip of a simulated robot went, from rest."""

    level: Array  # of the drives at the end of each control step, rest first, shape (r + 1, d)
    tip_m: Array  # where the tip was then, shape (r + 1, 3) [m]
    direction: Array  # unit vectors along the tip's axis there, shape (r + 1, 3)


def random_targets(
    plant: Plant, robots: RobotGroup, chosen: Index, rngs: Generators, clearance_m: float
) -> list[DrawnPoints]:
    """Return a random reachable point for each chosen robot, `clearance_m` or more from its tip at rest.

    `plant` says what the robots are and is not moved; each chosen robot has a generator.

    Raises:
        InputError: no draw of a robot ends so far from rest.
        SimulationDiverged: they do not even stand at rest.
    """
    require_standing(plant, robots, chosen)
    rest = robots.tips(chosen)[0]
    found: dict[int, DrawnPoints] = {}
    open_ = np.arange(len(chosen))
    for _ in range(_MOST_DRAWS):
        level = np.array([random_level(plant, rngs[int(place)]) for place in open_])
        moved = chosen[open_]
        robots.reset(moved)
        robots.move(moved, level, RAMP_S)
        robots.settle(moved)
        tips = robots.tips(moved)[0]
        far = np.linalg.norm(tips - rest[open_], axis=1) >= clearance_m
        done = far & robots.finite(moved)
        for row in np.flatnonzero(done):
            found[int(open_[row])] = DrawnPoints(level[row], tips[row].copy())
        open_ = open_[~done]
        if not len(open_):
            return [found[place] for place in range(len(chosen))]
    raise _too_near(plant, clearance_m)


def random_paths(
    plant: Plant,
    robots: RobotGroup,
    chosen: Index,
    rngs: Generators,
    clearance_m: float,
    steps: int,
    step_s: float,
) -> list[Path]:
    """Return for each chosen robot the way of its tip from rest through random levels, one after another.

    Between two levels the drives start and stop gently; the longer way takes more of the `steps`. The tip
    comes at least `clearance_m` away from rest. Arguments as of `random_targets`.

    Raises:
        InputError: no draw takes a robot's tip so far.
        SimulationDiverged: they do not even stand at rest.
    """
    found: dict[int, Path] = {}
    open_ = np.arange(len(chosen))
    for _ in range(_MOST_DRAWS):
        drawn = {int(place): random_levels(plant, rngs[int(place)], steps) for place in open_}
        going = np.array([place for place in open_ if drawn[int(place)] is not None], dtype=int)
        if len(going):
            levels = np.array([drawn[int(place)] for place in going])
            require_standing(plant, robots, chosen[going])
            tips, directions = _gone(robots, chosen[going], levels, step_s)
            away = np.linalg.norm(tips - tips[:, :1], axis=2).max(axis=1)
            done = (away >= clearance_m) & robots.finite(chosen[going])
            for row in np.flatnonzero(done):
                found[int(going[row])] = Path(levels[row], tips[row], directions[row])
        open_ = np.array([place for place in open_ if int(place) not in found], dtype=int)
        if not len(open_):
            return [found[place] for place in range(len(chosen))]
    raise _too_near(plant, clearance_m)


def random_level(plant: Plant, rng: np.random.Generator) -> Array:
    """Return random levels of the drives, shape (d,); of tension drives some stay slack."""
    level = rng.uniform(plant.drives.lowest, 1.0)
    pulled = rng.random(len(level)) < PULLED_SHARE
    return np.where(pulled, level, 0.0) if plant.drives.quantity is Quantity.TENSION else level


def random_levels(plant: Plant, rng: np.random.Generator, steps: int) -> Array | None:
    """Return the drives' levels on a random way from rest, shape (steps + 1, d); None where it is none."""
    ends = np.array([np.zeros(len(plant.level)), *(random_level(plant, rng) for _ in range(PATH_LEGS))])
    passed = np.cumsum([0.0, *np.abs(np.diff(ends, axis=0)).max(axis=1)])
    if not passed[-1] > 0.0:
        return None
    # Along each leg by a half wave of the cosine; legs share the steps by how far they go.
    leg = np.linspace(0.0, passed[-1], steps + 1)
    start = np.clip(np.searchsorted(passed, leg, side="right") - 1, 0, PATH_LEGS - 1)
    share = (leg - passed[start]) / np.maximum(passed[start + 1] - passed[start], 1e-12)
    gently = (0.5 - 0.5 * np.cos(math.pi * np.clip(share, 0.0, 1.0)))[:, np.newaxis]
    levels: Array = ends[start] + gently * (ends[start + 1] - ends[start])
    return levels


def require_standing(plant: Plant, robots: RobotGroup, chosen: Index) -> None:
    """Return robots to rest; raise `SimulationDiverged` where they do not stand."""
    robots.reset(chosen)
    if not robots.finite(chosen).all():
        raise SimulationDiverged(f"{plant.specified.name}: the simulation diverged on the way to rest")


def _gone(robots: RobotGroup, chosen: Index, levels: Array, step_s: float) -> tuple[Array, Array]:
    """Return where tips were and looked, (k, r + 1, 3), from rest through `levels`, (k, r + 1, d)."""
    tips, directions = np.zeros((2, *levels.shape[:2], 3))
    for step in range(levels.shape[1]):
        if step > 0:
            robots.move(chosen, levels[:, step], step_s)
        place, axes, _ = robots.tips(chosen)
        tips[:, step], directions[:, step] = place, axes[:, :, 2]
    return tips, directions


def _too_near(plant: Plant, clearance_m: float) -> InputError:
    return InputError(
        f"{plant.specified.name}: in {_MOST_DRAWS} random draws of its inputs the tip never came to "
        f"{clearance_m * 1e3:g} mm or more from where it stands"
    )


# ----------------------------------------------------------------------------------------------------
# Many copies of one robot on a pool of threads, and what is drawn for them ahead.

T = TypeVar("T")


class Fleet:
    """Copies of a plant, a part of them for each thread; numbers from 0 choose among them, rising."""

    def __init__(self, plant: Plant, count: int, threads: int) -> None:
        """Make `count` copies on at most so many threads."""
        threads = min(threads, count)
        ends = np.linspace(0, count, threads + 1).astype(int)
        self._first = ends[:-1]
        self._parts: list[Together] = [Together(plant, size) for size in np.diff(ends)]
        self._part_of = np.repeat(np.arange(threads), np.diff(ends))
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None

    @property
    def native_s(self) -> float:
        """Time of the processors spent in MuJoCo and compiled loops since the beginning [s]."""
        return sum(part.native_s for part in self._parts)

    def each(self, chosen: Index, act: Callable[[RobotGroup, Index, Index], T]) -> list[T]:
        """Call `act` for the chosen copies of each thread at once, and return what they return.

        It gets a thread's robots, the numbers of the chosen ones among them, and their places in `chosen`.
        """
        tasks: list[Callable[[], T]] = []
        for part, (robots, first) in enumerate(zip(self._parts, self._first, strict=True)):
            places = np.flatnonzero(self._part_of[chosen] == part)
            if len(places):
                own = chosen[places] - first
                tasks.append(lambda robots=robots, own=own, places=places: act(robots, own, places))  # type: ignore[misc]
        if self._pool is None or len(tasks) == 1:
            return [task() for task in tasks]
        return [future.result() for future in [self._pool.submit(task) for task in tasks]]

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()


class Supply(Generic[T]):
    """What is drawn by simulation at each reset: many at once, and ahead, on copies of the robots.

    A single copy that ends its episode would leave all threads but one idle. So what is drawn then is drawn
    for every copy that has none in stock. Each copy's things are those that its own generator gives.
    """

    def __init__(
        self,
        plant: Plant,
        count: int,
        threads: int,
        draw: Callable[[RobotGroup, Index, Generators], list[T]],
    ) -> None:
        """Build the robots that draw."""
        self._fleet = Fleet(plant, count, threads)
        self._draw = draw
        # of each copy the generator's state before the draw, the generator after it, and what was drawn
        self._stock: dict[int, tuple[object, np.random.Generator, T]] = {}

    def take(self, chosen: Index, rngs: list[np.random.Generator | None]) -> list[T]:
        """Return a thing for each of the chosen copies, whose generators in `rngs` then have gone on."""
        for one, (before, _, _) in list(self._stock.items()):
            rng = rngs[one]
            if rng is None or rng.bit_generator.state != before:  # seeded anew, or used by others
                del self._stock[one]
        if any(int(one) not in self._stock for one in chosen):
            empty = [one for one, rng in enumerate(rngs) if rng is not None and one not in self._stock]
            self._fill(np.array(empty), rngs)
        things = []
        for one in chosen:
            _, rngs[int(one)], thing = self._stock.pop(int(one))
            things.append(thing)
        return things

    def close(self) -> None:
        """End the threads."""
        self._fleet.close()

    def _fill(self, empty: Index, rngs: Sequence[np.random.Generator | None]) -> None:
        drawing = [copy.deepcopy(rng) for one in empty if (rng := rngs[one]) is not None]
        before = [rng.bit_generator.state for rng in drawing]

        def act(robots: RobotGroup, own: Index, places: Index) -> tuple[Index, list[T]]:
            return places, self._draw(robots, own, [drawing[place] for place in places])

        for places, things in self._fleet.each(empty, act):
            for place, thing in zip(places, things, strict=True):
                self._stock[int(empty[place])] = before[place], drawing[place], thing
