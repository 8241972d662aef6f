"""Tendons that converge to the backbone or wind about it, by keys of a robot's file."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lumped_cases import FULL_PULL_N, LENGTH, NO_GRAVITY, benchmark, pulled, rod

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots.continuum.description import hole_xy_m, winds_or_converges
from catheter_sim.simulation.replay import simulate
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import twin_for
from catheter_sim.validation.lines import given
from catheter_sim.validation.tdcr_readings import helical, simulated_tip_m, vc_tip_m

EI = 4e-3  # of `rod` [N m^2]
HALF_TURN = np.array([0.0, 0.0, 0.5 * FULL_PULL_N, 0.0])


def wound(disks: int, turn_rad: float = math.pi) -> RobotSpec:
    """Return the benchmark's robot with all its tendons wound by half a turn from base to tip."""
    robot = benchmark(disks)
    tendons = [
        replace(item, turn_rad=turn_rad * (0.5 if item.ends_at == "first" else 1.0)) for item in robot.tendons
    ]
    return replace(robot, tendons=tuple(tendons), links_per_subsegment=2)


def mixed(disks: int, links: int = 4) -> RobotSpec:
    """Return it with two straight tendons, one that converges to half its distance, one that winds."""
    robot = benchmark(disks)
    one, two, three, four = robot.tendons
    three, four = replace(three, end_radius_m=4e-3), replace(four, turn_rad=0.5 * math.pi)
    return replace(robot, tendons=(one, two, three, four), links_per_subsegment=links)


def tip(name: str, robot: RobotSpec, pull) -> np.ndarray:
    return STATIC_MODELS[name].solve(robot, pulled([pull]), NO_GRAVITY).postures[0].p_w[-1]


def test_holes_go_evenly_from_base_to_end():
    """Half way up a tendon its distance and its angle are half way, at its end they are there."""
    robot = mixed(2)
    converging, winding = robot.tendons[2:]
    assert hole_xy_m(robot, converging, 0.05) == pytest.approx((0.0, 6e-3))
    assert hole_xy_m(robot, converging, 0.1) == pytest.approx((0.0, 4e-3))
    angle = winding.angle_rad + 0.25 * math.pi
    assert hole_xy_m(robot, winding, 0.05) == pytest.approx((8e-3 * math.cos(angle), 8e-3 * math.sin(angle)))
    assert winds_or_converges(robot)
    assert not winds_or_converges(benchmark(2))


def test_all_tendons_wound_alike_are_holes_with_a_rest_twist():
    """The same model for MuJoCo, site by site."""
    ours, theirs = (build_mjcf(robot, "tension") for robot in (wound(3), helical(3)))
    assert ours.count('name="hole_') == 22
    assert [line for line in ours.splitlines() if "hole_" in line] == [
        line for line in theirs.splitlines() if "hole_" in line
    ]


@pytest.mark.slow
@pytest.mark.xdist_group("tdcr")
def test_winding_tendons_come_to_a_rod_written_for_them_alone():
    """Half a turn: VC_ref_noproj and parabolas by energy to 0.02 % at ten disks, in second order."""
    away = {}
    for disks in (5, 10):
        expected = vc_tip_m(helical(disks), HALF_TURN)
        for name in ("VC_ref_noproj", "polynomial", "PRB_one"):
            gap = np.linalg.norm(tip(name, wound(disks), HALF_TURN) - expected)
            away[name, disks] = 100.0 * gap / LENGTH
    assert away["VC_ref_noproj", 10] < 0.02
    assert away["polynomial", 10] < 0.03
    assert math.log2(away["VC_ref_noproj", 5] / away["VC_ref_noproj", 10]) == pytest.approx(2.0, abs=0.3)
    straight = np.linalg.norm(
        tip("VC_ref_noproj", benchmark(10), HALF_TURN) - vc_tip_m(helical(10), HALF_TURN)
    )
    assert straight > 0.1 * LENGTH


@pytest.mark.slow
@pytest.mark.xdist_group("tdcr")
def test_straight_converging_and_winding_tendons_together_are_the_simulation():
    """Three tendons pulled: the rod in eyelets to 0.03 % of the length, arcs to 2 %."""
    robot, pull = mixed(10), 0.5 * FULL_PULL_N * np.array([1.0, 0.0, 1.0, 1.0])
    chain = simulated_tip_m(robot, pull)
    assert np.linalg.norm(tip("VC_ref_noproj", robot, pull) - chain) < 3e-4 * LENGTH
    assert 1e-3 * LENGTH < np.linalg.norm(tip("CC", robot, pull) - chain) < 2e-2 * LENGTH
    assert np.linalg.norm(tip("VC_ref_noproj", benchmark(10), pull) - chain) > 2e-2 * LENGTH


