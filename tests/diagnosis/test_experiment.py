"""Claims about what is to be measured next: inputs that can be played, and that tell rivals apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import as_inputs, displacement_history, joint_history, pair_history, rod_history, small_robot

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import read_inputs
from catheter_sim.diagnosis.comparison import rival_groups
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.next_experiment import TELLS_APART_NOISE, advice, next_experiment
from catheter_sim.diagnosis.problem import Problem, Term
from catheter_sim.diagnosis.programmes import programmes
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

FIRST, SECOND = Term("nonlinear_stiffness", ("cubic_mm2",)), Term("twist", ("rate_deg_per_m",))
HISTORIES = {
    "small": displacement_history,
    "neuroendoscope_section": pair_history,
    "chest_tube_section": rod_history,
    "mitral_transseptal": joint_history,
}


@pytest.mark.parametrize("name", HISTORIES)
def test_programmes_can_be_played(name):
    """All are valid for the robot, stay inside what was reached, and begin and end at rest."""
    robot = small_robot() if name == "small" else load_robot(name)
    history = HISTORIES[name](1)
    found = programmes(robot, [Trial("a.csv", "train", history, Table(history.time_s, {}))])
    assert len(found) >= 4
    assert len({item.words for item in found}) == len(found)
    for item in found:
        inputs = read_inputs(replace(robot, actuation=history.actuation), item.table)
        assert inputs.tendon.min() >= 0.0
        assert inputs.tendon.any()
        assert (inputs.tendon.max(axis=0) <= history.tendon.max(axis=0) + 1e-6).all()
        for end in (0, -1):
            assert not inputs.tendon[end].any()
        assert not inputs.force_tip[-1].any()


@pytest.mark.parametrize(
    ("group", "word"),
    [
        (("backlash", "tendon_friction"), "pretension"),
        (("backlash", "rate"), "speed"),
        (("drift", "stiffness"), "minutes"),
        (("coupling", "twist"), "alone"),
    ],
)
def test_advice_names_what_would_tell_them_apart(group, word):
    """In words, for what no inputs show."""
    assert word in advice(group)


def rivals(bends_load: float) -> tuple[Problem, tuple]:
    """Return a problem that two effects explain alike, and both fits.

    Args:
        bends_load: by how much the first makes the robot follow a force across the tip, too.
    """
    robot = small_robot()

    def twin(robots, inputs, every):
        moved, force = 1e3 * inputs.tendon[:, 0], inputs.force_tip[:, 0]
        found = []
        for item in robots:
            first, second = (
                item.effects.get(term.effect, {}).get(term.free[0], 0.0) for term in (FIRST, SECOND)
            )
            found.append(1e-2 * (first + second) * moved + bends_load * first * force)
        return np.array(found)[:, ::every, None]

    pull = np.tile(4e-3 * np.sin(np.pi * np.arange(12) / 12), 8)
    inputs = as_inputs(np.stack([pull, 0 * pull, 0 * pull], axis=1), "displacement")
    noise = 0.1 * np.random.default_rng(1).normal(size=len(pull))
    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, {"tip_x_mm": 300.0 * pull + noise}, "made"))
    problem = Problem(robot, (), (trial,), ("tip_x_mm",), np.full(1, 0.1), twin)
    return problem, (fit(problem, (FIRST,)), fit(problem, (SECOND,)))


def proposed(bends_load):
    """Return what to measure next to tell the two apart."""
    problem, (first, second) = rivals(bends_load)
    groups = rival_groups(first, [second])
    noise, gravity = np.full(1, 0.1), np.zeros(3)
    return next_experiment(problem, first, first.causes, [second], groups, noise, gravity, simulation=False)


def test_inputs_are_proposed_to_which_rivals_answer_unlike():
    """Only a force across the tip shows which it is: that is what is to be played, and what it shows."""
    found = proposed(1.0)
    assert "known force" in found.words
    assert "a refitted twist would miss the new data by" in found.words
    assert np.any(found.inputs.columns["force_tip_x_N"])
    assert found.apart["twist for nonlinear_stiffness"].twin > TELLS_APART_NOISE


def test_where_no_inputs_tell_them_apart_it_is_said():
    """The rival follows all programmes: no inputs are praised, and other measurements are advised."""
    found = proposed(0.0)
    assert found.apart["twist for nonlinear_stiffness"].twin < 0.1
    assert "Play the CSV" not in found.words
    assert "None of the inputs that were tried tells nonlinear stiffness from twist." in found.words


def test_where_time_is_up_words_are_left():
    """A search without end has none, and a budget that is spent ends what would try inputs, too."""
    problem, (first, second) = rivals(1.0)
    groups = (("backlash", "tendon_friction"),)
    kept = next_experiment(
        problem,
        first,
        first.causes,
        [second],
        groups,
        np.full(1, 0.1),
        np.zeros(3),
        simulation=False,
        deadline=0.0,
    )
    assert kept.inputs is None
    assert "pretension" in kept.words


def test_without_rivals_loops_are_proposed():
    """To check what was named, and what repeats."""
    problem, (first, _) = rivals(0.0)
    found = next_experiment(problem, first, first.causes, [], (), np.full(1, 0.1), np.zeros(3))
    assert "each channel alone" in found.words
    assert found.apart == {}


def test_where_the_twin_follows_no_programme_words_are_left():
    """No inputs are proposed then, and nothing breaks."""
    problem, (first, second) = rivals(1.0)
    rows = len(problem.trials[0].inputs)

    def twin(robots, inputs, every):
        known = problem.twin(robots, inputs, every)
        return known if len(inputs) == rows else np.full_like(known, np.nan)

    lost = replace(problem, twin=twin)
    groups = (("backlash", "tendon_friction"),)
    found = next_experiment(lost, first, first.causes, [second], groups, np.full(1, 0.1), np.zeros(3))
    assert found.inputs is None
    assert "pretension" in found.words
