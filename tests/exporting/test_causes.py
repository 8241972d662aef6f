"""Which causes a file carries is asked of their forms: exactly where that can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.core.effect import Stage
from catheter_sim.effects import EFFECTS
from catheter_sim.exporting.elements import (
    EXACT,
    FITTED,
    LEFT,
    affine_of,
    find_causes,
    timing_of,
    view_of,
    without,
)
from catheter_sim.exporting.judge import distance_of

ROBOTS = ("neuroendoscope", "chest_tube_section", "mitral_4dof", "notched_wrist")


@pytest.mark.parametrize("name", ROBOTS)
def test_every_form_of_every_effect_is_accounted_for(name: str) -> None:
    """Each form that makes sense is carried, fitted or left, with a reason; nothing is passed over."""
    plain = cs.load_robot(name)
    assert find_causes(plain) == ()
    for effect in EFFECTS.values():
        for form in effect.forms:
            for item in form.parameters(plain)[:1]:
                value = item.null + item.scale if np.isfinite(item.null) else 1.0 / item.scale
                robot = cs.load_robot(name, {f"effects.{effect.name}.{item.name}": value})
                (cause,) = find_causes(robot)
                assert (cause.effect, cause.form) == (effect.name, form.name)
                assert cause.way in (EXACT, FITTED, LEFT)
                assert cause.how
                assert without(robot, (cause,)).effects == {}


def test_commands_become_a_matrix_and_a_bias() -> None:
    """Gain, then offset, then coupling, in the order in which effects act."""
    settings = {
        "effects.actuation_gain.scale": 1.2,
        "effects.actuation_offset.offset_bending_proximal_mm": 0.3,
        "effects.coupling.bending_proximal_to_bending_distal": 0.1,
    }
    affine = affine_of(cs.load_robot("mitral_4dof", settings))
    expected = 1.2 * np.eye(4)
    expected[1, 0] = 0.12
    np.testing.assert_allclose(affine.matrix[:3, :3], expected[:3, :3], atol=1e-9)
    np.testing.assert_allclose(affine.bias[:3], [3e-4, 3e-5, 0.0], atol=1e-12)


def test_the_largest_distance_is_of_any_face_and_row() -> None:
    """One face that is 3 mm off in one row makes 3 mm; the tip's mean is of the tip alone."""
    one, other = np.zeros((4, 5, 3)), np.zeros((4, 5, 3))
    other[2, 1, 0], other[3, -1, 1] = 3e-3, 1e-3
    found = distance_of("by hand", one, other)
    assert found.largest_mm == pytest.approx(3.0)
    assert found.rms_mm == pytest.approx(0.5)


def test_a_force_on_the_tip_is_taken_over() -> None:
    """The payload's force acts as it is given."""
    robot = cs.load_robot("neuroendoscope_section", {"effects.payload.force_x_N": 0.002})
    np.testing.assert_allclose(affine_of(robot).force_tip, [0.002, 0.0, 0.0])


def test_a_trackers_frame_is_a_view_and_its_scale_is_none() -> None:
    """Turn and shift are those that are given; a scale is no rigid motion, so that it is left."""
    frame = {
        "effects.measurement_frame.rotation_z_deg": 90.0,
        "effects.measurement_frame.translation_x_mm": 5.0,
    }
    view = view_of(cs.load_robot("notched_wrist", frame))
    np.testing.assert_allclose(view.R @ [1.0, 0.0, 0.0] + view.shift, [0.005, 1.0, 0.0], atol=1e-12)
    (cause,) = find_causes(cs.load_robot("notched_wrist", {"effects.measurement_frame.scale": 1.1}))
    assert cause.way == LEFT


def test_lags_delays_and_creep_are_read() -> None:
    """What stands before the robot is the actuators', what stands behind it the sensors'."""
    settings = {"lag_s": 0.2, "delay_s": 0.1, "output_delay_s": 0.3}
    robot = cs.load_robot("notched_wrist", {f"effects.rate.{key}": value for key, value in settings.items()})
    before, behind = timing_of(robot, Stage.COMMAND), timing_of(robot, Stage.OBSERVATION)
    assert (before.lag_s, before.delay_s, behind.lag_s, behind.delay_s) == (0.2, 0.1, 0.0, 0.3)
    creep = timing_of(cs.load_robot("notched_wrist", {"effects.drift.creep": 0.1}), Stage.COMMAND)
    assert (creep.creep, creep.creep_time_s) == (0.1, 60.0)
