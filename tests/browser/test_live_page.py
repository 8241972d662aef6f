"""The page that runs robots by MuJoCo's WebAssembly module, as a reader opens it: from a folder."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from tests.scripts_as_modules import script_module

ROOT = Path(__file__).resolve().parents[2]
site_pages = script_module("site_pages")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (ROOT / "docs" / "live").is_dir(), reason="docs/live is not here, as in an sdist"),
]


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What of the page runs, with its scripts, without the site's frame."""
    folder = tmp_path_factory.mktemp("site")
    for name, text in site_pages.live_scripts().items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    for name in ("live/live.js", "style.css"):
        (folder / name).write_bytes((ROOT / "docs" / name).read_bytes())
    markup = (ROOT / "docs" / "live.md").read_text(encoding="utf-8")
    runs = markup[markup.index('<div class="live"') : markup.rindex("</script>") + len("</script>")]
    page = f'<!doctype html><meta charset="utf-8"><link rel="stylesheet" href="style.css">{runs}'
    (folder / "live.html").write_text(page, encoding="utf-8")
    return (folder / "live.html").as_uri()


def said(page: Any) -> tuple[float, np.ndarray]:
    """Return the time [s] and the tip [mm] that stand below the picture."""
    numbers = re.findall(r"-?[\d.]+", page.locator("#live-state").inner_text())
    return float(numbers[0]), np.array([float(value) for value in numbers[1:4]])


def start(page: Any, address: str, robot: str) -> None:
    """Open the page, choose a robot and start it."""
    page.goto(address)
    page.locator("#live-robot").select_option(robot)
    page.locator("#live-start").click()
    page.locator("#live-channels input").first.wait_for(timeout=60_000)


def pulled(page: Any, channel: str, value: float) -> None:
    """Set a slider, as a hand that is done with it."""
    slider = page.get_by_label(channel, exact=True)
    slider.evaluate("(own, value) => { own.value = value; own.dispatchEvent(new Event('input')); }", value)


def test_a_slider_moves_the_robot_to_where_mujoco_has_it(page: Any, address: str) -> None:
    """A catheter without friction rests where MuJoCo has it here; reset makes it straight again."""
    start(page, address, "mitral_transseptal")
    pulled(page, "displacement_bending_mm", 1.5)
    page.wait_for_function(
        "parseFloat(document.getElementById('live-state').textContent) > 3", timeout=120_000
    )
    about = site_pages.live_robot("mitral_transseptal")
    model = mujoco.MjModel.from_xml_string(about["mjcf"])
    data = mujoco.MjData(model)
    names = [model.actuator(k).name for k in range(model.nu)]
    data.ctrl[names.index("tendon_bending")] = 1.5e-3
    data.ctrl[names.index("antagonist_bending")] = -1.5e-3
    mujoco.mj_step(model, data, 6000)
    assert said(page)[1] == pytest.approx(1e3 * data.site("tip").xpos, abs=0.1)
    page.locator("#live-reset").click()
    page.wait_for_function("parseFloat(document.getElementById('live-state').textContent) < 2")
    page.wait_for_timeout(500)
    assert said(page)[1] == pytest.approx([0.0, 0.0, about["length_mm"]], abs=0.2)


@pytest.mark.parametrize("robot", sorted(site_pages.LIVE_ROBOTS))
def test_every_robot_runs_and_is_drawn(page: Any, address: str, robot: str) -> None:
    """Its first channel, at half of its range, moves the tip; the canvas shows more than one colour."""
    start(page, address, robot)
    first = site_pages.live_robot(robot)["sliders"][0]
    before = said(page)[1]
    pulled(page, first["name"], first["most"] / 2.0)
    page.wait_for_timeout(4000)
    after = said(page)[1]
    assert np.isfinite(after).all()
    assert np.linalg.norm(after - before) > 1.0
    colours = page.locator("#live-view").evaluate(
        "own => new Set(new Uint32Array(own.getContext('2d')"
        ".getImageData(0, 0, own.width, own.height).data.buffer)).size"
    )
    assert colours > 20


def test_what_is_exported_is_what_the_code_exports(tmp_path: Path) -> None:
    """The stored file of a rolling robot is the one that its command writes today."""
    from catheter_sim.catalogue import load_robot
    from catheter_sim.exporting.write import write_model

    found = write_model(load_robot("chest_tube_section"), "mjx").text
    assert found == site_pages.LIVE_ROBOTS["chest_tube_section"].read_text(encoding="utf-8")
