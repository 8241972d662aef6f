"""Data taken while a robot moves: how they are read, cut, and weighed."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.fit import blocks_of
from catheter_sim.diagnosis.noise import chance_of_gain, noise_from_row_to_row
from catheter_sim.diagnosis.problem import Problem, with_fewer_rows
from catheter_sim.diagnosis.thresholds import GAIN_CHANCE
from catheter_sim.diagnosis.trials import (
    DYNAMIC,
    HELD,
    Dataset,
    Trial,
    beginnings,
    equal_stretches,
    judged_after,
    measured_from,
    too_little,
)
from catheter_sim.diagnosis.workers import twin_of
from catheter_sim.errors import InputError
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table
from tests.simulation.moving import HANGING, pulled, swinging

COLUMNS = ("tip_x_mm", "tip_z_mm")
ROBOT = swinging()


def trial(seed: int, seconds: float, noise_mm: float = 0.1) -> Trial:
    inputs = pulled(seed, seconds)
    run = simulate(ROBOT, inputs, HANGING, dynamic=True)
    tips = 1e3 * np.array([posture.p_w[-1] for posture in run.postures])
    tips = tips + noise_mm * np.random.default_rng(seed).normal(size=tips.shape)
    table = Table(inputs.time_s, {"tip_x_mm": tips[:, 0], "tip_z_mm": tips[:, 2]}, f"trial_{seed}")
    return Trial(f"trial_{seed}", "train", inputs, table)


def dataset(trials: tuple[Trial, ...]) -> Dataset:
    return Dataset(Path("."), "d", ROBOT, "r", "", "", HANGING, (), COLUMNS, trials, motion=DYNAMIC)


def folder(place: Path, motion: str) -> Path:
    place.joinpath("trial.csv").write_text(
        "time_s,tension_right_N,tip_x_mm\n" + "".join(f"{k},{0.1 * k},{k}\n" for k in range(4))
    )
    place.joinpath("dataset.toml").write_text(
        f"""[dataset]
