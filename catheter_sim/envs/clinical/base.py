"""What the clinical tasks share: a robot pushed into an anatomy, forces on its tissue, resolved rates."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import body_count
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs.robots import change_toward
from catheter_sim.envs.surroundings import Surround, Surroundings
from catheter_sim.envs.tip import (
    CONTROL_STEP_S,
    DIVERGED_REWARD,
    RATE_PER_S,
    Action,
    Bounds,
    Observation,
    TipEnv,
    checked_options,
)
from catheter_sim.errors import InputError, shown
from catheter_sim.mjcf.names import face as face_name
from catheter_sim.modelling.attach import INSERTION
from catheter_sim.modelling.build import View
from catheter_sim.pictures.images import Picture
from catheter_sim.pictures.offscreen import fitted_view
from catheter_sim.simulation.tissue import Tissue

# ----------------------------------------------------------------------------------------------------
# What the clinical tasks have in common: a robot pushed into an anatomy, and the forces on its tissue.

FORCE_WEIGHT = 0.1  # assumed: robot lengths that a step at the limit of force costs
_FORCE_BOUND = 10.0  # limits

A = TypeVar("A")  # what a task's anatomy is


@dataclass(frozen=True)
class BaseMotion:
    """A joint under the robot's base, and how an action moves it.

    Attributes:
        name: of the joint and its actuator in the surroundings' model.
        lowest, highest: ends of its range [m or rad]; it starts at 0, which lies in it.
        rate_per_s: how fast it moves at full action [m/s or rad/s].
    """

    name: str
    lowest: float
    highest: float
    rate_per_s: float


class ClinicalEnv(TipEnv, Generic[A]):
    """A robot that is pushed into an anatomy, drawn at random at every reset.

    A task's own class says what `motions` its base has, what `limits_N` its regions of tissue bear, and

    - `draw(rng)`: an anatomy, a value; `middle()`: the one in the middle of all ranges, used until `reset`;
    - `surround(anatomy, robot, actuation)`: the robot's model in it (`Surroundings`): the MJCF of
      `build_mjcf`, its base carried (`modelling.attach.carry`), its elements made to touch
      (`surroundings.let_touch`), convex geoms `tissue_<region>_<k>`, and meshes to be seen; a region's force
      is stiffness times depth at rest, whatever the robot (`simulation.tissue`). The frame of all of it is
      the task's own: places in observations and `info` are in it;
    - `begin()`: what the task asks for at the start of an episode (`target_m` and its own);
    - `judge()`: called after every step; returns its reward and whether the task is done;
    - `task_bounds()`, `task_parts()`: its own parts of the observation.

    The rest is done here. An action has the drives' changes first (as in `reach.ReachEnv`: shares of 0.05 of
    a range), then one number for each motion, in shares of what its rate allows in a step. The observation
    ends with the task's parts, `base`, where the base stands in shares of its motions' ranges, and `force`,
    the largest force on each region with a limit during the last step, in shares of the limit.

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

    motions: tuple[BaseMotion, ...]
    limits_N: ClassVar[Mapping[str, float]]
    reset_options = ("anatomy",)
    anatomy: A

    def __init__(self, robot: Any, **arguments: Any) -> None:
        """Build the robot in the middle anatomy; arguments are those of `TipEnv`."""
        super().__init__(robot, **arguments)
        self.force_N = self.peak_N = np.zeros(len(self._tissue.regions))

    @abstractmethod
    def draw(self, rng: np.random.Generator) -> A:
        """Return a random anatomy."""

    @abstractmethod
    def middle(self) -> A:
        """Return the anatomy in the middle of all ranges."""

    @abstractmethod
    def surround(self, anatomy: A, robot: RobotSpec, actuation: str) -> Surroundings:
        """Return the robot's model in the anatomy."""

    @abstractmethod
    def begin(self) -> None:
        """Start the task: the robot is at rest in `anatomy`."""

    @abstractmethod
    def judge(self) -> tuple[float, bool]:
        """Return the task's part of the step's reward, and whether the task is done."""

    @abstractmethod
    def task_bounds(self) -> Bounds:
        """Return the task's own parts of the observation: lower bounds and the upper bound of each."""

    @abstractmethod
    def task_parts(self) -> Mapping[str, Array]:
        """Return the values of these parts."""

    @abstractmethod
    def seen_points(self) -> Array:
        """Return points that a picture shows, shape (n, 3) [m]."""

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation | Picture, dict[str, Any]]:
        """Start an episode in a new anatomy.

        Args:
            seed: of the random anatomies from now on; None: go on with the present generator.
            options: `{"anatomy": ...}`, a value of the task's kind, or nothing for a random one.

        Raises:
            InputError: an unknown option, or an anatomy of another kind.
        """
        given = checked_options(options, self.reset_options).get("anatomy")
        if given is not None and not isinstance(given, type(self.anatomy)):
            raise InputError(f"anatomy = {shown(given)}: a {type(self.anatomy).__name__} is needed")
        super().reset(seed=seed, options=options)
        self._start()
        self.peak_N = np.zeros(len(self._tissue.regions))
        self._note_forces()
        self.begin()
        return self._observation(), self._info(False)

    def step(self, action: Action) -> tuple[Observation | Picture, float, bool, bool, dict[str, Any]]:
        """Move the drives and the base for one control step; see the class's text."""
        if not self._moved(action):
            return self._observation(), DIVERGED_REWARD, True, False, self._info(False)
        self._note_forces()
        reward, done = self.judge()
        reward -= FORCE_WEIGHT * float(self._shares(self.force_N).max(initial=0.0))
        if self.pressed_too_hard:
            return self._observation(), DIVERGED_REWARD, True, False, self._info(False)
        return self._observation(), reward, done, False, self._info(done)

    @property
    def pressed_too_hard(self) -> bool:
        """Whether a limit of force was passed in this episode."""
        return bool((self._shares(self.peak_N) > 1.0).any())

    @property
    def _tissue(self) -> Tissue:
        tissue = self.plant.simulator.tissue
        assert tissue is not None
        return tissue

    def _prepare(self) -> None:
        self.anatomy = self.middle()

    def _surround(self) -> Surround:
        return lambda robot, actuation: self.surround(self.anatomy, robot, actuation)

    def _renew(self, options: Mapping[str, Any]) -> None:
        given = options.get("anatomy")
        self.anatomy = self.draw(self.np_random) if given is None else given
        self._replace_plant()

    def _base_after(self, change: Array) -> Array:
        rates = np.array([motion.rate_per_s for motion in self.motions])
        lowest = np.array([motion.lowest for motion in self.motions])
        highest = np.array([motion.highest for motion in self.motions])
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
        ranges = [(min(motion.lowest / motion.highest, 0.0), motion) for motion in self.motions]
        return {
            **self.task_bounds(),
            "base": (np.array([low for low, _ in ranges]), 1.0),
            "force": (np.zeros(len(self.limits_N)), _FORCE_BOUND),
        }

    def _more_parts(self) -> Mapping[str, Array]:
        return {
            **self.task_parts(),
            "base": self.plant.carriage / [motion.highest for motion in self.motions],
            "force": self._shares(self.force_N),
        }

    def _observation(self) -> Observation | Picture:
        return self._observed({"target": self.target_m / self.length_m})

    def _info(self, done: bool) -> dict[str, Any]:
        names = self._tissue.regions
        told = {
            **self._common_info(),
            "force_N": dict(zip(names, map(float, self.force_N), strict=True)),
            "peak_force_N": dict(zip(names, map(float, self.peak_N), strict=True)),
            "pressed_too_hard": self.pressed_too_hard,
            "is_success": bool(done and not self.pressed_too_hard and not self._diverged),
        }
        for motion, place in zip(self.motions, self.plant.carriage, strict=True):
            told[f"{motion.name}_{'m' if motion.name == INSERTION else 'rad'}"] = float(place)
        return self._handed_out(told)

    def _view(self) -> View:
        points = self.seen_points()
        seen = View("anatomy", points.mean(axis=0), np.array([0.0, -1.0, 0.0]), 0.1)
        return fitted_view(seen, points, *self._size)


