"""Which causes stay named: the interval that is printed decides, what the simulation adds to it included."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import pair_history

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.intervals import cause_intervals
from catheter_sim.diagnosis.problem import Problem, Term
from catheter_sim.diagnosis.pruning import Pruning, prune, pruning_notes, with_shares
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

TERMS = (Term("actuation_gain", ("scale",)), Term("tendon_friction", ("mu",)))
NOISE_MM = 0.1


def twin(robots, inputs, every):
    """Return a tip that moves 100 mm a newton times a scale, and by 3 mm times mu every few rows."""
    rows = np.arange(len(inputs))[::every]
    shape = 3.0 * np.sin(0.9 * rows)
    found = []
    for robot in robots:
        scale = robot.effects.get("actuation_gain", {}).get("scale", 1.0)
        mu = robot.effects.get("tendon_friction", {}).get("mu", robot.friction.mu)
        found.append(100.0 * scale * inputs.tendon[::every, 0] + mu * shape)
    return np.array(found)[:, :, None]


@pytest.fixture(scope="module")
def pruning() -> Pruning:
    """A scale of 1.2, and friction of 0.4 for 0.3, in three training trials and two held out."""
    robot = load_robot("neuroendoscope_section")
    true = replace(robot, effects={"actuation_gain": {"scale": 1.2}, "tendon_friction": {"mu": 0.4}})
    generator = np.random.default_rng(2)
    trials = []
    for seed in range(5):
        inputs = pair_history(seed)
        values = twin([true], inputs, 1)[0, :, 0] + NOISE_MM * generator.normal(size=len(inputs))
        table = Table(inputs.time_s, {"tip_x_mm": values}, f"{seed}.csv")
        trials.append(Trial(f"{seed}.csv", "train" if seed < 3 else "heldout", inputs, table))
    problem = Problem(robot, (), tuple(trials[:3]), ("tip_x_mm",), np.array([NOISE_MM]), twin)
    test = replace(problem, trials=tuple(trials[3:]))
    before = fit(problem, (), cross_validate=False)
    return Pruning(problem, test, before, {"mm": NOISE_MM}, "mm", False)


def test_causes_that_are_surely_something_stay(pruning):
    """By the noise both are sure, and nothing is said of them."""
    both = with_shares(pruning, fit(pruning.problem, TERMS, cross_validate=False))
    kept = prune(pruning, both)
    assert kept.after is both.after
    assert pruning_notes(kept, None) == []


def test_a_cause_that_the_simulation_makes_unsure_is_not_named(pruning):
    """Its printed interval would hold the value that does nothing: it goes, with a note, the other stays."""
    both = with_shares(pruning, fit(pruning.problem, TERMS, cross_validate=False))
    index = [free.effect for free in both.after.numbers].index("tendon_friction")
    parameter = both.after.numbers[index].parameter
    shift = np.zeros(len(both.after.numbers))
    shift[index] = (parameter.null - both.after.values["tendon_friction", "mu"]) / parameter.scale
    low, high = cause_intervals(both.after, shift)["tendon_friction", "mu"]
    assert low <= parameter.null <= high
    left = prune(pruning, both, shift)
    assert [cause.name for cause in left.causes] == ["actuation_gain"]
    assert left.unsure == ("tendon_friction",)
    assert any("tendon friction lowers the error, but" in note.text for note in pruning_notes(left, None))


def test_a_cause_without_which_much_is_lost_stays_and_that_is_said(pruning):
    """The scale carries nearly all of the gain: doubted by the simulation it is named, with the reason."""
    both = with_shares(pruning, fit(pruning.problem, TERMS, cross_validate=False))
    index = [free.effect for free in both.after.numbers].index("actuation_gain")
    shift = np.zeros(len(both.after.numbers))
    shift[index] = 0.5 / both.after.numbers[index].parameter.scale
    left = prune(pruning, both, shift)
    assert {cause.name for cause in left.causes} == {"actuation_gain", "tendon_friction"}
    assert left.needed == ("actuation_gain",)
    assert any(note.text.startswith("Each number of actuation gain") for note in pruning_notes(left, shift))
