"""The joints' balance with friction, slack, play and measured laws, as a static model."""

from __future__ import annotations

import importlib
import math

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.description import joint_stiffness
from catheter_sim.robots.catheter.kinematics import angle_rad, arm_m, pk, pulled_m
from catheter_sim.robots.catheter.measured import te
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.catheter.statics import balance
from catheter_sim.validation.lines import given
from catheter_sim.validation.mitral import joint_angles_deg

STILL = np.zeros(3)


def catheter(name: str, *settings: str) -> CatheterRobot:
    robot = load_robot(name, settings)
    assert isinstance(robot, CatheterRobot)
    return robot


def pulls(pair: int, *values_mm: float, steps: int = 10) -> Inputs:
    """Return inputs of one pair through the given values, `steps` rows each."""
    path = [np.zeros(1)]
    for value in values_mm:
        path.append(np.linspace(path[-1][-1], value, steps + 1)[1:])
    rows = np.zeros((sum(map(len, path)), 4))
    rows[:, pair] = np.concatenate(path) * 1e-3
    return given(rows, "displacement")


def bends_deg(robot: CatheterRobot, inputs: Inputs, name: str) -> Array:
    return joint_angles_deg(robot, balance(robot, inputs, STILL).postures)[name]


@pytest.mark.parametrize("name", ["mitral_transseptal", "mitral_4dof"])
def test_nominal_robots_balance_as_pure_kinematics(name: str) -> None:
    """Without friction, slack, play and laws the model is `pk`, whatever moves."""
    robot = catheter(name)
    rng = np.random.default_rng(0)
    inputs = given(rng.uniform(-1.0, 1.0, (20, 4)) * np.array([1.0, 1.0, 1.0, 0.0]) * 1e-3, "displacement")
    for ours, pure in zip(
        balance(robot, inputs, STILL).postures, pk(robot, inputs, STILL).postures, strict=True
    ):
        assert ours.p_w == pytest.approx(pure.p_w, abs=1e-12)
        assert ours.joint_angles == pytest.approx(pure.joint_angles, abs=1e-12)


def test_slips_where_the_capstan_says() -> None:
    """On the way out and back the drive's tension is the joint's times, or over, exp(mu turn)."""
    robot = catheter("mitral_transseptal@tube", "friction.mu=0.2", "path_deg=90")
    segment, inputs = robot.segments[1], pulls(0, 6.0, 0.0)
    run = balance(robot, inputs, STILL)
    bend = np.radians(joint_angles_deg(robot, run.postures)["bending"])
    tension = np.array([posture.actuator_tension[0] for posture in run.postures])
    joint = joint_stiffness(robot, segment) * bend / arm_m(segment, bend)
    turn = 0.2 * (math.pi / 2.0 + 0.5 * bend)
    taut = bend > 1e-6
    out, back = taut & (np.arange(21) <= 10), taut & (np.arange(21) > 14)
    assert out.sum() >= 6
    assert back.sum() >= 2
    assert tension[out] == pytest.approx((joint * np.exp(turn))[out], rel=1e-9)
    assert tension[back] == pytest.approx((joint * np.exp(-turn))[back], rel=1e-9)


def test_sticks_after_a_turn() -> None:
    """Right after a turn the joint keeps its angle and the drive's tension alone falls."""
    robot = catheter("mitral_transseptal@tube", "friction.mu=0.2", "path_deg=90")
    run = balance(robot, pulls(0, 6.0, 5.8), STILL)
    bend = joint_angles_deg(robot, run.postures)["bending"]
    tension = [posture.actuator_tension[0] for posture in run.postures]
    assert np.ptp(bend[10:]) < 1e-12
    assert tension[-1] == pytest.approx(tension[10] - robot.tendons[0].stiffness_N_per_m * 0.2e-3, abs=1e-9)


def test_no_friction_leaves_no_loop() -> None:
    """With mu = 0 the elastic joint comes back on its way out."""
    robot = catheter("mitral_transseptal@tube", "friction.mu=0", "path_deg=360")
    bend = bends_deg(robot, pulls(0, 6.0, 0.0), "bending")
    assert bend[:11] == pytest.approx(bend[:9:-1], abs=1e-9)


def test_slack_is_a_dead_zone_without_a_loop() -> None:
    """A slack pair moves nothing within its slack, and beyond it as a taut one less its slack."""
    robot = catheter("mitral_transseptal", "tendons.bending.slack_mm=1.5")
    bend = bends_deg(robot, pulls(0, 3.0, -3.0, 0.0, steps=12), "bending")
    ways = np.concatenate(
        [[0.0], np.linspace(0, 3, 13)[1:], np.linspace(3, -3, 13)[1:], np.linspace(-3, 0, 13)[1:]]
    )
    own = np.copysign(np.maximum(np.abs(ways) - 1.5, 0.0), ways) * 1e-3
    assert bend == pytest.approx(np.degrees(angle_rad(robot.segments[1], own)), abs=1e-9)


