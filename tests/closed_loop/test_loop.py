"""Claims about the closed loop: it ends when a cause is sure or the budget is spent, and can be resumed."""

from __future__ import annotations

import json
import math
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.closed_loop import loop
from catheter_sim.closed_loop.loop import (
    NO_MORE,
    NOTHING,
    PLAYS,
    SURE,
    WAITING,
    Budget,
    LoopFinding,
    LoopFolder,
    LoopStep,
    Proposed,
    dataset_from,
    plays_of,
    recordings_of,
    run_loop,
    sure_causes,
)
from catheter_sim.closed_loop.story import write_story
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.errors import InputError
from catheter_sim.lab.recorded import RecordedRig
from catheter_sim.lab.rig import Limits
from catheter_sim.lab.simulated import stand_in
from catheter_sim.tables import Table, write_table

ROBOT, COLUMN = "mitral_4dof", "displacement_bending_proximal_mm"
COLUMNS = ("tip_x_mm", "tip_z_mm")


class Bench(RecordedRig):
    """A bench that answers at once: the tip goes with the input."""

    plays = 0

    def read(self, columns=None):
        assert self._played is not None
        name, inputs = self._played
        type(self).plays += 1
        tip = 10.0 * inputs.columns[COLUMN]
        return Table(inputs.time_s, {**inputs.columns, "tip_x_mm": tip, "tip_z_mm": 300.0 - tip}, name)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    Bench.plays = 0
    (tmp_path / "inbox").mkdir()
    limits = Limits({COLUMN: (-1.5, 1.5)}, 600.0)
    return Bench(tmp_path / "inbox", load_robot(ROBOT), ROBOT, COLUMNS, np.zeros(3), limits)


