"""Claims about tendons that are driven by displacement: how stiff an inextensible one is, pretension."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.robots.continuum.constant_curvature import drive_stiffness
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.theory.static_models import STATIC_MODELS


def bench(*settings: str) -> ContinuumRobot:
    robot = load_robot("spacer_disk", ("disks_per_segment=2", *settings))
    assert isinstance(robot, ContinuumRobot)
    return robot


@pytest.mark.parametrize("scale", [0.1, 1.0, 10.0])
def test_inextensible_tendon_follows_the_stiffness_of_the_robot(scale: float) -> None:
    """Its stiffness over that of bending, EI / (r^2 L) with the scaled EI, is the same for every robot."""
    robot = bench(f"stiffness_scale={scale}")
    rigidity = 211e9 * np.pi * 0.4e-3**4 / 4.0 * scale
    ratios = [
        drive_stiffness(robot, tendon) * tendon.radius_m**2 * length / rigidity
        for tendon, length in zip(robot.tendons, (0.05, 0.05, 0.1, 0.1), strict=True)
    ]
    assert ratios == pytest.approx([ratios[0]] * 4, rel=1e-9)
    reference = bench()
    unscaled = drive_stiffness(reference, reference.tendons[0]) * reference.tendons[0].radius_m ** 2 * 0.05
    assert ratios[0] == pytest.approx(unscaled / (rigidity / scale), rel=1e-9)


@pytest.mark.parametrize("pretension", [0.0, 0.5])
@pytest.mark.parametrize("model", ["CC", "CC_sub"])
def test_straight_robot_holds_its_pretension(model: str, pretension: float) -> None:
    """Undisplaced, every tendon pulls with its pretension; 10 um more at 10 N/mm adds 0.1 N."""
    settings = [f"tendons.{k}.pretension_N={pretension}" for k in range(1, 5)]
    settings += [f"tendons.{k}.stiffness_N_per_mm=10" for k in range(1, 5)]
    robot = bench("stiffness_scale=1000", *settings)
    rows = np.array([[0.0] * 4, [1e-5] * 4])
    inputs = Inputs(np.arange(2.0), "displacement", rows, np.zeros((2, 3)), np.zeros((2, 3)))
    run = STATIC_MODELS[model].solve(robot, inputs, np.zeros(3))
    expected = pretension + np.array([[0.0] * 4, [0.1] * 4])
    found = [posture.actuator_tension for posture in run.postures]
    np.testing.assert_allclose(found, expected, atol=1e-6)
