"""`[calibration]` in a dataset.toml: which numbers of a specimen are fitted, and what is refused."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.document import leaves, to_document, with_number
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.nuisance import calibration_numbers, nuisances_of
from catheter_sim.diagnosis.prepare import training_problem
from catheter_sim.diagnosis.search import candidates_for
from catheter_sim.diagnosis.trials import split_trials
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.validation.chest_tube_measured import (
    CALIBRATED_RANGES as RANGES,
)
from catheter_sim.validation.chest_tube_measured import (
    HELD_OUT,
    HIDDEN,
    TENSIONS_N,
    hidden_values,
    model_error_percent,
    write_draw,
)

SECTION = load_robot("chest_tube_section")


def test_a_number_is_changed_where_its_key_says():
    """Every number of a specification is reached by its dotted key, and nothing else changes."""
    before = dict(leaves(to_document(SECTION)))
    for key, value in before.items():
        if key.endswith("joints"):
            with pytest.raises(KeyError):
                with_number(SECTION, key, value + 1.0)
            continue
        after = dict(leaves(to_document(with_number(SECTION, key, 0.7))))
        assert after.pop(key) == pytest.approx(0.7)
        assert after == {other: number for other, number in before.items() if other != key}


def test_numbers_start_at_what_is_specified():
    """A calibrated number starts at the specification, infinite ones as their inverse, without a prior."""
    numbers = {item.name: item for item in calibration_numbers(RANGES, SECTION, "test")}
    assert set(numbers) == set(RANGES)
    assert numbers["clearance_mm"].parameter.start == pytest.approx(0.335)
    modulus = numbers["segments.section.link_modulus_Pa"].parameter
    assert modulus.inverse
    assert modulus.to_fit(modulus.start) == 0.0
    assert all(math.isinf(item.spread) for item in numbers.values())
    changed = numbers["friction.mu"].change_robot(SECTION, 0.1)
    assert changed.friction.mu == 0.1


@pytest.mark.slow
def test_what_is_calibrated_is_not_named_a_cause(tmp_path):
    """With friction and stiffness calibrated, neither is tried as a cause; the others are."""
    shapes = np.ones((len(TENSIONS_N), 15, 3)) * np.arange(1.0, 16.0)[:, None] * 15.0
    write_draw(tmp_path, shapes, seed=0)
    dataset = load_dataset(tmp_path)
    train, _ = split_trials(dataset)
    problem = training_problem(dataset, train)
    assert [item.name for item in problem.nuisances] == list(RANGES)
    assert {"tendon_friction", "stiffness"}.isdisjoint(candidates_for(problem))
    assert {"backlash", "actuation_gain", "measurement_frame"} <= set(candidates_for(problem))
    assert len(train[0].inputs) + len(HELD_OUT) == len(TENSIONS_N)


def test_keys_may_be_written_with_or_without_quotes():
    """TOML reads a dotted key without quotes as nested tables: it means the same."""
    flat = calibration_numbers(tomllib.loads('"friction.mu" = [0.0, 1.0]'), SECTION, "test")
    nested = calibration_numbers(tomllib.loads("friction.mu = [0.0, 1.0]"), SECTION, "test")
    assert [item.parameter for item in flat] == [item.parameter for item in nested]


@pytest.mark.parametrize(
    ("table", "named"),
    [
        ({"friction.nu": [0.0, 1.0]}, "unknown number 'friction.nu'"),
        ({"friction.mu": [0.5, 1.0]}, "specified value, 0.316, lies outside"),
        ({"friction.mu": [1.0, 0.0]}, "lower below upper"),
        ({"friction.mu": 0.3}, "lower below upper"),
        ({"friction.mu": [0.0, float("nan")]}, "lower below upper"),
        ({"segments.section.joints": [10, 20]}, "whole number"),
        ({"segments.section.larger_arm_mm": [2.0, 8.0]}, "larger_arm_mm = 8"),
        ({"segments.section.link_modulus_Pa": [0.0, math.inf]}, "link_modulus_mm = 0|must be|above 0"),
        ([1, 2], "a table is needed"),
    ],
)
def test_a_wrong_table_is_one_line(table, named):
    """What is wrong with the table is said in one line that names the key."""
    with pytest.raises(InputError, match=named) as caught:
        calibration_numbers(table, SECTION, "dataset.toml")
    assert "\n" not in str(caught.value)
    assert "calibration" in str(caught.value)


def test_both_arms_of_a_rolling_robot_are_its_moment_arm():
    """The nuisance moment arm scales the moment of a rod at rest, at odd and at even joints."""
    (arm,) = (item for item in nuisances_of("chest_tube_section") if item.name == "moment_arm")
    longer = arm.change_robot(SECTION, 1.01)
    assert isinstance(longer, RollingRobot)
    assert isinstance(SECTION, RollingRobot)
    for name in ("larger_arm_m", "smaller_arm_m"):
        assert getattr(longer.segments[0], name) == pytest.approx(1.01 * getattr(SECTION.segments[0], name))


def test_hidden_values_are_those_of_the_prototype():
    """What the recovery is judged by are the published numbers, the stiffness as a scale of Table II's."""
    values = hidden_values()
    assert values["friction.mu"] == 0.0703
    assert values["clearance_mm"] == pytest.approx(0.60)
    own = 7.79e9 * math.pi / 4.0 * 0.3e-3**4
    assert values["stiffness_scale"] == pytest.approx(own / 25.6e-6)
    assert load_robot(HIDDEN).friction.mu == values["friction.mu"]


def test_model_error_is_relative_to_the_distance_from_the_base():
    """Points off by 1 mm at 50 and 100 mm from the base are off by 1.5 % in the mean (Section IV-A)."""
    measured = np.array([[30.0, 40.0], [0.0, 100.0]])
    assert model_error_percent(measured + np.array([[0.6, 0.8], [1.0, 0.0]]), measured) == pytest.approx(1.5)


def test_a_data_set_with_a_calibration_is_read(tmp_path: Path):
    """The table passes the reader; a misspelt table is refused with the choices."""
    shapes = np.ones((len(TENSIONS_N), 15, 3)) * np.arange(1.0, 16.0)[:, None] * 15.0
    write_draw(tmp_path, shapes, seed=0)
    assert len(load_dataset(tmp_path).calibration) == len(RANGES)
    path = tmp_path / "dataset.toml"
    path.write_text(path.read_text().replace("[calibration]", "[calibrations]"))
    with pytest.raises(InputError, match="calibration"):
        load_dataset(tmp_path)
