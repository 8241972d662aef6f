"""The twin of robots in motion: many robots and trials, each as the simulation alone would have it."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.simulation import moving_twin
from catheter_sim.simulation.moving_twin import MovingTwin
from catheter_sim.simulation.replay import simulate
from tests.simulation.moving import HANGING, pulled, swinging

TIP = (4,)


def tips(robot: ContinuumRobot, seed: int, seconds: float = 0.5) -> Array:
    run = simulate(robot, pulled(seed, seconds), HANGING, dynamic=True)
    return np.array([posture.p_w[-1] for posture in run.postures])


@pytest.mark.slow
def test_several_trials_of_several_robots_are_each_what_the_simulation_alone_gives() -> None:
    """One model is built for all trials of a robot: nothing of a trial may be left in the next one."""
    robots = [swinging(), swinging(mu=0.0, damping_time_s=0.03)]
    trials = [pulled(0), pulled(1, 0.3)]
    found = MovingTwin().solve_trials([(robots, [trial] * 2) for trial in trials], HANGING, TIP, 1)
    for trial, (seed, seconds) in enumerate(((0, 0.5), (1, 0.3))):
        for which, robot in enumerate(robots):
            assert np.allclose(
                found[trial].p_w[which, :, 0], tips(robot, seed, seconds), rtol=0.0, atol=1e-12
            )
    assert np.abs(found[0].p_w[0] - found[0].p_w[1]).max() > 1e-3


def test_rows_left_out_are_simulated_all_the_same() -> None:
    every = MovingTwin().solve([swinging()], [pulled()], HANGING, TIP, 7)
    all_rows = MovingTwin().solve([swinging()], [pulled()], HANGING, TIP, 1)
    assert every.p_w.shape[1] == 8
    assert np.array_equal(every.p_w, all_rows.p_w[:, ::7])


@pytest.mark.slow
def test_a_longer_step_changes_little_and_the_less_the_shorter_it_is() -> None:
    fine = MovingTwin(2.5e-4).solve([swinging()], [pulled()], HANGING, TIP, 1).p_w
    apart = [
        float(np.abs(MovingTwin(step_s, 2).solve([swinging()], [pulled()], HANGING, TIP, 1).p_w - fine).max())
        for step_s in (1e-3, 2e-3)
    ]
    assert 0.0 < apart[0] < apart[1] < 5e-4


def test_numbers_of_no_robot_are_nan_and_no_error() -> None:
    impossible = replace(swinging(), friction=Friction(-1.0))
    states = MovingTwin().solve([impossible, swinging()], [pulled()] * 2, HANGING, TIP, 5)
    finite = np.isfinite(states.p_w).all(axis=(1, 2, 3))
    assert finite[1]


def test_a_robot_that_diverges_is_nan_from_there_on() -> None:
    wild = swinging(damping_time_s=0.0)
    wild = replace(wild, dynamics=replace(wild.dynamics, timestep_s=0.05, motion_timestep_s=0.05))
    pulls = pulled()
    strong = replace(pulls, tendon=1e4 * pulls.tendon)
    states = MovingTwin().solve([wild], [strong], HANGING, TIP, 1)
    assert np.isnan(states.p_w[0, -1]).all()


def test_what_is_remembered_is_read_and_written_by_one_thread_at_a_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every look into the memory, and every change of it, holds the lock; a second look finds the runs."""

    class Watched(OrderedDict):
        def __getitem__(self, name: str) -> object:
            assert moving_twin._runs_lock.locked()
            return super().__getitem__(name)

        def __setitem__(self, name: str, run: object) -> None:
            assert moving_twin._runs_lock.locked()
            super().__setitem__(name, run)

        def __contains__(self, name: object) -> bool:
            assert moving_twin._runs_lock.locked()
            return super().__contains__(name)

    moved = []

    def followed(robot: object, trials: list, *_: object) -> list:
        moved.append(robot)
        return [(np.zeros((1, 1, 3)), np.zeros((1, 1, 3, 3)), np.zeros((1, 1)), np.zeros((1, 2)))] * len(
            trials
        )

    monkeypatch.setattr(moving_twin, "_runs", Watched())
    monkeypatch.setattr(moving_twin, "_moved", followed)
    robot = load_robot("neuroendoscope_section")
    still = Inputs(np.zeros(1), "tension", np.zeros((1, 2)), np.zeros((1, 3)), np.zeros((1, 3)))
    for _ in range(2):
        moving_twin.MovingTwin().solve([robot], [still], np.zeros(3), [29], 1)
    assert len(moved) == 1
