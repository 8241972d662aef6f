"""Points and ways that the tip of a robot reaches: drawn at random, or checked.

A point counts as reachable where the simulated robot comes to it from rest on a straight way of its
drives, friction, effects and load included. So every target has inputs that are known to reach it,
and none rests on a model of the workspace.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.envs.plant import Plant
from catheter_sim.envs.steering import change_toward
from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.robots.posture import Array

RAMP_S = 1.0  # simulated time from rest to the drives' goal, before the robot settles
PULLED_SHARE = 0.5  # of the tension drives in a random draw: single tendons and antagonists alike
PATH_LEGS = 2  # random levels that a way goes through
_MOST_DRAWS = 20
_STARTS = 4  # places in the range of the drives from which a given point is sought
_APART_RAD = 1.0  # between their bends; a tube's stroke counts as half a turn
_TRIALS = 12  # simulated postures on the way from each of them
_GAIN = 0.95  # a trial that leaves more than this share of the miss is the last from its start
_CORRECTED = 8  # trials from the best posture with slopes corrected by what they showed
_FOUND = 1e-3  # of the robot's length: the frictionless robot is at the point
_CLOUD = 4000  # draws among which the starts are chosen


@dataclass(frozen=True)
class Found:
    """A posture that was looked for.

    Attributes:
        level: of the drives, shape (d,).
        tip_m: where the tip comes to rest under them, shape (3,) [m].
    """

    level: Array
    tip_m: Array


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
    plant.reset()
    rest = plant.posture().p_w[-1]
    for _ in range(_MOST_DRAWS):
        level = random_level(plant, rng)
        try:
            tip = tip_at(plant, level)
        except SimulationDiverged:
            continue
        if np.linalg.norm(tip - rest) >= clearance_m:
            return Found(level, tip)
    raise _too_near(plant, clearance_m)


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


def random_path(
    plant: Plant, rng: np.random.Generator, clearance_m: float, steps: int, step_s: float
) -> Path:
    """Return the way of the tip while the drives go from rest through random levels, one after another.

    Between two levels they start and stop gently; the longer way takes more of the `steps`. The tip
    comes at least `clearance_m` away from rest.

    Raises:
        InputError: no draw takes the tip so far.
    """
    for _ in range(_MOST_DRAWS):
        ends = np.array([np.zeros(len(plant.level)), *(random_level(plant, rng) for _ in range(PATH_LEGS))])
        passed = np.cumsum([0.0, *np.abs(np.diff(ends, axis=0)).max(axis=1)])
        if not passed[-1] > 0.0:
            continue
        # Along each leg by a half wave of the cosine; legs share the steps by how far they go.
        leg = np.linspace(0.0, passed[-1], steps + 1)
        start = np.clip(np.searchsorted(passed, leg, side="right") - 1, 0, PATH_LEGS - 1)
        share = (leg - passed[start]) / np.maximum(passed[start + 1] - passed[start], 1e-12)
        gently = (0.5 - 0.5 * np.cos(math.pi * np.clip(share, 0.0, 1.0)))[:, np.newaxis]
        levels = ends[start] + gently * (ends[start + 1] - ends[start])
        plant.reset()
        seen = [plant.posture()]
        try:
            for level in levels[1:]:
                plant.move(level, step_s)
                seen.append(plant.posture())
        except SimulationDiverged:
            continue
        tip = np.array([item.p_w[-1] for item in seen])
        if np.linalg.norm(tip - tip[0], axis=1).max() >= clearance_m:
            direction = np.array([item.R_w[-1][:, 2] for item in seen])
            return Path(levels, tip, direction)
    raise _too_near(plant, clearance_m)


def random_level(plant: Plant, rng: np.random.Generator) -> Array:
    """Return random levels of the drives, shape (d,); of tension drives some stay slack."""
    level = rng.uniform(plant.drives.lowest, 1.0)
    pulled = rng.random(len(level)) < PULLED_SHARE
    return np.where(pulled, level, 0.0) if plant.drives.actuation == "tension" else level


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


def _too_near(plant: Plant, clearance_m: float) -> InputError:
    return InputError(
        f"{plant.specified.name}: in {_MOST_DRAWS} random draws of its inputs the tip never came to "
        f"{clearance_m * 1e3:g} mm or more from where it stands"
    )
