"""The kinds of robots: one line each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from catheter_sim.core.kind import Kind
from catheter_sim.core.robot import RobotSpec, check_markers
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter import KIND as _CATHETER
from catheter_sim.robots.continuum import KIND as _CONTINUUM
from catheter_sim.robots.notched_tube import KIND as _NOTCHED_TUBE
from catheter_sim.robots.rolling import KIND as _ROLLING

KINDS: Mapping[str, Kind[Any]] = {
    kind.name: kind
    for kind in (
        _CONTINUUM,
        _ROLLING,
        _CATHETER,
        _NOTCHED_TUBE,
    )
}
_OF_SPEC: Mapping[type[RobotSpec], Kind[Any]] = {kind.spec: kind for kind in KINDS.values()}


def kind_of(robot: RobotSpec) -> Kind[Any]:
    """Return the kind of `robot`: that of its class, or of the nearest class it inherits from."""
    return next(_OF_SPEC[inherited] for inherited in type(robot).__mro__ if inherited in _OF_SPEC)


def face_of(robot: RobotSpec, name: str, what: str) -> Any:
    """Return the face `name` of the kind of `robot`, without which there is no `what` ("environment").

    Raises:
        InputError: the kind has no such face; the message names those that have.
    """
    kind = kind_of(robot)
    if not kind.has(name):
        having = [other.name for other in KINDS.values() if other.has(name)]
        what = f"no {what} for robots of kind {kind.name!r}"
        raise InputError(f"{robot.name}: {what}; choices: {', '.join(having) or '(none)'}")
    return kind.face(name, what)


def check_robot(robot: RobotSpec, where: str) -> None:
    """Raise `InputError` where a number of `robot` is impossible.

    `where`: what to call it in the message (file or robot id).
    """
    kind = kind_of(robot)
    kind.checks.check(robot, where)
    if robot.markers:
        check_markers(robot, kind.drives.outputs(robot).elements, where)
