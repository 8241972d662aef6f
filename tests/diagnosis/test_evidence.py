"""Noise, held-out errors and the next experiment: figures that can be checked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from planted import displacement_history, pair_history, small_robot

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis.fit import GROSS_ERROR, fit, residuals, tempered, untempered
from catheter_sim.diagnosis.noise import (
    errors_of,
    gain_interval,
    gain_percent,
    is_white,
    noise_floor,
    repeat_noise,
    rmse_by_unit,
    stretch_squares,
    tip_errors,
    white_noise,
)
from catheter_sim.diagnosis.problem import Problem, Term, fitted_numbers
from catheter_sim.diagnosis.trials import TIP, Trial
from catheter_sim.tables import Table


def trial(columns, inputs, file="a.csv") -> Trial:
    """Return a trial with the given outputs."""
    return Trial(file, "heldout", inputs, Table(inputs.time_s, columns, file))


def test_noise_from_repeats_and_from_residuals():
    """White noise of 0.2 is found again, from a repeat and on top of a slow residual."""
    generator = np.random.default_rng(4)
    inputs = pair_history(1, cycles=12)
    rows = len(inputs)
    slow = 3.0 * np.sin(np.arange(rows) / 40.0)
    noisy = [slow + 0.2 * generator.normal(size=rows) for _ in range(2)]
    trials = [trial({"tip_x_mm": values}, inputs, f"{k}.csv") for k, values in enumerate(noisy)]
    assert repeat_noise(trials, ("tip_x_mm",))["mm"] == pytest.approx(0.2, rel=0.15)
    assert white_noise({"tip_x_mm": noisy})["mm"] == pytest.approx(0.2, rel=0.15)
    assert noise_floor({"mm": 0.3, "deg": 0.1}, {"mm": 0.2}) == {"mm": 0.2, "deg": 0.1}
    other = trial({"tip_x_mm": noisy[0]}, pair_history(2, cycles=12))
    assert repeat_noise([trials[0], other], ("tip_x_mm",)) == {}


def test_structure_is_told_from_white_noise():
    """Noise passes for white, a slow wave does not, gaps do not matter."""
    generator = np.random.default_rng(5)
    noise = generator.normal(size=400)
    noise[::50] = np.nan
    assert is_white([noise])
    assert not is_white([noise + 3.0 * np.sin(np.arange(400) / 20.0)])


def heldout_problem(columns) -> Problem:
    """Return a problem of one held-out trial whose measurements are all there."""
    inputs = displacement_history(2, cycles=20)
    one = trial({name: np.zeros(len(inputs)) for name in columns}, inputs)
    return Problem(small_robot(), (), (one,), tuple(columns), np.ones(len(columns)), lambda *_: np.zeros(0))


def test_rmse_is_over_all_outputs_of_one_unit():
    """Millimetres and degrees are kept apart; within a unit every output counts alike."""
    problem = heldout_problem(("tip_x_mm", "tip_z_mm", "joint_x1_deg"))
    rows = len(problem.trials[0].inputs)
    errors = np.tile([3.0, 4.0, 7.0], rows)
    assert rmse_by_unit(problem, errors) == {"mm": pytest.approx(np.sqrt(12.5)), "deg": pytest.approx(7.0)}


def test_gain_interval_is_around_the_gain_and_honest_about_few_cycles():
    """A gain that is the same in every cycle has a narrow interval, one that comes and goes a wide one."""
    problem = heldout_problem(("tip_x_mm",))
    rows = len(problem.trials[0].inputs)
    generator = np.random.default_rng(8)
    before = generator.normal(size=rows)
    low, high = gain_interval(stretch_squares(problem, before, 0.5 * before, "mm"))
    assert low == pytest.approx(50.0)
    assert high == pytest.approx(50.0)
    patchy = np.where(np.arange(rows) < rows // 2, 0.1, 1.0) * before
    low, high = gain_interval(stretch_squares(problem, before, patchy, "mm"))
    assert low < gain_percent(*(float(np.sqrt(np.mean(e**2))) for e in (before, patchy))) < high
    assert high - low > 10.0
    assert gain_percent(0.0, 0.0) == 0.0


def test_gain_interval_knows_that_trials_differ():
    """Gains alike in all cycles of a trial, but not from trial to trial: other trials' gains lie inside."""
    generator = np.random.default_rng(9)

    def trial():
        before = generator.uniform(0.5, 1.5, size=6) ** 2
        return np.stack([before, before * generator.uniform(0.02, 0.2)], axis=1)

    inside = 0
    for _ in range(20):
        held, others = [trial(), trial()], [trial() for _ in range(6)]
        low, high = gain_interval(held, others)
        third = np.concatenate([trial(), trial()]).sum(axis=0)
        inside += low <= 100.0 * (1.0 - np.sqrt(third[1] / third[0])) <= high
    assert inside >= 18


