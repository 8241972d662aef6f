"""Impossible robots are refused in one line, with the key and the value as a file has them."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path

import pytest

from catheter_sim.catalogue import ROBOTS, load_robot, robot_toml
from catheter_sim.errors import InputError
from catheter_sim.robots import check_robot
from catheter_sim.robots.continuum.description import disks
from catheter_sim.robots.continuum.spec import ContinuumRobot


@pytest.mark.parametrize("reference", ROBOTS)
def test_built_in_robots_are_possible(reference: str) -> None:
    """Every built-in robot passes its own check."""
    check_robot(ROBOTS[reference](), reference)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("segments.first.length_mm=0", "segments.first.length_mm = 0: must be above zero"),
        ("segments.first.length_mm=-5", "segments.first.length_mm = -5: must be above zero"),
        ("segments.first.length_mm=inf", "segments.first.length_mm = inf: must be above zero and finite"),
        ("segments.second.outer_radius_mm=0", "segments.second.outer_radius_mm = 0: must be above zero"),
        ("segments.first.bending_stiffness_N_mm2=0", "bending_stiffness_N_mm2 = 0: must be above zero"),
        ("segments.first.torsion_stiffness_N_mm2=0", "torsion_stiffness_N_mm2 = 0: must be above zero"),
        ("segments.first.mass_g=0", "segments.first.mass_g = 0: must be above zero"),
        ("segments.first.disks=0", "segments.first.disks = 0: must be 1 or more"),
        ("segments.first.bending_axes=z", "segments.first.bending_axes = 'z': must be x, y, xy or none"),
        ("segments.first.stiffness_cubic_mm2=inf", "stiffness_cubic_mm2 = inf: must be finite"),
        ("segments.first.rest_curvature_x_per_m=1000", "rest_curvature_x_per_m = 1000: more than two turns"),
        ("segments.first.rest_twist_deg_per_m=-20000", "rest_twist_deg_per_m = -20000: more than two turns"),
        ("segments.first.rest_curvature_y_per_m=inf", "rest_curvature_y_per_m = inf: more than two turns"),
        ("segments.first.name=a b", "segment 'a b': a name needs letters, digits and _ only"),
        ("segments.first.name=second", "segment 'second' stands twice"),
        ("tendons.1.name=2", "tendon '2' stands twice"),
        ("tendons.1.channel=a-b", "tendons.1.channel 'a-b': a name needs letters"),
        ("tendons.1.ends_at=tip", "tendons.1.ends_at: unknown segment 'tip'; choices: first, second"),
        ("tendons.1.radius_mm=0", "tendons.1.radius_mm = 0: must be above zero"),
        ("tendons.1.radius_mm=9.2", "tendons.1.radius_mm = 9.2: the tendon lies outside the disks of"),
        ("tendons.1.angle_deg=inf", "tendons.1.angle_deg = inf: must be finite"),
        ("tendons.1.stiffness_N_per_mm=-1", "tendons.1.stiffness_N_per_mm = -1: must be above zero"),
        ("tendons.1.pretension_N=-1", "tendons.1.pretension_N = -1: must not be negative"),
        ("tendons.1.pretension_N=inf", "tendons.1.pretension_N = inf: must not be negative"),
        ("friction.mu=-0.1", "friction.mu = -0.1: must lie in 0 to 10"),
        ("friction.mu=inf", "friction.mu = inf: must lie in 0 to 10"),
        ("mount.axial_stiffness_N_per_mm=0", "mount.axial_stiffness_N_per_mm = 0: must be above zero"),
        ("dynamics.timestep_s=0", "dynamics.timestep_s = 0: must be above zero"),
        ("dynamics.timestep_s=1e-9", "dynamics.timestep_s = 1e-09: must lie in 1e-05 to 0.1 s"),
        ("dynamics.timestep_s=1", "dynamics.timestep_s = 1: must lie in 1e-05 to 0.1 s"),
        ("dynamics.relaxation_time_s=1e5", "dynamics.relaxation_time_s = 100000: must be at most 1000 s"),
        ("disks_per_segment=1000000000", "disks times links_per_subsegment = 8000000000: more than 400"),
        ("name=", "name = '': 1 to 100 characters that can be printed are needed"),
        ("name=\u200b", "name = '\\u200b': 1 to 100 characters that can be printed are needed"),
        ("segments.first.name=" + "s" * 61, "a name has at most 60 characters"),
        ("segments.first.length_mm=1e-300", "length_mm = 1e-300: too small or too large to compute with"),
        ("segments.first.mass_g=1e300", "segments.first.mass_g = 1e+300: too small or too large to compute"),
        ("stiffness_scale=0", "stiffness_scale = 0: must be above zero"),
        ("channel_radius_mm=-1", "channel_radius_mm = -1: must lie in 0 to the smallest outer radius"),
        ("channel_radius_mm=8.5", "the tendon lies in the free channel (radius 8.5 mm)"),
        ("links_per_subsegment=0", "links_per_subsegment = 0: must be 1 or more"),
        ("links_per_subsegment=1000000", "disks times links_per_subsegment = 20000000: more than 400 links"),
        ("disks_per_segment=-1", "disks_per_segment = -1: must not be negative"),
        ("actuation=push", "unknown actuation 'push'; choices: tension, displacement"),
        ("appearance=shiny", "unknown appearance 'shiny'; choices: spacer_disks, wire_guides"),
    ],
)  # fmt: skip
def test_impossible_number_is_named(setting: str, message: str) -> None:
    """The line names the robot, the key in the file's unit and the value as it was written."""
    with pytest.raises(InputError) as caught:
        load_robot("spacer_disk", [setting])
    assert str(caught.value).startswith("spacer_disk: ")
    assert message in str(caught.value)


