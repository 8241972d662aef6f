"""Mistakes in one trial alone, and in all points at once, on readings made by hand."""

from __future__ import annotations

import numpy as np
import pytest
from made_readings import COLUMNS, TRIALS, arc, causes, changed, pull_of, seen

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis.faults_of_columns import most_likely_mistake
from catheter_sim.diagnosis.faults_of_trials import mistakes_of_one_trial

ROBOT = load_robot("neuroendoscope_section")


def predict(inputs):
    """Return the arc's outputs along its tendons: the right one pulls, the left one back."""
    return arc(inputs.tendon[:, 0] - inputs.tendon[:, 1])


def of_one(measured):
    return mistakes_of_one_trial(seen(measured), ROBOT, predict)


def in_all(measured):
    return most_likely_mistake(seen(measured).trials, COLUMNS, ROBOT, predict)


SPOILED = {
    "The x axis of all points looks turned": lambda v: v * [-1.0, 1.0, -1.0, 1.0],
    "The axes x and z of all points look exchanged": lambda v: v[:, [1, 0, 3, 2]],
    "The points tip and body_5 look exchanged": lambda v: v[:, [2, 3, 0, 1]],
    "The columns tip_x_mm and tip_z_mm look swapped": lambda v: v[:, [1, 0, 2, 3]],
    "The unit of tip_x_mm looks wrong: m for mm": lambda v: v * [1e-3, 1.0, 1.0, 1.0],
}


@pytest.mark.parametrize("words", SPOILED)
@pytest.mark.parametrize("stretch", [1.0, 1.25])
def test_a_mistake_is_named(words, stretch):
    """In one trial, with its file, or in all; beside a robot that bends a quarter more, too."""
    sound = changed(lambda k, v: arc(stretch * pull_of(k)))
    (fault,) = of_one([SPOILED[words](v) if k == 2 else v for k, v in enumerate(sound)])
    assert fault.where == "trial_2.csv"
    assert fault.what.startswith(words)
    found = in_all([SPOILED[words](v) for v in sound])
    assert found is not None
    assert found.words.startswith(words)


@pytest.mark.parametrize("unit", [1e-3, 1.0 / 25.4])
def test_one_trial_in_another_unit(unit):
    """All positions in m, or in inches."""
    sound = changed(lambda k, v: v)
    (fault,) = of_one([unit * v if k == 4 else v for k, v in enumerate(sound)])
    assert fault.where == "trial_4.csv"
    what = "m for mm" if unit == 1e-3 else "inches for mm"
    assert fault.what.startswith(f"The unit of all columns in mm looks wrong: {what}")


def test_inputs_in_grams():
    """Of one trial: a thousandth of its inputs times 9.80665 is what pulled."""
    found = seen(changed(lambda k, v: v))
    found.trials[1].inputs.tendon[:] *= 1e3 / 9.80665
    models = [predict(trial.inputs) for trial in found.trials]
    again = seen(found.measured, models)
    again.trials[1].inputs.tendon[:] *= 1e3 / 9.80665
    (fault,) = mistakes_of_one_trial(again, ROBOT, predict)
    assert fault.where == "trial_1.csv"
    assert "gf for N" in fault.what


def test_a_zero_that_is_off_in_one_trial():
    """By 15 % of the largest pull."""
    (fault,) = of_one(changed(lambda k, v: arc(np.maximum(pull_of(k) - 0.0018 * (k == 3), 0.0))))
    assert fault.where == "trial_3.csv"
    assert "looks off by about 15 %" in fault.what


@pytest.mark.parametrize("name", causes())
def test_causes_are_no_mistakes(name):
    """Nothing is put right in sound readings, whatever is at work."""
    assert of_one(causes()[name]) == ()
    assert in_all(causes()[name]) is None


def test_a_trial_in_which_nothing_moves_is_in_no_other_unit():
    """Inputs divided by a thousand would fit a tracker that hangs on nothing."""
    faults = of_one(changed(lambda k, v: 0.0 * v + [2.0, 99.0, 1.0, 50.0] if k == TRIALS - 1 else v))
    assert not any("unit" in fault.what for fault in faults)
