"""Robots to and from documents: nothing is lost, and every wrong key or value is named."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from string import ascii_lowercase, digits
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catheter_sim.catalogue import ROBOTS, load_robot, robot_toml
from catheter_sim.core.document import from_document, leaves, override, parse_override, to_document
from catheter_sim.core.robot import Dynamics, Friction, Mount
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

_NAMES = st.text("abcXYZ019_", min_size=1, max_size=6).filter(lambda name: name.strip("_") != "")


def _size(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda value: float(f"{value:.9g}"))


@st.composite
def robots(draw: st.DrawFn) -> ContinuumRobot:
    """Draw a possible robot, every field away from its default."""
    names = draw(st.lists(_NAMES, min_size=1, max_size=3, unique=True))
    segments = tuple(
        Segment(
            name=name,
            length_m=draw(_size(1e-3, 1.0)),
            disks=draw(st.integers(1, 20)),
            outer_radius_m=draw(_size(2e-3, 0.1)),
            bending_stiffness_N_m2=draw(_size(1e-8, 1.0)),
            mass_kg=draw(_size(1e-6, 1.0)),
            bending_axes="xy",
            torsion_stiffness_N_m2=draw(st.one_of(_size(1e-8, 1.0), st.just(math.inf))),
            stiffness_cubic_m2=draw(_size(-1e-3, 1e-3)),
            stiffness_quintic_m4=draw(_size(-1e-6, 1e-6)),
            rest_curvature_x_per_m=draw(_size(-5, 5)),
            rest_curvature_y_per_m=draw(_size(-5, 5)),
            rest_twist_rad_per_m=draw(_size(-5, 5)),
        )
        for name in names
    )
    tendons = tuple(
        Tendon(
            name=name,
            radius_m=draw(_size(1.1e-3, 1.9e-3)),
            angle_rad=draw(_size(-7, 7)),
            ends_at=draw(st.sampled_from(names)),
            channel=draw(st.one_of(st.just(""), _NAMES)),
            stiffness_N_per_m=draw(st.one_of(_size(1.0, 1e6), st.just(math.inf))),
            pretension_N=draw(_size(0, 10)),
        )
        for name in draw(st.lists(_NAMES, min_size=1, max_size=4, unique=True))
    )
    return ContinuumRobot(
        name=draw(_NAMES),
        description=draw(st.text(max_size=10)),
        segments=segments,
        tendons=tendons,
        friction=Friction(draw(_size(0, 2))),
        mount=Mount(draw(st.one_of(_size(1.0, 1e6), st.just(math.inf)))),
        dynamics=Dynamics(draw(_size(1e-4, 0.1)), draw(_size(1e-3, 1.0)), draw(_size(1e-3, 1.0))),
        actuation=draw(st.sampled_from(["tension", "displacement"])),
        appearance=draw(st.sampled_from(["spacer_disks", "wire_guides"])),
        channel_radius_m=draw(_size(0, 1e-3)),
        stiffness_scale=draw(_size(0.1, 10)),
        links_per_subsegment=draw(st.integers(1, 5)),
        hinges=draw(st.sampled_from(["even", "rod"])),
        disks_per_segment=draw(st.integers(0, 20)),
        effects=draw(st.dictionaries(_NAMES, st.dictionaries(_NAMES, _size(-9, 9), max_size=2), max_size=2)),
        sources=draw(st.dictionaries(_NAMES, st.text(max_size=9), max_size=2)),
    )


def assert_same(one: Any, other: Any) -> None:
    """Assert equality, numbers to 1e-11 of their size (the file's 12 digits)."""
    if isinstance(one, float):
        assert other == pytest.approx(one, rel=1e-11, abs=0)
    elif dataclasses.is_dataclass(one):
        for item in dataclasses.fields(one):
            assert_same(getattr(one, item.name), getattr(other, item.name))
    elif isinstance(one, tuple):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            assert_same(a, b)
    elif isinstance(one, Mapping):
        assert list(one) == list(other)
        for key in one:
            assert_same(one[key], other[key])
    else:
        assert one == other


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(robot=robots())
def test_robot_survives_its_toml(robot: ContinuumRobot, tmp_path_factory: pytest.TempPathFactory) -> None:
    """A robot written as .toml and loaded is the same robot, field by field; the text is the same too."""
    path = tmp_path_factory.mktemp("robots") / "robot.toml"
    path.write_text(robot_toml(robot), encoding="utf-8")
    again = load_robot(path)
    assert_same(robot, again)
    assert robot_toml(again) == robot_toml(robot)


@pytest.mark.parametrize("reference", ROBOTS)
def test_built_in_robot_survives_its_toml(reference: str, tmp_path: Path) -> None:
    """A built-in robot loaded by its id, or from the .toml made of it, is the robot as written in code."""
    robot = ROBOTS[reference]()
    (tmp_path / "robot.toml").write_text(robot_toml(robot), encoding="utf-8")
    assert_same(robot, load_robot(tmp_path / "robot.toml"))
    assert_same(robot, load_robot(reference))


@pytest.mark.slow
def test_every_number_can_be_set() -> None:
    """--set reaches each leaf of each robot's document, and changes that one leaf alone."""
    for reference in ROBOTS:
        document = to_document(ROBOTS[reference]())
        before = dict(leaves(document))
        for key, value in before.items():
            changed = to_document(ROBOTS[reference]())
            override(changed, key, 5 if math.isinf(value) else value + 1)
            different = {name for name, new in leaves(changed) if new != before[name]}
            assert different == {key}, key


@settings(max_examples=100, deadline=None)
@given(
    first=st.sampled_from(ascii_lowercase),
    more=st.text(f"{ascii_lowercase}{digits}_.", max_size=20),
    value=st.floats(allow_nan=False),
)
def test_setting_reads_back(first: str, more: str, value: float) -> None:
    """KEY=VALUE gives the key and the number, with blanks around either."""
    key = first + more
    name, number = parse_override(f" {key} = {value!r} ")
    assert name == key
    assert number == value


def refused_or_loaded(setting: str) -> str:
    """Return the error's text for a setting of spacer_disk, or "" where it loads; others propagate."""
    try:
        load_robot("spacer_disk", [setting])
    except InputError as error:
        return str(error)
    return ""


@settings(max_examples=100, deadline=None)
@given(text=st.text(max_size=12), key=st.text(max_size=12))
def test_any_setting_is_an_input_error_or_a_robot(key: str, text: str) -> None:
    """Whatever is typed after --set, there is a checked robot or one line: no other exception."""
    message = refused_or_loaded(f"{key}={text}")
    assert message == "" or message.startswith(("settings ", "spacer_disk: "))


_HEADS = ("name", "friction", "segments", "tendons", "1", "0", "mu", "mount", "effects", "sources", "")
_TAILS = ("", ".mu", ".0", ".1", ".1.radius_mm", ".x.y", ".x.y.z", ".")


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(
    head=st.sampled_from(_HEADS),
    tail=st.sampled_from(_TAILS),
    value=st.sampled_from(["1", "0", "-1", "nan", "inf", "1e400", "x", "", "[1]", "true", "2.5"]),
)
def test_any_dotted_setting_is_an_input_error_or_a_robot(head: str, tail: str, value: str) -> None:
    """The same for keys that nearly exist: scalars with keys, tables without, names that are numbers."""
    message = refused_or_loaded(f"{head}{tail}={value}")
    assert message == "" or message.startswith(("settings ", "spacer_disk: "))


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("friction.mu", "KEY=VALUE is needed"),
        ("=1", "KEY=VALUE is needed"),
        ("friction.nu=1", "unknown key 'nu'; choices: mu"),
        ("fricton.mu=1", "unknown key 'fricton'; choices: name, description"),
        ("segments.third.length_mm=5", "unknown key 'third'; choices: first, second"),
        ("segments.first.length_m=5", "choices: length_mm, "),
        ("segments=5", "names a whole table; choices: first, second"),
        ("segments.first=5", "names a whole table; choices: first, second"),
        ("name.x=5", "name is a value, it has no keys"),
        ("friction.mu.x=5", "friction.mu is a value, it has no keys"),
        ("friction.mu=abc", "mu: a number is needed, not 'abc'"),
        ("friction.mu=nan", "mu: a number is needed, not nan"),
        ("disks_per_segment=2.5", "a whole number is needed"),
        ("effects.backlash=1", "effects.NAME.PARAMETER=VALUE"),
        ("effects.backlash.width_mm.x=1", "effects.NAME.PARAMETER=VALUE"),
        ("effects.backlash.width_mm=wide", "effects.backlash.width_mm: a number is needed"),
    ],
)
def test_wrong_setting_is_named(setting: str, message: str) -> None:
    """The line names the key and the choices at the level where it fails."""
    with pytest.raises(InputError) as caught:
        load_robot("spacer_disk", [setting])
    assert message in str(caught.value)


