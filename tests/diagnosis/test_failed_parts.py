"""A search is never lost to a defect in what comes after it: both reports say what is missing."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_problem import pulls
from planted import as_inputs, data_set
from test_report import made_up

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis import pictures, pipeline
from catheter_sim.diagnosis import report as html
from catheter_sim.diagnosis import report as write
from catheter_sim.diagnosis.changes import report as since_report
from catheter_sim.diagnosis.changes.compare import Changes
from catheter_sim.diagnosis.choose import Choice, choose_causes, without_explained_faults
from catheter_sim.diagnosis.notes import Attempts
from catheter_sim.diagnosis.pipeline import investigate_prepared, write_diagnosis
from catheter_sim.diagnosis.prepare import (
    DiagnosisRun,
    Prepared,
    calibrate,
    find_data_faults,
    prepare,
    split_problem,
)
from catheter_sim.diagnosis.workers import SERIAL, Workers, map_calls
from catheter_sim.errors import TRACEBACK_VARIABLE, InputError, SimulationDiverged

RUN = DiagnosisRun(SERIAL, lambda line: None)


@pytest.fixture(autouse=True)
def defects_are_told(monkeypatch: pytest.MonkeyPatch, defects_are_raised: None) -> None:
    monkeypatch.delenv(TRACEBACK_VARIABLE)


def broken(*_: object, **__: object) -> None:
    raise ZeroDivisionError("float division by zero")


def test_what_fails_is_named_in_one_sentence() -> None:
    """With the fault; once, however often it fails. What works is returned as it is."""
    attempt = Attempts()
    assert attempt("The replay", lambda: 5, lambda: 0) == 5
    for _ in range(2):
        assert attempt("The next experiment", lambda: 1 // 0, lambda: 7) == 7
    assert attempt("The replay", lambda: diverged(), lambda: 0) == 0
    first, second = (note.text for note in attempt.notes)
    assert first.startswith("The next experiment is missing: the program failed there (ZeroDivisionError")
    assert second.startswith("The replay is missing: the program failed there (SimulationDiverged: row 3")
    assert all("\n" not in text for text in (first, second))


def diverged() -> int:
    raise SimulationDiverged("row 3: not finite")


@pytest.mark.parametrize("error", [InputError("x"), MemoryError(), KeyboardInterrupt()])
def test_what_a_user_or_the_machine_ends_is_raised(error: BaseException) -> None:
    def ends() -> None:
        raise error

    attempt = Attempts()
    with pytest.raises(type(error)):
        attempt("The replay", ends, lambda: None)
    assert attempt.notes == []


def test_whoever_looks_for_a_defect_sees_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(TRACEBACK_VARIABLE, "1")
    with pytest.raises(ZeroDivisionError):
        Attempts()("The replay", broken, lambda: None)


@cache
def chosen() -> tuple[Prepared, Choice]:
    """Return measurements of a worn catheter with the causes that were chosen for them."""
    histories = [
        as_inputs(
            1e-3 * np.outer(2.0 * pulls(loops=4, seed=seed) - 0.5, [1.0, 0.0, 0.0, 0.0]), "displacement"
        )
        for seed in range(3)
    ]
    data = data_set(
        load_robot("mitral_transseptal"),
        "mitral_transseptal",
        {"backlash": {"width_mm": 0.4}},
        histories,
        ("tip_x_mm", "tip_z_mm"),
        solver="pk",
    )
    prepared = prepare(data)
    split = split_problem(prepared)
    before = calibrate(split)
    faults = without_explained_faults(RUN, split, before, find_data_faults(split, before))
    return prepared, choose_causes(RUN, split, faults)


STAGES = {
    "decide_on_heldout": "What the held-out data say of the causes",
    "examine": "On what the error depends",
    "judge": "The judgement of the causes",
    "replay_in_mujoco": "The replay in MuJoCo",
    "prune_again": "The weighing of the causes",
    "score_hypotheses": "How probable each cause is",
    "conclude": "What is said of the causes",
    "plan_next_experiment": "The next experiment",
    "widen_intervals": "How sure the numbers are",
}


@pytest.mark.slow
@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_that_fails_leaves_the_reports(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, stage: str
) -> None:
    """The verdict is the search's, unless a stage that comes to it fails: then nothing is named."""
    prepared, choice = chosen()
    monkeypatch.setattr(pipeline, stage, broken)
    found = investigate_prepared(RUN, prepared, simulation=False, chosen=choice).diagnosis
    write_diagnosis(found, tmp_path)
    document = json.loads((tmp_path / "diagnosis.json").read_text())
    page = (tmp_path / "report.html").read_text()
    said = next(text for text in document["notes"] if "is missing" in text)
    assert said.startswith(f"{STAGES[stage]} is missing: the program failed there (ZeroDivisionError")
    assert "float division by zero" in page
    decisive = stage in ("decide_on_heldout", "judge", "score_hypotheses")
    assert (document["verdict"] == "cause_found") is not decisive
    assert [item["name"] for item in document["causes"]] == ([] if decisive else ["backlash"])
    if stage == "score_hypotheses":  # no probability: what was found corrects the robot without a name
        assert [item["name"] for item in document["corrections"]] == ["backlash"]
    assert document["noise_floor"] > 0.0
    assert document["heldout"]["rmse_before"] > 0.0
    assert {"robot.toml", "model.xml"} <= {path.name for path in tmp_path.iterdir()}


