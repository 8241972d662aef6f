"""The report as a page: read on a telephone, in words, the simulation's figure first, what to do now."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from page_checks import read_page
from test_report import BLANK, made_up, trial_fit

from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.pictures import paths_figure, shown_planes, shown_points
from catheter_sim.diagnosis.report import report_html
from catheter_sim.diagnosis.result import Cause, DataFault, DiagnosisResult, FittedParameter, NextExperiment
from catheter_sim.diagnosis.words import (
    bench_rows,
    figure_words,
    headline_numbers,
    number_words,
    spoken,
)
from catheter_sim.effects import EFFECTS
from catheter_sim.pictures.curves import png_of
from catheter_sim.tables import Table

SIMULATED = {"heldout_simulation_rmse_after_mm": 0.93, "heldout_simulation_minus_twin_rms_mm": 0.1}
NOTES = (
    Note("number_at_bound", "coupling.base_to_tip is at its bound, where its interval ends."),
    Note("frozen", "trial_05.csv: body_6_z_mm repeats 24.6024 from row 23 to 31. Is it a frozen sensor?"),
    Note("harm", "raises the held-out error of tip_x_mm from 0.127 to 1.05 mm (displacement_bending_mm)."),
)


def verdicts() -> list[DiagnosisResult]:
    """Return a diagnosis of every verdict, its texts full of keys."""
    gain = Cause(
        "actuation_gain",
        {"scale_bending_distal": FittedParameter(1.1, (1.0, 1.2), 1.0)},
        3.0,
        plausible=False,
    )
    common = {
        "notes": NOTES,
        "absorbs": (gain,),
        "extra": SIMULATED,
        "calibrated": {
            name: FittedParameter(1.0, (0.9, 1.1), 1.0) for name in ("moment_arm", "frame_shift_z_mm")
        },
    }
    fault = DataFault("tip_x_mm and body_6_x_mm do not follow the inputs", "tip_x_mm, tip_y_mm")
    return [
        made_up(**common),
        made_up("unexplained", **common),
        made_up("no_discrepancy", next_experiment=NextExperiment("Nothing more."), **common),
        made_up("data_suspect", data_faults=(fault,), **common),
    ]


@pytest.mark.slow
@pytest.mark.parametrize("diagnosis", verdicts(), ids=lambda item: item.verdict)
def test_the_page_is_read_on_a_telephone_and_holds_no_raw_key(diagnosis: DiagnosisResult) -> None:
    """Viewport, nothing wider than 390 px, tables in boxes that scroll, pictures with words, no keys."""
    page = read_page(report_html(diagnosis, BLANK))
    assert page.problems == []
    assert "coupling, base to tip is at its bound" in page.seen
    assert "held-out error of tip x from 0.127 to 1.05 mm (displacement bending)" in page.seen


def test_the_simulations_figure_is_the_headline_with_the_fast_models_beside_it() -> None:
    """In the order in which they are read; without a simulation the page says that it was not run."""
    numbers = headline_numbers(made_up(extra=SIMULATED))
    assert [item["value"] for item in numbers] == ["0.93 mm", "0.90 mm", "6.10 mm", "0.050 mm", "85.3 %"]
    assert "simulation (MuJoCo)" in numbers[0]["words"]
    assert "fast model" in numbers[1]["words"]
    assert [item["look"] == "first" for item in numbers] == [True, False, False, False, False]
    numbers = headline_numbers(made_up())
    assert numbers[0]["value"] == "0.90 mm"
    assert "MuJoCo was not run" in numbers[0]["words"]
    numbers = headline_numbers(made_up("unexplained", extra=SIMULATED))
    assert [item["value"] for item in numbers] == ["0.93 mm", "6.10 mm", "0.050 mm"]


def test_what_a_minute_shows_comes_before_what_is_folded() -> None:
    """Sentence, figures, picture, cause, what to do, ranking and doubts stand open, the rest is folded."""
    html = report_html(made_up(extra=SIMULATED), BLANK)
    open_part, folded = html.split("<details>", 1)
    order = ["<h1>", "0.93 mm", "<img", "What is wrong", "What to do now", "What was tried", "Doubts"]
    places = [open_part.index(item) for item in order]
    assert places == sorted(places)
    words = read_page(html).seen
    assert len(words[: words.index("The evidence")].split()) < 700  # some three minutes if read word by word
    assert "How large the error is" in folded
    assert html.count("<details>") == html.count("</details>") == html.count("<summary>")


def test_what_to_do_names_the_checks_of_the_causes_and_of_their_rivals() -> None:
    """Those named first, then what may stand in their place; nothing is mended where the model agrees."""
    names = [row["name"] for row in bench_rows(made_up())]
    assert names == ["backlash", "tendon friction", "stiffness", "actuation gain"]
    loose = made_up("unexplained", indistinguishable=())
    assert [row["name"] for row in bench_rows(loose)] == ["backlash", "tendon friction", "stiffness"]
    assert bench_rows(made_up("no_discrepancy", indistinguishable=())) == []
    assert bench_rows(made_up("data_suspect", indistinguishable=())) == []


@pytest.mark.parametrize("name", EFFECTS)
def test_every_cause_says_what_to_look_at_on_the_robot(name: str) -> None:
    """In whole sentences, without a key; it says what to do, not what the model does."""
    words = EFFECTS[name].bench
    assert words.endswith((".", "?"))
    assert len(words.split()) > 12
    assert not re.search(r"\w_\w", words)


def test_keys_are_said_in_words() -> None:
    """Numbers of causes, figures and keys inside sentences; the key stays in the title; markup is escaped."""
    assert number_words("scale_bending_distal") == ("factor of bending distal", "")
    assert number_words("width_mm") == ("width", "mm")
    assert number_words("curvature_tip_x_per_m") == ("curvature, tip x", "1/m")
    assert number_words("frame_shift_z_mm") == ("tracker's frame, shift along z", "mm")
    assert figure_words("heldout_simulation_rmse_after_mm") == (
        "MuJoCo, after: error of each output, RMS",
        "mm",
    )
    text, unit = figure_words("heldout_tip_distance_rmse_aligned_after_mm_as_chosen_in_training")
    assert text.startswith("fast model, after: tip error in space, RMS, without its mean offset")
    assert (text.endswith("chosen in training"), unit) == (True, "mm")
    said = spoken("<b> backlash.width_mm, a_b/c_1.csv and 0.5 N/mm, i.e. 3.17.0.")
    assert said == (
        '&lt;b&gt; <span title="backlash.width_mm">backlash, width</span>, <code>a_b/c_1.csv</code> and '
        "0.5 N/mm, i.e. 3.17.0."
    )


@pytest.mark.slow
def test_paths_are_drawn_where_points_move() -> None:
    """Of a plane motion one plane, of one in space two; up to three points, the farthest last; one scale."""
    _, fit = trial_fit("b.csv", "heldout", 1.0)
    assert shown_points(list(fit.measured.columns)) == ["tip"]
    assert shown_planes(fit, ["tip"]) == [("x", "z"), ("x", "y")]
    flat = {**fit.measured.columns, "tip_y_mm": 0.0 * fit.time_s}
    plane = replace(fit, measured=Table(fit.time_s, flat))
    assert shown_planes(plane, ["tip"]) == [("x", "z")]
    figure = paths_figure(plane)
    assert figure is not None
    png_of(figure)  # the layout is made as it is drawn
    (axes,) = figure.axes
    low, high = (axes.transData.transform((at, at)) for at in (0.0, 10.0))
    assert np.ptp([low[0], high[0]]) == pytest.approx(np.ptp([low[1], high[1]]))
    drawn = [line for line in axes.lines if line.get_label() == "measured"]
    np.testing.assert_allclose(drawn[0].get_xdata(), np.delete(flat["tip_x_mm"], 5))
    still = {name: np.zeros_like(fit.time_s) for name in fit.measured.columns}
    assert paths_figure(replace(fit, measured=Table(fit.time_s, still))) is None
    angles = Table(fit.time_s, {"joint_x1_deg": fit.measured.columns["joint_x1_deg"]})
    assert paths_figure(replace(fit, measured=angles)) is None
    many = [f"body_{k}_{axis}_mm" for k in range(1, 10) for axis in "xz"]
    assert shown_points(many) == ["body_3", "body_6", "body_9"]


def test_rows_that_leap_are_places_and_rows_that_go_on_are_a_path() -> None:
    """Between postures that are taken in random order no line is drawn."""
    _, fit = trial_fit("b.csv", "heldout", 0.1)
    order = np.random.default_rng(1).permutation(len(fit.time_s))
    mixed = [
        Table(fit.time_s, {name: values[order] for name, values in table.columns.items()})
        for table in (fit.measured, fit.before, fit.after)
    ]
    for item, style in (
        (fit, "-"),
        (replace(fit, measured=mixed[0], before=mixed[1], after=mixed[2]), "None"),
    ):
        figure = paths_figure(item)
        assert figure is not None
        (line,) = [line for line in figure.axes[0].lines if str(line.get_label()).startswith("after")]
        assert line.get_linestyle() == style
