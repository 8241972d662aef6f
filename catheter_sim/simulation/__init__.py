"""Robots in MuJoCo, with the laws that run beside its step."""
