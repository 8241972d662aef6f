"""The kinds of robots, and how a file's document says which one it holds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar, cast

from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.document import Document, from_document, to_document
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.specification import ContinuumRobot

Robot = ContinuumRobot | RollingRobot | CatheterRobot
R = TypeVar("R", bound=Robot)

KINDS: dict[str, type[ContinuumRobot] | type[RollingRobot] | type[CatheterRobot]] = {
    "continuum": ContinuumRobot,
    "rolling": RollingRobot,
    "catheter": CatheterRobot,
}


def robot_from_document(document: Document, where: str) -> Robot:
    """Return the robot in a document in file units; without the key `kind` it is a continuum robot.

    Raises:
        InputError: an unknown kind, or a key or value that this kind does not have.
    """
    kind = document.get("kind", "continuum")
    if not isinstance(kind, str) or kind not in KINDS:
        raise unknown("kind", str(kind), KINDS, where)
    if kind == "continuum":
        document = {key: item for key, item in document.items() if key != "kind"}
    robot: Robot = from_document(KINDS[kind], document, where)
    return robot


def complete_document(document: Document, where: str) -> dict[str, Any]:
    """Return `document` with every key that it leaves out, so that --set reaches them all."""
    return to_document(robot_from_document(document, where))


def with_segments(robot: R, changes: Iterable[Mapping[str, float]]) -> R:
    """Return `robot` with fields of its segments changed: by name, one mapping for each segment."""
    parts: Sequence[Any] = robot.segments
    segments = tuple(
        replace(part, **change) if change else part for part, change in zip(parts, changes, strict=True)
    )
    changed: Any = replace(cast(Any, robot), segments=segments)
    return cast(R, changed)


def require_continuum(robot: Robot, what: str) -> ContinuumRobot:
    """Return `robot`, which must be a continuum robot.

    Args:
        robot: any robot.
        what: what does not know the other kinds yet, for the message ("the simulation").

    Raises:
        InputError: it is of another kind.
    """
    if isinstance(robot, ContinuumRobot):
        return robot
    raise InputError(
        f"{robot.name}: {what} does not know robots of kind {robot.kind!r}; choices: a continuum robot"
    )


def require_no_catheter(robot: Robot, what: str) -> ContinuumRobot | RollingRobot:
    """Return `robot`, which must not be a catheter.

    Args:
        robot: any robot.
        what: what does not know catheters yet, for the message ("the benchmark").

    Raises:
        InputError: it is a catheter.
    """
    if not isinstance(robot, CatheterRobot):
        return robot
    choices = ", ".join(kind for kind in KINDS if kind != robot.kind)
    raise InputError(
        f"{robot.name}: {what} does not know robots of kind {robot.kind!r} yet; choices: {choices}"
    )
