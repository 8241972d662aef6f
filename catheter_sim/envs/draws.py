"""Random points and ways of a robot's tip, for many robots at once.

Whoever draws for many gets of each what its generator alone would have given: each robot goes on with its
own generator until it has what it needs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.core.drive import Quantity
from catheter_sim.envs.plant import Plant
from catheter_sim.envs.robots import Robots
from catheter_sim.errors import InputError, SimulationDiverged

RAMP_S = 1.0  # simulated time from rest to the drives' goal, before the robot settles
PULLED_SHARE = 0.5  # of the tension drives in a random draw: single tendons and antagonists alike
PATH_LEGS = 2  # random levels that a way goes through
_MOST_DRAWS = 100


@dataclass(frozen=True)
class Found:
    """A posture that was looked for.

    Attributes:
        level: of the drives, shape (d,).
        tip_m: where the tip comes to rest under them, shape (3,) [m].
    """

    level: Array
    tip_m: Array


@dataclass(frozen=True)
class Path:
    """A way that the tip of a simulated robot went, from rest.

    Attributes:
        level: of the drives at the end of each control step, rest first, shape (r + 1, d).
        tip_m: where the tip was then, shape (r + 1, 3) [m].
        direction: unit vectors along the tip's axis there, shape (r + 1, 3).
    """

    level: Array
    tip_m: Array
    direction: Array


def random_targets(
    plant: Plant, robots: Robots, chosen: Index, rngs: Sequence[np.random.Generator], clearance_m: float
) -> list[Found]:
    """Return a random reachable point for each chosen robot, `clearance_m` or more from its tip at rest.

    Args:
        plant: what the robots are; it is not moved.
        robots: what is moved.
        chosen: which of them, shape (k,).
        rngs: a generator for each of these.
        clearance_m: least distance [m].

    Raises:
        InputError: no draw of a robot ends so far from rest.
        SimulationDiverged: they do not even stand at rest.
    """
    require_standing(plant, robots, chosen)
    rest = robots.tips(chosen)[0]
    found: dict[int, Found] = {}
    open_ = np.arange(len(chosen))
    for _ in range(_MOST_DRAWS):
        level = np.array([random_level(plant, rngs[int(place)]) for place in open_])
        moved = chosen[open_]
        robots.reset(moved)
        robots.move(moved, level, RAMP_S)
        robots.settle(moved)
        tips = robots.tips(moved)[0]
        far = np.linalg.norm(tips - rest[open_], axis=1) >= clearance_m
        done = far & robots.finite(moved)
        for row in np.flatnonzero(done):
            found[int(open_[row])] = Found(level[row], tips[row].copy())
        open_ = open_[~done]
        if not len(open_):
            return [found[place] for place in range(len(chosen))]
    raise _too_near(plant, clearance_m)


def random_paths(
    plant: Plant,
    robots: Robots,
    chosen: Index,
    rngs: Sequence[np.random.Generator],
    clearance_m: float,
    steps: int,
    step_s: float,
) -> list[Path]:
    """Return for each chosen robot the way of its tip from rest through random levels, one after another.

    Between two levels the drives start and stop gently; the longer way takes more of the `steps`. The tip
    comes at least `clearance_m` away from rest. Arguments as of `random_targets`.

    Raises:
        InputError: no draw takes a robot's tip so far.
        SimulationDiverged: they do not even stand at rest.
    """
    found: dict[int, Path] = {}
    open_ = np.arange(len(chosen))
    for _ in range(_MOST_DRAWS):
        drawn = {int(place): random_levels(plant, rngs[int(place)], steps) for place in open_}
        going = np.array([place for place in open_ if drawn[int(place)] is not None], dtype=int)
        if len(going):
            levels = np.array([drawn[int(place)] for place in going])
            require_standing(plant, robots, chosen[going])
            tips, directions = _gone(robots, chosen[going], levels, step_s)
            away = np.linalg.norm(tips - tips[:, :1], axis=2).max(axis=1)
            done = (away >= clearance_m) & robots.finite(chosen[going])
            for row in np.flatnonzero(done):
                found[int(going[row])] = Path(levels[row], tips[row], directions[row])
        open_ = np.array([place for place in open_ if int(place) not in found], dtype=int)
        if not len(open_):
            return [found[place] for place in range(len(chosen))]
    raise _too_near(plant, clearance_m)


def random_level(plant: Plant, rng: np.random.Generator) -> Array:
    """Return random levels of the drives, shape (d,); of tension drives some stay slack."""
    level = rng.uniform(plant.drives.lowest, 1.0)
    pulled = rng.random(len(level)) < PULLED_SHARE
    return np.where(pulled, level, 0.0) if plant.drives.quantity is Quantity.TENSION else level


def random_levels(plant: Plant, rng: np.random.Generator, steps: int) -> Array | None:
    """Return the drives' levels on a random way from rest, shape (steps + 1, d); None where it is none."""
    ends = np.array([np.zeros(len(plant.level)), *(random_level(plant, rng) for _ in range(PATH_LEGS))])
    passed = np.cumsum([0.0, *np.abs(np.diff(ends, axis=0)).max(axis=1)])
    if not passed[-1] > 0.0:
        return None
    # Along each leg by a half wave of the cosine; legs share the steps by how far they go.
    leg = np.linspace(0.0, passed[-1], steps + 1)
    start = np.clip(np.searchsorted(passed, leg, side="right") - 1, 0, PATH_LEGS - 1)
    share = (leg - passed[start]) / np.maximum(passed[start + 1] - passed[start], 1e-12)
    gently = (0.5 - 0.5 * np.cos(math.pi * np.clip(share, 0.0, 1.0)))[:, np.newaxis]
    levels: Array = ends[start] + gently * (ends[start + 1] - ends[start])
    return levels


def require_standing(plant: Plant, robots: Robots, chosen: Index) -> None:
    """Return robots to rest.

    Raises:
        SimulationDiverged: they do not stand.
    """
    robots.reset(chosen)
    if not robots.finite(chosen).all():
        raise SimulationDiverged(f"{plant.specified.name}: the simulation diverged on the way to rest")


def _gone(robots: Robots, chosen: Index, levels: Array, step_s: float) -> tuple[Array, Array]:
    """Return where tips were on the way from rest through `levels`, shape (k, r + 1, d), and looked.

    Both of shape (k, r + 1, 3).
    """
    tips, directions = np.zeros((2, *levels.shape[:2], 3))
    for step in range(levels.shape[1]):
        if step > 0:
            robots.move(chosen, levels[:, step], step_s)
        place, axes, _ = robots.tips(chosen)
        tips[:, step], directions[:, step] = place, axes[:, :, 2]
    return tips, directions


def _too_near(plant: Plant, clearance_m: float) -> InputError:
    return InputError(
        f"{plant.specified.name}: in {_MOST_DRAWS} random draws of its inputs the tip never came to "
        f"{clearance_m * 1e3:g} mm or more from where it stands"
    )
