"""Random steps in all environments: is anything not finite, does the engine or Python warn?

    python scripts/random_steps.py --steps 100000 --jobs 2

The steps are spread evenly over the environments, in turns of each; in every second turn the robot is drawn
anew at every reset (`randomised_settings`). Actions are uniform, each kept for a random number of steps, so
that drives come to the ends of their ranges too. A fault is a warning of the engine or of Python, at resets
too; an observation outside its space; a reward or a number of `info` that is not finite; a simulation that
diverges. Faults are printed, at the end the steps and episodes of each environment. Exit status 1 where
there was a fault.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import joblib
import mujoco
import numpy as np

import catheter_sim  # noqa: F401 - registers the environments
from catheter_sim.catalogue import load_robot
from catheter_sim.cli.arguments import whole_number
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.catheter.spec import CatheterRobot

PREFIX, SUFFIX = "catheter_sim/", "-v0"
LONGEST_KEPT = 20  # steps: as many as take a drive through its range
_TURN_STEPS = 250  # about, of one environment at a time


@dataclass(frozen=True)
class Walk:
    """What happened in random steps.

    Attributes:
        steps: that were taken.
        episodes: that were begun.
        faults: a line for each.
    """

    steps: int
    episodes: int
    faults: tuple[str, ...]


def main() -> int:
    """Take the steps and print what happened; return the exit status."""
    known = [
        name[len(PREFIX) : -len(SUFFIX)]
        for name in gymnasium.registry
        if name.startswith(PREFIX) and name.endswith(SUFFIX)
    ]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--steps", type=whole_number(1, 10**9), default=100_000, help="default 100000")
    parser.add_argument("--jobs", type=whole_number(1, 256), default=1, help="processes; default 1")
    parser.add_argument("--seed", type=whole_number(0, 2**31 - 1), default=0, help="default 0")
    parser.add_argument("--environments", help=f"comma-separated, of {', '.join(known)}; default all")
    options = parser.parse_args()
    names = options.environments.split(",") if options.environments else known
    try:
        for name in names:
            if name not in known:
                raise unknown("environment", name, known, "--environments")
    except InputError as error:
        print(f"random_steps: error: {error}", file=sys.stderr)
        return 2
    turns = max(2, 2 * round(options.steps / (2 * _TURN_STEPS * len(names))))
    shares = [len(part) for part in np.array_split(np.arange(options.steps), turns * len(names))]
    tasks = [
        joblib.delayed(turn)(
            names[number % len(names)], share, options.seed + number, number // len(names) % 2 == 1
        )
        for number, share in enumerate(shares)
    ]
    done: dict[str, list[Walk]] = {name: [] for name in names}
    taken = faulty = 0
    for number, walk in enumerate(joblib.Parallel(options.jobs, return_as="generator")(tasks)):
        name = names[number % len(names)]
        done[name].append(walk)
        taken, faulty = taken + walk.steps, faulty + len(walk.faults)
        for fault in walk.faults:
            print(f"{name}: {fault}", flush=True)
        if number % len(names) == len(names) - 1:
            print(f"{taken} of {options.steps} steps, {faulty} faults", flush=True)
    print("environment,steps,episodes,faults")
    for name, walks in done.items():
        counts = (sum(walk.steps for walk in walks), sum(walk.episodes for walk in walks))
        print(f"{name},{counts[0]},{counts[1]},{sum(len(walk.faults) for walk in walks)}")
    return 1 if faulty else 0


def turn(name: str, steps: int, seed: int, randomised: bool) -> Walk:
    """Return what happens in random steps of an environment, made anew."""
    full = f"{PREFIX}{name}{SUFFIX}"
    robot = gymnasium.spec(full).kwargs["robot"]
    arguments = {"randomised": randomised_settings(robot)} if randomised else {}
    env = gymnasium.make(full, **arguments)
    try:
        return walk(env, steps, seed)
    finally:
        env.close()


def randomised_settings(robot: str) -> dict[str, tuple[float, float]]:
    """Return what is drawn of a robot, and its bounds: friction, stiffness, and the scale of its inputs.

    Catheters of straight paths have less friction (both ranges are assumed).
    """
    friction = (0.01, 0.1) if isinstance(load_robot(robot), CatheterRobot) else (0.05, 0.5)
    return {
        "friction.mu": friction,
        "effects.stiffness.scale": (0.8, 1.25),
        "effects.actuation_gain.scale": (0.9, 1.1),
    }


def walk(env: gymnasium.Env[Any, Any], steps: int, seed: int) -> Walk:
    """Take random steps. A fault ends an episode; where a reset fails there are no more steps.

    Args:
        env: the environment.
        steps: how many.
        seed: of the first reset and of the actions.
    """
    rng = np.random.default_rng(seed)
    faults: list[str] = []
    said: list[str] = []
    mujoco.set_mju_user_warning(said.append)
    done = episodes = kept = 0
    ended = True
    action = np.zeros(env.action_space.shape or (), np.float32)
    try:
        while done < steps:
            with warnings.catch_warnings(record=True) as warned:
                warnings.simplefilter("always")
                begins = ended
                if begins:
                    observation, info = env.reset(seed=seed if episodes == 0 else None)
                    reward, ended, episodes = 0.0, False, episodes + 1
                else:
                    if kept == 0:
                        action = rng.uniform(-1.0, 1.0, action.shape).astype(np.float32)
                        kept = int(rng.integers(1, LONGEST_KEPT + 1))
                    observation, reward, terminated, truncated, info = env.step(action)
                    ended, kept, done = terminated or truncated, kept - 1, done + 1
            where = f"episode {episodes}, seed {seed}, after step {done}: "
            found = [f"Python warns: {item.message}" for item in warned] + [
                f"MuJoCo: {text}" for text in said
            ]
            found += wrong(env, observation, reward, info)
            faults += [where + text for text in found]
            ended = ended or (bool(found) and not begins)
            said.clear()
    except InputError as error:
        faults.append(f"episode {episodes + 1}, seed {seed}, after step {done}: {error}")
    finally:
        mujoco.set_mju_user_warning(None)
    return Walk(done, episodes, tuple(faults))


def wrong(env: gymnasium.Env[Any, Any], observation: Any, reward: Any, info: Mapping[str, Any]) -> list[str]:
    """Return what is wrong after a step or a reset."""
    found = []
    if observation not in env.observation_space:
        found.append("the observation lies outside its space")
    if not np.isfinite(reward):
        found.append(f"reward {reward}")
    found += [f"info {name} is not finite" for name in _unbounded(info)]
    if info["diverged"]:
        found.append("the simulation diverged")
    # said once only by MuJoCo, counted each time
    counts = [int(item.number) for item in env.unwrapped.plant.simulator.data.warning]  # type: ignore[attr-defined]
    found += [f"engine's counters of warnings: {counts}"] if any(counts) else []
    return found


def _unbounded(info: Mapping[str, Any]) -> Sequence[str]:
    names: list[str] = []
    for name, value in info.items():
        if isinstance(value, Mapping):
            names += [f"{name}.{part}" for part in _unbounded(value)]
        elif not np.isfinite(value).all():
            names.append(name)
    return names


if __name__ == "__main__":
    sys.exit(main())
