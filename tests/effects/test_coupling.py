"""Coupling: one section's or joint's input moves another one, side to side."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction, RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import arriving_inputs, check_effects, with_effects
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

COUPLING = EFFECTS["coupling"]


def arrived(robot: RobotSpec, values: dict[str, float], tendon: Array) -> Array:
    """Return what arrives of one row of inputs, shape (t,)."""
    coupled = with_effects(robot, {"coupling": values})
    check_effects(coupled)
    zeros = np.zeros((1, 3))
    inputs = Inputs(np.zeros(1), robot.actuation, np.array([tendon], dtype=float), zeros, zeros)
    return arriving_inputs(coupled, inputs).tendon[0]


def two_by_three(turn_deg: float) -> ContinuumRobot:
    """Return two segments of three tendons each, the second's turned against the first's."""
    return ContinuumRobot(
        name="two",
        description="",
        segments=(Segment("a", 0.05, 5, 5e-3, 2e-3, 5e-3), Segment("b", 0.06, 5, 5e-3, 2e-3, 5e-3)),
        tendons=tuple(
            Tendon(f"{segment}{k}", 4e-3, math.radians(120.0 * k + turn), segment, stiffness_N_per_m=8e3)
            for segment, turn in (("a", 0.0), ("b", turn_deg))
            for k in range(3)
        ),
        friction=Friction(0.0),
        actuation="displacement",
    )


def names(reference: str) -> list[str]:
    """Return the shares of a robot: each has its growth in the other form, and only that."""
    robot = load_robot(reference)
    share, growing = ([item.name for item in form.parameters(robot)] for form in COUPLING.forms[:2])
    assert [name.rpartition("_per_")[0] for name in growing] == share
    return share


def test_one_section_has_nothing_to_couple() -> None:
    """Robots of one section have no such effect, and setting it is refused."""
    for reference in ("neuroendoscope_section", "chest_tube_section"):
        assert names(reference) == []
    with pytest.raises(InputError, match="makes no sense"):
        check_effects(with_effects(load_robot("neuroendoscope_section"), {"coupling": {"a_to_b": 0.1}}))


def test_names_are_from_one_to_the_other() -> None:
    """Ordered pairs of sections, or of a catheter's joints; nothing is added to an advance."""
    assert set(names("neuroendoscope")) == {"distal_to_proximal", "proximal_to_distal"}
    assert len(names("chest_tube")) == 6
    catheter = names("mitral_transseptal")
    assert {"advance_to_torsion_distal", "bending_to_torsion_proximal"} < set(catheter)
    assert len(catheter) == 9
    assert not any(name.endswith("to_advance") for name in catheter)


def test_every_pair_alone_comes_before_all_together() -> None:
    """A diagnosis frees one coefficient at a time, then all."""
    robot = load_robot("mitral_4dof")
    variants = COUPLING.variants(robot)
    assert variants == (*((name,) for name in names("mitral_4dof")), tuple(names("mitral_4dof")))


def test_right_acts_on_right_and_left_on_left() -> None:
    """A share of a distal tension acts on the proximal tendons of its side, half on each, none elsewhere."""
    robot = load_robot("neuroendoscope")  # distal right, left; proximal right 1, 2, left 1, 2
    got = arrived(robot, {"distal_to_proximal": 0.2}, np.array([1.0, 0.3, 0.0, 0.0, 0.1, 0.1]))
    np.testing.assert_allclose(got, [1.0, 0.3, 0.1, 0.1, 0.13, 0.13], atol=1e-12)
    back = arrived(robot, {"proximal_to_distal": 0.5}, np.array([0.0, 0.0, 0.2, 0.2, 0.0, 0.0]))
    np.testing.assert_allclose(back, [0.2, 0.0, 0.2, 0.2, 0.0, 0.0], atol=1e-12)


def test_rods_at_right_angles_do_not_meet() -> None:
    """Of the chest tube's tip, the rods to the sides act on the base, those to front and back do not."""
    robot = load_robot("chest_tube")
    order = [rod.name for rod in robot.tendons]
    tension = np.array([5.0 if name in ("tip_left", "tip_front") else 0.0 for name in order])
    got = arrived(robot, {"tip_to_base": 0.1, "tip_to_middle": 0.2}, tension) - tension
    assert dict(zip(order, got.round(12).tolist(), strict=True)) == {
        name: {"base_left": 0.5, "middle_left": 1.0}.get(name, 0.0) for name in order
    }


@pytest.mark.parametrize("turn_deg", [0.0, 40.0, 60.0])
def test_turned_tendons_share_by_the_cosine(turn_deg: float) -> None:
    """Each tendon's share adds up to one, acts most on its nearest, and turns with the robot."""
    robot = two_by_three(turn_deg)
    each = np.array(
        [arrived(robot, {"a_to_b": 1.0}, 1e-3 * np.eye(6)[index])[3:] * 1e3 for index in range(3)]
    )
    np.testing.assert_allclose(each.sum(axis=1), 1.0, atol=1e-12)
    near, far = math.cos(math.radians(turn_deg)), max(math.cos(math.radians(120.0 - turn_deg)), 0.0)
    np.testing.assert_allclose(each[0], [near / (near + far), 0.0, far / (near + far)], atol=1e-12)
    np.testing.assert_allclose(each[1], np.roll(each[0], 1), atol=1e-12)


def test_a_displaced_pair_of_tendons_takes_and_gives_its_channel() -> None:
    """By displacement a channel's tendons all move alike: the share is of the channel's, for each of them."""
    robot = replace(load_robot("neuroendoscope"), actuation="displacement")
    got = arrived(robot, {"distal_to_proximal": 0.2}, 1e-3 * np.array([1.0, -1.0, 0.0, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(got * 1e3, [1.0, -1.0, 0.2, 0.2, -0.2, -0.2], atol=1e-12)


def test_a_joint_of_a_catheter_moves_another_by_its_share() -> None:
    """Displacements add up in mm a mm, sign included; the pair that moves is not changed itself."""
    robot = load_robot("mitral_transseptal")  # bending, torsion proximal, torsion distal, advance
    values = {"bending_to_torsion_distal": -0.1, "advance_to_bending": 0.01}
    got = arrived(robot, values, 1e-3 * np.array([2.0, 1.0, 0.5, 30.0])) * 1e3
    np.testing.assert_allclose(got, [2.3, 1.0, 0.3, 30.0], atol=1e-12)


def test_a_tension_never_becomes_a_push() -> None:
    """A share below zero takes tension away, down to zero."""
    robot = load_robot("neuroendoscope")
    got = arrived(robot, {"distal_to_proximal": -0.5}, np.array([1.0, 0.0, 0.1, 0.1, 0.3, 0.3]))
    np.testing.assert_allclose(got, [1.0, 0.0, 0.0, 0.0, 0.3, 0.3], atol=1e-12)
