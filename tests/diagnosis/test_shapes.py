"""What the report's page is given to move: the series as written, the robot's shape, no more than fits."""

from __future__ import annotations

import json
import math
import re
import shutil
import string
import subprocess
from dataclasses import replace
from functools import cache
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from moving_report import GRAVITY, SEVERAL, TIP, fitted, moving_diagnosis
from page_checks import read_page
from planted import Effects
from test_report_words import assert_plain, blocks_of

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import posture_columns, read_inputs
from catheter_sim.diagnosis.conclude import uncorrected
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.pictures import figures
from catheter_sim.diagnosis.problem import Problem, Term
from catheter_sim.diagnosis.report import fit_files, report_html, write_results
from catheter_sim.diagnosis.result import DiagnosisResult
from catheter_sim.diagnosis.shapes import (
    MOST_CHARACTERS,
    MOST_ON_LINE,
    computed_along,
    in_space,
    radii_mm,
)
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.diagnosis.verdict import trial_fits
from catheter_sim.effects.apply import in_force
from catheter_sim.simulation import moving_twin
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table, read_table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import moving_twin_for, twin_for
from tests.simulation.moving import HANGING, pulled, swinging

pytestmark = pytest.mark.slow
EXAMPLES = Path(__file__).parents[2] / "assets" / "examples"
NOTHING: Any = SimpleNamespace(numbers=(), x=np.zeros(0))  # a fit of no number
MOVED = {"measurement_frame": {"translation_x_mm": 3.0, "rotation_y_deg": 5.0}}


def embedded(html: str) -> dict:
    """Return the data that stand in a page."""
    (text,) = re.findall(r'<script type="application/json" id="in-space">(.*?)</script>', html, re.DOTALL)
    return read(json.loads(text))


def read(data: dict) -> dict:
    """Return a page's data with its numbers read: rows, seconds, and millimetres."""
    for trial in data["trials"]:
        trial["rows"] = numbers_of(trial["rows"], 1).astype(int)
        trial["time_s"] = numbers_of(trial["time_s"], 1e4)
        trial["error"] = {name: numbers_of(code, 1e4) for name, code in trial["error"].items()}
        for courses in (
            point[stage] for point in trial["points"] for stage in ("measured", "before", "after")
        ):
            courses.update({axis: numbers_of(code, 100) for axis, code in courses.items()})
        for stage in ("before", "after") if trial["line"] else ():
            trial["line"][stage] = numbers_of(trial["line"][stage], 100).reshape(-1, len(trial["rows"])).T
    return data


