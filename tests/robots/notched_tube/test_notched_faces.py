"""Statics, twin and handles of a notched tube: what they answer, and that they agree."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from notched_cases import changed, inputs

from catheter_sim.core.document import number_at
from catheter_sim.core.effect import Role
from catheter_sim.robots.notched_tube import description, statics
from catheter_sim.robots.notched_tube.description import length_m
from catheter_sim.robots.notched_tube.published import notched_wrist
from catheter_sim.robots.notched_tube.statics import solve_rows
from catheter_sim.robots.notched_tube.twin import NotchedTubeTwin, twin

ROBOT = notched_wrist()
GRAVITY = np.array([0.0, 0.0, -9.81])
LOOP = [0.0, 0.8, 1.6, 2.3, 1.9, 1.2, 2.0, 0.4]


def test_statics_are_named_once_and_york_takes_one_segment() -> None:
    """Both models bend alike under a small tension; the printed one is refused of two segments."""
    models = {model.name: model for model in statics.MODELS}
    assert list(models) == ["york", "kinetostatic"]
    assert all("\n" not in model.summary for model in statics.MODELS)
    smooth = changed(ROBOT, mu=0.0)
    rows = inputs([0.0, 0.2])
    bends = [model.law(smooth, rows, np.zeros(3)).postures[1].joint_angles[0] for model in statics.MODELS]
    assert bends[0] == pytest.approx(bends[1], rel=0.1)
    (segment,) = ROBOT.segments
    two = replace(ROBOT, segments=(segment, replace(segment, name="upper")))
    assert [model.lacks(two) for model in statics.MODELS] == ["several segments", ""]
    assert not any(model.lacks(ROBOT) for model in statics.MODELS)


def test_twin_is_the_kinetostatic_model_of_many_robots() -> None:
    """Each robot's rows are those of the static model alone, at the rows and elements asked for."""
    robots = [changed(ROBOT, mu=mu) for mu in (0.0, 0.1, 0.3)]
    rows = [inputs([share * drive for drive in LOOP], force=(0.0, 0.01, 0.0)) for share in (1.0, 0.9, 0.8)]
    states = NotchedTubeTwin().solve(robots, rows, GRAVITY, [0, 4], 3)
    assert states.p_w.shape == (3, 3, 2, 3)
    assert states.R_w.shape == (3, 3, 2, 3, 3)
    (model,) = (item for item in statics.MODELS if item.name == "kinetostatic")
    for index, (robot, row) in enumerate(zip(robots, rows, strict=True)):
        for k, posture in enumerate(model.law(robot, row, GRAVITY).postures[::3]):
            assert states.p_w[index, k] == pytest.approx(posture.p_w[[0, 4]], abs=1e-9)
            assert states.R_w[index, k] == pytest.approx(posture.R_w[[0, 4]], abs=1e-6)
            assert states.joint_angles()[index, k] == pytest.approx(posture.joint_angles, abs=1e-6)
            assert states.tension[index, k] == pytest.approx(posture.actuator_tension)


def test_twin_of_no_balance_is_nan_from_there_on() -> None:
    """From the row on that nothing balances a robot is NaN, and another one is not; nor is it an error."""
    rows = [inputs([0.5, 0.6, 0.5]), inputs([0.5, math.inf, 0.5])]
    states = NotchedTubeTwin().solve([ROBOT, ROBOT], rows, GRAVITY, [4], 1)
    assert np.isfinite(states.p_w[0]).all()
    assert np.isfinite(states.p_w[1, 0]).all()
    assert np.isnan(states.p_w[1, 1:]).all()
    assert np.isnan(states.joint_angles()[1, 1:]).all()
    unknown = changed(ROBOT, stiffness_cubic_m2=math.nan)
    assert np.isnan(NotchedTubeTwin().solve([unknown], [inputs([0.5])], GRAVITY, [4], 1).p_w).all()


def test_twin_of_no_elements_and_by_displacement() -> None:
    """A value that can be sent away; by displacement the tension is the answer."""
    made = pickle.loads(pickle.dumps(twin(ROBOT, "displacement")))
    assert made.carries_load
    rows = inputs([0.0, 3e-4, 6e-4], "displacement")
    states = made.solve([ROBOT], [rows], np.zeros(3), [], 1)
    assert states.p_w.shape == (1, 3, 0, 3)
    assert (np.diff(states.tension[0, :, 0]) > 0.0).all()


def test_handles_are_numbers_of_the_robot() -> None:
    """Places are numbers of the robot's file; a planar tube neither twists nor bends aside."""
    found = description.handles(replace(ROBOT, actuation="displacement"))
    assert [item for item in found if item.role is not Role.TENDON_STIFFNESS] == list(
        description.handles(ROBOT)
    )
    for item in found:
        if item.key:
            assert math.isfinite(number_at(ROBOT, item.key)) or item.role in (
                Role.MOUNT,
                Role.TENDON_STIFFNESS,
            )
    roles = {item.role for item in found}
    assert {Role.CUBIC, Role.HOLE_TWIST, Role.REST_CURVATURE, Role.TIP_FORCE, Role.FRICTION} <= roles
    planar = description.handles(replace(ROBOT, bending_axes="x"))
    assert Role.HOLE_TWIST not in {item.role for item in planar}
    assert [item.parameter for item in planar if item.role is Role.REST_CURVATURE] == ["curvature_x_per_m"]
    assert [item.parameter for item in planar if item.role is Role.TIP_FORCE] == ["force_x_N", "force_z_N"]


def test_movers_bend_the_last_segment_toward_the_notches() -> None:
    """One tendon, one channel, one side."""
    (mover,) = description.movers(ROBOT)
    assert (mover.channel, mover.part, mover.toward, mover.advances) == ("tendon", "wrist", (1.0, 0.0), False)


def test_sizes_bend_the_tube_by_about_a_radian() -> None:
    """Tension and tip force of that size bend a linear tube by half a radian to two."""
    found = description.sizes(ROBOT)
    assert found.length_m == length_m(ROBOT)
    linear = changed(ROBOT, mu=0.0, metal=replace(ROBOT.material, plateau_slope=1.0))
    for drive, force in ((found.tension_N, 0.0), (0.0, found.tip_force_N)):
        row = inputs([0.0, drive], force=(force, 0.0, 0.0))
        bend = solve_rows([linear], [row], np.zeros(3)).joint_angles()[0, 1, :5].sum()
        assert 0.4 < bend < 2.0
    most = found.curvature_per_m * found.length_m
    assert 0.5 < most < 2.4, "radians over the tube"
