"""What the report's page is given to move: the series as written, the robot's shape, no more than fits."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from moving_report import GRAVITY, SEVERAL, TIP, moving_diagnosis
from page_checks import read_page
from planted import Effects
from test_report_words import assert_plain, blocks_of

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import posture_columns, read_inputs
from catheter_sim.diagnosis.pictures import figures
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.report import fit_files, report_html, write_results
from catheter_sim.diagnosis.result import DiagnosisResult
from catheter_sim.diagnosis.shapes import (
    MOST_NUMBERS,
    MOST_ON_LINE,
    computed_along,
    in_space,
    words_on_rows,
)
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.effects.apply import in_force
from catheter_sim.tables import Table, read_table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import twin_for

pytestmark = pytest.mark.slow
EXAMPLES = Path(__file__).parents[2] / "assets" / "examples"
MOVED = {"measurement_frame": {"translation_x_mm": 3.0, "rotation_y_deg": 5.0}}


def embedded(html: str) -> dict:
    """Return the data that stand in a page."""
    (text,) = re.findall(r'<script type="application/json" id="in-space">(.*?)</script>', html, re.DOTALL)
    return json.loads(text)


@cache
def plain_page() -> str:
    """Return the page of the tip alone."""
    return page_of(moving_diagnosis())


def page_of(diagnosis: DiagnosisResult) -> str:
    return report_html(diagnosis, figures(diagnosis))


def lines_mm(trial: dict, stage: str) -> np.ndarray:
    """Return the centrelines of a trial's rows, shape (k, p, 3)."""
    steps = np.array(trial["line"][stage], dtype=float)
    return 0.01 * steps.reshape(len(steps), -1, 3).cumsum(axis=1)


