"""Results in a folder: the JSON keeps the contract, the report says what was found and needs no network."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.document import to_json
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.pictures import ReportPicture, figures, shown_columns
from catheter_sim.diagnosis.report import fit_files, report_html, sentence, write_results
from catheter_sim.diagnosis.result import (
    Candidate,
    Cause,
    DataFault,
    DiagnosisResult,
    FittedParameter,
    NextExperiment,
    Remainder,
    TrialFit,
    UnitResult,
)
from catheter_sim.diagnosis.trials import Dataset, Trial
from catheter_sim.diagnosis.words import digits_to_tell, interval, listed, name_and_unit, rounded
from catheter_sim.errors import InputError
from catheter_sim.tables import Table, read_table

BLANK = (ReportPicture("headline", "a picture", b""), ReportPicture("errors", "another picture", b""))
COLUMNS = ("tip_x_mm", "tip_y_mm", "tip_z_mm", "joint_x1_deg")


def trial_fit(file: str, role: str, error_mm: float) -> tuple[Trial, TrialFit]:
    """Return a trial of four loops and its fit, off by `error_mm` before and a tenth of it after."""
    pull = np.tile(np.concatenate([np.linspace(0, 0.4, 10), np.linspace(0.4, 0, 10)]), 4)
    time_s = np.arange(float(len(pull)))
    zeros = np.zeros((len(pull), 3))
    truth = {
        "tip_x_mm": 90 * pull,
        "tip_y_mm": 0 * pull,
        "tip_z_mm": 60 - 50 * pull,
        "joint_x1_deg": 9 * pull,
    }
    measured = {name: values + error_mm * np.sign(np.sin(time_s)) for name, values in truth.items()}
    after = {name: 0.1 * truth[name] + 0.9 * values for name, values in measured.items()}
    measured["tip_x_mm"][5] = np.nan
    inputs = Inputs(time_s, "tension", np.stack([pull, 0 * pull], axis=1), zeros, zeros)
    table = Table(time_s, measured, file)
    return Trial(file, role, inputs, table), TrialFit(
        file, role, time_s, table, Table(time_s, truth), Table(time_s, after)
    )


def made_up(verdict: str = "cause_found", **changes: Any) -> DiagnosisResult:
    """Return a diagnosis whose every figure is made up."""
    train, fit_train = trial_fit("a.csv", "train", 0.8)
    heldout, fit_heldout = trial_fit("b.csv", "heldout", 1.0)
    robot = load_robot("neuroendoscope_section")
    dataset = Dataset(
        folder=Path("loops"),
        name="loops & <knees>",
        robot=robot,
        robot_reference="neuroendoscope_section",
        source="bench 3",
        licence="CC0",
        gravity_mps2=np.zeros(3),
        input_channels=("tension_right_N",),
        output_channels=COLUMNS,
        trials=(train, heldout),
    )
    found = verdict == "cause_found"
    causes = (
        Cause(
            "backlash",
            {"width_mm": FittedParameter(0.4217, (0.401, 0.443), 0.0)},
            80.1,
            "play",
            ("joint_play",),
            probability=0.93,
        ),
        Cause("tendon_friction", {"mu": FittedParameter(0.31, (-0.02, 0.64), 0.0)}, 5.1, probability=0.6),
    )
    result = DiagnosisResult(
        dataset=dataset,
        verdict=verdict,
        unit="mm",
        by_unit={
            "mm": UnitResult("mm", 0.05, 6.104, 0.9, 85.26, (83.0, 87.1)),
            "deg": UnitResult("deg", 0.1, 2.0, 0.5, 75.0, (60.0, 80.0)),
        },
        causes=causes if found else (),
        ranking=(
            Candidate(("backlash", "tendon_friction"), 0.9, 0.88),
            Candidate(("stiffness",), 2.7, float("nan")),
            Candidate((), 6.104, 6.0),
        ),
        indistinguishable=(("stiffness", "actuation_gain"),),
        next_experiment=NextExperiment(
            "Pull slowly & return.", Table(np.arange(3.0), {"tension_right_N": np.array([0.0, 0.3, 0.0])})
        ),
        extended_robot=load_robot("neuroendoscope_section", ["friction.mu=0.31"]),
        fits=(fit_train, fit_heldout),
        notes=(Note("noise", "Noise was estimated from <one> repeat."),),
        extra={"tip_rmse_aligned_after_mm": 0.85},
        absorbs=(
            Cause("stiffness", {"scale": FittedParameter(10.0, (9.0, 10.0), 1.0)}, 2.0, plausible=False),
        ),
        probabilities={"backlash": 0.93, "tendon_friction": 0.6, "twist": 0.01, "none": 0.01, "outside": 0.2},
        residual={"mm": Remainder(18.0, ("direction",)), "deg": Remainder(1.0, ())},
    )
    return replace(result, **changes)


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (("a/t.csv", "b/t.csv"), ("a_t", "b_t")),
        (("t.csv", "a/t.csv", "a_t.csv"), ("t", "a_t", "a_t_2")),
        (("t.csv", "T.csv", "t.dat", "t_2.csv"), ("t", "T_2", "t_3", "t_2_2")),
        (("../a/t.csv", "/a/t.csv"), ("a_t", "a_t_2")),
        (("x" * 300 + "/t.csv",), ("x" * 198 + "_t",)),
    ],
)
def test_no_two_trials_share_a_file(files: tuple[str, ...], names: tuple[str, ...]) -> None:
    """A trial's folders stand in the name of its series; what would still be alike is numbered."""
    fits = [trial_fit(file, "train", 1.0)[1] for file in files]
    assert fit_files(fits) == tuple(f"fitted_train_{name}.csv" for name in names)