name = "n"
robot = "neuroendoscope_section"
source = "s"
licence = "l"
[conditions]
gravity_mps2 = [0.0, 0.0, 0.0]
{motion}
[channels]
inputs = ["tension_right_N"]
outputs = ["tip_x_mm"]
[[trials]]
file = "trial.csv"
"""
    )
    return place


@pytest.mark.parametrize(
    ("line", "motion"), [("", HELD), ('motion = "held"', HELD), ('motion = "dynamic"', DYNAMIC)]
)
def test_a_data_set_says_whether_its_rows_were_held(tmp_path: Path, line: str, motion: object) -> None:
    assert load_dataset(folder(tmp_path, line)).motion == motion


@pytest.mark.parametrize("line", ['motion = "moving"', "motion = 1", "motion = true"])
def test_another_motion_is_refused_with_the_choices(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError, match=r"dataset\.toml: conditions\.motion.*choices: held, dynamic"):
        load_dataset(folder(tmp_path, line))


def test_tables_may_say_it_too() -> None:
    t = np.arange(4.0)
    tables = [{"time_s": t, "tension_right_N": 0.1 * t, "tip_x_mm": k * t} for k in (1.0, 2.0)]
    assert cs.dataset("neuroendoscope_section", tables, motion="dynamic").motion == DYNAMIC
    assert cs.dataset("neuroendoscope_section", tables).motion == HELD
    with pytest.raises(InputError, match="choices: held, dynamic"):
        cs.dataset("neuroendoscope_section", tables, motion="fast")


def test_a_stretch_of_a_longer_recording_is_played_from_before_and_judged_later(tmp_path: Path) -> None:
    """In a file and from tables; rows before it are commands without measurements."""
    found = load_dataset(folder(tmp_path, "warm_up_s = 2")).trials[0]
    assert np.array_equal(np.isnan(found.outputs.columns["tip_x_mm"]), [True, True, False, False])
    assert found.inputs.tendon.max() == pytest.approx(0.3)
    assert measured_from(found) == 2
    t = 7.0 + np.arange(4.0)
    tables = [{"time_s": t, "tension_right_N": 0.1 * t, "tip_x_mm": k * t} for k in (1.0, 2.0)]
    made = cs.dataset("neuroendoscope_section", tables, warm_up_s=1.5)
    assert [measured_from(item) for item in made.trials] == [2, 2]
    assert measured_from(cs.dataset("neuroendoscope_section", tables).trials[0]) == 0


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("-1", "0 or more, is needed, not -1"),
        ("nan", "finite number of seconds"),
        ('"2 s"', "a number of seconds is needed, not '2 s'"),
        ("true", "a number of seconds is needed"),
        ("4", "4 s leave no measured value of trial.csv, which lasts 3 s"),
    ],
)
def test_a_warm_up_that_cannot_be_is_refused(tmp_path: Path, value: str, said: str) -> None:
    with pytest.raises(InputError, match=rf"dataset\.toml: conditions\.warm_up_s: .*{re.escape(said)}"):
        load_dataset(folder(tmp_path, f"warm_up_s = {value}"))


def test_what_is_judged_later_counts_from_there() -> None:
    """Beginnings to choose by and stretches of chance are as long as what was measured, not as the trial."""
    whole = trial(0, 3.0)
    late = judged_after(whole, 1.0, "here")
    (short,) = beginnings((late,), 0.5)
    assert short.inputs.time_s[-1] == pytest.approx(1.5)
    assert np.isfinite(short.outputs.columns["tip_x_mm"]).sum() == 51
    assert len(equal_stretches(late)) == 2
    assert equal_stretches(late)[0].start == 0
    problem = Problem(ROBOT, (), (late,), COLUMNS, np.ones(2), lambda *_: np.zeros(0), moving=True)
    counts = np.unique(blocks_of(problem), return_counts=True)[1]
    assert counts.max() <= 1.1 * counts.min()


def test_beginnings_are_prefixes_alike_in_length() -> None:
    """A prefix of a motion is what it was: nothing that comes later can have changed it."""
    trials = (trial(0, 1.0), trial(1, 0.3))
    short = beginnings(trials, 1.0)
    assert [item.inputs.time_s[-1] for item in short] == [0.5, 0.3]
    assert np.array_equal(short[0].outputs.columns["tip_x_mm"], trials[0].outputs.columns["tip_x_mm"][:51])


def test_rows_of_a_swing_are_no_independent_values() -> None:
    """Ten seconds at 100 Hz are ten stretches for every estimate of chance, not a thousand rows."""
    inputs = pulled(0, 10.0)
    table = Table(inputs.time_s, {name: np.zeros(len(inputs)) for name in COLUMNS})
    one = Trial("t", "train", inputs, table)
    parts = equal_stretches(one)
    assert len(parts) == 10
    assert [part.start for part in parts] == [0, *(part.stop for part in parts[:-1])]
    assert parts[-1].stop == len(inputs)
    problem = Problem(ROBOT, (), (one,), COLUMNS, np.ones(2), lambda *_: np.zeros(0), moving=True)
    assert len(np.unique(blocks_of(problem))) == 10
    fewer = with_fewer_rows(replace(problem, trials=(one, one, one, one)))
    assert sum(item.inputs.time_s[-1] for item in fewer.trials) == pytest.approx(10.0)


def test_noise_is_told_from_motion_by_its_rows() -> None:
    """White noise on a swing thousands of times as large; a swing without noise has next to none."""
    time_s = 0.01 * np.arange(2000)
    swing = 50.0 * np.sin(2.0 * np.pi * 1.5 * time_s)
    noise = 0.1 * np.random.default_rng(5).normal(size=(2000, 1))
    assert noise_from_row_to_row([swing[:, None] + noise])[0] == pytest.approx(0.1, rel=0.1)
    assert noise_from_row_to_row([swing[:, None]])[0] < 0.02


@pytest.mark.slow
def test_fits_take_longer_steps_only_where_these_hide_in_the_noise() -> None:
    noisy, exact = dataset((trial(0, 0.4, 1.0),)), dataset((trial(0, 0.4, 1e-5),))
    longer, own = (twin_of(item, item.trials) for item in (noisy, exact))
    assert longer.predict.twin.timestep_s > ROBOT.dynamics.motion_timestep_s
    assert own.predict.twin.timestep_s == 0.0
    assert "s of a processor." in str(longer.notes[0])


@pytest.mark.parametrize(("lengths_s", "enough"), [((4.9,), False), ((5.0,), True), ((2.0, 3.0), True)])
def test_heldout_motion_too_short_for_any_proof_is_said(lengths_s: tuple[float, ...], enough: bool) -> None:
    """As many stretches as are asked for can prove a gain, one fewer cannot."""
    train, heldout = [], []
    for seed, seconds in enumerate((10.0, *lengths_s)):
        inputs = pulled(seed, seconds)
        table = Table(inputs.time_s, dict.fromkeys(COLUMNS, inputs.time_s), f"t{seed}")
        (heldout if seed else train).append(Trial(f"t{seed}", "", inputs, table))
    assert len(too_little(train, heldout, COLUMNS, moving=True)) == (0 if enough else 1)
    stretches = sum(len(equal_stretches(item)) for item in heldout)
    assert (chance_of_gain(np.ones(stretches)) <= GAIN_CHANCE) == enough
