"""The fit: exact where it is linear, honest intervals, honest errors on what is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import as_inputs, displacement_history, pair_history, small_robot
from scipy.optimize import least_squares

from catheter_sim.catalogue import load_robot
from catheter_sim.core.effect import Parameter
from catheter_sim.diagnosis.comparison import as_good, pays
from catheter_sim.diagnosis.fit import Fit, FitTask, best_of_grid, blocks_of, fit, fold_of, residuals
from catheter_sim.diagnosis.fitted_sets import Search
from catheter_sim.diagnosis.intervals import intervals
from catheter_sim.diagnosis.nuisance import Nuisance, nuisances_of
from catheter_sim.diagnosis.problem import Problem, Term, box_of, fitted_numbers, prior_of, start_of
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.diagnosis.workers import (
    SERIAL,
    carried_over,
    foreseen,
    misled,
    reached,
    shortlist,
    tangent,
    values_at,
    without,
)
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import with_effects
from catheter_sim.tables import Table
from catheter_sim.theory.twins import twin_for

COLUMNS = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
FRAME = Term("measurement_frame", ("translation_x_mm", "rotation_y_deg"))


def made(effects, noise_mm=0.0, seed=1, robot=None, inputs=None, columns=COLUMNS, reference="small.toml"):
    """Return a problem whose measurements are the twin's own with `effects`, and white noise."""
    robot = robot or small_robot()
    inputs = inputs or displacement_history(3)
    twin = twin_for(robot, inputs.actuation, columns, np.zeros(3))
    values = twin([with_effects(robot, effects)], inputs, 1)[0]
    values = values + noise_mm * np.random.default_rng(seed).normal(size=values.shape)
    table = Table(inputs.time_s, {name: values[:, index] for index, name in enumerate(columns)}, "made")
    weight = np.full(len(columns), max(noise_mm, 0.01))
    trial = Trial("made.csv", "train", inputs, table)
    return Problem(robot, nuisances_of(reference), (trial,), tuple(columns), weight, twin)


@pytest.mark.parametrize(
    ("term", "effects"),
    [
        (Term("backlash", ("width_mm",)), {"backlash": {"width_mm": 0.37}}),
        (
            Term("axial_compression", ("stiffness_N_per_mm",)),
            {"axial_compression": {"stiffness_N_per_mm": 20.0}},
        ),
        (Term("stiffness", ("scale",)), {"stiffness": {"scale": 0.7}}),
        (Term("actuation_offset", ("offset_t1_mm",)), {"actuation_offset": {"offset_t1_mm": -0.4}}),
        (FRAME, {"measurement_frame": {"translation_x_mm": 3.0, "rotation_y_deg": -5.0}}),
    ],
)
def test_recovers_what_was_put_in(term, effects):
    """From noiseless data of its own twin a fit returns the numbers that made them."""
    found = fit(made(effects), (term,), cross_validate=False).values
    for name, value in effects[term.effect].items():
        assert found[term.effect, name] == pytest.approx(value, rel=2e-3)


def test_the_optimum_is_another_solvers():
    """With noise and three causes that bend the model, SciPy's trust region ends where the fit does."""
    effects = {"stiffness": {"scale": 0.7}, "backlash": {"width_mm": 0.4}, "twist": {"rate_deg_per_m": 60.0}}
    problem = made(effects, noise_mm=0.2)
    terms = tuple(Term(name, tuple(values)) for name, values in effects.items())
    found = fit(problem, terms, cross_validate=False)
    low, high = box_of(found.numbers)
    other = least_squares(
        lambda x: residuals(problem, found.numbers, x[None])[0],
        np.clip(found.x * 1.2, low + 1e-3, high - 1e-3),
        bounds=(low, high),
        diff_step=1e-4,
        xtol=1e-8,
        ftol=1e-10,
    )
    assert float(found.residual @ found.residual) == pytest.approx(2.0 * other.cost, rel=2e-4)
    error = 1.0 / np.sqrt((found.jacobian**2).sum(axis=0))
    assert np.abs(found.x - other.x).max() < 0.3 * error.max()


def test_an_effect_that_is_not_there_stays_at_null():
    """Compression fitted to data without it becomes an infinite stiffness, held at its bound."""
    term = Term("axial_compression", ("stiffness_N_per_mm",))
    found = fit(made({"stiffness": {"scale": 1.0}}), (term,), cross_validate=False)
    assert 1.0 / found.values["axial_compression", "stiffness_N_per_mm"] < 1e-6


