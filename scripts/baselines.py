"""How often the simple controllers, and chance, succeed in the environments.

    python scripts/baselines.py --episodes 100 --jobs 2 -o results/baselines.csv
    python scripts/baselines.py --environments NeuroendoscopeTrack,Mitral4dofTrack -o results/track.csv
    python scripts/baselines.py --show NeuroendoscopeTumour -o tumour.mp4 --width 480

Seeds are 0, 1, ...; of each episode the end counts. -o FILE gets one row for each environment: successes of
the controller (`CONTROLLERS`) and of uniformly random actions. With --show the controller's episode of
seed 0 is drawn instead: -o OUT.png gets its end or a step, OUT.mp4 all of it, twice as fast as it runs.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import joblib
import numpy as np
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the controllers lie

import catheter_sim  # noqa: F401 - registers the environments
from catheter_sim.cli.arguments import whole_number
from catheter_sim.envs.clinical.deliver import DeliverEnv
from catheter_sim.envs.clinical.insert_and_tumour import InsertEnv, TumourEnv
from catheter_sim.envs.reach_and_track import ReachEnv, TrackEnv
from catheter_sim.envs.tip import Action, Observation
from catheter_sim.errors import InputError, unknown
from catheter_sim.pictures.images import PICTURE, suffix_of, write_picture, write_video
from catheter_sim.tables import replaced_when_whole
from reference.steering import deliver, following, insert_rates, resolved_rate, tumour_rates

PREFIX, SUFFIX = "catheter_sim/", "-v0"
POLICIES = ("controller", "chance")
# task -> its controller
CONTROLLERS: dict[type[gymnasium.Env[Any, Any]], Callable[[Any, Observation], Action]] = {
    ReachEnv: resolved_rate,
    TrackEnv: following,
    TumourEnv: lambda env, _: tumour_rates(env),
    InsertEnv: lambda env, _: insert_rates(env),
    DeliverEnv: deliver,
}
_TOGETHER = 10  # episodes of one process at a time


def main() -> int:
    """Run the episodes, print and write the table; return the exit status."""
    known = [
        name[len(PREFIX) : -len(SUFFIX)]
        for name in gymnasium.registry
        if name.startswith(PREFIX) and name.endswith(SUFFIX)
    ]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--episodes", type=whole_number(1, 10000), default=20, help="default 20")
    parser.add_argument("--jobs", type=whole_number(1, 256), default=1, help="processes; default 1")
    parser.add_argument("--environments", help=f"comma-separated, of {', '.join(known)}; default all")
    parser.add_argument("-o", "--output", metavar="FILE", required=True, help="file to write")
    parser.add_argument("--show", metavar="NAME", help="draw an episode of this environment")
    parser.add_argument("--width", type=whole_number(160, 4096), default=1280, help="of --show; default 1280")
    parser.add_argument("--step", type=whole_number(1, 10000), help="of --show, to end at; default the last")
    options = parser.parse_args()
    try:
        if options.show is not None:
            if options.show not in known:
                raise unknown("environment", options.show, known, "--show")
            show(options.show, options.output, options.width, options.step)
            return 0
        names = options.environments.split(",") if options.environments else known
        for name in names:
            if name not in known:
                raise unknown("environment", name, known, "--environments")
        seeds = np.array_split(np.arange(options.episodes), -(-options.episodes // _TOGETHER))
        tasks = [
            joblib.delayed(successes)(name, policy, part)
            for name in names
            for policy in POLICIES
            for part in seeds
        ]
        done = joblib.Parallel(options.jobs)(tqdm(tasks, disable=None, leave=False))
        found = np.array(done).reshape(len(names), len(POLICIES), -1).sum(axis=2)
        lines = ["environment," + ",".join(POLICIES) + ",episodes"]
        for name, (by_controller, by_chance) in zip(names, found, strict=True):
            lines.append(f"{name},{by_controller},{by_chance},{options.episodes}")
        with replaced_when_whole(options.output) as file:
            file.write("\n".join(lines) + "\n")
    except InputError as error:
        print(f"baselines: error: {error}", file=sys.stderr)
        return 2
    print("\n".join(lines))
    return 0


def show(name: str, path: str, width: int, last: int | None = None) -> None:
    """Draw the controller's episode of seed 0, up to step `last`: its end (.png), or all of it (.mp4, .gif).

    Raises:
        InputError: the file's name has another ending, or it cannot be written.
    """
    kind = suffix_of(path)
    size = {"width": width, "height": 2 * round(width * 9 / 32)}
    env = gymnasium.make(f"{PREFIX}{name}{SUFFIX}", render_mode="rgb_array", **size)
    observation, _ = env.reset(seed=0)
    frames, ended, steps = [], False, 0
    while not ended:
        action = CONTROLLERS[type(env.unwrapped)](env.unwrapped, observation)
        observation, _, terminated, truncated, _ = env.step(action)
        steps += 1
        ended = terminated or truncated or steps == last
        if ended or kind != PICTURE:
            frames.append(env.render())
    fps = 2 * env.metadata["render_fps"]
    env.close()
    if kind == PICTURE:
        write_picture(path, frames[-1])
    else:
        write_video(path, frames, fps, len(frames))
    print(f"wrote {path}: {width} x {size['height']} pixels")


def successes(name: str, policy: str, seeds: Sequence[int]) -> int:
    """Return how many of the episodes of these seeds end with success."""
    env = gymnasium.make(f"{PREFIX}{name}{SUFFIX}")
    count = 0
    for seed in seeds:
        generator = np.random.default_rng(seed)
        observation, info = env.reset(seed=int(seed))
        ended = False
        while not ended:
            if policy == "chance":
                action = generator.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
            else:
                action = CONTROLLERS[type(env.unwrapped)](env.unwrapped, observation)
            observation, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
        count += bool(info["is_success"])
    env.close()
    return count


if __name__ == "__main__":
    sys.exit(main())
