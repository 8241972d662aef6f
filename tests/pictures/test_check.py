"""The render check passes a right model and fails a slightly wrong one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import read_inputs
from catheter_sim.core.posture import Posture
from catheter_sim.pictures.images import TOLERANCE_PX, centreline, check_render, compare
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.tables import Table
from catheter_sim.theory.static_models import STATIC_MODELS

Pose = Callable[[ContinuumRobot, np.ndarray], tuple[mujoco.MjModel, mujoco.MjData]]
TEN_TENSIONS_N = np.linspace(0.04, 0.4, 10)
LINE = np.column_stack([np.full(50, 320.25), np.linspace(400.0, 100.0, 50)])  # upward in the picture


def statics(robot: ContinuumRobot) -> tuple[Posture, ...]:
    """Return ten analytic postures of the measured section, up to about a quarter circle."""
    table = Table(np.arange(10.0), {"tension_right_N": TEN_TENSIONS_N})
    run = STATIC_MODELS["fkm_exact_arm"].solve(robot, read_inputs(robot, table), np.zeros(3))
    return run.postures


def stretched(posture: Posture, factor: float) -> Posture:
    return replace(posture, p_w=posture.p_w * factor)


@pytest.mark.slow
def test_right_model_is_drawn_within_a_pixel(posed_chain: Pose) -> None:
    """Ten analytic postures of the measured section, drawn with their own hinge angles."""
    robot = load_robot("neuroendoscope_section")
    checks = [check_render(robot, *posed_chain(robot, item.joint_angles), item) for item in statics(robot)]
    assert all(item.passed for item in checks)
    assert max(item.mean_px for item in checks) < 0.5 * TOLERANCE_PX  # leaves room for a simulation's error
    assert all(item.length_ratio == pytest.approx(1.0, abs=0.003) for item in checks)


@pytest.mark.slow
def test_stiffness_wrong_by_two_percent_fails(posed_chain: Pose) -> None:
    """Analytic stiffness 2 % off: over the ten postures the mean distance is above a pixel."""
    robot = load_robot("neuroendoscope_section")
    wrong = statics(replace(robot, stiffness_scale=1.02))
    checks = [
        check_render(robot, *posed_chain(robot, right.joint_angles), item)
        for right, item in zip(statics(robot), wrong, strict=True)
    ]
    assert np.mean([item.mean_px for item in checks]) > TOLERANCE_PX
    assert not checks[-1].passed
    assert checks[-1].largest_px > 3.0 * TOLERANCE_PX


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_length_wrong_by_two_percent_fails(posed_chain: Pose, factor: float) -> None:
    """A robot drawn 2 % too long or too short fails, though its backbone covers the expected line."""
    robot = load_robot("neuroendoscope_section")
    for posture in (statics(robot)[0], statics(robot)[-1]):
        check = check_render(robot, *posed_chain(robot, posture.joint_angles), stretched(posture, factor))
        assert not check.passed
        assert check.length_ratio == pytest.approx(1.0 / factor, abs=0.01)


def test_mirrored_model_fails(posed_chain: Pose) -> None:
    """A sign error (bending to the other side) is far outside."""
    robot = load_robot("neuroendoscope_section")
    posture = statics(robot)[4]
    assert check_render(robot, *posed_chain(robot, -posture.joint_angles), posture).mean_px > 20.0


def test_nothing_drawn_is_not_a_pass() -> None:
    """Without any pixel the distance is undefined, and undefined does not pass."""
    check = compare(np.zeros((480, 640), dtype=bool), LINE)
    assert math.isnan(check.mean_px)
    assert not check.passed


@pytest.mark.parametrize("offset", [0.0, 4.0])
def test_distance_is_the_offset_of_the_pixels(offset: float) -> None:
    """A tube painted 4 px to the side of a straight line is 4 px away; painted on it, 0."""
    row, column = np.mgrid[0:480, 0:640] + 0.5
    mask = (np.abs(column - 320.25 - offset) <= 6.0) & (row > 100.0) & (row < 400.0)
    assert compare(mask, LINE).mean_px == pytest.approx(offset, abs=0.3)


def test_curve_follows_a_bent_backbone_between_its_faces() -> None:
    """Four faces on a circular arc of 120 deg give the arc, where straight chords would be 1.3 mm off."""
    angles = np.radians((30.0, 60.0, 90.0, 120.0))
    radius = 0.04
    posture = Posture(
        p_w=np.column_stack([radius * (1 - np.cos(angles)), 0 * angles, radius * np.sin(angles)]),
        R_w=np.array(
            [[(math.cos(a), 0, math.sin(a)), (0, 1, 0), (-math.sin(a), 0, math.cos(a))] for a in angles]
        ),
        joint_angles=angles,
        actuator_tension=np.zeros(0),
        tendon_tension=np.zeros((0, 4)),
    )
    curve = centreline(load_robot("spacer_disk"), posture)
    assert np.abs(np.hypot(curve[:, 0] - radius, curve[:, 2]) - radius).max() < 0.05e-3
    assert curve[-1] == pytest.approx(posture.p_w[-1])
    assert curve[0] == pytest.approx(np.zeros(3))
