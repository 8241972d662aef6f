"""Trains PPO of Stable-Baselines3 to bring the neuroendoscope's tip to its targets.

    pip install -e '.[train]'
    python scripts/train_reach.py --minutes 20 -o results/reach

Writes into the folder given by -o, which is made: curve.csv and curve.png (success over time, the share among
the episodes that ended since the line before; actions are still drawn at random around the policy's), the
policy policy.zip with its normalisation normalisation.pkl, and at the end, on the standard output, the share
of --episodes new episodes in which the policy's mean actions succeed.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import gymnasium
import matplotlib

import catheter_sim  # noqa: F401 - registers the environments
from catheter_sim.cli.arguments import whole_number
from catheter_sim.envs.stable_baselines import vec_env
from catheter_sim.errors import InputError, unknown
from catheter_sim.tables import replaced_when_whole

PREFIX, SUFFIX = "catheter_sim/", "-v0"
COLUMNS = ("seconds", "steps", "episodes", "success", "mean_reward")
# Few, short rollouts of many environments, and an outlook of some 20 steps: what an action does to the
# distance shows within a few of them.
PPO_ARGUMENTS: dict[str, Any] = {
    "n_steps": 32,
    "batch_size": 512,
    "n_epochs": 8,
    "learning_rate": 1e-3,
    "gamma": 0.95,
    "gae_lambda": 0.9,
    "clip_range": 0.2,
    "target_kl": 0.03,
    "policy_kwargs": {"net_arch": [64, 64], "log_std_init": -0.7},
}
EVALUATION_SEED = 1_000_000


def main() -> int:
    """Train, and write what is left of it; return the exit status."""
    known = [
        name[len(PREFIX) : -len(SUFFIX)]
        for name in gymnasium.registry
        if name.startswith(PREFIX) and name.endswith(SUFFIX)
    ]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--environment", default="NeuroendoscopeReach", help=f"of {', '.join(known)}")
    parser.add_argument("--minutes", type=float, default=20.0, help="of the clock; default 20")
    parser.add_argument("--num-envs", type=whole_number(1, 100_000), default=64, help="default 64")
    parser.add_argument("--threads", type=whole_number(1, 256), default=2, help="default 2")
    parser.add_argument("--episodes", type=whole_number(1, 10_000), default=100, help="default 100")
    parser.add_argument("--seed", type=whole_number(0, 2**31 - 1), default=0, help="default 0")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write into")
    options = parser.parse_args()
    try:
        if options.environment not in known:
            raise unknown("environment", options.environment, known, "--environment")
        if not 0.0 < options.minutes < 1e5:
            raise InputError(f"--minutes {options.minutes:g}: must be above zero")
        folder = Path(options.output)
        folder.mkdir(parents=True, exist_ok=True)
        print(trained(options, folder))
    except InputError as error:
        print(f"train_reach: error: {error}", file=sys.stderr)
        return 2
    return 0


def environments(options: argparse.Namespace, count: int) -> Any:
    """Return so many environments in the form of Stable-Baselines3."""
    env = gymnasium.make_vec(
        f"{PREFIX}{options.environment}{SUFFIX}",
        count,
        "vector_entry_point",
        threads=options.threads,
        autoreset_mode="SameStep",
    )
    return vec_env(env)


def trained(options: argparse.Namespace, folder: Path) -> str:
    """Train for the given time, write curve and policy; return a line on the policy."""
    envs = environments(options, options.num_envs)
    import torch  # at hand where `environments` succeeds
    from stable_baselines3 import PPO
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

    torch.set_num_threads(options.threads)
    normalised = VecNormalize(VecMonitor(envs), norm_obs=True, norm_reward=True, gamma=PPO_ARGUMENTS["gamma"])
    rows: list[tuple[float, ...]] = []
    begun = time.perf_counter()

    class Curve(BaseCallback):  # type: ignore[misc]
        """Notes what episodes came to, after every rollout, and ends the training in time."""

        def _on_training_start(self) -> None:
            self._ended: list[dict[str, Any]] = []

        def _on_step(self) -> bool:
            self._ended += [info for info in self.locals["infos"] if "episode" in info]
            return time.perf_counter() - begun < 60.0 * options.minutes

        def _on_rollout_end(self) -> None:
            ended, count = self._ended, len(self._ended)
            if count < 50:  # too few to say a share
                return
            success = sum(bool(info["is_success"]) for info in ended) / count
            reward = sum(float(info["episode"]["r"]) for info in ended) / count
            rows.append((time.perf_counter() - begun, self.num_timesteps, count, success, reward))
            self._ended = []

    model = PPO("MlpPolicy", normalised, seed=options.seed, device="cpu", **PPO_ARGUMENTS)
    model.learn(10**9, callback=Curve())
    seconds, steps = time.perf_counter() - begun, model.num_timesteps
    model.save(folder / "policy.zip")
    normalised.save(str(folder / "normalisation.pkl"))
    envs.close()
    with replaced_when_whole(folder / "curve.csv") as file:
        lines = [",".join(f"{value:.6g}" for value in row) for row in rows]
        file.write("\n".join([",".join(COLUMNS), *lines]) + "\n")
    draw(rows, folder / "curve.png")
    normalised.training = False
    share = succeeding(options, model, normalised)
    return (
        f"{options.environment}: {steps} steps in {seconds:.0f} s; success in {share * 100:.0f} % of "
        f"{options.episodes} new episodes"
    )


def succeeding(options: argparse.Namespace, model: Any, normalised: Any) -> float:
    """Return the share of new episodes in which the policy's mean actions succeed."""
    count = min(options.num_envs, options.episodes)
    envs = environments(options, count)
    envs.seed(EVALUATION_SEED)
    observation, successes, ended = envs.reset(), 0, 0
    left = [options.episodes // count + (one < options.episodes % count) for one in range(count)]
    while ended < options.episodes:
        action, _ = model.predict(normalised.normalize_obs(observation), deterministic=True)
        observation, _, dones, infos = envs.step(action)
        for one in dones.nonzero()[0]:
            if left[one] > 0:  # of every environment its first ones, so that short episodes count no more
                left[one] -= 1
                ended += 1
                successes += bool(infos[one]["is_success"])
    envs.close()
    return successes / options.episodes


def draw(rows: list[tuple[float, ...]], path: Path) -> None:
    """Draw success over time, and over steps."""
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.5), sharey=True, layout="constrained")
    for axis, column, scale, label in zip(
        axes, (0, 1), (1.0 / 60.0, 1e-3), ("time [min]", "steps [thousands]"), strict=True
    ):
        axis.plot([row[column] * scale for row in rows], [100.0 * row[3] for row in rows])
        axis.set(xlabel=label, ylim=(0, 100))
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("episodes with success [%]")
    figure.savefig(path, dpi=150)
    plt.close(figure)


if __name__ == "__main__":
    sys.exit(main())