@pytest.mark.slow
def test_two_trials_of_one_name_keep_their_series(tmp_path: Path) -> None:
    """Two trials of one name in two folders have two files; the report lists both."""
    made = [trial_fit(file, "heldout", size) for file, size in (("a/t.csv", 1.0), ("b/t.csv", 2.0))]
    trials, fits = zip(*made, strict=True)
    plain = made_up()
    diagnosis = replace(plain, fits=fits, dataset=replace(plain.dataset, trials=trials))
    write_results(diagnosis, tmp_path, "<mujoco/>")
    page = report_html(diagnosis, BLANK)
    for fit, name in zip(fits, ("fitted_heldout_a_t.csv", "fitted_heldout_b_t.csv"), strict=True):
        series = read_table(tmp_path / name).columns["tip_x_mm"]
        np.testing.assert_allclose(series, fit.measured.columns["tip_x_mm"], rtol=1e-8)
        assert name in page
    assert len(list(tmp_path.glob("fitted_*"))) == 2


def test_json_keeps_the_contract() -> None:
    """Every key of the contract is there with its type; further keys are allowed."""
    document = to_json(made_up())
    assert document["dataset"] == "loops & <knees>"
    assert document["robot"] == "neuroendoscope_section"
    assert document["unit"] == "mm"
    assert document["verdict"] == "cause_found"
    assert document["noise_floor"] == 0.05
    assert document["heldout"] == {
        "rmse_before": 6.104,
        "rmse_after": 0.9,
        "gain_percent": 85.26,
        "gain_percent_ci95": [83.0, 87.1],
    }
    assert document["causes"][0] == {
        "name": "backlash",
        "parameters": {"width_mm": {"value": 0.4217, "ci95": [0.401, 0.443]}},
        "gain_percent": 80.1,
        "form": "play",
        "forms_as_good": ["joint_play"],
        "probability": 0.93,
        "plausible": True,
    }
    assert [(cause["name"], cause["plausible"]) for cause in document["absorbs"]] == [("stiffness", False)]
    assert document["probabilities"]["outside"] == 0.2
    assert document["residual"]["mm"] == {"times_noise": 18.0, "of": "held-out", "structure": ["direction"]}
    assert document["ranking"][0]["causes"] == ["backlash", "tendon_friction"]
    assert document["ranking"][0]["heldout_rmse"] == 0.9
    assert document["indistinguishable"] == [["stiffness", "actuation_gain"]]
    assert document["next_experiment"] == "Pull slowly & return."
    assert set(document["by_unit"]) == {"mm", "deg"}
    assert document["by_unit"]["mm"]["rmse_after"] == document["heldout"]["rmse_after"]


def test_undefined_numbers_are_null_with_a_reason() -> None:
    """What is not finite is null, and the document says which and why; the text is strict JSON."""
    document = to_json(made_up())
    assert document["ranking"][1]["cross_validated_rmse"] is None
    assert list(document["undefined"]) == ["absorbs.0.probability", "ranking.1.cross_validated_rmse"]
    open_ended = Cause("axial_compression", {"stiffness_N_per_mm": FittedParameter(9.0, (7.0, np.inf))}, 1.0)
    reasons = to_json(made_up(causes=(open_ended,)))["undefined"]
    assert reasons["causes.0.parameters.stiffness_N_per_mm.ci95.1"].startswith("infinite")
    assert json.loads(json.dumps(document, allow_nan=False)) == document


