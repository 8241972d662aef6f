"""Claims about the MJCF of exposed tubes that bend, and of bending joints whose rest is bent."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots.catheter.model import tube_joint_names
from catheter_sim.robots.catheter.spec import CatheterRobot
from reference.catheter import tube_end

ROBOTS = ("mitral_transseptal", "mitral_4dof")


def catheter(name: str, *settings: str) -> CatheterRobot:
    robot = load_robot(name, settings)
    assert isinstance(robot, CatheterRobot)
    return robot


def compiled(robot: CatheterRobot) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(build_mjcf(robot))


def springs_of(model: mujoco.MjModel) -> list[str]:
    names = [model.tendon(k).name for k in range(model.ntendon)]
    return [name for name in names if name.startswith(("bend_", "skew_"))]


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_only_a_tube_that_bends_has_hinges(name: str) -> None:
    """Rigid and straight: no springs, no hinges. Elastic or curved: five hinges and four springs more."""
    plain = compiled(catheter(name))
    assert not springs_of(plain)
    for key, value in (("tube_stiffness_N_mm2", 80), ("tube_curvature_y_per_m", -4)):
        robot = catheter(name, f"segments.advance.{key}={value}")
        model = compiled(robot)
        assert model.nv == plain.nv + 5
        assert springs_of(model) == [f"{kind}_advance_{axis}" for axis in "xy" for kind in ("bend", "skew")]
        tube = next(part for part in robot.segments if part.name == "advance")
        joints = [model.joint(item) for item in tube_joint_names(tube)]
        # in the kinematic order: the guide's end, the slide, the module
        slide = model.joint("advance").id
        assert [joint.id for joint in joints] == [slide - 2, slide - 1, slide + 1, slide + 2, slide + 3]


@pytest.mark.parametrize("name", ROBOTS)
def test_springs_are_the_beams_stiffness_at_half_the_stroke(name: str) -> None:
    """Against turns of its ends from the chord: EI / s [[4, -2], [-2, 4]] in either plane, none across."""
    model = compiled(catheter(name, "segments.advance.tube_stiffness_N_mm2=80", "stiffness_scale=1.25"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rows = np.zeros((model.ntendon, model.nv))
    for k in range(model.ntendon):
        start, count = model.ten_J_rowadr[k], model.ten_J_rownnz[k]
        rows[k, model.ten_J_colind[start : start + count]] = data.ten_J.ravel()[start : start + count]
    matrix = rows.T @ (model.tendon_stiffness[:, np.newaxis] * rows)
    ends = [(f"exit_advance_{axis}", f"inlet_advance_{axis}") for axis in "xy"]
    x, y = ([int(model.joint(item).dofadr[0]) for item in pair] for pair in ends)
    beam = 1.25 * 80e-6 / 0.03 * np.array([[4.0, -2.0], [-2.0, 4.0]])
    assert matrix[np.ix_(x, x)] == pytest.approx(beam, rel=1e-7)
    assert matrix[np.ix_(y, y)] == pytest.approx(beam, rel=1e-7)
    assert not matrix[np.ix_(x, y)].any()


@pytest.mark.parametrize("name", ROBOTS)
def test_hinges_of_an_arc_place_the_module_exactly(name: str) -> None:
    """Half of the bend at either end and the chord between them are the arc, in any plane, without twist."""
    robot = catheter(
        name, *(f"segments.advance.tube_curvature_{a}_per_m={k}" for a, k in (("x", 19), ("y", 31)))
    )
    model = compiled(robot)
    data = mujoco.MjData(model)
    tube = next(part for part in robot.segments if part.name == "advance")
    place, R = tube_end(tube, 0.05)
    chord = place / np.linalg.norm(place)
    toward_x, toward_y = math.atan2(chord[0], chord[2]), math.asin(chord[1])
    for end in ("exit", "inlet"):
        data.joint(f"{end}_advance_x").qpos = toward_x
        data.joint(f"{end}_advance_y").qpos = toward_y
    data.joint("advance").qpos = np.linalg.norm(place)
    mujoco.mj_forward(model, data)
    guide = data.site("exit_advance").xpos
    assert data.site("inlet_advance").xpos - guide == pytest.approx(place, abs=1e-9)
    assert data.site("tip").xmat.reshape(3, 3) == pytest.approx(R, abs=1e-9)


def test_file_alone_bends_its_tube_in_plain_mujoco() -> None:
    """Advanced by 40 mm, a tube of 15 / m has turned its module by 0.6 rad; only the slide is a chord."""
    robot = catheter("mitral_4dof", "segments.advance.tube_curvature_x_per_m=15")
    model = compiled(robot)
    data = mujoco.MjData(model)
    for step in range(800):
        data.actuator("tendon_advance").ctrl = 0.04 * min(1.0, step / 200)
        mujoco.mj_step(model, data)
    axis = data.site("tip").xmat.reshape(3, 3)[:, 2]
    assert math.atan2(axis[0], axis[2]) == pytest.approx(0.6, abs=1e-3)
    assert float(data.joint("advance").qpos[0]) == pytest.approx(0.04, abs=1e-6)


@pytest.mark.parametrize(
    ("name", "segment"), [("mitral_transseptal", "bending"), ("mitral_4dof", "bending_distal")]
)
def test_tendons_are_just_taut_at_the_rest_bend(name: str, segment: str) -> None:
    """At the model's rest shape the gaps share the rest bend, and no spring and no tendon pulls."""
    model = compiled(catheter(name, f"segments.{segment}.rest_deg=14"))
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos_spring
    mujoco.mj_forward(model, data)
    gaps = [model.joint(k).name for k in range(model.njnt) if model.joint(k).name.startswith(f"{segment}_")]
    bends = [float(data.joint(item).qpos[0]) for item in gaps]
    assert np.degrees(bends) == pytest.approx(np.full(len(gaps), 14.0 / len(gaps)), abs=1e-6)
    assert np.abs(data.qfrc_passive).max() < 1e-12
    # tendons of 1.7e7 N/m, and a file of nine digits
    assert np.abs(data.actuator_force).max() < 1e-2