# ----------------------------------------------------------------------------------------------------
# Resolved rates of a robot in an anatomy: how its points move with its drives and its base.
#
# Slopes come from the simulated posture: MuJoCo's Jacobian of a point at the joints as they stand,
# friction, load and contacts included, times what drives do to joints without them (`quick_model`). Joints
# that a sheath still holds straight do not move; where the robot is pushed on, the joint that leaves it
# bends.


@dataclass(frozen=True)
class Wish:
    """That a point of the robot moves so.

    Attributes:
        element: whose far face the point is the middle of, from 1; the last one's is the tip.
        way_m: wished motion, shape (3,) [m].
        along: only these directions count, shape (k, 3), each as long as its weight.
    """

    element: int
    way_m: Array
    along: Array


class Rates:
    """A robot in a task, as its simulation stands now."""

    def __init__(self, env: ClinicalEnv, out_m: float) -> None:
        """Read the robot's state.

        Args:
            env: the task; its base slides along z.
            out_m: z beyond which the robot is free to bend [m].
        """
        self._env, plant = env, env.plant
        self._model, self._data = plant.simulator.model, plant.simulator.data
        mujoco.mj_fwdPosition(self._model, self._data)
        self.elements = body_count(plant.simulator.robot)
        sites = [self._model.site(face_name(k)).id for k in range(1, self.elements + 1)]
        self._sites = sites
        self.p_w = self._data.site_xpos[sites].copy()
        self._joints = self._joint_slopes(out_m)

    def choose(self, wishes: list[Wish]) -> Action:
        """Return the action that fulfils the wishes as well as one step can."""
        env, plant = self._env, self._env.plant
        slopes, ways = [], []
        for wish in wishes:
            jacobian = np.zeros((3, self._model.nv))
            mujoco.mj_jacSite(self._model, self._data, jacobian, None, self._sites[wish.element - 1])
            slopes.append(wish.along @ jacobian @ self._joints)
            ways.append(wish.along @ wish.way_m)
        ranges = np.array([motion.highest for motion in env.motions])
        ends = np.array([(motion.lowest, motion.highest) for motion in env.motions])
        rates = np.array([motion.rate_per_s for motion in env.motions]) / ranges
        largest = CONTROL_STEP_S * np.concatenate([np.full(len(plant.level), RATE_PER_S), rates])
        place = np.concatenate([plant.level, plant.carriage / ranges])
        lowest = np.concatenate([plant.drives.lowest, ends[:, 0] / ranges])
        least = np.clip(lowest - place, -largest, 0.0)
        most = np.clip(1.0 - place, 0.0, largest)
        change = change_toward(np.concatenate(ways), np.concatenate(slopes), env.length_m, least, most)
        return (change / largest).astype(np.float32)

    def _joint_slopes(self, out_m: float) -> Array:
        """Return how the joints move with the levels and the base's shares of its ranges, (nv, d + c)."""
        env, model, data = self._env, self._model, self._data
        plant = env.plant
        bend = plant.drives.bend
        drives = len(plant.level)
        slopes = np.zeros((model.nv, drives + len(env.motions)))
        length = float(plant.segment_length.sum()) / self.elements
        leaving = True
        for index, place, count in plant.hinges:
            if data.xanchor[index, 2] < out_m:
                continue
            dof = int(model.jnt_dofadr[index])
            slopes[dof, :drives] = bend[place] / count
            if leaving:  # the joint that has just left the sheath
                natural = float(bend[place] @ plant.level) / count
                slopes[dof, drives] = natural / length
                leaving = False
        for number, motion in enumerate(env.motions):
            if motion.name == INSERTION:
                slopes[:, drives + number] *= motion.highest
            slopes[int(model.joint(motion.name).dofadr[0]), drives + number] = motion.highest
        return slopes
