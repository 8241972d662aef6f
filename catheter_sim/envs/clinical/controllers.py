"""Model-based controllers of the clinical tasks: resolved rates with what the anatomy asks for besides."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.anatomy.chest import CHANNEL_M, Chest
from catheter_sim.anatomy.ventricles import TUMOUR_RADIUS_M, foramen, tumour, way
from catheter_sim.arrays import Array
from catheter_sim.envs.clinical.insert import InsertEnv
from catheter_sim.envs.clinical.rates import Rates, Wish
from catheter_sim.envs.clinical.tumour import TumourEnv
from catheter_sim.envs.tip import CONTROL_STEP_S, Action

_LEAD_M = 3e-3  # that the tip is asked to go ahead on the way, in one step
_NEAR_M = 1.5e-3  # the same near the foramen and beyond it
_BEFORE_M, _PASSED_M = 6e-3, 4e-3  # of the tip before and behind the foramen's middle: near it
_CLEAR_M = 3.5e-3  # of the tip's middle from the tumour, on the way's axis: from there it turns to the points
_ENOUGH = 0.7  # of the tolerance: so near it goes to a point, and no nearer, as that moves the shaft least
_OFF_M = 2.2e-3  # least distance of the tip's middle from the tumour: the tip's radius and a margin
_SHAFT, _SHAFT_GAIN = 1.0, 0.3  # weight of the shaft's place in the foramen against the tip's; share a step
_TURN_M = 34e-3  # radius of the turn in the pleural space
_AHEAD = 3  # points of the way, a millimetre apart, that the tip is asked to go in a step
_FOLLOW, _FOLLOW_GAIN = 0.3, 0.3  # weight of a link's place on the way against the tip's; share a step
_ROLL_GAIN = 0.3  # share of the roll's error that goes in a step


def tumour_rates(env: TumourEnv) -> Action:
    """Return the action of resolved rates in `TumourEnv`.

    The tip follows the planned way until it is through the foramen, and then goes toward the next point from
    the end of the way, as near as is asked for; the shaft is to stay in the middle of the foramen meanwhile.
    On the way to the foramen, where the robot is hardly bent yet, it is rolled into the plane of the way.
    """
    rates = Rates(env, 0.0)
    tip, anatomy = rates.p_w[-1], env.anatomy
    hole = foramen(anatomy)
    middle, axes = hole.p_w[0], hole.R_w[0]
    ahead = float((tip - middle) @ axes[:, 2])
    most = _LEAD_M if ahead < -_BEFORE_M else _NEAR_M
    if ahead < _PASSED_M:
        s = np.linspace(0.0, anatomy.length_m, 400)
        places = way(anatomy, s).p_w
        nearest = int(np.linalg.norm(places - tip, axis=1).argmin())
        goal = way(anatomy, s[nearest] + most).p_w[0]
    else:
        end = way(anatomy, np.array([anatomy.length_m - _CLEAR_M])).p_w[0]
        back = end - env.target_m
        goal = env.target_m + _limited(back, _ENOUGH * env.tolerance_m)
    wishes = [Wish(rates.elements, _kept_off(tip, _limited(goal - tip, most), tumour(anatomy)), np.eye(3))]
    if ahead > 0.0:
        along = (rates.p_w - middle) @ axes[:, 2]
        element = int(np.abs(along).argmin())
        back = _SHAFT_GAIN * (middle - rates.p_w[element])
        wishes.append(Wish(element + 1, back, _SHAFT * axes[:, :2].T))
    action = rates.choose(wishes)
    if ahead < -_BEFORE_M:
        roll = math.atan2(middle[1], middle[0]) if math.hypot(*middle[:2]) > 1e-3 else anatomy.azimuth_rad
        error = 0.5 * (roll + anatomy.azimuth_rad) - env.plant.carriage[1]
        action[-1] = np.clip(_ROLL_GAIN * error / (env.motions[1].rate_per_s * CONTROL_STEP_S), -1.0, 1.0)
    return action


def insert_way(anatomy: Chest) -> Array:
    """Return points a millimetre apart from the channel's mouth to the aspiration point, shape (n, 3) [m].

    Straight on, round an arc of `_TURN_M` into the plane of the wall, and straight on.
    """
    depth, across = anatomy.target_depth_m, anatomy.target_away_m
    first, turn = depth - _TURN_M, 0.5 * math.pi * _TURN_M
    s = np.arange(0.0, first + turn + across - _TURN_M, 1e-3)
    angle = np.clip((s - first) / _TURN_M, 0.0, 0.5 * math.pi)
    after = np.maximum(s - first - turn, 0.0)
    x = _TURN_M * (1.0 - np.cos(angle)) + after
    z = np.minimum(s, first) + _TURN_M * np.sin(angle)
    azimuth = anatomy.target_azimuth_rad
    return np.stack([x * math.cos(azimuth), x * math.sin(azimuth), z], axis=1)


def insert_rates(env: InsertEnv) -> Action:
    """Return the action of resolved rates in `InsertEnv`.

    The tip goes along `insert_way`, and each link that is out of the wall is to stay on it; the robot is
    rolled into the plane of the way while it is still in the wall.
    """
    rates = Rates(env, 0.0)
    tip, way_m = rates.p_w[-1], insert_way(env.anatomy)
    turn = env.anatomy.target_azimuth_rad - env.plant.carriage[1]
    action = np.zeros(env.action_space.shape, dtype=np.float32)
    if tip[2] < 0.0 and float(np.hypot(*tip[:2])) < CHANNEL_M:
        action[-2] = 1.0
    else:
        nearest = int(np.linalg.norm(way_m - tip, axis=1).argmin())
        goal = way_m[min(nearest + _AHEAD, len(way_m) - 1)]
        wishes = [Wish(rates.elements, _limited(goal - tip, _AHEAD * 1e-3), np.eye(3))]
        for element in range(rates.elements - 1, 0, -1):
            place = rates.p_w[element - 1]
            if place[2] < 0.0:
                break
            other = way_m[int(np.linalg.norm(way_m - place, axis=1).argmin())]
            wishes.append(Wish(element, _FOLLOW_GAIN * (other - place), _FOLLOW * np.eye(3)))
        action = rates.choose(wishes)
    action[-1] = np.clip(turn / (env.motions[1].rate_per_s * CONTROL_STEP_S), -1.0, 1.0)
    return action


def _limited(way_m: Array, most_m: float) -> Array:
    """Return a motion, no longer than `most_m`."""
    size = float(np.linalg.norm(way_m))
    return way_m * min(1.0, most_m / max(size, 1e-12))


def _kept_off(tip: Array, move: Array, ball: Array) -> Array:
    """Return a motion that does not bring the tip's middle nearer to the tumour than `_OFF_M`."""
    inward = (ball - tip) / np.linalg.norm(ball - tip)
    room = float(np.linalg.norm(ball - tip)) - TUMOUR_RADIUS_M - _OFF_M
    return move - inward * max(0.0, float(move @ inward) - room)