@pytest.fixture
def diagnosed(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Let the diagnosis say of backlash, one after the other, the probabilities in the list returned."""
    said: list[float] = []

    def next_step(rig, kept, steps, budget, *others):
        recordings = kept.recordings()
        dataset_from(rig, recordings, "checked")  # what is recorded is a data set
        probability = said.pop(0)
        found = LoopFinding(
            "cause_found", {"backlash": probability}, "It is play.", ["backlash"][: probability >= 0.95]
        )
        if found.sure:
            return LoopStep(len(recordings), found, None, SURE)
        if loop._spent(steps, budget):
            return LoopStep(len(recordings), found, None, NO_MORE)
        made = sum(step.proposed is not None and step.found is not None for step in steps) + 1
        clock, pull = np.arange(3.0), np.array([0.0, 1.0, 0.0])
        kept.keep_programme(f"experiment_{made}", Table(clock, {COLUMN: pull}))
        return LoopStep(len(recordings), found, Proposed(f"experiment_{made}", "a pull", 0.1))

    monkeypatch.setattr(loop, "_next_step", next_step)
    return said


def test_it_ends_when_a_cause_is_sure(bench, diagnosed, tmp_path) -> None:
    """First data, one experiment, then enough: every play is measured once."""
    diagnosed += [0.5, 0.97]
    found = run_loop(bench, tmp_path / "out")
    assert (found.end, found.causes) == (SURE, ("backlash",))
    assert Bench.plays == 2 * len(PLAYS)
    again = run_loop(bench, tmp_path / "out")
    assert (again.end, again.causes, len(again.steps)) == (SURE, ("backlash",), len(found.steps))
    assert Bench.plays == 2 * len(PLAYS)


def test_it_ends_when_the_budget_is_spent_and_goes_on_with_more(bench, diagnosed, tmp_path) -> None:
    """Started again with a larger budget it makes the experiments that are missing, no more."""
    diagnosed += [0.5, 0.5, 0.5, 0.5, 0.96]
    assert run_loop(bench, tmp_path / "out", budget=Budget(experiments=2)).end == NO_MORE
    assert Bench.plays == 3 * len(PLAYS)
    assert run_loop(bench, tmp_path / "out", budget=Budget(experiments=2)).end == NO_MORE
    assert Bench.plays == 3 * len(PLAYS)
    found = run_loop(bench, tmp_path / "out", budget=Budget(experiments=3))
    assert found.end == SURE
    assert Bench.plays == 4 * len(PLAYS)
    assert [step.recordings for step in found.steps] == [len(PLAYS) * count for count in range(5)]


def test_minutes_are_a_budget_too(bench, diagnosed, tmp_path) -> None:
    """Experiments of a tenth of a minute each: two of them are made."""
    diagnosed += [0.5] * 9
    found = run_loop(bench, tmp_path / "out", budget=Budget(experiments=99, minutes=0.15))
    assert found.end == NO_MORE
    assert Bench.plays == 3 * len(PLAYS)


def test_a_stop_in_the_middle_loses_nothing(bench, diagnosed, tmp_path, monkeypatch) -> None:
    """Interrupted at the third play, the next run makes those that are missing."""
    diagnosed += [0.97]
    read, count = Bench.read, 0

    def stopped(self, columns=None):
        nonlocal count
        count += 1
        if count == 3:
            raise KeyboardInterrupt
        return read(self, columns)

    monkeypatch.setattr(Bench, "read", stopped)
    with pytest.raises(KeyboardInterrupt):
        run_loop(bench, tmp_path / "out")
    assert len(LoopFolder(tmp_path / "out").recordings()) == 2
    assert run_loop(bench, tmp_path / "out").end == SURE
    assert Bench.plays == len(PLAYS)


def test_another_benchs_folder_is_refused(bench, diagnosed, tmp_path) -> None:
    """In one line that names what differs; so is a file that is none."""
    diagnosed += [0.97]
    run_loop(bench, tmp_path / "out")
    with pytest.raises(InputError, match=r"gravity_mps2 is .*: the folder holds another bench's loop"):
        run_loop(replace(bench, gravity_mps2=np.array([0.0, 0.0, 9.81])), tmp_path / "out")
    (tmp_path / "out" / "steps.json").write_text(json.dumps({"steps": [{}]}))
    with pytest.raises(InputError, match=r"steps\.json: is no loop's file"):
        run_loop(bench, tmp_path / "out")


def test_it_waits_for_files_in_whatever_order(bench, diagnosed, tmp_path) -> None:
    """Of a real bench every play is asked for at once; files come shuffled, twice and in halves."""
    diagnosed += [0.97]
    rig = RecordedRig(bench.folder, bench.robot, ROBOT, COLUMNS, np.zeros(3), bench.limits)
    found = run_loop(rig, tmp_path / "out")
    assert found.end == WAITING
    asked = sorted(path.name.removesuffix("_inputs.csv") for path in rig.folder.glob("*_inputs.csv"))
    assert asked == [f"first_{number}" for number in range(1, len(PLAYS) + 1)]
    programme = LoopFolder(tmp_path / "out").programme("first")
    plays = {name: inputs for name, _, inputs in plays_of(programme, rig.robot, "first")}
    texts = {}
    for name, inputs in plays.items():
        bench.play(inputs, name)
        write_table(bench.read(), tmp_path / "one.csv")
        texts[name] = (tmp_path / "one.csv").read_text()
    random.Random(3).shuffle(asked)
    for name in asked:
        assert found.end == WAITING
        (rig.folder / f"{name}.csv").write_text(texts[name][: len(texts[name]) // 2])
        assert run_loop(rig, tmp_path / "out").end == WAITING
        for file in (f"{name}.csv", f"{name} (1).csv"):
            (rig.folder / file).write_text(texts[name])
        found = run_loop(rig, tmp_path / "out")
    assert found.end == SURE
    files = [file for file, _, _ in LoopFolder(tmp_path / "out").recordings()]
    assert sorted(files) == [f"{name}.csv" for name in sorted(asked)]


def test_recordings_are_a_data_set(bench, diagnosed, tmp_path) -> None:
    """What the loop keeps is what `diagnose` takes, and comes back from it."""
    diagnosed += [0.97]
    run_loop(bench, tmp_path / "out")
    kept = LoopFolder(tmp_path / "out")
    dataset = load_dataset(kept.data)
    assert [trial.role for trial in dataset.trials] == [role for _, role in PLAYS]
    for (_, role, table), (_, first_role, first) in zip(
        recordings_of(dataset), sorted(kept.recordings(), key=lambda item: item[1] == "heldout"), strict=True
    ):
        assert role == first_role
        np.testing.assert_allclose(table.columns[COLUMN], first.columns[COLUMN], atol=1e-9)
        np.testing.assert_allclose(table.columns["tip_x_mm"], first.columns["tip_x_mm"])


def test_sure_is_what_stands_at_a_limit() -> None:
    """Causes alone, most believed first; neither "none" nor "outside" is one."""
    assert sure_causes({"backlash": 0.95, "drift": 0.97, "rate": 0.949, "none": 0.99, "outside": 0.99}) == (
        "drift",
        "backlash",
    )


@pytest.mark.slow
def test_a_hidden_cause_is_found_by_itself(tmp_path) -> None:
    """From single pulls that cannot tell a wrong scale from a stretching tendon, to the hidden one."""
    rig = stand_in(ROBOT, ["actuation_gain.channel"], seed=4)
    found = run_loop(rig, tmp_path / "out", budget=Budget(experiments=4))
    write_story(found, rig.robot.name, tmp_path / "out")
    story = (tmp_path / "out" / "story.md").read_text()
    assert (found.end, found.causes) == (SURE, ("actuation_gain",))
    assert "actuation gain" in story.splitlines()[0]
    page = (tmp_path / "out" / "story.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert found.end != NOTHING


def test_an_end_without_bound_is_kept(tmp_path) -> None:
    """JSON has no infinity: the file is strict JSON all the same, and the numbers come back."""
    numbers = [("precurvature", "curvature_x_per_m", 1.5, -math.inf, math.inf)]
    step = LoopStep(
        2, LoopFinding("cause_found", {"precurvature": 0.9}, "words", [], numbers), None, "budget"
    )
    folder = LoopFolder(tmp_path)
    folder.keep([step], {})
    json.loads((tmp_path / "steps.json").read_text(), parse_constant=pytest.fail)
    (again,) = folder.steps({})
    assert again.found.numbers == numbers
