"""Claims about the tracker at the tool: what it takes for joint angles, and what it is misled by."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.controllers.loop import ToolTracker, tool_angles
from catheter_sim.robots.catheter.kinematics import tool_frame
from catheter_sim.robots.catheter.published import mitral_4dof
from catheter_sim.simulation.simulator import Simulator

STRAIGHT = (0.0, 0.0, 0.0)
VALUES = np.array([0.5, -0.7, 0.4, 0.012])  # bends, torsion [rad], advance [m]: the order of the pairs
Q = VALUES[[0, 1, 3, 2]]  # base to tip


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_angles_are_the_tools(sign: float) -> None:
    """Of a tool that the forward kinematics gives, its own three angles come back."""
    R = tool_frame(mitral_4dof(), sign * Q)[:3, :3]
    found = tool_angles(mitral_4dof(), R, sign * VALUES, STRAIGHT)
    np.testing.assert_allclose(found[:3], sign * VALUES[:3], atol=1e-12)


def test_a_turned_frame_moves_the_angle_about_its_axis() -> None:
    """Turned about the proximal joint's axis (+y bends toward +x), that angle alone is off, by the turn."""
    turn = math.radians(2.0)
    R = tool_frame(mitral_4dof(), Q)[:3, :3]
    found = tool_angles(mitral_4dof(), R, VALUES, (0.0, turn, 0.0))
    np.testing.assert_allclose(found[:3] - VALUES[:3], [-turn, 0.0, 0.0], atol=1e-12)


@pytest.mark.slow
def test_noise_is_of_angles_alone() -> None:
    """At rest the angles spread by the noise, to a tenth of it in 400 looks; the advance has none."""
    simulator = Simulator(mitral_4dof())
    tracker = ToolTracker(mitral_4dof(), 0.01, np.random.default_rng(0))
    turns = np.array([True, True, True, False])
    seen = np.array([tracker.measured(simulator, np.zeros(4), turns) for _ in range(400)])
    np.testing.assert_allclose(seen[:, :3].std(axis=0), 0.01, rtol=0.1)
    assert not seen[:, 3].any()
