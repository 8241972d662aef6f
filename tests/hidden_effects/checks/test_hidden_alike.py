"""Which explanations can be told apart at all: by the distance of the nearest rival from the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.nuisance import nuisances_of
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.effects.apply import with_effects
from catheter_sim.tables import Table
from catheter_sim.theory.twins import twin_for
from hidden_effects.first_draws import TOLD_APART, distance

pytestmark = pytest.mark.slow
COLUMNS = ("tip_x_mm", "tip_z_mm")


def problem_of(tensions_N) -> Problem:
    """Return a problem of the chest-tube section with one trial; its outputs do not matter."""
    tension = np.array(tensions_N, dtype=float)[:, np.newaxis]
    zeros = np.zeros((len(tension), 3))
    inputs = Inputs(np.arange(len(tension), dtype=float), "tension", tension, zeros, zeros)
    robot = load_robot("chest_tube_section")
    table = Table(inputs.time_s, {name: np.zeros(len(tension)) for name in COLUMNS})
    return Problem(
        robot=robot,
        nuisances=nuisances_of("chest_tube_section"),
        trials=(Trial("trial.csv", "train", inputs, table),),
        columns=COLUMNS,
        weight=np.ones(2),
        twin=twin_for(robot, "tension", COLUMNS, np.zeros(3)),
    )


LOOP = np.r_[np.linspace(0, 30, 7), np.linspace(25, 5, 5), np.linspace(10, 25, 4), np.linspace(20, 0, 5)]


@pytest.mark.parametrize(
    ("hidden", "rival", "alike"),
    [
        ({"stiffness": {"scale": 0.8}}, "stiffness", True),
        ({"stiffness": {"scale": 0.8}}, "actuation_gain", True),
        ({"stiffness": {"scale": 0.8}}, "backlash", False),
        ({"backlash": {"width_N": 2.0}}, "stiffness", False),
    ],
)
def test_gain_can_stand_for_stiffness_and_backlash_cannot(hidden, rival, alike):
    """Without weight tension over stiffness is all that counts; a dead-band is something else."""
    problem = problem_of(LOOP)
    true = with_effects(problem.robot, hidden)
    apart, per_value = distance(problem, problem.trials, true, {"mm": 0.2}, (rival,), {})
    assert (apart < TOLD_APART) is alike
    assert per_value == pytest.approx(apart / np.sqrt(2 * len(LOOP)))


def test_less_noise_tells_more_apart():
    """The distance is in units of the noise: half of it, twice the distance."""
    problem = problem_of(LOOP)
    true = with_effects(problem.robot, {"backlash": {"width_N": 2.0}})
    # No nuisance numbers: their own spread, which does not scale with the noise, would enter the fit.
    bare = replace(problem, nuisances=())
    far, near = (
        distance(bare, bare.trials, true, {"mm": noise}, ("actuation_offset",), {})[0] for noise in (0.1, 0.2)
    )
    assert far == pytest.approx(2.0 * near, rel=0.05)
