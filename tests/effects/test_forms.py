"""Forms of effects: each acts at its stage alone; what remembers gives by steps what it gives as a series."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.effect import Effect, Form, Stage
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Observed
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import (
    ArrivingCommands,
    Sight,
    arriving_inputs,
    check_effects,
    measured,
    nearest_rotations,
    remembers_what_was_seen,
    with_effects,
)
from catheter_sim.errors import InputError

REFERENCES = ("neuroendoscope", "spacer_disk", "chest_tube", "mitral_transseptal", "mitral_4dof")
FORMS = [(effect, form) for effect in EFFECTS.values() for form in effect.forms]
UNEVEN_S = np.array([0.0, 0.4, 0.5, 1.7, 2.0, 4.5, 4.6, 9.0, 9.1, 12.0])
SECTION = load_robot("neuroendoscope_section")


def ids(value: object) -> str:
    return value.name if isinstance(value, Effect | Form) else str(value)


def values_of(form: Form, robot: RobotSpec) -> dict[str, float]:
    """Return values of a form's parameters that do something, all different."""
    return {
        item.name: item.from_fit(
            float(np.clip(item.to_fit(item.null) + (5.0 + k) * item.scale, *item.fit_bounds))
        )
        for k, item in enumerate(form.parameters(robot))
    }


def wandering(robot: RobotSpec) -> Inputs:
    """Return uneven rows on which every tendon turns several times."""
    generator = np.random.default_rng(11)
    size = 3.0 if robot.actuation == "tension" else 2e-3
    way = size * np.abs(np.cumsum(generator.normal(size=(len(UNEVEN_S), len(robot.tendons))), axis=0))
    nothing = np.zeros((len(UNEVEN_S), 3))
    return Inputs(UNEVEN_S, robot.actuation, way, nothing, nothing)


def in_steps(robot: RobotSpec, inputs: Inputs) -> tuple[Array, Array]:
    """Return what arrives at the tendons and on the tip, command by command."""
    commands = ArrivingCommands(robot)
    dt_s = np.diff(inputs.time_s, prepend=inputs.time_s[0])
    rows = [commands.step(row, float(dt)) for row, dt in zip(inputs.tendon, dt_s, strict=True)]
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])


@pytest.mark.parametrize(("effect", "form"), FORMS, ids=ids)
def test_a_form_has_what_its_stage_needs(effect: Effect, form: Form) -> None:
    """One function, of its stage; a name of its own in its effect; and an equation."""
    names = ("specify", "command", "shape", "observe", "memory")
    given = [name for name in names if getattr(form, name) is not None]
    wanted = {
        Stage.COMMAND: {"command", "memory"},
        Stage.SPECIFICATION: {"specify"},
        Stage.LAW: {"specify"},
        Stage.SHAPE: {"shape"},
        Stage.OBSERVATION: {"observe", "memory"},
    }
    assert len(given) == 1
    assert given[0] in wanted[form.stage]
    assert form.equation
    assert [item.name for item in effect.forms].count(form.name) == 1


@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("effect", EFFECTS.values(), ids=ids)
def test_forms_share_no_parameter_and_are_told_by_theirs(effect: Effect, reference: str) -> None:
    """Every group that is freed together is of one form, alone or beside another's, and is found by it."""
    robot = load_robot(reference)
    names = [item.name for item in effect.parameters(robot)]
    assert len(set(names)) == len(names)
    for form in effect.forms:
        own = {item.name for item in form.parameters(robot)}
        for group in form.freed(robot):
            assert set(group) & own
            assert set(group) <= set(names)
            assert effect.form_of(robot, group) is form


