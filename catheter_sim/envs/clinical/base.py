"""What the clinical tasks share: a robot pushed into an anatomy, and forces on its tissue."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Generic

import numpy as np

from catheter_sim.anatomy.anatomies import A, median_of, random_of
from catheter_sim.arrays import Array, Index
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs.robots import Generators, RobotGroup
from catheter_sim.envs.surroundings import Surround, Surroundings
from catheter_sim.envs.tip import DIVERGED_REWARD, Bounds, TipEnv
from catheter_sim.errors import InputError, shown
from catheter_sim.modelling.attach import INSERTION
from catheter_sim.modelling.build import View
from catheter_sim.pictures.offscreen import fitted_view
from catheter_sim.simulation.tissue import Tissue
from catheter_sim.units import in_file_units

# ----------------------------------------------------------------------------------------------------
# What the clinical tasks have in common: a robot pushed into an anatomy, and the forces on its tissue.

FORCE_WEIGHT = 0.1  # assumed: robot lengths that a step at the limit of force costs
_FORCE_BOUND = 10.0  # limits


@dataclass(frozen=True)
class BaseMotion:
    """A joint under the robot's base, and how an action moves it."""

    name: str  # of the joint and its actuator in the surroundings' model
    lowest: float  # ends of its range [m or rad]; it starts at 0, which lies in it
    highest: float
    rate_per_s: float  # how fast it moves at full action [m/s or rad/s]


