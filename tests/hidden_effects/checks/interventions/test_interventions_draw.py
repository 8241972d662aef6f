"""Two recordings of one specimen: what is shared, what changes, and that nothing else differs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.errors import InputError
from catheter_sim.lab import specimen
from catheter_sim.lab.engine import Planted
from catheter_sim.lab.forms import BY_KEY
from hidden_effects import interventions
from hidden_effects.interventions import NEW, OLD, Recordings, drawn_recordings, make
from hidden_effects.natural import Draw, scored_draw
from hidden_effects.planting import clean_outputs
from hidden_effects.running import ANSWER, Folders, read_json

ROBOTS = ("mitral_transseptal",)


@pytest.fixture(scope="module", autouse=True)
def few_rows():
    """Trials of some nine rows."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(specimen, "_MANY_ROWS", 60.0)
        patch.setattr(specimen, "_SPREAD", 0.0)
        yield


def first_draw(**asked: object) -> int:
    """Return the first draw of seed 3 that is dealt so."""
    dealers = {
        "story": interventions.story_of,
        "commands": interventions.commands_of,
        "shares": interventions.shares_unknown,
    }
    return next(
        index
        for index in range(1000)
        if all(dealers[name]("tune", 3, index) == value for name, value in asked.items())
    )


def says(verdict: str, *changes: str):
    """Return a comparison that says this."""

    def compare(dataset: Path, output: Path, limit_s: float) -> str:
        assert sorted(path.name for path in dataset.iterdir()) == [NEW, OLD]
        output.mkdir()
        named = [{"name": name, "parameters": {}} for name in changes]
        document = {"verdict": verdict, "causes": [], "changes": named, "unit": "mm"}
        (output / "diagnosis.json").write_text(json.dumps(document))
        return ""

    return compare


def test_shares_are_as_said() -> None:
    """Of 200 draws of any seed: one thing changes in 100, two in 20, nothing in 80; half hide something."""
    stories = [interventions.story_of("judge", 9, index) for index in range(200)]
    assert [stories.count(story) for story in ("single", "pair", "none")] == [100, 20, 80]
    commands = [interventions.commands_of("judge", 9, index) for index in range(200)]
    assert [commands.count(name) for name in ("same", "partly", "other")] == [70, 70, 60]
    assert sum(interventions.shares_unknown("judge", 9, index) for index in range(200)) == 100


@pytest.mark.parametrize(("commands", "least", "most"), [("same", 7, 7), ("partly", 1, 6), ("other", 0, 0)])
def test_commands_are_shared_as_said(commands: str, least: int, most: int) -> None:
    """As many trials as asked have the earlier recording's commands, and held-out ones learned channels."""
    for seed in range(5):
        made = drawn_recordings(np.random.default_rng(seed), "mitral_transseptal", commands)
        pairs = zip(made.before.courses, made.courses, strict=True)
        same = sum(np.array_equal(old.commands, new.commands) for old, new in pairs)
        assert least <= same <= most
        moved = np.array([course.commands.any(axis=0) for course in made.courses])
        assert not (moved[5:].any(axis=0) & ~moved[:5].any(axis=0)).any()


@pytest.mark.slow
def test_what_both_hide_is_one_law() -> None:
    """A form whose numbers follow what is large in a data set does the same in both recordings, also where
    the later one goes less far."""
    first = drawn_recordings(np.random.default_rng(5), "mitral_transseptal", "same").before
    furthest = max(range(4), key=lambda number: first.plain[number].p[:, -1, 0].max())
    later = tuple(
        replace(course, commands=0.2 * course.commands) if number == furthest else course
        for number, course in enumerate(first.courses)
    )
    made = Recordings(first, later)
    hidden = Planted(BY_KEY["obstacle.outside"], 30.0, {"axis": "x", "sign": 1.0, "at": 0.02})
    old, new, plain = (
        clean_outputs(ground, planted)
        for ground, planted in ((first, [hidden]), (made.after, [hidden]), (first, []))
    )
    others = [number for number in range(len(later)) if number != furthest]
    for number in others:
        np.testing.assert_array_equal(old[number], new[number])
    assert max(np.abs(old[number] - plain[number]).max() for number in others) > 0.1


