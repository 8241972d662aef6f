"""Which forces run beside a notched tube's step: its notches' arcs and metal, and friction at their edges."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import (
    Controls,
    CopiesLaw,
    CopyArrays,
    Law,
    RobotInModel,
    Step,
    StraightControls,
    TendonPaths,
    Views,
)
from catheter_sim.mechanics import tendons
from catheter_sim.mechanics.compiled import compiled_in_place
from catheter_sim.robots.notched_tube.description import HINGES, notches, rest_angles
from catheter_sim.robots.notched_tube.section import (
    closed_stiffness,
    fibres,
    knees,
    section,
    torsion_stiffness,
)
from catheter_sim.robots.notched_tube.spec import NotchedSegment, NotchedTubeRobot

# ----------------------------------------------------------------------------------------------------
# How stiff unbent notches are: what a model's springs hold of the metal's law, and its damping's scale.


def spring_stiffness(robot: NotchedTubeRobot, segment: NotchedSegment) -> tuple[float, float, float]:
    """Return what resists a notch's turn toward +x, toward +y and about the tube [N m/rad]."""
    metal, shape = robot.material, section(segment)
    modulus = metal.modulus_Pa * robot.stiffness_scale
    per_moment = modulus / segment.notch_height_m
    torsion = torsion_stiffness(segment, modulus, metal.poisson_ratio)
    return per_moment * shape.second_moment_m4, per_moment * shape.lateral_second_moment_m4, torsion


def stop_stiffness(robot: NotchedTubeRobot, segment: NotchedSegment) -> float:
    """Return what resists further bending of a closed notch [N m/rad]."""
    return closed_stiffness(segment, robot.material.modulus_Pa * robot.stiffness_scale)


def bending_seen_from_tendon(robot: NotchedTubeRobot) -> float:
    """Return the whole tube's stiffness against its tendon's displacement, unbent [N/m]."""
    radius = robot.tendons[0].radius_m
    softness = 0.0
    for notch in notches(robot):
        arm = radius + section(notch.segment).centroid_m
        softness += arm**2 / spring_stiffness(robot, notch.segment)[0]
    return 1.0 / softness


# ----------------------------------------------------------------------------------------------------
# Inner loops of a notched tube's step, compiled: where links hang, and how notches resist.
#
# `catheter_sim.robots.notched_tube.laws` says what the loops are for. Index k counts notches and
# links from 0 at the base. Arrays: `notch`, shape (n, 10): see the columns' names; `fibre`, (n, f, 3): x
# from the centroid, y, area; `metal`, (4,): modulus, strains at which the plateaus begin in tension and in
# compression, share of the modulus that the plateau loses; `hinge`, (n, a), a = 1 or 3: MuJoCo's numbers of
# the hinges toward +x, toward +y and about the tube.

# Columns of `notch` [m, rad, 1/rad^2, 1/rad^4, N m/rad].
HEIGHT, BELOW, CENTROID, REST_X, REST_Y, CUBIC, QUINTIC, STIFF_X, STIFF_Y, PITCH = range(10)
COLUMNS = 10
SCRATCH = (9, 4)
ALONE: Index = np.zeros(1, dtype=np.int64)  # of copies, where there is one robot
_SHARE = 0.5  # of the way to balance that a stretch goes in a step


@compiled_in_place
def _about(axis: Array, angle: float, out: Array) -> None:
    """Fill the quaternion of a turn about a unit vector."""
    sine = math.sin(0.5 * angle)
    out[0] = math.cos(0.5 * angle)
    for i in range(3):
        out[1 + i] = sine * axis[i]


@compiled_in_place
def _after_back(turn: Array, q: Array) -> None:
    """Take the turn back from `q`: q becomes conj(turn) q."""
    a, b, c, d = turn[0], -turn[1], -turn[2], -turn[3]
    e, f, g, h = q[0], q[1], q[2], q[3]
    q[0] = a * e - b * f - c * g - d * h
    q[1] = a * f + b * e + c * h - d * g
    q[2] = a * g - b * h + c * e + d * f
    q[3] = a * h + b * g - c * f + d * e


