"""The render checks: a simulated robot's pixels against those of the same parts where statics have them.

The robot is simulated, and its model is drawn by MuJoCo with a stripe along it that marks its roll. Two
cameras stand still, across each other. The picture that statics promise is made without MuJoCo: each part's
triangles at the analytic frame of its element, through a pinhole camera, nearest first. Part by part the
centres of both pictures' pixels are compared, so that what hides behind what is the same in both.

Where a part lies in its element's frame is taken from the straight robot; `off_axis_m` holds it to the axis.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import trimesh
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.channels import outputs_of
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mjcf import names
from catheter_sim.modelling.build import View, remembered_mjcf, views
from catheter_sim.pictures.images import PinholeCamera, open_renderer, projection_matrix
from catheter_sim.robots import kind_of
from catheter_sim.robots.catheter.description import elements, hinge_counts, hinge_heights_m, turning
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.replay import RAMP_S, simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.lines import NO_GRAVITY, Line, Validation, given

WIDTH, HEIGHT = 640, 480  # of a picture [pixels]
MEAN_PX, WORST_PX = 0.4, 1.0  # tolerances [pixels]: of a section's mean offset, and of any one part's
_LEAST_PIXELS = 8  # of a part: with fewer its centre says little, and it is not compared
BODY, STRIPE = KINDS = ("body", "stripe")  # drawn one at a time, so that neither hides the other
_SHOWN, _STRIPES, _HIDDEN = 0, 1, 5  # groups of geoms
_RED = (0.85, 0.1, 0.1, 1.0)  # of the stripe

# ----------------------------------------------------------------------------------------------------
# The check's own model: the robot's, with a piece of a stripe on each element.

# The stripe lies where both cameras see it on a straight robot: between -y and +x [rad].
_STRIPE_RAD = -math.pi / 4.0
_WIDTH, _THICKNESS = 0.4, 0.2  # of the stripe, over the robot's radius
_LENGTH = 0.8  # of a piece at most, over its element's length


def cameras(robot: RobotSpec) -> tuple[View, View]:
    """Return the model's `side` camera and one across it, both level, chosen from the straight robot."""
    side = next(view for view in views(robot) if view.name == "side")
    return side, replace(side, name="across", backward=np.array([1.0, 0.0, 0.0]))


def mm_per_px(robot: RobotSpec) -> float:
    """Return what a pixel of both cameras' pictures measures at the robot's base [mm]."""
    return 1e3 * cameras(robot)[0].height / HEIGHT


@dataclass(frozen=True)
class MarkedModel:
    """A robot's model with a stripe, and what of it is compared.

    Parts are the fixed base, number 0, and the elements that have a face, base to tip.

    Attributes:
        model: with the cameras of `cameras`.
        part: of each geom, shape (ngeom,); -1: not compared, nor drawn.
        stripe: whether a geom is a piece of the stripe, shape (ngeom,).
        face: the site in each element's distal face, base to tip, shape (n,).
        section: of each part, shape (n + 1,): 0 is the base.
        triangles: of each geom that is drawn, in its part's frame, shape (m, 3, 3) [m]; by geom.
        geom_pos, site_pos: of the straight robot's model, shapes (ngeom, 3) and (nsite, 3) [m].
    """

    model: mujoco.MjModel
    part: NDArray[np.int64]
    stripe: NDArray[np.bool_]
    face: NDArray[np.int64]
    section: NDArray[np.int64]
    triangles: dict[int, Array]
    geom_pos: Array
    site_pos: Array


