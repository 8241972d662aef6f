"""Robots as MJCF: written with PyMJCF, read by plain `mujoco`."""

# Before any other import of dm_control, which would look for a window or for EGL.
from catheter_sim.mjcf import backend as _backend  # noqa: F401
