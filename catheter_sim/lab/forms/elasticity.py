"""Forms of another stiffness, and of an elastic law that is not linear."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec, with_segments
from catheter_sim.lab import memory
from catheter_sim.lab.engine import Acting, LabForm, Numbers, Scale, Shapes, of_cells, places_along, rebent
from catheter_sim.lab.specimen import Course, Specimen

_PERCENT = 0.01


def _pulled_cells(specimen: Specimen) -> bool:
    """Whether its shape follows from forces: by displacements alone a softer robot bends as a stiffer one."""
    return of_cells(specimen) and specimen.tensioned


def _scaled(acting: Acting, robot: RobotSpec) -> RobotSpec:
    return replace(robot, stiffness_scale=robot.stiffness_scale * (1.0 + _PERCENT * acting.size))


def _scale_found(acting: Acting) -> Mapping[str, float]:
    before = acting.specimen.robot.stiffness_scale / acting.specimen.bench.robot.stiffness_scale
    return {"scale": before * (1.0 + _PERCENT * acting.size)}


def _sections(specimen: Specimen) -> bool:
    return (
        _pulled_cells(specimen)
        and len(specimen.bench.robot.segments) > 1
        and specimen.has("bending_stiffness_N_m2")
    )


def _one_segment(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {"segment": int(generator.integers(len(specimen.bench.robot.segments)))}


def _section_scaled(acting: Acting, robot: RobotSpec) -> RobotSpec:
    changes: list[Mapping[str, float]] = [{} for _ in robot.segments]
    own = robot.segments[acting.numbers["segment"]].bending_stiffness_N_m2
    changes[acting.numbers["segment"]] = {"bending_stiffness_N_m2": own * (1.0 + _PERCENT * acting.size)}
    return with_segments(robot, changes)


def _section_found(acting: Acting) -> Mapping[str, float]:
    index = acting.numbers["segment"]
    own, specified = (
        robot.segments[index].bending_stiffness_N_m2
        for robot in (acting.specimen.robot, acting.specimen.bench.robot)
    )
    name = acting.specimen.bench.robot.segments[index].name
    return {f"scale_{name}": own / specified * (1.0 + _PERCENT * acting.size)}


def _tapered(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    softer = 1.0 + _PERCENT * acting.size * 2.0 * places_along(acting)
    return rebent(shapes, lambda bends: bends / softer)


def _aged(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """Each element softens by how far it has been bent (Mullins)."""

    def aged(bends: Array) -> Array:
        most = np.maximum.accumulate(np.linalg.norm(bends, axis=-1, keepdims=True), axis=0)
        return bends * (1.0 + _PERCENT * acting.size * most / acting.scale.bend_rad)

    return rebent(shapes, aged)


def _cubic(acting: Acting) -> float:
    """Moment EI (k + c k^3): at the largest bend of the specimen the moment changes by `size` percent."""
    return _PERCENT * acting.size / acting.scale.curvature_per_m**2


def _cubed(acting: Acting, robot: RobotSpec) -> RobotSpec:
    return with_segments(
        robot, [{"stiffness_cubic_m2": item.stiffness_cubic_m2 + _cubic(acting)} for item in robot.segments]
    )


def _has_cubic(specimen: Specimen) -> bool:
    return _pulled_cells(specimen) and specimen.has("stiffness_cubic_m2")


def _section_cubed(acting: Acting, robot: RobotSpec) -> RobotSpec:
    changes: list[Mapping[str, float]] = [{} for _ in robot.segments]
    changes[acting.numbers["segment"]] = {"stiffness_cubic_m2": _cubic(acting)}
    return with_segments(robot, changes)


def _quintic_m4(acting: Acting) -> float:
    """Moment EI (k + c k^5): at the largest bend of the specimen the moment changes by `size` percent."""
    return _PERCENT * acting.size / acting.scale.curvature_per_m**4


def _quintic(acting: Acting, robot: RobotSpec) -> RobotSpec:
    change = _quintic_m4(acting)
    return with_segments(
        robot, [{"stiffness_quintic_m4": item.stiffness_quintic_m4 + change} for item in robot.segments]
    )


def _yields(specimen: Specimen) -> bool:
    return _pulled_cells(specimen) and specimen.has("plastic_share") and not specimen.planar


def _where_it_yields(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {"share_of_bend": generator.uniform(0.1, 0.4)}


def _yielding(acting: Acting, robot: RobotSpec) -> RobotSpec:
    changes = {"plastic_share": _PERCENT * acting.size, "yield_curvature_per_m": _yield_per_m(acting)}
    return with_segments(robot, [changes] * len(robot.segments))


def _yield_per_m(acting: Acting) -> float:
    return float(acting.numbers["share_of_bend"] * acting.scale.curvature_per_m)


def _sliders(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """Three parts of each element's bend follow the whole with dead-bands of their own."""
    share = min(_PERCENT * acting.size, 1.0)
    widths = acting.scale.bend_rad * np.array([0.15, 0.4, 0.8])

    def late(bends: Array) -> Array:
        rows = bends.reshape(len(bends), -1)
        plays = sum(memory.play(rows, width) for width in widths) / len(widths)
        return ((1.0 - share) * rows + share * plays).reshape(bends.shape)

    return rebent(shapes, late)