def marked(robot: RobotSpec) -> MarkedModel:
    """Return the model of `robot` with a stripe and two cameras across each other."""
    spec = mujoco.MjSpec.from_string(remembered_mjcf(robot))
    count = outputs_of(robot).elements
    rest = _rest(spec.compile(), count)[0]
    radius = max(segment.outer_radius_m for segment in robot.segments)
    for number, length in enumerate(np.diff(rest[:, 2]), 1):
        _add_stripe(spec.site(names.face(number)), number, radius, float(length))
    across = cameras(robot)[1]
    turn = np.zeros(4)
    mujoco.mju_mat2Quat(turn, np.column_stack([*across.axes, across.backward]).ravel())
    spec.worldbody.add_camera(name=across.name, pos=across.position, quat=turn, fovy=across.fovy_deg)
    ends = np.cumsum([segment.length_m for segment in robot.segments])
    section = np.searchsorted(ends, rest[:, 2] - 1e-6)  # to a micrometre
    section[0] = -1
    return _numbered(robot, spec.compile(), count, section)


def _rest(model: mujoco.MjModel, count: int) -> tuple[Array, Array, mujoco.MjData]:
    """Return where base and faces are in the straight robot, (n + 1, 3) [m], (n + 1, 3, 3), and its data."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    sites = [model.site(names.face(number)).id for number in range(1, count + 1)]
    place = np.concatenate([np.zeros((1, 3)), data.site_xpos[sites]])
    turn = np.concatenate([np.eye(3)[None], data.site_xmat[sites].reshape(-1, 3, 3)])
    return place, turn, data


def _add_stripe(face: mujoco.MjsSite, number: int, radius: float, length: float) -> None:
    """Add a box on the robot's surface below a face, which turns with it."""
    half = np.array(
        [0.5 * _THICKNESS * radius, 0.5 * _WIDTH * radius, 0.5 * min(_LENGTH * length, 2.0 * radius)]
    )
    out = radius + half[0]
    place = np.array([out * math.cos(_STRIPE_RAD), out * math.sin(_STRIPE_RAD), -half[2]])
    face.parent.add_geom(
        name=f"{STRIPE}_{number}",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=half,
        pos=np.asarray(face.pos) + place,
        quat=[math.cos(_STRIPE_RAD / 2.0), 0.0, 0.0, math.sin(_STRIPE_RAD / 2.0)],
        rgba=_RED,
        mass=0.0,
        contype=0,
        conaffinity=0,
    )


def _numbered(robot: RobotSpec, model: mujoco.MjModel, count: int, section: NDArray[np.int64]) -> MarkedModel:
    """Return the model with its geoms told apart, and groups by which either kind is drawn alone."""
    place, turn, data = _rest(model, count)
    face = np.array([model.site(names.face(number)).id for number in range(1, count + 1)])
    of_body = np.full(model.nbody, -1)
    of_body[0] = 0
    of_body[model.site_bodyid[face]] = np.arange(1, count + 1)
    part = of_body[model.geom_bodyid]
    stripe = np.array([model.geom(k).name.startswith(f"{STRIPE}_") for k in range(model.ngeom)])
    part[_left_behind(robot, model, face) & ~stripe] = -1
    model.geom_group[:] = np.where(part < 0, _HIDDEN, np.where(stripe, _STRIPES, _SHOWN))
    triangles = {}
    for geom in np.flatnonzero(part >= 0):
        corners = _triangles(model, int(geom)) @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        triangles[int(geom)] = (corners - place[part[geom]]) @ turn[part[geom]]
    at = model.geom_pos.copy(), model.site_pos.copy()
    return MarkedModel(model, part, stripe, face, section, triangles, *at)


def _left_behind(robot: RobotSpec, model: mujoco.MjModel, face: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which geoms do not keep their place beside their element's face: halves of soft links.

    Where faces are moved, a body's geoms stay, or some follow: then those that stay are its other half.
    """
    moved = copy.copy(model)
    moved.site_pos[face, 2] -= 1e-3  # a millimetre: any length would do
    follows = (kind_of(robot).picture.geom_places(robot, moved) != model.geom_pos).any(axis=1)
    halved = np.isin(model.geom_bodyid, model.geom_bodyid[follows])
    return np.asarray(halved & ~follows)


def _triangles(model: mujoco.MjModel, geom: int) -> Array:
    """Return a geom's triangles in its own frame, shape (m, 3, 3) [m]."""
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
        box = trimesh.creation.box(2.0 * model.geom_size[geom])
        return np.asarray(box.triangles)
    mesh = model.geom_dataid[geom]
    vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]].astype(float)
    return np.asarray(vertices[model.mesh_face[model.mesh_faceadr[mesh] :][: model.mesh_facenum[mesh]]])


