"""Model-based controllers of the clinical tasks: resolved rates with what the anatomy asks for besides."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.anatomy.ventricles import TUMOUR_RADIUS_M, foramen, tumour, way
from catheter_sim.envs.clinical.rates import Rates, Wish
from catheter_sim.envs.clinical.tumour import TumourEnv
from catheter_sim.envs.tip import Action
from catheter_sim.robots.posture import Array

_LEAD_M = 3e-3  # that the tip is asked to go ahead on the way, in one step
_NEAR_M = 1.5e-3  # the same near the foramen and beyond it
_BEFORE_M, _PASSED_M = 6e-3, 4e-3  # of the tip before and behind the foramen's middle: near it
_CLEAR_M = 3.5e-3  # of the tip's middle from the tumour, on the way's axis: from there it turns to the points
_ENOUGH = 0.7  # of the tolerance: so near it goes to a point, and no nearer, as that moves the shaft least
_OFF_M = 2.2e-3  # least distance of the tip's middle from the tumour: the tip's radius and a margin
_SHAFT, _SHAFT_GAIN = 1.0, 0.3  # weight of the shaft's place in the foramen against the tip's; share a step
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
        action[-1] = np.clip(_ROLL_GAIN * error / (env.motions[1].rate_per_s * 0.1), -1.0, 1.0)
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
