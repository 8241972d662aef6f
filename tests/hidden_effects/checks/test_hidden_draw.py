"""Draws of the hidden-effect bench: decided by seed and number, sized as they say."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.effects import EFFECTS
from catheter_sim.lab.robots import BENCH_ROBOTS, bench_robot
from hidden_effects.first_draws import (
    SMALLEST,
    Direction,
    _shown,
    amplitude_for,
    drawn_direction,
    over_noise,
    robot_of,
    setting_of,
    story_of,
)

QUICK = [name for name in BENCH_ROBOTS if name != "neuroendoscope"]


def test_twenty_draws_tell_every_story():
    """Twenty draws in a row hold ten single effects, four pairs, three times nothing, three from outside."""
    for block in range(3):
        stories = Counter(story_of(5, 20 * block + place) for place in range(20))
        assert stories == {"single": 10, "pair": 4, "none": 3, "outside": 3}


def test_every_robot_has_its_turn():
    """As many draws in a row as there are robots meet each robot once, in another order with another seed."""
    count = len(BENCH_ROBOTS)
    orders = [[robot_of(seed, index) for index in range(count)] for seed in (1, 2)]
    assert sorted(orders[0]) == sorted(BENCH_ROBOTS)
    assert orders[0] != orders[1]


@pytest.mark.parametrize("name", QUICK)
def test_setting_is_decided_by_its_key(name):
    """The same key gives the same robot, inputs and noise; another key other inputs."""
    first, again, other = (setting_of((seed, 0, 0), name, False) for seed in (3, 3, 4))
    assert first.built == again.built
    assert first.columns == again.columns
    np.testing.assert_array_equal(first.noise, again.noise)
    for one, two in zip((*first.trials, *first.aside), (*again.trials, *again.aside), strict=True):
        np.testing.assert_array_equal(one.tendon, two.tendon)
    assert not np.array_equal(first.trials[0].tendon, other.trials[0].tendon)


@pytest.mark.parametrize("name", QUICK)
def test_inputs_start_at_rest_and_one_trial_is_repeated(name):
    """Every trial begins with zero inputs at time zero; one training trial repeats the first."""
    setting = setting_of((1, 2, 0), name, False)
    for inputs in (*setting.trials, *setting.aside):
        assert not inputs.tendon[0].any()
        assert inputs.time_s[0] == 0.0
        assert (np.diff(inputs.time_s) > 0.0).all()
    np.testing.assert_array_equal(setting.trials[0].tendon, setting.trials[4].tendon)
    rows = sum(len(inputs) for inputs in setting.trials)
    assert 100 <= rows <= 900


@pytest.mark.parametrize("seed", range(6))
def test_training_trials_pull_every_rod_that_others_do(seed):
    """Nobody could know the scale, say, of a rod that is pulled for the first time on held-out data."""
    setting = setting_of((seed, 2, 0), "chest_tube", False)
    pulled = [
        np.concatenate([item.tendon for item in trials]).any(axis=0)
        for trials in (setting.trials[:5], (*setting.trials[5:], *setting.aside))
    ]
    assert pulled[1].any()
    assert not (pulled[1] & ~pulled[0]).any()


def test_third_set_has_its_own_inputs():
    """No trial of the third set repeats one of the data set."""
    setting = setting_of((1, 2, 0), "chest_tube_section", False)
    for aside in setting.aside:
        assert not any(np.array_equal(aside.tendon, inputs.tendon) for inputs in setting.trials)


def test_errors_of_calibration_stay_in_their_ranges():
    """Stiffness within 3 %, friction within 20 %, arm within 1 % of the specification: the nominal ranges."""
    factors = [setting_of((seed, 0, 0), "chest_tube_section", False).factors for seed in range(20)]
    for name, half in (("elastic_constant", 0.03), ("friction_coefficient", 0.2), ("moment_arm", 0.01)):
        values = np.array([item[name] for item in factors])
        assert np.abs(values - 1.0).max() <= half
        assert np.abs(values - 1.0).max() > 0.5 * half


@pytest.mark.parametrize("slope", [0.3, 7.0])
@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_amplitude_gives_the_wanted_change(slope, power):
    """Where a change grows as some power of an amplitude, the amplitude found gives the wanted one to 3 %."""
    found = amplitude_for(lambda amplitude: slope * amplitude**power, 12.0)
    assert found is not None
    assert slope * found[0] ** power == pytest.approx(12.0, rel=0.03)


def test_amplitude_stops_at_a_bound():
    """Beyond its bound an effect is not possible: the largest amplitude is taken if it shows, else none."""
    shows = amplitude_for(lambda amplitude: 2.0 * amplitude if amplitude <= 4.0 else math.nan, 25.0)
    assert shows is not None
    assert 7.0 < shows[1] <= 8.0
    assert amplitude_for(lambda amplitude: amplitude if amplitude <= SMALLEST / 2 else math.nan, 25.0) is None


@pytest.mark.parametrize("name", QUICK)
def test_directions_leave_the_value_that_does_nothing(name):
    """Every effect of every robot moves off the value that does nothing without leaving its bounds."""
    generator = np.random.default_rng(0)
    robot = bench_robot(name, generator).robot
    for effect in (item for item in EFFECTS if EFFECTS[item].variants(robot)):
        direction = drawn_direction(robot, effect, generator)
        values = direction.values(1e-3)
        assert values is not None, effect
        assert any(values[item.name] != item.null for item in direction.parameters)


def test_size_is_the_rms_over_the_noise():
    """A change of 3 in one of two columns with noise 0.5 and 2 is the root of (6^2 + 0^2) / 2 times noise."""
    ones = [np.ones((5, 2)), np.ones((3, 2))]
    moved = [item + np.array([3.0, 0.0]) for item in ones]
    assert over_noise(moved, ones, np.array([0.5, 2.0])) == pytest.approx(math.sqrt(18.0))


def test_frame_of_a_plane_is_not_turned_out_of_it():
    """What the measured plane does not show of a frame stays as it is."""
    setting = setting_of((1, 0, 0), "neuroendoscope_section", False)
    drawn = drawn_direction(setting.bench.robot, "measurement_frame", np.random.default_rng(1))
    shown = _shown(setting, drawn)
    moved = {item.name for item, share in zip(shown.parameters, shown.share, strict=True) if share}
    assert moved == {"translation_x_mm", "translation_z_mm", "rotation_y_deg"}


def test_scale_of_a_channel_that_no_training_trial_pulls_stays_as_it_is():
    """What held-out trials alone show could not be fitted."""
    setting = setting_of((1, 0, 0), "spacer_disk", False)
    first = np.arange(setting.trials[0].tendon.shape[1]) == 0
    training = [replace(item, tendon=np.where(first, 0.0, item.tendon)) for item in setting.trials[:5]]
    assert any(item.tendon[:, 0].any() for item in setting.trials[5:])
    parameters = EFFECTS["actuation_gain"].forms[0].parameters(setting.bench.robot)[1:]
    every = Direction("actuation_gain", parameters, np.ones(len(parameters)))
    shown = _shown(replace(setting, trials=(*training, *setting.trials[5:])), every)
    assert [item.name for item, share in zip(parameters, shown.share, strict=True) if not share] == [
        parameters[0].name
    ]
