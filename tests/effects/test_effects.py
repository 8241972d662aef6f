"""Every effect: null does nothing, a value does what it says, and wrong values are refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catheter_sim.catalogue import load_robot, robot_toml
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction, RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import (
    arriving_inputs,
    check_effects,
    observed,
    with_built_in_effects,
    with_effects,
)
from catheter_sim.errors import InputError
from catheter_sim.mechanics.hysteresis import play
from catheter_sim.robots import check_robot
from catheter_sim.robots.catheter.description import bent_by
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.continuum.constant_curvature import constant_curvature
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.robots.rolling.complete import elastic_moments, spans
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.theory.twins import twin_for

CLOSED_LIST = {
    "tendon_friction",
    "backlash",
    "tendon_elongation",
    "axial_compression",
    "nonlinear_stiffness",
    "stiffness",
    "precurvature",
    "payload",
    "coupling",
    "actuation_gain",
    "actuation_offset",
    "measurement_frame",
    "rate",
    "drift",
    "twist",
}
COLUMNS = ("tip_x_mm", "tip_y_mm", "tip_z_mm", "tip_qw", "tip_qx", "tip_qy", "tip_qz", "body_5_x_mm")


def three_tendons() -> ContinuumRobot:
    """Return a small robot driven by displacement: two segments, three tendons each."""
    return ContinuumRobot(
        name="small",
        description="",
        segments=(Segment("a", 0.05, 5, 5e-3, 2e-3, 5e-3), Segment("b", 0.06, 5, 5e-3, 2e-3, 5e-3)),
        tendons=tuple(
            Tendon(f"{segment}{k}", 4e-3, math.radians(120.0 * k + turn), segment, stiffness_N_per_m=8e3)
            for segment, turn in (("a", 0.0), ("b", 40.0))
            for k in range(3)
        ),
        friction=Friction(0.1),
        actuation="displacement",
    )


ROBOTS = {
    "neuroendoscope_section": load_robot("neuroendoscope_section"),
    "spacer_disk": load_robot("spacer_disk"),
    "three_tendons": three_tendons(),
    "chest_tube_section": load_robot("chest_tube_section"),
    "chest_tube": load_robot("chest_tube"),
    "mitral_transseptal": load_robot("mitral_transseptal"),
    "mitral_4dof": load_robot("mitral_4dof"),
}
EACH = [(effect, name) for effect in EFFECTS for name in ROBOTS if EFFECTS[effect].parameters(ROBOTS[name])]


def some_inputs(robot: RobotSpec, rows: int = 6) -> Inputs:
    """Return a wandering series of inputs that the robot can bear."""
    generator = np.random.default_rng(7)
    size = 0.3 if robot.actuation == "tension" else 2e-3
    if isinstance(robot, RollingRobot):
        size = 6.0
    tendon = np.abs(np.cumsum(generator.normal(size=(rows, len(robot.tendons))), axis=0)) * size / 3.0
    zeros = np.zeros((rows, 3))
    return Inputs(np.arange(rows, dtype=float), robot.actuation, tendon, zeros, zeros)


def outputs(robot: RobotSpec, inputs: Inputs) -> np.ndarray:
    """Return the analytic twin's outputs with the robot's effects, shape (rows, columns)."""
    columns = COLUMNS
    if isinstance(robot, CatheterRobot):  # its stiffness sets the tendons' tension and nothing else
        columns += tuple(f"tension_{name}_N" for name in bent_by(robot))
    return twin_for(robot, inputs.actuation, columns, np.zeros(3))([robot], inputs)[0]


def test_names_are_of_the_closed_list():
    """Every effect has a name of the contract, and is listed under it."""
    assert set(EFFECTS) <= CLOSED_LIST
    assert all(effect.name == name for name, effect in EFFECTS.items())


@pytest.mark.parametrize(("effect", "robot"), EACH)
def test_parameters_make_sense(effect, robot):
    """Null and start lie inside the bounds, a scale is positive, and a variant frees known parameters."""
    parameters = EFFECTS[effect].parameters(ROBOTS[robot])
    names = [item.name for item in parameters]
    assert len(set(names)) == len(names)
    for item in parameters:
        assert item.lower <= item.null <= item.upper
        assert item.lower <= item.start <= item.upper
        assert item.scale > 0.0
        low, high = item.fit_bounds
        assert low <= item.to_fit(item.start) <= high
        assert item.from_fit(item.to_fit(item.start)) == pytest.approx(item.start)
        assert item.from_fit(item.to_fit(item.null)) == item.null
    for variant in EFFECTS[effect].variants(ROBOTS[robot]):
        assert set(variant) <= set(names)


@pytest.mark.parametrize(("effect", "robot"), EACH)
def test_null_changes_nothing(effect, robot):
    """With every parameter at its null the outputs are those of the robot without the effect."""
    plain = ROBOTS[robot]
    nulls = {item.name: item.null for item in EFFECTS[effect].parameters(plain)}
    inputs = some_inputs(plain)
    with_it = with_effects(plain, {effect: nulls})
    check_effects(with_it)
    np.testing.assert_allclose(outputs(with_it, inputs), outputs(plain, inputs), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "robot"), EACH)
def test_a_change_that_matters_matters(effect, robot):
    """Ten scales away from null something is observed (elsewhere than tip and body where it must be)."""
    plain = ROBOTS[robot]
    inputs = some_inputs(plain)
    changed = False
    for item in EFFECTS[effect].parameters(plain):
        low, high = item.fit_bounds
        value = item.from_fit(float(np.clip(item.to_fit(item.null) + 10.0 * item.scale, low, high)))
        here = with_effects(plain, {effect: {item.name: value}})
        check_effects(here)
        check_robot(with_built_in_effects(here), "test")
        changed |= bool(np.abs(outputs(here, inputs) - outputs(plain, inputs)).max() > 1e-4)
    assert changed


@pytest.mark.parametrize(("effect", "robot"), EACH)
def test_effects_survive_the_file(effect, robot, tmp_path):
    """A robot with an effect is read back from its `.toml` with the same effect."""
    item = EFFECTS[effect].parameters(ROBOTS[robot])[0]
    here = with_effects(ROBOTS[robot], {effect: {item.name: item.start}})
    path = tmp_path / "robot.toml"
    path.write_text(robot_toml(here), encoding="utf-8")
    assert load_robot(path).effects == here.effects


@given(
    st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=40),
    st.floats(0.0, 3.0),
)
@settings(max_examples=60, deadline=None)
def test_play_stays_within_half_its_width(values, width):
    """The output of a play lies within half a width of the input, and moves only when pushed."""
    series = np.array(values)[:, None]
    result = play(series, width)
    assert (np.abs(result - series) <= 0.5 * width + 1e-12).all()
    before = np.concatenate([[[0.0]], result[:-1]])
    moved = result != before
    at_the_end = np.isclose(np.abs(result - series), 0.5 * width, atol=1e-12)
    assert (~moved | at_the_end).all()


def test_play_is_a_loop_of_its_width():
    """Out and back, the output lags by half a width each way, stands still over one width in between."""
    triangle = np.concatenate([np.linspace(0, 3, 31), np.linspace(3, 0, 31)[1:]])[:, None]
    result = play(triangle, 0.8)[:, 0]
    assert result[25] == pytest.approx(triangle[25, 0] - 0.4)
    assert result[55] == pytest.approx(triangle[55, 0] + 0.4)
    still = np.isclose(result, 2.6)
    assert still[30:38].all()
    assert not still[39:].any()
    np.testing.assert_array_equal(play(triangle, 0.0), triangle)


def test_gain_offset_and_play_act_in_that_order():
    """What arrives is play(gain * command + offset), however the effects are written down."""
    robot = with_effects(
        three_tendons(),
        {
            "backlash": {"width_mm": 0.5},
            "actuation_offset": {"offset_mm": 0.2, "offset_a1_mm": -0.3},
            "actuation_gain": {"scale": 1.1, "scale_b0": 0.9},
        },
    )
    inputs = some_inputs(robot)
    gain = np.array([1.1, 1.1, 1.1, 1.1 * 0.9, 1.1, 1.1])
    offset = np.array([0.2, -0.1, 0.2, 0.2, 0.2, 0.2]) * 1e-3
    expected = play(inputs.tendon * gain + offset, 0.5e-3)
    np.testing.assert_allclose(arriving_inputs(robot, inputs).tendon, expected, atol=1e-15)


def test_a_tension_never_arrives_below_zero():
    """An offset or a dead-band takes a tension to zero, not below."""
    robot = load_robot("neuroendoscope_section")
    inputs = some_inputs(robot)
    for effects in ({"actuation_offset": {"offset_N": -0.3}}, {"backlash": {"width_N": 0.8}}):
        assert arriving_inputs(with_effects(robot, effects), inputs).tendon.min() == 0.0


def test_springs_stand_in_series():
    """Elongation and compression soften what the specification says, and an infinite one changes nothing."""
    robot = with_effects(
        three_tendons(),
        {"tendon_elongation": {"stiffness_N_per_mm": 8.0}, "axial_compression": {"stiffness_N_per_mm": 50.0}},
    )
    built = with_built_in_effects(robot)
    assert built.tendons[0].stiffness_N_per_m == pytest.approx(4e3)
    assert built.mount.axial_stiffness_N_per_m == pytest.approx(50e3)
    assert built.effects == {}
    softer = replace(robot, mount=built.mount)
    assert with_built_in_effects(softer).mount.axial_stiffness_N_per_m == pytest.approx(25e3)


def test_precurvature_is_the_shape_at_rest():
    """A rest curvature k bends the unloaded robot by k times its length, in the direction named."""
    robot = with_effects(
        three_tendons(), {"precurvature": {"curvature_y_per_m": 3.0, "curvature_b_y_per_m": 1.0}}
    )
    inputs = replace(some_inputs(robot, 1), tendon=np.full((1, 6), -0.01))
    R_w = constant_curvature(with_built_in_effects(robot), inputs, np.zeros(3)).postures[0].R_w[-1]
    bend = 3.0 * 0.11 + 1.0 * 0.06
    np.testing.assert_allclose(R_w[:, 2], [0.0, math.sin(bend), math.cos(bend)], atol=1e-9)


def test_measurement_frame_turns_about_the_base_then_shifts():
    """A quarter turn about z carries the measured tip from x to y; the shift comes after."""
    robot = load_robot("spacer_disk")
    inputs = replace(some_inputs(robot, 1), tendon=np.array([[0.0, 0.0, 3.0, 0.0]]))
    postures = constant_curvature(robot, inputs, np.zeros(3)).postures
    framed = with_effects(robot, {"measurement_frame": {"rotation_z_deg": 90.0, "translation_x_mm": 5.0}})
    seen = observed(framed, inputs.time_s, postures)[0]
    x, y, z = postures[0].p_w[-1]
    np.testing.assert_allclose(seen.p_w[-1], [-y + 5e-3, x, z], atol=1e-12)
    np.testing.assert_allclose(seen.R_w[-1][2], postures[0].R_w[-1][2], atol=1e-12)
    np.testing.assert_array_equal(seen.joint_angles, postures[0].joint_angles)


def test_joints_of_rolling_links_share_a_precurvature():
    """A rest curvature bends every unloaded rolling joint by itself times a link's length."""
    robot = with_effects(load_robot("chest_tube_section"), {"precurvature": {"curvature_x_per_m": 2.0}})
    columns = [f"joint_x{k}_deg" for k in (1, 2, 15)]
    twin = twin_for(robot, "tension", columns, np.zeros(3))
    angles = twin([robot], replace(some_inputs(robot, 1), tendon=np.zeros((1, 1))), 1)[0, 0]
    np.testing.assert_allclose(angles, math.degrees(2.0 * 15e-3), atol=1e-9)