@compiled_in_place
def _turned(q: Array, way: float, v: Array, out: Array) -> None:
    """Fill `v` turned by the quaternion, `way` = 1, or back, -1."""
    s, x, y, z = q[0], way * q[1], way * q[2], way * q[3]
    a, b, c = 2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])
    u0, u1, u2 = v[0], v[1], v[2]
    out[0] = u0 + s * a + y * c - z * b
    out[1] = u1 + s * b + z * a - x * c
    out[2] = u2 + s * c + x * b - y * a


@compiled_in_place
def _helix(w: Array, length: float, p: Array, slope: Array, turn: Array, k: int) -> None:
    """Fill a helix' end, and its slope and turn by component k of the rotation vector w."""
    a, b, c = w[0], w[1], w[2]
    q = a * a + b * b + c * c
    if q < 1e-3:
        c1, d1 = 0.5 - q / 24.0 * (1.0 - q / 30.0), -1.0 / 24.0 + q / 360.0 - q * q / 13440.0
        c2, d2 = 1.0 / 6.0 - q / 120.0 * (1.0 - q / 42.0), -1.0 / 120.0 + q / 2520.0 - q * q / 120960.0
    else:
        angle = math.sqrt(q)
        c0, c1 = math.sin(angle) / angle, (1.0 - math.cos(angle)) / q
        c2 = (1.0 - c0) / q
        d1, d2 = (0.5 * c0 - c1) / q, (-0.5 * (math.cos(angle) - c0) / q - c2) / q
    u0, u1, u2 = a * c, b * c, c * c - q
    p[0], p[1], p[2] = length * (c1 * b + c2 * u0), length * (c2 * u1 - c1 * a), length * (1.0 + c2 * u2)
    e1, e2 = 2.0 * d1 * w[k], 2.0 * d2 * w[k]
    ka, kb, kc = (1.0 if k == 0 else 0.0), (1.0 if k == 1 else 0.0), (1.0 if k == 2 else 0.0)
    slope[0] = length * (e1 * b + c1 * kb + e2 * u0 + c2 * (ka * c + a * kc))
    slope[1] = length * (e2 * u1 + c2 * (kb * c + b * kc) - e1 * a - c1 * ka)
    slope[2] = length * (e2 * u2 - 2.0 * c2 * (a * ka + b * kb))
    turn[0] = ka + c1 * (b * kc - c * kb) + c2 * (a * w[k] - q * ka)
    turn[1] = kb + c1 * (c * ka - a * kc) + c2 * (b * w[k] - q * kb)
    turn[2] = kc + c1 * (a * kb - b * ka) + c2 * (c * w[k] - q * kc)


