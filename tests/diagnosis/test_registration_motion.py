"""Registration on points alone: turns, shifts and mirror images of a cloud whose motion is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.frame import document, frame_numbers, register
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

COLUMNS = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
CLOUD = np.random.default_rng(3).normal(size=(40, 3)) * (20.0, 12.0, 6.0) + (0.0, 0.0, 50.0)
INPUTS = Inputs(np.arange(40.0), "tension", np.zeros((40, 2)), np.zeros((40, 3)), np.zeros((40, 3)))


def found(measured: np.ndarray):
    """Return how a cloud is registered against `CLOUD`."""
    table = Table(INPUTS.time_s, {name: measured[:, k] for k, name in enumerate(COLUMNS)}, "a.csv")
    robot = load_robot("neuroendoscope_section")
    return register([Trial("a.csv", "train", INPUTS, table)], COLUMNS, robot, lambda *_: CLOUD[None])


@pytest.mark.parametrize("turn", [(0, 0, 90), (90, 0, 0), (0, 120, 60), (40, -35, 50)])
def test_a_turn_is_undone(turn):
    """Measured positions come back to where the robot says that they are."""
    R = Rotation.from_euler("xyz", turn, degrees=True).as_matrix()
    registration = found(CLOUD @ R.T)
    assert registration.R_bt @ R == pytest.approx(np.eye(3), abs=1e-6)


def test_a_mirror_image_is_left_alone():
    """One coordinate with its sign turned, or two exchanged, is no motion."""
    assert not found(CLOUD * (-1.0, 1.0, 1.0)).turned
    assert not found(CLOUD[:, [2, 1, 0]]).turned


def test_a_slight_turn_is_left_to_its_cause_and_a_far_shift_is_not():
    """15 deg stay; 300 mm are taken out, and three numbers of the shift are fitted besides."""
    R = Rotation.from_euler("y", 15.0, degrees=True).as_matrix()
    slight, far = found(CLOUD @ R.T), found(CLOUD @ R.T + (300.0, 0.0, 0.0))
    assert not slight.applied
    assert frame_numbers(slight) == ()
    assert not far.turned
    assert [item.name for item in frame_numbers(far)] == [f"frame_shift_{axis}_mm" for axis in "xyz"]
    assert all(item.superseded_by == ("measurement_frame",) for item in frame_numbers(far))


def test_the_whole_motion_is_told_in_the_trackers_axes():
    """What is fitted afterwards is along the base's axes: turned into the tracker's it adds to the shift."""
    R = Rotation.from_euler("z", 90.0, degrees=True).as_matrix()
    registration = found(CLOUD @ R.T + (300.0, 200.0, 100.0))
    before = document(registration, {})["translation_mm"]
    after = document(registration, {"frame_shift_x_mm": 2.0})["translation_mm"]
    assert np.subtract(after, before) == pytest.approx((0.0, 2.0, 0.0))
    assert before == pytest.approx((300.0, 200.0, 100.0), abs=1e-6)


def test_free_numbers_move_the_outputs_as_a_tracker_would():
    """Turns about x, y and z, then a shift, are the rigid motion that `document` tells."""
    R = Rotation.from_euler("xyz", (40.0, -35.0, 50.0), degrees=True).as_matrix()
    registration = found(CLOUD @ R.T + (300.0, 200.0, 100.0))
    numbers = frame_numbers(registration)
    assert len(numbers) == 6
    values = dict(zip([item.name for item in numbers], (3.0, -4.0, 5.0, 1.0, 2.0, 3.0), strict=True))
    outputs = CLOUD[None]
    for item in numbers:
        outputs = item.change_outputs(COLUMNS, outputs, np.array([values[item.name]]))
    told = document(replace(registration, R_bt=np.eye(3), shift_mm=np.zeros(3)), values)
    turn = Rotation.from_rotvec(told["rotation_deg"], degrees=True).as_matrix()
    assert outputs[0] == pytest.approx(CLOUD @ turn.T + told["translation_mm"], abs=1e-9)


@pytest.mark.parametrize("factor", [1e-3, 1.0 / 25.4, 0.1, 0.5])
def test_only_metres_are_put_right(factor):
    """A thousandth of the size is a file in metres; inches, centimetres and half the motion are not."""
    registration = found(factor * CLOUD)
    assert registration.factor == (1000.0 if factor == 1e-3 else 1.0)


def test_a_model_that_errs_by_half_its_motion_shows_the_turn_all_the_same():
    """Beside the right exchange of axes no other is nearly as good; and in the base frame none is taken."""
    spread = (CLOUD - CLOUD.mean(axis=0)).std(axis=0)
    erring = CLOUD + 0.6 * spread * np.random.default_rng(5).normal(size=CLOUD.shape)
    R = Rotation.from_euler("y", 90.0, degrees=True).as_matrix()
    assert found(erring @ R.T).R_bt @ R == pytest.approx(np.eye(3), abs=1e-9)
    assert not found(erring).applied
