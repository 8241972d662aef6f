"""Robots as MuJoCo models, alone or in somebody's scene."""
