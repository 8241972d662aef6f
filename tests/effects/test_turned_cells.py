"""Elements that are turned between their faces: closed form, simulation, and what does not carry them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import posture_columns
from catheter_sim.core.effect import Role
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import (
    outside_the_robot,
    reshapes,
    wholly_built_in,
    with_built_in_effects,
    with_effects,
)
from catheter_sim.effects.shared import places, sizes
from catheter_sim.effects.twist import stacked_anew
from catheter_sim.envs.reach_and_track import ReachEnv
from catheter_sim.errors import InputError
from catheter_sim.simulation.replay import simulate
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import twin_for

PLANAR = ("neuroendoscope_section", "neuroendoscope", "chest_tube_section", "chest_tube")
COLUMNS = ("tip_x_mm", "tip_y_mm", "tip_z_mm", "tip_qw", "tip_qx", "tip_qy", "tip_qz", "body_2_y_mm")
STILL = np.zeros(3)


def arc(elements: int, bend_rad: float, length_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the faces of elements on an arc in the xz plane."""
    angle = bend_rad * np.arange(1, elements + 1) / elements
    x, z = 1.0 - np.cos(angle), np.sin(angle)
    places = length_m / bend_rad * np.stack([x, np.zeros_like(x), z], axis=-1)
    return places, Rotation.from_rotvec(angle[:, np.newaxis] * [0.0, 1.0, 0.0]).as_matrix()


def turned(robot: RobotSpec, tip_deg: float) -> RobotSpec:
    """Return the robot whose last element is turned by an angle in all."""
    rate = tip_deg / sizes(robot).length_m
    return with_effects(robot, {"twist": {"cells_rate_deg_per_m": rate}})


def pulled(robot: RobotSpec, rows: int = 5) -> Inputs:
    """Return a pull of the first tendon that bends the robot well within what it can do."""
    tendon = np.zeros((rows, len(robot.tendons)))
    tendon[:, 0] = np.linspace(0.0, 0.4, rows)
    return Inputs(np.arange(float(rows)), "tension", tendon, np.zeros((rows, 3)), np.zeros((rows, 3)))


@pytest.mark.parametrize("turn_deg", [-70.0, 20.0, 160.0])
def test_many_elements_on_an_arc_become_a_helix(turn_deg: float) -> None:
    """Curvature k about an axis that turns about the tangent at a rate t: a helix of radius k / (k^2 + t^2)
    and climb t / (k^2 + t^2) for each radian, w = (k^2 + t^2)^1/2 of them for each length."""
    bend, length, elements = 2.0, 0.1, 2000
    each = math.radians(turn_deg) / elements
    p, _ = stacked_anew(*arc(elements, bend, length), each)
    curvature, torsion = bend / length, math.radians(turn_deg) / length
    w = math.hypot(curvature, torsion)
    at = length * np.arange(1, elements + 1) / elements
    chord = np.hypot(2.0 * curvature / w**2 * np.sin(0.5 * w * at), torsion / w * at)
    np.testing.assert_allclose(np.linalg.norm(p, axis=-1), chord, atol=1e-4 * length)
    # Out of the plane by k t s^3 / 6 at first, to the left of the bend where the turn is counter-clockwise.
    near = elements // 20
    assert p[near, 1] == pytest.approx(curvature * torsion * at[near] ** 3 / 6.0, rel=0.1)


def test_two_elements_by_hand() -> None:
    """Each turned by 180 deg: the first element bends toward y, the second away from what y has become."""
    bend, length = math.radians(60.0), 0.02
    one = Rotation.from_euler("y", bend)
    step = length * np.array([0.3, 0.0, 0.9])
    p = np.array([step, step + one.apply(step)])
    R = np.array([one.as_matrix(), (one * one).as_matrix()])
    half = Rotation.from_euler("z", 90.0, degrees=True)
    placed, frames = stacked_anew(p, R, math.pi)
    first = half * one * half
    np.testing.assert_allclose(
        placed, [half.apply(step), half.apply(step) + (first * half).apply(step)], atol=1e-15
    )
    np.testing.assert_allclose(frames, [first.as_matrix(), (first * first).as_matrix()], atol=1e-12)
    np.testing.assert_allclose(placed[0], length * np.array([0.0, 0.3, 0.9]), atol=1e-12)