FILES = {
    (write, "robot_toml"): "robot.toml",
    (write, "fit_table"): "fitted_train_a.csv",
    (pipeline, "model_of"): "model.xml",
    (pictures, "figures"): "Every picture",
    (html, "report_html"): "Most of report.html",
    (write, "to_json"): "Most of diagnosis.json",
}


@pytest.mark.slow
@pytest.mark.parametrize(("place", "name"), FILES, ids=[name for _, name in FILES])
def test_a_file_that_fails_leaves_the_others(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, place: object, name: str
) -> None:
    """Verdict and causes are in both reports, and so is the name of what is missing."""
    monkeypatch.setattr(place, name, broken)
    write_diagnosis(made_up(), tmp_path)
    document = json.loads((tmp_path / "diagnosis.json").read_text())
    page = (tmp_path / "report.html").read_text()
    assert document["verdict"] == "cause_found"
    assert document["causes"][0]["name"] == "backlash"
    assert any(text.startswith(f"{FILES[place, name]} is missing") for text in document["notes"])
    assert "backlash" in page
    assert name == "to_json" or "float division by zero" in page
    assert ("headline.png" in {path.name for path in tmp_path.iterdir()}) is (name != "figures")


def test_pictures_are_drawn_here_where_other_processes_are_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    """As often as a lack of memory kills them; what was found is not lost to it."""
    asked: list[Workers] = []

    def killed(place: Workers, *call: Any) -> list[Any]:
        asked.append(place)
        if place.jobs > 1:
            raise InputError("--jobs 2: processes were killed")
        return map_calls(place, *call)

    monkeypatch.setattr(pictures, "map_calls", killed)
    found = pictures.figures(made_up(), Workers(2))
    assert [place.jobs for place in asked] == [2, 1]
    assert [item.name for item in found] == [item.name for item in pictures.figures(made_up())]
    assert all(item.png.startswith(b"\x89PNG") for item in found)


@pytest.mark.slow
def test_a_file_that_cannot_be_written_is_named_and_the_others_are_there(tmp_path: Path) -> None:
    """A folder in the place of model.xml is the user's: one line, after everything else was written."""
    (tmp_path / "model.xml").mkdir()
    with pytest.raises(InputError, match=r"model\.xml"):
        write_diagnosis(made_up(), tmp_path)
    assert json.loads((tmp_path / "diagnosis.json").read_text())["verdict"] == "cause_found"
    assert "backlash" in (tmp_path / "report.html").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["comparison_document", "comparison_sentence", "model_of"])
def test_a_comparison_is_not_lost_either(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str) -> None:
    monkeypatch.setattr(since_report, name, broken)
    since_report.write_comparison(Changes(made_up(), "old", "new", 80, 80), tmp_path)
    document = json.loads((tmp_path / "diagnosis.json").read_text())
    assert document["verdict"] == "changed"
    assert any("is missing" in text for text in document["notes"])
    assert "float division by zero" in (tmp_path / "report.html").read_text()
