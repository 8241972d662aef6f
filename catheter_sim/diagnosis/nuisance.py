"""Known-uncertain numbers of a specimen, calibrated before anything is called wrong.

The ranges are those of the project's nominal specification: every specimen of these robots may
differ by so much, and no cause is named for it. A robot from a `.toml` brings no such ranges, so
that nothing of it is calibrated: what its file says is taken at its word.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from catheter_sim.robots.specification import ContinuumRobot, Friction


@dataclass(frozen=True)
class Nuisance:
    """One number of a specimen, as a factor on the specified one.

    Attributes:
        name: of the factor, in reports.
        half_range: the factor lies in 1 -+ this.
        change_robot: the specification with the factor in it.
        superseded_by: effects that free the same number; with one of them this factor is kept at 1.
    """

    name: str
    half_range: float
    change_robot: Callable[[ContinuumRobot, float], ContinuumRobot]
    superseded_by: tuple[str, ...]


def _stiffness(robot: ContinuumRobot, factor: float) -> ContinuumRobot:
    return replace(robot, stiffness_scale=robot.stiffness_scale * factor)


def _friction(robot: ContinuumRobot, factor: float) -> ContinuumRobot:
    return replace(robot, friction=Friction(robot.friction.mu * factor))


def _arm(robot: ContinuumRobot, factor: float) -> ContinuumRobot:
    tendons = tuple(replace(item, radius_m=item.radius_m * factor) for item in robot.tendons)
    return replace(robot, tendons=tendons)


_ONE_SECTION = (
    Nuisance("elastic_constant", 0.03, _stiffness, ("stiffness",)),
    Nuisance("friction_coefficient", 0.20, _friction, ("tendon_friction",)),
    Nuisance("moment_arm", 0.01, _arm, ()),
)
_BY_ROBOT = {"neuroendoscope_section": _ONE_SECTION, "neuroendoscope": _ONE_SECTION}


def nuisances_of(robot_reference: str) -> tuple[Nuisance, ...]:
    """Return the nuisance parameters of a robot by its id; none for a path."""
    return _BY_ROBOT.get(robot_reference.partition("@")[0], ())