def test_rods_stiffen_with_the_bend_of_their_joint():
    """The cubic term multiplies a rolling joint's elastic moment by 1 + c k^2, k its bend per length."""
    plain = load_robot("chest_tube_section")
    law = with_built_in_effects(with_effects(plain, {"nonlinear_stiffness": {"cubic_mm2": 500.0}}))
    theta = np.linspace(-0.2, 0.3, 15)
    moments = []
    for robot in (plain, law):
        chain = rolling_chain(robot)
        moments.append(elastic_moments(chain, theta, spans(chain, theta))[0])
    np.testing.assert_allclose(moments[1], moments[0] * (1.0 + 500.0 * (theta / 15.0) ** 2), rtol=1e-12)


def test_payload_pulls_the_tip():
    """A force on the tip adds to what the inputs bring."""
    robot = with_effects(load_robot("spacer_disk"), {"payload": {"force_y_N": 0.02}})
    inputs = some_inputs(robot, 3)
    np.testing.assert_allclose(arriving_inputs(robot, inputs).force_tip, [[0.0, 0.02, 0.0]] * 3)


def test_catheters_stretch_where_they_bend():
    """Tendon elongation acts on the bending pairs alone: torsion joints need no tension."""
    robot = with_effects(load_robot("mitral_4dof"), {"tendon_elongation": {"stiffness_N_per_mm": 8.0}})
    stiffness = {pair.name: pair.stiffness_N_per_m for pair in with_built_in_effects(robot).tendons}
    assert stiffness["bending_proximal"] == stiffness["bending_distal"] == 8e3
    assert stiffness["torsion"] == stiffness["advance"] == math.inf


