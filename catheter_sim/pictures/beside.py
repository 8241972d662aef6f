"""What stands in a picture besides the robot: where words find room, measured points, a joint's profile."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.kind import CloseUp
from catheter_sim.mjcf.names import TIP, face
from catheter_sim.pictures.images import (
    MEASURED,
    NO_TENSION,
    WIDER,
    Place,
    PulledTendons,
    paint_points,
    paint_tendon,
    tendon_path,
    tension_colours,
)

# ----------------------------------------------------------------------------------------------------
# Where a rectangle finds room in a picture: on no pixel that is taken, near a corner.

_STEP_PX = 4  # between places that are tried
_OWN_CORNER = 0.05  # what a pixel away from the wanted corner costs over one away from the nearest corner


@dataclass(frozen=True)
class Item:
    """Something that stands beside the robot.

    Attributes:
        name: what it is called where it finds no room.
        size: width and height, margins included [pixels].
        corner: where it stands if there is room: row and column, 0 first, 1 last.
    """

    name: str
    size: tuple[int, int]
    corner: tuple[int, int]


def free_place(taken: NDArray[np.bool_], item: Item) -> Place | None:
    """Return the place nearest to a corner at which `item` covers no pixel that is `taken`.

    Args:
        taken: shape (height, width).
        item: what needs room.

    Returns:
        Its left and top edge [pixels], None where there is no room.
    """
    height, width = taken.shape
    across, down = item.size
    if across > width or down > height:
        return None
    left = np.unique(np.append(np.arange(0, width - across, _STEP_PX), width - across))
    top = np.unique(np.append(np.arange(0, height - down, _STEP_PX), height - down))
    total = np.pad(taken.cumsum(axis=0, dtype=np.int32).cumsum(axis=1), ((1, 0), (1, 0)))
    upper, lower = total[top], total[top + down]
    covered = (lower - upper)[:, left + across] - (lower - upper)[:, left]
    beside, above = np.minimum(left, width - across - left), np.minimum(top, height - down - top)
    own_beside = np.abs(left - item.corner[1] * (width - across))
    own_above = np.abs(top - item.corner[0] * (height - down))
    cost = (above + _OWN_CORNER * own_above)[:, np.newaxis] + beside + _OWN_CORNER * own_beside
    cost[covered > 0] = np.inf
    row, column = divmod(int(np.argmin(cost)), len(left))
    return (int(left[column]), int(top[row])) if np.isfinite(cost[row, column]) else None


def free_places(taken: NDArray[np.bool_], items: Iterable[Item]) -> dict[str, Place]:
    """Return places of `items` by name, none on another; what comes first chooses first.

    What finds no room is missing.
    """
    left_over, found = taken.copy(), {}
    for item in items:
        place = free_place(left_over, item)
        if place is not None:
            found[item.name] = place
            left_over[place[1] : place[1] + item.size[1], place[0] : place[0] + item.size[0]] = True
    return found


# ----------------------------------------------------------------------------------------------------
# Tendons as a picture shows them: grey without tension, side by side where they share a hole.


@dataclass(frozen=True)
class TendonLook:
    """From where a picture of tendons is taken.

    Attributes:
        backward: from what is seen to the camera, shape (3,), of length 1.
        least_radius_m: of a tendon as it is drawn: thinner ones are lost between pixels.
    """

    backward: Array
    least_radius_m: float

    def beside(self, step: Array) -> Array:
        """Return the direction across a stretch in the picture, shape (3,); 0 for one that is seen end on."""
        across = np.cross(step, self.backward)
        length = float(np.linalg.norm(across))
        return np.asarray(across / length if length > 0.0 else across)


def paint_pulled(
    scene: mujoco.MjvScene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    pulled: PulledTendons,
    tensions: Sequence[Array],
    full_N: float,
    look: TendonLook,
) -> None:
    """Let `scene` show tension where there is any: a tendon without is grey, and no wider than it is.

    Tendons that share a hole are moved apart in the picture, so that none hides another.

    Args:
        tensions: of each pulled tendon, stretch by stretch [N]; none: not known.
        full_N: what is drawn in the last colour.
        look: from where the picture is taken.
    """
    shares = [tension / full_N if full_N > 0.0 else 0.0 * tension for tension in tensions]
    shares = shares or [np.zeros(0)] * len(pulled.pulls)
    taut = [len(share) > 0 and bool(share.max() > NO_TENSION) for share in shares]
    radii = [
        max((WIDER if pulls else 1.0) * float(model.tendon_width[tendon]), look.least_radius_m)
        for (_, tendon), pulls in zip(pulled.pulls, taut, strict=True)
    ]
    aside = np.zeros(len(radii))
    for group in pulled.groups:
        widths = np.array([2.0 * radii[index] for index in group])
        aside[list(group)] = np.cumsum(widths) - 0.5 * widths - 0.5 * widths.sum()
    places = {tendon: index for index, (_, tendon) in enumerate(pulled.pulls)}
    for geom in scene.geoms[: scene.ngeom]:
        if geom.objtype == int(mujoco.mjtObj.mjOBJ_TENDON) and geom.objid in places:
            index = places[geom.objid]
            geom.rgba[:] = tension_colours(0.0)
            geom.size[:2] = geom.size[:2] if taut[index] else radii[index]
            geom.pos[:] += aside[index] * look.beside(geom.mat[:, 2])
    for index, (_, tendon) in enumerate(pulled.pulls):
        if taut[index]:
            path = tendon_path(model, data, tendon)
            moves = [aside[index] * look.beside(step) for step in np.diff(path, axis=0)]
            paint_tendon(scene, path, shares[index], radii[index], moves)


# ----------------------------------------------------------------------------------------------------
# Measured points beside the computed robot: balls, lines from where they are computed, a ghost through them.

GHOST_POINTS = 3  # bodies and tip that must be measured to show a robot through them
GHOST_SHARE = 0.35  # of a picture's colours, where the ghost is
_PIECES = 8  # of the ghost from one measured point to the next
_LINE = 0.3  # a line's radius over a ball's


@dataclass(frozen=True)
class MeasuredPoints:
    """Points that were measured beside a history of inputs.

    Attributes:
        names: "tip", "body_<k>" or "marker_<name>".
        places: of each at the inputs' rows, shape (r, k, 3) [m]; NaN is missing.
    """

    names: tuple[str, ...]
    places: Array

    def words(self) -> str:
        """Return in a line what is drawn of them."""
        names = ", ".join(self.names)
        if len(along(self.names)) < GHOST_POINTS:
            return f"measured: {names}: blue balls, lines from the computed points"
        return (
            f"measured: {names}: blue balls, lines from the computed points, a see-through robot along them"
        )


def along(names: Sequence[str]) -> list[int]:
    """Return which of the points lie on the robot's axis, base to tip: bodies and the tip."""
    place = {
        index: np.inf if name == TIP else float(name.removeprefix("body_"))
        for index, name in enumerate(names)
        if name == TIP or name.startswith("body_")
    }
    return sorted(place, key=lambda index: place[index])


