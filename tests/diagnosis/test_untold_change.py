"""What of a change in motion no command tells: how much of it a cause may leave."""

from __future__ import annotations

import numpy as np
import pytest
from made_problem import gain_problem, noisy, pulls, trial_of

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.changes.differences import MOST_MODEL_SHARE, unpredicted_share
from catheter_sim.diagnosis.result import UnitResult
from catheter_sim.diagnosis.verdict import most_error_remains, structured_remainder

COLUMN = ("tip_x_mm",)


def share(changes: list[Array], driven: list[Array] | None = None) -> float:
    """Return the share of a change that is untold, of trials with these changes."""
    trials = tuple(
        trial_of(pull, {"tip_x_mm": pull + change})
        for pull, change in zip(driven or PULLS, changes, strict=False)
    )
    problem = gain_problem(trials, 0.01, COLUMN)
    return unpredicted_share(problem, problem.robot)


PULLS = [pulls(seed=seed) for seed in range(4)]


def test_what_follows_from_the_commands_is_told() -> None:
    """A change that goes with the square of the input leaves its noise."""
    assert share([noisy(pull**2, seed) for seed, pull in enumerate(PULLS)]) < 0.25


def test_swings_that_no_command_tells_are_not() -> None:
    """Half of the squares follow from the command, the others swing by chance: sqrt(1/2) is untold."""
    rng = np.random.default_rng(7)
    time = np.arange(len(PULLS[0]))
    swings = [
        np.std(pull**2) * np.sqrt(2.0) * np.sin(0.9 * time + rng.uniform(0.0, 2.0 * np.pi)) for pull in PULLS
    ]
    changes = [pull**2 - np.mean(pull**2) + swing for pull, swing in zip(PULLS, swings, strict=True)]
    assert share(changes) == pytest.approx(np.sqrt(0.5), abs=0.06)


def test_there_is_a_limit_to_it() -> None:
    """Noise alone is untold, and a cause has to tell a part of a change all the same."""
    assert share([noisy(0.0 * pull, seed) for seed, pull in enumerate(PULLS)]) == MOST_MODEL_SHARE


def test_what_a_trial_alone_shows_is_not_told_by_the_others() -> None:
    """Up where one trial pulls, down where the other does: by both together all of it, by either nothing."""
    low, high = PULLS[0] - PULLS[0].min(), PULLS[1] - PULLS[1].min() + 2.0 * np.ptp(PULLS[0])
    changes = [noisy(1.0 + 0.0 * low, 1), noisy(-1.0 + 0.0 * high, 2)]
    assert share(changes, [low, high]) == MOST_MODEL_SHARE


def test_one_trial_says_nothing_of_others() -> None:
    assert share([PULLS[0] ** 2]) == 0.0


@pytest.mark.parametrize(("model_share", "too_much"), [(0.0, True), (0.6, True), (0.8, False)])
def test_what_a_cause_may_leave_of_a_change(model_share: float, too_much: bool) -> None:
    """A cause that leaves 7 of 10 mm, at twenty times the noise, is believed where 8 are untold."""
    result = UnitResult("mm", 0.35, 10.0, 7.0, 30.0, (20.0, 40.0), 0.001)
    assert most_error_remains(result, model_share) == too_much
    assert structured_remainder(result, (), 1, model_share) is None