@pytest.mark.slow
def test_folder_holds_everything(tmp_path: Path) -> None:
    """The folder is made; robot, model, series, next inputs, pictures, report and JSON are in it."""
    diagnosis = made_up()
    folder = tmp_path / "new" / "folder"
    written = write_results(diagnosis, folder, "<mujoco/>")
    assert {path.name for path in written} == {path.name for path in folder.iterdir()}
    assert written[-1].name == "diagnosis.json"
    assert json.loads((folder / "diagnosis.json").read_text()) == to_json(diagnosis)
    assert (folder / "model.xml").read_text().endswith("-->\n<mujoco/>")
    assert load_robot(folder / "robot.toml") == diagnosis.extended_robot
    assert read_table(folder / "next_experiment.csv").columns["tension_right_N"].tolist() == [0.0, 0.3, 0.0]
    series = read_table(folder / "fitted_heldout_b.csv").columns
    shown = {f"{prefix}{name}" for prefix in ("", "before_", "after_") for name in COLUMNS}
    commanded = {"input_tension_right_N", "input_tension_left_N"}
    assert series.keys() == shown | commanded
    trial = diagnosis.dataset.trials[1]
    np.testing.assert_allclose(series["input_tension_right_N"], trial.inputs.tendon[:, 0])
    assert np.isnan(series["tip_x_mm"][5])
    residual = series["tip_z_mm"] - series["before_tip_z_mm"]
    assert np.abs(residual[1:]) == pytest.approx(1.0)
    assert (folder / "headline.png").read_bytes().startswith(b"\x89PNG")
    write_results(diagnosis, folder, "<mujoco/>")  # into the folder that exists


@pytest.mark.parametrize("below", ["", "folder"])
def test_folder_that_cannot_be_written(tmp_path: Path, below: str) -> None:
    """A file in the way of the folder ends in one line and stays as it was."""
    obstacle = tmp_path / "results"
    obstacle.write_text("mine")
    with pytest.raises(InputError, match="results") as caught:
        write_results(made_up(), obstacle / below, "<mujoco/>")
    assert "\n" not in str(caught.value)
    assert obstacle.read_text() == "mine"


@pytest.mark.slow
def test_report_stands_alone() -> None:
    """Nothing in the report points to another machine, and every picture is inlined."""
    diagnosis = made_up()
    pictures = figures(diagnosis)
    html = report_html(diagnosis, pictures)
    targets = re.findall(r"(?:src|href)=[\"']([^\"']*)", html)
    assert len(targets) == len(re.findall(r"(?:src|href)\s*=", html))
    assert all(target.startswith("data:image/png;") or target == "next_experiment.csv" for target in targets)
    assert not re.search(r"https?:|@import|url\(", html)
    assert html.count("data:image/png;base64,") == len(pictures) == 8
    assert [picture.name for picture in pictures[:3]] == ["paths", "headline", "errors"]


def test_report_escapes_what_it_is_given() -> None:
    """Names and notes appear as they were written, never as markup."""
    html = report_html(made_up(), BLANK)
    assert "loops &amp; &lt;knees&gt;" in html
    assert "from &lt;one&gt; repeat" in html
    assert "<knees>" not in html


def test_report_of_a_cause() -> None:
    """The cause, its value and interval, its doubt, the ranking and the groups are all there."""
    html = " ".join(report_html(made_up(), BLANK).split())
    head = html[html.index("<h1>") :]
    assert "is wrong about backlash and tendon friction." in head[:400]
    assert "85.3 %" in head[: head.index("<h2>")]
    assert "0.422" in html
    assert "0.401 to 0.443" in html
    assert "−0.02 to 0.64 *" in html
    assert "Probability 0.93" in html
    assert "By itself this number is not established" in html
    assert "stiffness or actuation gain" in html
    assert "no effect (model as specified)" in html
    assert "next_experiment.csv" in html
    assert "CC0" in html


@pytest.mark.parametrize(
    ("verdict", "says"),
    [
        ("no_discrepancy", "agrees with these data"),
        (
            "unexplained",
            "the most probable one, backlash, has probability 0.93 and does not pass every check",
        ),
    ],
)
def test_report_without_a_cause(verdict: str, says: str) -> None:
    """Without a cause the report says so, names none and shows the error, not a gain."""
    diagnosis = made_up(
        verdict,
        ranking=(Candidate((), 6.104, 6.0), Candidate(("stiffness",), 7.0, 7.1)),
        indistinguishable=(),
        notes=(),
        next_experiment=NextExperiment("Nothing more is needed."),
    )
    html = " ".join(report_html(diagnosis, BLANK).split())
    assert says in sentence(diagnosis)
    assert "<b>6.10 mm</b>" in html
    assert chosen_rows(html) == ["no effect (model as specified)"]
    assert "85.3" not in html[: html.index("How large")]
    assert "next_experiment.csv" not in html
    assert to_json(diagnosis)["causes"] == []
    assert to_json(diagnosis)["next_experiment_inputs"] is None


