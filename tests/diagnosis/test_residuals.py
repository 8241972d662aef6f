"""Residual views: each finds what was planted in its coordinate, and none finds anything in noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_up import pulled_by

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.pictures import view_figure
from catheter_sim.diagnosis.residuals import (
    VIEWS,
    binned_mean,
    fits_to_judge,
    score_views,
    stack,
    turning_points,
)
from catheter_sim.diagnosis.result import TrialFit
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.tables import Table

SEED = 20240131


def loops(cycles: int, rows: int = 20) -> Array:
    """Return pulls from rest to full and back [N], a different height each time."""
    heights = 0.5 - 0.3 * np.abs(np.sin(np.arange(cycles)))
    up = np.linspace(0.0, 1.0, rows)
    return np.concatenate([height * np.concatenate([up, up[::-1][1:-1]]) for height in heights] + [[0.0]])


def planted(residual: Array, pull: Array) -> tuple[Dataset, tuple[TrialFit, ...]]:
    """Return a data set of one held-out trial with the given residual before and none but noise after."""
    computed = 60.0 * pull
    noise = 0.1 * np.random.default_rng(SEED).normal(size=len(pull))
    dataset = pulled_by(pull, {"tip_x_mm": computed + residual + noise})
    trial = dataset.trials[0]
    time_s = trial.inputs.time_s
    before = Table(time_s, {"tip_x_mm": computed})
    after = Table(time_s, {"tip_x_mm": computed + residual})
    return dataset, (TrialFit(trial.file, trial.role, time_s, trial.outputs, before, after),)


def shares(residual: Array, pull: Array) -> dict[str, tuple[float, float]]:
    """Return what each view explains before and after [%]."""
    dataset, fits = planted(residual, pull)
    return {
        score.view: (score.before_percent, score.after_percent) for score in score_views(dataset, fits, "mm")
    }


PULL = loops(8)
TIME = np.arange(float(len(PULL)))
DIRECTION = turning_points(PULL)[0]


@pytest.mark.parametrize(
    ("residual", "views"),
    [
        (1.5 * DIRECTION, ("direction", "history")),
        (0.02 * TIME, ("time",)),
        (30.0 * PULL**2, ("input", "position")),
    ],
    ids=["friction", "drift", "stiffness"],
)
def test_the_right_view_explains_what_was_planted(residual: Array, views: tuple[str, ...]) -> None:
    """What acts through a coordinate is seen in its view above all others, and gone once corrected."""
    found = shares(residual, PULL)
    ranked = sorted(found, key=lambda view: -found[view][0])
    assert set(ranked[: len(views)]) == set(views)
    for view in views:
        assert found[view][0] > 85.0
        assert found[view][1] < 5.0
    assert all(found[view][0] < 60.0 for view in set(VIEWS) - set(views))


def test_noise_explains_nothing() -> None:
    """In white noise no view explains more than chance leaves, since it is judged on other cycles."""
    found = shares(np.zeros(len(PULL)), PULL)
    assert set(found) == set(VIEWS)
    assert max(before for before, _ in found.values()) < 3.0


def test_turning_points_ignore_small_moves_back() -> None:
    """The way counts from the last true turn; a step back below 2 % of the range is none."""
    values = np.array([0.0, 5.0, 10.0, 9.9, 10.1, 6.0, 2.0, 4.0])
    direction, way = turning_points(values)
    assert direction.tolist() == [1, 1, 1, 1, 1, -1, -1, 1]
    assert way == pytest.approx([0, 5, 10, 9.9, 10.1, -4.1, -8.1, 2])


def test_turning_points_of_a_still_robot() -> None:
    """Without motion there is no direction and no way."""
    direction, way = turning_points(np.full(5, 3.0))
    assert not direction.any()
    assert not way.any()


def test_intervals_hold_the_true_mean_of_clustered_rows() -> None:
    """Rows that err together in a cycle give intervals that hold the mean in about 95 of 100 draws."""
    generator = np.random.default_rng(SEED)
    blocks = np.repeat(np.arange(12), 10)
    inside = []
    for _ in range(400):
        values = np.repeat(generator.normal(size=12), 10) + 0.3 * generator.normal(size=120)
        curve = binned_mean(np.zeros(120), values, blocks)
        inside.append(abs(curve.mean[0]) <= curve.half_width[0])
    assert 0.91 <= np.mean(inside) <= 0.99, f"seed {SEED}"


def test_missing_values_are_left_out() -> None:
    """A row without a measurement is in no view, and its coordinates go with it."""
    dataset, (fit,) = planted(np.zeros(len(PULL)), PULL)
    holes = fit.measured.columns["tip_x_mm"].copy()
    holes[[3, 50]] = np.nan
    fit = replace(fit, measured=Table(fit.time_s, {"tip_x_mm": holes}))
    residuals = stack(dataset, [fit], "tip_x_mm", "before")
    assert len(residuals.values) == len(PULL) - 2
    assert np.isfinite(residuals.values).all()
    assert 50.0 not in residuals.coordinates["time"]["time in the trial_s"]
    for coordinates in residuals.coordinates.values():
        assert all(len(values) == len(PULL) - 2 for values in coordinates.values())


def test_few_held_out_cycles_call_in_the_training_trials() -> None:
    """Views are judged on held-out cycles; where there are fewer than four, on all trials."""
    dataset, fits = planted(np.zeros(len(PULL)), PULL)
    assert fits_to_judge(dataset, fits) == fits
    short = loops(2)
    few, (heldout,) = planted(np.zeros(len(short)), short)
    training = replace(heldout, file="b.csv", role="train")
    both = replace(few, trials=(few.trials[0], replace(few.trials[0], file="b.csv", role="train")))
    assert fits_to_judge(both, (heldout, training)) == (heldout, training)


def test_pictures_say_what_is_seen() -> None:
    """The title states the share explained; every axis carries its unit."""
    dataset, fits = planted(1.5 * DIRECTION, PULL)
    for score in score_views(dataset, fits, "mm"):
        figure = view_figure(dataset, fits, score, ["tip_x_mm"], "held-out data")
        (axes,) = figure.axes
        assert axes.get_ylabel() == "mean residual [mm]"
        unit = {"direction": "rising", "time": "[s]", "input": "[N]"}.get(score.view, "[mm]")
        assert axes.get_xlabel().endswith(unit)
        if score.view == "direction":
            assert "explains 100 % before" in figure.get_suptitle()
            assert figure.get_suptitle().endswith("nothing after")
