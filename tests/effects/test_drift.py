"""Claims about a zero that wanders and a response that creeps, both at once."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.effects.apply import arriving_inputs, with_effects

TIME_S = np.array([0.0, 4.0, 20.0, 60.0, 90.0, 150.0])
TENSION_N = np.array([0.0, 0.4, 0.4, 0.1, 0.3, 0.3])


def arrived(**drift: float) -> np.ndarray:
    """Return what arrives at the right tendon, shape (6,) [N]."""
    rows = np.stack([TENSION_N, np.zeros(6)], axis=1)
    inputs = Inputs(TIME_S, "tension", rows, np.zeros((6, 3)), np.zeros((6, 3)))
    robot = with_effects(load_robot("neuroendoscope_section"), {"drift": drift})
    return arriving_inputs(robot, inputs).tendon[:, 0]


@pytest.mark.parametrize("zero", [0.12, -0.03])
@pytest.mark.parametrize("creep", [0.3, -0.2])
def test_what_wanders_creeps_too(zero: float, creep: float) -> None:
    """u + z t + creep y, where y follows u + z t with the time constant: the equation integrated numerically.

    Neither acts as if the other were not there: both alone, added, are something else.
    """
    constant_s = 40.0

    def driven(t: float) -> float:
        return float(np.interp(t, TIME_S, TENSION_N)) + zero * t / 60.0

    solved = solve_ivp(
        lambda t, y: [(driven(t) - y[0]) / constant_s], (0.0, TIME_S[-1]), [0.0],
        t_eval=TIME_S, rtol=1e-9, atol=1e-12, max_step=1.0,
    )  # fmt: skip
    expected = [driven(t) + creep * y for t, y in zip(TIME_S, solved.y[0], strict=True)]
    both = arrived(zero_N_per_min=zero, creep=creep, creep_time_s=constant_s)
    assert both == pytest.approx(expected, abs=1e-5)
    alone = arrived(zero_N_per_min=zero) + arrived(creep=creep, creep_time_s=constant_s) - TENSION_N
    assert np.abs(both - alone).max() > 3e-3
