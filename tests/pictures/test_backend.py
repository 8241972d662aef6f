"""Drawing needs no screen and no setting; without EGL one line says what to install."""

from __future__ import annotations

import os
import subprocess
import sys

import mujoco
import pytest

from catheter_sim.errors import InputError
from catheter_sim.pictures.backend import open_renderer

# `mujoco` comes first, as in a program that has used it long before it draws.
PROGRAM = """
import os, mujoco
from catheter_sim.errors import InputError
from catheter_sim.pictures.backend import open_renderer
model = mujoco.MjModel.from_xml_string("<mujoco/>")
try:
    with open_renderer(model, 64, 48) as renderer:
        renderer.update_scene(mujoco.MjData(model))
        print("drawn", renderer.render().shape, os.environ.get("MUJOCO_GL"))
except InputError as error:
    print("error", error)
"""
BEFORE_IMPORT = """
from catheter_sim.errors import InputError
from catheter_sim.pictures.backend import require_mujoco
try:
    require_mujoco()
except InputError as error:
    print("error", error)
"""


def run(program: str, **changes: str | None) -> list[str]:
    """Return the lines that a fresh Python prints, its environment changed; nothing may go to stderr."""
    environment = {key: value for key, value in os.environ.items() if key not in ("MUJOCO_GL", "DISPLAY")}
    environment |= {key: value for key, value in changes.items() if value is not None}
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return done.stdout.splitlines()


@pytest.mark.slow
def test_unset_backend_means_egl_even_after_mujoco_was_imported() -> None:
    """A program that imported `mujoco` without a setting draws, and its environment is left as it was."""
    assert run(PROGRAM) == ["drawn (48, 64, 3) None"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent.json"},  # a loader without a driver
        {"MUJOCO_GL": "glfw"},  # a window where there is no screen
        {"MUJOCO_GL": "disable"},
    ],
    ids=("no driver", "no screen", "disabled"),
)
def test_without_egl_one_line_names_the_packages(changes: dict[str, str]) -> None:
    """Whatever is missing, the error is one line that says what to install."""
    (line,) = run(PROGRAM, **changes)
    assert line.startswith("error cannot draw")
    assert "apt install libegl1 libgl1-mesa-dri" in line


@pytest.mark.slow
@pytest.mark.parametrize("setting", ["egl", "nonsense"])
def test_setting_that_breaks_the_import_of_mujoco_is_one_line(
    setting: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """`MUJOCO_GL` of a backend that is not installed, or of none, is an input error and no traceback."""
    folder = tmp_path_factory.mktemp("libraries")
    (folder / "libEGL.so.1").touch()  # found first by the loader, and no library
    (folder / "libEGL.so").touch()
    (line,) = run(BEFORE_IMPORT, MUJOCO_GL=setting, LD_LIBRARY_PATH=str(folder))
    assert line.startswith("error cannot draw")
    assert "libegl1" in line


@pytest.mark.parametrize("size", [(8, 48), (64, 100_000)])
def test_size_of_no_picture_is_refused(size: tuple[int, int]) -> None:
    """Too small and too large sizes name the side and its limits."""
    with pytest.raises(InputError, match="16 to 4096 pixels a side"):
        open_renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), *size)


def test_picture_may_be_larger_than_the_models_buffer() -> None:
    """The offscreen buffer in a model file (640 x 480 by default) does not limit the picture."""
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    with open_renderer(model, 800, 600) as renderer:
        renderer.update_scene(mujoco.MjData(model))
        assert renderer.render().shape == (600, 800, 3)
