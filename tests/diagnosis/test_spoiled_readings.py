"""Checks of the data, each on readings made by hand: what is spoiled is found, what a cause does is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_readings import COLUMNS, LENGTHS_MM, TRIALS, arc, causes, changed, noisy, pull_of, seen, truth

from catheter_sim.diagnosis.faults_of_columns import moved_without_inputs, outputs_out_of_step
from catheter_sim.diagnosis.faults_of_readings import (
    clipped_outputs,
    exchanged_points,
    interpolated_outputs,
    jumps_elsewhere,
)
from catheter_sim.diagnosis.faults_of_trials import moved_between_trials, outstanding_trials

CHECKS = (
    clipped_outputs,
    exchanged_points,
    interpolated_outputs,
    jumps_elsewhere,
    moved_between_trials,
    moved_without_inputs,
    outputs_out_of_step,
    outstanding_trials,
)
ROWS = np.arange(60)[:, None]


@pytest.mark.parametrize("name", causes())
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_a_cause_is_no_fault_of_the_data(check, name):
    """Play, lag, delay, creep, a set that stays, offsets by trial: sound, whatever the model misses."""
    assert check(seen(causes()[name])) == ()


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_outliers_and_missing_cells_are_no_fault(check):
    """One row in fifty ten times the noise off, one cell in twenty missing."""
    generator = np.random.default_rng(5)

    def spoil(number, values):
        off = (generator.random((60, 1)) < 0.02) * 2.0 * generator.normal(size=values.shape)
        return np.where(generator.random(values.shape) < 0.05, np.nan, values + off)

    assert check(seen(changed(spoil))) == ()


def files(faults):
    return [fault.where for fault in faults]


def test_points_that_leap_away_and_come_back():
    """The tip 40 mm off in rows 20 to 23 and 40 to 42 of one trial: the file, the point and the rows."""
    away = ((ROWS >= 19) & (ROWS < 23)) | ((ROWS >= 39) & (ROWS < 42))
    (fault,) = jumps_elsewhere(seen(changed(lambda k, v: v + (k == 2) * away * [30.0, 25.0, 0.0, 0.0])))
    assert fault.where == "trial_2.csv"
    assert fault.rows == (20, 42)
    assert fault.what.startswith("tip leaps away and comes back (7 rows: 20 to 23, 40 to 42)")


def test_markers_that_change_places():
    """Middle and tip exchanged over a third of a trial, also beside a robot that is half as stiff again."""
    for stretch in (1.0, 1.3):

        def spoil(number, values, stretch=stretch):
            values = arc(stretch * pull_of(number))
            taken = (number == 3) & (ROWS >= 30) & (ROWS < 50)
            return np.where(taken, values[:, [2, 3, 0, 1]], values)

        (fault,) = exchanged_points(seen(changed(spoil)))
        assert fault.where == "trial_3.csv"
        assert 28 < fault.rows[0] < 34 < 46 < fault.rows[1] <= 50


@pytest.mark.parametrize("pull", [1.0, 1.4])
def test_a_tracker_that_is_moved_between_trials(pull):
    """By 5 mm, or by 12 deg about the base, from trial 3 on or in one trial; beside a cause, too."""
    turn = np.kron(np.eye(2), [[np.cos(0.2), np.sin(0.2)], [-np.sin(0.2), np.cos(0.2)]])
    for first, last in ((3, TRIALS), (2, 3)):
        for move in (lambda v: v + np.tile([4.0, 3.0], 2), lambda v: v @ turn.T):

            def spoil(number, values, first=first, last=last, move=move):
                values = arc(pull * pull_of(number))
                return move(values) if first <= number < last else values

            (fault,) = moved_between_trials(seen(changed(spoil)))
            assert fault.where == f"trial_{first}.csv"


def test_a_tip_that_alone_lies_elsewhere_is_no_moved_tracker():
    """5 mm at the tip and none at the middle: a robot that has changed."""
    assert moved_between_trials(seen(changed(lambda k, v: v + (k >= 3) * np.array([5.0, 0, 0, 0])))) == ()


def shifted(values, rows):
    """Return a series so many rows later; before zero: earlier."""
    return values[np.clip(np.arange(len(values)) - rows, 0, len(values) - 1)]


@pytest.mark.parametrize("pull", [1.0, 1.1])
def test_outputs_before_their_inputs(pull):
    """Five rows early in one trial, in all of them, or from the middle of one on."""
    early = changed(lambda k, v: shifted(arc(pull * pull_of(k)), -5) if k == 1 else arc(pull * pull_of(k)))
    assert files(outputs_out_of_step(seen(early))) == ["trial_1.csv"]
    everywhere = changed(lambda k, v: shifted(v, -5))
    assert len(outputs_out_of_step(seen(everywhere))) == TRIALS
    lost = changed(lambda k, v: np.where((ROWS >= 30) & (k == 4), shifted(v, -5), v))
    (fault,) = outputs_out_of_step(seen(lost))
    assert fault.where == "trial_4.csv"
    assert "5 rows before" in fault.what


def test_one_long_way_home_with_a_set_comes_in_time():
    """Tendons that stay longer hold the bend back by a constant: on one way home as if it came early."""
    pulls = [pull_of(number) for number in range(TRIALS)]
    pulls[3] = 0.012 * np.interp(ROWS[:, 0], [0, 29, 59], [0.0, 1.0, 0.0])
    longer = [np.maximum(pull - 0.15 * np.maximum.accumulate(pull), 0.0) for pull in pulls]
    measured = [noisy(arc(pull), number) for number, pull in enumerate(longer)]
    assert outputs_out_of_step(seen(measured, [arc(pull) for pull in pulls])) == ()


def test_one_trial_that_is_late_alone():
    """Five rows in one trial and none in the others; not one of fast rows, where all are late by 4 s."""
    alone = changed(lambda k, v: shifted(v, 5) if k == 2 else v)
    assert files(outputs_out_of_step(seen(alone))) == ["trial_2.csv"]
    steps_s = [4.0, 4.0, 0.8, 4.0, 4.0, 4.0]
    late = changed(lambda k, v: shifted(v, round(4.0 / steps_s[k])))
    assert outputs_out_of_step(seen(late, steps_s=steps_s)) == ()


def test_a_late_trial_needs_others_to_say_so():
    """No fault where nothing else drives its channel, or where the others are explained no better."""
    alone = changed(lambda k, v: shifted(v, 5) if k == 2 else v)
    found = seen(alone)
    trials = list(found.trials)
    elsewhere = replace(trials[2].inputs, tendon=trials[2].inputs.tendon[:, ::-1])
    trials[2] = replace(trials[2], inputs=elsewhere)
    assert outputs_out_of_step(replace(found, trials=trials)) == ()
    scattered = [values if k == 2 else noisy(values, 20 + k, 2.0) for k, values in enumerate(alone)]
    assert outputs_out_of_step(seen(scattered)) == ()


def test_trials_that_stand_out():
    """Outputs of other trials, rows in another order, a robot of half the size: one trial of six, or two."""
    other = truth()
    mixed = changed(lambda k, v: other[{1: 4, 4: 1}.get(k, k)])
    assert files(outstanding_trials(seen(mixed))) == ["trial_1.csv", "trial_4.csv"]
    shuffled = changed(lambda k, v: np.random.default_rng(3).permutation(v) if k == 5 else v)
    assert files(outstanding_trials(seen(shuffled))) == ["trial_5.csv"]
    small = changed(lambda k, v: 0.5 * v if k == 0 else v)
    assert files(outstanding_trials(seen(small))) == ["trial_0.csv"]


def test_a_trial_that_follows_nothing_beside_a_large_cause():
    """Noise in one trial, beside a robot that bends half as much again: errors alone would not show it."""
    values = changed(lambda k, v: 0.0 * v + [2.0, 98.0, 0.5, 49.0] if k == 3 else arc(1.5 * pull_of(k)))
    assert files(outstanding_trials(seen(values))) == ["trial_3.csv"]


def test_an_output_that_ends_at_a_limit():
    """The tip's x at 20 mm at most; rounded readings that come again are no limit."""
    clipped = [np.minimum(v, [20.0, np.inf, np.inf, np.inf]) for v in changed(lambda k, v: v)]
    (fault,) = clipped_outputs(seen(clipped))
    assert fault.where == "tip_x_mm"
    assert "20" in fault.what
    assert clipped_outputs(seen([np.round(v / 2.0) * 2.0 for v in changed(lambda k, v: v)])) == ()


