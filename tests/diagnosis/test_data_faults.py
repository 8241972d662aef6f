"""Claims about data that are wrong: each mistake gets a line that names it, and no cause is blamed for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import data_set, displacement_history, small_data, small_robot

from catheter_sim.core.inputs import slice_inputs
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.prepare import SUSPECTED, calibrate, find_data_faults, prepare, split_problem
from catheter_sim.diagnosis.readings import without_frozen_readings

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def sound():
    """The small robot's data, nothing wrong with it."""
    return small_data({})


def with_outputs(data, change):
    """Return the data with every trial's output columns changed: (trial's index, columns) to columns."""
    trials = [
        replace(trial, outputs=replace(trial.outputs, columns=change(index, dict(trial.outputs.columns))))
        for index, trial in enumerate(data.trials)
    ]
    return replace(data, trials=tuple(trials))


def with_inputs(data, change):
    """Return the data with every trial's tendon inputs changed."""
    trials = [
        replace(trial, inputs=replace(trial.inputs, tendon=change(trial.inputs.tendon)))
        for trial in data.trials
    ]
    return replace(data, trials=tuple(trials))


def found(data):
    return diagnose_dataset(data, simulation=False)


def assert_doubted(data, words):
    """Assert that no cause is named, and that the first note is the doubt."""
    diagnosis = found(data)
    assert diagnosis.verdict == "data_suspect"
    assert diagnosis.data_faults
    assert diagnosis.causes == ()
    assert diagnosis.notes[0].text.startswith(SUSPECTED)
    assert words in diagnosis.notes[0].text


def assert_too_little(data, words):
    """Assert that no cause is named, and that the first suspicion is what is missing: nothing looks wrong."""
    diagnosis = found(data)
    assert diagnosis.verdict == "data_suspect"
    assert diagnosis.causes == ()
    assert words in diagnosis.data_faults[0].what
    assert not any(note.text.startswith(SUSPECTED) for note in diagnosis.notes)


def test_sound_data_are_not_doubted(sound):
    """Nothing is said of them."""
    diagnosis = found(sound)
    assert diagnosis.verdict == "no_discrepancy"
    assert not any(note.text.startswith(SUSPECTED) for note in diagnosis.notes)


def test_everything_in_metres_is_doubted(sound):
    """Commands and positions 1000 times too small agree with one another: the robot hardly moves."""
    smaller = with_inputs(sound, lambda tendon: 1e-3 * tendon)
    smaller = with_outputs(
        smaller,
        lambda _, columns: {name: values.mean() + 1e-3 * values for name, values in columns.items()},
    )
    assert_doubted(smaller, "The robot hardly moves")


def test_a_cause_of_a_third_of_the_motion_is_no_mistake_in_the_data():
    """A gain of 0.65 is far from any unit's factor, and is named as what it is."""
    diagnosis = found(small_data({"actuation_gain": {"scale": 0.65}}))
    assert diagnosis.verdict == "cause_found"
    assert diagnosis.causes[0].name == "actuation_gain"


@pytest.mark.long
def test_a_cause_that_one_trial_shows_most_is_no_fault_of_that_trial():
    """A zero that creeps, in a trial twenty times as long as others; another robot in it is a fault."""
    creeping = {"drift": {"zero_mm_per_min": 0.03}}
    histories = [displacement_history(seed) for seed in range(3)]
    histories[0] = replace(histories[0], time_s=20.0 * histories[0].time_s)
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    data, sound = (
        data_set(small_robot(), "small.toml", hidden, histories, columns) for hidden in (creeping, {})
    )
    prepared = split_problem(prepare(data))
    assert find_data_faults(prepared, calibrate(prepared)).of_trials
    assert [cause.name for cause in found(data).causes] == ["drift"]
    other = small_data({"stiffness": {"scale": 0.7}})
    assert_doubted(replace(sound, trials=(other.trials[0], *sound.trials[1:])), "trial_0.csv")


def test_swapped_outputs(sound):
    """Two columns of one unit."""

    def swap(index, columns):
        columns["tip_x_mm"], columns["tip_z_mm"] = columns["tip_z_mm"], columns["tip_x_mm"]
        return columns

    assert_doubted(with_outputs(sound, swap), "tip_x_mm and tip_z_mm look swapped")


def test_outputs_in_other_units(sound):
    """All columns in inches; one column in centimetres."""
    inches = with_outputs(sound, lambda index, columns: {name: v / 25.4 for name, v in columns.items()})
    assert_doubted(inches, "inches for mm")
    one = with_outputs(sound, lambda index, columns: columns | {"tip_x_mm": 0.1 * columns["tip_x_mm"]})
    assert_doubted(one, "The unit of tip_x_mm looks wrong: cm for mm")


def test_an_axis_that_points_the_other_way(sound):
    """A column with its sign turned."""
    turned = with_outputs(sound, lambda index, columns: columns | {"tip_x_mm": -columns["tip_x_mm"]})
    assert_doubted(turned, "tip_x_mm looks turned in sign")


def test_swapped_inputs(sound):
    """Two tendons of three."""
    swapped = with_inputs(sound, lambda tendon: tendon[:, [1, 0, 2]])
    assert_doubted(swapped, "displacement_t0_mm and displacement_t1_mm look swapped")


def test_inputs_in_another_unit(sound):
    """Micrometres in a column called mm."""
    assert_doubted(with_inputs(sound, lambda tendon: 1e3 * tendon), "um for mm")


def test_inputs_that_never_change(sound):
    """Nothing can be told from one posture."""
    assert_too_little(with_inputs(sound, lambda tendon: np.full_like(tendon, 1e-3)), "never change")