# ----------------------------------------------------------------------------------------------------
# The picture that statics promise, without MuJoCo.


@compiled
def _painted(corners: Array, part: NDArray[np.int64], width: int, height: int) -> NDArray[np.int64]:
    """Return the part that each pixel's centre shows, shape (height, width); -1: none.

    Args:
        corners: image coordinates and one over the depth of triangles' corners, shape (m, 3, 3): linear
            in the picture on a flat triangle.
        part: of each triangle, shape (m,).
        width, height: of the picture [pixels].
    """
    shown = np.full((height, width), -1, np.int64)
    nearest = np.zeros((height, width))
    for k in range(len(corners)):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners[k]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        first_row = max(0, math.ceil(min(ay, by, cy) - 0.5))
        last_row = min(height - 1, math.floor(max(ay, by, cy) - 0.5))
        first = max(0, math.ceil(min(ax, bx, cx) - 0.5))
        last = min(width - 1, math.floor(max(ax, bx, cx) - 0.5))
        for row in range(first_row, last_row + 1):
            for column in range(first, last + 1):
                x, y = column + 0.5, row + 0.5
                b = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
                c = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
                if b < 0.0 or c < 0.0 or b + c > 1.0:
                    continue
                near = az + b * (bz - az) + c * (cz - az)
                if near > nearest[row, column]:
                    nearest[row, column] = near
                    shown[row, column] = part[k]
    return shown


def pinhole(view: View) -> PinholeCamera:
    """Return the camera of `view` with a picture of `WIDTH` x `HEIGHT` pixels; no model is read."""
    axes = np.column_stack([*view.axes, view.backward])
    return PinholeCamera(view.position, axes, math.radians(view.fovy_deg), WIDTH, HEIGHT)


def expected_picture(
    marks: MarkedModel, posture: Posture, camera: PinholeCamera, kind: str
) -> NDArray[np.int64]:
    """Return the part that each pixel shows where every element has its frame in `posture`; -1: none.

    `kind`: `BODY` or `STRIPE`, drawn alone.
    """
    place = np.concatenate([np.zeros((1, 3)), posture.p_w])
    turn = np.concatenate([np.eye(3)[None], posture.R_w])
    wanted = [k for k in marks.triangles if marks.stripe[k] == (kind == STRIPE)]
    corners = [marks.triangles[k] @ turn[marks.part[k]].T + place[marks.part[k]] for k in wanted]
    counts = [len(item) for item in corners]
    image = np.concatenate(corners) @ projection_matrix(camera)[:, :3].T + projection_matrix(camera)[:, 3]
    image[..., :2] /= image[..., 2:]
    image[..., 2] = 1.0 / image[..., 2]
    return np.asarray(_painted(image, np.repeat(marks.part[wanted], counts), camera.width, camera.height))


# ----------------------------------------------------------------------------------------------------
# The picture that MuJoCo draws.


def drawn_picture(
    marks: MarkedModel, renderer: mujoco.Renderer, data: mujoco.MjData, view: View, kind: str
) -> NDArray[np.int64]:
    """Return the part that each pixel shows as MuJoCo draws the model in `data`; -1: none."""
    options = mujoco.MjvOption()
    options.geomgroup[:] = 0
    options.geomgroup[_STRIPES if kind == STRIPE else _SHOWN] = 1
    for groups in (options.sitegroup, options.tendongroup, options.skingroup, options.actuatorgroup):
        groups[:] = 0
    renderer.update_scene(data, camera=view.name, scene_option=options)
    number, what = np.moveaxis(renderer.render(), 2, 0)
    return np.where(what == int(mujoco.mjtObj.mjOBJ_GEOM), marks.part[number], -1)