def test_between_nuisance_and_cause_that_do_the_same_the_cause_moves():
    """A wrong gain is not spread over elastic constant and moment arm, which could each hide a part."""
    section = load_robot("neuroendoscope_section")
    problem = made(
        {"actuation_gain": {"scale": 1.1}},
        noise_mm=0.05,
        robot=section,
        inputs=pair_history(2, cycles=2),
        columns=("tip_x_mm", "tip_z_mm"),
        reference="neuroendoscope_section",
    )
    found = fit(problem, (Term("actuation_gain", ("scale",)),), cross_validate=False)
    assert found.values["actuation_gain", "scale"] == pytest.approx(1.1, abs=0.015)
    calibrated = fit(problem, (), cross_validate=False)
    assert calibrated.values["", "elastic_constant"] == pytest.approx(0.97)
    assert calibrated.held.any()


def test_what_has_no_influence_is_left_alone():
    """A rotation about the axis along which nothing is measured keeps its start, with an open interval."""
    section = load_robot("neuroendoscope_section")
    problem = made(
        {"measurement_frame": {"translation_x_mm": 2.0}},
        noise_mm=0.05,
        robot=section,
        inputs=pair_history(2, cycles=2),
        columns=("tip_x_mm", "tip_z_mm"),
    )
    term = Term("measurement_frame", ("translation_x_mm", "translation_y_mm", "rotation_x_deg"))
    found = fit(problem, (term,), cross_validate=False)
    assert found.values["measurement_frame", "translation_x_mm"] == pytest.approx(2.0, abs=0.05)
    assert found.values["measurement_frame", "translation_y_mm"] == 0.0
    assert found.values["measurement_frame", "rotation_x_deg"] == 0.0
    assert intervals(found)["measurement_frame", "translation_y_mm"] == (-50.0, 50.0)


def test_left_out_stretches_are_predicted_as_by_fits_without_them():
    """The one-step errors on left-out folds are those of fits that never saw the fold."""
    terms = (Term("stiffness", ("scale",)), FRAME)
    problem = made({"stiffness": {"scale": 0.8}, "actuation_offset": {"offset_mm": 0.1}}, noise_mm=0.3)
    found = fit(problem, terms)
    fold = fold_of(found.block)
    trial = problem.trials[0]
    for index in np.unique(fold)[::3]:
        rows = (fold == index).reshape(-1, len(COLUMNS))[:, 0]
        hidden = {name: np.where(rows, np.nan, values) for name, values in trial.outputs.columns.items()}
        without = replace(problem, trials=(replace(trial, outputs=replace(trial.outputs, columns=hidden)),))
        exact = fit(without, terms, found.values, cross_validate=False)
        error = residuals(problem, exact.numbers, exact.x[None])[0]
        gap = error[fold == index] - found.left_out[fold == index]
        assert np.sqrt(np.mean(gap**2)) < 0.02 * np.sqrt(np.mean(error[fold == index] ** 2))


def saturating():
    """Return a problem and a term: a stretch says 0.998 of a curve that levels off at 1, all others 0.9."""
    robot, term = small_robot(), Term("twist", ("rate_deg_per_m",))
    ((parameter,),) = [EFFECTS["twist"].parameters(robot)]
    inputs = displacement_history(1, cycles=8)
    rows = np.arange(len(inputs))

    def levels_off(robots, inputs, every):
        rates = np.array([item.effects["twist"]["rate_deg_per_m"] for item in robots]) / parameter.scale
        values = np.tanh(3.0 * rates)[:, np.newaxis, np.newaxis]
        return np.broadcast_to(values, (len(robots), len(inputs), 2))[:, ::every]

    first = rows < len(rows) // 8
    seen = {"tip_x_mm": np.where(first, 0.998, np.nan), "tip_y_mm": np.where(first, np.nan, 0.9)}
    trial = Trial("made.csv", "train", inputs, Table(inputs.time_s, seen, "made"))
    return Problem(robot, (), (trial,), tuple(seen), np.array([1e-4, 0.01]), levels_off), term