@pytest.mark.parametrize("columns", [TIP, SEVERAL])
def test_a_page_holds_the_series_as_they_are_written(tmp_path: Path, columns: tuple[str, ...]) -> None:
    """Every point that was measured, measured, before and after, to half a hundredth of a millimetre."""
    diagnosis = moving_diagnosis(columns=columns)
    write_results(diagnosis, tmp_path, "<mujoco/>")
    data = embedded((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert [trial["file"] for trial in data["trials"]] == ["a.csv", "loops.csv"]
    assert data["first"] == 1
    for trial in data["trials"]:
        series = read_table(tmp_path / trial["series"]).columns
        rows = np.array(trial["rows"]) - 1
        assert 3 not in rows  # nothing was measured there
        found = {f"{p['name']}_{axis}_mm" for p in trial["points"] for axis in p["measured"]}
        assert found == set(columns)
        assert trial["points"][-1]["name"] == "tip"  # whose path is drawn
        for point in trial["points"]:
            for stage, prefix in (("measured", ""), ("before", "before_"), ("after", "after_")):
                for axis in point["measured"]:
                    written = series[f"{prefix}{point['name']}_{axis}_mm"][rows]
                    np.testing.assert_allclose(0.01 * np.array(point[stage][axis]), written, atol=0.0051)


def test_the_error_is_that_of_the_series() -> None:
    """Of one point its distance in space, of several the root mean square, over every row measured."""
    for columns in (TIP, SEVERAL):
        diagnosis = moving_diagnosis(columns=columns)
        data = in_space(diagnosis, fit_files(diagnosis.fits))
        fit, trial = diagnosis.fits[0], data["trials"][0]
        known = np.isfinite(fit.measured.columns["tip_x_mm"])
        for stage, table in (("before", fit.before), ("after", fit.after)):
            squares = sum((fit.measured.columns[name] - table.columns[name]) ** 2 for name in columns)
            expected = np.sqrt(squares / (1 if columns == TIP else 3))[known]
            np.testing.assert_allclose(trial["error"][stage], expected, atol=1e-4)


def test_shapes_are_the_robots() -> None:
    """The line before is that of statics that share no code with it; its end is the tip of the series."""
    diagnosis = moving_diagnosis(rows=40)
    robot, fit = diagnosis.dataset.robot, diagnosis.fits[1]
    trial = in_space(diagnosis, fit_files(diagnosis.fits))["trials"][1]
    assert len(trial["line"]["radius_mm"]) == len(lines_mm(trial, "after")[0]) <= MOST_ON_LINE
    for stage, table in (("before", fit.before), ("after", fit.after)):
        ends = lines_mm(trial, stage)[:, -1]
        rows = np.array(trial["rows"]) - 1
        written = np.stack([table.columns[name][rows] for name in TIP], axis=1)
        np.testing.assert_allclose(ends, written, atol=0.0051)
    given = in_force(robot, diagnosis.dataset.trials[1].inputs)
    postures = STATIC_MODELS["fkm_exact_arm"].solve(given.robot, given.inputs, GRAVITY).postures
    names = [f"body_{k}_{axis}_mm" for k in (1, 5) for axis in "xyz"]
    expected = posture_columns(robot, postures, names)
    for index, point in enumerate(fit.shapes.points):
        if point in ("body_1", "body_5"):
            mine = fit.shapes.before[:, index]
            theirs = np.stack([expected[f"{point}_{axis}_mm"] for axis in "xyz"], axis=1)
            np.testing.assert_allclose(mine, theirs[fit.shapes.rows], atol=0.05)
    np.testing.assert_allclose(fit.shapes.before[:, 0], 0.0, atol=1e-12)


ROWS = {
    "continuum": {"displacement_upper_1_mm": (0.0, 4.0), "displacement_lower_2_mm": (0.0, 2.0)},
    "rolling": {"tension_up_N": (0.0, 6.0), "tension_aside_N": (0.0, 2.0)},
    "catheter": {"displacement_bend_x_mm": (0.0, 1.0), "displacement_roll_mm": (0.0, 0.5)},
    "notched_tube": {"tension_pull_N": (0.0, 3.5)},
}
LENGTH_MM = {"continuum": 120.0, "rolling": 108.0, "catheter": 58.0, "notched_tube": 14.1}  # at rest


@pytest.mark.parametrize("effects", [{}, {"rate": {"delay_s": 0.5}}, MOVED], ids=["none", "rate", "frame"])
@pytest.mark.parametrize("kind", ROWS)
def test_every_kind_of_robot_has_a_shape(kind: str, effects: Effects) -> None:
    """It begins where the base is seen, ends at the tip, is as long as the robot at rest; series stay."""
    robot = replace(load_robot(EXAMPLES / f"{kind}_robot.toml"), effects=effects)
    table = Table(np.arange(8.0), {name: np.linspace(*ends, 8) for name, ends in ROWS[kind].items()})
    inputs = read_inputs(robot, table)
    robot = replace(robot, actuation=inputs.actuation)
    columns = ("tip_x_mm", "tip_z_mm")
    predict = twin_for(robot, inputs.actuation, columns, GRAVITY)
    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, dict.fromkeys(columns, np.ones(8))))
    problem = Problem(robot, (), (trial,), columns, np.ones(2), predict)
    nothing: Any = SimpleNamespace(numbers=(), x=np.zeros(0))
    before, _, shapes = computed_along(problem, trial, nothing, nothing)
    assert shapes is not None
    np.testing.assert_array_equal(before, predict([robot], inputs)[0])
    np.testing.assert_array_equal(shapes.before[:, -1][:, [0, 2]], before)
    np.testing.assert_allclose(shapes.before[:, 0], [[3.0 if effects is MOVED else 0.0, 0.0, 0.0]] * 8)
    lengths = np.linalg.norm(np.diff(shapes.before, axis=1), axis=2).sum(axis=1)
    assert lengths[0] == pytest.approx(LENGTH_MM[kind], rel=0.005)


def test_a_shape_changes_no_series() -> None:
    """To ask for all elements gives the columns that were asked for, as without them."""
    with_shapes, without = moving_diagnosis(columns=SEVERAL), moving_diagnosis(columns=SEVERAL, moving=True)
    for one, other in zip(with_shapes.fits, without.fits, strict=True):
        assert one.shapes is not None
        assert other.shapes is None
        for stage in ("before", "after"):
            for name, values in getattr(one, stage).columns.items():
                np.testing.assert_allclose(
                    values, getattr(other, stage).columns[name], rtol=1e-12, atol=1e-12
                )


def test_without_shapes_the_points_move_alone() -> None:
    """As of data in motion; the page says so."""
    diagnosis = moving_diagnosis(columns=SEVERAL, moving=True)
    html = page_of(diagnosis)
    data = embedded(html)
    assert all(trial["line"] is None for trial in data["trials"])
    assert set(data["trials"][0]["points"][1]["after"]) == {"x", "z"}
    assert "The shape between the points is not at hand" in html


def test_without_points_in_space_there_is_no_robot_in_space() -> None:
    """Of one coordinate alone; and where nothing was fitted. The tables still sort and can be saved."""
    diagnosis = moving_diagnosis(columns=("tip_x_mm",))
    assert in_space(diagnosis, fit_files(diagnosis.fits)) is None
    html = page_of(diagnosis)
    assert 'id="in-space"' not in html
    assert 'data-csv="what_was_tried"' in html
    nothing = replace(diagnosis.by_unit["mm"], rmse_before=float("nan"))
    assert in_space(replace(moving_diagnosis(), by_unit={"mm": nothing}), ("a", "b")) is None


