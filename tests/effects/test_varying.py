"""A number that varies along the robot, over time, with an input or with what came before acts as it says."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.variation import ALONG, SHAPES, Variation, variation_of
from catheter_sim.effects.apply import check_effects
from catheter_sim.effects.varying import argument, course
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.theory.twins import twin_for

TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
ROWS = 60
RIGHT = "tension_right_N"


def section(**effects: dict[str, float]) -> RobotSpec:
    return replace(load_robot("neuroendoscope_section"), effects=effects)


def pulled(values: np.ndarray) -> Inputs:
    """Return inputs of the section: its right tendon pulled [N], a row a second."""
    still = np.zeros((len(values), 3))
    tendon = np.stack([values, np.zeros(len(values))], axis=1)
    return Inputs(np.arange(float(len(values))), "tension", tendon, still, still)


def there_and_back() -> Inputs:
    return pulled(0.15 * (1.0 - np.cos(np.arange(ROWS) / 6.0)))


def tips(robots: list[RobotSpec], inputs: Inputs) -> np.ndarray:
    """Return the robots' tips along inputs, shape (B, r, 3) [mm]."""
    predict = twin_for(robots[0], "tension", TIP, np.zeros(3))
    return predict(robots, inputs)


def test_a_step_in_time_is_one_robot_before_and_another_after() -> None:
    before, after = section(stiffness={"scale": 1.0}), section(stiffness={"scale": 0.7})
    both = section(stiffness={"scale": 1.0, "scale~time.step(29.5)": -0.3})
    first, second, found = tips([before, after, both], there_and_back())
    np.testing.assert_allclose(found[:30], first[:30], atol=1e-12)
    np.testing.assert_allclose(found[30:], second[30:], atol=1e-12)
    assert np.abs(second - first).max() > 5.0


@pytest.mark.parametrize(("effect", "by"), [("stiffness", -0.4), ("actuation_gain", 0.3)])
def test_a_number_that_fades_is_that_of_each_row(effect: str, by: float) -> None:
    """To 2 % of what it changes: each row against a robot whose number stays at the row's value."""
    robot = section(**{effect: {"scale": 1.0, "scale~time.linear(59)": by}})
    inputs = there_and_back()
    (found,) = tips([robot], inputs)
    rows = (10, 25, 40, 59)
    still = [section(**{effect: {"scale": 1.0 + by * row / 59.0}}) for row in rows]
    wanted, plain = tips(still, inputs), tips([section(**{effect: {"scale": 1.0}})], inputs)[0]
    change = np.abs(wanted[-1] - plain).max()
    assert change > 0.5
    for own, row in zip(wanted, rows, strict=True):
        assert np.abs(found[row] - own[row]).max() < 0.02 * change


def test_two_parts_are_the_whole() -> None:
    """What varies over both halves alike is the number itself; one half alone does part of it."""
    whole = section(stiffness={"scale": 0.7})
    parts = {"scale~place.between(0,0.5)": -0.3, "scale~place.between(0.5,1)": -0.3}
    first, both, near, far, plain = tips(
        [
            whole,
            section(stiffness={"scale": 1.0, **parts}),
            *(section(stiffness={"scale": 1.0, name: value}) for name, value in parts.items()),
            section(stiffness={"scale": 1.0}),
        ],
        there_and_back(),
    )
    np.testing.assert_allclose(both, first, atol=1e-9)
    moved = [float(np.abs(item - plain).max()) for item in (near, far, first)]
    assert moved[2] > moved[0] > moved[1] > 0.5  # what bends near the base swings all beyond it


