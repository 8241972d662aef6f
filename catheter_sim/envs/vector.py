"""Many copies of an environment at once, for Gymnasium's `make_vec`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from operator import methodcaller
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import batch_space
from gymnasium.wrappers import TimeLimit

from catheter_sim.arrays import Array, Index
from catheter_sim.envs.clinical.deliver import DeliverEnv
from catheter_sim.envs.clinical.insert_and_tumour import InsertEnv, TumourEnv
from catheter_sim.envs.reach_and_track import ReachEnv, TrackEnv
from catheter_sim.envs.robots import Fleet, RobotGroup, Supply, require_standing, together
from catheter_sim.envs.tip import (
    CONTROL_STEP_S,
    TipEnv,
    argument_names,
    checked_above_zero,
    checked_actions,
    checked_choice,
    checked_mask,
    checked_options,
    checked_seeds,
    checked_whole,
    level_after,
    one_of,
    refuse_unknown,
    require_running,
)
from catheter_sim.errors import InputError, shown
from catheter_sim.pictures.images import Picture
from catheter_sim.platforms import processors

# ----------------------------------------------------------------------------------------------------
# Environments of any kind behind Gymnasium's `VectorEnv`, one after another on a pool of threads.


class _Ahead(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Does what is asked for next ahead, on another thread."""

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        self.done: list[Any] = []

    def ahead(self, act: Callable[[gymnasium.Env[Any, Any]], Any]) -> None:
        """Keep what `act` returns for the next `step` or `reset`."""
        self.done = [act(self.env)]

    def step(self, action: Any) -> Any:
        return self.done.pop() if self.done else self.env.step(action)

    def reset(self, **arguments: Any) -> Any:
        return self.done.pop() if self.done else self.env.reset(**arguments)


class OneByOneEnv(SyncVectorEnv[Any, Any]):
    """`SyncVectorEnv`, but that environments move at once where they leave Python's lock to each other."""

    def __init__(
        self,
        env_fns: Iterable[Callable[[], gymnasium.Env[Any, Any]]],
        threads: int,
        autoreset_mode: AutoresetMode,
    ) -> None:
        """Make the environments."""
        makers = [lambda make=make: _Ahead(make()) for make in env_fns]  # type: ignore[misc]
        super().__init__(makers, autoreset_mode=autoreset_mode)
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None
        self._begun = np.zeros(self.num_envs, dtype=bool)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start episodes; see `SyncVectorEnv.reset`.

        Raises:
            InputError: a bad mask or option, wrong number of seeds, or what the task's reset raises.
        """
        own = checked_options(options, (*self.envs[0].unwrapped.reset_options, "reset_mask"))  # type: ignore[attr-defined]
        seeds = checked_seeds(seed, self.num_envs)
        given = own.pop("reset_mask", None)
        mask = checked_mask(given, self.num_envs)
        if not (self._begun | mask).all():
            raise InputError("reset_mask: the first reset is one of all environments")
        self._begun |= mask
        self._all_at_once(
            [one for one in range(self.num_envs) if mask[one]],
            [methodcaller("reset", seed=own_seed, options=own) for own_seed in seeds],
        )
        own = own if given is None else {**own, "reset_mask": mask}
        return super().reset(seed=seeds, options=own or None)

    def step(self, actions: Any) -> Any:
        """Move all environments for one control step.

        Raises:
            InputError: the actions have another shape, or are no numbers; without autoreset, an episode
                has ended.
            ResetNeeded: no episode has begun.
        """
        starts = self._autoreset_envs if self.autoreset_mode is AutoresetMode.NEXT_STEP else None
        if self.autoreset_mode is AutoresetMode.DISABLED:
            require_running(self._autoreset_envs)
        stepping = np.ones(self.num_envs, dtype=bool) if starts is None else ~starts
        actions = checked_actions(actions, self.action_space.shape, stepping)  # type: ignore[arg-type]
        self._all_at_once(
            range(self.num_envs),
            [
                methodcaller("reset") if starts is not None and starts[one] else methodcaller("step", action)
                for one, action in enumerate(actions)
            ],
        )
        return super().step(actions)

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads and close the environments."""
        if self._pool is not None:
            self._pool.shutdown()
        super().close_extras(**kwargs)

    def _all_at_once(self, chosen: Iterable[int], acts: Sequence[Callable[[Any], Any]]) -> None:
        """Let each chosen environment do its act ahead; where one fails, all are forgotten."""
        if self._pool is None:
            return
        tasks = [self._pool.submit(self.envs[one].ahead, acts[one]) for one in chosen]  # type: ignore[attr-defined]
        try:
            for task in tasks:
                task.result()
        except BaseException:
            for task in tasks:
                task.cancel() or task.exception()
            for env in self.envs:
                env.done.clear()  # type: ignore[attr-defined]
            raise