def test_tendon_may_pass_only_disks_that_hold_it() -> None:
    """A thin distal segment refuses the tendons that run through it, and no others."""
    with pytest.raises(InputError, match=r"tendons\.3\.radius_mm = 8.*disks of segment second"):
        load_robot("spacer_disk", ["segments.second.outer_radius_mm=5"])
    thin = ["segments.second.outer_radius_mm=5", "tendons.3.radius_mm=4", "tendons.4.radius_mm=4"]
    assert load_robot("spacer_disk", thin).tendons[0].radius_m == pytest.approx(8e-3)


def test_curvature_across_a_plane_hinge_is_refused() -> None:
    """A robot that bends in one plane cannot be given a rest curvature out of it."""
    with pytest.raises(InputError, match="rest_curvature_y_per_m = 1: must be 0 where bending_axes is x"):
        load_robot("neuroendoscope_section", ["segments.section.rest_curvature_y_per_m=1"])


def test_disks_per_segment_rules_where_it_is_set() -> None:
    """0 leaves each segment's own number of disks; anything else replaces it."""
    robot = load_robot("spacer_disk", ["disks_per_segment=0", "segments.first.disks=3"])
    assert [disks(robot, segment) for segment in robot.segments] == [3, 10]
    robot = dataclasses.replace(robot, disks_per_segment=7)
    assert [disks(robot, segment) for segment in robot.segments] == [7, 7]


def test_unknown_robot_names_the_choices() -> None:
    """The choices are the ids and a path; of a known robot's unknown set its sets besides."""
    robots = [name for name in ROBOTS if "@" not in name]
    with pytest.raises(InputError) as caught:
        load_robot("spacer_disc")
    choices = [*robots, "a path to a .toml", "a path to an MJCF .xml"]
    assert str(caught.value) == f"unknown robot 'spacer_disc'; choices: {', '.join(choices)}"
    with pytest.raises(InputError, match="chest_tube_section@prototype, chest_tube_section@printed_shapes"):
        load_robot("chest_tube_section@table3")


def test_file_that_is_no_robot_is_named(tmp_path: Path) -> None:
    """Missing, broken, binary or wrong files end in one line with the file's name."""
    (tmp_path / "broken.toml").write_text("name = ")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "empty.toml").write_text("")
    (tmp_path / "folder.toml").mkdir()
    text = robot_toml(ROBOTS["spacer_disk"]())
    (tmp_path / "flat.toml").write_text(text.replace("length_mm = 50.0", "length_mm = 0.0", 1))
    for name, message in (
        ("no.toml", "no such file"),
        ("broken.toml", "not valid TOML"),
        ("binary.toml", "cannot be read"),
        ("empty.toml", "name, description, segments, friction are missing"),
        ("folder.toml", "cannot be read"),
        ("flat.toml", "segments.first.length_mm = 0: must be above zero"),
    ):
        with pytest.raises(InputError) as caught:
            load_robot(tmp_path / name)
        assert str(caught.value).startswith(str(tmp_path / name)), name
        assert message in str(caught.value)
        assert "\n" not in str(caught.value)