def test_stretch_that_alone_holds_a_fit_is_predicted_by_a_fit_without_it():
    """Where the model saturates, one step from the fit to everything leads nowhere: the others are fitted.

    Without the first stretch they find 0.9, and miss it by a thousand of its weights.
    """
    problem, term = saturating()
    found = fit(problem, (term,))
    alone = fold_of(found.block) == 0
    assert np.abs(found.residual[alone]).max() < 5.0
    assert found.left_out[alone] == pytest.approx(-980.0, rel=0.02)


def test_only_what_errs_beyond_its_worth_is_rough():
    """The same fit, a little above what matters and a little below: there the stretch is not fitted anew."""
    problem, term = saturating()
    whole = fit(problem, (term,))
    well, rough = (fit(problem, (term,), worth=factor * whole.fitted_rms) for factor in (1.01, 0.99))
    assert (whole.rough, well.rough, rough.rough) == (False, False, True)
    assert (well.left_out == whole.left_out).all()
    assert (rough.x == whole.x).all()
    assert rough.fitted_rms <= rough.cross_validated_rms < whole.cross_validated_rms


def test_a_search_fits_again_what_was_rough():
    """A set that errs too much beside another is cross-validated well once it competes with a worse one."""
    problem, term = saturating()
    search = Search(SERIAL, problem, lambda line: None)
    whole = fit(problem, (term,), scan=True)
    near, far = (
        replace(whole, left_out=np.full_like(whole.left_out, size * whole.fitted_rms)) for size in (0.5, 2.0)
    )
    for beside, rough in ((near, True), (near, True), (far, False), (near, False)):
        (found,) = search.fitted([((term,), {})], beside)
        assert found.rough is rough
    assert (found.left_out == whole.left_out).all()


def test_scan_finds_the_least_of_several_minima():
    """A pulse that comes late: near the start no shift of the model's pulse meets it."""
    robot, term = small_robot(), Term("twist", ("rate_deg_per_m",))
    (parameter,) = EFFECTS["twist"].parameters(robot)
    inputs = displacement_history(1, cycles=8)
    place = np.linspace(-1.0, 1.0, len(inputs))

    def pulse(robots, inputs, every):
        late = np.array([item.effects["twist"]["rate_deg_per_m"] for item in robots]) / parameter.upper
        return np.exp(-(((place - late[:, np.newaxis]) / 0.08) ** 2))[:, ::every, np.newaxis]

    late = replace(robot, effects={"twist": {"rate_deg_per_m": 0.7 * parameter.upper}})
    seen = {"tip_x_mm": pulse([late], inputs, 1)[0, :, 0]}
    trial = Trial("made.csv", "train", inputs, Table(inputs.time_s, seen, "made"))
    problem = Problem(robot, (), (trial,), tuple(seen), np.array([0.01]), pulse)
    near = fit(problem, (term,))
    assert near.cross_validated_rms > 10.0
    found = fit(problem, (term,), scan=True)
    assert found.cross_validated_rms < 1e-3
    assert found.values["twist", "rate_deg_per_m"] == pytest.approx(0.7 * parameter.upper, rel=1e-4)


@pytest.mark.slow
def test_intervals_cover_where_rows_of_a_block_hang_together():
    """With errors common to whole cycles the 95 % interval covers the truth in at least 85 of 100 draws.

    An interval that took each row for independent would cover it in about 40.
    """
    robot = small_robot()
    inputs = displacement_history(4, cycles=18)

    def twin(robots, inputs, every):
        shift = [robot.effects["measurement_frame"]["translation_x_mm"] for robot in robots]
        return np.broadcast_to(np.array(shift)[:, None, None], (len(robots), len(inputs.time_s[::every]), 1))

    generator = np.random.default_rng(11)
    covered = 0
    for _ in range(100):
        table = Table(inputs.time_s, {"tip_x_mm": np.zeros(len(inputs))}, "made")
        problem = Problem(
            robot, (), (Trial("a.csv", "train", inputs, table),), ("tip_x_mm",), np.ones(1), twin
        )
        block = blocks_of(problem)
        common = generator.normal(size=block.max() + 1)[block]
        values = 1.5 + common + 0.3 * generator.normal(size=len(block))
        table = replace(table, columns={"tip_x_mm": values})
        problem = replace(problem, trials=(Trial("a.csv", "train", inputs, table),))
        found = fit(problem, (Term("measurement_frame", ("translation_x_mm",)),), cross_validate=False)
        low, high = intervals(found)["measurement_frame", "translation_x_mm"]
        covered += low <= 1.5 <= high
    assert covered >= 85


