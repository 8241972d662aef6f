"""Claims about what pays: stretches that all gain, whatever their size, are no chance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest
from planted import as_inputs, small_robot

from catheter_sim.diagnosis import fitted_sets, search, workers
from catheter_sim.diagnosis.comparison import as_good, leaves_only_noise, pays
from catheter_sim.diagnosis.fit import Fit, blocks_of, fit, fold_of
from catheter_sim.diagnosis.fitted_sets import may_end_at
from catheter_sim.diagnosis.noise import chance_of_gain
from catheter_sim.diagnosis.problem import Problem, Term, fitted_numbers
from catheter_sim.diagnosis.search import select
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.effects import EFFECTS
from catheter_sim.tables import Table

BLOCK = np.repeat(np.arange(8), 10)


def fit_with(left_out):
    """Return a fit of which only the errors on left-out stretches matter."""
    nothing = np.zeros((len(left_out), 0))
    return Fit((), (), np.zeros(0), left_out, nothing, np.zeros(0, bool), BLOCK, np.asarray(left_out, float))


BEFORE = fit_with(np.ones(80))


def chance(after):
    """Return the probability of the gain over `BEFORE` by chance."""
    return chance_of_gain(np.bincount(BLOCK, weights=1.0 - after.left_out**2))


def test_uneven_gain_in_every_stretch_pays():
    """One stretch gains a hundred times what the others do: their mean is uncertain, its sign is not."""
    share = np.where(BLOCK == 0, 0.05, 0.99)
    assert chance(fit_with(share)) < 0.01
    assert pays(BEFORE, fit_with(share))


def test_gain_in_half_of_the_stretches_does_not_pay():
    """As much lost as won, and a little more won: chance."""
    after = np.sqrt(np.where(BLOCK % 2 == 0, 0.4, 1.4))
    assert chance(fit_with(after)) > 0.2
    assert not pays(BEFORE, fit_with(after))


def test_gain_too_small_to_matter_does_not_pay():
    """A hundredth in every stretch is certain, and not worth a cause; the two are as good."""
    after = fit_with(np.full(80, 0.99))
    assert chance(after) < 0.01
    assert not pays(BEFORE, after)
    assert as_good(after, BEFORE)


def test_search_does_not_end_where_causes_tried_beside_it_pay():
    """Two causes, each worth 2 % of the error: one may go if the other was never there, not if both pay."""
    frame, gain, lag = (Term(name, ()) for name in ("measurement_frame", "actuation_gain", "rate"))
    both, one, none = (
        replace(fit_with(np.full(80, size)), terms=terms)
        for size, terms in ((0.96, (frame, gain, lag)), (0.98, (frame, gain)), (1.0, (frame,)))
    )
    assert not pays(none, one)
    assert not pays(one, both)
    assert may_end_at(one, none, [none, one])
    assert not may_end_at(one, none, [none, one, both])
    assert may_end_at(one, replace(none, terms=(Term("payload", ()),)), [one, both])


@pytest.mark.parametrize(("forms", "taken"), [(2, True), (20, False)])
def test_of_many_forms_one_does_better_by_chance(forms, taken, monkeypatch):
    """A tenth less in each of eight stretches, by chance once in 256: enough of two forms, not of twenty."""
    now = replace(BEFORE, terms=(Term("stiffness", ()),))
    other = replace(fit_with(np.full(80, 0.9)), terms=(Term("stiffness", ("scale",)),))
    worse = replace(fit_with(np.full(80, 1.1)), terms=other.terms)
    fits = [("stiffness", "form", item) for item in (other, *[worse] * (forms - 1))]
    monkeypatch.setattr(search, "_fitted", lambda *_, **__: (now, fits))
    monkeypatch.setattr(search, "fit", lambda *_, **__: other)
    problem = SimpleNamespace(moving=False, model_share=None)
    assert chance(other) == pytest.approx(1 / 256)
    assert (search.in_best_forms(problem, now) is other) is taken  # type: ignore[arg-type]


STRETCHES, ROWS = 16, 12
UNITS = {"nonlinear_stiffness": "cubic_mm2", "twist": "rate_deg_per_m"}


PULL = np.tile(np.sin(np.pi * np.arange(ROWS) / ROWS), STRETCHES)
Outputs = Callable[[float, float, float], np.ndarray]


def made(outputs: Outputs, size: str, true: tuple[float, float, float], seed: int) -> Problem:
    """Return data of a model of two causes, of sizes over what they are `size` of, and the stiffness.

    Args:
        outputs: of the two sizes and how far the stiffness is from 1.
        size: field of a parameter that counts as one, "scale" or "upper".
        true: what the data have.
        seed: of their noise.
    """
    robot = small_robot()
    one = {
        name: next(getattr(item, size) for item in EFFECTS[name].parameters(robot) if item.name == number)
        for name, number in UNITS.items()
    }

    def twin(robots, inputs, every):
        rows = []
        for item in robots:
            sizes = [item.effects.get(name, {}).get(UNITS[name], 0.0) / one[name] for name in UNITS]
            rows.append(outputs(*sizes, item.effects.get("stiffness", {}).get("scale", 1.0) - 1.0))
        return np.array(rows)[:, ::every, None]

    inputs = as_inputs(np.stack([PULL, 0 * PULL, 0 * PULL], axis=1), "displacement")
    noise = 0.1 * np.random.default_rng(seed).normal(size=len(PULL))
    table = Table(inputs.time_s, {"tip_x_mm": outputs(*true) + noise}, "made")
    trial = Trial("a.csv", "train", inputs, table)
    return Problem(robot, (), (trial,), ("tip_x_mm",), np.full(1, 0.1), twin)


def opposed(a: float, b: float, stiffer: float) -> np.ndarray:
    """Two causes that add in every second cycle and cancel in the others."""
    side = np.repeat(np.where(np.arange(STRETCHES) % 2, 1.0, -1.0), ROWS)
    return PULL * (a + side * b)


def multiplied(a: float, b: float, stiffer: float) -> np.ndarray:
    """The product of two causes, each alone nothing, and nearly what a third does."""
    return 30.0 * a * b * PULL**2 + stiffer * PULL


def test_two_causes_are_found_that_do_not_pay_alone(monkeypatch):
    """Each alone makes half of the cycles worse: a search of one step ends with none, of two with both."""
    problem = made(opposed, "scale", (3.0, 3.0, 0.0), seed=1)
    candidates = ("stiffness", *UNITS)
    assert set(select(problem, candidates).chosen.causes) == set(UNITS)
    monkeypatch.setattr(search, "PATIENCE", 0)
    assert select(problem, candidates).chosen.causes == ()


@pytest.mark.parametrize("looks", [0, 1, 2, 3, 5])
def test_when_time_is_up_the_best_so_far_is_chosen(looks: int, monkeypatch):
    """By a clock that goes on by one with each look at it: in probes, in fits, in a later step."""
    problem = made(opposed, "scale", (3.0, 0.0, 0.0), seed=1)
    whole = select(problem, tuple(UNITS))
    assert whole.chosen.causes == ("nonlinear_stiffness",)
    assert not whole.unfinished
    ticks = count()
    for module in (fitted_sets, workers):
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: float(next(ticks))))
    found = select(problem, tuple(UNITS), deadline=float(looks))
    assert found.unfinished
    assert found.chosen is found.path[-1]
    assert found.chosen.causes in {(), *(item.causes for item in found.tried)}
    assert len(found.tried) <= len(whole.tried)
    assert looks or found.chosen.causes in {(), whole.chosen.causes}


def test_two_causes_are_found_beside_one_that_imitates_them(monkeypatch):
    """The third cause takes most of the error alone, so that no step from it leads to the other two."""
    monkeypatch.setattr(search, "BEAM", 1)
    problem = made(multiplied, "upper", (0.5, 0.5, 0.0), seed=1)
    candidates = ("stiffness", *UNITS)
    assert set(select(problem, candidates).chosen.causes) == set(UNITS)
    monkeypatch.setattr(fitted_sets, "PAIRS", 0)
    monkeypatch.setattr(search, "NEAR_SETS", 0)
    assert set(select(problem, candidates).chosen.causes) == {"stiffness"}


def test_a_search_that_ended_wrongly_is_left_by_exchanging_causes(monkeypatch):
    """Where sets of two are not tried at first, one cause is exchanged for the two that it imitates."""
    monkeypatch.setattr(search, "BEAM", 1)
    monkeypatch.setattr(fitted_sets, "PAIRS", 0)
    problem = made(multiplied, "upper", (0.5, 0.5, 0.0), seed=1)
    assert set(select(problem, ("stiffness", *UNITS)).chosen.causes) == set(UNITS)


def test_a_rival_is_tried_in_its_other_forms():
    """What errs by 1.5 times the noise in its simplest form, and by the noise in another, does as well."""
    robot = small_robot()

    def twin(robots, inputs, every):
        rows = []
        for item in robots:
            law = item.effects.get("nonlinear_stiffness", {})
            twist = item.effects.get("twist", {}).get("rate_deg_per_m", 0.0)
            cubic, quintic = law.get("cubic_mm2", 0.0), law.get("quintic_mm4", 0.0)
            pull = inputs.tendon[:, 0]
            off = 0.08 * np.sin(6.0 * np.pi * pull)
            rows.append(twist * pull / 10.0 + cubic * (pull + off) / 100.0 + quintic * pull / 1e4)
        return np.array(rows)[:, ::every, None]

    inputs = as_inputs(np.stack([PULL, 0 * PULL, 0 * PULL], axis=1), "displacement")
    noise = 0.1 * np.random.default_rng(3).normal(size=len(PULL))
    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, {"tip_x_mm": 2.0 * PULL + noise}, "made"))
    problem = Problem(robot, (), (trial,), ("tip_x_mm",), np.full(1, 0.1), twin)
    found = select(problem, ("twist", "nonlinear_stiffness"))
    assert found.chosen.causes == ("twist",)
    assert ("quintic_mm4",) in [term.free for item in found.equals for term in item.terms]


def pulled_in_turn(true: tuple[float, float, float], seed: int, moving: bool) -> Problem:
    """Return data of a robot of which each output follows one channel, whose gains are `true`.

    Each channel is pulled by itself, so that a gain of one alone is no stiffness; in seconds, as motion is
    cut.
    """
    robot = small_robot()
    keys = [item.name for item in EFFECTS["actuation_gain"].forms[0].parameters(robot)]
    alone = [name for name in keys if name != "scale"]
    waves = np.stack([np.roll(PULL, 4 * k) * (1.0 + 0.1 * k) for k in range(3)], axis=1)
    inputs = replace(as_inputs(waves, "displacement"), time_s=0.1 * np.arange(len(PULL)))

    def twin(robots, inputs, every):
        rows = []
        for item in robots:
            gains = item.effects.get("actuation_gain", {})
            each = np.array([gains.get(name, gains.get("scale", 1.0)) for name in alone])
            stiffer = item.effects.get("stiffness", {}).get("scale", 1.0)
            rows.append(inputs.tendon * each / stiffer)
        return np.array(rows)[:, ::every]

    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    noise = 0.01 * np.random.default_rng(seed).normal(size=waves.shape)
    values = waves * np.array(true) + noise
    table = Table(inputs.time_s, {name: values[:, k] for k, name in enumerate(columns)}, "made")
    trial = Trial("a.csv", "train", inputs, table)
    return Problem(robot, (), (trial,), columns, np.full(3, 0.01), twin, moving=moving)


def test_in_motion_values_per_channel_are_tried_before_sets_of_two():
    """A gain of one channel settles the error alone: no set of two is fitted, as each costs minutes."""
    found = select(pulled_in_turn((1.5, 1.0, 1.0), 1, moving=True), ("stiffness", "actuation_gain", "twist"))
    assert found.chosen.causes == ("actuation_gain",)
    assert len(found.chosen.numbers) == 3
    assert max(len(item.terms) for item in found.tried) == 1


def test_in_motion_little_is_fitted_where_nothing_is_wrong():
    """The robot as it is settles the error: the best probed causes alone are fitted, and none is chosen."""
    candidates = ("stiffness", *UNITS, "actuation_gain", "backlash", "payload")
    found = select(pulled_in_turn((1.0, 1.0, 1.0), 1, moving=True), candidates)
    assert found.chosen.causes == ()
    assert 0 < len(found.tried) <= fitted_sets.FINALISTS


def test_a_lag_is_sought_from_hundredths_of_a_second_in_motion():
    """From 0.2 s, where fits of held rows begin, a lag of 20 ms of a robot that swings was not found."""
    term = (Term("rate", ("lag_s",)),)
    held, moving = (pulled_in_turn((1.0, 1.0, 1.0), 1, moving) for moving in (False, True))
    for problem, start, scale in ((held, 0.2, 0.1), (moving, 0.02, 0.01)):
        (number,) = fitted_numbers(problem, term)
        assert (number.parameter.start, number.parameter.scale) == (start, scale)


def bent(cubic: float, quintic: float, softer: float) -> np.ndarray:
    """How far a robot bends whose moment grows by a third or a fifth power of the bend, to first order."""
    return 20.0 * PULL * (1.0 - cubic * PULL**2 - quintic * PULL**4 + softer)


def of_powers(quintic: float) -> Problem:
    """Return data of a law of the fifth power; twists make up for it, too, of the sixth."""
    robot = small_robot()
    keys = ("cubic_mm2", "quintic_mm4")
    numbers = {item.name: item.scale for item in EFFECTS["nonlinear_stiffness"].parameters(robot)}

    def twin(robots, inputs, every):
        rows = []
        for item in robots:
            law = item.effects.get("nonlinear_stiffness", {})
            powers = [law.get(key, 0.0) / (20.0 * numbers[key]) for key in keys]
            stiffer = item.effects.get("stiffness", {}).get("scale", 1.0) - 1.0
            twisted = item.effects.get("twist", {}).get("rate_deg_per_m", 0.0)
            rows.append(bent(*powers, -stiffer) - 0.01 * twisted * PULL**6)
        return np.array(rows)[:, ::every, None]

    inputs = as_inputs(np.stack([PULL, 0 * PULL, 0 * PULL], axis=1), "displacement")
    noise = 0.1 * np.random.default_rng(2).normal(size=len(PULL))
    table = Table(inputs.time_s, {"tip_x_mm": bent(0.0, quintic, 0.0) + noise}, "made")
    trial = Trial("a.csv", "train", inputs, table)
    return Problem(robot, (), (trial,), ("tip_x_mm",), np.full(1, 0.1), twin)


def test_a_cause_in_another_form_comes_before_two_causes(monkeypatch):
    """The fifth power is tried alone as soon as the third leaves structure; no third cause is sought then."""
    problem, candidates = of_powers(0.2), ("stiffness", *UNITS)
    found = select(problem, candidates)
    assert [term.free for term in found.chosen.terms] == [("quintic_mm4",)]
    assert max(len(item.terms) for item in found.tried) == 2
    monkeypatch.setattr(fitted_sets, "FIRST_IN_ALL_FORMS", 0)
    assert [term.free for term in select(problem, candidates).chosen.terms] != [("quintic_mm4",)]


def test_wild_rows_do_not_keep_a_search_going():
    """One row in fifty at ten times the noise is nothing to look for; a wave of the noise's size is.

    So is a jump late in the record, however wild its rows are.
    """
    problem = of_powers(0.0)
    (trial,) = problem.trials
    values = trial.outputs.columns["tip_x_mm"]
    wild, wave = values.copy(), values + 0.1 * np.sin(np.arange(len(values)) / 7.0)
    wild[::50] += 1.0
    late = values + 1.0 * (np.arange(len(values)) > 0.9 * len(values))
    for changed, nothing_left in ((values, True), (wild, True), (wave, False), (late, False)):
        outputs = replace(trial.outputs, columns={"tip_x_mm": changed})
        asked = replace(problem, trials=(replace(trial, outputs=outputs),))
        assert leaves_only_noise(asked, fit(asked, ())) is nothing_left
    assert not leaves_only_noise(asked, fit(asked, ()), 1.5)  # the late jump


def test_neighbours_are_left_out_of_different_fits():
    """Of an interleaved problem pieces of two rows or three; else an eighth of the rows together."""
    for interleaved, together in ((True, 3), (False, len(PULL) // 16)):
        fold = fold_of(blocks_of(replace(of_powers(0.0), interleaved=interleaved)))
        runs = np.diff(np.flatnonzero(np.diff(fold, prepend=-1, append=-1)))
        assert (runs.max() <= together) if interleaved else (runs.max() >= together)
        assert sorted(set(fold.tolist())) == list(range(8))
