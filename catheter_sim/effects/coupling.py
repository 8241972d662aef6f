"""One joint or section moves another: a share of its input acts on the other one's tendons, too.

Of a catheter: a displacement moves another joint's pair besides its own, by so many mm a mm. Nothing is
added to an advance, which stands at its stop at rest.

Of a robot with several sections: the tendons of one act on those of another by a share of their tension or
displacement that the routing takes there. Side acts on side: a channel's share goes to the channels of the
other section less than 90 deg away, in proportion to the cosine. Tendons that pass another section at
another angle than drawn act a quarter turn aside, too.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_inputs, tendon_inputs
from catheter_sim.core.effect import Effect, Form, Mover, Parameter, Stage, Values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec, by_identity
from catheter_sim.effects.shared import TO_SI, actuation_unit, scale_of
from catheter_sim.robots import kind_of

_NAME, _ASIDE = "{}_to_{}", "{}_aside_{}"
_ABREAST = 1e-9  # cosine up to which two channels are at right angles
# Bound, and a change that matters, of a coefficient; an advance goes ten times as far as a tendon.
_SIZE, _ADVANCE_SIZE = (1.0, 0.02), (0.1, 0.002)
# The same of its growth over a mm, or over the tension that bends the robot by a radian.
_GROWTH, _ADVANCE_GROWTH = (0.5, 0.01), (0.02, 0.0002)


def _movers(robot: RobotSpec) -> tuple[Mover, ...]:
    return kind_of(robot).handles.movers(robot)


@by_identity(1)
def _shares(movers: tuple[Mover, ...]) -> Array:
    """Return which share of each channel (column) acts on each other one (row), shape (c, c)."""
    either_way = np.array([item.toward is None for item in movers])
    share = _cosines(movers, np.eye(2))
    share[either_way[:, np.newaxis] | either_way] = 1.0
    return _parted(movers, share)


@by_identity(1)
def _shares_aside(movers: tuple[Mover, ...]) -> Array:
    """Return the same for what each does a quarter turn from its side: x to y, y to x, (2, c, c)."""
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    return np.stack([_parted(movers, _cosines(movers, way)) for way in (turn, turn.T)])


def _cosines(movers: tuple[Mover, ...], turn: Array) -> Array:
    """Return the cosines from each mover's turned side (column) to each other side (row), none below zero."""
    sums = [np.array(item.toward or (0.0, 0.0)) for item in movers]
    side = np.array([item / max(float(np.linalg.norm(item)), 1e-12) for item in sums])
    cosine = side @ turn @ side.T
    return np.where(cosine > _ABREAST, cosine, 0.0)


def _parted(movers: tuple[Mover, ...], share: Array) -> Array:
    """Return shares that add up to one in each other part; none in the own one, none of an advance."""
    parts = np.array([item.part for item in movers])
    for part in dict.fromkeys(parts.tolist()):
        total = share[parts == part].sum(axis=0)
        share[parts == part] /= np.where(total > 0.0, total, 1.0)
    share[parts[:, np.newaxis] == parts] = 0.0
    share[[item.advances for item in movers]] = 0.0
    return share


def _pairs(movers: tuple[Mover, ...], shares: Array | None = None) -> list[tuple[str, str]]:
    """Return the ordered pairs of sections or joints of which the first can act on the second."""
    parts = [item.part for item in movers]
    onto, of = np.nonzero(_shares(movers) if shares is None else shares)
    acting = {(parts[first], parts[second]) for first, second in zip(of, onto, strict=True)}
    return [pair for pair in permutations(dict.fromkeys(parts), 2) if pair in acting]


def _parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    movers = _movers(robot)
    advanced = {item.part for item in movers if item.advances}
    found = []
    for first, second in _pairs(movers):
        bound, scale = _ADVANCE_SIZE if first in advanced else _SIZE
        found.append(Parameter(_NAME.format(first, second), 0.0, -bound, bound, scale=scale, start=0.0))
    return tuple(found)


def _groups(robot: RobotSpec) -> tuple[tuple[str, ...], ...]:
    names = tuple(_NAME.format(*pair) for pair in _pairs(_movers(robot)))
    return (*((name,) for name in names), names) if names else ()


def _growth_name(robot: RobotSpec) -> str:
    return f"{_NAME}_per_{scale_of(robot)}"


