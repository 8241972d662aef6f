"""Claims about what the pieces of a catheter look like."""

from __future__ import annotations

from itertools import pairwise

import mujoco
import numpy as np
import pytest
from solid_points import winding_number

from catheter_sim.catalogue import load_robot
from catheter_sim.modelling.build import build_mjcf, robot_length, views
from catheter_sim.robots.catheter import picture
from catheter_sim.robots.catheter.description import ring_length_m
from catheter_sim.robots.catheter.picture import pieces
from catheter_sim.robots.catheter.spec import CatheterRobot

ROBOTS = ("mitral_transseptal", "mitral_4dof")


def catheter(name: str, *settings: str) -> CatheterRobot:
    robot = load_robot(name, settings)
    assert isinstance(robot, CatheterRobot)
    return robot


@pytest.mark.parametrize("name", ROBOTS)
def test_meshes_are_closed_and_each_is_shown(name: str) -> None:
    """Watertight, facing outward, and named by exactly the parts of the bodies."""
    robot = catheter(name)
    meshes = picture.meshes(robot)
    for key, mesh in meshes.items():
        assert mesh.is_watertight, key
        assert mesh.is_winding_consistent, key
        assert mesh.volume > 0.0, key
    shown = {part.mesh_key for index in range(len(pieces(robot)) + 1) for part in picture.parts(robot, index)}
    assert shown == set(meshes)


@pytest.mark.parametrize("name", ROBOTS)
def test_rings_are_as_long_as_specified_and_have_their_holes(name: str) -> None:
    """Length, outline, free lumen, and holes where tendons and wires pass."""
    robot = catheter(name)
    for segment in robot.segments:
        if segment.joint != "bending":
            continue
        mesh = picture.meshes(robot)[f"ring_{segment.name}"]
        assert mesh.bounds[:, 2] == pytest.approx((0.0, ring_length_m(segment)), abs=1e-9)
        assert np.abs(mesh.vertices[:, :2]).max() == pytest.approx(segment.outer_radius_m, abs=1e-9)
        arm, height = segment.arm_m, 0.4 * ring_length_m(segment)
        free = [(0, 0), (0.9 * robot.channel_radius_m, 0), (arm, 0), (-arm, 0), (0, arm), (0, -arm)]
        places = np.array([(*place, height) for place in [*free, (0.75 * arm, 0.75 * arm)]])
        assert winding_number(mesh, places) == pytest.approx([0.0] * len(free) + [1.0], abs=1e-6)


@pytest.mark.parametrize("name", ROBOTS)
def test_straight_robots_pieces_do_not_sink_into_one_another(name: str) -> None:
    """Along the axis, rings and modules follow one another with the specified gaps."""
    robot = catheter(name)
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    spans = []
    for k in range(model.ngeom):
        if not model.geom(k).name.startswith(("ring_", "module_")):
            continue
        mesh = model.geom_dataid[k]
        begin = model.mesh_vertadr[mesh]
        vertices = model.mesh_vert[begin : begin + model.mesh_vertnum[mesh]].astype(float)
        z = (vertices @ data.geom_xmat[k].reshape(3, 3).T + data.geom_xpos[k])[:, 2]
        spans.append((float(z.min()), float(z.max())))
    spans.sort()
    gaps = np.array([after[0] - before[1] for before, after in pairwise(spans)])
    assert (gaps > -1e-8).all()
    specified = {round(2e6 * segment.half_gap_m) for segment in robot.segments if segment.joint == "bending"}
    plate = round(1e6 * 0.12 * robot.segments[0].outer_radius_m)  # it ends a guide within its last gap
    allowed = {0} | specified | {gap - plate for gap in specified}
    assert {round(1e6 * gap) for gap in gaps} <= allowed
    assert sum(gap > 1e-6 for gap in gaps) >= sum(segment.rings for segment in robot.segments)


def test_tube_comes_out_of_the_guide_as_it_advances() -> None:
    """Between the guide's end and the module the drawn tube is as long as the advance."""
    model = mujoco.MjModel.from_xml_string(build_mjcf(catheter("mitral_transseptal")))
    data = mujoco.MjData(model)
    lengths = []
    for advance in (0.0, 0.035):
        data.qpos[model.joint("advance").qposadr[0]] = advance
        mujoco.mj_forward(model, data)
        lengths.append(float(data.tendon("tube_advance").length[0]))
        assert float(data.tendon("coupling_advance").length[0]) == pytest.approx(advance, abs=1e-9)
    assert lengths[1] - lengths[0] == pytest.approx(0.035, abs=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_views_hold_the_robot_with_its_tube_advanced(name: str) -> None:
    """The side view is higher than the advanced robot is long; the close-up shows the first rings."""
    robot = catheter(name)
    assert robot_length(robot) == pytest.approx(sum(part.length_m for part in robot.segments) + 0.06)
    named = {view.name: view for view in views(robot)}
    assert named["side"].height > robot_length(robot)
    first = next(part for part in robot.segments if part.joint == "bending")
    assert named["detail"].height == pytest.approx(6.0 * first.length_m / first.rings)


def test_robot_without_a_lumen_can_be_drawn() -> None:
    """Nothing of the meshes depends on a free channel."""
    robot = catheter("mitral_4dof", "channel_radius_mm=0")
    assert all(mesh.is_watertight for mesh in picture.meshes(robot).values())
    mujoco.MjModel.from_xml_string(build_mjcf(robot))