@pytest.mark.slow
@pytest.mark.xdist_group("tdcr")
def test_displacements_of_routed_tendons_are_the_simulations():
    """From rest, where a tendon that winds is longer than the robot: tip and tensions of the chain.

    To 0.1 % of the length; taken for as long as the robot, the tendons would be off by ten times that.
    """
    robot = mixed(10)
    tendons = tuple(replace(item, stiffness_N_per_m=2e4) for item in robot.tendons)
    robot = replace(robot, tendons=tendons, actuation="displacement")
    inputs = given(1e-3 * np.array([[2.0, -2.5, 3.0, -1.0], [1.0, -1.0, 0.5, 2.0]]), "displacement")
    run = STATIC_MODELS["VC_ref_noproj"].solve(robot, inputs, NO_GRAVITY)
    chain = simulate(robot, inputs, NO_GRAVITY)
    for ours, theirs in zip(run.postures, chain.postures, strict=True):
        assert ours.actuator_tension.max() > 1.0
        np.testing.assert_allclose(ours.p_w[-1], theirs.p_w[-1], atol=1e-3 * LENGTH)
        np.testing.assert_allclose(ours.actuator_tension, theirs.actuator_tension, atol=0.05)
    np.testing.assert_allclose(
        STATIC_MODELS["VC_ref_noproj"]
        .solve(robot, given([[0.0] * 4], "displacement"), NO_GRAVITY)
        .postures[0]
        .actuator_tension,
        0.0,
        atol=1e-9,
    )


@pytest.mark.slow
@pytest.mark.xdist_group("tdcr")
@pytest.mark.parametrize(
    "name", ["CC_sub", "PRB", "PRB_one", "VC_ref", "VC_ref_noproj", "polynomial", "haar"]
)
def test_a_small_pull_of_a_converging_tendon_bends_by_its_arm(name):
    """x = T / EI (r L^2 / 2 + (r' - r) L^2 / 6) and turn T L (r + r') / 2 EI, r' at the end.

    CC_sub takes the moment at each subsegment's base, where the arm is larger.
    """
    robot = rod(20, ((0.0, 8e-3),))
    robot = replace(robot, tendons=(replace(robot.tendons[0], end_radius_m=2e-3),))
    (posture,) = STATIC_MODELS[name].solve(robot, pulled([[0.01]]), NO_GRAVITY).postures
    x = 0.01 / EI * LENGTH**2 * (8e-3 / 2.0 - 6e-3 / 6.0)
    close = {"CC_sub": 0.04, "haar": 0.02}.get(name, 4e-3)
    assert posture.p_w[-1, 0] == pytest.approx(x, rel=close)
    assert posture.R_w[-1][0, 2] == pytest.approx(0.01 * LENGTH * 5e-3 / EI, rel=max(close, 4e-3))


def test_arcs_turn_by_the_mean_arm_and_fits_take_more_of_them():
    """CC's tip turns by T L (r + r') / 2 EI; the twin's arcs give the bend's place along the robot, too."""
    robot = rod(20, ((0.0, 8e-3),))
    robot = replace(robot, tendons=(replace(robot.tendons[0], end_radius_m=2e-3),))
    inputs = pulled([[0.01]])
    (posture,) = STATIC_MODELS["CC"].solve(robot, inputs, NO_GRAVITY).postures
    assert posture.R_w[-1][0, 2] == pytest.approx(0.01 * LENGTH * 5e-3 / EI, rel=1e-6)
    x = 0.01 / EI * LENGTH**2 * (8e-3 / 2.0 - 6e-3 / 6.0)
    assert posture.p_w[-1, 0] < 0.85 * x
    table = twin_for(robot, "tension", ["tip_x_mm"], NO_GRAVITY)([robot], inputs, 1)
    assert float(np.ravel(table)[-1]) == pytest.approx(1e3 * x, rel=0.02)


def test_what_does_not_carry_them_says_so():
    robot = mixed(3)
    for name in ("VC", "VC_moment", "VC_tip_force", "four_bar"):
        assert STATIC_MODELS[name].lacks(robot) == "tendons that wind or converge"
    planar = load_robot("neuroendoscope_section", {"tendons.left.end_radius_mm": 1.0})
    assert "wind or converge" in STATIC_MODELS["fkm_sliding"].lacks(planar)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("end_radius_mm", 9.5, r"end_radius_mm = 9\.5: the tendon lies outside the disks of segment second"),
        ("end_radius_mm", -1.0, "must not be negative"),
        ("turn_deg", 800.0, "more than two turns"),
    ],
)
def test_impossible_routing_is_one_line(key, value, message):
    with pytest.raises(InputError, match=message):
        load_robot("spacer_disk", {f"tendons.3.{key}": value})