@compiled_in_place
def place(
    copies: Index,
    qpos: Array,
    qpos_index: Index,
    notch: Array,
    stretch: Array,
    hinge: Index,
    body: Index,
    jnt_pos: Array,
    jnt_axis: Array,
    body_pos: Array,
    body_quat: Array,
    scratch: Array,
) -> None:
    """Move hinges and links in the models of many robots to where the notches' arcs have them.

    A link hangs on its notch's hinges so that it stands at the end of the arc, turned by the rotation vector
    (-y, x, t) of the hinges' angles. Each hinge lies on the line about which the link turns now.

    Args:
        copies: which of m robots; all that changes has an axis of m before the others.
        qpos: MuJoCo's positions, shape (m, nq); `qpos_index` picks the hinges' angles, shape (n, a).
        notch: see the columns.
        stretch: of the strips, shape (m, n).
        hinge, body: numbers in MuJoCo, shapes (n, a) and (n,).
        jnt_pos, jnt_axis, body_pos, body_quat: out: MuJoCo's.
        scratch: shape `SCRATCH`.
    """
    w, p, slope, at, q, turn = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4], scratch[5]
    far, axis, point = scratch[6], scratch[7], scratch[8]
    axes = hinge.shape[1]
    for copy in copies:
        for k in range(notch.shape[0]):
            w[0] = w[2] = 0.0
            w[1] = qpos[copy, qpos_index[k, 0]]
            if axes == 3:
                w[0], w[2] = -qpos[copy, qpos_index[k, 1]], qpos[copy, qpos_index[k, 2]]
            length, offset = notch[k, HEIGHT] * (1.0 + stretch[copy, k]), notch[k, CENTROID]
            size = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
            half = 0.5 if size < 1e-8 else math.sin(0.5 * size) / size
            q[0] = math.cos(0.5 * size)
            for i in range(3):
                q[1 + i] = half * w[i]
            _helix(w, length, p, slope, axis, 1)
            at[0], at[1], at[2] = 1.0, 0.0, 0.0
            _turned(q, 1.0, at, far)
            for i in range(3):
                at[i] = p[i] + offset * far[i]
            at[0] -= offset
            at[2] += notch[k, BELOW]
            for back in range(axes):  # from the last hinge to the first: its line, and its turn taken back
                j = axes - 1 - back
                _helix(w, length, p, slope, axis, 1 if j == 0 else (0 if j == 1 else 2))
                size = math.sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2])
                if j == 1:
                    size = -size
                for i in range(3):
                    axis[i] /= size
                    slope[i] /= size
                point[0] = p[0] - offset - (slope[1] * axis[2] - slope[2] * axis[1])
                point[1] = p[1] - (slope[2] * axis[0] - slope[0] * axis[2])
                point[2] = p[2] + notch[k, BELOW] - (slope[0] * axis[1] - slope[1] * axis[0])
                _about(axis, qpos[copy, qpos_index[k, j]], turn)
                _after_back(turn, q)
                for i in range(3):
                    far[i] = point[i] - at[i]
                _turned(turn, -1.0, far, slope)
                for i in range(3):
                    at[i] = point[i] - slope[i]
                _turned(q, -1.0, axis, jnt_axis[copy, hinge[k, j]])
                _turned(q, -1.0, slope, jnt_pos[copy, hinge[k, j]])
            for i in range(3):
                body_pos[copy, body[k], i] = at[i]
            for i in range(4):
                body_quat[copy, body[k], i] = q[i]


@compiled_in_place
def _section(fibre: Array, metal: Array, stretch: float, kx: float, ky: float, out: Array) -> None:
    """Fill the section's N, Mx, My, and the slope of N by the stretch."""
    for i in range(4):
        out[i] = 0.0
    modulus, tension, compression, lost = metal[0], metal[1], metal[2], metal[3]
    for i in range(fibre.shape[0]):
        x, y = fibre[i, 0], fibre[i, 1]
        strain = stretch - x * ky + y * kx
        slope = modulus * fibre[i, 2]
        force = slope * strain
        if strain > tension:
            force -= lost * slope * (strain - tension)
            slope *= 1.0 - lost
        elif strain < -compression:
            force -= lost * slope * (strain + compression)
            slope *= 1.0 - lost
        out[0] += force
        out[1] += y * force
        out[2] -= x * force
        out[3] += slope


