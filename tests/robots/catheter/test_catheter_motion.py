"""Claims about catheters in motion: slow motion is the held one, whatever acts by laws between two steps."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.simulation.replay import simulate


def swung(tendons: int, seconds: float = 2.0) -> Inputs:
    """Return the first joints' pairs and the tube, each out and in again."""
    time_s = np.arange(0.0, seconds, 0.1)
    rows = np.zeros((len(time_s), tendons))
    rows[:, 0] = rows[:, 1] = 1e-3 * np.sin(np.pi * time_s / seconds)
    rows[:, -1] = 5e-3 * np.sin(np.pi * time_s / seconds) ** 2
    nothing = np.zeros((len(time_s), 3))
    return Inputs(time_s, "displacement", rows, nothing, nothing)


@pytest.mark.slow
@pytest.mark.parametrize(
    "reference",
    [
        "mitral_transseptal",
        "mitral_transseptal@tube",
        "mitral_4dof",
        pytest.param("mitral_4dof@elongation", marks=pytest.mark.long),
    ],
)
def test_a_catheter_that_moves_slowly_is_where_it_is_held(reference: str) -> None:
    """Every published set moves, with friction, tubes and stretching tendons, within 0.5 mm of held rows."""
    robot = load_robot(reference)
    inputs, still = swung(len(robot.tendons)), np.zeros(3)

    def tips(dynamic: bool) -> Array:
        run = simulate(robot, inputs, still, dynamic=dynamic)
        assert run.failure is None
        return 1e3 * np.array([posture.p_w[-1] for posture in run.postures])

    moving, held = tips(True), tips(False)
    assert np.linalg.norm(moving - held, axis=1).max() < 0.5
    assert np.ptp(held, axis=0).max() > 2.0