def test_more_tendons_and_holes_than_can_be_built_are_refused() -> None:
    """A hundred tendons are taken, one more is not; nor are more than ten thousand holes."""
    robot = load_robot("spacer_disk")
    assert isinstance(robot, ContinuumRobot)
    for count, message in ((100, ""), (101, "r: 101 tendons: more than 100")):
        tendons = tuple(dataclasses.replace(robot.tendons[0], name=f"t{k}") for k in range(count))
        many = dataclasses.replace(robot, tendons=tendons, disks_per_segment=10)
        if message:
            with pytest.raises(InputError, match=message):
                check_robot(many, "r")
        else:
            check_robot(many, "r")
            with pytest.raises(InputError, match="links times tendons = 12000: more than 10000 holes"):
                check_robot(dataclasses.replace(many, disks_per_segment=60, links_per_subsegment=1), "r")


@pytest.mark.slow
def test_twenty_thousand_tendons_end_in_one_line(tmp_path: Path) -> None:
    """In seconds, without looking at each of them against each other."""
    text = robot_toml(ROBOTS["neuroendoscope_section"]())
    start = text.index("[[tendons]]")
    tendon = text[start : text.index("[[tendons]]", start + 1)]
    many = "\n".join(tendon.replace('"right"', f'"t{k}"', 1) for k in range(20_000))
    (tmp_path / "many.toml").write_text(text[:start] + many + "\n" + text[start:])
    before = time.process_time()
    with pytest.raises(InputError, match=r"many\.toml: tendons: 20002 entries: more than 1000"):
        load_robot(tmp_path / "many.toml")
    assert time.process_time() - before < 20.0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("name = " + "[" * 1000 + "]" * 1000, "not valid TOML: nested too deeply"),
        ("name = " + "[" * 200 + "]" * 200, "name.0.0.0.0.0.0.0.0.0.0.0.0.0.0.0: tables or lists nested"),
        (".".join("a" * 50) + " = 1", "tables or lists nested deeper than 16"),
        (".".join("a" * 100_000) + " = 1", "not valid TOML: a key has more than 100 parts"),
        ("name = 'a'\n" + "# comment\n" * 1_000_001, "larger than 10 MB, so neither a robot nor a data set"),
        ("disks_per_segment = 1" + "0" * 400, "disks_per_segment: a whole number of more than 64 bits"),
        ("stiffness_scale = 1" + "0" * 400, "stiffness_scale: a whole number of more than 64 bits"),
        ("stiffness_scale = 1" + "0" * 5000, "a whole number has thousands of digits"),
        ("segments = [{disks = 0x" + "f" * 5000 + "}]", "segments.0.disks: a whole number of more than 64"),
        ('name = "' + "x" * 100_000 + '"', "are missing"),
    ],
    ids=lambda text: text[:30],
)  # fmt: skip
def test_file_beyond_all_measure_is_one_line(tmp_path: Path, content: str, message: str) -> None:
    """Depth and size that Python's own readers give up on are the file's fault, with its key."""
    (tmp_path / "robot.toml").write_text(content)
    with pytest.raises(InputError) as caught:
        load_robot(tmp_path / "robot.toml")
    assert str(caught.value).startswith(f"{tmp_path / 'robot.toml'}: ")
    assert message in str(caught.value)
    assert len(str(caught.value)) <= 500


@pytest.mark.parametrize("value", ["1" + "0" * 400, "1" + "0" * 5000, "-1e400"], ids=len)
@pytest.mark.parametrize("key", ["segments.first.length_mm", "disks_per_segment", "name"])
def test_setting_beyond_all_measure_is_one_line(key: str, value: str) -> None:
    """A number that no float holds is called that; infinity has to be written as such."""
    with pytest.raises(InputError, match=f"settings {key}=.*: too large a number") as caught:
        load_robot("spacer_disk", [f"{key}={value}"])
    assert len(str(caught.value)) <= 200
    load_robot("spacer_disk", ["segments.first.torsion_stiffness_N_mm2=inf"])
