"""The drawn robot: closed meshes, at the right places, that show the specification's geometry."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from solid_points import surface, winding_number

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.mjcf.parts import inline
from catheter_sim.robots import check_robot
from catheter_sim.robots.continuum import description, picture
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

ROBOTS = ("neuroendoscope", "neuroendoscope_section", "spacer_disk")


def turned_about_hinge(mesh: trimesh.Trimesh, angle_rad: float, raised: float = 0.0) -> trimesh.Trimesh:
    """Return `mesh` turned about the hinge (the y axis), moved along its own z first."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return trimesh.Trimesh(
        (mesh.vertices + np.array((0.0, 0.0, raised))) @ rotation.T, mesh.faces, process=False
    )


def shape_of(name: str, segment: int = 0) -> picture.CellShape:
    return picture.cell_shape(load_robot(name), segment)


@pytest.mark.parametrize("name", ROBOTS)
def test_every_mesh_is_a_closed_solid_of_few_faces(name: str) -> None:
    """All meshes are watertight, wound outward, of positive volume, and small enough to write inline."""
    for key, mesh in picture.element_meshes(load_robot(name)).items():
        assert mesh.is_watertight, key
        assert mesh.is_winding_consistent, key
        assert mesh.volume > 0, key
        assert len(mesh.faces) <= 700, key


@pytest.mark.parametrize("name", ROBOTS)
def test_every_part_names_a_mesh_and_every_mesh_is_used(name: str) -> None:
    """Links from the base to the tip show exactly the meshes that are written."""
    robot = load_robot(name)
    links = sum(picture.links_of(robot, segment) for segment in robot.segments)
    parts = [part for link in range(links + 1) for part in picture.element_parts(robot, link)]
    assert {part.mesh_key for part in parts} == set(picture.element_meshes(robot))
    with pytest.raises(IndexError):
        picture.element_parts(robot, links + 1)


def test_segment_names_cannot_collide_with_the_ends() -> None:
    """A segment called `tip` or `base` keeps a mesh of its own."""
    robot = load_robot("neuroendoscope")
    renamed = replace(
        robot,
        segments=tuple(
            replace(item, name=name) for item, name in zip(robot.segments, ("base", "tip"), strict=True)
        ),
        tendons=tuple(
            replace(item, ends_at={"proximal": "base", "distal": "tip"}[item.ends_at])
            for item in robot.tendons
        ),
    )
    assert len(picture.element_meshes(renamed)) == len(picture.element_meshes(robot))


def test_eyelets_are_free_at_the_tendons_and_nowhere_else() -> None:
    """A guide is open along each tendon, and solid just beside the hole."""
    robot = load_robot("neuroendoscope")
    for index, count in ((0, 6), (1, 2)):
        shape = picture.cell_shape(robot, index)
        guide = picture.wire_guide(shape, shape)
        names = [item.name for item in robot.segments]
        expected = [
            (item.radius_m * math.cos(item.angle_rad), item.radius_m * math.sin(item.angle_rad))
            for item in robot.tendons
            if names.index(item.ends_at) >= index
        ]
        assert len(expected) == count
        z = np.linspace(-0.1, 1.1, 13) * shape.length
        for x, y in expected:
            along = np.column_stack([np.full(13, x), np.full(13, y), z])
            assert np.abs(winding_number(guide, along)).max() < 1e-6
            radial = np.array([x, y]) / math.hypot(x, y)
            # Inward and outward of the hole, within the ring.
            for offset in (-1.3, 1.3):
                beside = np.append([x, y] + radial * offset * shape.eyelet_radius, shape.length / 2.0)
                assert winding_number(guide, beside[np.newaxis])[0] == pytest.approx(1.0, abs=1e-6)


def test_tool_channel_is_free_from_base_to_tip() -> None:
    """No part reaches into the channel of the printed 1.4 mm diameter (Kato 2016)."""
    robot = load_robot("neuroendoscope")
    assert robot.channel_radius_m == pytest.approx(0.7e-3)
    for key, mesh in picture.element_meshes(robot).items():
        # The channel's outline is a polygon inside of the circle: its edges' middles come nearest.
        nearest = np.hypot(surface(mesh)[:, 0], surface(mesh)[:, 1]).min()
        assert nearest > robot.channel_radius_m * 0.98, key