def test_a_soft_half_is_that_of_a_robot_of_two_segments() -> None:
    """Against a robot whose file has two segments, the far one softer, without friction."""
    plain = replace(load_robot("neuroendoscope_section"), actuation="tension")
    assert isinstance(plain, ContinuumRobot)
    plain = replace(plain, friction=replace(plain.friction, mu=0.0))
    (whole,) = plain.segments
    half = replace(
        whole, name="near", length_m=whole.length_m / 2.0, disks=whole.disks // 2, mass_kg=whole.mass_kg / 2.0
    )
    soft = replace(half, name="far", bending_stiffness_N_m2=0.6 * whole.bending_stiffness_N_m2)
    tendons = tuple(replace(item, ends_at="far") for item in plain.tendons)
    two = replace(plain, segments=(half, soft), tendons=tendons)
    varied = replace(plain, effects={"stiffness": {"scale": 1.0, "scale~place.between(0.5,1)": -0.4}})
    inputs = there_and_back()
    wanted, found, before = tips([two], inputs)[0], tips([varied], inputs)[0], tips([plain], inputs)[0]
    change = np.abs(wanted - before).max()
    assert change > 1.0
    assert np.abs(found - wanted).max() < 0.01 * change


def test_what_numbers_vary_with() -> None:
    """Time, size, sign, direction, way, largest size and turns of a pull that goes up, down and up."""
    robot, inputs = section(), pulled(np.array([0.0, 0.1, 0.3, 0.2, 0.0, 0.2]))
    found = {along: argument(robot, inputs, along, RIGHT) for along in ALONG if along != "place"}
    wanted = {
        "time": [0, 1, 2, 3, 4, 5],
        "level": [0.0, 0.1, 0.3, 0.2, 0.0, 0.2],
        "sign": [0.0, 0.1, 0.3, 0.2, 0.0, 0.2],
        "direction": [0, 1, 1, -1, -1, 1],
        "outward": [0, 1, 1, -1, -1, 1],
        "path": [0.0, 0.1, 0.3, 0.4, 0.6, 0.8],
        "largest": [0.0, 0.1, 0.3, 0.3, 0.3, 0.3],
        "turns": [0, 0, 0, 1, 1, 2],
    }
    assert found.keys() == wanted.keys()
    for along, values in wanted.items():
        np.testing.assert_allclose(found[along], values, atol=1e-12, err_msg=along)


def test_what_goes_below_zero_goes_outward() -> None:
    """A displacement that goes to -2 mm, home and to 1 mm: its direction has a sign, its size none."""
    robot = load_robot("mitral_4dof")
    path = [0.0, -1.0, -2.0, -1.0, 0.0, 1.0]
    inputs = cs.inputs(robot, {"time_s": range(6), "displacement_torsion_mm": path})
    ways = [argument(robot, inputs, along, "displacement_torsion_mm") for along in ("direction", "outward")]
    np.testing.assert_array_equal(ways, [[0, -1, -1, 1, 1, 1], [0, 1, 1, -1, -1, 1]])


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_begins_at_none_and_comes_to_one(shape: str) -> None:
    """A hat is one at its middle; a logarithm and what waits come to theirs at e - 1 and at infinity."""
    at = {"ramp": (2.0, 4.0), "hat": (2.0, 4.0, 6.0), "between": (2.0, 4.0)}.get(shape, (2.0,))
    along = "place" if shape == "between" else "time"
    values = SHAPES[variation_of(Variation("scale", along, shape, at=at).name).shape].of(
        np.array([0.0, 4.0, 2.0 * (np.e - 1.0), 1e9]), at
    )
    assert values[0] == 0.0
    one = {"logarithmic": 2, "saturating": 3}.get(shape, 1)
    assert values[one] == pytest.approx(2.0 if shape == "linear" else 1.0)


