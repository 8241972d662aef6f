"""`[calibration]`: several numbers of the robot that are one, and where a marker lies."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from planted import data_set, displacement_history, small_robot

import catheter_sim as cs
from catheter_sim.core.robot import Marker
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.nuisance import calibration_numbers
from catheter_sim.diagnosis.prepare import training_problem
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.spec import ContinuumRobot

RADII = ["tendons.t0.radius_mm", "tendons.t1.radius_mm", "tendons.t2.radius_mm"]


def marked() -> ContinuumRobot:
    """Return a robot of three tendons with a ring beside its last disk."""
    return replace(small_robot(), markers=(Marker("ring", 8, offset_x_m=6e-3),))


def test_one_number_stands_for_several() -> None:
    """Of the same value: what they all are. Of others: a factor on each."""
    robot = marked()
    (radius,) = calibration_numbers({"hole_mm": {"keys": RADII, "range": [4.0, 4.9]}}, robot, "here")
    assert (radius.name, radius.parameter.null) == ("hole_mm", pytest.approx(4.5))
    changed = radius.change_robot(robot, 4.7)
    assert isinstance(changed, ContinuumRobot)
    assert [item.radius_m for item in changed.tendons] == pytest.approx([4.7e-3] * 3)
    assert replace(changed, tendons=robot.tendons) == robot
    first, *others = robot.tendons
    uneven = replace(robot, tendons=(replace(first, radius_m=4e-3), *others))
    (share,) = calibration_numbers({"holes": {"keys": RADII, "factor": [0.9, 1.1]}}, uneven, "here")
    changed = share.change_robot(uneven, 1.1)
    assert isinstance(changed, ContinuumRobot)
    assert [item.radius_m for item in changed.tendons] == pytest.approx([4.4e-3, 4.95e-3, 4.95e-3])


def test_a_cause_that_says_the_same_is_not_tried() -> None:
    """Tied springs of the tendons stand for their elongation, as a single one does."""
    keys = [f"tendons.t{k}.stiffness_N_per_mm" for k in range(3)]
    (spring,) = calibration_numbers({"spring": {"keys": keys, "range": [2.0, 20.0]}}, marked(), "here")
    (alone,) = calibration_numbers({keys[0]: [2.0, 20.0]}, marked(), "here")
    assert spring.stands_for == alone.stands_for


@pytest.mark.slow
def test_a_planted_offset_of_a_marker_and_a_tied_radius_are_found() -> None:
    """Both at once, with 0.05 mm of noise: the ring 1.3 mm farther out, all holes 0.2 mm."""
    specified = marked()
    ring = replace(specified.markers[0], offset_x_m=7.3e-3, offset_y_m=-0.8e-3)
    holes = tuple(replace(item, radius_m=4.7e-3) for item in specified.tendons)
    hidden = replace(specified, markers=(ring,), tendons=holes)
    columns = tuple(f"{point}_{axis}_mm" for point in ("body_4", "marker_ring") for axis in "xyz")
    histories = [displacement_history(seed, cycles=3) for seed in (1, 2)]
    measured = data_set(hidden, "small", {}, histories, columns, noise_mm=0.05)
    table = tomllib.loads(
        "markers.ring.offset_x_mm = [4.0, 9.0]\nmarkers.ring.offset_y_mm = [-3.0, 3.0]\n"
        f"hole_mm = {{ keys = {RADII}, range = [4.0, 4.9] }}"
    )
    numbers = calibration_numbers(table, specified, "here")
    dataset = replace(measured, robot=specified, calibration=numbers)
    problem = training_problem(dataset, dataset.trials[:1])
    found = {name: value for (_, name), value in fit(problem, (), cross_validate=False).values.items()}
    assert found["markers.ring.offset_x_mm"] == pytest.approx(7.3, abs=0.1)
    assert found["markers.ring.offset_y_mm"] == pytest.approx(-0.8, abs=0.1)
    assert found["hole_mm"] == pytest.approx(4.7, abs=0.05)


def test_data_from_frames_may_tie_numbers_too() -> None:
    """As tuples or lists."""
    time_s = np.arange(4.0)
    trial = {"time_s": time_s, "displacement_t0_mm": time_s, "tip_x_mm": 2.0 * time_s}
    again = trial | {"tip_x_mm": 2.1 * time_s}
    tied = {"hole_mm": {"keys": tuple(RADII), "range": (4.0, 4.9)}}
    dataset = cs.dataset(marked(), [trial, again], calibration=tied)
    assert dataset.calibration is not None
    assert [item.name for item in dataset.calibration] == ["hole_mm"]


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("keys = [A], range = [4, 5]", "keys: a list of two numbers of the robot or more"),
        ("keys = [A, 3], range = [4, 5]", "keys: a list of two numbers of the robot or more"),
        ("keys = [A, 'tendons.t9.radius_mm'], range = [4, 5]", "unknown number 'tendons.t9.radius_mm'"),
        ("keys = [A, A], range = [4.1, 4.9]", "tendons.t0.radius_mm is calibrated already"),
        ("keys = [A, B]", "range = .* or factor = .* is needed"),
        ("keys = [A, B], range = [4, 5], factor = [0.9, 1.1]", "one of them"),
        ("keys = [A, B], ranges = [4, 5]", "unknown key 'ranges'; choices: keys, range, factor"),
        ("keys = [A, B], range = [4.6, 4.9]", "the specified value, 4.5, lies outside"),
        ("keys = [A, B], range = [4.0, nan]", "lower below upper"),
        ("keys = [A, B], range = [4.0, 5.5]", "= 5.5: tendons.t0.radius_mm = 5.5: the tendon lies outside"),
        ("keys = [A, B], factor = [1.1, 1.2]", "the specified value, 1, lies outside"),
        ("keys = [A, 'tendons.t1.pretension_N'], range = [1, 5]", "are no numbers of one sort"),
        ("keys = [A, 'tendons.t1.angle_deg'], range = [1, 5]", "are no numbers of one sort"),
        ("keys = ['tendons.t0.angle_deg', 'tendons.t1.angle_deg'], range = [1, 50]", "numbers that differ"),
        ("keys = ['segments.arm.disks', 'markers.ring.element'], factor = [0.5, 2]", "is a whole number"),
        ("keys = [A, 'segments.arm.torsion_stiffness_N_mm2'], factor = [0.5, 2]", "among them is inf"),
        ("keys = [A, 'tendons.t0.channel_gain'], factor = [0.5, 2]", "inputs are read with tendons.t0"),
    ],
)  # fmt: skip
def test_what_cannot_be_tied_is_one_line(line: str, named: str) -> None:
    """The line names the entry and what is wrong with it."""
    text = (
        line.replace("[A", f"['{RADII[0]}'")
        .replace(" A]", f" '{RADII[0]}']")
        .replace(" B]", f" '{RADII[1]}']")
    )
    with pytest.raises(InputError, match=named) as caught:
        calibration_numbers(tomllib.loads(f"hole = {{ {text} }}"), marked(), "dataset.toml")
    assert str(caught.value).startswith("dataset.toml: calibration.hole")
    assert "\n" not in str(caught.value)


def test_a_number_is_calibrated_once() -> None:
    """By itself and in a tie is twice; a tie's name is none of the robot's."""
    tie = {"keys": RADII, "range": [4.0, 4.9]}
    with pytest.raises(InputError, match=r"calibration\.hole: tendons\.t0\.radius_mm is calibrated already"):
        calibration_numbers({RADII[0]: [4.0, 4.9], "hole": tie}, marked(), "here")
    with pytest.raises(InputError, match="stiffness_scale: is a number of the robot"):
        calibration_numbers({"stiffness_scale": tie}, marked(), "here")