def test_projections_meet_in_a_line_at_the_hinge() -> None:
    """The curved projection's lowest points are a line along y at the hinge; the flat top is level."""
    shape = shape_of("neuroendoscope")
    guide = picture.wire_guide(shape, shape)
    lowest = guide.vertices[guide.vertices[:, 2] < 1e-9]
    assert np.abs(lowest[:, 0]).max() < 1e-12
    assert lowest[:, 1].min() < -shape.bore_radius
    assert lowest[:, 1].max() > shape.bore_radius
    assert np.abs(lowest[:, 1]).min() > shape.bore_radius
    top = guide.vertices[guide.vertices[:, 2] > shape.length - 1e-9]
    assert np.allclose(top[:, 2], shape.length, atol=1e-12)
    assert np.ptp(top[:, 0]) > 0.2 * shape.outer_radius  # a flat plane, on which the arc can roll


@pytest.mark.parametrize("angle_deg", [-8.0, 0.0, 3.0, 8.0])
def test_neighbouring_guides_touch_but_do_not_run_into_one_another(angle_deg: float) -> None:
    """From -8 to 8 deg the two projections sink into one another by less than 8 um, and stay in touch."""
    shape = shape_of("neuroendoscope")
    below, above = picture.base_guide(shape), picture.wire_guide(shape, shape)
    angle = math.radians(angle_deg)

    axis = np.array([math.sin(angle), 0.0, math.cos(angle)])  # of the upper guide

    def overlap(raised: float) -> bool:
        moved = turned_about_hinge(above, angle, raised)
        # The lower guide ends at z = 0, the upper one begins there in its own frame.
        low = surface(moved)[surface(moved)[:, 2] < 0]
        high = surface(below)[surface(below) @ axis > raised]
        return bool((winding_number(below, low) > 0.5).any() or (winding_number(moved, high) > 0.5).any())

    assert not overlap(8e-6)
    assert overlap(-8e-6)


def test_flexures_are_thin_and_stand_on_the_bending_axis() -> None:
    """Near a hinge the backbone is two strips beside the channel, thin across the bending axis."""
    shape = shape_of("neuroendoscope")
    backbone = picture.backbone_cell(shape, shape)
    z = backbone.vertices[:, 2]
    for here in (z < 0.2 * shape.length, z > 0.8 * shape.length):
        strips = backbone.vertices[here]
        assert np.abs(strips[:, 0]).max() < 0.15 * shape.tube_radius
        assert np.abs(strips[:, 1]).min() >= shape.channel_radius
        assert {-1.0, 1.0} == set(np.sign(strips[:, 1]))
    rigid = backbone.vertices[(z > 0.2 * shape.length) & (z < 0.8 * shape.length)]
    assert np.hypot(rigid[:, 0], rigid[:, 1]).max() < shape.bore_radius


@pytest.mark.parametrize("name", ["neuroendoscope", "spacer_disk"])
def test_backbone_is_unbroken_from_the_base_face_to_the_tip(name: str) -> None:
    """Stacked on the straight robot, the backbone's parts reach from z = 0 to the full length."""
    robot = load_robot(name)
    solids = picture.element_meshes(robot)
    hinges, z = [0.0], 0.0  # frame of link 0: the base
    for segment in robot.segments:
        count = picture.links_of(robot, segment)
        hinges += [z + (i + 0.5) * segment.length_m / count for i in range(count)]
        z += segment.length_m
    spans = []
    for link, hinge in enumerate(hinges):
        for part in picture.element_parts(robot, link):
            if part.is_backbone:
                heights = solids[part.mesh_key].vertices[:, 2] + part.z_offset + hinge
                spans.append((heights.min(), heights.max()))
    assert spans[0][0] == pytest.approx(0.0, abs=1e-9)
    assert spans[-1][1] == pytest.approx(z, abs=1e-9)
    for (_, end), (start, _) in itertools.pairwise(spans):
        assert start <= end + 1e-9


