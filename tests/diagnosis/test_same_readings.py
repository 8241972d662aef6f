"""A trial given twice, and readings given twice: found by their digits, not where a robot repeats itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_readings import COLUMNS, NOISE_MM, TRIALS, noisy, trial_of, truth

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis.faults_of_readings import copied_rows
from catheter_sim.diagnosis.readings import copies_in, without_copies, without_old_readings
from catheter_sim.diagnosis.trials import Dataset

ROLES = ("train",) * (TRIALS - 2) + ("heldout",) * 2


def dataset(measured, numbers=tuple(range(TRIALS)), roles=ROLES):
    """Return a data set of some trials' inputs with what was measured."""
    trials = tuple(
        replace(trial_of(number, values, role=role), file=f"file_{k}.csv")
        for k, (number, values, role) in enumerate(zip(numbers, measured, roles, strict=True))
    )
    return Dataset(
        folder=Path("made"),
        name="made",
        robot=load_robot("neuroendoscope_section"),
        robot_reference="neuroendoscope_section",
        source="made",
        licence="none",
        gravity_mps2=np.zeros(3),
        input_channels=("tension_right_N",),
        output_channels=COLUMNS,
        trials=trials,
    )


def sound():
    return [np.round(noisy(values, number), 5) for number, values in enumerate(truth())]


@pytest.mark.parametrize("decimals", [5, 2])
def test_a_training_trial_that_is_held_out_too_is_told(decimals):
    """Whole, spelled as it was or rounded, or a half of it: both files and the rows."""
    for rows in (slice(0, 60), slice(20, 50)):
        values = [*sound(), np.round(sound()[1][rows], decimals)]
        data = dataset(values, (*range(TRIALS), 1), (*ROLES, "heldout"))
        kept, notes, copies = without_copies(data)
        assert kept is data
        assert notes == ()
        (fault,) = copied_rows(data.trials, copies)
        assert fault.where == "file_6.csv"
        assert fault.rows == (1, rows.stop - rows.start)
        assert "file_1.csv, which trains" in fault.what


def test_a_trial_that_trains_twice_is_counted_once():
    """And said; so is one without a role."""
    for roles in ((*ROLES, "train"), ("",) * (TRIALS + 1)):
        data = dataset([*sound(), sound()[0]], (*range(TRIALS), 0), roles)
        kept, (note,), copies = without_copies(data)
        assert [trial.file for trial in kept.trials] == [f"file_{k}.csv" for k in range(TRIALS)]
        assert note.code == "trial_twice"
        assert "file_6.csv: its readings are those of file_0.csv" in note.text
        assert copies == ()


def test_a_repeated_measurement_is_no_copy():
    """The same pull again, with its own noise; in steps of half the noise, or of twenty times it, too."""
    again = np.round(noisy(truth()[0], 99), 5)
    numbers, roles = (*range(TRIALS), 0), (*ROLES, "heldout")
    for step in (1e-5, 0.5 * NOISE_MM, 20.0 * NOISE_MM):
        values = [np.round(item / step) * step for item in (*sound(), again)]
        assert copies_in(dataset(values, numbers, roles)) == ()


def test_computed_trials_that_begin_alike_are_no_copies():
    """Twenty rows without noise that two trials have in common."""
    values = truth()
    values[1] = np.vstack([values[0][:20], values[1][20:]])
    assert copies_in(dataset(values)) == ()


def test_repeated_readings_of_a_slow_sensor_are_missing():
    """Each fifth row measured and repeated: the first of them stays."""
    values = sound()
    values[2] = values[2][np.arange(60) - np.arange(60) % 5]
    kept, (note,) = without_old_readings(dataset(values))
    assert note.code == "old_readings"
    assert "file_2.csv: 48 of 60 rows" in note.text
    column = kept.trials[2].outputs.columns["tip_x_mm"]
    assert np.array_equal(np.isfinite(column), np.arange(60) % 5 == 0)


def test_a_counter_s_repeats_and_rest_are_readings():
    """Steps of a quarter of the motion; rows at rest that read the same."""
    coarse = dataset([np.round(values / 20.0) * 20.0 for values in truth()])
    assert without_old_readings(coarse) == (coarse, ())
    resting = dataset(sound())
    trial = resting.trials[0]
    trial.inputs.tendon[:30] = 0.0
    for column in trial.outputs.columns.values():
        column[:30] = column[0]
    assert without_old_readings(resting)[1] == ()