def test_gain_interval_knows_that_small_trials_say_little():
    """Few trials with large errors before, others with small ones, noise after: 95 % of other sets."""
    generator = np.random.default_rng(4)

    def trials(count):
        large = [index == 0 or generator.random() < 0.6 for index in range(count)]
        before = [generator.lognormal(3.0 if rich else 1.5, 0.6) for rich in large]
        after = [generator.chisquare(300) / 300 for _ in large]
        return [np.array([[b + a, a]]) for b, a in zip(before, after, strict=True)]

    inside = 0
    for _ in range(400):
        low, high = gain_interval(trials(2), trials(5))
        third = np.concatenate(trials(3)).sum(axis=0)
        inside += low <= 100.0 * (1.0 - np.sqrt(third[1] / third[0])) <= high
    assert 0.94 * 400 <= inside < 400


def test_one_cycle_says_nothing_of_the_gain():
    """Nothing to compare with: undefined, not narrow."""
    assert np.isnan(gain_interval([np.array([[1.0, 0.5]])])).all()


def test_alignment_takes_out_a_shift_and_nothing_else():
    """Tip errors: 3-4-12 gives 13 mm as it is, zero aligned; a zero-mean error is left as it is."""
    rows = np.zeros(40)
    shifted = {name: [(rows + step, rows)] for name, step in zip(TIP, (3.0, 4.0, 12.0), strict=True)}
    figures = tip_errors(shifted)
    assert figures["tip_distance_rmse_{}_mm"] == pytest.approx(13.0)
    assert figures["tip_distance_rmse_aligned_{}_mm"] == pytest.approx(0.0, abs=1e-12)
    swing = np.tile([1.0, -1.0], 20)
    swinging = {name: [(swing if name == "tip_x_mm" else rows, rows)] for name in TIP}
    assert tip_errors(swinging)["tip_distance_rmse_aligned_{}_mm"] == pytest.approx(1.0)


def gross_problem(error: float) -> Problem:
    """Return a problem whose measurements are a scale of 1.2 times the pull, all off by `error`."""
    inputs = pair_history(1)
    pull = inputs.tendon[:, :1]

    def twin(robots, commanded, every):
        scales = [robot.effects.get("actuation_gain", {}).get("scale", 1.0) for robot in robots]
        return np.array([1e3 * scale * commanded.tendon[::every, :1] for scale in scales])

    measured = {"tip_x_mm": 1.2e3 * pull[:, 0] + error}
    robot = load_robot("neuroendoscope_section")
    return Problem(robot, (), (trial(measured, inputs),), ("tip_x_mm",), np.array([0.1]), twin)


def test_an_error_is_reported_as_large_as_it_is():
    """Off by 1073 mm in all rows, with a weight of 0.1 mm, the error is that, and not a thousand weights."""
    problem = gross_problem(1073.0)
    null = fit(problem, (), cross_validate=False)
    pull = problem.trials[0].inputs.tendon[:, 0]
    expected = np.sqrt(np.mean((1073.0 + 0.2e3 * pull) ** 2))
    assert rmse_by_unit(problem, errors_of(problem, null))["mm"] == pytest.approx(expected, rel=1e-9)


def test_gross_errors_are_tempered_like_hubers_loss():
    """Squares below the limit, lines of the same slope above it, and back again."""
    error = np.array([-5e4, -GROSS_ERROR, -3.0, 0.0, GROSS_ERROR, 1.5 * GROSS_ERROR, 1e7])
    assert untempered(tempered(error)) == pytest.approx(error, rel=1e-12)
    inside = np.abs(error) <= GROSS_ERROR
    assert (tempered(error)[inside] == error[inside]).all()
    loss = lambda size: float(tempered(np.array([size]))[0] ** 2)  # noqa: E731
    assert loss(3.0 * GROSS_ERROR) - loss(2.0 * GROSS_ERROR) == pytest.approx(2.0 * GROSS_ERROR**2, rel=1e-12)
    assert loss(GROSS_ERROR * (1.0 + 1e-6)) - loss(GROSS_ERROR) == pytest.approx(
        2e-6 * GROSS_ERROR**2, rel=1e-4
    )


def test_a_fit_finds_its_way_through_gross_errors():
    """Every row is beyond the limit from the start; there is a slope all the same, and the scale is found."""
    problem = gross_problem(0.0)
    sharp = Problem(problem.robot, (), problem.trials, problem.columns, np.array([1e-3]), problem.twin)
    term = Term("actuation_gain", ("scale",))
    start = residuals(
        sharp,
        fitted_numbers(sharp, (term,)),
        np.array([[0.7 / fitted_numbers(sharp, (term,))[0].parameter.scale]]),
    )
    assert np.median(np.abs(untempered(start))) > 10.0 * GROSS_ERROR
    found = fit(sharp, (term,), {("actuation_gain", "scale"): 0.7}, cross_validate=False)
    assert found.values["actuation_gain", "scale"] == pytest.approx(1.2, abs=1e-4)
