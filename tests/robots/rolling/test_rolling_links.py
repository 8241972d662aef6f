"""Drawn links of rolling-joint robots: the statics' profile, the specification's holes, rolling contact."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from solid_points import Array, surface, winding_number

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.errors import InputError
from catheter_sim.mjcf.parts import inline
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots import check_robot
from catheter_sim.robots.rolling import joint as geometry
from catheter_sim.robots.rolling import picture
from catheter_sim.robots.rolling.description import last_joint, rods, rolling_chain, rolling_joints
from catheter_sim.robots.rolling.spec import Rod, RollingRobot, RollingSegment
from catheter_sim.simulation.simulator import Simulator

pytestmark = pytest.mark.slow

ROBOTS = ("chest_tube_section", "chest_tube_section@prototype", "chest_tube")
STRIPS = 8  # of each arc


def rolling(name: str) -> RollingRobot:
    robot = load_robot(name)
    assert isinstance(robot, RollingRobot)
    return robot


def facet_error(robot: RollingRobot) -> float:
    """Return the largest height of an arc over one facet, of all joints [m]."""
    errors = []
    for joint in rolling_joints(robot):
        outer = joint.segment.outer_radius_m
        for radius, reach in (
            (joint.radius_positive_m, outer - joint.line_m),
            (joint.radius_negative_m, outer + joint.line_m),
        ):
            errors.append(radius * (1.0 - math.cos(math.asin(min(reach / radius, 1.0)) / (2.0 * STRIPS))))
    return max(errors)


def lowest(vertices: Array, axis: int, u: float) -> float:
    """Return the height of the lowest vertex in the plane u of the bending direction, NaN: none."""
    here = vertices[np.abs(vertices[:, axis] - u) < 2e-9]
    return float(here[:, 2].min()) if len(here) else math.nan


@pytest.mark.parametrize("name", ROBOTS)
def test_every_mesh_is_a_closed_solid_of_few_faces(name: str) -> None:
    """All meshes are watertight, wound outward, of positive volume, and small enough to write inline."""
    for key, mesh in picture.link_meshes(rolling(name)).items():
        assert mesh.is_watertight, key
        assert mesh.is_winding_consistent, key
        assert mesh.volume > 0, key
        assert len(mesh.faces) <= 1000, key


def test_like_links_share_their_meshes_and_every_mesh_is_used() -> None:
    """Two mirrored variants for the asymmetric segment, one for each plane of the others, and the base."""
    for name, count in (("chest_tube_section", 3), ("chest_tube", 6), ("chest_tube_section@prototype", 5)):
        robot = rolling(name)
        parts = [part for k in range(len(rolling_joints(robot)) + 1) for part in picture.link_parts(robot, k)]
        assert {part.mesh_key for part in parts} == set(picture.link_meshes(robot))
        assert len({part.mesh_key for part in parts}) == count


@pytest.mark.parametrize("name", ["chest_tube_section", "chest_tube"])
def test_lower_face_is_where_the_statics_have_the_contact(name: str) -> None:
    """The mesh's border of every strip lies at Eq. 17's contact for some bend; all else lies above it."""
    robot = rolling(name)
    solids = picture.link_meshes(robot)
    for joint in rolling_joints(robot):
        vertices = solids[picture.link_parts(robot, joint.index)[0].mesh_key].vertices
        outer = joint.segment.outer_radius_m
        for radius, sign in ((joint.radius_positive_m, 1.0), (joint.radius_negative_m, -1.0)):
            edge = math.asin(min((outer - sign * joint.line_m) / radius, 1.0))
            for theta in sign * edge * np.arange(STRIPS) / STRIPS:  # the last one ends in the outline
                x, z = geometry.contact_on_profile(theta, radius)
                assert lowest(vertices, joint.axis, joint.line_m + x) == pytest.approx(z, abs=5e-9)
        assert lowest(vertices, joint.axis, joint.line_m) == 0.0
        u = vertices[:, joint.axis] - joint.line_m
        radius = geometry.active_radius(u, joint.radius_positive_m, joint.radius_negative_m)
        height = geometry.mouth_height(u, radius)  # of a point at this offset on its arc
        assert (vertices[:, 2] > height - 5e-9).all()
        assert vertices[:, 2].max() == pytest.approx(joint.link_length_m, abs=1e-12)


def test_alternate_links_are_mirror_images() -> None:
    """Link 2's lower face at x is link 1's at -x."""
    robot = rolling("chest_tube_section")
    solids = picture.link_meshes(robot)
    first, second = (
        surface(solids[picture.link_parts(robot, k)[0].mesh_key]) * (sign, 1.0, 1.0)
        for k, sign in ((1, 1.0), (2, -1.0))
    )
    for u in first[first[:, 2] < 0.5e-3][::7, 0]:
        assert lowest(second, 0, u) == pytest.approx(lowest(first, 0, u), abs=1e-8)


def polygon(sections: int, radius: float) -> float:
    """Return the area of a regular polygon in a circle."""
    return 0.5 * sections * radius**2 * math.sin(2.0 * math.pi / sections)


@pytest.mark.parametrize("name", ["chest_tube_section", "chest_tube"])
def test_volume_is_that_between_profile_and_flat(name: str) -> None:
    """Outline less lumen and bores, times their length: between circles for polygons and the reverse."""
    robot = rolling(name)
    solids = picture.link_meshes(robot)
    for joint in rolling_joints(robot):
        outer = joint.segment.outer_radius_m
        u = np.linspace(-outer, outer, 2001)
        chord = 2.0 * np.sqrt(outer**2 - u**2)
        length = joint.link_length_m - np.average(picture.arc_height(joint, u), weights=chord)
        passing = [rod for rod in rods(robot) if last_joint(robot, rod) >= joint.index]
        bore, lumen = passing[0].rod_radius_m + robot.clearance_m, robot.channel_radius_m
        sunk = sum(2.0 * rod.countersink_m for rod in passing) * 1.6 * math.pi * bore**2
        least = (polygon(32, outer) - math.pi * (lumen**2 + len(passing) * bore**2)) * length - sunk
        most = (math.pi * outer**2 - polygon(16, lumen) - len(passing) * polygon(8, 0.97 * bore)) * length
        volume = solids[picture.link_parts(robot, joint.index)[0].mesh_key].volume
        assert 0.995 * least < volume < 1.005 * most
        assert most < 1.25 * least


@pytest.mark.parametrize("name", ["chest_tube_section", "chest_tube"])
def test_holes_are_free_between_the_models_mouths_and_solid_beside(name: str) -> None:
    """Rod and clearance wide (up to 3 % less where rods run side by side), from mouth to mouth."""
    robot = rolling(name)
    chain = rolling_chain(robot)
    solids = picture.link_meshes(robot)
    angle = np.linspace(0.1, 2.0 * math.pi, 9)
    for joint in {(item.segment.name, item.axis): item for item in rolling_joints(robot)}.values():
        solid = solids[picture.link_parts(robot, joint.index)[0].mesh_key]
        k = joint.index - 1
        for index, rod in enumerate(rods(robot)):
            if last_joint(robot, rod) < joint.index:
                continue
            radius = rod.rod_radius_m + robot.clearance_m
            x, y = chain.position[index, k]
            z_from, z_to = chain.mouth[index, k], joint.link_length_m - rod.countersink_m
            for share, expected in ((0.88, 0.0), (1.02, 1.0)):
                around = [
                    np.stack([x + share * radius * np.cos(angle), y + share * radius * np.sin(angle)], axis=1)
                ] * 3
                heights = np.repeat(np.linspace(z_from, z_to, 5)[1:-1], len(angle))
                points = np.column_stack([np.concatenate(around), heights])
                assert winding_number(solid, points) == pytest.approx(expected, abs=1e-6), rod.name


def test_countersunk_holes_widen_toward_both_faces() -> None:
    """At the tip of the full robot the mouths are wider than the holes, and end at the mouths' depth."""
    robot = rolling("chest_tube")
    segment = robot.segments[-1]
    for hole in picture.holes(robot, segment):
        assert hole.face_radius > 1.1 * hole.radius
        assert hole.countersink == robot.tendons[-1].countersink_m
        assert math.hypot(*hole.place) - hole.face_radius > robot.channel_radius_m
        assert math.hypot(*hole.place) + hole.face_radius < segment.outer_radius_m
        joint = next(item for item in rolling_joints(robot) if item.segment == segment)
        solid = picture.link_meshes(robot)[picture.link_parts(robot, joint.index)[0].mesh_key]
        (x, y), top = hole.place, joint.link_length_m
        bottom = float(picture.arc_height(joint, np.array(hole.place[joint.axis])))
        beside = 0.5 * (hole.radius + 0.9 * hole.face_radius)
        for depth, expected in ((0.1, 0.0), (1.1, 1.0)):
            for z in (bottom + depth * hole.countersink, top - depth * hole.countersink):
                angle = np.linspace(0.1, 2.0 * math.pi, 9)
                around = np.column_stack([x + beside * np.cos(angle), y + beside * np.sin(angle)])
                points = np.column_stack([around, np.full(9, z)])
                assert winding_number(solid, points) == pytest.approx(expected, abs=1e-6)
    plain = rolling("chest_tube_section")
    for hole in picture.holes(plain, plain.segments[0]):
        assert hole.face_radius == hole.radius


