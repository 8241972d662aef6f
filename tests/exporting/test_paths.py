"""A rolling joint's body shifts in the file as a circle rolls."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.exporting.elements import find_shifts
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots import kind_of
from catheter_sim.simulation.simulator import Simulator


@pytest.mark.slow
def test_a_rolling_link_is_lifted_as_a_circle_is() -> None:
    """By R (1 - cos q) about its contact's place: a point on a rolling circle."""
    robot = cs.load_robot("chest_tube_section")
    plain = mujoco.MjModel.from_xml_string(build_mjcf(robot, motion=True))
    most = np.full(plain.njnt, 0.2)
    shifts = find_shifts(Simulator(robot), plain, np.zeros(plain.njnt), most, 0.225)
    lift = next(item for item in shifts if item.joint == "x1" and item.axis == 2)
    assert lift.left_m < 1e-6
    curvature = 2.0 * lift.coefficients[1]  # R of R (1 - cos q) = R q^2 / 2
    assert abs(curvature) == pytest.approx(6.7e-3, rel=0.02) or abs(curvature) == pytest.approx(
        2.275e-3, rel=0.02
    )
    assert lift.slope(0.1) == pytest.approx((lift.at(0.101) - lift.at(0.099)) / 0.002, rel=1e-4)


@pytest.mark.slow
def test_where_no_law_moves_a_body_there_are_no_slides() -> None:
    """A robot of fixed hinges has none."""
    robot = cs.load_robot("neuroendoscope_section")
    plain = mujoco.MjModel.from_xml_string(build_mjcf(robot, motion=True))
    assert kind_of(robot).name == "continuum"
    assert find_shifts(Simulator(robot), plain, np.zeros(plain.njnt), np.ones(plain.njnt), 0.06) == ()
