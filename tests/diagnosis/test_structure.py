"""Claims about the tests of residuals: they find what is planted, and err on noise as often as they say."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import pulled_by

from catheter_sim.diagnosis.residuals import STRUCTURE_DRAWS, TESTS, _tested, structure_tests, turning_points
from catheter_sim.diagnosis.result import TrialFit
from catheter_sim.tables import Table

CYCLES, ROWS = 16, 24
COLUMNS = ("body_1_x_mm", "body_1_y_mm", "body_2_x_mm", "body_2_y_mm", "tip_x_mm", "tip_y_mm")
SIZE = {"body_1": 0.3, "body_2": 0.6, "tip": 1.0}
SHARE = np.concatenate([np.linspace(0.0, 1.0, ROWS // 2), np.linspace(1.0, 0.0, ROWS // 2)])
HEADING = np.repeat(np.random.default_rng(3).uniform(0.3, 1.27, CYCLES), ROWS)
PULL = np.tile(SHARE, CYCLES) * np.repeat(np.random.default_rng(4).uniform(0.6, 1.0, CYCLES), ROWS)
AXIS = {"x": np.cos(HEADING), "y": np.sin(HEADING)}


def judged(residual):
    """Return the tests by name, of measurements that are off by `residual`: column to shape (n,)."""
    computed, measured = {}, {}
    for name in COLUMNS:
        point, axis, _ = name.rsplit("_", 2)
        computed[name] = 40.0 * SIZE[point] * PULL * AXIS[axis]
        measured[name] = computed[name] + residual(name)
    dataset = pulled_by(PULL, measured)
    trial = dataset.trials[0]
    time_s, table = trial.inputs.time_s, trial.outputs
    model = Table(time_s, computed)
    found = structure_tests(
        dataset, [TrialFit("a.csv", "heldout", time_s, table, model, model)], "mm", "before"
    )
    return {item.name: item for item in found}


def slow_noise(generator):
    """Return noise that hangs together from row to row inside a cycle, and not from cycle to cycle."""
    white = generator.normal(size=(CYCLES, ROWS))
    result = np.empty_like(white)
    result[:, 0] = white[:, 0]
    for row in range(1, ROWS):
        result[:, row] = 0.9 * result[:, row - 1] + np.sqrt(1.0 - 0.9**2) * white[:, row]
    return 0.1 * result.ravel()


@pytest.mark.slow
def test_noise_is_called_structure_as_rarely_as_promised():
    """200 draws of noise that hangs together inside cycles: p below 0.05 in some 5 % of them, per test."""
    generator = np.random.default_rng(11)
    below = dict.fromkeys(TESTS, 0)
    for _ in range(200):
        noise = {name: slow_noise(generator) for name in COLUMNS}
        for name, found in judged(noise.__getitem__).items():
            below[name] += found.p_value <= 0.05
    assert all(count <= 20 for count in below.values()), below
    assert sum(below.values()) >= 20  # and no test is deaf


@pytest.mark.parametrize(
    ("name", "others", "shape"),
    [
        ("direction", ("arc length", "out of plane", "time"), lambda column, side: 0.1 * side),
        ("position", ("arc length", "out of plane", "time"), lambda column, side: 0.2 * (PULL > 0.5) - 0.1),
        (
            "time",
            ("arc length", "out of plane", "direction"),
            lambda column, side: np.linspace(-0.1, 0.1, len(PULL)),
        ),
    ],
    ids=["friction", "stiffness", "drift"],
)
def test_what_is_planted_is_found(name, others, shape):
    """An error that hangs on one thing is significant there, and not where it does not hang."""
    generator = np.random.default_rng(5)
    side = turning_points(PULL)[0]
    noise = {column: shape(column, side) + slow_noise(generator) for column in COLUMNS}
    found = judged(noise.__getitem__)
    assert found[name].significant, found[name]
    assert not any(found[other].significant for other in others), found


def test_waves_over_the_input_are_found_in_fine_steps():
    """A pulley out of true leaves six waves: eight groups see nothing of them by a quarter, fine ones do."""
    generator = np.random.default_rng(8)
    wave = 0.3 * np.sin(2.0 * np.pi * 6.0 * PULL)
    found = judged({column: wave + slow_noise(generator) for column in COLUMNS}.__getitem__)
    assert found["fine input"].significant
    assert found["fine input"].share_percent > 50.0
    assert all(found[name].share_percent < 25.0 for name in ("input", "position", "direction", "history"))


def test_noise_has_no_share_in_fine_steps():
    """What two dozen groups take of noise by chance is taken out of the share."""
    generator = np.random.default_rng(9)
    noise = {column: slow_noise(generator) for column in COLUMNS}
    assert judged(noise.__getitem__)["fine input"].share_percent < 5.0


def test_error_that_grows_along_the_robot_is_found():
    """Residuals in proportion to the place along the robot, the mean over all elements being zero."""
    generator = np.random.default_rng(6)
    place = {"body_1": -0.1, "body_2": 0.0, "tip": 0.1}
    noise = {column: place[column.rsplit("_", 2)[0]] + slow_noise(generator) for column in COLUMNS}
    assert judged(noise.__getitem__)["arc length"].significant


def test_twist_is_found_out_of_the_plane_and_not_as_direction():
    """A turn about the axis by 1 deg: out of the bending plane, whatever its heading."""
    generator = np.random.default_rng(7)
    angle = np.radians(1.0)

    def turned(column):
        point, axis, _ = column.rsplit("_", 2)
        other = {"x": -AXIS["y"], "y": AXIS["x"]}[axis]
        return 40.0 * SIZE[point] * PULL * angle * other + slow_noise(generator)

    found = judged(turned)
    assert found["out of plane"].significant
    assert not found["direction"].significant


def test_strongest_of_many_coordinates_is_judged_as_one_of_many():
    """Noise, and twenty coordinates that it might hang on: the strongest is below 5 % in 5 of 100 draws, and
    its p-values are spread evenly; one that had been asked for alone would be below it in 64."""
    generator = np.random.default_rng(8)
    blocks, groups, draws = 12, 4, 120
    found = []
    for _ in range(draws):
        signs = generator.choice([-1.0, 1.0], size=(blocks, STRUCTURE_DRAWS))
        sums = {
            f"coordinate {k}": [(generator.normal(size=(groups, blocks)), np.full(groups, float(blocks)))]
            for k in range(20)
        }
        test = _tested("input", sums, signs, 1e3)
        assert test is not None
        found.append(test.p_value)
    assert np.mean(np.array(found) <= 0.05) <= 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / draws)
    assert np.mean(found) == pytest.approx(0.5, abs=4.0 * np.sqrt(1.0 / 12.0 / draws))
