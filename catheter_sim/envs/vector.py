"""Many copies of an environment at once: the entry points of `gymnasium.make_vec`.

Robots are stepped together by `mujoco.batch`, one batch and one part of the robots for each thread
(`simulation.copies` says why, `fleet` does it). `scripts/benchmark_vector.py` measures what that gives, as
ratios against a loop over one environment in the same run.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.wrappers import TimeLimit

from catheter_sim.envs.arguments import argument_names, checked_choice, checked_whole, refuse_unknown
from catheter_sim.envs.clinical.deliver import DeliverEnv
from catheter_sim.envs.clinical.insert import InsertEnv
from catheter_sim.envs.clinical.tumour import TumourEnv
from catheter_sim.envs.reach import ReachEnv
from catheter_sim.envs.robots import together
from catheter_sim.envs.tip import TipEnv
from catheter_sim.envs.track import TrackEnv
from catheter_sim.envs.vector_threads import OneByOneEnv
from catheter_sim.envs.vector_together import ReachTogether, TogetherEnv, TrackTogether

_OF_MANY = ("num_envs", "max_episode_steps", "threads", "autoreset_mode")  # arguments of their own


def reach(num_envs: int = 1, **arguments: Any) -> VectorEnv[Any, Any, Any]:
    """Return many `ReachEnv`; see `vector_env`."""
    return vector_env(ReachEnv, ReachTogether, num_envs, **arguments)


def track(num_envs: int = 1, **arguments: Any) -> VectorEnv[Any, Any, Any]:
    """Return many `TrackEnv`; see `vector_env`."""
    return vector_env(TrackEnv, TrackTogether, num_envs, **arguments)


def tumour(num_envs: int = 1, **arguments: Any) -> VectorEnv[Any, Any, Any]:
    """Return many `TumourEnv`; see `vector_env`."""
    return vector_env(TumourEnv, None, num_envs, **arguments)


def insert(num_envs: int = 1, **arguments: Any) -> VectorEnv[Any, Any, Any]:
    """Return many `InsertEnv`; see `vector_env`."""
    return vector_env(InsertEnv, None, num_envs, **arguments)


def deliver(num_envs: int = 1, **arguments: Any) -> VectorEnv[Any, Any, Any]:
    """Return many `DeliverEnv`; see `vector_env`."""
    return vector_env(DeliverEnv, None, num_envs, **arguments)


def vector_env(
    task: type[TipEnv],
    many: Callable[..., TogetherEnv] | None,
    num_envs: int,
    /,
    max_episode_steps: int | None = None,
    threads: int | None = None,
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    **arguments: Any,
) -> VectorEnv[Any, Any, Any]:
    """Return many environments of one task behind Gymnasium's `VectorEnv`.

    Observations, rewards, ends and `info` are those of single environments with the same seeds (seed
    i is the first one's plus i, or a list holds each) under `TimeLimit`, and of Gymnasium's `SyncVectorEnv`
    of these, but for rounding, which friction amplifies: to 1e-9 m in the first steps, to some 0.01 mm
    after a hundred. The same seed and number of copies give the same bits.
    `reset(options={"reset_mask": ...})` resets some of them; the other options of the task's reset are for
    all. An environment whose simulation diverges terminates; the others go on.

    Where `simulation.copies` knows all that the robot does, robots are stepped together: the six published
    robots by their own settings, and with other numbers in these. Otherwise (links that give way, tubes
    that bend, stretch and resistance of Nayar 2023, friction of a catheter's pairs, effects on the inputs,
    robots that are `randomised`) whole environments are stepped one by one on the threads, where Python's
    lock leaves little to gain.

    So are the clinical tasks, whose numbers are then those of single environments to the bit. A batch could
    hold a model for each copy's anatomy, but the springs of tissue are written into the rows of a step's
    contacts (`simulation.tissue`) after MuJoCo has made them and before it solves them, where a batch lets
    nobody in; as applied forces they would not be stable. Contacts and their solution run without Python's
    lock, so that threads gain more the more contacts there are. Each reset builds a new anatomy under the
    lock.

    Targets and ways are simulated too. They are drawn for all environments that have none in stock as soon
    as one needs one, on other copies of the robots, so that an episode that ends alone leaves no thread idle.

    Pictures (`observation="pixels"`, `render_mode="rgb_array"`) are drawn one after another by one renderer;
    one by one each environment has its own, and one thread is used.

    Args:
        task: the environment.
        many: its copies where they are stepped together; None: never.
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
    threads = min(_processors() if threads is None else checked_whole("threads", threads), count)
    if max_episode_steps is not None:
        max_episode_steps = checked_whole("max_episode_steps", max_episode_steps)
    if not isinstance(autoreset_mode, AutoresetMode):
        modes = [item.value for item in AutoresetMode]
        autoreset_mode = AutoresetMode(checked_choice("autoreset_mode", autoreset_mode, modes))
    one = task(**arguments)
    if many is not None and not one.randomised and together(one.plant):
        return many(one, count, max_episode_steps, threads, autoreset_mode)

    def make(first: list[TipEnv] = [one]) -> Any:  # noqa: B006 - the one that was made is used
        env = first.pop() if first else task(**arguments)
        return env if max_episode_steps is None else TimeLimit(env, max_episode_steps)

    return OneByOneEnv([make] * count, 1 if one.pixels or one.render_mode else threads, autoreset_mode)


def _processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