def stand(marks: MarkedModel, simulator: Simulator) -> mujoco.MjData:
    """Let the marked model stand as `simulator` does, and return its data.

    Rolling moves a model's hinges, links and faces (`robots.rolling.laws`); what is drawn follows its face.
    """
    model, data = marks.model, mujoco.MjData(marks.model)
    for name in ("jnt_pos", "body_pos", "site_pos"):
        getattr(model, name)[:] = getattr(simulator.model, name)
    model.geom_pos[:] = marks.geom_pos
    model.geom_pos[:] = kind_of(simulator.robot).picture.geom_places(simulator.robot, model)
    model.geom_pos[marks.stripe] += (model.site_pos - marks.site_pos)[
        marks.face[marks.part[marks.stripe] - 1]
    ]
    data.qpos[:] = simulator.data.qpos
    mujoco.mj_fwdPosition(model, data)
    return data


# ----------------------------------------------------------------------------------------------------
# Two pictures compared, part by part.


@dataclass(frozen=True)
class Offsets:
    """Where a posture's parts are drawn beside where statics have them, in both cameras.

    Attributes:
        offset_px: centre of each part's pixels less that of those expected, by camera, of body and stripe,
            shape (2, 2, n + 1, 2); NaN where a part is hidden, or drawn nowhere although it should be.
        judged: which parts are expected to be seen, shape (2, 2, n + 1).
        section: of each part, shape (n + 1,).
    """

    offset_px: Array
    judged: NDArray[np.bool_]
    section: NDArray[np.int64]

    @property
    def mean_px(self) -> float:
        """The largest signed mean along an image axis over a section's parts, as a size; NaN: undefined."""
        if not self.judged.any():
            return math.nan
        means = [
            np.abs(offset[judged & (self.section == section)].mean(axis=0)).max()
            for offset, judged in zip(
                self.offset_px.reshape(4, -1, 2), self.judged.reshape(4, -1), strict=True
            )
            for section in np.unique(self.section[judged])
        ]
        return float(np.max(means))

    @property
    def worst_px(self) -> float:
        """The largest distance of any part; NaN: undefined."""
        if not self.judged.any():
            return math.nan
        return float(np.linalg.norm(self.offset_px[self.judged], axis=1).max())

    @property
    def passed(self) -> bool:
        """Whether both are within their tolerances; undefined is not."""
        return self.mean_px <= MEAN_PX and self.worst_px <= WORST_PX


def centres(picture: NDArray[np.int64], count: int) -> tuple[Array, NDArray[np.int64]]:
    """Return the centre of each part's pixels, shape (count, 2) [pixels], and their number, (count,)."""
    row, column = np.nonzero(picture >= 0)
    part = picture[row, column]
    number = np.bincount(part, minlength=count)
    with np.errstate(invalid="ignore"):
        sums = [np.bincount(part, values + 0.5, minlength=count) / number for values in (column, row)]
    return np.stack(sums, axis=1), number


def compare(
    drawn: Sequence[NDArray[np.int64]], expected: Sequence[NDArray[np.int64]], section: NDArray[np.int64]
) -> Offsets:
    """Return the offsets between pictures of body and stripe in both cameras, in the order of `Offsets`."""
    count = len(section)
    offset = np.full((4, count, 2), np.nan)
    judged = np.zeros((4, count), dtype=bool)
    for k, (ours, theirs) in enumerate(zip(drawn, expected, strict=True)):
        place, number = centres(ours, count)
        promised, seen = centres(theirs, count)
        judged[k] = seen >= _LEAST_PIXELS
        offset[k] = np.where((judged[k] & (number > 0))[:, np.newaxis], place - promised, np.nan)
    return Offsets(offset.reshape(2, 2, count, 2), judged.reshape(2, 2, count), section)


