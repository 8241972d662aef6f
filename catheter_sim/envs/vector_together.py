"""Environments whose robots are stepped together: Reach and Track behind Gymnasium's `VectorEnv`."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from catheter_sim.arrays import Array, Index
from catheter_sim.envs import EPISODE_STEPS
from catheter_sim.envs.arguments import (
    checked_above_zero,
    checked_actions,
    checked_choice,
    checked_mask,
    checked_options,
    checked_seeds,
    checked_whole,
    require_running,
)
from catheter_sim.envs.draws import Path, random_paths, random_targets, require_standing
from catheter_sim.envs.fleet import Fleet, Supply
from catheter_sim.envs.observation import Seen, observe
from catheter_sim.envs.reach import ReachEnv, arrived
from catheter_sim.envs.robots import Robots
from catheter_sim.envs.tip import (
    CONTROL_STEP_S,
    DIVERGED_REWARD,
    TARGET_CLEARANCE,
    TipEnv,
    commanded_name,
    level_after,
)
from catheter_sim.envs.track import TrackEnv, angle_between, cost_of, followed
from catheter_sim.errors import InputError, shown
from catheter_sim.pictures.images import Picture
from catheter_sim.pictures.state import State
from catheter_sim.units import in_file_units

Infos = dict[str, Any]
_SEEN = "action_space", "observation_space", "state_space", "layout", "metadata", "render_mode", "pixels"
_TASK = "drives", "dynamics", "hold_steps", "length_m", "randomised", "time_left", "tolerance_m"
SHARED = (*_SEEN, *_TASK)  # attributes of one environment that copies have in common


class TogetherEnv(VectorEnv[Any, Any, Any]):
    """Many copies of one `tip.TipEnv`; see the text of `vector`."""

    metadata: dict[str, Any] = dict(TipEnv.metadata)  # noqa: RUF012 - Gymnasium's way

    def __init__(
        self,
        one: TipEnv,
        num_envs: int,
        max_episode_steps: int | None,
        threads: int,
        autoreset_mode: AutoresetMode,
    ) -> None:
        """Make copies of `one`, which is kept for what all have in common."""
        self.one, self.plant = one, one.plant
        self.num_envs = num_envs
        self.metadata = {**one.metadata, "autoreset_mode": autoreset_mode}
        self.render_mode = one.render_mode
        self.layout, self.drives = one.layout, one.drives
        self.single_observation_space, self.single_action_space = one.observation_space, one.action_space
        self.observation_space = batch_space(one.observation_space, num_envs)
        self.action_space = batch_space(one.action_space, num_envs)
        self._mode, self._limit = autoreset_mode, max_episode_steps
        self._fleet = Fleet(one.plant, num_envs, threads)
        self._all = np.arange(num_envs)
        self._rngs: list[np.random.Generator | None] = [None] * num_envs
        self._seeds = [-1] * num_envs
        self._draws = one.pixels or one.render_mode is not None
        self._states: list[State | None] = [None] * num_envs
        drives, tendons = len(one.drives.names), len(one.plant.specified.tendons)
        self._now = Seen(
            tip=np.zeros((num_envs, 3)),
            seen_tip=np.zeros((num_envs, 3)),
            direction=np.zeros((num_envs, 3)),
            seen_direction=np.zeros((num_envs, 3)),
            velocity=np.zeros((num_envs, 3)),
            seen_velocity=np.zeros((num_envs, 3)),
            level=np.zeros((num_envs, drives)),
            tension=np.zeros((num_envs, tendons)),
            bends=np.zeros((num_envs, *one.plant.quick.bend_unit.shape)),
        )
        self._level = np.zeros((num_envs, drives))
        self._target = np.zeros((num_envs, 3))
        self._elapsed = np.zeros(num_envs, dtype=int)
        self._diverged = np.zeros(num_envs, dtype=bool)
        self._ended = np.zeros(num_envs, dtype=bool)
        self._begun = np.zeros(num_envs, dtype=bool)

    @property
    def native_s(self) -> float:
        """Time of the processors that the steps of episodes spent in MuJoCo and compiled loops [s]."""
        return self._fleet.native_s

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The copies' generators."""
        return tuple(self._generator(one) for one in range(self.num_envs))

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The copies' seeds; a copy that was given none draws one."""
        for one in range(self.num_envs):
            self._generator(one)
        return tuple(self._seeds)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Any, Infos]:
        """Start episodes; see the text of `vector`.

        Args:
            seed: one for each copy, or that of the first, each further one by one more.
            options: those of the task's reset, for all; `reset_mask`, shape (n,): which copies.

        Raises:
            InputError: a bad mask, wrong number of seeds, or what the task's reset raises.
        """
        options = checked_options(options, (*self.one.reset_options, "reset_mask"))
        chosen = np.flatnonzero(checked_mask(options.pop("reset_mask", None), self.num_envs))
        seeds = checked_seeds(seed, self.num_envs)
        for one in chosen:
            own = seeds[one]
            if own is not None:
                self._rngs[one], self._seeds[one] = seeding.np_random(own)
        self._begin(chosen, self._goals(chosen, options))
        return self._observations(), self._infos(chosen)

    def step(self, actions: Any) -> tuple[Any, Array, np.ndarray, np.ndarray, Infos]:
        """Move all copies for one control step; those whose episode ended start anew, by the mode.

        Raises:
            InputError: the actions have another shape, or are no numbers; without autoreset, an episode
                has ended.
            ResetNeeded: an environment was never reset.
        """
        if not self._begun.all():
            raise gymnasium.error.ResetNeeded("step() needs a reset of every environment before it")
        anew = self._ended if self._mode is AutoresetMode.NEXT_STEP else np.zeros_like(self._ended)
        if self._mode is AutoresetMode.DISABLED:
            require_running(self._ended)
        stepping, starting = np.flatnonzero(~anew), np.flatnonzero(anew)
        wished = checked_actions(actions, (len(self._level), self._level.shape[1]), stepping)
        goals = self._goals(starting, {}) if len(starting) else []
        self._level[stepping] = level_after(self._level[stepping], wished[stepping], self.drives)
        self._fleet.each(stepping, lambda robots, own, places: self._move(robots, own, stepping[places]))
        rewards, terminations, truncations = np.zeros(self.num_envs), *np.zeros((2, self.num_envs), bool)
        if len(stepping):
            rewards[stepping], terminations[stepping] = self._judge(stepping)
            self._elapsed[stepping] += 1
        over = self._over() if self._limit is None else self._over() | (self._elapsed >= self._limit)
        truncations[stepping] = over[stepping]
        if len(starting):
            self._begin(starting, goals)
        ended = terminations | truncations
        infos: Infos = {}
        if self._mode is AutoresetMode.SAME_STEP and ended.any():
            done = np.flatnonzero(ended)
            infos = self._finals(done)
            self._begin(done, self._goals(done, {}))
        self._ended = ended if self._mode is not AutoresetMode.SAME_STEP else np.zeros_like(ended)
        return (
            self._observations(),
            rewards,
            terminations,
            truncations,
            {**infos, **self._infos(self._all)},
        )

    def render(self) -> tuple[Picture | None, ...] | None:  # type: ignore[override]
        """Return a picture of each copy, as of the task's `render`, all by one renderer."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() draws only where render_mode='rgb_array' was given to make_vec()")
            return None
        return tuple(self._picture(one) for one in range(self.num_envs))

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return what each copy has under `name`, as `SyncVectorEnv.call`.

        Copies are no environments. Each has `render`, `target_m`, `np_random` and `np_random_seed`; `SHARED`
        names what they have in common: their task's arguments, the spaces, the drives.

        Raises:
            AttributeError: they have nothing of this name.
        """
        each: dict[str, Any] = {
            "target_m": self._target.copy(),
            "np_random": self.np_random,
            "np_random_seed": self.np_random_seed,
        }
        if name == "render":
            return self.render(*args, **kwargs) or (None,) * self.num_envs
        if name in each:
            return tuple(each[name])
        if name in SHARED and hasattr(self.one, name):
            return (getattr(self.one, name),) * self.num_envs
        known = ", ".join(["render", *each, *(name for name in SHARED if hasattr(self.one, name))])
        raise AttributeError(f"{name}: not of copies that are stepped together; choices: {known}")

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of each copy; see `call`."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set `tolerance_m` or `hold_steps` of all copies.

        Args:
            name: of the attribute.
            values: the value, or a list of it for each copy.

        Raises:
            InputError: another name, a value that is impossible, or values that differ.
        """
        checks = {"tolerance_m": checked_above_zero, "hold_steps": checked_whole}
        known = [item for item in checks if hasattr(self.one, item)]
        check = checks[checked_choice("attribute of copies that are stepped together", name, known)]
        every = values if isinstance(values, list | tuple) else [values]
        found = {check(name, value) for value in every}
        if len(found) != 1:
            raise InputError(f"{name} = {shown(values)}: copies that are stepped together have one value")
        setattr(self.one, name, found.pop())

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads and free the renderer."""
        self._fleet.close()
        self.one.close()

    @abstractmethod
    def _goals(self, chosen: Index, options: Mapping[str, Any]) -> list[Any]:
        """Return what each of the chosen copies is to do in the coming episode."""

    @abstractmethod
    def _set(self, chosen: Index, goals: list[Any]) -> None:
        """Let the chosen copies, at rest, have this to do."""

    @abstractmethod
    def _judge(self, stepped: Index) -> tuple[Array, np.ndarray]:
        """Return rewards and whether the episode terminates of copies after a step, shapes (k,)."""

    def _over(self) -> np.ndarray:
        """Return of which copies the task itself has come to its end in time, shape (n,)."""
        return np.zeros(self.num_envs, dtype=bool)

    @abstractmethod
    def _goal(self) -> Mapping[str, Array]:
        """Return what all observations show of the task, each of shape (n, 3)."""

    @abstractmethod
    def _told(self) -> Mapping[str, np.ndarray]:
        """Return the task's own part of `info`, for all."""

    @property
    def _distance_m(self) -> Array:
        distance: Array = np.linalg.norm(self._now.tip - self._target, axis=1)
        return distance

    def _generator(self, one: int) -> np.random.Generator:
        rng = self._rngs[one]
        if rng is None:
            rng, self._seeds[one] = seeding.np_random(None)
            self._rngs[one] = rng
        return rng

    def _begin(self, chosen: Index, goals: list[Any]) -> None:
        """Bring copies to rest for new episodes."""
        self._level[chosen] = 0.0
        self._elapsed[chosen] = 0
        self._diverged[chosen] = self._ended[chosen] = False

        def act(robots: Robots, own: Index, places: Index) -> None:
            require_standing(self.plant, robots, own)
            self._see(robots, own, chosen[places], moved=False)

        self._fleet.each(chosen, act)
        self._set(chosen, goals)
        self._begun[chosen] = True

    def _move(self, robots: Robots, own: Index, rows: Index) -> None:
        """Move a thread's copies; those that diverge are seen as they were before."""
        robots.move(own, self._level[rows], CONTROL_STEP_S)
        finite = robots.finite(own)
        self._diverged[rows] = ~finite
        self._see(robots, own[finite], rows[finite], moved=True)

    def _see(self, robots: Robots, own: Index, rows: Index, moved: bool) -> None:
        """Take down how a thread's copies stand."""
        if not len(own):
            return
        now = self._now
        tip, axes, tension = robots.tips(own)
        seen_tip, seen_axes = self.plant.seen(tip, axes)
        now.velocity[rows] = (tip - now.tip[rows]) / CONTROL_STEP_S if moved else 0.0
        now.seen_velocity[rows] = (seen_tip - now.seen_tip[rows]) / CONTROL_STEP_S if moved else 0.0
        now.tip[rows], now.seen_tip[rows] = tip, seen_tip
        now.direction[rows], now.seen_direction[rows] = axes[:, :, 2], seen_axes[:, :, 2]
        now.level[rows], now.tension[rows], now.bends[rows] = self._level[rows], tension, robots.bends(own)
        if self._draws:
            for row, one in zip(rows, own, strict=True):
                self._states[row] = robots.state(int(one))

    def _picture(self, one: int) -> Picture:
        state = self._states[one]
        if state is None:
            raise gymnasium.error.ResetNeeded("render() needs a reset before it")
        return self.one.drawn(state, self._target[one])

    def _observations(self) -> np.ndarray:
        if self.one.pixels:
            shape = self.single_observation_space.shape or ()
            return np.stack(
                [
                    np.zeros(shape, dtype=np.uint8) if state is None else self._picture(one)
                    for one, state in enumerate(self._states)
                ]
            )
        return observe(self.plant, self._now, self._goal(), self.one.state_space, self._more_parts())

    def _more_parts(self) -> Mapping[str, Array]:
        """Return the values of the task's own further parts of all observations, each of shape (n, ...)."""
        return {}

    def _values(self) -> dict[str, np.ndarray]:
        """Return `info` of all copies."""
        now = self._now
        told = {
            "tip_m": now.tip.copy(),
            "target_m": self._target.copy(),
            "distance_m": self._distance_m,
            "speed_m_per_s": np.linalg.norm(now.velocity, axis=1),
            commanded_name(self.drives): np.matmul(self.drives.tendon, now.level[..., np.newaxis])[..., 0],
            "diverged": self._diverged.copy(),
            **self._told(),
        }
        return in_file_units(told)

    def _infos(self, chosen: Index) -> Infos:
        """Return `info` of the chosen copies as Gymnasium has it: arrays, and who has such a value."""
        has = np.zeros(self.num_envs, dtype=bool)
        has[chosen] = True
        infos: Infos = {}
        for name, values in self._values().items():
            values[~has] = 0
            infos[name], infos[f"_{name}"] = values, has.copy()
        return infos

    def _finals(self, ended: Index) -> Infos:
        """Return last observations and `info` of episodes that have just ended, as Gymnasium has them."""
        observations, values = self._observations(), self._values()
        infos: Infos = {}
        for one in ended:
            final = {name: row[one] if row.ndim > 1 else row[one].item() for name, row in values.items()}
            entry = {"final_obs": observations[one], "final_info": final}
            infos = self._add_info(infos, entry, int(one))
        return infos


