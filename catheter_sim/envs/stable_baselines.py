"""The vector environments as Stable-Baselines3 wants them (the optional extra `train`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

from catheter_sim.errors import InputError


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
        final = info["final_info"]
        infos[one] = {name: final[name][one] for name in final if not name.startswith("_")}
        infos[one]["terminal_observation"] = info["final_obs"][one]
        infos[one]["TimeLimit.truncated"] = bool(truncated[one] and not terminated[one])
    return observation, reward.astype(np.float32), ended, infos


def vec_env(env: VectorEnv[Any, Any, Any]) -> Any:
    """Return `env` as a `stable_baselines3.common.vec_env.VecEnv`.

    Args:
        env: with `autoreset_mode="SameStep"`.

    Raises:
        InputError: it starts anew in another way, or Stable-Baselines3 is not installed.
    """
    if env.metadata.get("autoreset_mode") is not AutoresetMode.SAME_STEP:
        raise InputError("Stable-Baselines3 needs environments with autoreset_mode='SameStep'")
    try:
        from stable_baselines3.common.vec_env import VecEnv
    except ImportError as error:
        raise InputError(
            "Stable-Baselines3 is not installed; choices: pip install 'catheter-sim[train]'"
        ) from error

    class Adapted(VecEnv):  # type: ignore[misc, valid-type]
        """See `vec_env`."""

        def __init__(self) -> None:
            super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

        def reset(self) -> np.ndarray:
            observation, _ = env.reset(seed=self._seeds if self._seeds[0] is not None else None)
            self._reset_seeds()
            return np.asarray(observation)

        def step_async(self, actions: np.ndarray) -> None:
            self._actions = actions

        def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
            return as_stable_baselines(*env.step(self._actions))

        def close(self) -> None:
            env.close()

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            return [getattr(env, attr_name)] * len(self._chosen(indices))

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            raise NotImplementedError("the environments have no attributes of their own")

        def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
            raise NotImplementedError("the environments have no methods of their own")

        def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
            return [False] * len(self._chosen(indices))

        def _chosen(self, indices: Any) -> Sequence[int]:
            return list(self._get_indices(indices))

    return Adapted()