def test_blocks_are_whole_cycles_and_folds_whole_blocks():
    """Blocks follow one another without gaps, and a fold is one stretch of blocks."""
    problem = made({}, inputs=displacement_history(4, cycles=20))
    block = blocks_of(problem)
    assert len(block) == 3 * len(problem.trials[0].inputs)
    assert (np.diff(block) >= 0).all()
    assert len(np.unique(block)) >= 16
    fold = fold_of(block)
    assert (np.diff(fold) >= 0).all()
    assert set(np.unique(fold)) == set(range(8))
    for label in np.unique(block):
        assert len(np.unique(fold[block == label])) == 1


def test_missing_values_are_left_out():
    """An empty cell counts neither as zero nor as an error."""
    problem = made({"measurement_frame": {"translation_x_mm": 3.0, "rotation_y_deg": 0.0}})
    trial = problem.trials[0]
    columns = dict(trial.outputs.columns)
    columns["tip_x_mm"] = columns["tip_x_mm"].copy()
    columns["tip_x_mm"][::7] = np.nan
    holed = replace(problem, trials=(replace(trial, outputs=replace(trial.outputs, columns=columns)),))
    found = fit(holed, (FRAME,), cross_validate=False)
    assert len(found.residual) == 3 * len(trial.inputs) - np.isnan(columns["tip_x_mm"]).sum()
    assert found.values["measurement_frame", "translation_x_mm"] == pytest.approx(3.0, rel=1e-3)


def test_what_a_cause_supersedes_comes_back_without_it():
    """A shift known to be uncertain is fitted with every cause but a frame, also where one replaces it."""
    offset = Term("actuation_offset", ("offset_t1_mm",))
    shift = Nuisance(
        Parameter("shift_mm", 0.0, -50.0, 50.0, scale=1.0, start=0.0),
        lambda robot, value: robot,
        superseded_by=(FRAME.effect,),
        change_outputs=lambda columns, outputs, values: outputs + values[:, None, None] * np.eye(3)[0],
    )
    effects = {"actuation_offset": {"offset_t1_mm": 0.02}, "measurement_frame": {"translation_x_mm": 3.0}}
    problem = replace(made(effects, noise_mm=0.05), nuisances=(shift,))
    frame = fit(problem, (FRAME,), cross_validate=False)
    taken = without(problem, frame, FRAME)
    assert taken.keys == (("", "shift_mm"),)
    ahead = foreseen(problem, frame, (offset,), [taken, tangent(problem, frame, offset)])
    cost, values = reached(problem, frame, (offset,), ahead.points)
    assert ahead.cost == pytest.approx(cost, rel=0.05)
    assert values["", "shift_mm"] == pytest.approx(3.0, abs=0.1)
    assert cost < 1.1 * float((fit(problem, (offset,), cross_validate=False).residual ** 2).sum())


def test_a_probe_foretells_the_fit():
    """One step beside the current fit already ranks the true cause before a wrong one."""
    problem = made({"axial_compression": {"stiffness_N_per_mm": 15.0}}, noise_mm=0.05)
    current = fit(problem, (FRAME,))
    right, wrong = Term("axial_compression", ("stiffness_N_per_mm",)), Term("twist", ("rate_deg_per_m",))
    steps = {
        term: foreseen(problem, current, (FRAME, term), [tangent(problem, current, term)])
        for term in (right, wrong)
    }
    assert steps[right].cost < 0.3 * steps[wrong].cost
    true, false = (reached(problem, current, (FRAME, term), steps[term].points)[0] for term in (right, wrong))
    assert true < 0.2 * false
    assert set(values_at(problem, (FRAME, right), steps[right].points[0])) == {
        free.key for free in fitted_numbers(problem, (FRAME, right))
    }


def test_a_step_too_far_is_taken_halfway_back():
    """A width whose step made things worse is tried nearer to none, so that it is not passed over."""
    problem = made({"backlash": {"width_mm": 0.2}}, noise_mm=0.05)
    null, play = fit(problem, ()), Term("backlash", ("width_mm",))
    too_far = np.array([[4.0], [6.0]])
    numbers = fitted_numbers(problem, (play,))
    asked = [value.parameter.scale * 4.0 for value in numbers]
    assert ((residuals(problem, numbers, too_far) ** 2).sum(axis=1) > null.residual @ null.residual).all()
    cost, values = reached(problem, null, (play,), too_far)
    assert cost < null.residual @ null.residual
    assert values["backlash", "width_mm"] == pytest.approx(0.5 * asked[0])
    instead, _ = reached(problem, fit(problem, (FRAME,)), (play,), too_far)
    assert instead > null.residual @ null.residual  # in the place of another the steps stand as they are


