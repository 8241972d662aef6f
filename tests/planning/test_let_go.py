"""A robot that rubs and has inputs to spare may have to let go of what it pulls to reach the next target."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import posture_columns
from catheter_sim.planning.inverse import Targets, inverse_kinematics, random_levels, targets_of
from catheter_sim.planning.models import PlanDrives, inputs_at, plan_drives
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table

STILL = np.zeros(3)
AXES = ("tip_x_mm", "tip_y_mm", "tip_z_mm")


def simulated_targets(name: str, seed: tuple[int, int]) -> tuple[Targets, PlanDrives]:
    """Return where random inputs, ten in a row from rest, bring the tip of the simulated robot."""
    robot = load_robot(name)
    drives = plan_drives(robot)
    clock = np.arange(10.0)
    inputs = inputs_at(drives, random_levels(drives, 10, np.random.default_rng(list(seed))), clock)
    columns = posture_columns(robot, simulate(robot, inputs, STILL).postures, AXES)
    return targets_of(robot, Table(clock, columns), drives.length_m), drives


@pytest.mark.long
def test_what_is_pulled_is_let_go_where_nothing_else_leads_there() -> None:
    """All ten of the whole chest tube are reached; the last one, at which one rod of eight pulls, is missed
    by 0.2 % of the length from every other start, whichever way led to the one before."""
    targets, drives = simulated_targets("chest_tube", (1, 93))
    plan = inverse_kinematics(load_robot("chest_tube"), targets, drives, STILL, None)
    assert plan.reachable.tolist() == [True] * 10
    assert plan.limits == ("",) * 10
