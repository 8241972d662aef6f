"""The page of a live robot in a browser: a slider and a key move the tip, what was driven is saved."""

from __future__ import annotations

import csv
import shlex
import time
from pathlib import Path
from typing import Any

import pytest

import catheter_sim as cs
from catheter_sim.cli.main import main

SECTION = "neuroendoscope_section"
pytestmark = pytest.mark.slow


def began(page: Any) -> None:
    """Wait for the first state; the page forbids code in texts, so no expression is waited for."""
    page.locator("#tip", has_text="mm").wait_for()


def value_comes(page: Any, channel: str, value: float) -> None:
    for _ in range(50):
        if float(page.locator(f"input[data-channel={channel}]").input_value()) == pytest.approx(value):
            return
        time.sleep(0.1)
    raise AssertionError(f"{channel} does not become {value}")


def tip(page: Any) -> list[float]:
    words = page.locator("#tip").inner_text().removeprefix("tip ").removesuffix(" mm")
    return [float(part) for part in words.split(", ")]


def settled(page: Any, moved_from: list[float]) -> list[float]:
    """Return the tip once it has left a place and rested for a second; a busy machine may take its time."""
    before, rested = moved_from, 0
    for _ in range(200):
        time.sleep(0.1)
        now = tip(page)
        rested = rested + 1 if now == before != moved_from else 0
        if rested == 10:
            return now
        before = now
    raise AssertionError(f"the tip does not come to rest: {before}")


def test_a_slider_and_a_key_move_the_tip_and_the_csv_is_simulated(page: Any, tmp_path: Path) -> None:
    """Dragged by the mouse to about the middle, then three keys; the saved file gives the same tip."""
    with cs.view(SECTION) as robot:
        page.goto(robot.address)
        began(page)
        start = tip(page)
        assert start == pytest.approx([0.0, 0.0, 60.0], abs=0.1)
        box = page.locator("input[data-channel=tension_right_N]").bounding_box()
        page.mouse.move(box["x"] + 8, box["y"] + box["height"] / 2)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps=5)
        page.mouse.up()
        bent = settled(page, start)
        assert bent[0] > 5.0
        page.locator("body").press("1")
        for _ in range(3):
            page.keyboard.press("w")
        more = settled(page, bent)
        assert more[0] > bent[0] + 0.2
        asked = float(page.locator("input[data-channel=tension_right_N]").input_value())
        with page.expect_download() as saved:
            page.click("#save")
        driven = tmp_path / "driven.csv"
        saved.value.save_as(driven)
    rows = list(csv.DictReader(driven.open()))
    assert float(rows[-1]["tension_right_N"]) == pytest.approx(asked, rel=1e-3)
    out = tmp_path / "out.csv"
    assert main(["simulate", SECTION, "--inputs", str(driven), "-o", str(out)]) == 0
    last = list(csv.DictReader(out.open()))[-1]
    assert [float(last[f"tip_{axis}_mm"]) for axis in "xyz"] == pytest.approx(more, abs=0.3)


def test_the_picture_turns_and_a_reset_brings_it_back(page: Any) -> None:
    with cs.view(SECTION, gravity_mps2=(0.0, 0.0, -9.81)) as robot:
        page.goto(robot.address)
        began(page)
        assert page.evaluate("document.documentElement.scrollHeight") == 900  # all of it is seen at a desk
        canvas = page.locator("#view")
        before = canvas.screenshot()
        canvas.focus()
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        page.wait_for_timeout(200)
        assert canvas.screenshot() != before
        number = page.get_by_label("tension_left_N, as a number")
        number.fill("0.2")
        number.press("Enter")
        assert settled(page, tip(page))[0] < -3.0
        bent = tip(page)
        page.locator("input[data-channel=tension_left_N]").dispatch_event("pointerdown")  # and not moved
        page.locator("input[data-channel=tension_left_N]").dispatch_event("pointerup")
        page.click("#reset")
        assert settled(page, bent) == pytest.approx([0.0, 0.0, 60.0], abs=0.1)
        assert float(number.input_value()) == 0.0


def test_the_copied_command_names_the_file_and_the_gravity(page: Any, tmp_path: Path) -> None:
    """As a shell reads it; typed in where the saved file lies, it simulates what was driven."""
    file = tmp_path / "my robot.toml"
    cs.save_robot(cs.load_robot(SECTION, ["friction.mu=0.02"]), file)
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    with cs.view(file, gravity_mps2=(0.0, 0.0, -9.81)) as robot:
        page.goto(robot.address)
        began(page)
        page.click("#copy")
        page.locator("#said", has_text="copied: ").wait_for()
        said = page.locator("#said").inner_text().removeprefix("copied: ")
        with page.expect_download() as saved:
            page.click("#save")
        saved.value.save_as(tmp_path / saved.value.suggested_filename)
    words = shlex.split(said)
    assert words[:3] == ["catheter-sim", "simulate", str(file)]
    assert "--gravity=0,0,-9.81" in words
    words[words.index("--inputs") + 1] = str(tmp_path / words[words.index("--inputs") + 1])
    words[words.index("-o") + 1] = str(tmp_path / "out.csv")
    assert main(words[1:]) == 0


def test_two_pages_show_one_robot_and_say_when_it_has_ended(page: Any) -> None:
    robot = cs.view(SECTION)
    page.goto(robot.address)
    other = page.context.new_page()
    other.goto(robot.address)
    for each in (page, other):
        began(each)
    number = page.get_by_label("tension_right_N, as a number")
    number.fill("0.25")
    number.press("Enter")
    value_comes(other, "tension_right_N", 0.25)
    robot.close()
    for each in (page, other):
        each.wait_for_selector("#lost:visible")


def test_it_fits_a_telephone(page: Any) -> None:
    """At 390 px nothing scrolls sideways, and every slider is seen."""
    with cs.view("neuroendoscope") as robot:
        page.set_viewport_size({"width": 390, "height": 800})
        page.goto(robot.address)
        began(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        for slider in page.locator("input[type=range]").all():
            if slider.is_visible():
                box = slider.bounding_box()
                assert box["width"] > 120
                assert box["x"] + box["width"] <= 390


def test_states_and_pictures_keep_up(page: Any) -> None:
    """A guard, not a benchmark: the figures are printed; a tenth of what is asked must be there."""
    with cs.view(SECTION) as robot:
        page.set_viewport_size({"width": 800, "height": 600})
        page.goto(robot.address)
        page.wait_for_timeout(3000)
        rate = page.locator("#rate").inner_text()
        print(rate)
        states, pictures = (float(part.split()[0]) for part in rate.split(", "))
        assert states >= 3.0
        assert pictures >= 2.0
