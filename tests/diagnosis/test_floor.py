"""What a flexible model of the inputs can learn of what is left, and what it cannot."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import read_inputs
from catheter_sim.diagnosis.floor import floor_of
from catheter_sim.diagnosis.result import Floor, TrialFit
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.tables import Table

NOISE = 0.2
ROWS = 200
Left = Callable[[np.ndarray, np.ndarray, np.random.Generator], np.ndarray]


def floor_with(left: Left, missing: float = 0.0, seed: int = 0) -> tuple[Floor, float]:
    """Return the floor, and the error before it, where a model leaves `left` besides noise."""
    robot, draw = load_robot("neuroendoscope_section"), np.random.default_rng(seed)
    trials, fits, squares = [], [], []
    for number in range(5):
        time_s = np.arange(float(ROWS))
        pull = 0.1 + 0.1 * np.sin(draw.uniform(0.03, 0.1) * time_s) * np.cos(
            draw.uniform(0.01, 0.03) * time_s
        )
        what = left(time_s, pull, draw)[:, np.newaxis] + NOISE * draw.normal(size=(ROWS, 2))
        what[draw.random(what.shape) < missing] = np.nan
        columns = {"tip_x_mm": what[:, 0] + 100.0 * pull, "tip_z_mm": what[:, 1] + 60.0}
        computed = {"tip_x_mm": 100.0 * pull, "tip_z_mm": np.full(ROWS, 60.0)}
        role, file = ("train" if number < 3 else "heldout"), f"trial_{number}.csv"
        measured = Table(time_s, columns, file)
        inputs = read_inputs(robot, Table(time_s, {"tension_right_N": pull}, file))
        trials.append(Trial(file, role, inputs, measured))
        after = Table(time_s, computed, file)
        fits.append(TrialFit(file, role, time_s, measured, after, after))
        if role == "heldout":
            squares.append(what**2)
    return floor_of(trials, fits), float(np.sqrt(np.nanmean(np.concatenate(squares))))


def test_noise_cannot_be_learned() -> None:
    """The floor is what is left, to 3 %, and no gain is told."""
    found, left = floor_with(lambda time_s, pull, draw: np.zeros(ROWS))
    assert found.rmse["mm"] == pytest.approx(left, rel=0.03)
    assert not found.gains("mm")


@pytest.mark.parametrize("missing", [0.0, 0.02])
def test_what_follows_from_the_inputs_is_learned(missing: float) -> None:
    """A law that no cause has, of level and of history: the floor comes within a quarter of the noise."""

    def law(time_s: np.ndarray, pull: np.ndarray, draw: np.random.Generator) -> np.ndarray:
        behind = np.empty(ROWS)
        now = pull[0]
        for row, value in enumerate(pull):
            now = behind[row] = min(max(now, value - 0.03), value + 0.03)
        return 2.0 * np.abs(pull - 0.12) / 0.12 + 40.0 * (pull - behind)

    found, left = floor_with(law, missing)
    assert left > 4.0 * NOISE
    assert found.rmse["mm"] < 1.25 * NOISE
    assert found.gains("mm")


def test_what_the_inputs_do_not_tell_stays() -> None:
    """A zero that wanders by itself, another way in each trial."""

    def wanders(time_s: np.ndarray, pull: np.ndarray, draw: np.random.Generator) -> np.ndarray:
        return np.asarray(np.cumsum(draw.normal(size=ROWS)) * 0.1)

    found, left = floor_with(wanders)
    assert left > 2.0 * NOISE
    assert found.rmse["mm"] > 0.9 * left


def test_without_held_out_trials_or_rows_there_is_none() -> None:
    """As where nothing was measured to judge by, or a model stopped on its way."""
    robot, time_s = load_robot("neuroendoscope_section"), np.arange(5.0)
    table, pull = Table(time_s, {"tip_x_mm": time_s}, "a.csv"), {"tension_right_N": 0.01 * time_s}
    first = Trial("a.csv", "train", read_inputs(robot, Table(time_s, pull, "")), table)
    whole = TrialFit("a.csv", "train", time_s, table, table, table)
    assert floor_of([], []) == floor_of([first], [whole]) == Floor()
    few = Table(time_s[:3], {"tip_x_mm": time_s[:3]}, "b.csv")
    second = dataclasses.replace(first, file="b.csv", role="heldout")
    assert (
        floor_of([first, second], [whole, TrialFit("b.csv", "heldout", few.time_s, few, few, few)]) == Floor()
    )
