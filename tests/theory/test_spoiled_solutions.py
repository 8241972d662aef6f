"""Claims about residuals of models that solve joint by joint: a spoiled solution shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rolling_cases import NO_GRAVITY, pulls

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.robots.catheter import measured
from catheter_sim.robots.rolling import pcc
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.theory.static_models import STATIC_MODELS


def test_rolling_joints_of_constant_curvature(monkeypatch: pytest.MonkeyPatch) -> None:
    """15 joints bent by 1 mrad too much resist by the sum of their stiffness times 1 mrad."""
    robot = load_robot("chest_tube_section")
    assert isinstance(robot, RollingRobot)
    inputs = pulls([0.5])
    assert STATIC_MODELS["pcc"].solve(robot, inputs, NO_GRAVITY).residual.max() < 1e-12
    balanced = pcc.balanced

    def short_of_it(moments: object, *arguments: object) -> np.ndarray:
        angle = balanced(moments, *arguments) + 1e-3  # type: ignore[arg-type]
        moments(angle)  # type: ignore[operator]
        return angle

    monkeypatch.setattr(pcc, "balanced", short_of_it)
    left = STATIC_MODELS["pcc"].solve(robot, inputs, NO_GRAVITY).residual
    stiffness = rolling_chain(robot).rest_stiffness.sum()
    assert left == pytest.approx([1e-3 * stiffness], rel=0.1)


def test_bending_joints_with_stretching_tendons(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tendon that is tighter than its joint holds leaves that force, times its arm (5 % more bent)."""
    robot = load_robot("mitral_4dof")
    rows = np.array([(4e-3, 0.0, 0.0, 0.0), (6e-3, 0.0, 0.0, 0.0)])
    inputs = Inputs(np.arange(2.0), "displacement", rows, np.zeros((2, 3)), np.zeros((2, 3)))
    assert STATIC_MODELS["te"].solve(robot, inputs, NO_GRAVITY).residual.max() < 1e-12
    displaced = measured.displaced

    def residual(tighter_N: float) -> np.ndarray:
        def short_of_it(joint: object, side: object, way: float) -> object:
            found = displaced(joint, side, way)  # type: ignore[arg-type]
            if way <= 0.0:
                return found
            return replace(found, tendon=replace(found.tendon, tension_N=found.tendon.tension_N + tighter_N))

        with monkeypatch.context() as patch:
            patch.setattr(measured, "displaced", short_of_it)
            return STATIC_MODELS["te"].solve(robot, inputs, NO_GRAVITY).residual

    arm = robot.segments[0].arm_m
    assert residual(0.5) == pytest.approx(np.full(2, 0.5 * arm), rel=0.05)
    assert residual(1.0) == pytest.approx(np.full(2, 1.0 * arm), rel=0.05)
