"""Robots as MJCF: written as text (`document.py`), read by `mujoco`."""