def test_catheters_name_their_channels_and_refuse_what_makes_no_sense():
    """Gain, offset and dead-band are in mm, one gain for each channel; a twist of the holes is refused."""
    robot = load_robot("mitral_transseptal")
    names = [item.name for item in EFFECTS["actuation_gain"].parameters(robot)]
    channels = ("bending", "torsion_proximal", "torsion_distal", "advance")
    curves = ["curve_per_mm", *(f"curve_{channel}_per_mm" for channel in channels)]
    assert names == ["scale", *(f"scale_{channel}" for channel in channels), *curves]
    assert EFFECTS["backlash"].parameters(robot)[0].name == "width_mm"
    with pytest.raises(InputError, match="makes no sense"):
        check_effects(with_effects(robot, {"twist": {"rate_deg_per_m": 1.0}}))


@pytest.mark.parametrize(
    ("effects", "named"),
    [
        ({"backslash": {"width_N": 1.0}}, "backlash"),
        ({"backlash": {"width_mm": 1.0}}, "width_N"),
        ({"backlash": {"width_N": -1.0}}, "must lie in 0 to"),
        ({"backlash": {"width_N": float("nan")}}, "a number is needed"),
        ({"tendon_elongation": {"stiffness_N_per_mm": 5.0}}, "makes no sense"),
    ],
)
def test_wrong_effects_are_refused(effects, named):
    """A wrong name, parameter or value is one line that says what would be right."""
    robot = replace(load_robot("neuroendoscope_section"), effects=effects)
    with pytest.raises(InputError, match=named) as caught:
        check_effects(robot)
    assert "\n" not in str(caught.value)