@dataclass(frozen=True)
class RenderCase:
    """Postures of a robot that are drawn, and the static model that they are compared with.

    Attributes:
        robot: robot id.
        model: name in `STATIC_MODELS`.
        tendon: rows of inputs at the actuators, shape (r, t) [N or m].
        ramp_s: simulated time from one held row to the next [s].
        as_built: makes of a static posture that of the rigid pieces that are simulated, where statics bend
            evenly.
    """

    robot: str
    model: str
    tendon: Array
    ramp_s: float = RAMP_S
    as_built: Callable[[Any, Posture], Posture] | None = None

    def statics(self, robot: RobotSpec, tendon: Array) -> list[Posture]:
        """Return what the static model makes of `robot` under rows of inputs, shape (r, t) [N or m]."""
        run = STATIC_MODELS[self.model].solve(robot, given(tendon, robot.actuation), NO_GRAVITY)
        built = self.as_built
        return [posture if built is None else built(robot, posture) for posture in run.postures]


@dataclass(frozen=True)
class DrawnCase:
    """The simulated rows of a case as they are drawn.

    Attributes:
        robot: as it is specified.
        marks: its marked model.
        rows: of each, four pictures: body and stripe in one camera, then in the other.
    """

    robot: RobotSpec
    marks: MarkedModel
    rows: tuple[tuple[NDArray[np.int64], ...], ...]

    def offsets(self, postures: Sequence[Posture], from_views: Sequence[View] = ()) -> list[Offsets]:
        """Return each row's offsets from what statics promise, seen in the check's cameras or in others."""
        seen = [pinhole(view) for view in from_views or cameras(self.robot)]
        return [
            compare(
                row,
                [expected_picture(self.marks, posture, camera, kind) for camera in seen for kind in KINDS],
                self.marks.section,
            )
            for row, posture in zip(self.rows, postures, strict=True)
        ]


def draw(case: RenderCase) -> DrawnCase:
    """Simulate the rows of `case`, and draw each.

    Raises:
        InputError: nothing can be drawn here.
        SimulationDiverged: the simulation failed.
    """
    robot = load_robot(case.robot)
    marks = marked(robot)
    rows: list[tuple[NDArray[np.int64], ...]] = []
    with open_renderer(marks.model, WIDTH, HEIGHT) as renderer:
        renderer.enable_segmentation_rendering()

        def keep(simulator: Simulator, row: int) -> None:
            data = stand(marks, simulator)
            rows.append(
                tuple(
                    drawn_picture(marks, renderer, data, view, kind)
                    for view in cameras(robot)
                    for kind in KINDS
                )
            )

        inputs = given(case.tendon, robot.actuation)
        run = simulate(robot, inputs, NO_GRAVITY, on_row=keep, ramp_s=case.ramp_s)
    if run.failure:
        raise SimulationDiverged(f"{case.robot}: {run.failure}")
    return DrawnCase(robot, marks, tuple(rows))


def off_axis_m(drawn: DrawnCase) -> float:
    """Return how far the middle of any round part lies from the straight robot's axis, at most [m]."""
    prefixes = tuple(f"{prefix}_" for prefix in kind_of(drawn.robot).picture.CENTRELINE_PARTS)
    round_parts = [
        corners.reshape(-1, 3)[:, :2]
        for geom, corners in drawn.marks.triangles.items()
        if drawn.marks.model.geom(geom).name.startswith(prefixes)
    ]
    return max(float(np.linalg.norm(part.max(axis=0) + part.min(axis=0))) / 2.0 for part in round_parts)


# ----------------------------------------------------------------------------------------------------
# A catheter's rings are rigid. Pure kinematics bends evenly: within a joint its frames are not the rings'.