def test_what_a_forecast_tells_nothing_of_is_computed():
    """The derivative where a width starts, far from none, says that any width makes things worse."""
    problem = made({"measurement_frame": {"translation_x_mm": 3.0}}, noise_mm=0.05)
    null, play = fit(problem, ()), Term("backlash", ("width_mm",))
    ahead = foreseen(problem, null, (play,), [tangent(problem, null, play)])
    worse = float(null.residual @ null.residual)
    assert misled(replace(ahead, cost=1.01 * worse), null, (play,))
    assert not misled(replace(ahead, cost=0.99 * worse), null, (play,))
    assert not misled(
        replace(ahead, cost=1.01 * worse), fit(problem, (FRAME,)), (play,)
    )  # instead of another
    order, far = list(range(20)), 17
    assert far not in shortlist(order, 3, set())
    assert shortlist(order, 3, {far}) == [*shortlist(order, 3, set()), far]


def test_details_start_at_the_common_value():
    """Values per channel start where the common value was."""
    problem = made({"actuation_gain": {"scale": 1.2}})
    common = fit(problem, (Term("actuation_gain", ("scale",)),), cross_validate=False)
    each = Term("actuation_gain", ("scale_t0", "scale_t1", "scale_t2"))
    start = carried_over(common, (each,))
    assert start["actuation_gain", "scale_t1"] == common.values["actuation_gain", "scale"]
    assert ("backlash", "width_mm") not in start


def made_up_fit(left_out, block) -> Fit:
    """Return a fit of which only the errors on left-out stretches matter."""
    empty = np.zeros((len(left_out), 0))
    return Fit((), (), np.zeros(0), left_out, empty, np.zeros(0, bool), block, left_out)


def test_a_cause_pays_only_beyond_chance():
    """A gain in every block pays; the same gain from one block alone, or one of a percent, does not."""
    generator = np.random.default_rng(2)
    block = np.repeat(np.arange(20), 30)
    before = made_up_fit(generator.normal(size=600), block)
    everywhere = made_up_fit(0.9 * before.left_out, block)
    small = made_up_fit(0.99 * before.left_out, block)
    once = made_up_fit(np.where(block == 3, 0.1, 1.0) * before.left_out, block)
    assert pays(before, everywhere)
    assert not pays(before, small)
    assert not pays(before, once)
    assert not pays(everywhere, before)
    assert as_good(before, once)
    assert not as_good(everywhere, before)


def test_a_history_may_be_thinned():
    """Comparing every third row leaves the history whole: the same values as of all rows, at those rows."""
    robot = with_effects(small_robot(), {"backlash": {"width_mm": 0.4}})
    inputs = as_inputs(displacement_history(6).tendon, "displacement")
    twin = twin_for(robot, "displacement", COLUMNS, np.zeros(3))
    np.testing.assert_allclose(twin([robot], inputs, 3), twin([robot], inputs, 1)[:, ::3], atol=1e-6)


def test_many_numbers_are_scanned_one_at_a_time_where_they_are_not_known() -> None:
    """From two wrong zeros a fit starts at the one that is there; from values that are known, at those."""
    problem = made({"actuation_offset": {"offset_t1_mm": 0.4}}, noise_mm=0.02)
    names = tuple(f"offset_t{k}_mm" for k in range(3))
    numbers = fitted_numbers(problem, (Term("actuation_offset", names),))
    mine = [index for index, item in enumerate(numbers) if item.effect]
    task = FitTask(problem, numbers, box_of(numbers), prior_of(numbers))
    x = start_of(numbers)
    x[mine[0]], x[mine[2]] = 20.0, -20.0
    best = best_of_grid(task, x)
    assert best[mine[1]] > 0.0
    assert best[mine[0]] == best[mine[2]] == 0.0
    known = {numbers[index].key: 0.0 for index in mine}
    assert np.array_equal(best_of_grid(task, x, known), x)
