"""Which way each effect goes and by how much, against geometry and closed forms; what adds, adds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction, RobotSpec
from catheter_sim.effects.apply import (
    arriving_inputs,
    check_effects,
    observed,
    with_built_in_effects,
    with_effects,
)
from catheter_sim.robots.continuum.constant_curvature import constant_curvature
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

LENGTH_M = 0.2
NONE = np.zeros(3)


def one_tendon(actuation: str = "tension") -> ContinuumRobot:
    """Return a frictionless robot of one tendon at +x that bends in any direction."""
    return ContinuumRobot(
        name="one",
        description="for the tests",
        segments=(Segment("arm", LENGTH_M, 20, 5e-3, 2e-3, 1e-3),),
        tendons=(Tendon("t", 4e-3, 0.0, "arm"),),
        friction=Friction(0.0),
        actuation=actuation,
    )


def changed(robot: RobotSpec, **effects: dict[str, float]) -> Any:
    """Return `robot` with effects attached, found possible."""
    result = with_effects(robot, effects)
    check_effects(result)
    return result


def pulled(tension_N: float) -> Inputs:
    zeros = np.zeros((1, 3))
    return Inputs(np.zeros(1), "tension", np.array([[tension_N]]), zeros, zeros)


def turn(vector: Array) -> Array:
    """Return the turn about `vector` by its length [rad], by Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def test_frame_turns_by_a_rotation_vector_about_the_base_and_then_shifts() -> None:
    """Positions and orientations alike, so that the robot stays one body: what is fixed to the tip is seen
    where the seen tip has it."""
    vector, shift = np.array([30.0, -40.0, 50.0]), np.array([4.0, -7.0, 11.0])
    frame = {f"rotation_{axis}_deg": value for axis, value in zip("xyz", vector, strict=True)}
    frame |= {f"translation_{axis}_mm": value for axis, value in zip("xyz", shift, strict=True)}
    robot = one_tendon()
    bent = replace(robot, segments=(replace(robot.segments[0], rest_curvature_y_per_m=4.0),))
    posture = constant_curvature(bent, pulled(0.02), NONE).postures[0]
    seen = observed(changed(bent, measurement_frame=frame), np.zeros(1), (posture,))[0]
    R, p = turn(np.radians(vector)), shift * 1e-3
    np.testing.assert_allclose(seen.p_w, posture.p_w @ R.T + p, atol=1e-12)
    for ahead in np.eye(3):
        fixed = posture.p_w + posture.R_w @ ahead
        np.testing.assert_allclose(seen.p_w + seen.R_w @ ahead, fixed @ R.T + p, atol=1e-12)


@pytest.mark.parametrize("rate_deg_per_m", [-200.0, 60.0, 200.0])
def test_twist_turns_the_bending_counter_clockwise_along_the_robot(rate_deg_per_m: float) -> None:
    """A weak pull bends each place toward its hole, at rate times its height: the tip goes where the
    integral of (L - s) (cos, sin) of that angle says."""
    (arm,), short = one_tendon().segments, LENGTH_M / 20
    arms = tuple(replace(arm, name=f"arm{k}", length_m=short, disks=1) for k in range(20))
    robot = replace(one_tendon(), segments=arms, tendons=(Tendon("t", 4e-3, 0.0, "arm19"),))
    robot = with_built_in_effects(changed(robot, twist={"rate_deg_per_m": rate_deg_per_m}))
    tip = constant_curvature(robot, pulled(1e-3), NONE).postures[0].p_w[-1]
    place = (np.arange(2000) + 0.5) / 2000 * LENGTH_M
    angle = math.radians(rate_deg_per_m) * place
    way = [np.sum((LENGTH_M - place) * side(angle)) for side in (np.cos, np.sin)]
    assert math.degrees(math.atan2(tip[1], tip[0])) == pytest.approx(
        math.degrees(math.atan2(way[1], way[0])), abs=0.03 * abs(rate_deg_per_m) * LENGTH_M
    )


@pytest.mark.parametrize("scale", [0.5, 3.0])
def test_stiffer_bends_less_under_tension(scale: float) -> None:
    """A weak pull bends a robot of three times the stiffness by a third."""
    bends = []
    for robot in (one_tendon(), with_built_in_effects(changed(one_tendon(), stiffness={"scale": scale}))):
        posture = constant_curvature(robot, pulled(0.01), NONE).postures[0]
        bends.append(math.atan2(posture.R_w[-1][0, 2], posture.R_w[-1][2, 2]))
    assert bends[0] > 1e-3
    assert bends[0] / bends[1] == pytest.approx(scale, rel=1e-3)


