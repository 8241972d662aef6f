"""Vector environments as Stable-Baselines3 wants them (the optional extra `train`)."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

from catheter_sim.errors import InputError, shown


def as_stable_baselines(
    observation: np.ndarray,
    reward: np.ndarray,
    terminated: np.ndarray,
    truncated: np.ndarray,
    info: dict[str, Any],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
    """Return what a step with "SameStep" autoreset gave in the form of a `VecEnv`'s step.

    Episodes that ended have the final `info` of the episode, the last observation as
    `terminal_observation`, and whether it was cut short only as `TimeLimit.truncated`; the others' are empty.
    """
    ended = terminated | truncated
    infos: list[dict[str, Any]] = [{} for _ in ended]
    for one in np.flatnonzero(ended):
        infos[one] = _own(info["final_info"], int(one))
        infos[one]["terminal_observation"] = info["final_obs"][one]
        infos[one]["TimeLimit.truncated"] = bool(truncated[one] and not terminated[one])
    return observation, reward.astype(np.float32), ended, infos


def _own(infos: dict[str, Any], one: int) -> dict[str, Any]:
    """Return one environment's part of what Gymnasium gathers of many: arrays by name, masks as `_<name>`."""
    own: dict[str, Any] = {}
    for name, values in infos.items():
        has = infos.get(f"_{name}")
        if name.startswith("_") or (has is not None and not has[one]):
            continue
        own[name] = _own(values, one) if isinstance(values, dict) else values[one]
    return own


def vec_env(env: VectorEnv[Any, Any, Any]) -> Any:
    """Return `env` as a `stable_baselines3.common.vec_env.VecEnv`.

    It draws where `env` was made with `render_mode="rgb_array"`. Attributes and methods are those of the
    single environments, some of them by `indices`. Copies that are stepped together have fewer, and only all
    at once: see `TogetherEnv.call`.

    Args:
        env: with `autoreset_mode="SameStep"`.

    Raises:
        InputError: it starts again in another way, or Stable-Baselines3 is not installed.
    """
    if env.metadata.get("autoreset_mode") is not AutoresetMode.SAME_STEP:
        raise InputError("Stable-Baselines3 needs environments with autoreset_mode='SameStep'")
    try:
        from stable_baselines3.common.vec_env import VecEnv
    except ImportError as error:
        raise InputError("Stable-Baselines3 is needed: pip install stable-baselines3") from error

    many: Any = env

    class Adapted(VecEnv):  # type: ignore[misc, valid-type]
        """See `vec_env`."""

        def __init__(self) -> None:
            super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
            self.metadata = dict(env.metadata)

        def reset(self) -> np.ndarray:
            observation, info = env.reset(seed=self._seeds if self._seeds[0] is not None else None)
            self.reset_infos = [_own(info, one) for one in range(self.num_envs)]
            self._reset_seeds()
            return np.asarray(observation)

        def step_async(self, actions: np.ndarray) -> None:
            self._actions = actions

        def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
            return as_stable_baselines(*env.step(self._actions))

        def close(self) -> None:
            env.close()

        def get_images(self) -> list[Any]:
            return list(env.render() or ())

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            every = many.get_attr(attr_name)
            return [every[one] for one in self._get_indices(indices)]

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            if indices is None:
                many.set_attr(attr_name, [value] * self.num_envs)
                return
            for single in self._singles(indices):
                single.set_wrapper_attr(attr_name, value)

        def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
            if indices is None:
                return list(many.call(method_name, *args, **kwargs))
            return [one.get_wrapper_attr(method_name)(*args, **kwargs) for one in self._singles(indices)]

        def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
            return [False for _ in self._get_indices(indices)]

        def _singles(self, indices: Any) -> list[Any]:
            if not hasattr(many, "envs"):
                raise InputError(f"indices = {shown(indices)}: choices: None, for all environments at once")
            return [many.envs[one] for one in self._get_indices(indices)]

    return Adapted()