def test_a_trial_of_another_robot(sound):
    """A third softer in one trial, a training one or the held-out one: its file is named."""
    other = small_data({"stiffness": {"scale": 0.7}})
    assert_doubted(replace(sound, trials=(other.trials[0], *sound.trials[1:])), "trial_0.csv")
    assert_doubted(replace(sound, trials=(*sound.trials[:-1], other.trials[-1])), "trial_2.csv")


def test_ten_rows(sound):
    """Ten rows in all prove nothing."""
    cut = slice(0, 5)
    trials = [
        replace(
            trial,
            inputs=slice_inputs(trial.inputs, cut),
            outputs=replace(
                trial.outputs,
                time_s=trial.outputs.time_s[cut],
                columns={name: values[cut] for name, values in trial.outputs.columns.items()},
            ),
        )
        for trial in sound.trials[-2:]
    ]
    assert_too_little(replace(sound, trials=tuple(trials)), "fewer than 60")


def test_a_frozen_sensor_is_taken_out_and_said(sound):
    """What repeats is missing from then on; the rest is diagnosed as ever."""

    def freeze(index, columns):
        if index == 0:
            columns["tip_x_mm"] = np.array(columns["tip_x_mm"])
            columns["tip_x_mm"][20:45] = columns["tip_x_mm"][20]
        return columns

    cold = with_outputs(sound, freeze)
    warm, notes = without_frozen_readings(cold)
    assert np.isnan(warm.trials[0].outputs.columns["tip_x_mm"][21:45]).all()
    assert np.isfinite(warm.trials[0].outputs.columns["tip_x_mm"][:21]).all()
    assert len(notes) == 1
    assert "trial_0.csv: tip_x_mm repeats" in notes[0].text
    diagnosis = found(cold)
    assert diagnosis.verdict == "no_discrepancy"
    assert notes[0] in diagnosis.notes


def test_a_robot_at_rest_is_no_frozen_sensor(sound):
    """Values that repeat while nothing moves stay."""

    def rest(index, columns):
        return {name: np.where(np.arange(len(v)) < 30, v[0], v) for name, v in columns.items()}

    still = with_inputs(
        with_outputs(sound, rest), lambda tendon: np.where(np.arange(len(tendon))[:, None] < 30, 0.0, tendon)
    )
    assert without_frozen_readings(still)[1] == ()


def test_a_third_missing_changes_no_verdict(sound):
    """Cells left out at random, nothing planted: no discrepancy."""

    def thin(index, columns):
        generator = np.random.default_rng(index)
        return {name: np.where(generator.random(len(v)) < 0.3, np.nan, v) for name, v in columns.items()}

    assert found(with_outputs(sound, thin)).verdict == "no_discrepancy"


def noise_of(size):
    """Return a change that puts white noise of a size in the place of every output."""
    generator = np.random.default_rng(3)
    return lambda index, columns: {name: size * generator.normal(size=len(v)) for name, v in columns.items()}


@pytest.mark.parametrize("size", [0.1, 5.0, 30.0])
def test_noise_is_no_measurement(sound, size):
    """Outputs of noise alone, less or more than the robot moves, have no cause."""
    doubted = found(with_outputs(sound, noise_of(size)))
    assert doubted.verdict == "data_suspect"
    assert doubted.causes == ()


@pytest.mark.parametrize("wander", [0.0, 0.1, 0.5])
def test_a_tracker_that_hangs_on_nothing(sound, wander):
    """It shows one place, or wanders slowly, while the robot is driven."""
    generator = np.random.default_rng(5)

    def loose(index, columns):
        return {
            name: 40.0
            + np.cumsum(wander * generator.normal(size=len(v)))
            + 0.1 * generator.normal(size=len(v))
            for name, v in columns.items()
        }

    assert_doubted(with_outputs(sound, loose), "Is the tracker attached")


@pytest.mark.parametrize("trial", [0, 1, 2])
def test_a_tracker_that_is_bumped(sound, trial):
    """15 mm from the middle of one trial on, a held-out one too: the file and the row are named."""
    rows = len(sound.trials[trial].inputs)

    def bump(index, columns):
        late = (np.arange(rows) >= rows // 2) * (index == trial)
        return columns | {"tip_x_mm": columns["tip_x_mm"] + 15.0 * late}

    diagnosis = found(with_outputs(sound, bump))
    assert diagnosis.verdict == "data_suspect"
    (doubt,) = diagnosis.data_faults
    assert doubt.where == f"trial_{trial}.csv"
    assert doubt.rows == (rows // 2 + 1, rows)


@pytest.mark.long
def test_a_bump_is_found_beside_a_cause():
    """The same of a robot that is a fifth softer than the model says."""
    soft = small_data({"stiffness": {"scale": 0.8}})
    rows = len(soft.trials[1].inputs)

    def bump(index, columns):
        late = (np.arange(rows) >= 30) * (index == 1)
        return {name: values + 8.0 * late for name, values in columns.items()}

    (doubt,) = found(with_outputs(soft, bump)).data_faults
    assert doubt.where == "trial_1.csv"
    assert doubt.rows[0] == 31


def test_a_mistake_is_found_in_a_trackers_own_frame(sound):
    """Two tendons swapped and the tracker a metre away."""
    swapped = with_inputs(sound, lambda tendon: tendon[:, [1, 0, 2]])
    away = with_outputs(swapped, lambda index, columns: {name: v + 1e3 for name, v in columns.items()})
    assert_doubted(away, "displacement_t0_mm and displacement_t1_mm look swapped")
