"""The meshes that a robot's links show in its model: without mass, and touching nothing."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh

from catheter_sim.mjcf.colours import Colour
from catheter_sim.mjcf.document import Element

_LEAST_VOLUME_M3 = 2e-15  # MuJoCo takes no smaller mesh for a solid than half of it; as a shell it does
GROUP = 2  # MuJoCo's habit for what is only to be seen
SEEN: Mapping[str, Any] = {"type": "mesh", "group": GROUP, "contype": 0, "conaffinity": 0, "mass": 0}


@dataclass(frozen=True)
class Part:
    """One mesh that a link shows.

    Attributes:
        mesh_key: name of the mesh.
        name_prefix: what it is ("backbone"); the geom's name is `<prefix>_<link>`.
        z_offset: where the mesh's origin lies along the link's z [m].
        z_turn: by how much the mesh is turned about the link's z [rad]: the holes' rest twist.
        rgba: its colour.
        material: name of a material of `modelling.scene.add_scene`.
        is_backbone: whether the render check looks at it.
    """

    mesh_key: str
    name_prefix: str
    z_offset: float
    z_turn: float
    rgba: Colour
    material: str
    is_backbone: bool


def inline(mesh: trimesh.Trimesh) -> tuple[str, str]:
    """Return the `vertex` and `face` texts of an MJCF mesh, vertices to a nanometre."""
    vertices = np.round(mesh.vertices, 9) + 0.0  # + 0.0 turns -0 into 0
    vertex = " ".join(f"{value:.9g}" for value in vertices.ravel())
    return vertex, " ".join(str(index) for index in mesh.faces.ravel())


def add_mesh(root: Element, name: str, mesh: trimesh.Trimesh, shell: bool | np.bool = False) -> None:
    """Add a mesh; as a shell it may be open, or too small for a solid."""
    vertex, face = inline(mesh)
    inertia = "shell" if shell else None
    root.part("asset").add("mesh", name=name, vertex=vertex, face=face, inertia=inertia)


def add_parts(
    root: Element,
    bodies: Sequence[Element],
    meshes: Mapping[str, trimesh.Trimesh],
    parts_of: Callable[[int], tuple[Part, ...]],
) -> None:
    """Add `meshes` to the model `root`, and geoms `<part>_<link>` (`Part.name_prefix`).

    Args:
        root: the model; its materials are those of `modelling.scene.add_scene`.
        bodies: what carries the base (link 0), then the links' bodies from base to tip.
        meshes: every mesh that a part names.
        parts_of: what a link shows, by its number.
    """
    for key, mesh in meshes.items():
        add_mesh(root, key, mesh, abs(mesh.volume) < _LEAST_VOLUME_M3)
    for index, body in enumerate(bodies):
        for part in parts_of(index):
            body.add(
                "geom",
                name=f"{part.name_prefix}_{index}",
                mesh=part.mesh_key,
                pos=(0.0, 0.0, part.z_offset),
                quat=(math.cos(part.z_turn / 2.0), 0.0, 0.0, math.sin(part.z_turn / 2.0)),
                rgba=part.rgba,
                material=part.material,
                **SEEN,
            )
