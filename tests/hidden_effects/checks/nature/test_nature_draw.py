"""A draw made whole: what decides it, what lies where, and how it is run again."""

from __future__ import annotations

import json
import pickle
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.errors import InputError
from catheter_sim.lab import specimen
from catheter_sim.lab.engine import LARGEST, SMALLEST, Ground, Planted, rms
from catheter_sim.lab.forms import BY_KEY
from hidden_effects import interventions, natural
from hidden_effects.natural import generator_of
from hidden_effects.running import ANSWER, Folders, read_json

ROBOTS = ("mitral_transseptal",)
SEED = 3
SINGLE, NOTHING = (
    next(index for index in range(45) if natural.story_of("tune", SEED, index) == story)
    for story in ("single", "none")
)


@pytest.fixture(scope="module", autouse=True)
def few_rows():
    """Trials of some nine rows."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(specimen, "_MANY_ROWS", 60.0)
        patch.setattr(specimen, "_SPREAD", 0.0)
        yield


@pytest.fixture(scope="module")
def drawn(few_rows, tmp_path_factory) -> Path:
    """Return a bench's folder in which the draw is made."""
    root = tmp_path_factory.mktemp("made")
    natural.made(natural.STEPS, natural.Draw("tune", SEED, NOTHING, root, ROBOTS))
    return root


@pytest.fixture
def root(drawn, tmp_path) -> Path:
    """Return a copy of it."""
    return shutil.copytree(drawn, tmp_path / "bench")


def says(verdict: str, *names: str):
    """Return a diagnosis that says this, and looks at nothing but the data set's folder."""

    def diagnose(dataset: Path, output: Path, limit_s: float) -> str:
        assert not list(dataset.parent.rglob(ANSWER))
        output.mkdir()
        causes = [{"name": name, "parameters": {}} for name in names]
        document = {"verdict": verdict, "causes": causes, "unit": "mm", "heldout": {"rmse_after": 0.2}}
        (output / "diagnosis.json").write_text(json.dumps(document))
        return ""

    return diagnose


def scored(root: Path, index: int, diagnose) -> dict:
    """Return the score of a draw."""
    return natural.scored_draw(
        natural.STEPS, natural.Draw("tune", SEED, index, root, ROBOTS), 900.0, diagnose
    )


@pytest.mark.slow
def test_seed_and_number_decide_everything(drawn, tmp_path):
    """Made again, a data set is the same to the last digit, and so is the answer."""
    natural.made(natural.STEPS, natural.Draw("tune", SEED, NOTHING, tmp_path, ROBOTS))
    one, other = Folders(drawn, NOTHING), Folders(tmp_path, NOTHING)
    for path in sorted(one.data.iterdir()):
        assert path.read_bytes() == (other.data / path.name).read_bytes()
    first, again = (read_json(place.answer / ANSWER) for place in (one, other))
    assert first | {"seconds_to_make": 0.0} == again | {"seconds_to_make": 0.0}


def test_purpose_seed_number_and_attempt_draw_otherwise():
    """Each of them changes what is drawn."""
    keys = [("tune", 1, 2, 0), ("judge", 1, 2, 0), ("tune", 2, 2, 0), ("tune", 1, 3, 0), ("tune", 1, 2, 1)]
    assert len({generator_of(*key).random() for key in keys}) == len(keys)


@pytest.mark.slow
def test_draw_is_a_data_set_and_an_answer(tmp_path):
    """The data set is one that the package reads; nothing in it says what is hidden; sizes are as asked."""
    score = scored(tmp_path, SINGLE, says("unexplained"))
    folders = Folders(tmp_path, SINGLE)
    dataset = load_dataset(folders.data)
    answer = read_json(folders.answer / ANSWER)
    (hidden,) = answer["hidden"]
    assert SMALLEST <= hidden["over_noise"] <= LARGEST
    text = "".join(path.read_text() for path in folders.data.iterdir())
    assert hidden["cause"] not in text
    assert "nature" not in text
    assert [trial.inputs.tendon[0].any() for trial in dataset.trials] == [False] * 7
    assert dataset.trials[0].inputs.tendon.tolist() == dataset.trials[4].inputs.tendon.tolist()
    assert tomllib.loads((folders.data / "dataset.toml").read_text())["dataset"]["name"] == folders.name
    assert (score["true"], score["seed"], score["purpose"]) == ([hidden["cause"]], SEED, "tune")


def test_only_draws_of_this_code_count(root, monkeypatch):
    """What other code has scored is diagnosed again, on the same data; what this one has is not."""
    first = scored(root, NOTHING, says("unexplained"))
    assert scored(root, NOTHING, says("no_discrepancy")) == first
    data = (Folders(root, NOTHING).data / "trial_01.csv").stat().st_mtime_ns
    monkeypatch.setattr(natural, "judging_code", lambda: "another")
    assert natural.scores_in(root) == []
    second = scored(root, NOTHING, says("no_discrepancy"))
    assert (second["verdict"], second["code"]) == ("no_discrepancy", "another")
    assert natural.scores_in(root) == [second]
    assert (Folders(root, NOTHING).data / "trial_01.csv").stat().st_mtime_ns == data


def test_code_that_changes_under_a_diagnosis_does_not_count(root, monkeypatch):
    """Its draw belongs to neither."""
    digests = iter(["before", "after"])
    monkeypatch.setattr(natural, "judging_code", lambda: next(digests))
    found = scored(root, NOTHING, says("unexplained"))
    assert found["code"] == natural.CHANGED


@pytest.mark.parametrize("steps", [natural.STEPS, interventions.STEPS])
def test_a_bench_s_steps_go_to_other_processes(steps):
    """Draws are scored several at a time."""
    assert pickle.loads(pickle.dumps(steps)) == steps


def test_folder_of_another_purpose_is_refused(tmp_path):
    """Draws for tuning and for judging do not mix."""
    natural.run_bench("tune", 1, (), tmp_path)
    with pytest.raises(InputError, match="another folder"):
        natural.run_bench("judge", 1, (), tmp_path)


def test_calibration_takes_what_it_can(pulled_ground):
    """What an uncertain number does within its range leaves nothing; thirty times that stays nearly whole."""
    generator = np.random.default_rng(4)
    ground = Ground(pulled_ground.specimen, pulled_ground.courses)
    ground.__dict__["calibrations"] = calibrations = generator.normal(size=(40, 3))
    assert rms(ground.left(0.01 * calibrations[:, 0])) < 1e-6
    beyond = 30.0 * calibrations[:, 0]
    assert rms(ground.left(beyond)) > 0.9 * rms(beyond)
    assert rms(ground.left(beyond, [beyond])) < 1e-6


@pytest.mark.slow
def test_effect_leaves_nothing_beside_itself(plain_ground):
    """With its own change free, a form's change is explained; with another's, it is not."""
    gain, frame = (
        plain_ground.change(Planted(BY_KEY[key], 8.0, numbers))
        for key, numbers in (
            ("actuation_gain.common", {}),
            ("measurement_frame.rigid", {"shift": {"x": 1.0}, "turn": {"z": 0.5}}),
        )
    )
    assert rms(plain_ground.left(gain, [gain])) < 1e-6 * rms(gain)
    assert rms(plain_ground.left(gain, [frame])) > 0.3 * rms(gain)