@pytest.mark.parametrize("columns", [TIP, SEVERAL])
def test_a_page_of_two_thousand_rows_is_small(columns: tuple[str, ...]) -> None:
    """Below 1.5 MB with its pictures; rows are thinned evenly, and the page says so."""
    diagnosis = moving_diagnosis(2000, columns)
    html = page_of(diagnosis)
    assert len(html.encode()) < 1_500_000
    data = embedded(html)
    numbers = 0
    for trial, total in zip(data["trials"], (1500, 500), strict=True):
        rows = np.array(trial["rows"])
        assert rows[0] == 1
        assert rows[-1] == total
        assert np.ptp(np.diff(rows)) <= 2
        assert len(trial["error"]["time_s"]) == total - 1
        numbers += sum(len(row) for stage in ("before", "after") for row in trial["line"][stage])
        numbers += 9 * len(trial["points"]) * len(rows)
    assert 0.5 * MOST_NUMBERS < numbers <= MOST_NUMBERS
    assert f"it shows {sum(len(trial['rows']) for trial in data['trials'])} of 1998 rows" in html
    assert words_on_rows(embedded(plain_page())) == ""


def test_names_from_files_end_no_script() -> None:
    """A data set and a trial whose names are markup stay text."""
    name = "</script><script>alert(1)</script><!--"
    html = page_of(moving_diagnosis(name=name))
    assert html.count("<script") == html.count("</script>") == 2
    assert "<!--" not in html.split("</style>")[1]
    assert embedded(html)["trials"][1]["file"] == f"{name}.csv"
    assert read_page(plain_page()).problems == []


def test_what_stands_beside_the_robot_is_plain() -> None:
    """Short sentences on how it is turned, what is left out and what moves without a shape."""
    for diagnosis in (moving_diagnosis(1600, SEVERAL), moving_diagnosis(columns=SEVERAL, moving=True)):
        assert_plain(blocks_of(page_of(diagnosis)))


def test_a_page_asks_for_nothing() -> None:
    """No address of another machine, no frame, no script or style of another file."""
    html = plain_page()
    assert not re.search(r"https?:|//[a-z]+\.|@import|url\(|fetch\(|XMLHttp|WebSocket|import\(", html)
    assert not re.search(r"<(script|link|iframe|object|embed)[^>]*\b(src|href|data)=", html)
    assert re.findall(r'src="(?!data:image/png;base64,)', html) == []


def test_without_a_script_and_in_print_the_pictures_stand_there() -> None:
    """The picture is hidden, and the robot shown, on a screen alone and by a class that the script gives."""
    html = plain_page()
    style = html[html.index("<style>") : html.index("</style>")]
    screen = style[style.index("@media screen {\n  .moves") :]
    assert ".live { display: none; }" in style
    assert screen.index(".moves .still { display: none; }") < screen.index("\n}")
    assert re.search(r'<figure class="still">\s*<img src="data:image/png', html)
    assert '<section class="space live"' in html
    assert 'class="moves"' not in html


def test_probabilities_are_bars_and_a_group_is_one() -> None:
    """Its members are named in it, each as wide as it is probable."""
    html = plain_page()
    table = html[html.index('data-csv="probabilities"') :].split("</table>")[0]
    rows = table.split("<tr>")[2:]
    assert len(rows) == 3
    assert "actuation gain or stiffness" in rows[0]
    assert "actuation gain 0.71 and stiffness 0.23" in rows[0]
    assert re.findall(r"width: ([\d.]+)%", rows[0]) == ["71.0", "23.0"]
    assert re.findall(r"width: ([\d.]+)%", rows[1]) == ["12.0"]


def test_the_script_can_be_read_and_is_in_the_package() -> None:
    """Its syntax by Node, where that is; it names every element that it asks the page for."""
    file = resources.files("catheter_sim.page").joinpath("report.js")
    script, html = file.read_text(encoding="utf-8"), plain_page()
    wanted = set(re.findall(r'part\("([\w-]+)"\)', script)) | {"measured", "before", "after", "path"}
    assert {name for name in wanted if f'id="space-{name}"' not in html} == set()
    assert "</" not in script
    if shutil.which("node") is None:
        pytest.skip("node is not installed: the script's syntax is not read")
    subprocess.run(["node", "--check", str(file)], check=True)
