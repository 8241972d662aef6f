"""Claims about the pictures of the pages: each has its commands; a change is seen."""

from __future__ import annotations

import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image

from catheter_sim.catalogue import ROBOTS, load_robot
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.pictures.images import open_renderer, write_video
from tests.scripts_as_modules import script_module

ROOT = Path(__file__).resolve().parents[2]
LARGEST_VIDEO_B = 300_000  # asked for

pictures = script_module("docs_pictures")
rows = pictures.table()
made = {pictures.DOCS / name for row in rows for name in row.files}


def view(mu: float = 0.0, smooth: int = 4, camera_deg: float = 0.0) -> np.ndarray:
    """Return a picture of the section bent by `mu` per cell [rad], edges smoothed by `smooth` samples."""
    model = mujoco.MjModel.from_xml_string(build_mjcf(load_robot("neuroendoscope_section")))
    model.vis.quality.offsamples = smooth
    data = mujoco.MjData(model)
    data.qpos[:] = mu
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance = (0.0, 0.0, 0.03), 0.12
    camera.azimuth, camera.elevation = 90.0 + camera_deg, -10.0
    with open_renderer(model, 1280, 720) as renderer:
        renderer.update_scene(data, camera)
        return renderer.render()


def skip_without_videos() -> None:
    """Skip where the videos were left out, as in the sdist."""
    if not (pictures.DOCS / "videos").is_dir():
        pytest.skip("docs/videos is not here, as in an sdist")


def test_every_picture_of_the_pages_has_its_commands() -> None:
    """Pictures of README and docs, and no others, are made by the gallery's blocks; every file is there."""
    skip_without_videos()
    shown = {path for path in pictures.pages_that_show() if ROOT in path.parents}
    folder = pictures.DOCS / "pictures"
    tutorials = {*folder.glob("tutorial_*"), folder / "drawing.svg"}  # by the commands of their own pages
    assert shown - tutorials == made
    stored = {path for folder in ("pictures", "videos") for path in (pictures.DOCS / folder).glob("*.*")}
    assert stored - tutorials - {folder / "learning.csv"} == made


def test_every_robot_has_a_picture_and_a_video() -> None:
    """Each is rendered from inputs that `catheter-sim example` copies."""
    for name in (name for name in ROBOTS if "@" not in name):
        files = (f"pictures/{name}.png", f"videos/{name}.mp4")
        (row,) = (row for row in rows if row.files == files)
        assert row.commands[0] == f"catheter-sim example {name}"
        assert all(command.startswith(f"catheter-sim render {name} ") for command in row.commands[1:])


def test_every_task_has_a_picture_and_a_video() -> None:
    """The tasks' names are the ends of the environments' ids."""
    for task in ("Reach", "Track", "Tumour", "Insert", "Deliver"):
        name = task.lower()
        (row,) = (row for row in rows if row.files == (f"pictures/{name}.png", f"videos/{name}.mp4"))
        assert all(f"{task} " in command for command in row.commands)


def test_videos_are_small_and_wait_for_the_reader() -> None:
    """480 pixels wide, at most 300 kB; each has a poster and controls, and none plays by itself."""
    skip_without_videos()
    text = pictures.GALLERY.read_text(encoding="utf-8")
    videos = sorted((pictures.DOCS / "videos").glob("*.mp4"))
    assert text.count("<video ") == len(videos)
    assert text.count('<video controls preload="none" width="480" poster="') == len(videos)
    assert "autoplay" not in text
    for path in videos:
        assert path.stat().st_size <= LARGEST_VIDEO_B, path.name
        count, frames = pictures.frames_of(path)
        assert frames[0].shape == (270, 480, 3), path.name
        assert 25 <= count <= 201, path.name


def test_a_page_whose_pictures_have_no_commands_is_refused() -> None:
    """And so are commands that make none of the pictures beside them."""
    with pytest.raises(ValueError, match="Title: pictures and commands that make them stand together"):
        pictures.table("# Title\n\n![a](pictures/a.png)\n")
    (row,) = pictures.table("# T\n\n![a](pictures/a.png)\n\n```text\nrender \\\n    -o a.png\n```\n")
    assert row == pictures.Row(("pictures/a.png",), ("render -o a.png",))