class ClinicalEnv(TipEnv, Generic[A]):
    """A robot that is pushed into an anatomy, drawn at random at every reset.

    A task's own class says what `motions` its base has, what `limits_N` its regions of tissue bear, and

    - `anatomy_kind`, a class of numbers with ranges; or `draw(rng)`, an anatomy, a value, and `middle()`, the
      one in the middle of all ranges, used until `reset`;
    - `surround(anatomy, robot, actuation)`: the robot's model in it (`Surroundings`): the MJCF of
      `build_mjcf`, its base carried (`modelling.attach.carry`), its elements made to touch
      (`surroundings.let_touch`), convex geoms `tissue_<region>_<k>`, and meshes to be seen; a region's force
      is stiffness times depth at rest, whatever the robot (`simulation.tissue`). The frame of all of it is
      the task's own: places in observations and `info` are in it;
    - `begin()`: what the task asks for at the start of an episode (`target_m` and its own), at rest;
    - `judge()`: called after every step; returns its reward and whether the task is done;
    - `task_bounds()`, `task_parts()`: its own parts of the observation, lower bounds and the upper bound of
      each, and their values;
    - `seen_points()`: points that a picture shows, shape (n, 3) [m].

    The rest is done here. An action has the drives' changes first (as in `ReachEnv`: shares of 0.05 of
    a range), then one number for each motion, in shares of what its rate allows in a step. The observation
    ends with the task's parts, `base`, where the base stands in shares of its motions' ranges. Last is
    `force`, the largest force on each region with a limit during the last step, in shares of the limit.

    A region's force is the sum of the normal forces on it, taken at every step of the simulation. Where it
    goes beyond its limit the episode terminates: that is no success, and costs 200. So success, a task done,
    includes that no limit was passed since the episode's start. A step's reward is the task's minus
    `FORCE_WEIGHT` times the largest share of a limit in this step.

    Attributes:
        anatomy: of this episode.
        limits_N: of each region of tissue; a region that `surround` names and this does not is no tissue.
        force_N: the largest force on each region during the last step, in the surroundings' order.
        peak_N: the same since the episode's start.
    """

    anatomy_kind: type[A]
    motions: tuple[BaseMotion, ...]
    limits_N: ClassVar[Mapping[str, float]]
    reset_options = ("anatomy",)
    stepped_together = False
    anatomy: A
    _done = False

    def __init__(self, robot: Any, **arguments: Any) -> None:
        """Build the robot in the middle anatomy; arguments are those of `TipEnv`."""
        super().__init__(robot, **arguments)
        self.force_N = self.peak_N = np.zeros(len(self._tissue.regions))

    def draw(self, rng: np.random.Generator) -> A:
        """Return a random anatomy."""
        return random_of(self.anatomy_kind, rng)

    def middle(self) -> A:
        """Return the anatomy in the middle of all ranges."""
        return median_of(self.anatomy_kind)

    @abstractmethod
    def surround(self, anatomy: A, robot: RobotSpec, actuation: str) -> Surroundings: ...

    @abstractmethod
    def begin(self) -> None: ...

    @abstractmethod
    def judge(self) -> tuple[float, bool]: ...

    @abstractmethod
    def task_bounds(self) -> Bounds: ...

    @abstractmethod
    def task_parts(self) -> Mapping[str, Array]: ...

    @abstractmethod
    def seen_points(self) -> Array: ...

    def draw_goals(self, robots: RobotGroup, chosen: Index, rngs: Generators) -> list[None]:
        """Return nothing: what is asked lies in the anatomy, which is drawn before the robot is built."""
        return [None] * len(chosen)

    def set_goals(self, chosen: Index, goals: list[None]) -> None:
        """Start the task."""
        self._done = False
        self.peak_N = np.zeros(len(self._tissue.regions))
        self._note_forces()
        self.begin()

    def judge_rows(self, stepped: Index) -> tuple[Array, np.ndarray]:
        """Return the step's reward, and whether the episode terminates."""
        self._done = False
        if not self.diverged[0]:
            self._note_forces()
            reward, done = self.judge()
            reward -= FORCE_WEIGHT * float(self._shares(self.force_N).max(initial=0.0))
            if not self.pressed_too_hard:
                self._done = done
                return np.array([reward]), np.array([done])
        return np.array([DIVERGED_REWARD]), np.array([True])

    @property
    def pressed_too_hard(self) -> bool:
        """Whether a limit of force was passed in this episode."""
        return bool((self._shares(self.peak_N) > 1.0).any())

    @property
    def _distance_m(self) -> float:
        """How far the tip is from the target, in truth."""
        return float(self._distance()[0])

    @property
    def _tissue(self) -> Tissue:
        tissue = self.plant.simulator.tissue
        assert tissue is not None
        return tissue

    def _prepare(self) -> None:
        self.anatomy = self.middle()

    def _surround(self) -> Surround:
        return lambda robot, actuation: self.surround(self.anatomy, robot, actuation)

    def _checked_options(self, options: Any) -> dict[str, Any]:
        known = super()._checked_options(options)
        given = known.get("anatomy")
        if given is not None and not isinstance(given, type(self.anatomy)):
            raise InputError(f"anatomy = {shown(given)}: a {type(self.anatomy).__name__} is needed")
        return known

    def _renew(self, options: Mapping[str, Any]) -> None:
        given = options.get("anatomy")
        self.anatomy = self.draw(self.np_random) if given is None else given
        self._replace_plant()

    def _base_after(self, change: Array) -> Array:
        motions = [(motion.rate_per_s, motion.lowest, motion.highest) for motion in self.motions]
        rates, lowest, highest = np.array(motions).T
        return np.clip(self.plant.carriage + change * rates, lowest, highest)

    def _note_forces(self) -> None:
        """Take down the largest forces since this was called last."""
        self.force_N = self._tissue.peak_N
        self.peak_N = np.maximum(self.peak_N, self.force_N)
        self._tissue.forget()

    def _shares(self, force_N: Array) -> Array:
        """Return forces on regions with limits in shares of these, shape (l,)."""
        places = [self._tissue.regions.index(name) for name in self.limits_N]
        return force_N[places] / np.array(list(self.limits_N.values()))

    def _more_bounds(self) -> Bounds:
        lowest = [min(motion.lowest / motion.highest, 0.0) for motion in self.motions]
        return {
            **self.task_bounds(),
            "base": (np.array(lowest), 1.0),
            "force": (np.zeros(len(self.limits_N)), _FORCE_BOUND),
        }

    def _more_parts(self) -> Mapping[str, Array]:
        parts = {
            **self.task_parts(),
            "base": self.plant.carriage / [motion.highest for motion in self.motions],
            "force": self._shares(self.force_N),
        }
        return {name: part[np.newaxis] for name, part in parts.items()}

    def _task_info(self) -> Mapping[str, Any]:
        return {"is_success": np.array([self._done])}

    def _info(self) -> dict[str, Any]:
        names = self._tissue.regions
        more: dict[str, Any] = {
            "force_N": dict(zip(names, map(float, self.force_N), strict=True)),
            "peak_force_N": dict(zip(names, map(float, self.peak_N), strict=True)),
            "pressed_too_hard": self.pressed_too_hard,
        }
        for motion, place in zip(self.motions, self.plant.carriage, strict=True):
            more[f"{motion.name}_{'m' if motion.name == INSERTION else 'rad'}"] = float(place)
        return {**super()._info(), **in_file_units(more)}

    def _view(self) -> View:
        points = self.seen_points()
        view = View("anatomy", points.mean(axis=0), np.array([0.0, -1.0, 0.0]), 0.1)
        return fitted_view(view, points, *self._size)
