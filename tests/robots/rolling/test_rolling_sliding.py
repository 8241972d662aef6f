"""Claims about friction by how rods slide in the links: Coulomb's law holds, and the simulation agrees."""

from __future__ import annotations

import numpy as np
import pytest
from rolling_cases import NO_GRAVITY, SHAPE_TABLE, pulls

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.robots.rolling import complete as steps
from catheter_sim.robots.rolling.complete import (
    complete,
    complete_sliding,
    postures,
    solve_history,
    virtual_work,
)
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation.chest_tube_full import moment_left, violations
from catheter_sim.validation.lines import history

ALONE_MM = 0.02  # 1e-4 of the length; the section comes within 0.001, the prototype within 0.014


def tips(found: tuple[Posture, ...] | list[Posture]) -> Array:
    """Return the tips of every row [mm]."""
    return np.array([posture.p_w[-1] for posture in found]) * 1e3


def farthest(one: Array, other: Array) -> float:
    """Return the largest distance of two rows of points."""
    return float(np.linalg.norm(one - other, axis=1).max())


def by_tensions(reference: str, inputs: Inputs) -> list[Posture]:
    """Return the postures of a robot whose rods rub by a rule on their own tensions."""
    chain = rolling_chain(load_robot(reference))
    solved = solve_history(chain, inputs, NO_GRAVITY)
    return postures(chain, inputs, NO_GRAVITY, solved.theta, solved.at_joint, solved.link_length)


def against() -> Inputs:
    """Base left held at 5 N, base right to 25 N and back, tip right up meanwhile: `chest_tube`, by 0.5 N.

    In rows of 1 N a rod turns round within a row now and then, and the row's ends cannot tell.
    """
    rows = np.zeros((4, 8))
    rows[1:, 1], rows[2, 0], rows[2:, 4] = 5.0, 25.0, (4.0, 10.0)
    return history(rows, 0.5)


def pushed_while_held() -> Inputs:
    """The section's rod pulled to 15 N and held, while a force goes to and fro on the tip."""
    force = np.zeros((16, 3))
    force[3:, 0] = 0.3 * np.sin(0.6 * np.arange(13))
    base = pulls(np.minimum(5.0 * np.arange(1, 17), 15.0))
    return Inputs(base.time_s, "tension", base.tendon, force, base.moment_tip)


@pytest.mark.slow
def test_rods_against_one_another_obey_coulomb() -> None:
    """Every slide has its full friction, every joint its balance; by a rule on tensions hundreds have not."""
    robot, inputs = load_robot("chest_tube"), against()
    found = complete(robot, inputs, NO_GRAVITY).postures
    wrong, slides = violations(robot, found)
    assert wrong == 0
    assert slides > 2000
    assert moment_left(robot, found, NO_GRAVITY) < 1e-9
    assert violations(robot, by_tensions("chest_tube", inputs))[0] > 500
    np.testing.assert_array_equal(tips(complete_sliding(robot, inputs, NO_GRAVITY).postures), tips(found))


@pytest.mark.slow
def test_virtual_work_balances_under_the_same_friction() -> None:
    """By virtual work each joint stands where the balance of forces has it, to 1e-6 deg."""
    robot, inputs = load_robot("chest_tube"), against()
    one, other = (model(robot, inputs, NO_GRAVITY) for model in (complete, virtual_work))
    for ours, theirs in zip(one.postures, other.postures, strict=True):
        assert np.degrees(ours.joint_angles) == pytest.approx(np.degrees(theirs.joint_angles), abs=1e-6)


@pytest.mark.parametrize("reference", ["chest_tube_section", "chest_tube_section@prototype"])
def test_a_rod_alone_slides_as_its_tensions_say(reference: str) -> None:
    """Loading, unloading, reloading without weight: both rules give the tip within 0.02 mm."""
    robot, inputs = load_robot(reference), pulls([row[0] for row in SHAPE_TABLE])
    sliding = tips(complete_sliding(robot, inputs, NO_GRAVITY).postures)
    assert farthest(sliding, tips(by_tensions(reference, inputs))) < ALONE_MM
    assert farthest(sliding[2:3], sliding[5:6]) > 10.0  # 20 N up and down: friction is at work


def test_without_friction_nothing_depends_on_sliding() -> None:
    """At mu = 0 both rules are the same, whatever the rods do."""
    robot, inputs = load_robot("chest_tube", ("friction.mu=0",)), against()
    chain = rolling_chain(robot)
    plain = solve_history(chain, inputs, NO_GRAVITY)
    sliding = solve_history(chain, inputs, NO_GRAVITY, pre_sliding_m=(1e-8,))
    np.testing.assert_allclose(sliding.theta, plain.theta, atol=1e-9)
    np.testing.assert_allclose(sliding.at_joint, plain.at_joint)


def test_half_the_step_moves_little(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rods that work against one another, in steps half as long: no tip moves by more than 0.2 mm of 375."""
    robot, inputs = load_robot("chest_tube"), against()
    given = tips(complete(robot, inputs, NO_GRAVITY).postures)
    monkeypatch.setattr(steps, "STEP_BEND_RAD", 0.5 * steps.STEP_BEND_RAD)
    assert farthest(tips(complete(robot, inputs, NO_GRAVITY).postures), given) < 0.2


@pytest.mark.slow
def test_a_load_that_moves_a_held_rod_is_met_as_simulated() -> None:
    """A force to and fro: the simulated tip within 1 mm of 225, where a rule on tensions is 20 mm off."""
    robot, inputs = load_robot("chest_tube_section"), pushed_while_held()
    simulated = tips(simulate(robot, inputs, NO_GRAVITY).postures)
    assert farthest(tips(complete(robot, inputs, NO_GRAVITY).postures), simulated) < 1.0
    assert farthest(tips(by_tensions("chest_tube_section", inputs)), simulated) > 20.0
    assert np.ptp(simulated[3:, 0]) > 20.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.long) for seed in (2, 3))])
def test_random_histories_of_eight_rods_end_as_simulated(seed: int) -> None:
    """Sections that bend against one another: the tip within 0.5 % of 375 mm, half of the rows within 0.05 %.

    A rule on tensions is more than 20 mm off somewhere.
    """
    robot, draw = load_robot("chest_tube"), np.random.default_rng(seed)
    names = [rod.name for rod in robot.tendons]
    rows = np.zeros((12, len(names)))
    for section in ("base", "middle", "tip"):
        level = draw.uniform(-20.0, 20.0, len(rows)) * draw.uniform(0.3, 1.0)
        rows[:, names.index(f"{section}_right")] = np.maximum(level, 0.0)
        rows[:, names.index(f"{section}_left")] = np.maximum(-level, 0.0)
    inputs = pulls(rows)
    simulated = tips(simulate(robot, inputs, NO_GRAVITY).postures)
    apart = np.linalg.norm(tips(complete(robot, inputs, NO_GRAVITY).postures) - simulated, axis=1)
    assert apart.max() < 1.9
    assert np.median(apart) < 0.19
    assert farthest(tips(by_tensions("chest_tube", inputs)), simulated) > 20.0