def test_a_file_keeps_it(tmp_path: Path) -> None:
    robot = section(
        stiffness={"scale": 1.0, "scale~time.step(1229.51234)": -0.3},
        drift={"fade~time.linear(60)": -0.1},
        actuation_gain={"scale": 0.9, f"scale~level.linear@{RIGHT}(0.3)": 0.1},
        twist={f"rate_deg_per_m~time.step(30)*outward.step@{RIGHT}(0)": 20.0},
    )
    cs.save_robot(robot, tmp_path / "robot.toml")
    text = (tmp_path / "robot.toml").read_text()
    assert 'with = "level"' in text
    assert "~" not in text
    again = cs.load_robot(tmp_path / "robot.toml")
    assert again.effects == robot.effects


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ('number = "scale"\nwith = "mood"\nshape = "step"\nat = [1]\nby = 1', "unknown with 'mood'"),
        ('number = "scale"\nwith = "time"\nshape = "round"\nat = [1]\nby = 1', "unknown shape 'round'"),
        ('number = "scale"\nwith = "time"\nshape = "ramp"\nat = [1]\nby = 1', "2 finite numbers"),
        ('number = "scale"\nwith = "level"\nshape = "step"\nat = [1]\nby = 1', "needs a channel"),
        ('number = "scale"\nwith = "time"\nshape = "step"\nby = 1', "at is missing"),
        ('number = "scale"\nwith = "time"\nshape = "step"\nat = [1]\nby = "x"', "numbers are needed"),
        ('number = "much"\nwith = "time"\nshape = "step"\nat = [1]\nby = 1', "unknown parameter 'much'"),
        ('number = "scale"\nwith = "time"\nshape = "step"\nat = [1]\nby = 1\nso = 2', "unknown key 'so'"),
        (
            'number = "scale"\nwith = "place"\nshape = "between"\nat = [0, 0.5]\nby = 1\n'
            'times = {with = "time", shape = "step", at = 3}',
            r"varies\[0\]: with = 'place' goes with no second course",
        ),
        (
            'number = "scale"\nwith = "time"\nshape = "step"\nat = [1]\nby = 1\n'
            'times = {with = "level", shape = "step", at = 3}',
            r"varies\[0\]\.times: with = 'level' needs a channel",
        ),
    ],
)
def test_a_wrong_table_is_one_line(tmp_path: Path, table: str, said: str) -> None:
    path = tmp_path / "robot.toml"
    cs.save_robot(section(), path)
    head = path.read_text()
    path.write_text(f"{head}\n[[effects.stiffness.varies]]\n{table}\n")
    with pytest.raises(InputError, match=said) as caught:
        check_effects(cs.load_robot(path))
    assert "\n" not in str(caught.value)


def test_simulation_and_statics_know_it() -> None:
    """A robot that softens at half time: before as the one, then as the other, to the last digit."""
    robot = section(stiffness={"scale": 1.0, "scale~time.step(2.5)": -0.3})
    inputs = pulled(np.array([0.0, 0.1, 0.2, 0.3, 0.2, 0.1]))
    before, after = section(stiffness={"scale": 1.0}), section(stiffness={"scale": 0.7})
    for compute in (cs.simulate, partial(cs.statics, model="fkm")):
        first, second, found = (
            np.array([1e3 * posture.p_w[-1] for posture in compute(item, inputs).postures])
            for item in (before, after, robot)
        )
        np.testing.assert_allclose(found, np.where(np.arange(6)[:, None] > 2, second, first), atol=1e-9)
        assert np.abs(second - first).max() > 5.0


def test_two_courses_are_multiplied() -> None:
    """Softer from 2.5 s on, and then beyond 0.25 N alone: in one row of six."""
    robot = section(stiffness={"scale": 1.0, f"scale~time.step(2.5)*level.step@{RIGHT}(0.25)": -0.3})
    inputs = pulled(np.array([0.0, 0.3, 0.2, 0.3, 0.2, 0.1]))
    before, after, found = (
        tips([item], inputs)[0] for item in (section(), section(stiffness={"scale": 0.7}), robot)
    )
    np.testing.assert_allclose(found, np.where(np.arange(6)[:, None] == 3, after, before), atol=1e-9)


def test_who_takes_a_number_at_one_value_says_so() -> None:
    robot = section(stiffness={"scale": 1.0, "scale~time.step(2.5)": -0.3})
    with pytest.raises(InputError, match=r"stiffness\.varies"):
        cs.build(robot)


def test_a_course_is_of_the_commands() -> None:
    """A robot without such a channel is refused, with the choices."""
    with pytest.raises(InputError, match=r"unknown channel 'bend'; choices: .*tension_right_N"):
        course(section(), there_and_back(), Variation("scale", "level", "step", "bend", (1.0,)))