def test_lumen_is_free_from_the_base_to_the_tip() -> None:
    """No mesh reaches into the channel."""
    robot = rolling("chest_tube")
    for key, mesh in picture.link_meshes(robot).items():
        nearest = np.hypot(surface(mesh)[:, 0], surface(mesh)[:, 1]).min()
        assert nearest > robot.channel_radius_m * math.cos(math.pi / 16) - 1e-9, key


def drawn_vertices(simulator: Simulator, geom: str) -> Array:
    """Return where the vertices of a drawn geom are in the base frame, shape (n, 3) [m]."""
    model, data = simulator.model, simulator.data
    index = model.geom(geom).id
    mesh = model.geom_dataid[index]
    begin, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    vertices = model.mesh_vert[begin : begin + count].astype(float)
    return vertices @ data.geom_xmat[index].reshape(3, 3).T + data.geom_xpos[index]


@pytest.mark.parametrize(
    ("name", "tensions", "force"),
    [
        ("chest_tube_section", {"active": 50.0}, (0.0, 0.0, 0.0)),
        ("chest_tube_section", {"active": 5.0}, (-0.3, 0.0, 0.0)),
        ("chest_tube", {"base_left": 30.0, "middle_right": 15.0, "tip_front": 12.0}, (0.0, 0.0, 0.0)),
        ("chest_tube", {"base_right": 20.0, "tip_left": 15.0, "tip_back": 12.0}, (0.1, 0.1, 0.0)),
    ],
)
def test_drawn_links_roll_on_the_flats_below(
    name: str, tensions: dict[str, float], force: tuple[float, float, float]
) -> None:
    """Bent by the simulation, each link touches the flat below, to the facets' error, and cuts nothing."""
    robot = rolling(name)
    simulator = Simulator(robot, inertia=False)
    simulator.set_inputs(np.array([tensions.get(rod.name, 0.0) for rod in robot.tendons]), force_tip=force)
    simulator.settle()
    posture = simulator.posture()
    assert np.abs(posture.joint_angles).max() > 0.15
    flats = [(np.zeros(3), np.array([0.0, 0.0, 1.0]))]
    flats += list(zip(posture.p_w, posture.R_w[:, :, 2], strict=True))
    for k, (point, normal) in enumerate(flats[:-1], start=1):
        gap = (drawn_vertices(simulator, f"link_{k}") - point) @ normal
        assert -1e-8 < gap.min() < facet_error(robot) + 1e-8
        assert (
            np.abs((drawn_vertices(simulator, f"link_{k}") - posture.p_w[k - 1]) @ flats[k][1]).min() < 1e-8
        )
    below = drawn_vertices(simulator, "base_0")
    assert below[:, 2].max() == pytest.approx(0.0, abs=1e-8)
    assert facet_error(robot) < 10e-6


