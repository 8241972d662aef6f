"""What differs between Linux, macOS and Windows: held files, signals, a parent's end, drawing, processors."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import platform
import signal
import stat
import time
from contextlib import suppress

from catheter_sim.errors import InputError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

# There a file that a process has open is neither removed nor renamed, and an orphan keeps its parent's id.
WINDOWS = os.name == "nt"
_LET_GO_S = 60.0  # a file is let go before it is renamed there, at once: one that is older was left
_LOOK_EVERY_S = 0.5  # whether the parent is still there
_ENDING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # the last is Windows'
BACKEND_VARIABLE = "MUJOCO_GL"  # read by MuJoCo once, as it is imported
_BACKENDS = {"Linux": "egl", "Darwin": "cgl"}
_NEEDED = {
    "Linux": "EGL is needed; on Debian: apt install libegl1 libgl1-mesa-dri",
    "Darwin": "macOS's own OpenGL is needed",
}


def hold(descriptor: int) -> None:
    """Hold an open file until it is closed: `remove_if_left` of no process takes it meanwhile.

    Windows holds open files by itself. A system that knows neither holds none, and removes none.
    """
    if fcntl is not None:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(descriptor, fcntl.LOCK_EX)


def remove_if_left(path: str) -> None:
    """Remove a regular file that nobody holds; what cannot be removed stays."""
    with suppress(OSError):
        if fcntl is None:
            found = os.lstat(path)
            if WINDOWS and stat.S_ISREG(found.st_mode) and time.time() - found.st_mtime > _LET_GO_S:
                os.unlink(path)
            return
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if stat.S_ISREG(os.fstat(descriptor).st_mode):
                os.unlink(path)
        finally:
            os.close(descriptor)


def ending_signals() -> list[signal.Signals]:
    """Return the signals of this system that ask a program to end."""
    return [getattr(signal, name) for name in _ENDING if hasattr(signal, name)]


def set_alarm(seconds: int) -> None:
    """Let the system end this process after so many seconds, 0 for never; does nothing on Windows [s]."""
    if hasattr(signal, "alarm"):
        signal.alarm(seconds)


def wait_for_parents_end(parent: int) -> None:
    """Return once the process with the id `parent`, which has started this one, has ended."""
    known = multiprocessing.parent_process()
    if WINDOWS and known is not None:
        known.join()
        return
    while os.getppid() == parent:
        time.sleep(_LOOK_EVERY_S)


def offscreen_backend() -> str:
    """Return the backend by which MuJoCo draws without a screen here, "" for the one it takes by itself."""
    return _BACKENDS.get(platform.system(), "")


def require_mujoco() -> None:
    """Import `mujoco`, which a backend that is named but not installed prevents.

    Raises:
        InputError: `MUJOCO_GL` names no backend, or one that is not installed.
    """
    try:
        importlib.import_module("mujoco")
    except (AttributeError, RuntimeError) as error:  # PyOpenGL's and MuJoCo's ways to say so
        raise no_context(error) from None


def no_context(error: Exception) -> InputError:
    """Return the line that says why nothing can be drawn, and what is needed."""
    reason = " ".join(str(error).split()).partition(". ")[0] or type(error).__name__
    setting = os.environ.get(BACKEND_VARIABLE, "").strip()
    own = offscreen_backend()
    hint = f" with {BACKEND_VARIABLE}={setting}" if setting.lower() not in ("", own) else ""
    hint += f" (unset, it means {own.upper()})" if hint and own else ""
    needed = _NEEDED.get(platform.system(), "a graphics driver with OpenGL is needed")
    return InputError(f"cannot draw{hint}: {needed} ({reason})")


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
