"""The report in a browser: turned, zoomed, played, sorted, saved, printed, on a telephone, without scripts.

Needs Playwright for Python and Chromium, the system's; where one is missing, one line says so.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from moving_report import SEVERAL, TIP, moving_diagnosis

from catheter_sim.diagnosis.report import write_results
from catheter_sim.tables import read_table

pytestmark = pytest.mark.slow
NAME = "loops & knees"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a diagnosis of 60 rows, three points measured."""
    place = tmp_path_factory.mktemp("report")
    write_results(moving_diagnosis(60, SEVERAL, NAME), place, "<mujoco/>")
    return place


@pytest.fixture
def page(browser: Any, folder: Path) -> Iterator[Any]:
    """Yield the report at a desk; nothing may fail in it, and nothing be asked of a network."""
    found, wrong = opened(browser, folder, width=1400)
    yield found
    found.context.close()
    assert wrong == []


# Keeps what is drawn in the last picture of the robot: of each stroke its colour, width and places in pixels.
KEEP_STROKES = """() => {
  const own = CanvasRenderingContext2D.prototype, kept = { strokes: [], now: [] };
  const { beginPath, moveTo, lineTo, stroke } = own, here = (pen) => pen.canvas.id === 'space-canvas';
  own.beginPath = function () { kept.now = []; beginPath.call(this); };
  own.moveTo = function (x, y) { kept.now.push([x, y]); moveTo.call(this, x, y); };
  own.lineTo = function (x, y) { kept.now.push([x, y]); lineTo.call(this, x, y); };
  own.stroke = function () {
    if (here(this)) kept.strokes.push({ ink: this.strokeStyle, width: this.lineWidth, places: kept.now });
    stroke.call(this);
  };
  window.strokes = kept.strokes;
}"""
VERMILION, BLUE, INK = "#d55e00", "#0072b2", "#1c2126"


SMALLEST_LETTERS = """() => {
  const walker = document.createTreeWalker(document.querySelector('main'), NodeFilter.SHOW_TEXT), sizes = [];
  while (walker.nextNode()) {
    const { parentElement: around, data } = walker.currentNode;
    if (data.trim() && around.checkVisibility()) sizes.push(parseFloat(getComputedStyle(around).fontSize));
  }
  return Math.min(...sizes);
}"""


def strokes(page: Any, act: Any) -> list[dict[str, Any]]:
    """Return the strokes of the picture that an act makes."""
    settle(page)
    page.evaluate("window.strokes.length = 0")
    act()
    settle(page)
    return page.evaluate("window.strokes")


def length_px(stroke: dict[str, Any]) -> float:
    (x, y), (to_x, to_y) = stroke["places"]
    return float(np.hypot(to_x - x, to_y - y))


def opened(browser: Any, folder: Path, width: int, **how: Any) -> tuple[Any, list[str]]:
    """Return a page of the report and the list of what goes wrong in it."""
    context = browser.new_context(viewport={"width": width, "height": 900}, accept_downloads=True, **how)
    page, wrong = context.new_page(), []
    page.add_init_script(f"({KEEP_STROKES})()")
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
    page.on(
        "request",
        lambda asked: wrong.append(asked.url) if not asked.url.startswith(("file:", "data:", "blob:")) else 0,
    )
    page.goto((folder / "report.html").as_uri())
    if how.get("java_script_enabled", True):
        settle(page)
    return page, wrong