@pytest.mark.slow
def test_another_posture_is_far_and_smoother_edges_are_near() -> None:
    """0.2 deg a cell more, or a camera turned by 10 deg, is far; unsmoothed edges and noise are near."""
    bent = view(0.02)
    noise = np.random.default_rng(0).normal(0.0, 3.0, bent.shape)
    near = [view(0.02, smooth=0), view(0.02, smooth=2), np.clip(bent + noise, 0, 255).astype(np.uint8)]
    assert max(pictures.distance(bent, other) for other in near) < 0.2 * pictures.BOUND
    far = [view(0.02 + np.radians(0.2)), view(0.02, camera_deg=10.0), bent[:, ::-1], 255 - bent, bent[:-1]]
    assert min(pictures.distance(bent, other) for other in far) > 2.0 * pictures.BOUND


def test_one_changed_colour_is_far() -> None:
    """Of the same brightness, in a hundredth of the picture; a change of one level is near."""
    plain = np.full((240, 320, 3), 120, np.uint8)
    other = plain.copy()
    other[100:128, 100:128] = (160, 120, 80)
    assert pictures.distance(plain, other) > 2.0 * pictures.BOUND
    assert pictures.distance(plain, plain + 1) < 0.2 * pictures.BOUND


def test_a_video_is_compared_by_its_frames(tmp_path: Path) -> None:
    """One frame that differs is enough; a video of another length is as far as can be."""
    frames = [np.full((48, 64, 3), 100, np.uint8) for _ in range(9)]
    for frame in frames:
        frame[10:30, 10:30] = 200
    other = [frame.copy() for frame in frames]
    other[4][10:30, 10:30] = (200, 40, 40)
    for name, shown in (("a", frames), ("b", other), ("c", frames[:8])):
        write_video(tmp_path / f"{name}.mp4", shown, fps=25, count=len(shown))
    assert pictures.files_apart(tmp_path / "a.mp4", tmp_path / "a.mp4") < 1e-9
    assert pictures.files_apart(tmp_path / "a.mp4", tmp_path / "b.mp4") > 2.0 * pictures.BOUND
    assert pictures.files_apart(tmp_path / "a.mp4", tmp_path / "c.mp4") == 1.0


def test_a_changed_picture_is_said_and_written(tmp_path: Path) -> None:
    """`--check` counts it and leaves it; `--write` replaces it; what failed is counted too."""
    command = "python -c \"from PIL import Image; Image.new('RGB', (64, 48), {}).save('a.png')\""
    row = pictures.Row(("pictures/a.png",), (command.format("'red'"),))
    assert pictures.treat(row, write=True, docs=tmp_path)[0] == 0
    assert pictures.treat(row, write=False, docs=tmp_path)[0] == 0
    changed = pictures.Row(row.files, (command.format("'blue'"),))
    wrong, says = pictures.treat(changed, write=False, docs=tmp_path)
    assert (wrong, "a.png: CHANGED" in says) == (1, True)
    assert np.asarray(Image.open(tmp_path / "pictures" / "a.png"))[0, 0].tolist() == [255, 0, 0]
    wrong, says = pictures.treat(pictures.Row(row.files, ("python -c 1/0",)), write=False, docs=tmp_path)
    assert (wrong, "ZeroDivisionError" in says) == (1, True)


def test_without_a_browser_a_screenshot_is_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reason is said."""
    (row,) = (row for row in rows if "pictures/report.png" in row.files)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    names = ", ".join(row.files)
    assert pictures.treat(row, write=False) == (0, f"{names}: skipped: Chromium is missing")


@pytest.mark.slow
@pytest.mark.parametrize("row", rows, ids=lambda row: Path(row.files[0]).stem)
def test_pictures_are_those_that_their_commands_make(row) -> None:
    """As `--check` says it, file by file."""
    skip_without_videos()
    wrong, says = pictures.treat(row, write=False)
    if "skipped" in says:
        pytest.skip(says)
    assert wrong == 0, says