def test_play_is_a_loop_of_its_width() -> None:
    """A drive with play moves its torsion joint by Eq. 7 of the displacement less, then plus, half of it."""
    robot = catheter("mitral_transseptal", "tendons.torsion_proximal.play_mm=1.0")
    turn = bends_deg(robot, pulls(1, 3.0, 1.0, steps=20), "torsion_proximal")
    segment = robot.segments[0]
    assert turn[20] == pytest.approx(math.degrees(float(angle_rad(segment, 2.5e-3))), abs=1e-9)
    assert turn[21:31] == pytest.approx(turn[20], abs=1e-9)
    assert turn[-1] == pytest.approx(math.degrees(float(angle_rad(segment, 1.5e-3))), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("pair", "name"), [(0, "bending_proximal"), (1, "bending_distal")])
def test_first_cycle_is_the_te_model(pair: int, name: str) -> None:
    """Without slack, play and friction the first loading and unloading are those of `te`.

    Its simplification of the tendon's law concerns later cycles only.
    """
    robot = catheter(
        "mitral_4dof@elongation", "friction.mu=0", f"tendons.{name}.slack_mm=0", "tendons.torsion.play_mm=0"
    )
    inputs = pulls(pair, 8.0, 4.0)
    theirs = joint_angles_deg(robot, te(robot, inputs, STILL).postures)[name]
    assert bends_deg(robot, inputs, name) == pytest.approx(theirs, abs=1e-9)


@pytest.mark.slow
def test_bent_joint_in_front_adds_to_the_distal_friction() -> None:
    """The distal joint's tendons turn with the proximal joint: bent, it leaves the distal one less."""
    robot = catheter("mitral_4dof@elongation", "friction.mu=0.2")
    rows = np.zeros((30, 4))
    rows[10:, 1] = np.linspace(0.0, 8e-3, 20)
    straight = bends_deg(robot, given(rows, "displacement"), "bending_distal")[-1]
    rows[:, 0] = np.minimum(np.arange(30), 10) * 0.8e-3
    bent = joint_angles_deg(robot, balance(robot, given(rows, "displacement"), STILL).postures)
    assert bent["bending_proximal"][-1] > 25.0
    assert bent["bending_distal"][-1] < straight - 0.5


def test_tortuous_path_widens_the_loop() -> None:
    """At the same displacement the angles out and back lie further apart with more turns before the base."""
    widths = []
    for path_deg in (0, 180, 360):
        robot = catheter("mitral_transseptal@tube", f"path_deg={path_deg}")
        bend = bends_deg(robot, pulls(0, 6.0, 0.0), "bending")
        widths.append(bend[15] - bend[5])
    assert 0.0 < widths[0] < widths[1] < widths[2]


@pytest.mark.parametrize(
    ("name", "settings", "told"),
    [
        ("mitral_transseptal@tube", (), "row 2 .*displacement_bending_mm = 30: beyond the range"),
        (
            "mitral_4dof@elongation",
            ("tendons.bending_proximal.stiffness_N_per_mm=5",),
            "no stiffness besides",
        ),
        (
            "mitral_4dof",
            ("tendons.bending_proximal.law=uhmwpe", "segments.bending_proximal.rest_deg=5"),
            "straight at rest",
        ),
        ("mitral_4dof@elongation", ("segments.bending_proximal.rest_deg=5",), "must be 0: the measured"),
    ],
)
def test_what_has_no_balance_is_told(name: str, settings: tuple[str, ...], told: str) -> None:
    """A displacement beyond the joint, and laws that it cannot combine, are one line each."""
    rows = np.zeros((2, 4))
    rows[1, 0] = 30e-3
    with pytest.raises(InputError, match=told):
        balance(catheter(name, *settings), given(rows, "displacement"), STILL)


def test_pulls_before_rest_are_of_the_other_side() -> None:
    """The model is odd: a mirrored history has mirrored angles."""
    robot = catheter("mitral_transseptal@tube")
    there, mirrored = (bends_deg(robot, pulls(0, sign * 5.0, -sign * 4.0), "bending") for sign in (1, -1))
    assert there == pytest.approx(-mirrored, abs=1e-9)
    assert float(pulled_m(robot.segments[1], math.radians(there[10]))) < 5e-3 - robot.tendons[0].slack_m


def test_a_sprung_joint_off_its_balance_shows_in_the_residual(monkeypatch: pytest.MonkeyPatch) -> None:
    """To rounding where it balances; a joint bent five percent too far leaves a part of its moment over."""
    module = importlib.import_module("catheter_sim.robots.catheter.statics")
    robot = catheter("mitral_transseptal", "tendons.bending.stiffness_N_per_mm=20", "friction.mu=0.2")
    pair = [item.name for item in robot.tendons].index("bending")
    inputs = pulls(pair, 2.5, 1.0, -2.0, 3.0)
    angles, tension, residual = module.balanced_joints(robot, inputs)
    moment = 5.6e-3 * np.abs(angles[:, pair]).max()
    assert tension.max() > 0.5
    assert residual.max() < 1e-6 * moment
    branch = module._branch
    monkeypatch.setattr(module, "_branch", lambda *arguments: 1.05 * branch(*arguments))
    _, _, spoiled = module.balanced_joints(robot, inputs)
    assert spoiled.max() > 1e-2 * moment
