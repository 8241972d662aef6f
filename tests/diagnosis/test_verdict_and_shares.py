"""The verdict's order, held-out figures in file units, and causes' shares against a fit done by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import as_inputs, small_robot

from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.next_experiment import _apart
from catheter_sim.diagnosis.problem import Problem, Term
from catheter_sim.diagnosis.pruning import named_causes
from catheter_sim.diagnosis.result import UnitResult
from catheter_sim.diagnosis.thresholds import NEAR_NOISE
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.diagnosis.verdict import ROUGH_NOISE, held_out, verdict_of
from catheter_sim.effects import EFFECTS
from catheter_sim.tables import Table

STRETCHES, ROWS = 16, 12
PULL = np.tile(np.sin(np.pi * np.arange(ROWS) / ROWS), STRETCHES)
SIDE = np.repeat(np.where(np.arange(STRETCHES) % 2, 1.0, -1.0), ROWS)
SHAPES = {"twist": PULL, "nonlinear_stiffness": 0.5 * PULL * SIDE + 0.2 * PULL**2}
UNITS = {"nonlinear_stiffness": "cubic_mm2", "twist": "rate_deg_per_m"}
TERMS = tuple(Term(name, (number,)) for name, number in UNITS.items())
WEIGHT_MM, NOISE_MM = 0.05, 0.1


def problem_of(sizes: dict[str, float], seed: int, residual: np.ndarray | None = None) -> Problem:
    """Return a trial of two causes that each add a shape of their own, of these sizes [mm].

    Args:
        sizes: by effect.
        seed: of the noise.
        residual: what is measured instead; the model says nothing of it.
    """
    robot = small_robot()
    one = {
        name: next(item.scale for item in EFFECTS[name].parameters(robot) if item.name == number)
        for name, number in UNITS.items()
    }

    def twin(robots, inputs, every):
        rows = [
            sum(
                item.effects.get(name, {}).get(UNITS[name], 0.0) / one[name] * shape
                for name, shape in SHAPES.items()
            )
            + 0.0 * PULL
            for item in robots
        ]
        return np.array(rows)[:, ::every, None]

    inputs = as_inputs(np.stack([PULL, 0 * PULL, 0 * PULL], axis=1), "displacement")
    noise = NOISE_MM * np.random.default_rng(seed).normal(size=len(PULL))
    values = (
        sum((size * SHAPES[name] for name, size in sizes.items()), noise) if residual is None else residual
    )
    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, {"tip_x_mm": values}, "made"))
    return Problem(robot, (), (trial,), ("tip_x_mm",), np.full(1, WEIGHT_MM), twin)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(
    "sizes", [{"twist": 1.0, "nonlinear_stiffness": 4.0}, {"twist": 3.0, "nonlinear_stiffness": 2.0}]
)
def test_shares_are_the_rises_of_the_error_without_each_cause(sizes):
    """Fitted by hand to the training rows with one shape left out, tried on the held-out rows: the rises
    stand to one another as the shares, which add up to the gain, the largest first."""
    train, test = problem_of(sizes, 1), problem_of(sizes, 2)
    after = fit(train, TERMS, cross_validate=False)
    result = held_out(train, test, fit(train, (), cross_validate=False), after, {"mm": NOISE_MM})["mm"]
    causes = named_causes(train, test, after, result, "mm")
    shown, asked = (item.trials[0].outputs.columns["tip_x_mm"] for item in (train, test))
    rises = {}
    for name in SHAPES:
        (other,) = (shape for key, shape in SHAPES.items() if key != name)
        rises[name] = rms(asked - (shown @ other) / (other @ other) * other) - result.rmse_after
    assert [cause.name for cause in causes] == sorted(rises, key=lambda name: -rises[name])
    for cause in causes:
        expected = result.gain_percent * rises[cause.name] / sum(rises.values())
        assert cause.gain_percent == pytest.approx(expected, rel=0.01)
    assert sum(cause.gain_percent for cause in causes) == pytest.approx(result.gain_percent)


def test_held_out_errors_are_in_millimetres():
    """Before: all that was put in and the noise; after: the noise; whatever a residual weighs."""
    sizes = {"twist": 3.0, "nonlinear_stiffness": 2.0}
    for weight in (0.02, 1.0):
        train, test = (replace(problem_of(sizes, seed), weight=np.full(1, weight)) for seed in (1, 2))
        before, after = fit(train, (), cross_validate=False), fit(train, TERMS, cross_validate=False)
        found = held_out(train, test, before, after, {"mm": NOISE_MM})["mm"]
        assert found.rmse_before == pytest.approx(rms(test.trials[0].outputs.columns["tip_x_mm"]), rel=1e-9)
        assert found.rmse_after == pytest.approx(NOISE_MM, rel=0.15)
        assert found.gain_percent == pytest.approx(100.0 * (1.0 - found.rmse_after / found.rmse_before))
        assert found.gain_percent_ci95[0] < found.gain_percent < found.gain_percent_ci95[1]
        assert found.chance < 0.01


NOTHING = Fit(
    (), (), np.zeros(0), np.zeros(1), np.zeros((1, 0)), np.zeros(0, bool), np.zeros(1, int), np.zeros(1)
)
ONE = replace(NOTHING, terms=TERMS[:1])
WHITE = np.random.default_rng(5).normal(size=len(PULL))
SURE = UnitResult("mm", 0.1, 5.0, 0.15, 97.0, (96.0, 98.0), 0.001)


def verdict(
    times_before: float,
    residual: np.ndarray,
    after: Fit = NOTHING,
    established: bool = True,
    harmful: bool = False,
    **more: float,
) -> str:
    """Return the verdict on an error so many times the noise before, which looks like `residual`."""
    result = replace(SURE, rmse_before=0.1 * times_before, **more)
    problem = problem_of({}, 0, residual)
    return verdict_of(problem, NOTHING, after, {"mm": result}, established, harmful)


@pytest.mark.parametrize(
    ("times", "residual", "expected"),
    [
        (0.9 * NEAR_NOISE, PULL, "no_discrepancy"),
        (1.1 * NEAR_NOISE, PULL, "unexplained"),
        (1.1 * NEAR_NOISE, WHITE, "no_discrepancy"),
        (0.9 * ROUGH_NOISE, PULL, "unexplained"),
        (0.9 * ROUGH_NOISE, WHITE, "no_discrepancy"),
        (1.1 * ROUGH_NOISE, WHITE, "unexplained"),
        (50.0, PULL, "unexplained"),
    ],
)
def test_no_discrepancy_is_an_error_near_the_noise(times, residual, expected):
    """Nearer where it has structure from row to row than where it has none; both bounds from both sides."""
    assert verdict(times, residual) == expected


def test_cause_is_found_only_by_a_sure_gain():
    """The same error and the same cause, the gain sure, by chance, or none; without a cause there is none."""
    assert verdict(50.0, PULL, ONE) == "cause_found"
    assert verdict(50.0, PULL, ONE, chance=0.3) == "unexplained"
    assert verdict(50.0, PULL, ONE, gain_percent=-1.0) == "unexplained"
    assert verdict(50.0, PULL) == "unexplained"
    assert verdict(1.2, PULL, ONE, chance=0.3) == "no_discrepancy"
    assert verdict(50.0, PULL, ONE, harmful=True) == "unexplained"


def test_a_model_is_improved_by_corrections_of_which_none_is_established():
    """The same sure gain: a cause is found only by an established one; harm and noise leave no correction."""
    assert verdict(50.0, PULL, ONE, established=False) == "improved"
    assert verdict(50.0, PULL, ONE, established=False, harmful=True) == "unexplained"
    assert verdict(50.0, PULL, ONE, established=False, chance=0.3) == "unexplained"
    assert verdict(0.9 * NEAR_NOISE, PULL, ONE, established=False) == "no_discrepancy"
    assert verdict(0.9 * NEAR_NOISE, PULL, ONE, established=True) == "cause_found"


def test_discrepancy_is_judged_before_the_correction():
    """A correction that leaves no error, but is no sure gain, does not make the data agree."""
    assert verdict(50.0, PULL, ONE, rmse_after=0.1, chance=0.3) == "unexplained"


def test_discrepancy_in_any_unit_is_one():
    """Degrees near the noise, millimetres far from it: unexplained, whichever is told first."""
    near, far = replace(SURE, unit="deg", rmse_before=0.12), replace(SURE, rmse_before=5.0)
    problem = problem_of({}, 0, PULL)
    for by_unit in ({"deg": near, "mm": far}, {"mm": far, "deg": near}):
        assert verdict_of(problem, NOTHING, NOTHING, by_unit, False) == "unexplained"
    by_unit = {"deg": near, "mm": replace(near, unit="mm")}
    assert verdict_of(problem, NOTHING, NOTHING, by_unit, False) == "no_discrepancy"


def test_an_error_that_hangs_on_something_is_none_of_noise():
    """Twice the noise, neighbouring rows uncorrelated since commands came in any order: still no noise."""
    problem, far = problem_of({}, 0, WHITE), {"mm": replace(SURE, rmse_before=0.2)}
    assert verdict_of(problem, NOTHING, NOTHING, far, False) == "no_discrepancy"
    assert verdict_of(problem, NOTHING, NOTHING, far, False, structured=True) == "unexplained"


def test_rivals_are_told_apart_by_a_root_mean_square():
    """Three millimetres off in half of the values, of a noise of one: 3 / sqrt(2); a missing one is none."""
    first, second = np.zeros((10, 2)), np.zeros((10, 2))
    second[:, 0] = 3.0
    assert _apart(first, second, np.ones(2)) == pytest.approx(3.0 / np.sqrt(2.0))
    assert _apart(first, second, np.array([0.5, 7.0])) == pytest.approx(6.0 / np.sqrt(2.0))
    second[0] = np.nan
    assert _apart(first, second, np.ones(2)) == pytest.approx(3.0 / np.sqrt(2.0))
