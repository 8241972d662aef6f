"""Replays of measured trials in time steps longer than the robot's own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from planted import as_inputs

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis import verdict
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

NO_GRAVITY = np.zeros(3)
COLUMNS = ("tip_x_mm", "tip_z_mm")
PULLS_N = np.array([[0.0, 0.0], [0.5, 0.0], [0.2, 0.1], [0.0, 0.4], [0.1, 0.0]])
DRAWN_M = 1e-3 * np.array([[0.0, 0.0], [1.0, -1.0], [0.4, -0.4], [-0.8, 0.8], [0.2, -0.2]])


def trial(actuation: str) -> Trial:
    inputs = as_inputs(PULLS_N if actuation == "tension" else DRAWN_M, actuation)
    nothing = np.full(len(inputs), np.nan)
    return Trial("trial.csv", "heldout", inputs, Table(inputs.time_s, dict.fromkeys(COLUMNS, nothing)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "actuation"),
    [((), "tension"), (("friction.mu=0",), "tension"), (("friction.mu=0",), "displacement")],
)
def test_longer_steps_lead_to_the_same_places(
    settings: tuple[str, ...], actuation: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Held rows end at rest, wherever the steps between them fell."""
    steps = []

    def noted(built: Any, *others: Any, **named: Any) -> Any:
        steps.append(built.dynamics.timestep_s)
        return simulate(built, *others, **named)

    simulate = verdict.simulate
    monkeypatch.setattr(verdict, "simulate", noted)
    specified = load_robot("neuroendoscope_section", settings)
    found = verdict.replay(specified, trial(actuation), COLUMNS, NO_GRAVITY)
    for name in ("SMOOTH_STRIDE", "SMOOTH_DRIVEN_STRIDE", "DRY_STRIDE"):
        monkeypatch.setattr(verdict, name, 1)
    own = verdict.replay(specified, trial(actuation), COLUMNS, NO_GRAVITY)
    assert steps[0] > steps[1] == specified.dynamics.timestep_s
    assert len(steps) == 2
    assert np.ptp(own.outputs[:, 0]) > 2.0
    np.testing.assert_allclose(found.outputs, own.outputs, rtol=0, atol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("trouble", ["failure", "restless"])
def test_a_run_that_does_not_rest_is_made_anew_in_the_robot_s_own_steps(
    trouble: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = []

    def spoiled(built: Any, *others: Any, **named: Any) -> Any:
        steps.append(built.dynamics.timestep_s)
        run = simulate(built, *others, **named)
        if len(steps) > 1:
            return run
        moving = np.zeros(len(run.at_rest), bool)
        return replace(run, failure="it fell") if trouble == "failure" else replace(run, at_rest=moving)

    simulate = verdict.simulate
    monkeypatch.setattr(verdict, "simulate", spoiled)
    robot = load_robot("neuroendoscope_section")
    found = verdict.replay(robot, trial("tension"), COLUMNS, NO_GRAVITY)
    assert steps[1] == robot.dynamics.timestep_s
    assert found.failure is None
    assert found.restless == 0
