"""What of a pair's displacement arrives at its tendons, and how far it may go: play, slack, ends."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.catheter.layout import is_extensible, moved_segment
from catheter_sim.kinds.catheter.spec import CatheterRobot, TendonPair
from catheter_sim.kinds.catheter.theory.tendons import largest_angle_rad, pulled_m
from catheter_sim.mechanics.play import play


def played_m(pair: TendonPair, displacement_m: Array) -> Array:
    """Return where a pair's pulley is along displacements from rest, shape (r,) [m].

    The drive's play follows with the pair's whole `play_m`, centred at rest (Nayar 2022, Eqs 29-31).
    """
    if pair.play_m > 0.0:
        return play(displacement_m[:, np.newaxis], pair.play_m)[:, 0]
    return displacement_m


def arriving_m(pair: TendonPair, displacement_m: Array) -> Array:
    """Return how far a pair's tendons are drawn along displacements from rest, shape (r,) [m].

    Of a bending joint's pair each tendon draws only what is left of its `slack_m`; in between neither does.
    """
    drawn = played_m(pair, displacement_m)
    return np.copysign(np.maximum(np.abs(drawn) - pair.slack_m, 0.0), drawn)


def input_range_m(robot: CatheterRobot) -> tuple[Array, Array]:
    """Return the least and largest displacement of each pair to which an angle belongs, shape (t,) each [m].

    There a joint is at its end: gaps closed, or tendon unwound. A bending pair that stretches goes on beyond
    it, and so does a tube.
    """
    least, most = np.full((2, len(robot.tendons)), [[-math.inf], [math.inf]])
    for index, pair in enumerate(robot.tendons):
        segment = robot.segments[moved_segment(robot, index)]
        if segment.joint == "prismatic" or (segment.joint == "bending" and is_extensible(pair)):
            continue
        ends = pulled_m(segment, largest_angle_rad(segment) * np.array([-1.0, 1.0]))
        spare = pair.slack_m + 0.5 * pair.play_m
        least[index], most[index] = ends[0] - spare, ends[1] + spare
    return least, most
