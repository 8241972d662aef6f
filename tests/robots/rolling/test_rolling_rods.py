"""Claims about many rods, an outer tube, and rods on a joint's own line, simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive import rows_to_inputs, tips_mm

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.robots.rolling.complete import complete
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation.chest_tube_full import ACROSS, SETS_N, in_outer_tube

pytestmark = pytest.mark.slow

NO_GRAVITY = np.zeros(3)


def differences(robot, rows, gravity=NO_GRAVITY):
    """Return the largest tip distance [mm] and joint angle difference [deg] from the complete statics."""
    runs = [solve(robot, rows_to_inputs(rows), gravity) for solve in (simulate, complete)]
    far = np.linalg.norm(tips_mm(runs[0]) - tips_mm(runs[1]), axis=1).max()
    angles = [np.degrees([posture.joint_angles for posture in run.postures]) for run in runs]
    return far, np.abs(angles[0] - angles[1]).max()


@pytest.mark.parametrize("sets", [slice(3, 5), pytest.param(slice(None), marks=pytest.mark.slow)])
def test_full_robot_without_friction_is_the_complete_balance(sets):
    """Base, middle and tip both ways in both planes, gravity across: 0.1 % of the length, 0.05 deg."""
    robot = replace(load_robot("chest_tube"), friction=Friction(0.0))
    far, turned = differences(robot, SETS_N[sets], ACROSS["+y"])
    assert far < 0.375
    assert turned < 0.05


@pytest.mark.parametrize("rod", [0, 6])
def test_one_rod_with_friction_is_the_complete_balance(rod):
    """Pulled alone to 30 N and let go to 10 N, the rods of the other planes slack: within 0.375 mm."""
    rows = np.zeros((2, 8))
    rows[:, rod] = (30.0, 10.0)
    far, turned = differences(load_robot("chest_tube"), rows)
    assert far < 0.375
    assert turned < 0.05


def test_rod_on_a_joints_own_line_keeps_its_tension():
    """Where a rod's tension can stop nothing, friction gives numbers, within the capstan's interval."""
    robot = load_robot("chest_tube")
    run = simulate(robot, rows_to_inputs([(0, 0, 0, 0, 0, 0, 10, 10)]), NO_GRAVITY)
    assert run.failure is None
    tension = run.postures[0].tendon_tension[6:]
    assert np.isfinite(tension).all()
    assert tension.max() <= 10.0 + 1e-9
    assert np.abs(tension[0] - tension[1]).max() < 0.05  # equal, as they pull alike
    assert np.abs(run.postures[0].joint_angles[15:]).max() < 1e-6  # joints of the base have other lines


def test_tube_stiffens_simulation_and_statics_alike():
    """In the outer tube, gravity across: within 0.25 mm of the statics; a stiff one keeps it straight."""
    bare = load_robot("chest_tube_section", ("friction.mu=0",))
    tubed = in_outer_tube(bare)
    far, turned = differences(tubed, [(5,), (50,)], ACROSS["+x"])
    assert far < 0.25
    assert turned < 0.05
    bends = []
    for robot in (bare, tubed, load_robot("chest_tube_section", ("sleeve.bending_stiffness_N_mm2=1e6",))):
        posture = simulate(robot, rows_to_inputs([(20,)]), NO_GRAVITY).postures[0]
        bends.append(np.degrees(posture.joint_angles.sum()))
    assert bends[0] > 1.2 * bends[1]
    # 15 joints of EI / L, turned by at most 20 N at an arm of 3 mm
    assert 0.0 < bends[2] < np.degrees(15 * 20.0 * 3e-3 * 15e-3 / 1.0)