def test_a_robot_written_twice_is_the_same_text() -> None:
    """Meshes depend on the specification alone."""
    first, second = (build_mjcf(load_robot("chest_tube")) for _ in range(2))
    assert first == second


@pytest.mark.parametrize("name", ROBOTS)
def test_mujoco_keeps_the_meshes_in_place(name: str) -> None:
    """In the straight model every drawn vertex is where its mesh and link have it."""
    robot = rolling(name)
    simulator = Simulator(robot)
    solids = picture.link_meshes(robot)
    height = [0.0, *(joint.face_z_m - joint.link_length_m for joint in rolling_joints(robot))]
    for k, z in enumerate(height):
        for part in picture.link_parts(robot, k):
            vertices = drawn_vertices(simulator, f"{part.name_prefix}_{k}")
            # MuJoCo reorders nothing that is not repeated; it keeps single precision.
            assert np.abs(vertices - solids[part.mesh_key].vertices - (0.0, 0.0, z)).max() < 3e-8


@given(
    link_mm=st.floats(2.0, 30.0),
    outer_mm=st.floats(1.0, 8.0),
    arms=st.tuples(st.floats(0.05, 0.95), st.floats(0.05, 0.95)),
    radii=st.tuples(st.floats(1.01, 4.0), st.floats(1.01, 4.0)),
    channel=st.floats(0.0, 0.9),
    clearance=st.floats(0.0, 0.3),
    laterals=st.lists(st.floats(-0.7, 0.7), min_size=1, max_size=5),
    sides=st.sampled_from(("+x", "-x", "+y", "-y")),
    countersink=st.floats(0.0, 0.49),
    axes=st.sampled_from(("x", "xy")),
    soft=st.booleans(),
)
@settings(max_examples=40, deadline=None)
def test_any_rolling_robot_that_passes_the_checks_can_be_drawn(
    link_mm: float,
    outer_mm: float,
    arms: tuple[float, float],
    radii: tuple[float, float],
    channel: float,
    clearance: float,
    laterals: list[float],
    sides: str,
    countersink: float,
    axes: str,
    soft: bool,
) -> None:
    """Whatever its profile, holes and lumen, a valid robot has closed meshes."""
    outer = outer_mm * 1e-3
    larger, smaller = (arm * 2.0 * outer for arm in (max(arms), min(arms)))
    segment = RollingSegment(
        name="only",
        length_m=3 * link_mm * 1e-3,
        joints=3,
        outer_radius_m=outer,
        mass_kg=1e-3,
        centre_of_mass_depth_m=0.0,
        larger_radius_m=larger * radii[0],
        smaller_radius_m=smaller * radii[1],
        larger_arm_m=larger,
        smaller_arm_m=smaller,
        bending_axes=axes,
        link_modulus_Pa=1e9 if soft else math.inf,
    )
    robot = RollingRobot(
        name="any",
        description="",
        segments=(segment,),
        tendons=tuple(
            Rod(
                f"r{k}",
                sides,
                "only",
                0.02 * outer,
                1e-5,
                lateral_m=lateral * outer,
                countersink_m=countersink * link_mm * 1e-3,
            )
            for k, lateral in enumerate(laterals)
        ),
        friction=Friction(0.0),
        clearance_m=clearance * outer,
        channel_radius_m=channel * outer,
    )
    try:
        check_robot(robot, "any")
    except InputError:
        assume(False)
    for key, mesh in picture.link_meshes(robot).items():
        assert mesh.is_watertight, key
        assert mesh.volume > 0, key


def test_segment_names_cannot_collide_with_the_base() -> None:
    """A segment called `base` keeps meshes of its own."""
    robot = rolling("chest_tube_section")
    renamed = replace(
        robot,
        segments=(replace(robot.segments[0], name="base"),),
        tendons=tuple(replace(rod, ends_at="base") for rod in robot.tendons),
        passive_rods=tuple(replace(rod, ends_at="base") for rod in robot.passive_rods),
    )
    assert len(picture.link_meshes(renamed)) == len(picture.link_meshes(robot))
    first = {inline(mesh) for mesh in picture.link_meshes(renamed).values()}
    assert first == {inline(mesh) for mesh in picture.link_meshes(robot).values()}
