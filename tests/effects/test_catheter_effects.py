"""Effects of the catheters' drives and tendons: play, slack, friction on a path, cyclic stretch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import arriving_inputs, check_effects, with_built_in_effects, with_effects
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.kinematics import pk
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.catheter.statics import balance
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.lines import given
from catheter_sim.validation.mitral import joint_angles_deg


def with_(name: str, **effects: dict[str, float]) -> CatheterRobot:
    robot = load_robot(name)
    assert isinstance(robot, CatheterRobot)
    changed = with_effects(robot, effects)
    check_effects(changed)
    return with_built_in_effects(changed)


def test_backlash_is_a_play_before_the_drives() -> None:
    """The common width and a channel's own add up, on the command; the robot stays as it is."""
    robot = load_robot("mitral_transseptal")
    wide = with_effects(robot, {"backlash": {"width_mm": 0.2, "width_torsion_distal_mm": 0.3}})
    assert with_built_in_effects(wide) == robot
    inputs = given(1e-3 * np.array([[1.0, -1.0, 1.0, 1.0], [0.9, 0.0, 0.3, 0.7]]), "displacement")
    arrived = 1e-3 * np.array([[0.9, -0.9, 0.75, 0.9], [0.9, -0.1, 0.55, 0.8]])
    np.testing.assert_allclose(arriving_inputs(wide, inputs).tendon, arrived, atol=1e-15)


def test_backlash_adds_to_the_robots_own_play() -> None:
    """Two plays, the effect's and behind it the robot's own, do what one of the summed width does."""
    robot = load_robot("mitral_transseptal@tube")
    assert isinstance(robot, CatheterRobot)
    effect = with_effects(robot, {"backlash": {"width_torsion_proximal_mm": 0.15}})
    pairs = [replace(pair, play_m=1.5e-3) if pair.play_m == 1.35e-3 else pair for pair in robot.tendons]
    wider = replace(robot, tendons=tuple(pairs))
    assert wider != robot
    ways = np.zeros((9, 4))
    ways[:, 1] = 1e-3 * np.array([0.0, 1.0, 3.0, 2.0, -1.0, -3.0, -2.9, 0.0, 2.0])
    inputs = given(ways, "displacement")
    found = [
        joint_angles_deg(item, STATIC_MODELS["pk"].solve(item, inputs, np.zeros(3)).postures)
        for item in (effect, wider)
    ]
    np.testing.assert_allclose(found[0]["torsion_proximal"], found[1]["torsion_proximal"], atol=1e-9)
    assert np.abs(found[0]["torsion_proximal"]).max() > 5.0


def test_slack_belongs_to_the_bending_pair() -> None:
    """Slack is the bending tendons'; there is none of torsion pairs, and none for other robots."""
    robot = with_("mitral_transseptal", backlash={"slack_bending_mm": 0.8})
    assert [pair.slack_m for pair in robot.tendons] == pytest.approx([0.8e-3, 0.0, 0.0, 0.0])
    names = [item.name for item in EFFECTS["backlash"].parameters(load_robot("mitral_transseptal"))]
    assert "slack_torsion_distal_mm" not in names
    assert not any(
        "slack" in item.name for item in EFFECTS["backlash"].parameters(load_robot("neuroendoscope"))
    )


def test_friction_is_an_effect_only_where_tendons_stretch() -> None:
    """An inextensible pair moves its joint whether it rubs or not: nothing to find, nothing to set."""
    robot = load_robot("mitral_transseptal")
    with pytest.raises(InputError, match=r"tendon_friction: makes no sense"):
        check_effects(with_effects(robot, {"tendon_friction": {"mu": 0.1}}))
    rubbed = with_("mitral_transseptal@tube", tendon_friction={"mu": 0.2, "path_deg": 90.0})
    assert rubbed.friction.mu == 0.2
    assert np.degrees(rubbed.path_rad) == pytest.approx(90.0)


def test_cyclic_stretch_takes_away_bend_and_leaves_a_set() -> None:
    """With the measured tendon the joint bends less than by a spring, and a second loop is another one."""
    robot = with_("mitral_4dof", tendon_elongation={"cyclic_length_mm": 350.0})
    ways = np.array([0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 2.0])
    rows = np.zeros((len(ways), 4))
    rows[:, 0] = ways * 1e-3
    inputs = given(rows, "displacement")
    nominal = load_robot("mitral_4dof")
    assert isinstance(nominal, CatheterRobot)
    stretched = joint_angles_deg(robot, balance(robot, inputs, np.zeros(3)).postures)["bending_proximal"]
    pure = joint_angles_deg(nominal, pk(nominal, inputs, np.zeros(3)).postures)["bending_proximal"]
    assert (stretched[1:] < pure[1:]).all()
    assert stretched[2] - stretched[6] > 1.0  # the same displacement, after a larger one
