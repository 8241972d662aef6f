"""Forms of another shape at rest, and of holes or cells that are turned about the axis."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec, with_segments
from catheter_sim.lab.engine import Acting, LabForm, Numbers, Scale, Shapes, of_cells, places_along, rebent
from catheter_sim.lab.forms.hysteresis import bends_joints
from catheter_sim.lab.specimen import Course, Specimen

_PERCENT = 0.01


def _unit_curvature(acting: Acting) -> float:
    """A hundredth of a radian over the whole length [1/m]."""
    return float(f"{0.01 / acting.specimen.length_m:.2g}")


def _axis(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    axes = "x" if specimen.planar and not _bends_in_y(specimen) else "xy"
    return {"axis": str(generator.choice(list(axes)))}


def _bends_in_y(specimen: Specimen) -> bool:
    return all(getattr(item, "bending_axes", "xy") == "xy" for item in specimen.bench.robot.segments)


def _curved(acting: Acting, robot: RobotSpec) -> RobotSpec:
    name = f"rest_curvature_{acting.numbers['axis']}_per_m"
    change = acting.size * _unit_curvature(acting)
    return with_segments(robot, [{name: getattr(item, name) + change} for item in robot.segments])


def _curvature(acting: Acting) -> Mapping[str, float]:
    return {f"curvature_{acting.numbers['axis']}_per_m": acting.size * _unit_curvature(acting)}


def _rest_joint(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    joints = [item.name for item in specimen.bench.robot.segments if getattr(item, "joint", "") == "bending"]
    return {"joint": str(generator.choice(joints))}


def _bent_at_rest(acting: Acting, robot: RobotSpec) -> RobotSpec:
    return with_segments(
        robot,
        [
            {"rest_rad": item.rest_rad + np.radians(acting.size)}
            if item.name == acting.numbers["joint"]
            else {}
            for item in robot.segments
        ],
    )


def _has_tube(specimen: Specimen) -> bool:
    return any(getattr(item, "stroke_m", 0.0) > 0.0 for item in specimen.bench.robot.segments)


def _tube_curved(acting: Acting, robot: RobotSpec) -> RobotSpec:
    name = f"tube_curvature_{acting.numbers['axis']}_per_m"
    change = acting.size * _unit_curvature(acting)
    return with_segments(
        robot,
        [
            {name: getattr(item, name) + change} if getattr(item, "stroke_m", 0.0) > 0.0 else {}
            for item in robot.segments
        ],
    )


def _rest_shape(profile: Callable[[Array], Array]) -> Callable[[Acting, Course, Shapes], Shapes]:
    """Return a rest shape that adds to every element's turn, by a profile over the robot's length."""

    def curved(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
        toward = np.array([0.0, 1.0, 0.0] if acting.numbers["axis"] == "x" else [-1.0, 0.0, 0.0])
        each = 0.01 * acting.size / acting.specimen.elements
        return rebent(shapes, lambda bends: bends + each * profile(places_along(acting)) * toward)

    return curved


def _twisted(acting: Acting, robot: RobotSpec) -> RobotSpec:
    change = np.radians(_twist_rate(acting)["rate_deg_per_m"])
    return with_segments(
        robot, [{"rest_twist_rad_per_m": item.rest_twist_rad_per_m + change} for item in robot.segments]
    )


def _twist_rate(acting: Acting) -> Mapping[str, float]:
    return {"rate_deg_per_m": acting.size * float(f"{1.0 / acting.specimen.length_m:.2g}")}


def _has_twist(specimen: Specimen) -> bool:
    return specimen.has("rest_twist_rad_per_m") and _bends_in_y(specimen)


def _turned_cells(along: Callable[[Array], Array]) -> Callable[[Acting, Course, Shapes], Shapes]:
    """Return cells that are each mounted turned about the axis, by `size` deg in all, spread by a profile."""

    def turned(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
        each = np.radians(acting.size) / acting.specimen.elements
        axis = np.array([0.0, 0.0, 1.0])
        return rebent(shapes, lambda bends: bends + each * along(places_along(acting)) * axis)

    return turned


def _wrung(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """Tension wrings the robot: it turns about its axis in proportion to all that pull."""
    pull = np.abs(course.commands[:, acting.specimen.pulls]).sum(axis=1) / acting.scale.pull
    each = np.radians(acting.size) / acting.specimen.elements * pull[:, np.newaxis, np.newaxis]
    return rebent(shapes, lambda bends: bends + each * np.array([0.0, 0.0, 1.0]))


def _in_space(specimen: Specimen) -> bool:
    return of_cells(specimen) and specimen.seen_axes == "xyz"


def _each_axis(specimen: Specimen, scale: Scale) -> Sequence[Numbers]:
    return [{"axis": axis} for axis in ("xy" if not specimen.planar or _bends_in_y(specimen) else "x")]


def _each_joint(specimen: Specimen, scale: Scale) -> Sequence[Numbers]:
    segments = specimen.bench.robot.segments
    return [{"joint": item.name} for item in segments if getattr(item, "joint", "") == "bending"]


def _s_shape(along: Array) -> Array:
    return np.asarray(2.0 * np.sin(2.0 * np.pi * along), dtype=np.float64)


def _tip_third(along: Array) -> Array:
    return np.asarray(3.0 * (along > 2.0 / 3.0), dtype=np.float64)


def _tip_half(along: Array) -> Array:
    return np.asarray(2.0 * (along > 0.5), dtype=np.float64)


_CURVED = LabForm(
    cause="precurvature",
    name="",
    law="",
    purpose="tune",
    applies=lambda specimen: specimen.has("rest_curvature_x_per_m"),
    draw=_axis,
    every=_each_axis,
    start=5.0,
    signed=True,
    most=150.0,
)
FORMS = (
    replace(
        _CURVED,
        name="curvature",
        law="moment EI (k - k0), all along",
        purpose="both",
        robot=_curved,
        parameters=_curvature,
    ),
    replace(
        _CURVED,
        name="joint",
        law="moment K (angle - rest) of a bending joint",
        purpose="both",
        applies=bends_joints,
        draw=_rest_joint,
        every=_each_joint,
        start=2.0,
        most=27.0,
        robot=_bent_at_rest,
        parameters=lambda acting: {f"{acting.numbers['joint']}_deg": acting.size},
    ),
    replace(
        _CURVED,
        name="tube",
        law="the tube that is pushed out is curved",
        purpose="both",
        applies=_has_tube,
        draw=lambda specimen, scale, generator: {"axis": str(generator.choice(["x", "y"]))},
        every=lambda specimen, scale: [{"axis": "x"}, {"axis": "y"}],
        robot=_tube_curved,
        parameters=_curvature,
    ),
    replace(
        _CURVED,
        name="growing",
        law="rest curvature 2 k0 z / L: straight at the base",
        applies=of_cells,
        shape=_rest_shape(lambda along: 2.0 * along),
    ),
    replace(
        _CURVED,
        name="tip_third",
        law="rest curvature 3 k0 in the last third alone",
        purpose="judge",
        applies=of_cells,
        shape=_rest_shape(_tip_third),
    ),
    replace(
        _CURVED,
        name="s_shape",
        law="rest curvature 2 k0 sin(2 pi z / L): an S",
        purpose="judge",
        applies=of_cells,
        shape=_rest_shape(_s_shape),
    ),
    LabForm(
        cause="twist",
        name="holes",
        law="the holes turn about the backbone at a constant rate",
        applies=_has_twist,
        start=5.0,
        signed=True,
        most=80.0,
        robot=_twisted,
        parameters=_twist_rate,
    ),
    LabForm(
        cause="twist",
        name="cells",
        law="every cell of a robot that bends in one plane is mounted turned about the axis, alike",
        applies=lambda specimen: _in_space(specimen) and not _has_twist(specimen),
        start=5.0,
        signed=True,
        most=80.0,
        shape=_turned_cells(lambda along: np.ones_like(along)),
        parameters=lambda acting: {"cells_rate_deg_per_m": acting.size / acting.specimen.length_m},
    ),
    LabForm(
        cause="twist",
        name="more_and_more",
        law="the cells are turned about the axis, more and more toward the tip",
        purpose="tune",
        applies=_in_space,
        start=5.0,
        signed=True,
        most=120.0,
        shape=_turned_cells(lambda along: 2.0 * along),
    ),
    LabForm(
        cause="twist",
        name="tip_half",
        law="only the cells of the tip's half are turned",
        purpose="judge",
        applies=_in_space,
        start=8.0,
        signed=True,
        most=160.0,
        shape=_turned_cells(_tip_half),
    ),
    LabForm(
        cause="twist",
        name="wrung",
        law="it turns about its axis in proportion to the tensions' sum",
        purpose="judge",
        applies=_in_space,
        start=6.0,
        signed=True,
        most=120.0,
        shape=_wrung,
        also=("coupling",),
    ),
)
