"""The laws that run beside a robot's step, in the order of their turns; friction comes last."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco

from catheter_sim.core.law import FrictionLaw, Law, RobotInModel, Step
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots import KINDS, kind_of
from catheter_sim.simulation.actuation import Actuation
from catheter_sim.simulation.friction import CapstanFriction

FRICTION_ROUTES = ("capstan", "nested", "none")
_REFERENCE = "reference_friction"  # a function that only some kinds' `laws.py` have


class LawList:
    """A robot's laws.

    Attributes:
        laws: all of them.
        friction: the last one, where tendons rub; else None.
        before, place, actuate, between: what they do at each point of a step (`core.law`).
    """

    def __init__(self, laws: tuple[Law, ...], friction: FrictionLaw | None) -> None:
        self.laws: tuple[Law | FrictionLaw, ...] = laws if friction is None else (*laws, friction)
        self.friction = friction
        self.before: tuple[Callable[[Step], None], ...] = self._acts("before")
        self.place: tuple[Callable[[mujoco.MjData], None], ...] = self._acts("place")
        self.actuate: tuple[Callable[[Step], None], ...] = self._acts("actuate")
        self.between: tuple[Callable[[Step], None], ...] = self._acts("between")

    def reset(self) -> None:
        """Forget the history."""
        for law in self.laws:
            law.reset()

    def _acts(self, name: str) -> tuple[Callable[[Any], None], ...]:
        """Return the methods of a name that do anything."""
        idle = getattr(Law, name)
        return tuple(getattr(law, name) for law in self.laws if getattr(type(law), name) is not idle)


def find_laws(robot: RobotSpec, place: RobotInModel, actuation: Actuation, friction: str) -> LawList:
    """Return the laws of a robot in a model; `friction` is one of `FRICTION_ROUTES`."""
    face = kind_of(robot).laws
    laws = face.laws(robot, place)
    if robot.friction.mu == 0 or friction == "none":
        return LawList(laws, None)
    if friction == "nested":
        return LawList(laws, getattr(face, _REFERENCE)(robot, place))
    paths = face.tendon_paths(robot, place)
    stiffness = actuation.pulls.drive_stiffness()
    return LawList(laws, CapstanFriction(robot.friction.mu, paths, place.model, stiffness))


def needs_reference_friction(robot: RobotSpec, friction: str) -> bool:
    """Return whether the robot's model must carry what the reference law of friction needs.

    Raises:
        InputError: `friction` is unknown, or the robot's kind has no reference law.
    """
    if friction not in FRICTION_ROUTES:
        raise unknown("friction route", friction, FRICTION_ROUTES)
    if friction != "nested" or robot.friction.mu == 0:
        return False
    kind = kind_of(robot)
    if not hasattr(kind.laws, _REFERENCE):
        having = " or ".join(name for name, other in KINDS.items() if hasattr(other.laws, _REFERENCE))
        raise InputError(
            f"{robot.name}: the nested reference of friction does not know robots of kind {kind.name!r}; "
            f"choices: a {having} robot"
        )
    return True