# ----------------------------------------------------------------------------------------------------
# Environments whose robots are stepped together: Reach and Track behind Gymnasium's `VectorEnv`.

Infos = dict[str, Any]
_SEEN = "action_space", "observation_space", "state_space", "layout", "metadata", "render_mode", "pixels"
_TASK = "drives", "dynamics", "hold_steps", "length_m", "randomised", "time_left", "tolerance_m"
SHARED = (*_SEEN, *_TASK)  # attributes of one environment that copies have in common


class TogetherEnv(VectorEnv[Any, Any, Any]):
    """Many copies of one `TipEnv`, rows of its arrays; see `vector_env`."""

    metadata: dict[str, Any] = dict(TipEnv.metadata)  # noqa: RUF012 - Gymnasium's way

    def __init__(
        self,
        one: TipEnv,
        num_envs: int,
        max_episode_steps: int | None,
        threads: int,
        autoreset_mode: AutoresetMode,
    ) -> None:
        """Make copies of `one`, whose rows they take."""
        self.one, self.num_envs = one, num_envs
        one.make_rows(num_envs)
        self.metadata = {**one.metadata, "autoreset_mode": autoreset_mode}
        self.render_mode = one.render_mode
        self.layout, self.drives = one.layout, one.drives
        self.single_observation_space, self.single_action_space = one.observation_space, one.action_space
        self.observation_space = batch_space(one.observation_space, num_envs)
        self.action_space = batch_space(one.action_space, num_envs)
        self._mode, self._limit = autoreset_mode, max_episode_steps
        self._fleet = Fleet(one.plant, num_envs, threads)
        self._supply = Supply(one.plant, num_envs, threads, one.draw_goals)
        self._all = np.arange(num_envs)
        self._rngs: list[np.random.Generator | None] = [None] * num_envs
        self._seeds = [-1] * num_envs
        self._elapsed = np.zeros(num_envs, dtype=int)
        self._ended, self._begun = np.zeros((2, num_envs), dtype=bool)

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
        """Start episodes; see `vector_env`.

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
        given = self.one.given_goal(options)
        self._begin(chosen, self._drawn(chosen) if given is None else [given] * len(chosen))
        return self.one.observations(), self._infos(chosen)

    def step(self, actions: Any) -> tuple[Any, Array, np.ndarray, np.ndarray, Infos]:
        """Move all copies for one control step; those whose episode ended start again, by the mode.

        Raises:
            InputError: the actions have another shape, or are no numbers; without autoreset, an episode
                has ended.
            ResetNeeded: an environment was never reset.
        """
        if not self._begun.all():
            raise gymnasium.error.ResetNeeded("step() needs a reset of every environment before it")
        resetting = self._ended if self._mode is AutoresetMode.NEXT_STEP else np.zeros_like(self._ended)
        if self._mode is AutoresetMode.DISABLED:
            require_running(self._ended)
        stepping, starting = np.flatnonzero(~resetting), np.flatnonzero(resetting)
        one, level = self.one, self.one.level
        wished = checked_actions(actions, level.shape, stepping)
        goals = self._drawn(starting)
        level[stepping] = level_after(level[stepping], wished[stepping], self.drives)
        self._fleet.each(stepping, lambda robots, own, places: self._move(robots, own, stepping[places]))
        rewards, terminations, truncations = np.zeros(self.num_envs), *np.zeros((2, self.num_envs), bool)
        if len(stepping):
            rewards[stepping], terminations[stepping] = one.judge_rows(stepping)
            self._elapsed[stepping] += 1
        over = one.over() if self._limit is None else one.over() | (self._elapsed >= self._limit)
        truncations[stepping] = over[stepping]
        self._begin(starting, goals)
        self._ended = terminations | truncations
        infos: Infos = {}
        if self._mode is AutoresetMode.SAME_STEP and self._ended.any():
            done = np.flatnonzero(self._ended)
            infos = self._finals(done)
            self._begin(done, self._drawn(done))
        infos |= self._infos(self._all)
        return one.observations(), rewards, terminations, truncations, infos

    def render(self) -> tuple[Picture | None, ...] | None:  # type: ignore[override]
        """Return a picture of each copy, as of the task's `render`, all by one renderer."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() draws only where render_mode='rgb_array' was given to make_vec()")
            return None
        return tuple(self.one.drawn(row) for row in range(self.num_envs))

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return what each copy has under `name`, as `SyncVectorEnv.call`.

        Copies are no environments. Each has `render`, `target_m`, `np_random` and `np_random_seed`; `SHARED`
        names what they have in common: their task's arguments, the spaces, the drives.

        Raises:
            AttributeError: they have nothing of this name.
        """
        each: dict[str, Any] = {
            "target_m": self.one.targets_m.copy(),
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
        self._supply.close()
        self.one.close()

    def _generator(self, one: int) -> np.random.Generator:
        rng = self._rngs[one]
        if rng is None:
            rng, self._seeds[one] = seeding.np_random(None)
            self._rngs[one] = rng
        return rng

    def _drawn(self, chosen: Index) -> list[Any]:
        """Return what each of the chosen copies is to do in the coming episode."""
        for one in chosen:
            self._generator(int(one))
        return self._supply.take(chosen, self._rngs)

    def _begin(self, chosen: Index, goals: list[Any]) -> None:
        """Bring copies to rest for new episodes."""
        if not len(chosen):
            return
        self.one.level[chosen] = 0.0
        self._elapsed[chosen] = 0
        self.one.diverged[chosen] = self._ended[chosen] = False

        def act(robots: RobotGroup, own: Index, places: Index) -> None:
            require_standing(self.one.plant, robots, own)
            self.one.see(robots, own, chosen[places], moved=False)

        self._fleet.each(chosen, act)
        self.one.set_goals(chosen, goals)
        self._begun[chosen] = True

    def _move(self, robots: RobotGroup, own: Index, rows: Index) -> None:
        """Move a thread's copies; those that diverge are seen as they were before."""
        robots.move(own, self.one.level[rows], CONTROL_STEP_S)
        finite = robots.finite(own)
        self.one.diverged[rows] = ~finite
        self.one.see(robots, own[finite], rows[finite], moved=True)

    def _infos(self, chosen: Index) -> Infos:
        """Return `info` of the chosen copies as Gymnasium has it: arrays, and who has such a value."""
        has = np.isin(self._all, chosen)
        infos: Infos = {}
        for name, values in self.one.infos().items():
            values[~has] = 0
            infos[name], infos[f"_{name}"] = values, has.copy()
        return infos

    def _finals(self, ended: Index) -> Infos:
        """Return last observations and `info` of episodes that have just ended, as Gymnasium has them."""
        observations, values = self.one.observations(), self.one.infos()
        infos: Infos = {}
        for row in ended:
            entry = {"final_obs": observations[row], "final_info": one_of(values, row)}
            infos = self._add_info(infos, entry, int(row))
        return infos


