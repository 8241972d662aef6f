"""Points and ways that the tip of a robot reaches: drawn at random, or checked.

A point counts as reachable where the simulated robot comes to it from rest on a straight way of its
drives, friction, effects and load included. So every target has inputs that are known to reach it,
and none rests on a model of the workspace.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.envs.draws import PULLED_SHARE, RAMP_S, Found, Path, random_paths, random_targets
from catheter_sim.envs.plant import Plant
from catheter_sim.envs.robots import OneByOne
from catheter_sim.envs.steering import change_toward
from catheter_sim.errors import InputError, SimulationDiverged

_ALONE = np.arange(1)
_STARTS = 4  # places in the range of the drives from which a given point is sought
_APART_RAD = 1.0  # between their bends; a tube's stroke counts as half a turn
_TRIALS = 12  # simulated postures on the way from each of them
_GAIN = 0.95  # a trial that leaves more than this share of the miss is the last from its start
_CORRECTED = 8  # trials from the best posture with slopes corrected by what they showed
_FOUND = 1e-3  # of the robot's length: the frictionless robot is at the point
_CLOUD = 4000  # draws among which the starts are chosen


def tip_at(plant: Plant, level: Array) -> Array:
    """Return where the tip comes to rest when the drives go from rest to `level`, shape (3,) [m].

    The plant stays there.

    Raises:
        SimulationDiverged: it comes to rest nowhere.
    """
    plant.reset()
    plant.move(level, RAMP_S)
    plant.settle()
    return plant.posture().p_w[-1]


def random_target(plant: Plant, rng: np.random.Generator, clearance_m: float) -> Found:
    """Return a random reachable point, at least `clearance_m` from the tip at rest.

    Raises:
        InputError: no draw ends so far from rest.
    """
    return random_targets(plant, OneByOne([plant]), _ALONE, [rng], clearance_m)[0]


def random_path(
    plant: Plant, rng: np.random.Generator, clearance_m: float, steps: int, step_s: float
) -> Path:
    """Return a random way of the tip, of so many `steps`; see `draws.random_paths`.

    Raises:
        InputError: no draw takes the tip so far.
    """
    return random_paths(plant, OneByOne([plant]), _ALONE, [rng], clearance_m, steps, step_s)[0]


def nearest(plant: Plant, target_m: Array, enough_m: float) -> Found:
    """Return the posture whose tip is nearest to `target_m` among those found from several starts.

    The search ends at a posture nearer than `enough_m` [m].

    Raises:
        SimulationDiverged: the robot does not stand even at rest.
    """
    drives, length = plant.drives, float(plant.segment_length.sum())
    plant.reset()
    best = Found(plant.level.copy(), plant.posture().p_w[-1])
    best_miss = float(np.linalg.norm(best.tip_m - target_m))
    for start in _starts(plant, target_m):
        level, least_miss = start, np.inf
        for _ in range(_TRIALS):
            try:
                tip = tip_at(plant, level)
            except SimulationDiverged:
                break
            miss = float(np.linalg.norm(tip - target_m))
            if miss < best_miss:
                best, best_miss = Found(level, tip), miss
            if best_miss <= enough_m:
                return best
            if miss > _GAIN * least_miss:
                break
            least_miss = miss
            room = drives.lowest - level, 1.0 - level
            slopes = plant.quick.tip_slopes(level, plant.segment_bends())
            level = level + change_toward(target_m - tip, slopes, length, *room)
    return _corrected(plant, target_m, best, enough_m)


def _corrected(plant: Plant, target_m: Array, found: Found, enough_m: float) -> Found:
    """Return `found`, or a nearer posture by slopes that learn from every trial (Broyden's update).

    Friction turns and shortens the tip's way; where a robot has many drives, the quick model's slopes
    alone may lead no nearer.
    """
    drives, length = plant.drives, float(plant.segment_length.sum())
    tip_at(plant, found.level)
    slopes = plant.quick.tip_slopes(found.level, plant.segment_bends())
    for _ in range(_CORRECTED):
        room = drives.lowest - found.level, 1.0 - found.level
        change = change_toward(target_m - found.tip_m, slopes, length, *room)
        if not change.any():
            break
        try:
            tip = tip_at(plant, found.level + change)
        except SimulationDiverged:
            break
        slopes = slopes + np.outer(tip - found.tip_m - slopes @ change, change) / (change @ change)
        if np.linalg.norm(tip - target_m) < np.linalg.norm(found.tip_m - target_m):
            found = Found(found.level + change, tip)
        if np.linalg.norm(found.tip_m - target_m) <= enough_m:
            break
    return found


def require_reachable(plant: Plant, target_m: Sequence[float], tolerance_m: float) -> Array:
    """Return `target_m` as an array, shape (3,) [m].

    Raises:
        InputError: it is no point, or the tip does not come within `tolerance_m` of it.
    """
    try:
        target = np.array(target_m, dtype=float)
    except (TypeError, ValueError):
        target = np.zeros(0)
    if target.shape != (3,) or not np.isfinite(target).all():
        raise InputError(f"target = {target_m!r}: three finite numbers are needed, x, y and z in m")
    out_of_reach = f"target {_millimetres(target)} mm is out of reach of {plant.specified.name}: "
    away, longest = float(np.linalg.norm(target)), float(plant.segment_length.sum())
    if away > longest + tolerance_m:
        raise InputError(f"{out_of_reach}{away * 1e3:.1f} mm from the base, it is {longest * 1e3:g} mm long")
    if plant.quick.planar and abs(target[1]) > tolerance_m:
        raise InputError(f"{out_of_reach}y must be 0, as it bends in the xz plane only")
    found = nearest(plant, target, tolerance_m)
    miss = float(np.linalg.norm(found.tip_m - target))
    if miss > tolerance_m:
        raise InputError(
            f"{out_of_reach}the tip was brought no nearer than {miss * 1e3:.1f} mm, "
            f"to {_millimetres(found.tip_m)} mm (tolerance {tolerance_m * 1e3:g} mm)"
        )
    return target


def frictionless_reach(plant: Plant) -> tuple[Array, Array, Array]:
    """Return where the robot without friction and load goes all over the range of its drives.

    Returns:
        Levels, shape (n, d), tips, shape (n, 3) [m], and bends, shape (n, *b) [rad or m].
    """
    lowest = plant.drives.lowest
    rng = np.random.default_rng(0)  # the same points every time
    level = rng.uniform(lowest, 1.0, (_CLOUD, len(lowest)))
    level[::2] *= rng.random(level[::2].shape) < PULLED_SHARE
    bent = plant.quick.reach(level[1:2], plant.rest_bends)[1][0]
    level *= np.any(plant.quick.tip_slopes(level[1], bent), axis=0)  # drives that move no tip stay at rest
    return level, *plant.quick.reach(level, plant.rest_bends)


def frictionless_level(plant: Plant, target_m: Array) -> Array:
    """Return the levels at which the robot without friction and load is nearest to a point, shape (d,).

    Without simulation; of the postures found from several starts.
    """
    quick, length = plant.quick, float(plant.segment_length.sum())
    best, best_miss = np.zeros(len(plant.drives.names)), np.inf
    for level in _starts(plant, target_m):
        for _ in range(_TRIALS):
            tips, bends = quick.reach(level[np.newaxis], plant.rest_bends)
            miss = float(np.linalg.norm(target_m - tips[0]))
            if miss < best_miss:
                best, best_miss = level, miss
            if best_miss < _FOUND * length:
                return best
            room = plant.drives.lowest - level, 1.0 - level
            level = level + change_toward(
                target_m - tips[0], quick.tip_slopes(level, bends[0]), length, *room
            )
    return best


def _starts(plant: Plant, target_m: Array) -> list[Array]:
    """Return levels, far apart in posture, at which the frictionless robot is near `target_m`."""
    level, tip, bend = frictionless_reach(plant)
    bend = bend * (math.pi / plant.quick.bend_unit)
    chosen: list[int] = []
    for index in np.argsort(np.linalg.norm(tip - target_m, axis=1)):
        if all(np.linalg.norm(bend[index] - bend[other]) > _APART_RAD for other in chosen):
            chosen.append(int(index))
        if len(chosen) == _STARTS:
            break
    return [level[index] for index in chosen]


def _millimetres(point_m: Array) -> str:
    return "(" + ", ".join(f"{value * 1e3:.1f}" for value in point_m) + ")"