def test_tip_comes_before_other_outputs() -> None:
    """The pictures show the tip's outputs of the reported unit, and none that hardly moves."""
    diagnosis = made_up()
    assert shown_columns(diagnosis, diagnosis.fits) == ["tip_x_mm", "tip_y_mm", "tip_z_mm"]
    fit = diagnosis.fits[0]
    still = Table(fit.time_s, {**fit.measured.columns, "tip_y_mm": 0.1 * np.sin(fit.time_s)})
    assert shown_columns(diagnosis, [replace(fit, measured=still)]) == ["tip_x_mm", "tip_z_mm"]
    assert shown_columns(replace(diagnosis, unit="deg"), diagnosis.fits) == ["joint_x1_deg"]


@pytest.mark.parametrize(
    ("value", "uncertainty", "text"),
    [
        (0.42171, 0.021, "0.422"),
        (35.94, 7.0, "35.9"),
        (35.94, 70.0, "36"),
        (-1.314, 0.14, "−1.31"),
        (1234.6, 0.0, "1235"),
        (0.001234, float("nan"), "0.00123"),
        (-0.0001, 0.1, "0.00"),
        (float("nan"), 1.0, "undefined"),
        (float("inf"), 1.0, "∞"),
    ],
)
def test_numbers_are_rounded_to_their_uncertainty(value: float, uncertainty: float, text: str) -> None:
    """Two significant digits of the uncertainty decide, three of the value where there is none."""
    assert rounded(value, uncertainty) == text


def test_numbers_side_by_side_have_the_same_decimals() -> None:
    """Two decimals at least, more where the smallest number needs them to be read."""
    assert digits_to_tell((6.104, 0.9)) == 2
    assert digits_to_tell((0.104, 0.0123)) == 3
    assert digits_to_tell((float("nan"), 0.0)) == 2
    assert sentence(made_up()).endswith("its error on held-out data falls from 6.10 to 0.90 mm.")


def test_words_for_names() -> None:
    """A name that ends in its unit is split into words and unit."""
    assert name_and_unit("width_mm") == ("width", "mm")
    assert name_and_unit("axial_stiffness_N_per_mm") == ("axial stiffness", "N/mm")
    assert name_and_unit("mu") == ("mu", "")
    assert interval(1.0, (0.95, 1.05)) == "0.950 to 1.050"
    assert interval(9.0, (7.0, np.inf)) == "7.00 to ∞"
    assert listed(("a", "b", "c")) == "a, b and c"
    assert listed(()) == ""


def chosen_rows(page: str) -> list[str]:
    """Return the names of the rows of the ranking that are highlighted."""
    return re.findall(
        r'<tr class="chosen"><td>([^<]*) <span class="mark">(?:named|reported)</span></td>', page
    )


@pytest.mark.parametrize("place", [0, 20, 39])
def test_one_set_of_the_ranking_is_highlighted_and_it_is_the_named_one(place: int) -> None:
    """Wherever it stands among forty; and the calibrated model where nothing is named."""
    others = [Candidate((name, "drift"), 1.0 + 0.1 * k, 1.0) for k, name in enumerate(["rate"] * 40)]
    others[place] = Candidate(("tendon_friction", "backlash"), 1.0 + 0.1 * place, 1.0)
    ranking = (*others, Candidate((), 6.104, 6.0))
    page = report_html(made_up(ranking=ranking), BLANK)
    assert chosen_rows(page) == ["tendon friction and backlash"]
    page = report_html(made_up("unexplained", ranking=ranking), BLANK)
    assert chosen_rows(page) == ["no effect (model as specified)"]


def test_the_report_says_how_the_highlighted_set_came_about() -> None:
    """Chosen in training alone, or changed by the held-out data."""
    page = report_html(made_up(chosen_in_training=("tendon_friction", "backlash")), BLANK)
    assert "The held-out error took no part" in page
    page = report_html(made_up(chosen_in_training=("tendon_friction", "backlash", "rate")), BLANK)
    assert "The held-out error took no part" not in page
    assert "Inside the training data tendon friction, backlash and rate was chosen." in page


def test_suspected_data_are_told_in_the_sentence_the_report_and_the_json() -> None:
    """What, where and which rows; no cause, no claim about the model."""
    doubt = DataFault("All positions jump here.", "b.csv", (38, 75))
    diagnosis = made_up("data_suspect", data_faults=(doubt,))
    assert sentence(diagnosis).endswith("so no cause was looked for. b.csv: All positions jump here.")
    page = report_html(diagnosis, BLANK)
    assert "<code>b.csv</code>: All positions jump here. (rows 38 to 75)" in page
    assert "Correct the data where the report says" in page
    document = to_json(diagnosis)
    assert document["verdict"] == "data_suspect"
    assert document["suspicions"] == [
        {"what": "All positions jump here.", "where": "b.csv", "rows": [38, 75]}
    ]
