"""PyMJCF (`dm_control.mjcf`), imported without a window system, an EGL library or a warning.

dm_control chooses an OpenGL backend as it is imported: without `MUJOCO_GL` it tries a window, and
warns on a machine without a screen; with `MUJOCO_GL=egl` it fails where no EGL is installed. Writing a
model draws nothing, so it is told to choose none. MuJoCo reads the same variable, once, as it is
imported, and must see what the user set: hence the order of the lines below.
"""

from __future__ import annotations

import os

import mujoco  # noqa: F401  # before the variable changes

_before = os.environ.get("MUJOCO_GL")
os.environ["MUJOCO_GL"] = "disable"
try:
    from dm_control import mjcf
finally:
    if _before is None:
        del os.environ["MUJOCO_GL"]
    else:
        os.environ["MUJOCO_GL"] = _before

__all__ = ["mjcf"]