def numbers_of(code: str, per: float) -> np.ndarray:
    """Return the numbers of a page, by a reading of its own: a number from its highest digit on."""
    digits, found, last = string.ascii_uppercase + string.ascii_lowercase + string.digits + "+/", [], 0
    for word in re.findall(r"!|[g-z0-9+/]*[A-Za-f]", code):
        whole = 0
        for letter in reversed(word):
            whole = 32 * whole + digits.find(letter) % 32
        last += 0 if word == "!" else (-1) ** (whole % 2) * (whole // 2)
        found.append(math.nan if word == "!" else last / per)
    return np.array(found)


@cache
def plain_page() -> str:
    """Return the page of the tip alone."""
    return page_of(moving_diagnosis())


def page_of(diagnosis: DiagnosisResult) -> str:
    return report_html(diagnosis, figures(diagnosis))


def lines_mm(trial: dict, stage: str) -> np.ndarray:
    """Return the centrelines of a trial's rows, shape (k, p, 3)."""
    steps = trial["line"][stage]
    return steps.reshape(len(steps), -1, 3).cumsum(axis=1)


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
        rows = trial["rows"] - 1
        assert 3 not in rows  # nothing was measured there
        found = {f"{p['name']}_{axis}_mm" for p in trial["points"] for axis in p["measured"]}
        assert found == set(columns)
        assert trial["points"][-1]["name"] == "tip"  # whose path is drawn
        for point in trial["points"]:
            for stage, prefix in (("measured", ""), ("before", "before_"), ("after", "after_")):
                for axis in point["measured"]:
                    written = series[f"{prefix}{point['name']}_{axis}_mm"][rows]
                    np.testing.assert_allclose(point[stage][axis], written, atol=0.0051)


def test_the_error_is_that_of_the_series() -> None:
    """Of one point its distance in space, of several the root mean square, over every row measured."""
    for columns in (TIP, SEVERAL):
        diagnosis = moving_diagnosis(columns=columns)
        data = read(in_space(diagnosis, fit_files(diagnosis.fits)))
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
    trial = read(in_space(diagnosis, fit_files(diagnosis.fits)))["trials"][1]
    assert len(trial["line"]["radius_mm"]) == len(lines_mm(trial, "after")[0]) <= MOST_ON_LINE
    for stage, table in (("before", fit.before), ("after", fit.after)):
        ends = lines_mm(trial, stage)[:, -1]
        rows = trial["rows"] - 1
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
    before, _, shapes = computed_along(problem, trial, NOTHING, NOTHING)
    assert shapes is not None
    np.testing.assert_array_equal(before, predict([robot], inputs)[0])
    np.testing.assert_array_equal(shapes.before[:, -1][:, [0, 2]], before)
    np.testing.assert_allclose(shapes.before[:, 0], [[3.0 if effects is MOVED else 0.0, 0.0, 0.0]] * 8)
    lengths = np.linalg.norm(np.diff(shapes.before, axis=1), axis=2).sum(axis=1)
    assert lengths[0] == pytest.approx(LENGTH_MM[kind], rel=0.005)


def without_shapes() -> DiagnosisResult:
    """Return a diagnosis by a model that knows the measured points alone."""
    diagnosis = moving_diagnosis(columns=SEVERAL)
    return replace(diagnosis, fits=tuple(replace(fit, shapes=None) for fit in diagnosis.fits))


def test_a_shape_changes_no_series() -> None:
    """To ask for all elements gives the columns that were asked for, as without them."""
    robot, columns = load_robot("neuroendoscope_section"), SEVERAL[:5]
    predict = twin_for(robot, "tension", columns, GRAVITY)
    trial = replace(moving_diagnosis(20).dataset.trials[0], outputs=moving_diagnosis(20).fits[0].measured)
    problem = Problem(robot, (), (trial,), columns, np.ones(5), predict)
    before, _, shapes = computed_along(problem, trial, NOTHING, NOTHING)
    assert shapes is not None
    np.testing.assert_allclose(before, predict([robot], trial.inputs)[0], rtol=1e-12, atol=1e-12)
    (plain,) = trial_fits(problem, [trial], NOTHING, NOTHING, shapes=False)
    assert plain.shapes is None
    np.testing.assert_allclose(plain.after.columns["tip_x_mm"], before[:, 0], rtol=1e-12, atol=1e-12)


def test_where_nothing_is_corrected_after_is_before() -> None:
    """Series and shapes, without computing them again."""
    for fit in uncorrected(moving_diagnosis().fits):
        assert fit.after is fit.before
        assert fit.shapes.after is fit.shapes.before
    assert all(fit.shapes is None for fit in uncorrected(without_shapes().fits))


def test_of_data_in_motion_the_shape_is_the_simulations() -> None:
    """The tip's series stay to the last digit, the line is that of a run, and no such run is remembered."""
    robot = swinging()
    inputs, columns = pulled(3, 0.3), ("tip_x_mm", "tip_z_mm")
    predict = moving_twin_for(robot, "tension", columns, HANGING)
    expected = predict([robot], inputs)[0]
    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, dict(zip(columns, expected.T, strict=True))))
    problem = Problem(robot, (), (trial,), columns, np.ones(2), predict, moving=True)
    kept = len(moving_twin._runs)
    before, after, shapes = computed_along(problem, trial, NOTHING, NOTHING)
    np.testing.assert_array_equal(before, expected)
    np.testing.assert_array_equal(after, expected)
    assert len(moving_twin._runs) == kept
    assert shapes is not None
    assert shapes.points == ("body_0", *(f"body_{k}" for k in range(1, 6)))
    postures = simulate(robot, inputs, HANGING, dynamic=True).postures
    np.testing.assert_allclose(shapes.before[:, 1:], [1e3 * item.p_w for item in postures], atol=1e-6)
    assert np.ptp(shapes.before[:, 3, 0]) > 1.0
    np.testing.assert_array_equal(shapes.before[:, 0], 0.0)