def test_what_the_specification_has_already_is_added_to() -> None:
    """Rest curvature, twist of the holes, cubic term and a load of the inputs stay under their effects."""
    own = replace(
        one_tendon().segments[0],
        rest_curvature_x_per_m=1.0,
        rest_curvature_y_per_m=-2.0,
        rest_twist_rad_per_m=0.3,
        stiffness_cubic_m2=2e-4,
    )
    robot = replace(one_tendon(), segments=(own,), stiffness_scale=2.0)
    built = with_built_in_effects(
        changed(
            robot,
            precurvature={"curvature_x_per_m": 0.5, "curvature_y_per_m": 0.25},
            twist={"rate_deg_per_m": 90.0},
            nonlinear_stiffness={"cubic_mm2": 300.0},
            stiffness={"scale": 1.5},
        )
    ).segments[0]
    assert built.rest_curvature_x_per_m == pytest.approx(1.5)
    assert built.rest_curvature_y_per_m == pytest.approx(-1.75)
    assert built.rest_twist_rad_per_m == pytest.approx(0.3 + math.pi / 2.0)
    assert built.stiffness_cubic_m2 == pytest.approx(5e-4)
    loaded = replace(pulled(0.0), force_tip=np.array([[0.01, 0.02, -0.03]]))
    heavier = arriving_inputs(changed(robot, payload={"force_x_N": 0.005, "force_z_N": -0.01}), loaded)
    np.testing.assert_allclose(heavier.force_tip, [[0.015, 0.02, -0.04]], atol=1e-15)


def test_units_of_a_catheters_effects() -> None:
    """Millimetres, degrees: a rest bend, a path's turns, a tendon's length and slack, each its own."""
    robot = load_robot("mitral_4dof")
    built = with_built_in_effects(
        changed(
            robot,
            precurvature={"bending_distal_deg": 12.0},
            tendon_elongation={"cyclic_length_mm": 350.0},
            backlash={"slack_bending_distal_mm": 0.7},
        )
    )
    before = {segment.name: segment.rest_rad for segment in robot.segments}
    added = {
        segment.name: math.degrees(segment.rest_rad - before[segment.name]) for segment in built.segments
    }
    assert added == pytest.approx({**dict.fromkeys(before, 0.0), "bending_distal": 12.0})
    pairs = {pair.name: pair for pair in built.tendons}
    assert pairs["bending_distal"].length_m == pytest.approx(0.35)
    assert pairs["bending_distal"].law == "uhmwpe"
    assert pairs["bending_distal"].slack_m == pytest.approx(7e-4)
    assert pairs["bending_proximal"].slack_m == 0.0
    tortuous = with_built_in_effects(
        changed(load_robot("mitral_transseptal@tube"), tendon_friction={"path_deg": 180.0})
    )
    assert tortuous.path_rad - load_robot("mitral_transseptal@tube").path_rad == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("reference", "unit"), [("neuroendoscope_section", "N"), ("mitral_transseptal", "mm")]
)
def test_wandering_zero_and_creep_act_together(reference: str, unit: str) -> None:
    """An input held from the start while its zero wanders: what has wandered creeps too.

    Creep answers the step u with c u (1 - exp(-t / T)) and the ramp r t with c r (t - T + T exp(-t / T)),
    which are the closed forms of a first-order lag; both come on top of u + r t.
    """
    robot = load_robot(reference)
    time_s = np.array([0.0, 1.0, 7.5, 20.0, 61.0, 240.0])
    held, rate, creep, constant_s = 0.3, 0.12, 0.4, 45.0
    si = 1.0 if unit == "N" else 1e-3
    tendon = np.full((len(time_s), len(robot.tendons)), held * si)
    zeros = np.zeros((len(time_s), 3))
    inputs = Inputs(time_s, robot.actuation, tendon, zeros, zeros)
    both = {f"zero_{unit}_per_min": rate, "creep": creep, "creep_time_s": constant_s}
    got = arriving_inputs(changed(robot, drift=both), inputs).tendon
    gone = np.exp(-time_s / constant_s)
    slope = rate / 60.0
    expected = held + slope * time_s
    expected = expected + creep * (held * (1.0 - gone) + slope * (time_s - constant_s * (1.0 - gone)))
    np.testing.assert_allclose(got, np.tile(expected[:, None] * si, got.shape[1]), rtol=1e-9)


def test_a_dead_band_starts_in_its_middle() -> None:
    """From rest nothing arrives within half the width, whichever way the first step goes."""
    robot = replace(one_tendon(), actuation="displacement")
    for first in (0.0, 0.2, -0.2, 0.4, -0.4):
        values = np.array([[first], [0.0]]) * 1e-3
        zeros = np.zeros((2, 3))
        inputs = Inputs(np.arange(2.0), "displacement", values, zeros, zeros)
        got = arriving_inputs(changed(robot, backlash={"width_mm": 0.6}), inputs).tendon[:, 0] * 1e3
        expected = math.copysign(max(abs(first) - 0.3, 0.0), first)
        np.testing.assert_allclose(got, [expected, expected], atol=1e-12)