def _plateau(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    knee = acting.numbers["knee"] * acting.scale.bend_rad

    def yielded(bends: Array) -> Array:
        size = np.linalg.norm(bends, axis=-1, keepdims=True)
        more = _PERCENT * acting.size * np.maximum(size - knee, 0.0)
        return bends * (1.0 + more / np.maximum(size, 1e-12))

    return rebent(shapes, yielded)


FORMS = (
    LabForm(
        cause="stiffness",
        name="scale",
        law="moment s EI k, all along",
        applies=_pulled_cells,
        start=6.0,
        signed=True,
        most=50.0,
        robot=_scaled,
        parameters=_scale_found,
    ),
    LabForm(
        cause="stiffness",
        name="taper",
        law="EI grows along the robot, 1 + 2 a z / L",
        purpose="tune",
        applies=_pulled_cells,
        start=8.0,
        most=100.0,
        shape=_tapered,
        also=("actuation_gain",),
    ),
    LabForm(
        cause="stiffness",
        name="section",
        law="s EI in one section only",
        applies=_sections,
        draw=_one_segment,
        every=lambda specimen, scale: [{"segment": k} for k in range(len(specimen.bench.robot.segments))],
        start=10.0,
        signed=True,
        most=60.0,
        robot=_section_scaled,
        also=("actuation_gain", "coupling"),
        parameters=_section_found,
    ),
    LabForm(
        cause="stiffness",
        name="aged",
        law="what has been bent is softer, by its largest bend so far (Mullins 1969)",
        purpose="judge",
        applies=_pulled_cells,
        start=8.0,
        most=60.0,
        shape=_aged,
        also=("actuation_gain", "drift", "nonlinear_stiffness"),
    ),
    LabForm(
        cause="nonlinear_stiffness",
        name="cubic",
        law="moment EI (k + c k^3), all along",
        applies=_has_cubic,
        start=12.0,
        most=300.0,
        robot=_cubed,
        parameters=lambda acting: {"cubic_mm2": 1e6 * _cubic(acting)},
    ),
    LabForm(
        cause="nonlinear_stiffness",
        name="plateau",
        law="beyond a bend an element gives way by more: the plateau of superelastic NiTi",
        purpose="tune",
        applies=_pulled_cells,
        draw=lambda specimen, scale, generator: {"knee": generator.uniform(0.3, 0.6)},
        start=15.0,
        most=150.0,
        shape=_plateau,
        also=("actuation_gain",),
    ),
    LabForm(
        cause="nonlinear_stiffness",
        name="yielding",
        law="beside EI k a part with a slider, h EI e, |e| <= e_y (Prandtl 1928)",
        applies=_yields,
        draw=_where_it_yields,
        every=lambda specimen, scale: [{"share_of_bend": 0.2}],
        start=15.0,
        most=200.0,
        robot=_yielding,
        parameters=lambda acting: {
            "plastic_share": _PERCENT * acting.size,
            "yield_per_m": _yield_per_m(acting),
        },
        also=("backlash", "tendon_friction"),
    ),
    LabForm(
        cause="nonlinear_stiffness",
        name="sliders",
        law="parts of every element's bend follow it through plays of their own (Iwan 1966)",
        purpose="judge",
        applies=_pulled_cells,
        start=10.0,
        most=100.0,
        shape=_sliders,
        also=("backlash", "tendon_friction"),
    ),
    LabForm(
        cause="nonlinear_stiffness",
        name="quintic",
        law="moment EI (k + c k^5), all along",
        applies=_has_cubic,
        start=15.0,
        most=200.0,
        robot=_quintic,
        parameters=lambda acting: {"quintic_mm4": 1e12 * _quintic_m4(acting)},
    ),
    LabForm(
        cause="nonlinear_stiffness",
        name="section",
        law="moment EI (k + c k^3) in one section only",
        purpose="judge",
        applies=lambda specimen: _has_cubic(specimen) and len(specimen.bench.robot.segments) > 1,
        draw=_one_segment,
        start=20.0,
        most=300.0,
        robot=_section_cubed,
        also=("stiffness", "actuation_gain", "coupling"),
    ),
)
