"""Known-uncertain numbers of a specimen, calibrated before anything is called wrong.

A data set that has a table `[calibration]` names them itself (`calibration_numbers`). For the others,
the ranges are those of the project's nominal specification: every specimen of these robots may differ
by so much, and no cause is named for it. Any other robot brings no such ranges, so that nothing of it
is calibrated: what its file says is taken at its word.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from catheter_sim.effects.face import Parameter
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.checks import check_robot
from catheter_sim.robots.document import leaves, number_at, to_document, with_number
from catheter_sim.robots.kinds import Robot, require_continuum, with_segments
from catheter_sim.robots.posture import Array
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.specification import Friction

_SCALE = 0.125  # of a change that matters, of a number's range
_RANGE_PARTS = 20.0  # of a calibrated number's whole range


@dataclass(frozen=True)
class Nuisance:
    """One number of a specimen.

    Attributes:
        parameter: its name in reports, its specified value (`null`) and its range.
        change_robot: the specification with a value of it.
        spread: standard deviation known beforehand; inf: nothing is known but the range.
        superseded_by: effects that free the same number; with one of them this stays as specified.
        stands_for: effects that are not tried, since this number is free already.
        change_outputs: where the number acts on what is measured and not on the robot: the output columns'
            names, outputs (B, r, o) in file units and values (B,) to outputs; None elsewhere.
    """

    parameter: Parameter
    change_robot: Callable[[Robot, float], Robot]
    spread: float = math.inf
    superseded_by: tuple[str, ...] = ()
    stands_for: tuple[str, ...] = ()
    change_outputs: Callable[[tuple[str, ...], Array, Array], Array] | None = None

    @property
    def name(self) -> str:
        """The number's name."""
        return self.parameter.name


def _factor(
    name: str, half: float, change: Callable[[Robot, float], Robot], superseded_by: tuple[str, ...] = ()
) -> Nuisance:
    """Return a factor on a specified number, uniform in 1 -+ `half`."""
    parameter = Parameter(name, 1.0, 1.0 - half, 1.0 + half, scale=2.0 * half * _SCALE, start=1.0)
    return Nuisance(parameter, change, half / math.sqrt(3.0), superseded_by)


def _stiffness(robot: Robot, factor: float) -> Robot:
    return replace(robot, stiffness_scale=robot.stiffness_scale * factor)


def _friction(robot: Robot, factor: float) -> Robot:
    return replace(robot, friction=Friction(robot.friction.mu * factor))


def _arm(robot: Robot, factor: float) -> Robot:
    if isinstance(robot, RollingRobot):
        arms = ("larger_arm_m", "smaller_arm_m")
        return with_segments(
            robot, ({arm: getattr(item, arm) * factor for arm in arms} for item in robot.segments)
        )
    disked = require_continuum(robot, "the moment arm")
    tendons = tuple(replace(item, radius_m=item.radius_m * factor) for item in disked.tendons)
    return replace(disked, tendons=tendons)


def _scaled(key: str, robot: Robot, factor: float) -> Robot:
    changed: Robot = with_number(robot, key, number_at(robot, key) * factor)
    return changed


_ONE_SECTION = (
    _factor("elastic_constant", 0.03, _stiffness, ("stiffness",)),
    _factor("friction_coefficient", 0.20, _friction, ("tendon_friction",)),
    _factor("moment_arm", 0.01, _arm),
)
_TRANSSEPTAL = (
    _factor("arm_bending", 0.01, partial(_scaled, "segments.bending.arm_mm")),
    _factor("radius_torsion_proximal", 0.01, partial(_scaled, "segments.torsion_proximal.tendon_radius_mm")),
    _factor("radius_torsion_distal", 0.01, partial(_scaled, "segments.torsion_distal.tendon_radius_mm")),
)
_BY_ROBOT = dict.fromkeys(
    ("neuroendoscope_section", "neuroendoscope", "chest_tube_section", "chest_tube"), _ONE_SECTION
) | {"mitral_transseptal": _TRANSSEPTAL}
# Effects that say the same as a calibrated number, by the last word of its key.
_SAME_AS = {
    "mu": "tendon_friction",
    "stiffness_scale": "stiffness",
    "bending_stiffness_N_mm2": "stiffness",
    "stiffness_cubic_mm2": "nonlinear_stiffness",
    "rest_curvature_x_per_m": "precurvature",
    "rest_curvature_y_per_m": "precurvature",
    "tube_curvature_x_per_m": "precurvature",
    "tube_curvature_y_per_m": "precurvature",
    "rest_twist_deg_per_m": "twist",
    "axial_stiffness_N_per_mm": "axial_compression",
    "stiffness_N_per_mm": "tendon_elongation",
}


def nuisances_of(robot_reference: str) -> tuple[Nuisance, ...]:
    """Return the nuisance parameters of a robot by its id; none for a path."""
    return _BY_ROBOT.get(robot_reference.partition("@")[0], ())


def calibration_numbers(table: Any, robot: Robot, where: str) -> tuple[Nuisance, ...]:
    """Return the numbers that a data set wants calibrated.

    Args:
        table: dotted key of the robot's specification -> [lower, upper], in file units, nested or
            flat; the fit starts at the specified value. The upper end may be inf, and so may the
            specified value.
        robot: as specified.
        where: the table's file, for errors.

    Raises:
        InputError: a key that the robot does not have, a range that is none, or one whose ends are
            impossible for the robot.
    """
    if not isinstance(table, Mapping):
        raise InputError(f"{where}: calibration: a table is needed, not {table!r}")
    specified = dict(leaves(to_document(robot)))
    found = []
    for key, ends in _flat(table):
        place = f"{where}: calibration.{key}"
        if key not in specified:
            raise unknown("number", key, specified, f"{where}: calibration")
        if (
            not isinstance(ends, list)
            or len(ends) != 2
            or not all(isinstance(end, int | float) and not isinstance(end, bool) for end in ends)
            or not ends[0] < ends[1]
        ):
            raise InputError(f"{place}: [lower, upper] is needed, lower below upper, not {ends!r}")
        low, high, value = float(ends[0]), float(ends[1]), specified[key]
        if not low <= value <= high:
            raise InputError(f"{place}: the specified value, {value:g}, lies outside {low:g} to {high:g}")
        try:
            for end in (low, high):
                check_robot(with_number(robot, key, end), f"{place} = {end:g}")
        except KeyError:
            raise InputError(f"{place}: is a whole number, it cannot be calibrated") from None
        found.append(_calibrated(key, low, high, value, place))
    return tuple(found)


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values: in TOML, `friction.mu = ...` without quotes is a nested table."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _calibrated(key: str, low: float, high: float, value: float, place: str) -> Nuisance:
    inverse = math.isinf(high)
    if inverse and low <= 0.0:
        raise InputError(f"{place}: up to inf, the lower end must be above 0")
    width = 1.0 / low if inverse else high - low
    parameter = Parameter(key, value, low, high, scale=width / _RANGE_PARTS, start=value, inverse=inverse)
    same = tuple(effect for name, effect in _SAME_AS.items() if key.split(".")[-1] == name)
    return Nuisance(parameter, partial(_with_number, key), stands_for=same)


def _with_number(key: str, robot: Robot, number: float) -> Robot:
    changed: Robot = with_number(robot, key, number)
    return changed
