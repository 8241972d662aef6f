"""Placeholder visuals until meshes are wired."""
from __future__ import annotations
def add_visuals(root, robot, bodies):
    return None
