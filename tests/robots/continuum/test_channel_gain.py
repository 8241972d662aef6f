"""A channel with gains: one motor that pulls a tendon and lets its opposite out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import load_robot, robot_toml
from catheter_sim.channels import actuations, channel_inputs, input_channels, read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.nuisance import calibration_numbers
from catheter_sim.effects.apply import ArrivingCommands, arriving_inputs, with_built_in_effects, with_effects
from catheter_sim.envs.robots import Plant, quick_model
from catheter_sim.errors import InputError
from catheter_sim.exporting.elements import EXACT, find_causes
from catheter_sim.exporting.write import write_model
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots import check_robot, kind_of
from catheter_sim.robots.continuum.description import drives
from catheter_sim.robots.continuum.rods import drive as rods_drive
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import twin_for

NO_GRAVITY = np.zeros(3)
WAY_MM = np.array([0.0, 1.5, 3.0, -2.0, 0.0])
TURN_MM = np.array([0.0, 0.5, -1.0, 1.0, 0.0])
# The same cause on one motor, and on each of its two tendons.
CAUSES = [
    ("actuation_offset", {"offset_bend_mm": 0.4}, {"offset_up_mm": 0.4, "offset_down_mm": -0.4}),
    ("actuation_gain", {"scale_bend": 1.2}, {"scale_up": 1.2, "scale_down": 1.2}),
    ("actuation_gain", {"curve_bend_per_mm": 0.1}, {"curve_up_per_mm": 0.1, "curve_down_per_mm": 0.1}),
    ("backlash", {"width_mm": 0.6}, {"width_mm": 0.6}),
    ("backlash", {"width_bend_mm": 0.6}, {"width_up_mm": 0.6, "width_down_mm": 0.6}),
    ("drift", {"zero_bend_mm_per_min": 3.0}, {"zero_up_mm_per_min": 3.0, "zero_down_mm_per_min": -3.0}),
    ("rate", {"lag_s": 0.7}, {"lag_s": 0.7}),
]
# Another slack of each motor's tendons, as zeros of four.
UNLIKE = {"offset_up_mm": -0.8, "offset_down_mm": -0.8, "offset_left_mm": -0.3, "offset_right_mm": -0.3}


def tendon(name: str, degrees: float, **more: float | str) -> Tendon:
    return Tendon(name, 4e-3, np.radians(degrees), "arm", stiffness_N_per_m=2e4, pretension_N=2.0, **more)  # type: ignore[arg-type]


def one_by_one() -> ContinuumRobot:
    """Return a robot whose four tendons have a channel each."""
    return ContinuumRobot(
        name="four",
        description="",
        segments=(Segment("arm", 0.06, 6, 5e-3, 1.5e-3, 3e-3),),
        tendons=(tendon("up", 0.0), tendon("down", 180.0), tendon("left", 90.0), tendon("right", 270.0)),
        friction=Friction(0.1),
        actuation="displacement",
    )


def with_motors() -> ContinuumRobot:
    """Return the same robot, whose motors "bend" and "turn" pull one tendon and let the opposite one out."""
    up, down, left, right = one_by_one().tendons
    pulled = (replace(up, channel="bend"), replace(left, channel="turn"))
    let_out = (
        replace(down, channel="bend", channel_gain=-1.0),
        replace(right, channel="turn", channel_gain=-1.0),
    )
    return replace(one_by_one(), tendons=(pulled[0], let_out[0], pulled[1], let_out[1]))


def given(robot: ContinuumRobot, **columns: np.ndarray) -> Inputs:
    return read_inputs(robot, Table(np.arange(float(len(WAY_MM))), columns))


def both() -> tuple[Inputs, Inputs]:
    """Return two motors' ways, and the four tendons' that are the same."""
    one = given(with_motors(), displacement_bend_mm=WAY_MM, displacement_turn_mm=TURN_MM)
    four = given(
        one_by_one(),
        displacement_up_mm=WAY_MM,
        displacement_down_mm=-WAY_MM,
        displacement_left_mm=TURN_MM,
        displacement_right_mm=-TURN_MM,
    )
    return one, four


@pytest.mark.slow
def test_a_motor_moves_its_tendons_as_opposite_commands_do() -> None:
    """In the simulation, a static model and the twin, to the last bit."""
    one, four = both()
    np.testing.assert_array_equal(one.tendon, four.tendon)
    np.testing.assert_array_equal(
        channel_inputs(with_motors(), one), np.stack([WAY_MM, TURN_MM], axis=1) / 1e3
    )
    runs = [
        (
            simulate(robot, inputs, NO_GRAVITY).postures,
            STATIC_MODELS["CC_sub"].solve(robot, inputs, NO_GRAVITY).postures,
        )
        for robot, inputs in ((with_motors(), one), (one_by_one(), four))
    ]
    for mine, other in zip(*runs, strict=True):
        for row, same in zip(mine, other, strict=True):
            np.testing.assert_array_equal(row.p_w, same.p_w)
            np.testing.assert_array_equal(row.actuator_tension, same.actuator_tension)
        assert np.linalg.norm(mine[2].p_w[-1] - mine[0].p_w[-1]) > 10e-3
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    twins = [
        twin_for(robot, "displacement", columns, NO_GRAVITY)([robot], inputs)
        for robot, inputs in ((with_motors(), one), (one_by_one(), four))
    ]
    np.testing.assert_array_equal(*twins)


@pytest.mark.parametrize(("name", "of_motor", "of_tendons"), CAUSES)
def test_a_cause_of_a_channel_acts_on_what_the_channel_moves(
    name: str, of_motor: dict[str, float], of_tendons: dict[str, float]
) -> None:
    """A motor's wrong zero pulls one tendon and lets the other out; along a history and step by step."""
    motors, four = (
        with_effects(robot, {name: values})
        for robot, values in ((with_motors(), of_motor), (one_by_one(), of_tendons))
    )
    one, other = both()
    arrived = arriving_inputs(motors, one).tendon
    np.testing.assert_allclose(arrived[:, :2], arriving_inputs(four, other).tendon[:, :2], atol=1e-15)
    np.testing.assert_allclose(arrived[:, 1], -arrived[:, 0], atol=1e-15)
    assert np.abs(arrived - one.tendon).max() > 1e-4
    commands = ArrivingCommands(motors)
    stepped = [commands.step(row, float(k > 0))[0] for k, row in enumerate(one.tendon)]
    np.testing.assert_allclose(stepped, arrived, atol=1e-9)


