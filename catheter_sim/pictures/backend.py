"""An OpenGL context without a screen: which backend, and one line where there is none.

MuJoCo picks its backend from the environment variable `MUJOCO_GL` once, as `mujoco` is imported, and
takes a window where it is unset. Here an unset variable means EGL, also where `mujoco` was imported
long before. The variable itself is left alone: `MUJOCO_GL=egl` breaks `import mujoco` on a machine
without an EGL library, which needs none to simulate.

OpenGL does not survive a fork: the child of a process that has drawn would wait forever for threads that only
its parent has. It gets an error instead.
"""

from __future__ import annotations

import atexit
import importlib
import os
import platform
import sys
import warnings
from functools import cache
from typing import TYPE_CHECKING, Any

from catheter_sim.errors import InputError

if TYPE_CHECKING:
    import mujoco

SMALLEST_SIDE, LARGEST_SIDE = 16, 4096  # of a picture [pixels]
_VARIABLE = "MUJOCO_GL"
_drew: set[int] = set()  # numbers of the processes that have drawn: this one, and those it was forked from
_PACKAGES = "EGL is needed; on Debian: apt install libegl1 libgl1-mesa-dri"


def require_mujoco() -> None:
    """Import `mujoco`, which a backend that is named but not installed prevents.

    Raises:
        InputError: `MUJOCO_GL` names no backend, or one that is not installed.
    """
    try:
        importlib.import_module("mujoco")
    except (AttributeError, RuntimeError) as error:  # PyOpenGL's and MuJoCo's ways to say so
        raise _no_context(error) from None


def open_renderer(model: mujoco.MjModel, width: int, height: int) -> mujoco.Renderer:
    """Return an offscreen renderer for pictures of `width` x `height` pixels; close it after use.

    The model's offscreen buffer is enlarged where the picture needs it.

    Raises:
        InputError: the size is no picture's, no OpenGL context can be had, or the process was forked from one
            that has drawn. What is opened raises the last too, where a fork took it along.
    """
    if _drew - {os.getpid()}:
        raise _forked()
    require_mujoco()
    for name, value in (("width", width), ("height", height)):
        if not SMALLEST_SIDE <= value <= LARGEST_SIDE:
            limits = f"{SMALLEST_SIDE} to {LARGEST_SIDE}"
            raise InputError(f"{name} = {value}: a picture has {limits} pixels a side")
    model.vis.global_.offwidth = max(model.vis.global_.offwidth, width)
    model.vis.global_.offheight = max(model.vis.global_.offheight, height)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # GLFW warns; what follows says it in one line
            _choose_backend()
            return _renderer_class()(model, height, width)
    except Exception as error:  # ctypes, PyOpenGL and MuJoCo each raise classes of their own
        raise _no_context(error) from None


@cache
def _renderer_class() -> type[mujoco.Renderer]:
    import mujoco

    class Renderer(mujoco.Renderer):
        """MuJoCo's, but that it raises in a forked child, where MuJoCo's would hang."""

        def __init__(self, *arguments: Any) -> None:
            self._process = os.getpid()
            super().__init__(*arguments)
            _drew.add(self._process)

        def render(self, **arguments: Any) -> Any:
            if self._process != os.getpid():
                raise _forked()
            return super().render(**arguments)

        def close(self) -> None:
            if self._process == os.getpid():
                super().close()

    return Renderer


def _forked() -> InputError:
    at_exit = getattr(sys.modules.get("mujoco.egl"), "_terminate_display", None)
    if at_exit is not None:  # it would hang as well
        atexit.unregister(at_exit)
    return InputError(
        "cannot draw: this process was forked from one that has drawn; start it with context='spawn' "
        "(AsyncVectorEnv, multiprocessing)"
    )


def _choose_backend() -> None:
    """Let `mujoco.Renderer` use the backend that `MUJOCO_GL` names now; on Linux EGL where it is unset."""
    import mujoco

    setting = os.environ.get(_VARIABLE)
    wanted = (setting or "").strip().lower() or ("egl" if platform.system() == "Linux" else "")
    module = sys.modules[mujoco.Renderer.__module__].gl_context  # where it takes `GLContext` from
    present = getattr(getattr(module, "GLContext", None), "__module__", "")
    if not wanted or present == f"mujoco.{wanted}":
        return
    os.environ[_VARIABLE] = wanted
    try:
        importlib.reload(module)
    finally:
        if setting is None:
            del os.environ[_VARIABLE]
        else:
            os.environ[_VARIABLE] = setting


def _no_context(error: Exception) -> InputError:
    reason = " ".join(str(error).split()).partition(". ")[0] or type(error).__name__
    setting = os.environ.get(_VARIABLE, "").strip()
    hint = f" with {_VARIABLE}={setting} (unset, it means EGL)" if setting.lower() not in ("", "egl") else ""
    return InputError(f"cannot draw{hint}: {_PACKAGES} ({reason})")