@compiled_in_place
def stretch_on(
    copies: Index,
    qpos: Array,
    qpos_index: Index,
    notch: Array,
    fibre: Array,
    metal: Array,
    tension: Array,
    drive: float,
    stretch: Array,
    balance: Array,
    scratch: Array,
) -> None:
    """Move the strips' stretches toward balance with the tendon, N = -T c, c the arc's chord over its length.

    A driven tendon slackens by its drive's stiffness times what they give way by: that is foreseen here.

    Args:
        copies, qpos, qpos_index, notch: as in `place`.
        fibre, metal: see the module's text.
        tension: of the tendon in each span, in each notch and after it, shape (m, 1, 2n) [N].
        drive: stiffness of the tendon's drive, 0 where its tension is given [N/m].
        stretch: changed, shape (m, n).
        balance: scratch, shape (n, 3): what is left over [N], c, and its slope by the stretch [N].
        scratch: shape `SCRATCH`.
    """
    found = scratch[0]
    for copy in copies:
        ask, answer = 0.0, 0.0
        for k in range(notch.shape[0]):
            y, x = qpos[copy, qpos_index[k, 0]], 0.0
            if qpos_index.shape[1] == 3:
                x = -qpos[copy, qpos_index[k, 1]]
            height = notch[k, HEIGHT]
            kx, ky = (x + notch[k, REST_Y]) / height, (y - notch[k, REST_X]) / height
            _section(fibre[k], metal, stretch[copy, k], kx, ky, found)
            half = 0.5 * math.sqrt(x * x + y * y)
            chord = 1.0 if half < 1e-8 else math.sin(half) / half
            lack = found[0] + tension[copy, 0, 2 * k] * chord
            ask += height * chord * lack / found[3]
            answer += height * chord * chord / found[3]
            balance[k, 0], balance[k, 1], balance[k, 2] = lack, chord, found[3]
        slackens = _SHARE * drive * ask / (1.0 + _SHARE * drive * answer)
        for k in range(notch.shape[0]):
            stretch[copy, k] -= _SHARE * (balance[k, 0] - balance[k, 1] * slackens) / balance[k, 2]


@compiled_in_place
def resist(
    copies: Index,
    qpos: Array,
    qpos_index: Index,
    notch: Array,
    fibre: Array,
    metal: Array,
    stretch: Array,
    dof: Index,
    torque: Array,
    scratch: Array,
) -> None:
    """Take the notches' moments, but for what the model's springs hold of them, from `torque`, (m, nv) [N m].

    Arguments are those of `stretch_on`; `dof`, shape (n, a), are the hinges' degrees of freedom.
    """
    found = scratch[0]
    for copy in copies:
        for k in range(notch.shape[0]):
            spatial = qpos_index.shape[1] == 3
            bent = qpos[copy, qpos_index[k, 0]] - notch[k, REST_X]
            aside = qpos[copy, qpos_index[k, 1]] - notch[k, REST_Y] if spatial else 0.0
            height = notch[k, HEIGHT]
            _section(fibre[k], metal, stretch[copy, k], -aside / height, bent / height, found)
            square = (bent * bent + aside * aside) / notch[k, PITCH] ** 2
            law = 1.0 + square * (notch[k, CUBIC] + square * notch[k, QUINTIC])
            torque[copy, dof[k, 0]] -= law * found[2] - notch[k, STIFF_X] * bent
            if spatial:
                torque[copy, dof[k, 1]] += law * found[1] + notch[k, STIFF_Y] * aside


# ----------------------------------------------------------------------------------------------------
# The notches of a tube in a simulation: arcs on hinges that move with them, and the metal's law.
#
# A notch bends as an arc. Its link hangs on one hinge for each way to turn, and before every step the
# hinges are moved to the lines about which the arc's end turns now, and the link to where the arc ends:
# position and velocity are then exact in the tube's plane, whatever the bend; out of it the velocity is
# short by the share bend^2 / 24. The strip's stretch follows the tendon's tension a few steps behind.

RADIAL, AROUND = 8, 24  # points over the wall's thickness and its angle: as in the statics


def notch_table(robot: NotchedTubeRobot) -> Array:
    """Return the numbers of `place` and `resist`, shape (n, 10)."""
    rows, below = [], 0.0
    for notch in notches(robot):
        segment = notch.segment
        bent, aside, _ = rest_angles(notch)
        stiff_x, stiff_y, _ = spring_stiffness(robot, segment)
        elastic = (segment.stiffness_cubic_m2, segment.stiffness_quintic_m4, stiff_x, stiff_y)
        centroid = section(segment).centroid_m
        rows.append((segment.notch_height_m, below, centroid, bent, aside, *elastic, notch.pitch_m))
        below = notch.uncut_m
    return np.array(rows)