@pytest.mark.parametrize(
    ("of_motors", "of_tendons"),
    [
        ({"slack_mm": 0.8}, {"offset_mm": -0.8}),
        ({"slack_bend_mm": 0.8, "slack_turn_mm": 0.3}, UNLIKE),
    ],
)
@pytest.mark.slow
def test_slack_of_a_motors_tendons_is_a_zero_too_low_of_each(
    of_motors: dict[str, float], of_tendons: dict[str, float]
) -> None:
    """In the simulation, the twin and static models."""
    one, four = both()
    slack = with_effects(with_motors(), {"backlash": of_motors})
    low = with_effects(one_by_one(), {"actuation_offset": of_tendons})
    weight = np.array([9.81, 0.0, 0.0])
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    seen = []
    for robot, inputs in ((slack, one), (low, four)):
        runs = (simulate(robot, inputs, weight), STATIC_MODELS["CC"].solve(robot, inputs, weight))
        tips = [1e3 * np.array([row.p_w[-1] for row in run.postures]) for run in runs]
        seen.append([*tips, twin_for(robot, "displacement", columns, weight)([robot], inputs)[0]])
    np.testing.assert_allclose(np.array(seen[0]), np.array(seen[1]), rtol=0.0, atol=1e-9)
    without = simulate(with_motors(), one, weight).postures
    assert np.linalg.norm(1e3 * without[2].p_w[-1] - seen[0][0][2]) > 5.0


