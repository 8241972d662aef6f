"""What is known of a number beforehand weighs against the data as a normal prior does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import as_inputs, small_robot
from scipy.stats import uniform

from catheter_sim.core.effect import Parameter
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.nuisance import Nuisance, nuisances_of
from catheter_sim.diagnosis.problem import FittedNumber, Problem, prior_of
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

ROWS = 32


def problem_of(spread: float, scale: float, truth: float, noise: float) -> Problem:
    """Return the fit of the robot's stiffness scale, 1 beforehand, to a column that shows it as it is."""
    robot = small_robot()
    parameter = Parameter("stiffness", null=1.0, lower=-9.0, upper=9.0, scale=scale, start=1.0)
    number = Nuisance(parameter, lambda robot, value: replace(robot, stiffness_scale=value), spread)

    def twin(robots, inputs, every):
        values = np.array([item.stiffness_scale for item in robots])
        return np.broadcast_to(values[:, None, None], (len(robots), len(inputs), 1))[:, ::every]

    inputs = as_inputs(np.zeros((ROWS, 3)), "displacement")
    swing = noise * np.where(np.arange(ROWS) % 2, 1.0, -1.0)
    table = Table(inputs.time_s, {"tip_x_mm": truth + swing}, "made")
    trial = Trial("a.csv", "train", inputs, table)
    return Problem(robot, (number,), (trial,), ("tip_x_mm",), np.full(1, noise), twin)


@pytest.mark.parametrize("scale", [0.02, 0.1, 0.5])
@pytest.mark.parametrize("spread", [0.05, 0.2])
def test_known_number_ends_between_what_is_known_and_what_is_measured(spread, scale):
    """By the precisions 1 / spread^2 and n / noise^2, whatever the unit in which it is fitted."""
    truth, noise = 1.8, 0.6
    known, measured = 1.0 / spread**2, ROWS / noise**2
    expected = (known * 1.0 + measured * truth) / (known + measured)
    found = fit(problem_of(spread, scale, truth, noise), (), cross_validate=False, thorough=True)
    assert found.values["", "stiffness"] == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("scale", [0.02, 0.5])
def test_leaving_what_is_known_by_one_spread_costs_one(scale):
    """As leaving a measurement by its noise does; a number of which nothing is known costs nothing."""
    parameter = Parameter("a", null=3.0, lower=0.0, upper=9.0, scale=scale, start=3.0)
    prior = prior_of([FittedNumber("", parameter, 0.25), FittedNumber("", parameter)])
    for steps, cost in ((0.0, 0.0), (1.0, 1.0), (-2.0, 4.0)):
        x = np.array([3.0 + 0.25 * steps, 7.0]) / scale
        assert prior.cost(x) == pytest.approx(cost, abs=1e-9)


@pytest.mark.parametrize("reference", ["neuroendoscope_section", "chest_tube", "mitral_transseptal"])
def test_specimens_are_spread_evenly_over_their_ranges(reference):
    """The standard deviation known beforehand is that of a uniform distribution over the range."""
    numbers = nuisances_of(reference)
    assert numbers
    for number in numbers:
        low, high = number.parameter.lower, number.parameter.upper
        assert number.spread == pytest.approx(uniform(low, high - low).std(), rel=1e-12)
        assert math.isclose(0.5 * (low + high), number.parameter.null)


def test_fit_comes_off_the_upper_bound_that_it_starts_at():
    """There the derivative is taken backward; a number that belongs inside ends inside."""
    problem = problem_of(math.inf, 0.5, 1.8, 0.6)
    (number,) = problem.nuisances
    problem = replace(
        problem, nuisances=(replace(number, parameter=replace(number.parameter, upper=2.0, start=2.0)),)
    )
    for thorough in (False, True):
        found = fit(problem, (), cross_validate=False, thorough=thorough)
        assert found.values["", "stiffness"] == pytest.approx(1.8, abs=1e-3)