def settle(page: Any) -> None:
    """Wait until what was asked for is drawn."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def drawn(page: Any, name: str = "canvas") -> str:
    settle(page)
    return page.evaluate(f"document.getElementById('space-{name}').toDataURL()")


def row_of(page: Any) -> int:
    return int(page.locator("#space-row").input_value())


def saved(page: Any, button: Any) -> tuple[str, list[list[str]]]:
    """Return the name and the rows of the CSV that a button saves."""
    with page.expect_download() as waiting:
        button.click()
    with open(waiting.value.path(), encoding="utf-8", newline="") as file:
        return waiting.value.suggested_filename, list(csv.reader(file))


@pytest.mark.parametrize(
    ("scheme", "before", "after"),
    [("light", [213, 94, 0], [0, 114, 178]), ("dark", [230, 159, 0], [86, 180, 233])],
)
def test_something_is_drawn_in_every_colour(
    page: Any, scheme: str, before: list[int], after: list[int]
) -> None:
    """Measured, before and after, in colours for the colour-blind; hidden, a colour is gone."""
    count = """(wanted) => {
      const canvas = document.getElementById('space-canvas'), pen = canvas.getContext('2d');
      const dots = pen.getImageData(0, 0, canvas.width, canvas.height).data;
      let found = 0;
      for (let k = 0; k < dots.length; k += 4) {
        found += wanted.every((value, axis) => Math.abs(dots[k + axis] - value) < 6) && dots[k + 3] > 250;
      }
      return found;
    }"""
    page.emulate_media(color_scheme=scheme)
    settle(page)
    assert page.evaluate(count, before) > 30
    page.locator("#space-measured").uncheck()  # its dots lie over those that are right
    settle(page)
    assert page.evaluate(count, after) > 30
    page.locator("#space-before").uncheck()
    settle(page)
    assert page.evaluate(count, before) == 0


def test_an_error_is_a_line_to_scale(page: Any, folder: Path) -> None:
    """From the measured tip to the computed one, as long against the scale as the series have it."""
    slider = page.locator("#space-row")
    drawn_now = strokes(page, lambda: slider.fill("12"))
    row = int(page.locator("#space-said").inner_text().removeprefix("Row ").split(",")[0]) - 1
    series = read_table(next(folder.glob("fitted_heldout_*.csv"))).columns
    apart = [series[f"tip_{axis}_mm"][row] - series[f"before_tip_{axis}_mm"][row] for axis in "xyz"]
    errors = [item for item in drawn_now if item["ink"] == VERMILION and item["width"] == 2.5]
    assert len(errors) == 3  # of three points
    (ruler,) = [item for item in drawn_now if item["ink"] == INK and item["width"] == 2]
    shown_mm = 20.0 * max(map(length_px, errors)) / length_px(ruler)
    assert shown_mm == pytest.approx(np.linalg.norm(apart), rel=0.1)  # seen from a little above, near or far


def test_zoom_keeps_what_is_under_the_mouse(page: Any) -> None:
    """The wheel about a place leaves it there, and twice as large it is twice as far from all others."""
    box = page.locator("#space-canvas").bounding_box()

    def ruler_and_place(act: Any) -> tuple[float, list[float]]:
        found = strokes(page, act)
        (ruler,) = [item for item in found if item["ink"] == INK and item["width"] == 2]
        return length_px(ruler), [item for item in found if item["width"] == 2.5][-1]["places"][0]

    _, place = ruler_and_place(lambda: page.locator("#space-row").fill("12"))
    page.mouse.move(box["x"] + place[0], box["y"] + place[1])
    _, after = ruler_and_place(lambda: page.mouse.wheel(0, -600))
    assert after == pytest.approx(place, abs=1.5)
    page.locator("#space-canvas").focus()
    _, moved = ruler_and_place(lambda: page.keyboard.press("Shift+ArrowLeft"))
    assert moved == pytest.approx([after[0] - 30.0, after[1]], abs=0.1)
    _, home = ruler_and_place(lambda: page.keyboard.press("Home"))
    assert home == pytest.approx(place, abs=0.1)


def test_where_several_points_are_measured_their_shape_is_drawn(browser: Any, tmp_path: Path) -> None:
    """A line through them, base to tip, and the whole tubes; not through a marker that stands aside."""
    columns = tuple(f"body_{k}_{axis}_mm" for k in (8, 16, 24) for axis in "xz")
    write_results(
        moving_diagnosis(20, (*TIP, *columns, "marker_ring_x_mm", "marker_ring_z_mm")), tmp_path, ""
    )
    page, wrong = opened(browser, tmp_path, 1400)
    found = strokes(page, lambda: page.locator("#space-row").fill("2"))
    (shape,) = [item for item in found if item["ink"] == INK and item["width"] == 1.5]
    heights = [y for _, y in shape["places"]]
    assert len(heights) == 4
    assert heights == sorted(heights, reverse=True)
    for ink in (VERMILION, BLUE):
        (tube,) = [item for item in found if item["ink"] == ink and item["width"] == 1]
        assert len(tube["places"]) == 2 * 25
    page.context.close()
    assert wrong == []


def test_it_turns_by_mouse_and_by_keys_and_zooms(page: Any) -> None:
    """Each changes what is drawn; Home undoes them all."""
    canvas = page.locator("#space-canvas")
    first = drawn(page)
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 150)
    page.mouse.down()
    page.mouse.move(box["x"] + 300, box["y"] + 190, steps=4)
    page.mouse.up()
    seen = [first, drawn(page)]
    page.mouse.wheel(0, -400)
    seen.append(drawn(page))
    canvas.focus()
    for key in ("ArrowLeft", "ArrowRight", "ArrowUp", "ArrowUp", "+", "-", "ArrowDown", "Shift+ArrowDown"):
        page.keyboard.press(key)
        seen.append(drawn(page))
    assert all(one != other for one, other in pairwise(seen))
    page.keyboard.press("Home")
    assert drawn(page) == first


def test_it_plays_to_the_end_and_stops(page: Any) -> None:
    """The slider, the words and both drawings follow; Pause holds the row."""
    page.locator("#space-row").fill("0")
    assert row_of(page) == 0
    first, curve = drawn(page), drawn(page, "curve")
    words = page.locator("#space-said").inner_text()
    page.get_by_role("button", name="Play").click()
    page.wait_for_function("Number(document.getElementById('space-row').value) >= 3")
    page.get_by_role("button", name="Pause").click()
    held = row_of(page)
    page.wait_for_timeout(400)
    assert row_of(page) == held
    assert drawn(page) != first
    assert drawn(page, "curve") != curve
    assert page.locator("#space-said").inner_text() != words
    page.get_by_role("button", name="Play").click()
    page.wait_for_function("document.getElementById('space-play').textContent === 'Play'", timeout=15000)
    assert row_of(page) == int(page.locator("#space-row").get_attribute("max"))


def test_the_slider_the_trial_and_the_error_choose_the_row(page: Any, folder: Path) -> None:
    """The words say the error of that row, as the series have it; another trial has rows of its own."""
    slider = page.locator("#space-row")
    slider.focus()
    slider.fill("4")
    assert row_of(page) == 4
    page.keyboard.press("ArrowRight")
    assert row_of(page) == 5
    series = read_table(next(folder.glob("fitted_heldout_*.csv"))).columns
    row = 6  # the sixth of those measured: nothing was in the fourth
    error = sum((series[name][row] - series[f"before_{name}"][row]) ** 2 for name in SEVERAL)
    said = page.locator("#space-said").inner_text()
    assert said.startswith("Row 7, 6.00 s: ")
    assert float(said.split(": ")[1].split(" mm")[0]) == pytest.approx(np.sqrt(error / 3), abs=0.02)
    chart = page.locator("#space-curve")
    box = chart.bounding_box()
    chart.click(position={"x": box["width"] - 12, "y": 60})
    assert row_of(page) == int(slider.get_attribute("max"))
    page.locator("#space-trial").select_option(label="a.csv (training)")
    assert int(slider.get_attribute("max")) == 43


def test_what_was_tried_sorts_by_click_and_by_key(page: Any) -> None:
    """Rising, falling, and by words; the head says which way, and the chosen row keeps its look."""
    table = page.locator("table[data-csv=what_was_tried]")
    rows = lambda: table.locator("tr td:nth-child(2)").all_inner_texts()  # noqa: E731
    first = rows()
    head = table.locator("th").nth(1)
    head.locator("button").click()
    assert head.get_attribute("aria-sort") == "ascending"
    assert rows() == sorted(first, key=float)
    head.locator("button").focus()
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "descending"
    assert rows() == sorted(first, key=float, reverse=True)
    table.locator("th").first.locator("button").press("Space")
    assert head.get_attribute("aria-sort") is None
    assert table.locator("tr td:nth-child(1)").all_inner_texts()[0].startswith("actuation gain")
    assert table.locator("tr.chosen").count() == 1


def test_tables_and_series_are_saved(page: Any, folder: Path) -> None:
    """As CSV: what the page shows, with the names that the written series have."""
    name, rows = saved(page, page.get_by_label("Save CSV: what was tried"))
    assert name == "what_was_tried.csv"
    assert [len(row) for row in rows] == [3] * 5
    assert rows[0][0] == "causes in the model"
    assert rows[1][0] == "actuation gain"
    assert {row[1] for row in rows[1:]} == {"0.0600", "0.9000", "0.7000", "3.1000"}
    page.locator("summary", has_text="What is probably at work").click()
    name, rows = saved(page, page.get_by_label("Save CSV: probabilities"))
    assert rows[0] == ["at work", "probability"]
    assert rows[1] == ["actuation gain or stiffness; actuation gain 0.71 and stiffness 0.23", "0.94"]
    (file,) = folder.glob("fitted_heldout_*.csv")
    name, rows = saved(page, page.get_by_role("button", name="Save CSV of the points"))
    assert name.startswith("points_fitted_heldout_")
    written = read_table(file).columns
    for index, column in enumerate(rows[0][2:], start=2):
        if column in written:
            kept = [int(row[0]) - 1 for row in rows[1:]]
            np.testing.assert_allclose(
                [float(row[index]) for row in rows[1:]], written[column][kept], atol=0.0051
            )
    assert {*SEVERAL, "before_tip_x_mm", "after_body_5_z_mm"} < set(rows[0])
    name, rows = saved(page, page.get_by_role("button", name="Save CSV of the distance"))
    assert rows[0] == ["time_in_trial_s", "before_mm", "after_mm"]
    assert len(rows) == 15


def test_probabilities_are_bars_with_groups(page: Any) -> None:
    """Each bar as long as it is probable; of a group one bar of its members, one after the other."""
    page.locator("summary", has_text="What is probably at work").click()
    rows = page.locator("table[data-csv=probabilities] tr").all()[1:]
    bars = [[part.bounding_box()["width"] for part in row.locator("i").all()] for row in rows]
    whole = rows[0].locator(".chance div").bounding_box()["width"]
    assert [len(bar) for bar in bars] == [2, 1, 1]
    assert bars[0] == pytest.approx([0.71 * whole, 0.23 * whole], rel=0.03)
    assert bars[1] == pytest.approx([0.12 * whole], rel=0.05)
    assert "actuation gain 0.71 and stiffness 0.23" in rows[0].inner_text()


def test_each_table_can_be_saved(page: Any) -> None:
    """A button behind each, that says which; no two of one name."""
    tables = page.evaluate("[...document.querySelectorAll('table')].map((table) => table.dataset.csv)")
    assert None not in tables
    assert len(set(tables)) == len(tables) >= 5
    labels = [button.get_attribute("aria-label") for button in page.locator(".save button[aria-label]").all()]
    assert labels == [f"Save CSV: {name.replace('_', ' ')}" for name in tables]


def test_it_prints_the_still_picture(page: Any) -> None:
    """On paper the picture stands where the robot moves on a screen, and what is folded is unfolded."""
    shown = "(name) => getComputedStyle(document.querySelector(name)).display"
    assert page.evaluate(shown, "figure.still") == "none"
    assert page.evaluate(shown, "section.live") == "block"
    page.emulate_media(media="print", color_scheme="dark")
    assert page.evaluate(shown, "figure.still") != "none"
    assert page.evaluate(shown, "section.live") == "none"
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert page.locator("table[data-csv=probabilities]").bounding_box()["height"] > 50
    assert page.locator("button:visible", has_text="Save CSV").count() == 0
    pdf = page.pdf()
    assert pdf.startswith(b"%PDF")
    assert pdf.count(b"/Type /Page\n") + pdf.count(b"/Type /Page ") >= 1
    page.emulate_media(media="screen")


def test_keys_reach_everything_and_show_where_they_are(page: Any) -> None:
    """By Tab alone: trial, check boxes, robot, play, slider; each with a visible outline."""
    wanted, reached = {"space-trial", "space-path", "space-canvas", "space-play", "space-row"}, set()
    for _ in range(25):
        page.keyboard.press("Tab")
        at = page.evaluate(
            "[document.activeElement.id, getComputedStyle(document.activeElement).outlineStyle]"
        )
        if at[0] in wanted:
            reached.add(at[0])
            assert at[1] != "none"
    assert reached == wanted


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_telephone_and_turns_by_touch(browser: Any, folder: Path, scheme: str) -> None:
    """Nothing to the right of 390 px, folded or not; a finger turns it, two zoom."""
    page, wrong = opened(browser, folder, 390, has_touch=True, is_mobile=True, color_scheme=scheme)
    for _ in range(2):
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        page.evaluate("document.querySelectorAll('details').forEach((part) => { part.open = true; })")
    assert page.locator("#space-canvas").bounding_box()["width"] > 330
    assert page.evaluate(SMALLEST_LETTERS) >= 12.0
    dark = page.evaluate("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)"
    assert dark == (scheme == "dark")
    first = drawn(page)
    page.locator("#space-canvas").scroll_into_view_if_needed()
    box = page.locator("#space-canvas").bounding_box()
    touch = page.context.new_cdp_session(page)

    def fingers(kind: str, *places: tuple[float, float]) -> None:
        points = [{"x": box["x"] + x, "y": box["y"] + y, "id": k} for k, (x, y) in enumerate(places)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    fingers("touchStart", (100, 100))
    fingers("touchMove", (150, 110))
    fingers("touchEnd")
    turned = drawn(page)
    assert turned != first
    fingers("touchStart", (100, 100), (200, 100))
    fingers("touchMove", (60, 100), (240, 100))
    fingers("touchEnd")
    assert drawn(page) != turned
    page.context.close()
    assert wrong == []


def test_without_scripts_the_pictures_stand_there(browser: Any, folder: Path) -> None:
    """Every picture of the report, no control that does nothing."""
    page, wrong = opened(browser, folder, 1400, java_script_enabled=False)
    assert page.locator("figure.still img").is_visible()
    assert not page.locator("section.live").is_visible()
    assert page.locator("button:visible").count() == 0
    assert page.locator("h1").inner_text().startswith("The model of")
    page.context.close()
    assert wrong == []