@pytest.mark.slow
def test_a_slack_pair_has_a_dead_zone_about_the_middle() -> None:
    """A tendon that is 0.8 mm too long and was stretched by 0.1 mm pulls from 0.7 mm on, either way.

    Beyond, an arc takes l = r phi of it, less what the tendon of 20 N/mm stretches by T = EI phi / (L r).
    """
    robot = replace(with_motors(), friction=Friction(0.0))
    slack = with_effects(robot, {"backlash": {"slack_mm": 0.8}})
    way = np.array([0.0, 0.65, -0.65, 2.7, -2.7])
    inputs = given(robot, displacement_bend_mm=way)
    tips = {
        "simulated": np.array([1e3 * row.p_w[-1] for row in simulate(slack, inputs, NO_GRAVITY).postures]),
        "twin": twin_for(robot, "displacement", ("tip_x_mm", "tip_y_mm", "tip_z_mm"), NO_GRAVITY)(
            [slack], inputs
        )[0],
    }
    arm = robot.segments[0]
    bend = 2.0e-3 / (4e-3 + arm.bending_stiffness_N_m2 / (arm.length_m * 4e-3) / 2e4)
    expected = 1e3 * arm.length_m / bend * (1.0 - np.cos(bend))
    for tip in tips.values():
        np.testing.assert_allclose(tip[:3, 0], 0.0, atol=0.01)
        np.testing.assert_allclose(tip[3:, 0], [expected, -expected], rtol=0.02)
    np.testing.assert_allclose(tips["simulated"], tips["twin"], atol=0.15)


def test_only_channels_that_drive_antagonists_have_slack() -> None:
    """Not tendons with a channel each, nor two that one channel pulls together, nor tensions."""
    together = tuple(replace(item, channel_gain=abs(item.channel_gain)) for item in with_motors().tendons)
    mixed = replace(with_motors(), tendons=(*with_motors().tendons[:2], *one_by_one().tendons[2:]))
    names = {
        name: [item["parameter"] for item in cs.list_effects(robot) if item["form"] == "slack"]
        for name, robot in {
            "motors": with_motors(),
            "four": one_by_one(),
            "together": replace(with_motors(), tendons=together),
            "mixed": mixed,
            "pulled": replace(one_by_one(), actuation="tension"),
        }.items()
    }
    every = ["slack_mm", "slack_bend_mm", "slack_turn_mm"]
    assert names == {"motors": every, "four": [], "together": [], "mixed": ["slack_mm"], "pulled": []}
    built = with_built_in_effects(with_effects(mixed, {"backlash": {"slack_mm": 0.8}}))
    assert [item.slack_m for item in built.tendons] == pytest.approx([0.8e-3, 0.8e-3, 0.0, 0.0])
    built = with_built_in_effects(
        with_effects(with_motors(), {"backlash": {"slack_mm": 0.3, "slack_bend_mm": 0.5}})
    )
    assert [item.slack_m for item in built.tendons] == pytest.approx([0.8e-3, 0.8e-3, 0.3e-3, 0.3e-3])
    np.testing.assert_allclose(
        1e3 * rods_drive(built, np.zeros((1, 4))).displacement_m, [[-0.8, -0.8, -0.3, -0.3]]
    )


def test_a_motors_tendons_lengthen_one_by_one() -> None:
    """A pull that stays in the one (`set_share`) is none that stays in the other."""
    one, four = both()
    arrived = [
        arriving_inputs(with_effects(robot, {"tendon_elongation": {"set_share": 0.1}}), inputs).tendon
        for robot, inputs in ((with_motors(), one), (one_by_one(), four))
    ]
    np.testing.assert_array_equal(arrived[0], arrived[1])
    assert np.abs(arrived[0] - one.tendon).max() > 1e-4


