"""Data of the bench: made by another solver, of the size that they claim, without the answer in them."""

from __future__ import annotations

import filecmp
import tomllib

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.trials import measured_of
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import with_effects
from catheter_sim.lab.robots import BENCH_ROBOTS
from hidden_effects import first_draws
from hidden_effects.first_draws import (
    GAP_SHARE,
    OUTSIDE,
    TRUTH,
    CannotMake,
    make,
    read_aside,
    rms,
    robot_as_written,
    robot_of,
    setting_of,
    simulated,
    story_of,
    truth,
    twin_of,
    write_draw,
)
from hidden_effects.running import ANSWER, Folders, read_json

pytestmark = pytest.mark.slow

ROBOT = ("mitral_transseptal",)  # quick to simulate
SEED = 1
SINGLE = next(index for index in range(20) if story_of(SEED, index) == "single")


def few_trials(patch: pytest.MonkeyPatch) -> None:
    """Make data sets of three trials, one of them held out, and a third set of one."""
    for name in ("TRAINING", "HELDOUT", "ASIDE"):
        patch.setattr(first_draws, name, 1)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Return a draw with one effect and few trials, and where it was written."""
    with pytest.MonkeyPatch.context() as patch:
        few_trials(patch)
        made = make(SEED, SINGLE, ROBOT)
    folders = Folders(tmp_path_factory.mktemp("bench"), SINGLE)
    write_draw(made, folders)
    return made, folders


def test_draw_is_decided_by_seed_and_number(written, tmp_path, monkeypatch):
    """Made again, every file of the data set and of the answer is the same to the byte."""
    _, folders = written
    again = Folders(tmp_path, SINGLE)
    few_trials(monkeypatch)
    write_draw(make(SEED, SINGLE, ROBOT), again)
    for one, other in ((folders.data, again.data), (folders.answer, again.answer)):
        names = sorted(path.name for path in one.iterdir())
        assert names == sorted(path.name for path in other.iterdir())
        assert filecmp.cmpfiles(one, other, names, shallow=False)[0] == names


def test_size_is_what_the_answer_says(written):
    """The written true robot, simulated with its effects and without, differs by the stated size."""
    made, folders = written
    answer = read_json(folders.answer / ANSWER)
    assert 5.0 <= answer["simulated_size_over_noise"] <= 30.0
    true = robot_as_written(folders.answer / TRUTH)
    dataset = load_dataset(folders.data)
    noise = np.array([answer["noise"][name.rsplit("_", 1)[-1]] for name in dataset.output_channels])
    changes = []
    for trial in dataset.trials:
        with_it, without = (
            simulated(made.setting.bench, robot, trial.inputs, dataset.gravity_mps2).columns(
                dataset.output_channels
            )
            for robot in (true, with_effects(true, {}))
        )
        changes.append((with_it - without) / noise)
        left = measured_of(trial, dataset.output_channels) - with_it
        assert np.nanstd(left / noise) == pytest.approx(1.0, abs=0.15)
    assert rms(np.concatenate(changes)) == pytest.approx(answer["simulated_size_over_noise"], rel=1e-3)


def test_data_set_does_not_hold_the_answer(written):
    """The data set names no effect and no cause, and has nothing but its table and its trials."""
    _, folders = written
    names = sorted(path.name for path in folders.data.iterdir())
    assert names == ["dataset.toml", *(f"trial_{number:02d}.csv" for number in range(1, 4))]
    text = "".join(path.read_text() for path in folders.data.iterdir())
    for word in (*EFFECTS, *OUTSIDE, "noise", "effects"):
        assert word not in text
    dataset = load_dataset(folders.data)
    assert dataset.robot == load_robot("mitral_transseptal")
    document = tomllib.loads((folders.data / "dataset.toml").read_text())
    assert document["dataset"]["name"] == folders.name


def test_third_set_is_kept_from_the_data_set(written):
    """The third set lies with the answer, has the same outputs, and is no trial of the data set."""
    _, folders = written
    dataset = load_dataset(folders.data)
    aside = read_aside(folders, dataset.output_channels)
    assert len(aside) == 1
    for trial in aside:
        assert set(trial.outputs.columns) == set(dataset.output_channels)
        assert not any(np.array_equal(trial.inputs.tendon, item.inputs.tendon) for item in dataset.trials)


@pytest.mark.parametrize(
    ("effects", "shown"),
    [
        ({"tendon_elongation": {"stiffness_N_per_mm": 7.0}, "stiffness": {"scale": 2.0}}, False),
        ({"tendon_elongation": {"stiffness_N_per_mm": 7.0}, "backlash": {"width_mm": 0.3}}, True),
    ],
    ids=["tendons over springs", "tendons and a dead-band"],
)
def test_pair_that_one_alone_explains_is_refused(effects, shown):
    """Of the catheter's springs and tendons only the ratio of the stiffnesses shows: that is no pair."""
    setting = setting_of((1, 0, 0), "mitral_transseptal", False)
    if shown:
        first_draws._require_all_shown(setting, effects)
    else:
        with pytest.raises(CannotMake, match="alone does the same"):
            first_draws._require_all_shown(setting, effects)


@pytest.mark.parametrize(("scale", "shown"), [(0.99, False), (0.85, True)])
def test_effect_that_a_calibration_does_as_well_is_refused(scale, shown):
    """A scale of the inputs within the range of the rods' stiffness is no discrepancy; one beyond it is."""
    setting = setting_of((1, 0, 0), "chest_tube_section", False)
    effects = {"actuation_gain": {"scale": scale}}
    if shown:
        first_draws._require_all_shown(setting, effects)
    else:
        with pytest.raises(CannotMake, match="calibrated numbers do the same"):
            first_draws._require_all_shown(setting, effects)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.long] if name == "chest_tube_section@prototype" else [])
        for name in BENCH_ROBOTS
        if name != "neuroendoscope"
    ],
)
def test_other_solver_agrees_with_the_twin(name):
    """With every effect off, the simulation that makes the data and the twin that fits them differ by less
    than a third of the noise that the bench draws at least (0.05 mm, 0.1 deg), or by so much that the bench
    gives such data more noise."""
    least = {"mm": 0.05, "deg": 0.1}
    setting = setting_of((1, 0, 0), name, False)
    trials = setting.trials[:1]
    robot = truth(setting, {})
    apart = np.concatenate(
        [
            simulated(setting.bench, robot, inputs, setting.gravity_mps2).columns(setting.columns) - twin
            for inputs, twin in zip(trials, twin_of(setting, robot, trials), strict=True)
        ]
    )
    assert apart.any()  # another solver
    for unit in ("mm", "deg"):
        mine = [column.endswith(unit) for column in setting.columns]
        if any(mine):
            assert rms(apart[:, mine]) < GAP_SHARE * (COARSE.get(name) or least[unit])


COARSE = {"file_displacement": 0.15, "file_tension": 0.15}  # arcs against chains of few links


def test_robots_of_a_seed_are_dealt():
    """A bench of one robot has no other."""
    assert {robot_of(SEED, index, ROBOT) for index in range(5)} == set(ROBOT)