def test_a_robot_that_moves_while_its_inputs_stand():
    """The inputs' sensor ends at half the pull; a robot that creeps on while they stand goes one way."""
    found = seen(changed(lambda k, v: v))
    for trial in found.trials:
        np.minimum(trial.inputs.tendon, 0.004, out=trial.inputs.tendon)
    assert moved_without_inputs(found)
    creeping = seen([noisy(arc(np.minimum(0.0003 * np.arange(60.0), 0.012)), k) for k in range(TRIALS)])
    for trial in creeping.trials:
        trial.inputs.tendon[20:] = 0.01
    assert moved_without_inputs(creeping) == ()


def test_rows_that_were_filled_in():
    """Each fifth row measured, lines between; smooth data without noise, and a coarse counter, are not."""
    rows = np.arange(60)
    at = rows[::5]

    def filled(number, values):
        return np.stack([np.interp(rows, at, column[at]) for column in noisy(values, number).T], axis=1)

    (fault,) = interpolated_outputs(seen([filled(k, v) for k, v in enumerate(truth())]))
    assert set(fault.where.split(", ")) <= set(COLUMNS)
    straight = [np.outer(1e3 * pull_of(k), [1.0, 1.0, 0.5, 0.5]) for k in range(TRIALS)]
    assert interpolated_outputs(seen(straight, straight)) == ()
    counted = [np.round(v / 0.5) * 0.5 for v in straight]
    assert interpolated_outputs(seen(counted, straight)) == ()


def test_the_arc_is_an_arc():
    """The points of the tests' own model lie at their arc lengths: a half circle's end is two radii away."""
    (x, z, _, _) = arc(np.array([np.pi / LENGTHS_MM[0]]))[0]
    assert x == pytest.approx(2.0 * LENGTHS_MM[0] / np.pi)
    assert z == pytest.approx(0.0, abs=1e-9)