@pytest.mark.slow
def test_files_and_environments_carry_slack() -> None:
    """It is in the model that is built, as the length at which a tendon begins to pull."""
    robot = with_effects(with_motors(), {"backlash": {"slack_mm": 0.8}})
    (cause,) = find_causes(robot)
    assert (cause.form, cause.way) == ("slack", EXACT)
    texts = [build_mjcf(with_built_in_effects(item)) for item in (with_motors(), robot)]
    plain, slack = (mujoco.MjModel.from_xml_string(text) for text in texts)
    longer = (slack.actuator_biasprm - plain.actuator_biasprm)[:, 0] / plain.actuator_gainprm[:, 0]
    np.testing.assert_allclose(longer, -0.8e-3, rtol=1e-6)
    stepped = Plant(robot, None, (0.0, 0.0, 0.0)).simulator.model
    np.testing.assert_allclose(stepped.actuator_biasprm, slack.actuator_biasprm, rtol=1e-9)


def test_coupling_reaches_both_tendons_of_a_motor() -> None:
    """Another section's input adds to a motor's, which pulls one of its tendons and lets the other out."""
    robot = with_motors()
    arm = robot.segments[0]
    ends = [
        replace(item, ends_at="end", angle_rad=angle)
        for item, angle in zip(robot.tendons[2:], (0.0, np.pi), strict=True)
    ]
    long = replace(robot, segments=(arm, replace(arm, name="end")), tendons=(*robot.tendons[:2], *ends))
    assert [mover.toward for mover in kind_of(long).handles.movers(long)] == [
        pytest.approx((2.0, 0.0)),
        pytest.approx((2.0, 0.0)),
    ]
    coupled = with_effects(long, {"coupling": {"arm_to_end": 0.1}})
    inputs = given(long, displacement_bend_mm=WAY_MM)
    arrived = arriving_inputs(coupled, inputs).tendon
    np.testing.assert_allclose(arrived[:, 2:], 1e-4 * np.stack([WAY_MM, -WAY_MM], axis=1), atol=1e-12)


def test_a_motor_bends_toward_the_tendon_that_it_pulls() -> None:
    """Without the gain the two sides would cancel."""
    assert [drive.side for drive in drives(with_motors(), "displacement")] == [
        pytest.approx((1.0, 0.0)),
        pytest.approx((0.0, 1.0)),
    ]


@pytest.mark.slow
def test_what_ik_says_is_what_the_motors_are_given() -> None:
    """The file's two columns bring the tip where the plan said, by the simulation of the same table."""
    robot = replace(with_motors(), friction=Friction(0.0))
    target = {"tip_x_mm": [15.0], "tip_y_mm": [-8.0]}
    found = cs.inverse_kinematics(robot, target, corrections=None)
    assert set(found.to_table().columns) == {"displacement_bend_mm", "displacement_turn_mm"}
    reached = cs.simulate(robot, cs.inputs(robot, found.to_table())).to_table(list(target)).columns
    assert reached["tip_x_mm"][0] == pytest.approx(15.0, abs=1.0)
    assert reached["tip_y_mm"][0] == pytest.approx(-8.0, abs=1.0)


def test_steering_refuses_gains_that_no_arc_has() -> None:
    """A tendon on half the radius is let out half as far, not as far: the line names it."""
    robot = with_motors()
    nearer = tuple(replace(item, radius_m=2e-3) if item.name == "down" else item for item in robot.tendons)
    with pytest.raises(InputError, match=r"four: tendons\.down\.channel_gain = -1: .* does not move so"):
        quick_model(replace(robot, tendons=nearer), "displacement")
    right = tuple(replace(item, channel_gain=-0.5) if item.name == "down" else item for item in nearer)
    assert quick_model(replace(robot, tendons=right), "displacement").drives.tendon.shape == (4, 2)


