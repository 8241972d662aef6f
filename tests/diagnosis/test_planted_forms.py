"""A planted form of a cause is told from its other forms where they differ, and listed with them elsewhere.

The data are those of the static model that the twin goes by: what a diagnosis could know at best.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import Effects, as_inputs, data_set, displacement_history, pair_history, small_robot

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.diagnosis.document import to_json
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.prepare import training_problem
from catheter_sim.diagnosis.problem import Problem, Term
from catheter_sim.diagnosis.result import Cause
from catheter_sim.diagnosis.search import in_best_forms, with_forms
from catheter_sim.diagnosis.trials import Dataset, split_trials
from catheter_sim.diagnosis.words import form_words
from catheter_sim.effects import EFFECTS

LAG, DELAY = Term("rate", ("lag_s",)), Term("rate", ("delay_s",))
OUTPUT_LAG, OUTPUT_DELAY = Term("rate", ("output_lag_s",)), Term("rate", ("output_delay_s",))


def paced(inputs: Inputs, seed: int) -> Inputs:
    """Return the same rows at random intervals of 0.4 to 3 s."""
    steps = np.random.default_rng(seed).uniform(0.4, 3.0, len(inputs) - 1)
    return replace(inputs, time_s=np.concatenate([[0.0], np.cumsum(steps)]))


def section_data(effects: Effects) -> Dataset:
    """Return three trials of the neuroendoscope's section, whose tendons rub: one a repeat of another."""
    histories = [paced(pair_history(seed, 3), seed) for seed in (1, 1, 2)]
    columns = ("tip_x_mm", "tip_z_mm", "body_15_x_mm", "body_15_z_mm")
    name = "neuroendoscope_section"
    return data_set(load_robot(name), name, effects, histories, columns, solver="fkm_exact_arm")


def small_data(effects: Effects) -> Dataset:
    """Return three trials of a robot that hardly bends, and does not rub."""
    robot = replace(small_robot(), friction=Friction(0.0))
    histories = [paced(displacement_history(seed), seed) for seed in (1, 2, 3)]
    histories = [replace(item, tendon=0.1 * item.tendon) for item in histories]
    columns = ("tip_x_mm", "tip_y_mm")
    return data_set(robot, "small.toml", effects, histories, columns, noise_mm=0.05, solver="CC")


def chosen_form(dataset: Dataset, first: Term) -> tuple[Problem, Fit, Cause]:
    """Return the hypothesis to which the simplest form leads, and its cause."""
    problem = training_problem(dataset, split_trials(dataset)[0])
    found = in_best_forms(problem, fit(problem, (first,), cross_validate=False))
    (cause,) = with_forms(problem, [Cause("rate", {}, 100.0)], found)
    return problem, found, cause


@pytest.mark.slow
def test_no_form_is_tried_once_time_is_up() -> None:
    """The hypothesis stays as it was found, though another form would be the right one."""
    dataset = section_data({"rate": {"output_lag_s": 0.8}})
    problem = training_problem(dataset, split_trials(dataset)[0])
    chosen = fit(problem, (LAG,), cross_validate=False)
    assert in_best_forms(problem, chosen, deadline=0.0) is chosen
    assert in_best_forms(problem, chosen) is not chosen


@pytest.mark.slow
@pytest.mark.parametrize(
    ("planted", "form", "term"),
    [
        ({"output_lag_s": 0.8}, "output_lag", OUTPUT_LAG),
        ({"output_delay_s": 0.8}, "output_delay", OUTPUT_DELAY),
        ({"lag_s": 0.8}, "input_lag", LAG),
        ({"delay_s": 0.8}, "input_delay", DELAY),
    ],
)
def test_where_tendons_rub_the_forms_are_told_apart(planted: dict[str, float], form: str, term: Term) -> None:
    """From the lag of the inputs the search goes to the form that was planted, and finds none as good."""
    _, found, cause = chosen_form(section_data({"rate": planted}), LAG)
    assert found.terms == (term,)
    assert cause.form == form
    assert cause.forms_as_good == ()
    ((name, value),) = planted.items()
    assert found.values["rate", name] == pytest.approx(value, rel=0.05)


@pytest.mark.parametrize("planted", [{"lag_s": 0.8}, {"output_lag_s": 0.8}])
def test_where_a_robot_is_a_proportion_a_lag_is_one_on_either_side(planted: dict[str, float]) -> None:
    """A robot in proportion to its inputs shows the same, late before or behind it: the first stays."""
    _, found, cause = chosen_form(small_data({"rate": planted}), LAG)
    assert found.terms == (LAG,)
    assert (cause.form, cause.forms_as_good) == ("input_lag", ("output_lag",))