def test_elements_that_are_not_turned_stay_where_they_are() -> None:
    """No turn, or none given, changes nothing."""
    p, R = arc(7, 1.2, 0.1)
    for part, same in zip(stacked_anew(p, R, 0.0), (p, R), strict=True):
        np.testing.assert_allclose(part, same, atol=1e-15)
    robot = load_robot("chest_tube_section")
    assert not reshapes(robot)
    assert not reshapes(with_effects(robot, {"twist": {}}))
    assert outside_the_robot(turned(robot, 0.0)) == []


@pytest.mark.parametrize("name", PLANAR)
def test_simulation_statics_and_twin_show_the_same(name: str) -> None:
    """The tip leaves the plane by half a millimetre or more, and all three agree as they do without.

    All three get the turn from one function, which the helix and the data of another law judge.
    """
    plain = load_robot(name)
    robot, inputs = turned(plain, 25.0), pulled(plain)
    before, now = twin_for(plain, "tension", COLUMNS, STILL)([plain, robot], inputs)
    assert np.abs(before[:, [1, 7]]).max() == pytest.approx(0.0, abs=1e-12)
    assert now[-1, 1] > 0.5
    for each, expected in ((plain, before), (robot, now)):
        columns = posture_columns(each, simulate(each, inputs, STILL).postures, COLUMNS)
        np.testing.assert_allclose(np.stack(list(columns.values()), axis=1), expected, atol=2e-3)
    model = STATIC_MODELS["complete" if name.startswith("chest_tube") else "fkm_exact_arm"]
    columns = posture_columns(robot, model.solve(robot, inputs, STILL).postures, COLUMNS)
    np.testing.assert_allclose(np.stack(list(columns.values()), axis=1), now, atol=2e-3)


def test_a_twin_asked_for_robots_with_and_without_shows_each() -> None:
    """One call for several robots and every other row: rows and robots are not mixed up."""
    plain = load_robot("chest_tube_section")
    robots, inputs = [turned(plain, 30.0), plain, turned(plain, -30.0)], pulled(plain)
    predict = twin_for(plain, "tension", COLUMNS, STILL)
    together = predict(robots, inputs, 2)
    for robot, rows in zip(robots, together, strict=True):
        np.testing.assert_array_equal(predict([robot], inputs)[0][::2], rows)
    np.testing.assert_allclose(together[0][:, 1], -together[2][:, 1], atol=1e-12)


@pytest.mark.parametrize("name", ["spacer_disk", "notched_wrist", *PLANAR])
def test_a_robot_has_one_way_to_twist(name: str) -> None:
    """Either holes or elements turn: what bends in any plane shows the same of both."""
    robot = load_robot(name)
    (parameter,) = EFFECTS["twist"].parameters(robot)
    assert (parameter.name == "cells_rate_deg_per_m") == bool(places(robot, Role.ELEMENT_TURN))
    assert (parameter.name == "cells_rate_deg_per_m") == (name in PLANAR)
    assert not (places(robot, Role.ELEMENT_TURN) and places(robot, Role.HOLE_TWIST))


def test_what_does_not_carry_it_says_so() -> None:
    """A robot built from the specification is without it; steps of a simulator and environments refuse."""
    robot = turned(load_robot("neuroendoscope_section"), 10.0)
    assert with_built_in_effects(robot) == replace(robot, effects={})
    assert outside_the_robot(robot) == ["twist"]
    with pytest.raises(InputError, match=r"effects.twist: acts on"):
        wholly_built_in(robot)
    with pytest.raises(InputError, match=r"effects.twist: acts on the shape.*leave it out"):
        ReachEnv("neuroendoscope_section", ["effects.twist.cells_rate_deg_per_m=100"])