@pytest.mark.slow
def test_an_exported_file_says_what_each_actuator_follows() -> None:
    """Two columns drive four actuators, two of them the other way."""
    robot = replace(with_motors(), friction=Friction(0.0))
    controls = {item.actuator: (item.column, item.share) for item in write_model(robot).controls}
    assert controls == {
        "tendon_up": ("displacement_bend_mm", pytest.approx(1.0)),
        "tendon_down": ("displacement_bend_mm", pytest.approx(-1.0)),
        "tendon_left": ("displacement_turn_mm", pytest.approx(1.0)),
        "tendon_right": ("displacement_turn_mm", pytest.approx(-1.0)),
    }


def test_a_motors_angle_on_a_spool_is_such_a_channel(tmp_path: Path) -> None:
    """In [map]: 90 deg on a spool of 10 mm pull one tendon by 15.7 mm and let out its opposite."""
    (tmp_path / "robot.toml").write_text(robot_toml(with_motors()))
    (tmp_path / "take.csv").write_text("time_s,motor,tip_x_mm\n0,0,0\n1,90,1\n2,0,0\n3,-90,1\n")
    (tmp_path / "dataset.toml").write_text(
        '[dataset]\nname = "take"\nrobot = "robot.toml"\nsource = "made up"\nlicence = "MIT"\n'
        "[conditions]\ngravity_mps2 = [0.0, 0.0, 0.0]\n"
        '[channels]\ninputs = ["displacement_bend_mm"]\noutputs = ["tip_x_mm"]\n'
        '[[trials]]\nfile = "take.csv"\n'
        '[map]\ndisplacement_bend_mm = { column = "motor", unit = "deg", spool_radius_mm = 10.0 }\n'
    )
    (trial,) = load_dataset(tmp_path).trials
    way = 0.01 * np.pi / 2
    np.testing.assert_allclose(trial.inputs.tendon[1], [way, -way, 0.0, 0.0], rtol=1e-12)


def test_such_a_robot_takes_no_tensions() -> None:
    """A tendon cannot push: tensions are refused by the robot's file, and as columns."""
    robot = with_motors()
    assert actuations(robot) == ("displacement",)
    assert input_channels(robot, "tension") == []
    with pytest.raises(
        InputError, match="unknown input channel 'tension_bend_N'; choices: displacement_bend_mm"
    ):
        given(robot, tension_bend_N=WAY_MM)
    with pytest.raises(InputError, match=r"four: tendons\.down\.channel_gain = -1: takes displacements"):
        check_robot(replace(robot, actuation="tension"), "four")


@pytest.mark.parametrize("gain", ["0", "inf", "1e9"])
def test_impossible_gains_are_named(gain: str, tmp_path: Path) -> None:
    """One line names the file, the tendon and the key."""
    path = tmp_path / "robot.toml"
    path.write_text(robot_toml(with_motors()))
    with pytest.raises(InputError, match=r"tendons\.down\.channel_gain = .*: a size of 0.001 to 1000"):
        load_robot(path, [f"tendons.down.channel_gain={gain}"])
    path.write_text(path.read_text().replace("channel_gain = -1.0", "channel_gain = nan"))
    with pytest.raises(InputError, match=r"tendons\.down: channel_gain: a number is needed, not nan"):
        load_robot(path)


def test_a_gain_is_neither_calibrated_nor_uncertain() -> None:
    """Inputs are read with it; a wrong one is the cause `actuation_gain`."""
    with pytest.raises(InputError, match="inputs are read with tendons"):
        calibration_numbers({"tendons.down.channel_gain": [-2.0, -0.5]}, with_motors(), "here")
    pulled = {"time_s": [0.0], "displacement_bend_mm": [1.0]}
    with pytest.raises(InputError, match="channel_gain: inputs are read with it"):
        cs.sense(with_motors(), pulled, uncertain={"tendons.down.channel_gain": 0.1})
