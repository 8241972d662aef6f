"""Diagnoses: from Python as from the command line, with and without a folder, and taken up again."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.diagnosis import pipeline, workers
from catheter_sim.diagnosis.trials import Dataset

ROBOT = "mitral_transseptal"


def small_data() -> Dataset:
    """Return three trials of a catheter with a dead-band, seeded noise of 0.05 mm on the tip."""
    time_s, noise = np.arange(24.0), np.random.default_rng(1)
    specimen = cs.load_robot(ROBOT, {"effects.backlash.width_mm": 0.4})
    trials = {}
    for most_mm in (1.8, 2.1, 2.4):
        pull = {"time_s": time_s, "displacement_bending_mm": most_mm * np.sin(0.42 * time_s)}
        seen = cs.statics(specimen, pull, model="pk").to_table(["tip_x_mm", "tip_z_mm"])
        noisy = {name: tip + noise.normal(0.0, 0.05, 24) for name, tip in seen.columns.items()}
        trials[f"bend_{most_mm}"] = pull | noisy
    return cs.dataset(ROBOT, trials, name="bends")


@pytest.fixture(scope="module", autouse=True)
def same_time() -> Iterator[None]:
    """Reports say when they were made: here all at once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", "0")
        yield


@pytest.fixture(scope="module")
def found() -> cs.Diagnosis:
    return cs.diagnose(small_data())


@pytest.mark.slow
def test_planted_cause_is_found_and_told(found: cs.Diagnosis) -> None:
    """The dead-band is named with its width; sentence, table, HTML and document say the same."""
    assert found.verdict == "cause_found"
    (row,) = found.to_table()
    assert (row["cause"], row["parameter"]) == ("backlash", "width_mm")
    assert row["low"] < 0.4 < row["high"]
    assert 0.0 < row["high"] - row["low"] < 0.05
    (cause,) = found.document["causes"]
    assert cause["parameters"]["width_mm"]["value"] == pytest.approx(row["value"], rel=1e-5)
    shown = found._repr_html_()
    assert f"<p>{found.sentence}</p>" in shown
    assert f"<td>{row['value']:.6g}</td>" in shown
    assert repr(found) == "<Diagnosis: cause_found (backlash)>"
    assert found.document["command"] == "cs.diagnose(...)"
    assert found.robot.effects["backlash"]["width_mm"] == pytest.approx(row["value"])


@pytest.mark.slow
def test_plot_shows_the_trial_that_was_held_out(found: cs.Diagnosis) -> None:
    """A panel for each output and one for the error; the first held-out trial unless another is named."""
    figure = found.plot()
    assert [axes.get_ylabel() for axes in figure.axes] == ["tip x [mm]", "tip z [mm]", "error [mm]"]
    heldout = next(fit.file for fit in found.result.fits if fit.role == "heldout")
    assert figure.get_suptitle() == f"{heldout} (heldout)"
    assert found.plot("bend_1.8").get_suptitle() == "bend_1.8 (train)"
    told = r"unknown trial 'bend_9'; choices: bend_1\.8, bend_2\.1, bend_2\.4"
    with pytest.raises(cs.InputError, match=told):
        found.plot("bend_9")


@pytest.mark.long
def test_saved_report_is_that_of_a_diagnosis_with_a_folder(found: cs.Diagnosis, tmp_path: Path) -> None:
    """`save` and `out` write the same files with the same numbers, and nothing unfinished is left."""
    found.save(tmp_path / "saved")
    again = cs.diagnose(small_data(), out=tmp_path / "out", jobs=2)
    names = sorted(path.name for path in (tmp_path / "saved").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "out").iterdir())
    assert {"diagnosis.json", "report.html", "robot.toml", "model.xml"} <= set(names)
    assert len(names) >= 7  # a series for each trial
    for name in ("diagnosis.json", "robot.toml", "model.xml"):
        assert (tmp_path / "saved" / name).read_text() == (tmp_path / "out" / name).read_text()
    written = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert written == json.loads(json.dumps(again.document))
    assert cs.load_robot(tmp_path / "out" / "robot.toml").effects["backlash"]["width_mm"] > 0.39


@pytest.mark.slow
def test_a_stopped_run_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a folder, no fit that was finished before a run was stopped is made again after it."""
    made: list[str] = []
    run = workers._run

    def noted(place: Any, call: Any, arguments: Any, names: list[str], missing: list[int]) -> Any:
        made.extend(names[index] for index in missing)
        return run(place, call, arguments, names, missing)

    def stopped(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(workers, "_run", noted)
    with monkeypatch.context() as patch:
        patch.setattr(pipeline, "replay_in_mujoco", stopped)
        with pytest.raises(KeyboardInterrupt):
            cs.diagnose(small_data(), out=tmp_path)
    before = set(made)
    assert before == {path.name for path in (tmp_path / pipeline.UNFINISHED).iterdir()}
    assert len(before) > 10
    made.clear()
    assert cs.diagnose(small_data(), out=tmp_path).verdict == "cause_found"
    assert before.isdisjoint(made)
    assert not (tmp_path / pipeline.UNFINISHED).exists()
