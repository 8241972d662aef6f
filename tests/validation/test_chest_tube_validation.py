"""Claims about the chest-tube robots' checks: they measure what they say, and notice what is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.robots.rolling.complete import complete
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation.chest_tube import ALL, BUT_MOMENT, term_curves
from catheter_sim.validation.chest_tube_full import (
    AGAINST,
    in_outer_tube,
    moment_left,
    pushed,
    requirements_table,
    table_markdown,
    tube_modulus_Pa,
    violations,
)
from catheter_sim.validation.lines import NO_GRAVITY, given, history, largest_distance, tips_mm


def full_robot() -> RollingRobot:
    """Return the full robot."""
    return load_robot("chest_tube")


def test_coulomb_count_notices_a_wrong_friction() -> None:
    """One rod there and back at mu = 0.2, judged as 0.316, slides without full friction; as 0.2 not."""
    robot = replace(load_robot("chest_tube_section"), friction=Friction(0.2))
    postures = complete(robot, history([(0,), (30,), (5,)], 1.0), NO_GRAVITY).postures
    wrong, slides = violations(robot, postures)
    assert wrong == 0
    assert slides > 200
    assert violations(load_robot("chest_tube_section"), postures)[0] > 100


def test_moment_left_notices_a_wrong_stiffness() -> None:
    """Simulated postures balance under their own tensions to 0.01 N mm, a 1 % stiffer robot's do not."""
    robot = load_robot("chest_tube_section")
    postures = simulate(robot, given(np.array([[20.0]])), NO_GRAVITY).postures
    assert moment_left(robot, postures, NO_GRAVITY) < 1e-5
    assert moment_left(replace(robot, stiffness_scale=1.01), postures, NO_GRAVITY) > 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", AGAINST)
def test_simulation_obeys_coulomb_as_the_statics_do(name: str) -> None:
    """Rods against one another: no slide without full friction in either, tips together within 0.1 %."""
    robot, corners = full_robot(), np.array(AGAINST[name], dtype=float)
    every = np.zeros((len(corners) + 1, 8))
    every[1:, : corners.shape[1]] = corners
    inputs = history(every, 1.0)
    ours = simulate(robot, inputs, NO_GRAVITY, ramp_s=0.25).postures
    theirs = complete(robot, inputs, NO_GRAVITY).postures
    assert violations(robot, ours)[0] == 0
    assert violations(robot, theirs)[0] == 0
    assert largest_distance(tips_mm(ours), tips_mm(theirs)) < 0.375
    assert moment_left(robot, ours, NO_GRAVITY) < 1e-5


def test_tube_of_the_assumed_material() -> None:
    """Gent's relation: 1.4 to 2 MPa at 40 Shore A, 5 to 10 MPa at 75; EI from the printed radii."""
    assert 1.4e6 < tube_modulus_Pa(40.0) < 2.0e6
    assert 5e6 < tube_modulus_Pa(75.0) < 10e6
    tubed = in_outer_tube(full_robot())
    second = np.pi / 64.0 * ((28.0 / 3.0) ** 4 - 6.2**4)  # mm^4, 28F outside, 6.2 mm inside
    assert tubed.sleeve.bending_stiffness_N_m2 == pytest.approx(tube_modulus_Pa() * second * 1e-12)


@pytest.mark.slow
def test_every_missing_term_is_needed_and_the_moment_ends_the_buckling() -> None:
    """All terms but one, or one alone, miss the complete tip by over 20 mm; without the moment it buckles."""
    curves = term_curves("without weight")
    for name, tips in curves.tips_mm.items():
        far = largest_distance(tips, curves.complete_tips_mm)
        assert (far < 1e-6) if name == ALL else (far > 20.0)
    assert np.median(curves.balances[BUT_MOMENT][-1, 1::2]) < -3.0
    assert curves.complete[:, 1::2].min() > -1e-9


@pytest.mark.slow
def test_pushed_tip_yields_less_where_rods_are_gripped() -> None:
    """Held tensions yield most, gripped rods less; the rod that works against the force is named."""
    robot = in_outer_tube(
        load_robot("chest_tube_section", ("segments.section.joints=4", "segments.section.length_mm=60"))
    )
    against, along = pushed(robot, robot.tendons[0], 30.0)
    for item in (against, along):
        assert 0.0 <= item.best_mm < item.yields_mm
        assert item.locked_mm < item.yields_mm
        assert 0.0 < item.carries_N <= 0.35
    assert (against.rod, along.rod) == ("active", "passive")


@pytest.fixture(scope="module")
def section_table() -> dict:
    """Return Table I of the measured section by name and wish."""
    table = requirements_table(load_robot("chest_tube_section"))
    return {(item.name, item.wished): item for item in table}


@pytest.mark.slow
def test_table_says_what_is_met(section_table: dict) -> None:
    """90 deg within 10 to 100 N is met; 180 deg, a 20 mm radius, a 3 mm lumen are not."""
    met = {key: item.met for key, item in section_table.items()}
    assert met["Bending range (Base)", "90 deg"]
    assert met["Estimated Tension", "10 - 100 N"]
    assert met["Outer diameter", "6.2 mm"]
    assert met["Bending range (Base)", "180 deg"] is False
    assert met["Inner diameter", "3 mm"] is False
    radius = section_table["Max radius of curvature", "20 mm"]
    assert radius.met is False
    assert "Base 32." in radius.found  # findings: the gap closes at about 32 mm
    assert met["Sterilizable/Disposable", "-"] is None
    text = table_markdown("Table I", tuple(section_table.values()))
    assert text.count("\n| ") == 1 + len(section_table)


@pytest.mark.slow
def test_table_is_computed_from_the_robot() -> None:
    """Another robot gives another table: a wider lumen, a shorter link and stiffer rods change its lines."""
    robot = load_robot("chest_tube_section")
    other = replace(robot, channel_radius_m=1.6e-3, stiffness_scale=8.0)
    table = {(item.name, item.wished): item for item in requirements_table(other)}
    assert table["Inner diameter", "3 mm"].met
    assert table["Bending range (Base)", "90 deg"].met is False