# ----------------------------------------------------------------------------------------------------
# Many copies of an environment at once: the entry points of `gymnasium.make_vec`.
#
# Robots are stepped together by `mujoco.batch`, one batch and one part of the robots for each thread
# (`simulation.copies` says why, `fleet` does it). `scripts/benchmark_vector.py` measures what that gives,
# as ratios against a loop over one environment in the same run.

_OF_MANY = ("num_envs", "max_episode_steps", "threads", "autoreset_mode")  # arguments of their own


def vector_env(
    task: type[TipEnv],
    /,
    num_envs: int = 1,
    max_episode_steps: int | None = None,
    threads: int | None = None,
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    **arguments: Any,
) -> VectorEnv[Any, Any, Any]:
    """Return many environments of one task behind Gymnasium's `VectorEnv`.

    Observations, rewards, ends and `info` are those of single environments with the same seeds under
    `TimeLimit`, and of Gymnasium's `SyncVectorEnv` of these, except for rounding. Friction amplifies it:
    to 1e-9 m in the first steps, to some 0.01 mm after a hundred. Seed i is the first one's plus i, or a
    list holds each. The same seed and number of copies give the same bits. `reset(options={"reset_mask":
    ...})` resets some of them; the other options of the task's reset are for all. An environment whose
    simulation diverges terminates; the others go on.

    Where `simulation.copies` knows all that the robot does, robots are stepped together: the six published
    robots by their own settings, and with other numbers in these. Otherwise whole environments are stepped
    one by one on the threads, where Python's lock leaves little to gain. (These are links that give way,
    tubes that bend, stretch and resistance of Nayar 2023, friction of a catheter's pairs, effects on the
    inputs, robots that are `randomised` .)

    So are the clinical tasks, whose numbers are then those of single environments to the bit. A batch could
    hold a model for each copy's anatomy. But the springs of tissue are written into the rows of a step's
    contacts (`simulation.tissue`) after MuJoCo has made them and before it solves them, where a batch lets
    nobody in. As applied forces they would not be stable. Contacts and their solution run without Python's
    lock, so that threads gain more the more contacts there are. Each reset builds a new anatomy under the
    lock.

    Targets and ways are simulated too. They are drawn for all environments that have none in stock as soon
    as one needs one, on other copies of the robots, so that an episode that ends alone leaves no thread idle.

    Pictures (`observation="pixels"`, `render_mode="rgb_array"`) are drawn one after another by one renderer;
    one by one each environment has its own, and one thread is used.

    Args:
        task: the environment.
        num_envs: how many.
        max_episode_steps: after which an episode is truncated; None: never.
        threads: how many; default: as many as the process may use processors.
        autoreset_mode: what happens where an episode ends, as in Gymnasium: "NextStep", "SameStep" or
            "Disabled".
        arguments: of the task.

    Raises:
        InputError: an argument is impossible.
    """
    refuse_unknown(arguments, [*_OF_MANY, *argument_names(task)], f"many {task.__name__}")
    count = checked_whole("num_envs", num_envs)
    threads = min(processors() if threads is None else checked_whole("threads", threads), count)
    if max_episode_steps is not None:
        max_episode_steps = checked_whole("max_episode_steps", max_episode_steps)
    if not isinstance(autoreset_mode, AutoresetMode):
        modes = [item.value for item in AutoresetMode]
        autoreset_mode = AutoresetMode(checked_choice("autoreset_mode", autoreset_mode, modes))
    one = task(**arguments)
    if one.stepped_together and not one.randomised and together(one.plant):
        return TogetherEnv(one, count, max_episode_steps, threads, autoreset_mode)

    def make(first: list[TipEnv] = [one]) -> Any:  # noqa: B006 - the one that was made is used
        env = first.pop() if first else task(**arguments)
        return env if max_episode_steps is None else TimeLimit(env, max_episode_steps)

    return OneByOneEnv([make] * count, 1 if one.pixels or one.render_mode else threads, autoreset_mode)


reach, track = partial(vector_env, ReachEnv), partial(vector_env, TrackEnv)
tumour, insert = partial(vector_env, TumourEnv), partial(vector_env, InsertEnv)
deliver = partial(vector_env, DeliverEnv)