@pytest.mark.slow
def test_a_cause_of_one_form_has_no_other() -> None:
    """Its form is named; nothing else is fitted."""
    dataset = section_data({"stiffness": {"scale": 1.3}})
    problem = training_problem(dataset, split_trials(dataset)[0])
    chosen = fit(problem, (Term("stiffness", ("scale",)),), cross_validate=False)
    assert in_best_forms(problem, chosen) is chosen
    (cause,) = with_forms(problem, [Cause("stiffness", {}, 100.0)], chosen)
    assert (cause.form, cause.forms_as_good) == ("scale", ())
    assert with_forms(problem, [], chosen) == ()


def wheel_data(effects: Effects) -> Dataset:
    """Return three trials of a wheel that pulls one tendon of the small robot and lets its opposite out."""
    first = replace(small_robot().tendons[0], channel="wheel")
    opposite = replace(first, name="opposite", angle_rad=first.angle_rad + np.pi, channel_gain=-1.0)
    robot = replace(small_robot(), tendons=(first, opposite))
    swings = [most * np.sin(0.42 * np.arange(24.0)) for most in (2.5e-3, 3.0e-3, 3.5e-3)]
    histories = [as_inputs(np.stack([way, -way], axis=1), "displacement") for way in swings]
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    return data_set(robot, "wheel.toml", effects, histories, columns, noise_mm=0.05)


@pytest.mark.slow
def test_slack_is_told_from_play() -> None:
    """A dead zone about the middle is no loop: from play the search goes to slack, and to its size."""
    dataset = wheel_data({"backlash": {"slack_mm": 0.8}})
    problem = training_problem(dataset, split_trials(dataset)[0])
    found = in_best_forms(problem, fit(problem, (Term("backlash", ("width_mm",)),), cross_validate=False))
    (cause,) = with_forms(problem, [Cause("backlash", {}, 100.0)], found)
    assert found.terms == (Term("backlash", ("slack_mm",)),)
    assert (cause.form, cause.forms_as_good) == ("slack", ())
    assert found.values["backlash", "slack_mm"] == pytest.approx(0.8, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("planted", "form"), [({"slack_mm": 0.8}, "slack"), ({"width_mm": 0.8}, "play"), ({}, "")]
)
def test_slack_of_a_channels_tendons_is_found(planted: dict[str, float], form: str) -> None:
    """It is named alone, with its size; not where a play is planted, or nothing."""
    found = diagnose_dataset(wheel_data({"backlash": planted} if planted else {}), simulation=False)
    assert [(item.name, item.form) for item in found.causes] == [("backlash", form)] * bool(form)
    assert found.verdict == ("cause_found" if form else "no_discrepancy")
    for name, value in planted.items():
        assert found.causes[0].parameters[name].value == pytest.approx(value, abs=0.02)


@pytest.mark.long
def test_a_tracker_that_lags_is_found_as_rate() -> None:
    """A diagnosis that knows nothing names the cause, its form and the lag."""
    found = diagnose_dataset(section_data({"rate": {"output_lag_s": 0.8}}), simulation=False)
    assert found.verdict == "cause_found"
    (cause,) = found.causes
    assert (cause.name, cause.form) == ("rate", "output_lag")
    low, high = cause.parameters["output_lag_s"].ci95
    assert low < 0.8 < high
    (written,) = to_json(found)["causes"]
    assert (written["form"], written["forms_as_good"]) == ("output_lag", [])


def test_a_report_says_in_which_form_a_cause_acts() -> None:
    """With its equation and what does as well; nothing where a cause has one form alone."""
    late = Cause("rate", {}, 90.0, "output_lag", ("input_lag", "output_delay"))
    said = form_words(late)
    assert said["form"] == "It acts on what is observed, in the form “output lag”"
    assert said["equation"] == "output_lag_s * dy/dt = x - y"
    assert said["other_forms"] == "“input lag” or “output delay”"
    for plain in (Cause("axial_compression", {}, 90.0, "mount"), Cause("rate", {}, 90.0)):
        assert set(form_words(plain).values()) == {""}


def test_a_form_also_takes_the_place_of_what_stood_in_for_it() -> None:
    """From a cubic law and a force that makes up for it the search goes to the quintic law alone."""
    robot = replace(small_robot(), friction=Friction(0.0))
    unit = next(
        item
        for form in EFFECTS["nonlinear_stiffness"].forms
        for item in form.parameters(robot)
        if item.name == "quintic_mm4"
    )
    effects = {"nonlinear_stiffness": {"quintic_mm4": 40.0 * unit.scale}}
    histories = [displacement_history(seed) for seed in (1, 2, 3)]
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    data = data_set(robot, "small.toml", effects, histories, columns, noise_mm=0.05, solver="CC")
    problem = training_problem(data, split_trials(data)[0])
    cubic, force = Term("nonlinear_stiffness", ("cubic_mm2",)), Term("payload", ("force_z_N",))
    before = fit(problem, (cubic, force), cross_validate=False)
    found = in_best_forms(problem, before)
    assert found.terms == (Term("nonlinear_stiffness", ("quintic_mm4",)),)
