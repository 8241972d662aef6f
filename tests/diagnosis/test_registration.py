"""A tracker has its own origin, axes and unit: the answer is the one of data in the robot's base frame."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from planted import catheter_data, data_set, pair_history, section_data, small_data
from scipy.spatial.transform import Rotation

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis.frame import frame_numbers
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.prepare import in_base_frame
from catheter_sim.diagnosis.trials import points_of

pytestmark = pytest.mark.xdist_group("registration")  # diagnoses are shared

SHIFT = (500.0, 300.0, 900.0)
NO_TURN = np.eye(3)


def turned(axis: str, angle: float = 90.0) -> np.ndarray:
    """Return a turn about an axis, shape (3, 3)."""
    return Rotation.from_euler(axis, angle, degrees=True).as_matrix()


def seen_from(data, R=NO_TURN, shift=(0.0, 0.0, 0.0), factor=1.0, clock_s=0.0):
    """Return the data as a tracker elsewhere would have them: p = factor (R p + shift), clocks later."""
    trials = []
    for trial in data.trials:
        columns = dict(trial.outputs.columns)
        names = tuple(columns)
        for axes in points_of(names).values():
            before = [columns[names[axes[a]]] if a in axes else np.zeros(len(trial.inputs)) for a in "xyz"]
            after = factor * (R @ np.array(before) + np.array(shift)[:, None])
            columns |= {names[index]: after["xyz".index(axis)] for axis, index in axes.items()}
        time_s = trial.inputs.time_s + clock_s
        trials.append(
            replace(
                trial,
                inputs=replace(trial.inputs, time_s=time_s),
                outputs=replace(trial.outputs, time_s=time_s, columns=columns),
            )
        )
    return replace(data, trials=tuple(trials))


@pytest.fixture(scope="module")
def soft():
    """A small robot a fifth softer than specified, measured in three coordinates."""
    return small_data({"stiffness": {"scale": 0.8}})


FRAMES = {
    "a metre away": {"shift": (1000.0, 0.0, 0.0)},
    "80 mm away": {"shift": (0.0, 80.0, 0.0)},
    "turned about x": {"R": turned("x")},
    "turned about y": {"R": turned("y")},
    "turned about z": {"R": turned("z")},
    "in metres": {"factor": 1e-3},
    "in metres, away and turned": {"factor": 1e-3, "shift": SHIFT, "R": turned("y")},
    "turned by any angle, and away": {"R": turned("xyz", [40.0, -35.0, 50.0]), "shift": SHIFT},
    "in epoch seconds": {"clock_s": 1.7e9},
}


@pytest.fixture(scope="module")
def diagnosed(soft):
    """Gives the diagnosis of the soft robot's data in a frame, "" for the base's; each is made once."""
    return cache(lambda frame: diagnose_dataset(seen_from(soft, **FRAMES.get(frame, {})), simulation=False))


@pytest.mark.slow
@pytest.mark.parametrize("frame", FRAMES)
def test_a_trackers_frame_changes_no_answer(diagnosed, frame):
    """The same cause, its number to a tenth of its interval, the same gain to two percent of the error."""
    clean, found = diagnosed(""), diagnosed(frame)
    assert (found.verdict, [item.name for item in found.causes]) == ("cause_found", ["stiffness"])
    (mine,), (theirs,) = ([*item.causes[0].parameters.values()] for item in (found, clean))
    assert mine.value == pytest.approx(theirs.value, abs=0.1 * (theirs.ci95[1] - theirs.ci95[0]))
    assert mine.ci95 == pytest.approx(theirs.ci95, abs=0.1 * (theirs.ci95[1] - theirs.ci95[0]))
    assert found.headline.gain_percent == pytest.approx(clean.headline.gain_percent, abs=2.0)


@pytest.mark.slow
@pytest.mark.parametrize("frame", FRAMES)
def test_the_motion_is_told(diagnosed, frame):
    """Turn and shift come out as they were put in, though the model is wrong by a fifth of its stiffness."""
    put_in = {"R": np.eye(3), "shift": (0.0, 0.0, 0.0), "factor": 1.0} | FRAMES[frame]
    told = diagnosed(frame).registration
    turn = Rotation.from_rotvec(told["rotation_deg"], degrees=True).as_matrix()
    assert turn == pytest.approx(put_in["R"], abs=0.005)
    assert told["translation_mm"] == pytest.approx(put_in["shift"], abs=0.3)
    assert told["factor"] == pytest.approx(1.0 / put_in["factor"])
    assert told["applied"] is (frame != "in epoch seconds")
    assert told["rotation_identifiable"]


@pytest.mark.slow
def test_a_slight_turn_of_a_tracker_far_away_is_a_cause_still(soft):
    """5 deg beside a shift of 400 mm: the shift is registered, the turn is named, and the softness too."""
    R = Rotation.from_rotvec([3.0, -2.0, 2.0], degrees=True).as_matrix()
    found = diagnose_dataset(seen_from(soft, R=R, shift=(100.0, 200.0, 300.0)), simulation=False)
    causes = {item.name: item.parameters for item in found.causes}
    assert set(causes) == {"measurement_frame", "stiffness"}
    for axis, angle in zip("xyz", (3.0, -2.0, 2.0), strict=True):
        assert causes["measurement_frame"][f"rotation_{axis}_deg"].value == pytest.approx(angle, abs=0.3)


def assert_it_stays(data):
    """Assert that data are taken as of the base frame."""
    moved, registration = in_base_frame(data)
    assert moved is data
    assert not registration.applied
    assert frame_numbers(registration) == ()


@pytest.mark.slow
def test_data_in_the_base_frame_stay_as_they_are(soft):
    """Nothing is moved where a model errs, by a stiffness or a drive's scale; nor by a slight frame."""
    assert_it_stays(soft)
    assert_it_stays(small_data({"measurement_frame": {"translation_x_mm": 20.0, "rotation_y_deg": 10.0}}))
    assert_it_stays(catheter_data({"actuation_gain": {"scale": 1.3}}))