def test_name_that_is_a_number_goes_before_position() -> None:
    """With tendons named 1 to 4, `tendons.1` is the tendon called 1, not the second one."""
    robot = load_robot("spacer_disk", ["tendons.1.angle_deg=45", "segments.1.mass_g=7"])
    assert robot.tendons[0].angle_rad == pytest.approx(math.pi / 4)
    assert robot.segments[1].mass_kg == pytest.approx(7e-3)  # no segment is called 1
    document = {"tendons": [{"name": "1", "x": 0.0}, {"name": "0", "x": 0.0}]}
    override(document, "tendons.0.x", 5)
    assert [item["x"] for item in document["tendons"]] == [0.0, 5.0]


def test_settings_apply_in_order_and_leave_the_rest() -> None:
    """The last setting of a key counts; all other numbers stay."""
    plain, changed = (
        load_robot("neuroendoscope"),
        load_robot("neuroendoscope", ["friction.mu=1", "friction.mu=0.2"]),
    )
    assert changed == dataclasses.replace(plain, friction=Friction(0.2))


def test_effects_are_kept_as_written() -> None:
    """An effect's numbers stay in the unit of their name, and stand under its name."""
    robot = load_robot("neuroendoscope", ["effects.backlash.width_mm=0.4", "effects.rate.delay_s=1"])
    assert robot.effects == {"backlash": {"width_mm": 0.4}, "rate": {"delay_s": 1.0}}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"segments": []}, "segments: a list with at least one entry is needed"),
        ({"segments": "x"}, "segments: a list with at least one entry is needed"),
        ({"segments": ["x"]}, "segments.0: a table is needed"),
        ({"tendons": "x"}, "tendons: a list with at least one entry is needed"),
        ({"friction": 0.3}, "friction: a table is needed"),
        ({"friction": {}}, "friction: mu is missing"),
        ({"friction": {"mu": True}}, "mu: a number is needed, not True"),
        ({"name": 5}, "name: a text is needed"),
        ({"colour": "red"}, "unknown key 'colour'; choices: actuation"),
        ({"effects": {"backlash": 1}}, "effects.backlash: a table is needed"),
        ({"effects": {"backlash": {"width_mm": "x"}}}, "effects.backlash.width_mm: a number is needed"),
        ({"sources": {"mount": 5}}, "sources.mount: a text is needed"),
    ],
)
def test_wrong_document_is_named(change: dict[str, Any], message: str) -> None:
    """A document with a wrong kind of value is refused in a line that says where."""
    document = to_document(ROBOTS["neuroendoscope_section"]()) | change
    with pytest.raises(InputError) as caught:
        from_document(ContinuumRobot, document, "robot.toml")
    assert str(caught.value).startswith("robot.toml: ")
    assert message in str(caught.value)


def test_missing_key_is_named() -> None:
    """A segment without its length is refused by the dotted key."""
    document = to_document(ROBOTS["neuroendoscope_section"]())
    del document["segments"][0]["length_mm"]
    with pytest.raises(InputError, match=r"r: segments\.section: length_mm is missing"):
        from_document(ContinuumRobot, document, "r")


def test_missing_keys_are_named_together() -> None:
    """Who left out three keys need not ask three times."""
    document = to_document(ROBOTS["spacer_disk"]())
    for key in ("length_mm", "disks", "mass_g"):
        del document["segments"][1][key]
    with pytest.raises(InputError, match=r"segments\.second: length_mm, disks, mass_g are missing"):
        from_document(ContinuumRobot, document, "robot.toml")