class Notches(Law):
    """Keeps hinges and links where the notches' arcs have them, and applies the metal's law."""

    def __init__(self, robot: NotchedTubeRobot, place: RobotInModel) -> None:
        self._model = model = place.model
        row = notches(robot)
        letters = HINGES if robot.bending_axes == "xy" else HINGES[:1]
        named = [[place.joint(f"{letter}{notch.index}").id for letter in letters] for notch in row]
        self._hinge: Index = np.array(named, dtype=np.int64)
        self._body: Index = np.array([place.body(f"link_{notch.index}").id for notch in row], dtype=np.int64)
        self._qpos = model.jnt_qposadr[self._hinge].astype(np.int64)
        self._dofs = model.jnt_dofadr[self._hinge].astype(np.int64)
        metal = robot.material
        modulus = metal.modulus_Pa * robot.stiffness_scale
        self._numbers = (
            notch_table(robot),
            np.array([fibres(notch.segment, RADIAL, AROUND) for notch in row]),
            np.array([modulus, *knees(metal), 1.0 - metal.plateau_slope]),
        )
        self._stretch, self._balance = np.zeros((1, len(row))), np.zeros((len(row), 3))
        self._scratch = np.zeros(SCRATCH)
        self._state = Views("qpos", "qfrc_applied", one_copy=True)
        self._moved = Views("jnt_pos", "jnt_axis", "body_pos", "body_quat", one_copy=True)

    def arrays(self) -> tuple[Index, Index, Index, Index, Array, Array, Array]:
        """Return what the law is made of, arguments of its loops.

        Positions, degrees of freedom, hinges, links; notches, fibres, metal.
        """
        places = self._qpos, self._dofs, self._hinge, self._body
        return *places, *self._numbers

    def reset(self) -> None:
        """Give the strips their own lengths back."""
        self._stretch[:] = 0.0

    def before(self, step: Step) -> None:
        """Stretch the strips as the tendon presses them together."""
        spans = step.span_tension()[:1]
        if spans.shape[1] != 2 * len(self._body):  # nothing rubs: one tension all along
            spans = np.full((1, 2 * len(self._body)), spans[0, 0])
        drive, own = float(step.pulls.drive_stiffness()[0]), (self._stretch, self._balance, self._scratch)
        qpos, _ = self._state(step.data)
        stretch_on(ALONE, qpos, self._qpos, *self._numbers, spans[np.newaxis], drive, *own)

    def place(self, data: mujoco.MjData) -> None:
        """Put hinges and links where the arcs have them."""
        (qpos, _), moved = self._state(data), self._moved(self._model)
        at = self._hinge, self._body
        place(ALONE, qpos, self._qpos, self._numbers[0], self._stretch, *at, *moved, self._scratch)

    def between(self, step: Step) -> None:
        """Add what the metal's law has beyond the model's springs."""
        qpos, torque = self._state(step.data)
        bent = self._stretch, self._dofs
        resist(ALONE, qpos, self._qpos, *self._numbers, *bent, torque, self._scratch)