def with_rigid_rings(robot: CatheterRobot, posture: Posture) -> Posture:
    """Return a posture by pure kinematics with each ring turned about the hinges below it.

    A bending joint's ends stay where the papers' arc has them (Nayar 2022, Eqs 3-5).
    """
    p_w, R_w = posture.p_w.copy(), posture.R_w.copy()
    bends = dict(
        zip(
            (segment.name for segment in turning(robot)),
            np.split(posture.joint_angles, np.cumsum(hinge_counts(robot))[:-1]),
            strict=True,
        )
    )
    parts = elements(robot)
    for k, part in enumerate(parts):
        segment = robot.segments[part.segment]
        if segment.joint != "bending":
            continue
        below = k - part.ring  # the element before the joint; -1: the base
        place, turn = (posture.p_w[below], posture.R_w[below]) if below >= 0 else (np.zeros(3), np.eye(3))
        axis = (0.0, 1.0, 0.0) if segment.bends_toward == "x" else (-1.0, 0.0, 0.0)
        height = 0.0
        for at, angle in zip(hinge_heights_m(segment)[: part.ring], bends[segment.name], strict=False):
            place = place + (at - height) * turn[:, 2]
            turn, height = turn @ about(axis, float(angle)), float(at)
        p_w[k], R_w[k] = place + (part.face_m - height) * turn[:, 2], turn
    return replace(posture, p_w=p_w, R_w=R_w)


def about(axis: Sequence[float], angle_rad: float) -> Array:
    """Return the turn about a unit vector by an angle, shape (3, 3) (Rodrigues' formula)."""
    x, y, z = axis
    cross = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
    return np.asarray(np.eye(3) + math.sin(angle_rad) * cross + (1.0 - math.cos(angle_rad)) * cross @ cross)


# ----------------------------------------------------------------------------------------------------
# The postures of every robot that are drawn, and the lines of the validation.

# Tensions of each robot's own tendons, in its order [N]; displacements and advance in mm.
_SECTION_N = [(0.12, 0.12), (0.24, 0.12), (0.5, 0.12), (0.65, 0.12), (0.3, 0.12), (0.12, 0.3), (0.12, 0.5)]
_FULL_N = [
    (0.4, 0.05, 0.05, 0.05, 0.05, 0.05),
    (0.05, 0.3, 0.15, 0.15, 0.05, 0.05),
    (0.05, 0.4, 0.3, 0.3, 0.05, 0.05),
    (0.3, 0.05, 0.05, 0.05, 0.3, 0.3),
]
_DISK_N = [(5, 0, 0, 0), (0, 5, 0, 0), (0, 0, 5, 3), (6, 2, 0, 0), (0, 0, 4, 6)]
_CHEST_SECTION_N = [(2,), (5,), (10,), (20,), (35,), (50,), (12,), (4,)]
_CHEST_N = [
    (20, 0, 0, 0, 0, 0, 0, 0),
    (20, 0, 15, 0, 10, 0, 0, 0),
    (10, 0, 0, 15, 0, 0, 10, 0),
    (8, 0, 8, 0, 0, 5, 0, 8),
    (5, 0, 0, 0, 0, 0, 10, 0),
]
_TRANSSEPTAL_MM = [
    (1.5, 1.0, 0.0, 30.0),
    (-3.8, 1.5, 1.5, 20.0),
    (2.5, -3.4, -2.0, 30.0),
    (-2.0, 1.5, -1.0, 50.0),
    (3.5, 1.0, 2.0, 60.0),
    (1.0, 2.5, 3.0, 60.0),
]
_FOUR_DOF_MM = [
    (1.5, 1.0, 1.0, 30.0),
    (-3.3, 1.0, 2.0, 20.0),
    (2.0, 2.0, -2.0, 40.0),
    (-2.0, 3.0, 1.0, 60.0),
    (3.0, -1.5, -2.0, 50.0),
    (1.0, -4.4, 2.7, 60.0),
]
_WRIST_N = [(0.5,), (1.0,), (1.5,), (2.0,), (2.5,), (3.0,), (1.0,)]