@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize(
    ("effect", "form"), [item for item in FORMS if item[1].stage is Stage.COMMAND], ids=ids
)
def test_steps_of_commands_are_the_series(effect: Effect, form: Form, reference: str) -> None:
    """What arrives command by command is what the whole history makes of them, in uneven time."""
    robot = load_robot(reference)
    if not form.parameters(robot):
        pytest.skip("makes no sense for this robot")
    robot = with_effects(robot, {effect.name: values_of(form, robot)})
    check_effects(robot)
    inputs = wandering(robot)
    arriving = arriving_inputs(robot, inputs)
    assert (arriving.tendon != inputs.tendon).any() or (arriving.force_tip != inputs.force_tip).any()
    tendon, force = in_steps(robot, inputs)
    np.testing.assert_allclose(tendon, arriving.tendon, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(force, arriving.force_tip, rtol=1e-12)


def test_all_together_by_steps() -> None:
    """Gain, zero, drift, lag with delay, play and coupling in a row: by steps as by the series."""
    robot = with_effects(
        load_robot("mitral_4dof"),
        {
            "coupling": {"bending_distal_to_bending_proximal": 0.3, "advance_to_torsion": 0.01},
            "backlash": {"width_mm": 0.3, "width_torsion_mm": 0.4},
            "rate": {"lag_s": 0.7, "delay_s": 0.9},
            "drift": {"zero_mm_per_min": 0.4, "creep": 0.2},
            "actuation_gain": {"scale": 1.1},
            "actuation_offset": {"offset_mm": 0.2},
        },
    )
    inputs = wandering(robot)
    expected = arriving_inputs(robot, inputs).tendon
    np.testing.assert_allclose(in_steps(robot, inputs)[0], expected, rtol=1e-12, atol=1e-15)
    commands = ArrivingCommands(robot)
    for row in inputs.tendon:
        commands.step(row, 1.0)
    commands.reset()  # and anew
    dt_s = np.diff(inputs.time_s, prepend=inputs.time_s[0])
    again = [commands.step(row, float(dt))[0] for row, dt in zip(inputs.tendon, dt_s, strict=True)]
    np.testing.assert_allclose(again, expected, rtol=1e-12, atol=1e-15)


def looked_at(turns_rad: Array, time_s: Array = UNEVEN_S) -> Observed:
    """Return a point on a circle about y, its orientation, the angle itself and a tension."""
    p_w = np.stack([np.sin(turns_rad), np.zeros_like(turns_rad), np.cos(turns_rad)], axis=1)[:, None]
    R_w = Rotation.from_rotvec(np.outer(turns_rad, [0.0, 1.0, 0.0])).as_matrix()[:, None]
    return Observed(time_s, p_w, R_w, turns_rad[:, None], turns_rad[:, None] + 3.0)


def late(**values: float) -> Any:
    robot = with_effects(SECTION, {"rate": values})
    check_effects(robot)
    return robot


@pytest.mark.parametrize("values", [{"output_lag_s": 0.8}, {"output_delay_s": 1.1}])
def test_what_is_observed_late_is_late_in_all_but_tensions(values: dict[str, float]) -> None:
    """Positions and angles follow as commands under an input lag, orientations too, tensions at once."""
    turns = np.array([0.1, 0.1, 0.3, 0.2, 0.4, 0.4, 0.1, 0.0, 0.3, 0.3])
    true = looked_at(turns)
    now = measured(late(**values), true)
    before = with_effects(
        load_robot("mitral_4dof"),
        {"rate": {key.removeprefix("output_"): item for key, item in values.items()}},
    )
    nothing = np.zeros((len(turns), 3))
    rise = np.zeros((len(turns), 4))
    rise[:, 0] = turns - turns[0]  # it has watched before: as at rest in the first row
    expected = arriving_inputs(before, Inputs(UNEVEN_S, "displacement", rise, nothing, nothing)).tendon[:, 0]
    np.testing.assert_allclose(now.joint_angles[:, 0], turns[0] + expected, atol=1e-12)
    np.testing.assert_array_equal(now.tension, true.tension)
    assert np.abs(now.p_w - true.p_w).max() > 0.05
    heading = np.arctan2(now.R_w[:, 0, 0, 2], now.R_w[:, 0, 2, 2])
    np.testing.assert_allclose(heading, now.joint_angles[:, 0], atol=2e-3)  # the mean of nearby turns
    np.testing.assert_allclose(np.linalg.det(now.R_w), 1.0, atol=1e-12)


def test_an_output_lag_of_a_held_robot_is_none() -> None:
    """What stands still is seen where it is, from the first row on."""
    true = looked_at(np.full(len(UNEVEN_S), 0.7))
    now = measured(late(output_lag_s=2.0, output_delay_s=0.3), true)
    for name in ("p_w", "R_w", "joint_angles"):
        np.testing.assert_allclose(getattr(now, name), getattr(true, name), atol=1e-14)


def test_looks_one_by_one_are_the_series() -> None:
    """Frames seen from look to look are those seen along the whole history, frame of the tracker included."""
    robot = with_effects(
        late(output_lag_s=0.6, output_delay_s=0.5),
        {
            "rate": {"output_lag_s": 0.6, "output_delay_s": 0.5},
            "measurement_frame": {"rotation_x_deg": 20.0, "translation_y_mm": 5.0},
        },
    )
    true = looked_at(np.array([0.0, 0.3, 0.3, -0.2, 0.1, 0.5, 0.6, 0.0, 0.1, 0.1]))
    expected = measured(robot, true)
    sight = Sight(robot)
    for row, dt in enumerate(np.diff(UNEVEN_S, prepend=UNEVEN_S[0])):
        p_w, R_w = sight.look(true.p_w[row], true.R_w[row], float(dt))
        np.testing.assert_allclose(p_w, expected.p_w[row], atol=1e-12)
        np.testing.assert_allclose(R_w, expected.R_w[row], atol=1e-12)


def test_no_row_may_be_left_out_before_a_lag_of_what_is_seen() -> None:
    """Only what remembers needs every row; and it needs their time."""
    assert remembers_what_was_seen(late(output_lag_s=0.1))
    assert not remembers_what_was_seen(late(lag_s=0.1, output_delay_s=0.0))
    assert not remembers_what_was_seen(
        with_effects(SECTION, {"measurement_frame": {"translation_x_mm": 1.0}})
    )
    still = replace(looked_at(np.zeros(3), np.array([0.0, 1.0, 1.0])))
    with pytest.raises(InputError, match=r"effects.rate: time_s = 1 at row 3 does not increase"):
        measured(late(output_lag_s=0.1), still)


def test_the_nearest_rotation_of_a_mean_is_between() -> None:
    """Half way between two turns about an axis lies the turn by their mean; a rotation is its own nearest."""
    turns = Rotation.from_rotvec([[0.0, 0.0, 0.2], [0.0, 0.0, 1.0]]).as_matrix()
    np.testing.assert_allclose(nearest_rotations(turns), turns, atol=1e-15)
    mean = nearest_rotations(turns.mean(axis=0))
    np.testing.assert_allclose(Rotation.from_matrix(mean).as_rotvec(), [0.0, 0.0, 0.6], atol=1e-12)
    assert np.isnan(nearest_rotations(np.full((2, 3, 3), np.nan))).all()