class NotchCopies(CopiesLaw):
    """The notches of many copies, each with its strips' stretches."""

    def __init__(self, notches: Notches, arrays: CopyArrays, drive: float) -> None:
        """Prepare; `drive`: stiffness of the tendon's drive, 0 where its tension is given [N/m]."""
        self._qpos, self._dofs, self._hinge, self._body, *self._numbers = notches.arrays()
        self._drive = drive
        self._arrays, count = arrays, len(arrays.qpos)
        fields = "jnt_pos", "jnt_axis", "body_pos", "body_quat"
        self.moved = {name: arrays.own(name) for name in fields}
        self._stretch = np.zeros((count, len(self._body)))
        self._balance = np.zeros((len(self._body), 3))
        self._scratch = np.zeros(SCRATCH)

    def reset(self, copies: Index) -> None:
        """Give the strips their own lengths back."""
        self._stretch[copies] = 0.0

    def before(self, copies: Index, tension: Array) -> None:
        """Stretch the strips as the tendon presses them together."""
        qpos, own = self._arrays.qpos, (self._stretch, self._balance, self._scratch)
        stretch_on(copies, qpos, self._qpos, *self._numbers, tension, self._drive, *own)

    def place(self, copies: Index) -> None:
        """Put hinges and links where the arcs have them."""
        qpos, at = self._arrays.qpos, (self._hinge, self._body, *self.moved.values())
        place(copies, qpos, self._qpos, self._numbers[0], self._stretch, *at, self._scratch)

    def between(self, copies: Index) -> None:
        """Add what the metal's law has beyond the model's springs."""
        arrays, bent = self._arrays, (self._stretch, self._dofs)
        resist(copies, arrays.qpos, self._qpos, *self._numbers, *bent, arrays.applied, self._scratch)


class EdgeTurns:
    """The angles by which the tendon turns at the notches' edges."""

    def __init__(self, robot: NotchedTubeRobot, place: RobotInModel) -> None:
        self._ends = span_ends(robot)
        spans = int(self._ends[0])
        name = robot.tendons[0].name
        self._sites = np.array([[place.site(f"hole_{name}_{k}").id for k in range(spans + 1)]], dtype=int)
        self._turn = np.zeros((1, spans))
        self._base, self._axis = place.base, np.array([0.0, 0.0, 1.0])

    def __call__(self, data: mujoco.MjData, ends: tendons.Index | None = None) -> Array:
        """Return the turn at the edge before each span; see `core.law.Turns`."""
        if self._base is not None:
            self._axis[:] = data.xmat[self._base, 2::3]
        last = self._ends if ends is None else ends
        tendons.spatial_turns(data.site_xpos, self._sites, last, self._axis, self._turn)
        return self._turn

    def of_copies(self, copies: tendons.Index, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Write the turns of some copies into `turn`; see `core.law.Turns`."""
        tendons.spatial_turns_of(copies, site_xpos, self._sites, self._ends, self._axis, turn)


def span_ends(robot: NotchedTubeRobot) -> np.ndarray:
    """Return the number of the tendon's spans: one in each notch and one in the uncut tube after it, (1,)."""
    return np.array([2 * len(notches(robot))], dtype=int)


def paths(robot: NotchedTubeRobot, place: RobotInModel) -> TendonPaths:
    """Return where the tendon rubs: at both edges of each notch."""
    spans = {}
    for notch in notches(robot):
        for letter in HINGES if robot.bending_axes == "xy" else HINGES[:1]:
            spans[int(place.joint(f"{letter}{notch.index}").dofadr[0])] = 2 * (notch.index - 1)
    return TendonPaths(
        names=[f"{place.prefix}tendon_{robot.tendons[0].name}"],
        spans=2 * len(notches(robot)),
        ends=span_ends(robot),
        span_of_dof=spans,
        turns=EdgeTurns(robot, place),
    )


# ----------------------------------------------------------------------------------------------------
# Which forces run beside a notched tube's step: its notches' arcs and metal, and friction at their edges.


def controls(robot: NotchedTubeRobot, place: RobotInModel) -> Controls:
    """Return what stands between inputs and actuators: nothing."""
    return StraightControls(place, span_ends(robot))


def laws(robot: NotchedTubeRobot, place: RobotInModel) -> tuple[Law, ...]:
    """Return the laws but friction."""
    return (Notches(robot, place),)


def tendon_paths(robot: NotchedTubeRobot, place: RobotInModel) -> TendonPaths:
    """Return where the tendon rubs."""
    return paths(robot, place)


def sliding_joints(robot: NotchedTubeRobot) -> list[str]:
    """Return the joints that must stand still besides the hinges: none."""
    return []
