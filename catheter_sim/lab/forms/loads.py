"""Forms of a load that nobody has noted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.lab.engine import Acting, LabForm, Numbers, Scale, Shapes
from catheter_sim.lab.specimen import Course, Specimen

_EARTH_MPS2 = 9.81


def _loadable(specimen: Specimen) -> bool:
    """Whether a load is drawn; not on a robot of joints: no diagnosis tries one there."""
    return not specimen.jointed


def _softness(acting: Acting) -> float:
    """Return a hundredth of the force across the tip that bends it by about what it is seen to bend [N].

    A largest sum of tensions T at the arm r bends as F L / 2: F = 2 T r / L. Displacements are taken at
    100 N/mm. The arm is that of the outermost hole, or the robot's radius.
    """
    specimen = acting.specimen
    robot = specimen.bench.robot
    arms = [getattr(tendon, "radius_m", 0.0) for tendon in robot.tendons]
    arm = max(arms) or min(segment.outer_radius_m for segment in robot.segments)
    pull = acting.scale.pull if specimen.tensioned else float(specimen.reach.max()) * 1e4
    return float(f"{0.01 * 2.0 * pull * arm / specimen.length_m:.2g}")


def _toward(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    """Draw an axis in which the robot gives way."""
    axes = specimen.bench.trials.axes.replace("z", "")
    return {"axis": str(generator.choice(list(axes)))}


def _unit(axis: str) -> Array:
    return np.array([1.0 if axis == letter else 0.0 for letter in "xyz"])


def _mass_kg(acting: Acting) -> float:
    return acting.size * _softness(acting) / _EARTH_MPS2


def _unstated(specimen: Specimen) -> bool:
    mass = sum(segment.mass_kg for segment in specimen.bench.robot.segments)
    return _loadable(specimen) and not specimen.weighs and mass > 0.0


def _pushed(acting: Acting, course: Course) -> tuple[int, Array]:
    place = max(1, round(acting.numbers["height"] * acting.specimen.elements))
    force = 1.5 * acting.size * _softness(acting) * _unit(acting.numbers["axis"])
    return place, np.tile(force, (len(course), 1))


def _height(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {**_toward(specimen, scale, generator), "height": generator.uniform(0.4, 0.7)}


def _tethered(acting: Acting, shapes: Shapes) -> Array:
    """A cable, a spring, pulls the tip back to where it is at rest; as if it did not move the tip."""
    stiffness = acting.size * _softness(acting) / acting.scale.tip_m
    tip = shapes.p[:, -1]
    rest = np.array([0.0, 0.0, acting.specimen.length_m])
    return -stiffness * (tip - rest)


FORMS = (
    LabForm(
        cause="payload",
        name="force",
        law="a constant force on the tip, base frame",
        applies=_loadable,
        draw=_toward,
        every=lambda specimen, scale: [{"axis": axis} for axis in specimen.bench.trials.axes],
        start=2.0,
        signed=True,
        most=100.0,
        tip_force=lambda acting: np.asarray(acting.size * _softness(acting) * _unit(acting.numbers["axis"])),
        parameters=lambda acting: {f"force_{acting.numbers['axis']}_N": acting.size * _softness(acting)},
    ),
    LabForm(
        cause="payload",
        name="mass",
        law="a mass on the tip, where weight acts: it turns with nothing but gravity",
        applies=lambda specimen: _loadable(specimen) and specimen.weighs,
        start=2.0,
        most=100.0,
        robot=lambda acting, robot: replace(robot, tip_mass_kg=robot.tip_mass_kg + _mass_kg(acting)),
        parameters=lambda acting: {"mass_g": 1e3 * _mass_kg(acting)},
    ),
    LabForm(
        cause="payload",
        name="unstated_weight",
        law="the robot's own weight, where the data set says that none acts",
        purpose="tune",
        applies=_unstated,
        draw=_toward,
        start=3.0,
        signed=True,
        most=10.0,
        gravity=lambda acting: acting.size * 0.1 * _EARTH_MPS2 * _unit(acting.numbers["axis"]),
    ),
    LabForm(
        cause="payload",
        name="body_force",
        law="a constant force halfway along the robot",
        purpose="judge",
        applies=_loadable,
        draw=_height,
        start=3.0,
        signed=True,
        most=100.0,
        body_force=_pushed,
        also=("precurvature",),
    ),
    LabForm(
        cause="payload",
        name="tether",
        law="a cable pulls the tip back toward its place at rest, as a spring",
        purpose="judge",
        applies=_loadable,
        start=5.0,
        most=60.0,
        tether=_tethered,
        also=("stiffness", "actuation_gain"),
    ),
)
