"""Model-based controllers of the clinical tasks: resolved rates with what the anatomy asks for besides."""

from __future__ import annotations

import numpy as np

from catheter_sim.anatomy.ventricles import TUMOUR_RADIUS_M, foramen, tumour, way
from catheter_sim.envs.clinical.rates import Rates, Wish
from catheter_sim.envs.clinical.tumour import TumourEnv
from catheter_sim.envs.tip import Action
from catheter_sim.robots.posture import Array

_LEAD_M = 3e-3  # that the tip is asked to go ahead on the way, or to a point
_PASSED_M = 4e-3  # of the tip behind the foramen's middle, before it turns to a point
_CLEAR_M = 3.0e-3  # of the tip's middle from the tumour: it does not touch yet, and reaches within 5 mm
_OFF_M = 2.2e-3  # least distance of the tip's middle from it: the tip's radius and a margin
_NEAR_M = 1.5e-3  # way in one step beyond the foramen
_SHAFT = 0.4  # weight of the shaft's place in the foramen against the tip's


def tumour_rates(env: TumourEnv) -> Action:
    """Return the action of resolved rates in `TumourEnv`.

    The tip follows the planned way until it is through the foramen, and then goes to the next point, from
    a little before it; the shaft is to stay in the middle of the foramen meanwhile.
    """
    rates = Rates(env, 0.0)
    tip, anatomy = rates.p_w[-1], env.anatomy
    hole = foramen(anatomy)
    middle, axes = hole.p_w[0], hole.R_w[0]
    ahead = float((tip - middle) @ axes[:, 2])
    if ahead < _PASSED_M:
        s = np.linspace(0.0, anatomy.length_m, 400)
        places = way(anatomy, s).p_w
        nearest = int(np.linalg.norm(places - tip, axis=1).argmin())
        goal = way(anatomy, s[nearest] + _LEAD_M).p_w[0]
    else:
        outward = env.target_m - tumour(anatomy)
        goal = env.target_m + _CLEAR_M * outward / np.linalg.norm(outward)
    move = _kept_off(tip, _limited(goal - tip, _LEAD_M if ahead < _PASSED_M else _NEAR_M), tumour(anatomy))
    wishes = [Wish(rates.elements, move, np.eye(3))]
    if ahead > 0.0:
        along = (rates.p_w - middle) @ axes[:, 2]
        element = int(np.abs(along).argmin())
        back = middle - rates.p_w[element]
        wishes.append(Wish(element + 1, _limited(0.3 * back, _LEAD_M), _SHAFT * axes[:, :2].T))
    return rates.choose(wishes)


def _limited(way_m: Array, most_m: float) -> Array:
    """Return a motion, no longer than `most_m`."""
    size = float(np.linalg.norm(way_m))
    return way_m * min(1.0, most_m / max(size, 1e-12))


def _kept_off(tip: Array, move: Array, ball: Array) -> Array:
    """Return a motion that does not bring the tip's middle nearer to the tumour than `_OFF_M`."""
    inward = (ball - tip) / np.linalg.norm(ball - tip)
    room = float(np.linalg.norm(ball - tip)) - TUMOUR_RADIUS_M - _OFF_M
    return move - inward * max(0.0, float(move @ inward) - room)