CASES: dict[str, RenderCase] = {
    case.robot: case
    for case in (
        RenderCase("neuroendoscope_section", "fkm_sliding", np.array(_SECTION_N)),
        # Two sections with friction follow a long reversal in 2 s too fast for statics: the tip of 120 mm is
        # then up to 0.40 mm off, after 5 s 0.19 mm.
        RenderCase("neuroendoscope", "fkm_sliding", np.array(_FULL_N), ramp_s=5.0),
        RenderCase("spacer_disk", "VC_ref_noproj", np.array(_DISK_N, dtype=float)),
        RenderCase("chest_tube_section", "complete", np.array(_CHEST_SECTION_N, dtype=float)),
        RenderCase("chest_tube_section@prototype", "complete", np.array(_CHEST_SECTION_N, dtype=float)),
        RenderCase("chest_tube", "complete", np.array(_CHEST_N, dtype=float)),
        RenderCase("mitral_transseptal", "pk", 1e-3 * np.array(_TRANSSEPTAL_MM), as_built=with_rigid_rings),
        RenderCase("mitral_4dof", "pk", 1e-3 * np.array(_FOUR_DOF_MM), as_built=with_rigid_rings),
        RenderCase("notched_wrist", "kinetostatic", np.array(_WRIST_N)),
    )
}


def checked(*ids: str) -> Validation:
    """Return the render check of robots in `CASES`; it says so where nothing can be drawn.

    Raises:
        SimulationDiverged: a simulation failed.
    """
    try:
        open_renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), WIDTH, HEIGHT).close()
    except InputError as error:
        return Validation((), (f"{', '.join(ids)}: render check not run: {error}",))
    lines: list[Line] = []
    for name in ids:
        case = CASES[name]
        drawn = draw(case)
        found = drawn.offsets(case.statics(drawn.robot, case.tendon))
        robot, _, which = name.partition("@")
        scale = mm_per_px(drawn.robot)
        what = f"{len(found)} postures drawn for two cameras, {scale:.2g} mm a pixel"
        what = f"@{which}, {what}" if which else what
        source = f"{case.model}, drawn without MuJoCo"
        mean = float(np.max([one.mean_px for one in found]))
        worst = float(np.max([one.worst_px for one in found] + [1e3 * off_axis_m(drawn) / scale]))
        along = "signed mean of a section along an image axis, largest"
        lines += [
            Line(robot, f"{what}: {along}", "px", mean, MEAN_PX, source),
            Line(robot, f"{what}: one part or piece of the stripe, largest", "px", worst, WORST_PX, source),
        ]
    return Validation(tuple(lines), ())


def validate_render_neuroendoscope_section(folder: Path) -> Validation:
    """Check drawn postures of the neuroendoscope's section; nothing is written."""
    return checked("neuroendoscope_section")


def validate_render_neuroendoscope(folder: Path) -> Validation:
    """Check drawn postures of the neuroendoscope; nothing is written."""
    return checked("neuroendoscope")


def validate_render_spacer_disk(folder: Path) -> Validation:
    """Check drawn postures of the spacer-disk robot; nothing is written."""
    return checked("spacer_disk")


def validate_render_chest_tube_section(folder: Path) -> Validation:
    """Check drawn postures of the chest tube's section, of rigid and of soft links; nothing is written."""
    return checked("chest_tube_section", "chest_tube_section@prototype")


def validate_render_chest_tube(folder: Path) -> Validation:
    """Check drawn postures of the chest tube; nothing is written."""
    return checked("chest_tube")


def validate_render_transseptal(folder: Path) -> Validation:
    """Check drawn postures of the transseptal catheter; nothing is written."""
    return checked("mitral_transseptal")


def validate_render_4dof(folder: Path) -> Validation:
    """Check drawn postures of the 4-DoF catheter; nothing is written."""
    return checked("mitral_4dof")


def validate_render_wrist(folder: Path) -> Validation:
    """Check drawn postures of the notched wrist; nothing is written."""
    return checked("notched_wrist")