def test_spacer_disks_stand_at_every_fourth_link() -> None:
    """With four links a subsegment, disks appear on every fourth link's distal face only."""
    robot = load_robot("spacer_disk")
    assert robot.links_per_subsegment == 4
    link_length = robot.segments[0].length_m / 40
    with_disk = {}
    for link in range(81):
        for part in picture.element_parts(robot, link):
            if part.name_prefix == "disk":
                with_disk[link] = part.z_offset
    assert list(with_disk) == list(range(0, 81, 4))
    assert with_disk.pop(0) == 0.0
    assert all(place == pytest.approx(link_length / 2.0) for place in with_disk.values())


def test_disks_are_turned_so_that_their_holes_lie_on_the_tendons() -> None:
    """With rest twist in both segments, each disk's holes are where the model's tendon holes are."""
    plain = load_robot("spacer_disk")
    robot = replace(
        plain,
        segments=tuple(
            replace(item, rest_twist_rad_per_m=rate)
            for item, rate in zip(plain.segments, (9.0, -4.0), strict=True)
        ),
    )
    tendon = robot.tendons[2]  # reaches the tip
    for link in description.links(robot):
        turns = [
            part.z_turn for part in picture.element_parts(robot, link.index) if part.name_prefix == "disk"
        ]
        expected = description.hole_angle_rad(robot, tendon, link.face_z_m) - tendon.angle_rad
        assert turns == ([pytest.approx(expected)] if link.disk else [])


def test_a_robot_written_twice_is_the_same_text() -> None:
    """Meshes depend on the specification alone."""
    first, second = (picture.element_meshes(load_robot("neuroendoscope")) for _ in range(2))
    assert {k: inline(m) for k, m in first.items()} == {k: inline(m) for k, m in second.items()}


@pytest.mark.parametrize("name", ROBOTS)
def test_mujoco_takes_the_meshes_and_keeps_them_in_place(name: str) -> None:
    """MuJoCo finds trimesh's volume, and its recentring of a mesh leaves every vertex where it was."""
    for key, mesh in picture.element_meshes(load_robot(name)).items():
        vertex, face = inline(mesh)
        model = mujoco.MjModel.from_xml_string(
            f"""<mujoco>
              <asset><mesh name="m" vertex="{vertex}" face="{face}" inertia="exact"/></asset>
              <worldbody><body><freejoint/><geom type="mesh" mesh="m" density="1000"/></body></worldbody>
            </mujoco>"""
        )
        assert model.body_mass[1] == pytest.approx(1000.0 * mesh.volume, rel=1e-3), key
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        vertices = model.mesh_vert @ data.geom_xmat[0].reshape(3, 3).T + data.geom_xpos[0]
        assert np.abs(vertices - mesh.vertices).max() < 1e-8, key  # mesh_vert has single precision


@pytest.mark.slow
@given(
    radius_mm=st.floats(0.5, 20.0),
    channel=st.one_of(st.just(0.0), st.floats(0.0, 0.999)),
    slenderness=st.floats(0.2, 5.0),
    angles_deg=st.lists(st.floats(-180.0, 180.0), min_size=1, max_size=6),
    tendon=st.floats(0.01, 0.999),
    axes=st.sampled_from(("x", "xy")),
    guides=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_any_robot_that_passes_the_checks_can_be_drawn(
    radius_mm: float,
    channel: float,
    slenderness: float,
    angles_deg: list[float],
    tendon: float,
    axes: str,
    guides: bool,
) -> None:
    """Whatever its channel, cells and tendons, a valid robot has closed meshes."""
    radius = radius_mm * 1e-3
    count = 4
    robot = ContinuumRobot(
        name="any",
        description="",
        segments=(Segment("only", count * slenderness * radius, count, radius, 1e-4, 1e-3, axes),),
        tendons=tuple(
            Tendon(f"t{k}", tendon * radius, math.radians(angle), "only")
            for k, angle in enumerate(angles_deg)
        ),
        friction=Friction(0.0),
        appearance="wire_guides" if guides else "spacer_disks",
        channel_radius_m=channel * tendon * radius,
    )
    check_robot(robot, "any")
    for key, mesh in picture.element_meshes(robot).items():
        assert mesh.is_watertight, key
        assert mesh.volume > 0, key