def computed_points(model: mujoco.MjModel, data: mujoco.MjData, names: Sequence[str]) -> Array:
    """Return where the model as it stands has the named points, shape (k, 3) [m]; NaN: it has no such."""
    found = np.full((len(names), 3), np.nan)
    for index, name in enumerate(names):
        site = face(int(name.removeprefix("body_"))) if name.startswith("body_") else name
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, site)
        if number >= 0:
            found[index] = data.site_xpos[number]
    return found


def ghost_line(names: Sequence[str], points: Array) -> Array:
    """Return a smooth line from the base through the measured points on the axis, shape (n, 3) [m].

    It leaves the base along z. It is empty where fewer than `GHOST_POINTS` are measured.
    """
    from scipy.interpolate import CubicSpline  # takes a while, which few pictures need

    on_axis = points[along(names)]
    on_axis = on_axis[np.isfinite(on_axis).all(axis=1)]
    if len(on_axis) < GHOST_POINTS:
        return np.zeros((0, 3))
    through = np.concatenate([np.zeros((1, 3)), on_axis])
    step = np.linalg.norm(np.diff(through, axis=0), axis=1)
    through, step = through[np.append(True, step > 0.0)], step[step > 0.0]
    at = np.append(0.0, np.cumsum(step))
    curve = CubicSpline(at, through, bc_type=((1, (0.0, 0.0, 1.0)), (2, (0.0, 0.0, 0.0))))
    fine = np.interp(np.arange((len(at) - 1) * _PIECES + 1) / _PIECES, np.arange(len(at)), at)
    return np.asarray(curve(fine))


def paint_measured(scene: mujoco.MjvScene, points: Array, computed: Array, size_m: float) -> None:
    """Add measured points, shape (k, 3) [m], to `scene`: balls of radius `size_m`, and lines.

    `computed`: where the model has them; NaN: no line is drawn.
    """
    paint_points(scene, points, size_m)
    for start, end in zip(computed, points, strict=True):
        if np.isfinite([start, end]).all():
            paint_line(scene, np.stack([start, end]), _LINE * size_m, MEASURED)


def paint_line(
    scene: mujoco.MjvScene,
    points: Array,
    radius_m: float,
    colour: Sequence[float] | NDArray[np.float32],
    shape: mujoco.mjtGeom = mujoco.mjtGeom.mjGEOM_CAPSULE,
) -> None:
    """Add a line through `points`, shape (n, 3) [m], to `scene`, as far as it has room."""
    rgba = np.asarray(colour, np.float32)
    for start, end in pairwise(points):
        if scene.ngeom >= scene.maxgeom:
            return
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, shape, np.zeros(3), np.zeros(3), np.eye(3).ravel(), rgba)
        mujoco.mjv_connector(geom, shape, radius_m, start, end)
        scene.ngeom += 1


# ----------------------------------------------------------------------------------------------------
# The close-up of a joint: its profile as lines.

_OUTLINE = 0.01  # radius of a profile's line over the height that the close-up shows


def paint_close_up(scene: mujoco.MjvScene, shown: CloseUp) -> None:
    """Add the lines of a close-up to `scene`."""
    for points, colour in shown.lines:
        paint_line(scene, points, _OUTLINE * shown.height_m, colour)
