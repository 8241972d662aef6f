"""One joint or section moves another: a share of its input acts on the other one's tendons, too.

Of a catheter: a displacement moves another joint's pair besides its own, by so many mm a mm. Nothing is
added to an advance, which stands at its stop at rest.

Of a robot with several sections: the tendons of one act on those of another by a share of their tension or
displacement that the routing takes there. Side acts on side: a channel's share goes to the channels of the
other section less than 90 deg away, in proportion to the cosine. A tension stays at zero or above: a tendon
cannot push.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations

import numpy as np

from catheter_sim.effects._channels import added, channels
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.catheter_layout import moved_segment
from catheter_sim.robots.channels import Inputs, channel_of
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array
from catheter_sim.robots.rolling import Rod
from catheter_sim.robots.specification import Tendon

_NAME = "{}_to_{}"
_ABREAST = 1e-9  # cosine up to which two channels are at right angles
_SIDE_RAD = {"+x": 0.0, "+y": math.pi / 2.0, "-x": math.pi, "-y": -math.pi / 2.0}
# Bound, and a change that matters, of a coefficient; an advance goes ten times as far as a tendon.
_SIZE, _ADVANCE_SIZE = (1.0, 0.02), (0.1, 0.002)


def _parts(robot: Robot) -> list[str]:
    """Return the section, or a catheter's joint, that each channel moves."""
    if isinstance(robot, CatheterRobot):
        return channels(robot)
    ends = dict(zip(channel_of(robot), (tendon.ends_at for tendon in robot.tendons), strict=True))
    return [ends[name] for name in channels(robot)]


def _side(tendon: Tendon | Rod) -> Array:
    """Return the direction in which a tendon bends its section, shape (2,)."""
    angle = _SIDE_RAD[tendon.side] if isinstance(tendon, Rod) else tendon.angle_rad
    return np.array([math.cos(angle), math.sin(angle)])


def _shares(robot: Robot) -> Array:
    """Return which share of each channel (column) acts on each other one (row), shape (c, c)."""
    names = channels(robot)
    if isinstance(robot, CatheterRobot):
        advanced = _advanced(robot)
        share = np.ones((len(names), len(names))) - np.eye(len(names))
        share[[name in advanced for name in names]] = 0.0
        return share
    tendons: Sequence[Tendon | Rod] = robot.tendons
    sums = {name: np.zeros(2) for name in names}
    for name, tendon in zip(channel_of(robot), tendons, strict=True):
        sums[name] = sums[name] + _side(tendon)
    side = np.array([sums[name] / max(float(np.linalg.norm(sums[name])), 1e-12) for name in names])
    cosine = side @ side.T
    parts = np.array(_parts(robot))
    share = np.where(cosine > _ABREAST, cosine, 0.0)
    for part in dict.fromkeys(parts.tolist()):
        total = share[parts == part].sum(axis=0)
        share[parts == part] /= np.where(total > 0.0, total, 1.0)
    share[parts[:, np.newaxis] == parts] = 0.0
    return share


def _advanced(robot: CatheterRobot) -> set[str]:
    joints = [robot.segments[moved_segment(robot, index)].joint for index in range(len(robot.tendons))]
    return {pair.name for pair, joint in zip(robot.tendons, joints, strict=True) if joint == "prismatic"}


def _pairs(robot: Robot) -> list[tuple[str, str]]:
    """Return the ordered pairs of sections or joints of which the first can act on the second."""
    parts = _parts(robot)
    onto, of = np.nonzero(_shares(robot))
    acting = {(parts[first], parts[second]) for first, second in zip(of, onto, strict=True)}
    return [pair for pair in permutations(dict.fromkeys(parts), 2) if pair in acting]


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    advanced = _advanced(robot) if isinstance(robot, CatheterRobot) else set()
    found = []
    for first, second in _pairs(robot):
        bound, scale = _ADVANCE_SIZE if first in advanced else _SIZE
        found.append(Parameter(_NAME.format(first, second), 0.0, -bound, bound, scale=scale, start=0.0))
    return tuple(found)


def _variants(robot: Robot) -> tuple[tuple[str, ...], ...]:
    names = tuple(_NAME.format(*pair) for pair in _pairs(robot))
    return (*((name,) for name in names), names)


def _change_inputs(robot: Robot, inputs: Inputs, values: Values) -> Inputs:
    if not any(values.values()):
        return inputs
    parts = _parts(robot)
    coefficient = np.array(
        [[values.get(_NAME.format(first, second), 0.0) for first in parts] for second in parts]
    )
    member = _members(robot)
    tendons = member.sum(axis=0)
    # A channel's tension is its tendons' sum, its displacement that of each.
    into, out_of = (member, member / tendons) if inputs.actuation == "tension" else (member / tendons, member)
    return added(inputs, inputs.tendon @ into @ (coefficient * _shares(robot)).T @ out_of.T)


def _members(robot: Robot) -> Array:
    """Return 1 where a tendon (row) is of a channel (column), shape (t, c)."""
    names = channels(robot)
    return np.array([[float(own == name) for name in names] for own in channel_of(robot)])


EFFECT = Effect(
    name="coupling",
    summary="<from>_to_<to> times the input of one section or joint is added to the other's, side to side",
    trace="a section or joint that moves while only another one is driven, in proportion",
    parameters=_parameters,
    change_inputs=_change_inputs,
    variants=_variants,
)
