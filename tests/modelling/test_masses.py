"""Claims about where a robot's mass is: what is described by length and mass is spread along its length."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots.continuum.description import pieces
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment

ROD = Segment("one", 0.4, 7, 5e-3, 0.03, 0.04)
THIN = Segment("two", 0.1, 4, 2e-3, 0.01, 0.003)


def masses(robot: ContinuumRobot) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre (3,) and second moments about the origin (3, 3) of the compiled, unbent robot."""
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot, motion=True))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mass, centre = model.body_mass[1:], data.xipos[1:]
    inertia = np.zeros((3, 3))
    for m, r, body in zip(mass, centre, range(1, model.nbody), strict=True):
        R = data.ximat[body].reshape(3, 3)
        inertia += R @ np.diag(model.body_inertia[body]) @ R.T + m * (r @ r * np.eye(3) - np.outer(r, r))
    return mass.sum(), mass @ centre / mass.sum(), inertia


@pytest.mark.parametrize("links", [1, 3])
@pytest.mark.parametrize("hinges", ["even", "rod"])
@pytest.mark.parametrize("segments", [(ROD,), (ROD, THIN)], ids=["one", "two"])
def test_chain_has_mass_centre_and_moments_of_the_continuous_body(
    links: int, hinges: str, segments: tuple[Segment, ...]
) -> None:
    """Those of solid cylinders end to end, to 1e-9: for the second moments, too, nothing is lumped."""
    robot = ContinuumRobot(
        name="rod",
        description="",
        segments=segments,
        friction=Friction(0.0),
        links_per_subsegment=links,
        hinges=hinges,
    )
    mass, centre, inertia = masses(robot)
    expected, first, across, along, z = 0.0, 0.0, 0.0, 0.0, 0.0
    for part in segments:
        top = z + part.length_m
        line = part.mass_kg / part.length_m
        expected += part.mass_kg
        first += line * (top**2 - z**2) / 2.0
        across += line * (top**3 - z**3) / 3.0 + part.mass_kg * part.outer_radius_m**2 / 4.0
        along += part.mass_kg * part.outer_radius_m**2 / 2.0
        z = top
    assert mass == pytest.approx(expected, rel=1e-9)
    assert centre == pytest.approx([0.0, 0.0, first / expected], rel=1e-9, abs=1e-12)
    assert np.diag(inertia) == pytest.approx([across, across, along], rel=1e-8)


def test_masses_that_are_stated_at_faces_stay_there() -> None:
    """The neuroendoscope's cells weigh 15 mg at their distal faces, half a cell beyond a uniform body's."""
    robot = load_robot("neuroendoscope_section")
    mass, centre, _ = masses(robot)
    assert mass == pytest.approx(0.45e-3, rel=1e-9)
    assert centre == pytest.approx([0.0, 0.0, 0.031], rel=1e-9, abs=1e-12)
    assert pieces(robot)[0].mass_kg == 0.0


def test_a_catheters_segments_have_their_masses_in_their_middles() -> None:
    """Rings lie evenly about a bending segment's middle, modules about their own; gaps weigh nothing."""
    names = ("torsion_proximal", "bending", "torsion_distal")
    robot = load_robot(
        "mitral_transseptal", [f"segments.{name}.mass_g={k + 2}" for k, name in enumerate(names)]
    )
    mass, centre, _ = masses(robot)
    expected, first, z = 0.0, 0.0, 0.0
    for segment in robot.segments:
        expected += segment.mass_kg
        first += segment.mass_kg * (z + 0.5 * segment.length_m)
        z += segment.length_m
    assert mass == pytest.approx(expected, rel=1e-4)  # what weighs nothing has 1e-9 kg
    assert centre[2] == pytest.approx(first / expected, rel=1e-4)


def test_a_notched_tubes_mass_is_in_its_uncut_pieces() -> None:
    """Total and centre of the pieces between the notches, to 1e-9."""
    robot = load_robot("notched_wrist")
    (segment,) = robot.segments
    mass, centre, _ = masses(robot)
    pitch = segment.notch_height_m + segment.spacing_m
    low = np.arange(segment.notches) * pitch + segment.notch_height_m
    uncut = np.full(segment.notches, segment.spacing_m)
    uncut[-1] = robot.tip_length_m
    assert mass == pytest.approx(segment.mass_kg, rel=1e-9)
    assert centre[2] == pytest.approx((low + 0.5 * uncut).mean(), rel=1e-6)
