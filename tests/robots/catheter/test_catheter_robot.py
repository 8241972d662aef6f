"""The mitral catheters as data: lengths, files, settings, channels, and what cannot be one."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot, robot_toml, robots_of
from catheter_sim.channels import (
    actuations,
    body_count,
    input_channels,
    joint_names,
    output_channels,
    read_inputs,
)
from catheter_sim.errors import InputError
from catheter_sim.robots import face_of
from catheter_sim.robots.catheter.description import (
    FOUR_DOF,
    TRANSSEPTAL,
    base_heights_m,
    closing_angle_rad,
    design,
    elements,
    ring_length_m,
)
from catheter_sim.tables import Table


def table(**columns: list[float]) -> Table:
    """Return a table of the given columns, a second a row."""
    rows = len(next(iter(columns.values())))
    return Table(np.arange(float(rows)), {name: np.array(item, float) for name, item in columns.items()})


def test_designs_and_lengths_are_those_printed() -> None:
    """Nayar 2022: 15 + 31.84 + 6 + 4.5 mm; Nayar 2023: 8.52 + 2 + 15.66 + 2 + 5 + 15 mm."""
    first, second = load_robot("mitral_transseptal"), load_robot("mitral_4dof")
    assert design(first) == TRANSSEPTAL
    assert design(second) == FOUR_DOF
    np.testing.assert_allclose(np.diff(base_heights_m(first)) * 1e3, [15.0, 31.84, 6.0, 4.5])
    np.testing.assert_allclose(np.diff(base_heights_m(second)) * 1e3, [8.52, 2.0, 15.66, 2.0, 5.0, 15.0])


def test_rings_are_those_printed() -> None:
    """Rings of 2.04 mm (2022, Table I); the 2023 lengths leave 1 mm a ring for both joints."""
    bending = load_robot("mitral_transseptal").segments[1]
    assert ring_length_m(bending) == pytest.approx(2.04e-3)
    for index in (0, 2):
        assert ring_length_m(load_robot("mitral_4dof").segments[index]) == pytest.approx(1e-3)


def test_limits_are_below_the_closing_of_the_gaps() -> None:
    """Every bending joint reaches its printed limit before its rings touch."""
    for make in robots_of("catheter").values():
        for segment in make().segments:
            if segment.joint == "bending":
                assert segment.limit_rad < closing_angle_rad(segment)


def test_elements_are_modules_and_rings() -> None:
    """13 elements each: modules, and rings in between."""
    assert [part.ring for part in elements(load_robot("mitral_transseptal"))] == [0, *range(1, 11), 0, 0]
    assert [part.ring for part in elements(load_robot("mitral_4dof"))] == [1, 2, 3, 0, *range(1, 7), 0, 0, 0]
    assert body_count(load_robot("mitral_4dof")) == 13


def test_channels_are_those_promised() -> None:
    """Displacements of the pairs, the advance; angles, hinges, tensions of the pairs alone."""
    robot = load_robot("mitral_transseptal")
    assert input_channels(robot) == [
        "displacement_bending_mm",
        "displacement_torsion_proximal_mm",
        "displacement_torsion_distal_mm",
        "advance_mm",
    ]
    assert input_channels(load_robot("mitral_4dof")) == [
        "displacement_bending_proximal_mm",
        "displacement_bending_distal_mm",
        "displacement_torsion_mm",
        "advance_mm",
    ]
    assert actuations(robot) == ("displacement",)
    assert input_channels(robot, "tension") == []
    names = output_channels(robot)
    assert [name for name in names if name.startswith("angle_")] == [
        "angle_torsion_proximal_deg",
        "angle_bending_deg",
        "angle_torsion_distal_deg",
    ]
    assert [name for name in names if name.startswith("tension_")] == [
        "tension_bending_N",
        "tension_torsion_proximal_N",
        "tension_torsion_distal_N",
    ]
    assert [name.removeprefix("joint_").removesuffix("_deg") for name in names if "joint_" in name] == (
        joint_names(robot)
    )
    assert "body_13_z_mm" in names
    assert "body_14_z_mm" not in names


def test_inputs_are_read_with_their_sign() -> None:
    """Displacements may be negative, a channel that is left out is zero, mm become m."""
    robot = load_robot("mitral_transseptal")
    inputs = read_inputs(robot, table(displacement_bending_mm=[0.0, -2.0], advance_mm=[0.0, 60.0]))
    np.testing.assert_allclose(inputs.tendon, [[0, 0, 0, 0], [-2e-3, 0, 0, 60e-3]])
    assert inputs.actuation == "displacement"


@pytest.mark.parametrize("advance", [-0.1, 60.1])
def test_an_advance_beyond_its_stroke_names_the_row(advance: float) -> None:
    """The tube cannot be drawn in past its start nor pushed out past its stroke."""
    robot = load_robot("mitral_transseptal")
    with pytest.raises(InputError, match=rf"line 3: advance_mm = {advance}: must lie in 0 to .*60 mm"):
        read_inputs(robot, table(advance_mm=[0.0, advance]))


def test_unknown_channels_name_the_choices() -> None:
    """A tension is no input of a catheter; the message lists what is."""
    robot = load_robot("mitral_transseptal")
    with pytest.raises(InputError, match="unknown input channel 'tension_bending_N'; choices: displacement_"):
        read_inputs(robot, table(tension_bending_N=[1.0]))


@pytest.mark.parametrize("reference", robots_of("catheter"))
def test_file_says_its_kind(reference: str, tmp_path: Path) -> None:
    """The file of a catheter says `kind = "catheter"`; a setting reaches its joints."""
    path = tmp_path / "robot.toml"
    path.write_text(robot_toml(load_robot(reference)), encoding="utf-8")
    assert 'kind = "catheter"' in path.read_text(encoding="utf-8")
    robot = load_robot(path, ["segments.advance.stroke_mm=50"])
    by_name = {segment.name: segment for segment in robot.segments}
    assert by_name["advance"].stroke_m == pytest.approx(50e-3)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("kind=rolling", "unknown key"),
        ("actuation=tension", "unknown actuation 'tension'; choices: displacement"),
        ("segments.bending.joint=ball", "unknown joint 'ball'; choices: torsion, bending, prismatic, rigid"),
        ("segments.bending.joint=torsion", "segments.bending.tendon_radius_mm = 0: must be above zero"),
        ("segments.advance.rings=3", "segments.advance.rings = 3: must be 0 for a prismatic joint"),
        ("segments.bending.rings=0", "segments.bending.rings = 0: must be above zero"),
        ("segments.bending.rings=501", "segments.bending.rings = 501: more than 400"),
        ("segments.bending.length_mm=11", "nothing is left for the rings between gaps of 11.44 mm in all"),
        ("segments.bending.arm_mm=3", "segments.bending.arm_mm = 3: lies outside the rings"),
        ("segments.bending.arm_mm=2.6", "segments.bending.arm_mm = 2.6: lies outside rim_radius_mm"),
        ("segments.bending.limit_deg=300", "limit_deg = 300: above the bend that closes the gaps, 264 deg"),
        ("segments.torsion_distal.limit_deg=130", "limit_deg = 130: above the tendon's wrap, 120 deg"),
        ("segments.torsion_distal.tendon_radius_mm=3", "tendon_radius_mm = 3: lies outside the module"),
        ("segments.torsion_distal.wrap_height_mm=-1", "wrap_height_mm = -1: must not be negative"),
        ("segments.bending.bends_toward=z", "unknown direction 'z'; choices: x, y"),
        ("segments.bending.mass_g=-1", "mass_g = -1: must not be negative"),
        ("segments.bending.name=advance", "segment 'advance' stands twice"),
        ("segments.advance.stroke_mm=0", "stroke_mm = 0: must be above zero"),
        ("tendons.bending.moves=tip", "tendons.bending.moves: unknown segment 'tip'; choices: torsion_"),
        ("tendons.bending.moves=advance", "segments.bending: moved by 1 of the tendons, not by none"),
        ("tendons.bending.stiffness_N_per_mm=0", "stiffness_N_per_mm = 0: must be above zero"),
        ("tendons.bending.length_mm=-1", "tendons.bending.length_mm = -1: must not be negative"),
        ("friction.mu=-1", "friction.mu = -1: must lie in 0 to 10"),
        ("channel_radius_mm=3", "channel_radius_mm = 3: must lie in 0 to the smallest outer radius, 2.85 mm"),
        ("stiffness_scale=0", "stiffness_scale = 0: must be above zero"),
    ],
)
def test_impossible_catheters_are_refused(setting: str, message: str) -> None:
    """One line, with the key and value as the file has them."""
    with pytest.raises(InputError) as caught:
        load_robot("mitral_transseptal", [setting])
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_does_not_know_catheters_says_so() -> None:
    """One line names the robot, what refuses it, its kind and the kinds that are known."""
    with pytest.raises(InputError) as caught:
        face_of(load_robot("mitral_4dof"), "friction_tails", "reference friction law")
    assert str(caught.value) == (
        "mitral_4dof: no reference friction law for robots of kind 'catheter'; choices: continuum"
    )
    assert face_of(load_robot("spacer_disk"), "friction_tails", "reference friction law")


def test_kinds_differ() -> None:
    """A catheter is a value: equal to another with the same numbers, unequal with one changed."""
    robot = load_robot("mitral_4dof")
    assert robot == load_robot("mitral_4dof")
    assert robot != dataclasses.replace(robot, stiffness_scale=2.0)