def _growth_parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    movers, name = _movers(robot), _growth_name(robot)
    advanced = {item.part for item in movers if item.advances}
    found = []
    for first, second in _pairs(movers):
        sizes = _ADVANCE_GROWTH if first in advanced else _GROWTH
        bound, scale = (round(size / actuation_unit(robot), 9) for size in sizes)
        found.append(Parameter(name.format(first, second), 0.0, -bound, bound, scale=scale, start=0.0))
    return tuple(found)


def _growth_groups(robot: RobotSpec) -> tuple[tuple[str, ...], ...]:
    names = tuple(item.name for item in _growth_parameters(robot))
    return (*((name,) for name in names), names) if names else ()


def _routing_parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    movers, (bound, scale) = _movers(robot), _SIZE
    return tuple(
        Parameter(_ASIDE.format(*pair), 0.0, -bound, bound, scale=scale, start=0.0)
        for pair in _pairs(movers, _shares_aside(movers)[0])
    )


def _routing_groups(robot: RobotSpec) -> tuple[tuple[str, ...], ...]:
    names = tuple(item.name for item in _routing_parameters(robot))
    if not names:
        return ()
    return (*((name,) for name in names), (*(item.name for item in _parameters(robot)), *names))


def _aside(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    coefficient = _coefficients(robot, values, _ASIDE)
    if not coefficient.any():
        return inputs
    moved, (forth, back) = channel_inputs(robot, inputs), _shares_aside(_movers(robot))
    inputs = _moved_besides(robot, inputs, np.maximum(coefficient, 0.0), moved, forth)
    return _moved_besides(robot, inputs, np.maximum(-coefficient, 0.0), moved, back)


def _coupled(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    coefficient = _coefficients(robot, values, _NAME)
    if not coefficient.any():
        return inputs
    return _moved_besides(robot, inputs, coefficient, channel_inputs(robot, inputs), _shares(_movers(robot)))


def _growing(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    coefficient = _coefficients(robot, values, _growth_name(robot))
    if not coefficient.any():
        return inputs
    moved = channel_inputs(robot, inputs)
    grown = moved * np.abs(moved) / TO_SI[scale_of(robot)]
    return _moved_besides(robot, inputs, coefficient, grown, _shares(_movers(robot)))


def _coefficients(robot: RobotSpec, values: Values, name: str) -> Array:
    """Return the values by their name, of each channel (column) onto each other one (row), shape (c, c)."""
    movers = _movers(robot)
    parts = list(dict.fromkeys(item.part for item in movers))
    found = np.array([[values.get(name.format(first, second), 0.0) for first in parts] for second in parts])
    which = [parts.index(item.part) for item in movers]
    return np.asarray(found.reshape(len(parts), len(parts))[np.ix_(which, which)])


def _moved_besides(
    robot: RobotSpec, inputs: Inputs, coefficient: Array, moved: Array, shares: Array
) -> Inputs:
    """Return inputs with shares (c, c) of what each channel moves (r, c) added to the others."""
    extra = moved @ (coefficient * shares).T
    return replace(inputs, tendon=inputs.tendon + tendon_inputs(robot, inputs.actuation, extra))


EFFECT = Effect(
    name="coupling",
    summary="<from>_to_<to> times the input of one section or joint is added to the other's, side to side",
    trace="a section or joint that moves while only another one is driven, in proportion",
    bench="Drive one section or joint alone. Watch the tendons and angles of the others: which one "
    "moves that should not?",
    forms=(
        Form(
            name="share",
            equation="u_b' = u_b + <a>_to_<b> * u_a",
            stage=Stage.COMMAND,
            parameters=_parameters,
            groups=_groups,
            command=_coupled,
        ),
        Form(
            name="growing",
            equation="u_b' = u_b + <a>_to_<b>_per_<unit> * |u_a| * u_a: more, the more the other is bent",
            stage=Stage.COMMAND,
            parameters=_growth_parameters,
            groups=_growth_groups,
            command=_growing,
            further=True,
        ),
        Form(
            name="routing",
            equation="u_c' = u_c + |<a>_aside_<b>| * u_a, c the channels of b a quarter turn from a's own "
            "side, x to y where it is above zero: tendons of a pass b at another angle than drawn",
            stage=Stage.COMMAND,
            parameters=_routing_parameters,
            groups=_routing_groups,
            command=_aside,
            further=True,
        ),
    ),
)