class ReachTogether(TogetherEnv):
    """Copies of a `reach.ReachEnv`."""

    def __init__(self, one: ReachEnv, num_envs: int, *rest: Any) -> None:
        """Make copies of `one`; arguments as of `TogetherEnv`."""
        super().__init__(one, num_envs, *rest)
        clearance = TARGET_CLEARANCE * one.length_m

        def draw(robots: Robots, chosen: Index, rngs: Sequence[np.random.Generator]) -> list[Array]:
            found = random_targets(self.plant, robots, chosen, rngs, clearance)
            return [item.tip_m for item in found]

        self._reach = one
        self._held = np.zeros(num_envs, dtype=int)
        self._supply: Supply[Array] = Supply(self.plant, num_envs, rest[1], draw)

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads and free the renderer."""
        self._supply.close()
        super().close_extras()

    def _goals(self, chosen: Index, options: Mapping[str, Any]) -> list[Array]:
        given = self._reach.target_of(options)
        if given is not None:
            return [given] * len(chosen)
        for one in chosen:
            self._generator(int(one))
        return self._supply.take(chosen, self._rngs)

    def _set(self, chosen: Index, goals: list[Array]) -> None:
        self._target[chosen], self._held[chosen] = goals, 0

    def _judge(self, stepped: Index) -> tuple[Array, np.ndarray]:
        distance, lost = self._distance_m[stepped], self._diverged[stepped]
        speed = np.linalg.norm(self._now.velocity[stepped], axis=1)
        there = arrived(distance, speed, self.one.tolerance_m) & ~lost
        self._held[stepped] = np.where(there, self._held[stepped] + 1, 0)
        rewards = np.where(lost, DIVERGED_REWARD, -distance / self.one.length_m)
        return rewards, self._success()[stepped] | lost

    def _goal(self) -> Mapping[str, Array]:
        return {"target": self._target / self.one.length_m}

    def _more_parts(self) -> Mapping[str, Array]:
        return {"held": self._held[:, np.newaxis] / self._reach.hold_steps}

    def _success(self) -> np.ndarray:
        return self._held >= self._reach.hold_steps

    def _told(self) -> Mapping[str, np.ndarray]:
        return {"is_success": self._success()}


class TrackTogether(TogetherEnv):
    """Copies of a `track.TrackEnv`."""

    def __init__(self, one: TrackEnv, num_envs: int, *rest: Any) -> None:
        """Make copies of `one`; arguments as of `TogetherEnv`."""
        super().__init__(one, num_envs, *rest)
        self._track = one
        clearance = TARGET_CLEARANCE * one.length_m

        def draw(robots: Robots, chosen: Index, rngs: Sequence[np.random.Generator]) -> list[Path]:
            return random_paths(self.plant, robots, chosen, rngs, clearance, EPISODE_STEPS, CONTROL_STEP_S)

        self._supply: Supply[Path] = Supply(self.plant, num_envs, rest[1], draw)
        self._way, self._looking = np.zeros((2, num_envs, EPISODE_STEPS + 1, 3))
        self._steps = np.zeros(num_envs, dtype=int)
        self._squares = np.zeros((num_envs, 2))

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads and free the renderer."""
        self._supply.close()
        super().close_extras()

    def _goals(self, chosen: Index, options: Mapping[str, Any]) -> list[Path]:
        for one in chosen:
            self._generator(int(one))
        return self._supply.take(chosen, self._rngs)

    def _set(self, chosen: Index, goals: list[Path]) -> None:
        self._steps[chosen], self._squares[chosen] = 0, 0.0
        self._way[chosen] = [goal.tip_m for goal in goals]
        self._looking[chosen] = [goal.direction for goal in goals]
        self._target[chosen] = self._way[chosen, 0]

    def _judge(self, stepped: Index) -> tuple[Array, np.ndarray]:
        self._steps[stepped] = np.minimum(self._steps[stepped] + 1, EPISODE_STEPS)
        self._target[stepped] = self._way[stepped, self._steps[stepped]]
        distance, angle = self._distance_m[stepped], self._angle_rad()[stepped]
        lost = self._diverged[stepped]
        self._squares[stepped[~lost]] += np.square(np.stack([distance, angle], axis=1)[~lost])
        rewards = np.where(lost, DIVERGED_REWARD, -cost_of(distance, angle, self.one.length_m))
        return rewards, lost

    def _over(self) -> np.ndarray:
        return (self._steps == EPISODE_STEPS) & ~self._diverged

    def _more_parts(self) -> Mapping[str, Array]:
        left = 1.0 - self._steps[:, np.newaxis] / EPISODE_STEPS
        return {"time_left": left} if self._track.time_left else {}

    def _angle_rad(self) -> Array:
        return angle_between(self._now.direction, self._looking[self._all, self._steps])

    def _goal(self) -> Mapping[str, Array]:
        following = self._way[self._all, np.minimum(self._steps + 1, EPISODE_STEPS)]
        return {
            "target": self._target / self.one.length_m,
            "target_direction": self._looking[self._all, self._steps],
            "target_velocity": (following - self._target) / (CONTROL_STEP_S * self.one.length_m),
        }

    def _told(self) -> Mapping[str, np.ndarray]:
        distance, angle = np.sqrt(self._squares / np.maximum(self._steps, 1)[:, np.newaxis]).T
        ended = (self._steps == EPISODE_STEPS) & ~self._diverged
        return {
            "angle_rad": self._angle_rad(),
            "rms_distance_m": distance.copy(),
            "rms_angle_rad": angle.copy(),
            "is_success": followed(distance, angle, self.one.tolerance_m) & ended,
        }
