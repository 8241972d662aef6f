"""Environments of any kind behind Gymnasium's `VectorEnv`, one after another on a pool of threads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from operator import methodcaller
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from catheter_sim.envs.arguments import (
    checked_actions,
    checked_mask,
    checked_options,
    checked_seeds,
    require_running,
)
from catheter_sim.errors import InputError


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


def _made(make: Callable[[], gymnasium.Env[Any, Any]]) -> _Ahead:
    return _Ahead(make())


class OneByOneEnv(SyncVectorEnv[Any, Any]):
    """`SyncVectorEnv`, but that environments move at once where they leave Python's lock to each other."""

    def __init__(
        self,
        env_fns: Iterable[Callable[[], gymnasium.Env[Any, Any]]],
        threads: int,
        autoreset_mode: AutoresetMode,
    ) -> None:
        """Make the environments."""
        super().__init__([partial(_made, make) for make in env_fns], autoreset_mode=autoreset_mode)
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