@pytest.mark.slow
def test_draw_is_two_data_sets_and_an_answer(tmp_path: Path) -> None:
    """Both are read by the package; nothing in them says what changed; the change is as large as asked."""
    index = first_draw(story="single", commands="other", shares=True)
    score = scored_draw(
        interventions.STEPS, Draw("tune", 3, index, tmp_path, ROBOTS), 900.0, says("changed", "no_such")
    )
    folders = Folders(tmp_path, index)
    old, new = (load_dataset(folders.data / name) for name in (OLD, NEW))
    answer = read_json(folders.answer / ANSWER)
    (change,) = answer["hidden"]
    assert 5.0 <= change["over_noise"] <= 30.0
    assert len(answer["shared"]) == 1
    assert not answer["shared"][0]["known"]
    assert old.output_channels == new.output_channels
    text = "".join(path.read_text() for path in folders.data.rglob("*.*"))
    assert change["cause"] not in text
    assert score["true"] == [change["cause"]]
    assert not score["right"]


@pytest.mark.long
def test_nothing_changed_differs_by_noise_alone(tmp_path: Path) -> None:
    """With the same commands and nothing changed the two recordings differ by the root of two noises."""
    index = first_draw(story="none", commands="same", shares=True)
    score = scored_draw(
        interventions.STEPS, Draw("tune", 3, index, tmp_path, ROBOTS), 900.0, says("changed", "stiffness")
    )
    folders = Folders(tmp_path, index)
    noise = read_json(folders.answer / ANSWER)["noise"]["mm"]
    old, new = (load_dataset(folders.data / name) for name in (OLD, NEW))
    change = [
        two.outputs.columns[name] - one.outputs.columns[name]
        for one, two in zip(old.trials, new.trials, strict=True)
        for name in old.output_channels
        if name.endswith("_mm")
    ]
    size = np.sqrt(np.nanmedian(np.concatenate(change) ** 2)) / 0.6745
    assert 1.1 * noise < size < 1.8 * noise
    assert score["false_alarm"]
    assert not score["right"]


def test_folder_of_other_draws_is_refused(tmp_path: Path) -> None:
    """Draws of another seed do not mix with these."""
    interventions.run_bench("tune", 1, (), tmp_path)
    with pytest.raises(InputError, match="another folder"):
        interventions.run_bench("tune", 2, (), tmp_path)


@pytest.mark.slow
def test_a_bare_draw_hides_nothing_in_both() -> None:
    """The same change of the same size on the same robot, with the same commands and the same noise."""
    index = first_draw(story="single", shares=True)
    whole, bare = (make("tune", 3, index, ROBOTS, bare) for bare in (False, True))
    assert (len(whole.shared), len(bare.shared)) == (1, 0)
    assert whole.attempt == bare.attempt
    (first, size), (second, again) = whole.changed[0], bare.changed[0]
    assert (first.form.key, first.size, first.numbers) == (second.form.key, second.size, second.numbers)
    np.testing.assert_array_equal(size, again)
    assert whole.noise_kind == bare.noise_kind
    assert any(
        not np.array_equal(one, other, equal_nan=True)
        for one, other in zip(whole.outputs[0], bare.outputs[0], strict=True)
    )
    without = clean_outputs(bare.recordings.before, [])
    noise = bare.recordings.before.specimen.noise
    for clean, measured in zip(without, bare.outputs[0], strict=True):
        assert np.nanmedian(np.abs((measured - clean) / noise)) < 2.0


def test_a_control_has_a_folder_of_its_own(tmp_path: Path) -> None:
    """Its draws are not those of the bench, whichever came first."""
    for first in (False, True):
        root = tmp_path / str(first)
        interventions.run_bench("tune", 3, [], root, bare=first)
        with pytest.raises(InputError, match="other"):
            interventions.run_bench("tune", 3, [], root, bare=not first)
