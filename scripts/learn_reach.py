"""Learns to bring a robot's tip to its targets, with nothing but NumPy, and draws how.

    python scripts/learn_reach.py -o results/learning [--turns 8] [--seeds 0 1 2]
    python scripts/learn_reach.py -o results/learning --table docs/pictures/learning.csv

The cross-entropy method on the policy of docs/guides/train_a_policy.md: drives move in proportion to the way
from tip to target and to the tip's velocity, 12 numbers in all. In each turn 64 policies, drawn around the
last turn's best, go for the same four targets; the best dozen is where the next turn draws. After each
turn the policy in the middle goes for 64 targets that no turn has seen. Prints and writes learning.csv
(seed, turn, share of the 64 policies' episodes, and of the 64 new targets, that succeed) and learning.png.
With --table nothing is learnt: a written learning.csv is drawn.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from matplotlib.figure import Figure

import catheter_sim  # noqa: F401 - registers the environments
from catheter_sim.cli.arguments import whole_number

ENVIRONMENT = "catheter_sim/NeuroendoscopeSectionReach-v0"
COUNT, BEST = 64, 12  # policies a turn, and those from which the next turn is drawn
TARGETS = 4  # of each turn; with one a turn learns what the next forgets
FIRST_SPREAD, LEAST_SPREAD = 5.0, 0.2  # of a policy's numbers [range of a drive a step, per robot length]
NEW_SEED = 1_000_000  # of targets that no turn sees


def episodes(envs: Any, policies: np.ndarray, seeds: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return each policy's sum of rewards over one episode, and whether it succeeded, shape (n,) each.

    Args:
        envs: as many environments as policies.
        policies: shape (n, 2, 6).
        seeds: of each environment's target.
    """
    seen = envs.reset(seed=seeds)[0]
    going, score, success = np.ones(len(seeds), bool), np.zeros(len(seeds)), np.zeros(len(seeds), bool)
    while going.any():
        error = np.hstack([seen[:, :3] - seen[:, 3:6], seen[:, 9:12]])
        action = np.clip(np.einsum("nao,no->na", policies, error), -1.0, 1.0)
        seen, reward, ended, late, _ = envs.step(action.astype(np.float32))
        score += going * reward
        success |= going & ended
        going &= ~(ended | late)
    return score, success


def learnt(envs: Any, seed: int, turns: int) -> list[tuple[int, int, float, float]]:
    """Return seed, turn, share of the policies that succeed, share of new targets that the middle reaches."""
    rng = np.random.default_rng(seed)
    mean, spread = np.zeros((2, 6)), np.full((2, 6), FIRST_SPREAD)
    rows = []
    for turn in range(turns):
        policies = mean + spread * rng.normal(size=(COUNT, 2, 6))
        score, success = np.zeros(COUNT), np.zeros(COUNT)
        for target in range(TARGETS):
            own, came = episodes(envs, policies, [1000 * seed + TARGETS * turn + target] * COUNT)
            score, success = score + own, success + came / TARGETS
        best = policies[np.argsort(score)[-BEST:]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + LEAST_SPREAD
        new = [NEW_SEED + number for number in range(COUNT)]
        _, reached = episodes(envs, np.repeat(mean[np.newaxis], COUNT, axis=0), new)
        rows.append((seed, turn + 1, float(success.mean()), float(reached.mean())))
        print(
            "seed {} turn {}: {:.0%} of the policies' episodes, {:.0%} of new targets".format(*rows[-1]),
            flush=True,
        )
    return rows


def drawn(rows: list[tuple[int, int, float, float]]) -> Figure:
    """Return the share of the drawn policies' episodes that succeed over the turns, and of new targets."""
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    axes = figure.subplots()
    for seed in dict.fromkeys(row[0] for row in rows):
        own = [row for row in rows if row[0] == seed]
        turns = [row[1] for row in own]
        (line,) = axes.plot(turns, [100.0 * row[2] for row in own], "o-", label=f"seed {seed}")
        axes.plot(turns, [100.0 * row[3] for row in own], ":", color=line.get_color())
    axes.plot([], [], "k:", label="the middle policy, new targets")
    axes.set_xlabel(f"turn ({COUNT} policies, {TARGETS} targets)")
    axes.set_ylabel("episodes that succeed [%]")
    axes.set_ylim(0.0, 102.0)
    axes.grid(color="0.92")
    axes.legend(frameon=False)
    return figure


def main() -> int:
    """Learn, print, write; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder to write, made if need be")
    parser.add_argument("--turns", type=whole_number(1, 1000), default=8)
    parser.add_argument("--seeds", type=whole_number(0, 10**6), nargs="+", default=[0, 1, 2])
    parser.add_argument("--table", metavar="CSV", type=Path, help="draw this learning.csv, and learn nothing")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    if options.table is None:
        envs = gymnasium.make_vec(ENVIRONMENT, COUNT, "vector_entry_point", threads=2)
        rows = [row for seed in options.seeds for row in learnt(envs, seed, options.turns)]
        envs.close()
    else:
        stored = np.loadtxt(options.table, delimiter=",", skiprows=1, ndmin=2)
        rows = [(int(seed), int(turn), float(own), float(new)) for seed, turn, own, new in stored]
    lines = ["seed,turn,episodes_that_succeed,new_targets_reached"]
    lines += [f"{seed},{turn},{own:.4f},{new:.4f}" for seed, turn, own, new in rows]
    (options.output / "learning.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    drawn(rows).savefig(options.output / "learning.png", dpi=110)
    return 0


if __name__ == "__main__":
    sys.exit(main())
