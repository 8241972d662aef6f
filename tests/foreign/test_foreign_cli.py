"""Claims about `catheter-sim diagnose` on somebody's MJCF: files, words, and refusals in one line."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import pytest

from catheter_sim.cli.main import main
from tests.foreign.recorded import text_of, write_dataset

KEYS = {
    "dataset",
    "robot",
    "unit",
    "verdict",
    "noise_floor",
    "heldout",
    "causes",
    "ranking",
    "indistinguishable",
}


@pytest.mark.slow
def test_a_report_has_the_files_and_keys_of_any_other(tmp_path: Path, capsys) -> None:
    folder = write_dataset(tmp_path / "data", command=lambda controls: controls * (1.2, 1.0))
    assert main(["diagnose", str(folder), "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "verdict: cause_found" in said
    assert "scale_one = 1.2" in said
    document = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert set(document) >= KEYS
    assert document["causes"][0]["name"] == "actuation_gain"
    low, high = document["causes"][0]["parameters"]["scale_one"]["ci95"]
    assert low < 1.2 < high
    assert document["heldout"]["gain_percent"] > 90.0
    page = (tmp_path / "out" / "report.html").read_text()
    assert "actuation gain" in page
    assert 'src="data:image/png' in page
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "model.xml"))
    assert model.actuator_gainprm[0, 0] == pytest.approx(1.2 * 40.0, rel=0.01)
    assert (tmp_path / "out" / "fitted_trial_2.csv").is_file()


@pytest.mark.slow
def test_what_nothing_explains_is_said_to_be_soaked_up(tmp_path: Path, capsys) -> None:
    def longer(spec: mujoco.MjSpec) -> None:
        spec.body("lower").pos = [0, 0, -0.33]

    folder = write_dataset(tmp_path / "data", longer)
    assert main(["diagnose", str(folder), "-o", str(tmp_path / "out")]) == 0
    document = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert document["causes"] == []
    assert document["verdict"] == ("improved" if document["corrections"] else "unexplained")
    assert all(item["probability"] < 0.5 for item in (*document["corrections"], *document["absorbs"]))
    assert capsys.readouterr().out.startswith(
        "Corrections improve the model" if document["corrections"] else "The model errs by"
    )


@pytest.mark.parametrize("option", ["--since", "--budget"])
def test_what_other_robots_have_is_refused(option: str, tmp_path: Path, capsys) -> None:
    (tmp_path / "dataset.toml").write_text(text_of())
    value = "60" if option == "--budget" else str(tmp_path)
    assert main(["diagnose", str(tmp_path), "-o", str(tmp_path / "out"), option, value]) == 2
    said = capsys.readouterr().err.strip()
    assert said.endswith(f"{option} is not for robots from somebody's MJCF")
    assert "\n" not in said


def test_a_model_that_is_missing_is_named(tmp_path: Path, capsys) -> None:
    (tmp_path / "dataset.toml").write_text(text_of())
    assert main(["diagnose", str(tmp_path), "-o", str(tmp_path / "out")]) == 2
    assert "two_link.xml: no such file" in capsys.readouterr().err