@pytest.mark.long
@pytest.mark.parametrize(
    ("make", "effects"),
    [
        (small_data, {"payload": {"force_x_N": 0.3}}),
        (section_data, {"backlash": {"width_N": 0.06}}),
        (section_data, {"stiffness": {"scale": 0.6}}),
    ],
)
def test_a_load_a_dead_band_or_soft_sections_move_nothing_either(make, effects):
    """The same of other causes, the sections with their friction."""
    assert_it_stays(make(effects))


@pytest.mark.long
def test_two_measured_coordinates_turn_in_their_plane():
    """A planar robot measured in x and z alone: a quarter turn about y and a shift, and no mirror image."""
    data = section_data({"backlash": {"width_N": 0.03}})
    clean = diagnose_dataset(data, simulation=False)
    found = diagnose_dataset(seen_from(data, R=turned("y"), shift=SHIFT), simulation=False)
    assert [item.name for item in found.causes] == ["backlash"]
    values = [item.causes[0].parameters["width_N"].value for item in (clean, found)]
    assert values[0] == pytest.approx(values[1], rel=0.01)
    told = found.registration
    assert told["rotation_deg"] == pytest.approx([0.0, 90.0, 0.0], abs=1e-9)
    assert told["translation_mm"][1] == 0.0  # y was not measured
    assert set(told["fitted"]) == {"frame_shift_x_mm", "frame_shift_z_mm"}


def line_data():
    """Return data of the catheter's tip as it advances: places on a line."""
    data = catheter_data({})
    trials = []
    for trial in data.trials:
        columns = {name: np.zeros(len(trial.inputs)) for name in ("tip_x_mm", "tip_y_mm")}
        columns["tip_z_mm"] = 57.34 + 1e3 * trial.inputs.tendon[:, 3]
        inputs = replace(trial.inputs, tendon=trial.inputs.tendon * np.array([0.0, 0.0, 0.0, 1.0]))
        trials.append(replace(trial, inputs=inputs, outputs=replace(trial.outputs, columns=columns)))
    return replace(data, trials=tuple(trials), output_channels=("tip_x_mm", "tip_y_mm", "tip_z_mm"))


@pytest.mark.slow
def test_points_on_a_line_leave_the_turn_about_it_open():
    """That is said, and the least turn taken."""
    moved, registration = in_base_frame(seen_from(line_data(), R=turned("y")))
    assert not registration.turn_known
    assert Rotation.from_matrix(registration.R_bt.T).magnitude() == pytest.approx(np.pi / 2.0)
    before = line_data().trials[0].outputs.columns
    for name, values in moved.trials[0].outputs.columns.items():
        assert values == pytest.approx(before[name], abs=1e-9)


@pytest.mark.slow
def test_the_tips_orientation_turns_too(soft):
    """Quaternions of the tip come back into the base frame with its place."""
    trials = []
    generator = np.random.default_rng(0)
    for trial in soft.trials:
        quaternion = Rotation.random(len(trial.inputs), rng=generator).as_quat(
            scalar_first=True, canonical=True
        )
        columns = dict(trial.outputs.columns) | {
            f"tip_q{letter}": quaternion[:, index] for index, letter in enumerate("wxyz")
        }
        trials.append(replace(trial, outputs=replace(trial.outputs, columns=columns)))
    names = (*soft.output_channels, "tip_qw", "tip_qx", "tip_qy", "tip_qz")
    data = replace(soft, trials=tuple(trials), output_channels=names)
    R = turned("z")
    there = seen_from(data, R=R)
    turned_trials = []
    for trial in there.trials:
        values = np.stack([trial.outputs.columns[f"tip_q{letter}"] for letter in "wxyz"], axis=1)
        seen = (Rotation.from_matrix(R) * Rotation.from_quat(values, scalar_first=True)).as_quat(
            scalar_first=True, canonical=True
        )
        columns = dict(trial.outputs.columns) | {f"tip_q{k}": seen[:, i] for i, k in enumerate("wxyz")}
        turned_trials.append(replace(trial, outputs=replace(trial.outputs, columns=columns)))
    back, _ = in_base_frame(replace(there, trials=tuple(turned_trials)))
    for before, after in zip(data.trials, back.trials, strict=True):
        for name in names:
            assert after.outputs.columns[name] == pytest.approx(before.outputs.columns[name], abs=1e-9)


@pytest.mark.long
def test_a_planar_robots_tracker_turned_about_its_axis_is_no_exchange_of_columns():
    """Bending in x alone, measured in y: that is a turn, which harms nothing, and the dead-band is found."""
    effects = {"backlash": {"width_N": 0.03}}
    histories = [pair_history(1), pair_history(1), pair_history(2)]
    robot = load_robot("neuroendoscope_section")
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    data = data_set(robot, "neuroendoscope_section", effects, histories, columns, solver="fkm_sliding")
    found = diagnose_dataset(seen_from(data, R=turned("z")), simulation=False)
    assert found.data_faults == ()
    assert [item.name for item in found.causes] == ["backlash"]
    assert found.registration["rotation_deg"] == pytest.approx([0.0, 0.0, 90.0], abs=1e-9)