def test_radii_are_those_of_the_segments() -> None:
    """At the base and after each element the radius of the segment below it."""
    robot = swinging()
    thin = replace(robot.segments[0], name="thin", outer_radius_m=0.005)
    robot = replace(robot, segments=(robot.segments[0], thin))
    np.testing.assert_allclose(radii_mm(robot, np.arange(11)), [12.0] * 6 + [5.0] * 5)


def test_without_shapes_the_points_move_alone() -> None:
    """As of a model that knows no more; the page says so."""
    diagnosis = without_shapes()
    html = page_of(diagnosis)
    data = embedded(html)
    assert all(trial["line"] is None for trial in data["trials"])
    assert set(data["trials"][0]["points"][1]["after"]) == {"x", "z"}
    assert data["trials"][0]["rows"][:4].tolist() == [1, 2, 3, 5]
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


EVERY = tuple(f"body_{k}_{axis}_mm" for k in range(1, 31) for axis in "xyz")


@pytest.mark.parametrize(
    ("rows", "columns", "least"), [(2000, TIP, 1998), (2000, SEVERAL, 1998), (2600, EVERY, 1000)]
)
def test_a_page_of_thousands_of_rows_is_small(rows: int, columns: tuple[str, ...], least: int) -> None:
    """Below 1.5 MB with its pictures. Of 2,000 rows it has each; of more, thinned evenly, it says so."""
    html = page_of(moving_diagnosis(rows, columns))
    assert len(html.encode()) < 1_500_000
    data, totals = embedded(html), (3 * rows // 4, rows // 4)
    for trial, total in zip(data["trials"], totals, strict=True):
        assert trial["rows"][[0, -1]].tolist() == [1, total]
        assert np.ptp(np.diff(trial["rows"])) <= 2
        assert len(trial["error"]["time_s"]) == total - 1
    shown = sum(len(trial["rows"]) for trial in data["trials"])
    assert least <= shown <= rows - 2
    assert (f"it shows {shown} of {rows - 2} rows" in " ".join(html.split())) == (shown < rows - 2)
    assert len(re.search(r'id="in-space">(.*?)</script>', html)[1]) <= 1.01 * MOST_CHARACTERS


def test_the_page_of_a_real_robot_of_three_segments_is_small() -> None:
    """Two thousand random postures, nine inputs: two series by its own model, without a search."""
    html = page_of(fitted(load_dataset(EXAMPLES / "opencr_v4"), Term("stiffness", ("scale",)), 1.2))
    data = embedded(html)
    assert len(html.encode()) < 1_500_000
    assert sum(len(trial["rows"]) for trial in data["trials"]) == 2063
    assert all(trial["line"] is not None for trial in data["trials"])


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
    for diagnosis in (moving_diagnosis(3000, SEVERAL), without_shapes()):
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
    files = [resources.files("catheter_sim.page").joinpath(name) for name in ("scene.js", "report.js")]
    script, html = "".join(file.read_text(encoding="utf-8") for file in files), plain_page()
    wanted = set(re.findall(r'part\("([\w-]+)"\)', script)) | {"measured", "before", "after", "path"}
    assert {name for name in wanted if f'id="space-{name}"' not in html} == set()
    assert "</" not in script
    if shutil.which("node") is None:
        pytest.skip("node is not installed: the script's syntax is not read")
    for file in files:
        subprocess.run(["node", "--check", str(file)], check=True)
