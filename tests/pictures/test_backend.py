"""Drawing needs no screen and no setting; without EGL one line says what to install."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import partial

import gymnasium
import mujoco
import pytest
from gymnasium.vector import AsyncVectorEnv

from catheter_sim.errors import InputError
from catheter_sim.pictures.images import open_renderer

# `mujoco` comes first, as in a program that has used it long before it draws.
PROGRAM = """
import os, mujoco
from catheter_sim.errors import InputError
from catheter_sim.pictures.images import open_renderer
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
from catheter_sim.platforms import require_mujoco
try:
    require_mujoco()
except InputError as error:
    print("error", error)
"""

# A child of a process that has drawn: what it prints, and that it ends within 20 s.
FORK = """
import os, signal, sys, mujoco
from catheter_sim.errors import InputError
from catheter_sim.pictures.images import open_renderer
model = mujoco.MjModel.from_xml_string("<mujoco/>")
renderer = open_renderer(model, 64, 48)
if sys.argv[1] == "closed":
    renderer.close()
child = os.fork()
if child == 0:
    signal.alarm(20)
    try:
        open_renderer(model, 64, 48) if sys.argv[1] != "taken along" else renderer.render()
    except InputError as error:
        print("child:", error, flush=True)
    renderer.close()
    sys.exit(7)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), renderer.width)
"""


def run(program: str, *arguments: str, **changes: str | None) -> list[str]:
    """Return the lines that a fresh Python prints, its environment changed; nothing may go to stderr."""
    environment = {key: value for key, value in os.environ.items() if key not in ("MUJOCO_GL", "DISPLAY")}
    environment |= {key: value for key, value in changes.items() if value is not None}
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
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


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.parametrize("what", ["open", "closed", "taken along"])
def test_the_child_of_a_process_that_has_drawn_says_why_it_cannot(what: str) -> None:
    """MuJoCo's own renderer would wait forever, at its first picture and at the process's end."""
    said, ended = run(FORK, what)
    assert said.startswith("child: cannot draw: this process was forked from one that has drawn")
    assert "context='spawn'" in said
    assert ended == "7 64"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*ERROR")  # Gymnasium's words for what a child raises
@pytest.mark.parametrize("context", ["fork", "spawn"])
def test_copies_in_processes_draw_where_they_can(context: str) -> None:
    """After the parent's picture: forked environments end in one line, spawned ones draw."""
    name = "catheter_sim/NeuroendoscopeSectionReach-v0"
    make = partial(gymnasium.make, f"catheter_sim:{name}", observation="pixels", disable_env_checker=True)
    straight = {"target": (0.0, 0.0, 0.06)}
    env = make()
    env.reset(seed=0, options=straight)
    many = AsyncVectorEnv([make], context=context)
    try:
        if context == "fork":
            with pytest.raises(InputError, match=r"forked from one that has drawn; start it with context"):
                many.reset(options=straight)
        else:
            pictures, _ = many.reset(options=straight)
            assert pictures.shape == (1, 64, 64, 3)
            assert pictures.any()
    finally:
        many.close(terminate=True)
        env.close()
