"""The static model CC: every segment bends in one arc of constant curvature.

Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Sections 3.2.1 and 5.2.2): a segment's curvature follows
from the moment of its tendons. Each runs parallel to the backbone at its distance, so that a bend b
shortens its path by arm . b. Where holes turn about the backbone, the moment turns with them. The
curvature is constant in a frame that turns along, and the segment is a helix (exact without load and with
the rest curvature's mean in that frame). Here the same two unknowns per segment also carry tendons driven
by displacement that stretch and go slack, pretension, a mount that gives way. They carry a cubic and
quintic elastic law, rest curvature and twist, dry friction with history. They carry the generalised force
of weight and tip load, by virtual work on arcs. That is exact for the shape assumed. A loaded backbone is
no arc, so that loads are where this model errs.

`straight_between_disks` adds what a tendon that runs straight from disk to disk gains over one held
everywhere. Over a subsegment of length h bent by t the chord is shorter by h t^2 / 24 for an arc. It is
shorter, for a chain of K hinges per subsegment at the middles of equal links, by h t^2 / 24 (1 + 2 / K^2),
to second order in t (`layout.hinge_places`). With it the model is the analytic twin of the simulated
chain. Where a segment says where its hinges stand (`hinge_share`), the path is that of a chain exactly.
Its arc begins by so much farther up as its hinges stand above the middles, and the disks as much farther
down.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.statics import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.mechanics.arcs import points_on_arcs
from catheter_sim.robots.continuum.arcs import ArcLoads, ArcRobots, ArcStates, solve_rows
from catheter_sim.robots.continuum.description import axes_of, disks, routing, winds_or_converges
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

MODEL = "CC"
# An inextensible tendon driven by displacement is a spring this many times stiffer than the
# robot's bending seen from that tendon: its stretch stays below 0.1 % of the bending's share.
INEXTENSIBLE_RATIO = 1000.0
_AT_START = 1e-9  # of a subsegment: of a hinge there
_BALANCED_RAD = 1e-5  # unbalanced moment, over a segment's stiffness, that still counts as balance


def constant_curvature(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` under `inputs`, row after row; see the module's text.

    Args:
        robot: any robot; its `effects` are not read.
        inputs: tensions or displacements, and loads on the tip.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: no equilibrium is found at a row (a segment that buckles, for one).
    """
    gravity = np.asarray(gravity_mps2, dtype=float)
    robots = arc_robots([robot])
    acting = loads([robot], [inputs], gravity)
    states = solve_rows(robots, inputs.tendon[None], inputs.actuation == "tension", acting)
    unbalanced = states.residual[0] > _BALANCED_RAD * float((robots.bending / robots.length).max())
    if unbalanced.any():
        row = int(np.argmax(unbalanced))
        raise InputError(
            f"{robot.name}: {MODEL} finds no equilibrium at row {row + 1} (time_s = {inputs.time_s[row]:g})"
        )
    return StaticRun(MODEL, inputs, gravity, postures(robot, robots, states), states.residual[0])


def arc_robots(robots: Sequence[ContinuumRobot], straight_between_disks: bool = False) -> ArcRobots:
    """Return `robots`, which differ in numbers only, as one batch; their `effects` are not read."""
    first = robots[0]
    free = np.array([[axis in axes_of(segment) for axis in "xy"] for segment in first.segments])

    def per_segment(name: str) -> Array:
        return np.array([[getattr(segment, name) for segment in robot.segments] for robot in robots])

    length = per_segment("length_m")
    scale = np.array([[robot.stiffness_scale] for robot in robots])
    rest = np.stack([per_segment("rest_curvature_x_per_m"), per_segment("rest_curvature_y_per_m")], axis=2)
    chord = np.zeros((len(robots), len(first.tendons), len(first.segments)))
    if straight_between_disks:
        runs = _runs(first)
        for s, segment in enumerate(first.segments):
            count = disks(first, segment)
            hinges = 1.0 + 2.0 / first.links_per_subsegment**2
            if segment.hinge_share != 0.5:
                hinges = 12.0 * segment.hinge_share * (1.0 - segment.hinge_share)
            if first.hinges == "rod" and first.links_per_subsegment > 1:
                hinges = 1.0  # as an arc
            chord[:, :, s] = runs[:, s] * (length[:, s] / (12.0 * count**2) * hinges)[:, None]
    share = per_segment("hinge_share")
    cells = np.array([disks(first, item) * (item.hinge_share != 0.5) for item in first.segments], float)
    return ArcRobots(
        length=length,
        bending=per_segment("bending_stiffness_N_m2") * scale,
        cubic=per_segment("stiffness_cubic_m2"),
        quintic=per_segment("stiffness_quintic_m4"),
        plastic=np.stack(
            [per_segment("plastic_share"), per_segment("yield_curvature_per_m") * length], axis=2
        ),
        rest=rest * (length * np.sinc(0.5 * turns(robots) / math.pi))[:, :, None],
        free=free,
        arm=np.array([_arms(robot, straight_between_disks) for robot in robots]),
        chord=chord,
        cells=np.array([cells * straight_between_disks] * len(robots)),
        share=share,
        lead=leads(robots),
        stiffness=np.array([[drive_stiffness(robot, item) for item in robot.tendons] for robot in robots]),
        pretension=np.array([[item.pretension_N for item in robot.tendons] for robot in robots]),
        slack=np.array([[item.slack_m for item in robot.tendons] for robot in robots]),
        mu=np.array([robot.friction.mu for robot in robots]),
        base_compliance=np.array([1.0 / robot.mount.axial_stiffness_N_per_m for robot in robots]),
    )


def leads(robots: Sequence[ContinuumRobot]) -> Array:
    """Return by how much the hinges stand above the middles of their subsegments, shape (B, S) [m]."""
    counts = [[disks(robot, item) for item in robot.segments] for robot in robots]
    share = np.array([[item.hinge_share - 0.5 for item in robot.segments] for robot in robots])
    return share * np.array([[item.length_m for item in robot.segments] for robot in robots]) / counts


def _runs(robot: ContinuumRobot) -> np.ndarray:
    """Return whether a tendon runs through a segment, shape (t, s)."""
    names = tuple(segment.name for segment in robot.segments)
    return _up_to(tuple(names.index(item.ends_at) for item in robot.tendons), len(names))


@lru_cache(maxsize=64)  # a fit asks for the same, robot by robot
def _up_to(last: tuple[int, ...], segments: int) -> np.ndarray:
    """Return the same of tendons by the number of their last segment, shape (t, s); not to be changed."""
    return np.array(last)[:, None] >= np.arange(segments)


def turns(robots: Sequence[ContinuumRobot]) -> Array:
    """Return by how much the direction of bending turns with the holes over each segment, shape (B, S) [rad].

    A segment that bends in one plane keeps it.
    """
    return np.array(
        [[_hole_turn(item) * (item.bending_axes == "xy") for item in robot.segments] for robot in robots]
    )


def _hole_turn(segment: Segment) -> float:
    return segment.rest_twist_rad_per_m * segment.length_m


def _arms(robot: ContinuumRobot, straight_between_disks: bool) -> Array:
    """Return each tendon's hole position in the middle of each segment, zero beyond its end, (t, s, 2) [m].

    A tendon that is straight between disks whose holes are turned passes nearer to the backbone. Where a
    segment bends in one plane, the mean of the hole's position shortens the path. Of a tendon that winds or
    converges it is the mean along the segment, so that small bends are right.
    """
    result = np.zeros((len(robot.tendons), len(robot.segments), 2))
    turned = 0.0
    runs = _runs(robot)
    angle = np.array([item.angle_rad for item in robot.tendons])
    radius_m = np.array([item.radius_m for item in robot.tendons])
    routed = winds_or_converges(robot)
    for s, segment in enumerate(robot.segments):
        half = 0.5 * _hole_turn(segment)
        nearer = math.cos(half / disks(robot, segment)) if straight_between_disks else 1.0
        if segment.bending_axes != "xy":
            nearer = float(np.sinc(half / math.pi))
        toward = np.stack([np.cos(angle + turned + half), np.sin(angle + turned + half)], axis=1)
        mean = radius_m[:, None] * toward
        if routed:
            mean = _mean_holes(robot, s, turned + half, straight_between_disks)
        result[:, s] = np.where(runs[:, s, None], nearer * mean, 0.0)
        turned += 2.0 * half
    return result


def _mean_holes(robot: ContinuumRobot, index: int, turned: float, straight_between_disks: bool) -> Array:
    """Return the tendons' holes, `turned` about the backbone [rad], averaged over a segment, (t, 2) [m].

    The mean of straight spans' middles, or of a path beside the backbone by Gauss's rule.
    """
    start = sum(item.length_m for item in robot.segments[:index])
    count = disks(robot, robot.segments[index])
    at, weight = np.polynomial.legendre.leggauss(8)
    if straight_between_disks:
        at, weight = np.linspace(-1.0, 1.0, count + 1), np.full(count + 1, 2.0 / count)
        weight[[0, -1]] *= 0.5
    heights = start + 0.5 * (1.0 + at) * robot.segments[index].length_m
    own = [[routing(robot, item, z) for z in heights] for item in robot.tendons]
    radius, angle = np.moveaxis(np.array(own).reshape(-1, len(at), 2), 2, 0)
    places = radius[..., None] * np.stack([np.cos(angle + turned), np.sin(angle + turned)], axis=2)
    return np.asarray(0.5 * np.einsum("q,tqi->ti", weight, places))


def drive_stiffness(robot: ContinuumRobot, tendon: Tendon) -> float:
    """Return a tendon's stiffness, a finite one (`INEXTENSIBLE_RATIO`) for an inextensible one [N/m]."""
    if math.isfinite(tendon.stiffness_N_per_m):
        return tendon.stiffness_N_per_m
    compliance = 0.0
    for segment in robot.segments:
        stiffness = robot.stiffness_scale * segment.bending_stiffness_N_m2 / segment.length_m
        compliance += tendon.radius_m**2 / stiffness * bool(axes_of(segment))
        if segment.name == tendon.ends_at:
            break
    return INEXTENSIBLE_RATIO / compliance


def places(robot: ContinuumRobot) -> tuple[np.ndarray, Array]:
    """Return the segment (index) and the fraction of its length at which each disk stands, shape (n,)."""
    segment, fraction = [], []
    for s, item in enumerate(robot.segments):
        count = disks(robot, item)
        segment += [s] * count
        fraction += [(i + 1) / count for i in range(count)]
    return np.array(segment), np.array(fraction)


def loads(robots: Sequence[ContinuumRobot], inputs: Sequence[Inputs], gravity_mps2: Array) -> ArcLoads:
    """Return what acts on each robot at each row.

    Weight acts at each disk or, of masses along the robot, in the middle of each subsegment, which a hinge
    above the middle brings down on the arc; force and moment on the tip.
    """
    segments = robots[0].segments
    mass = np.array([[_disk_mass(robot, segment) for segment in robot.segments] for robot in robots])
    share = np.array([[item.hinge_share or _AT_START for item in segments]])
    along = np.array([[robot.masses == "along"] for robot in robots])
    before = (share * along)[..., None]
    return ArcLoads(
        disks=np.array([disks(robots[0], segment) for segment in segments]),
        weight=np.concatenate([mass[:, :, None] * gravity_mps2, before], axis=2),
        force_tip=np.array([item.force_tip for item in inputs]),
        moment_tip=np.array([item.moment_tip for item in inputs]),
    )


def _disk_mass(robot: ContinuumRobot, segment: Segment) -> float:
    return segment.mass_kg / disks(robot, segment)


def postures(
    robot: ContinuumRobot, robots: ArcRobots, states: ArcStates, index: int = 0
) -> tuple[Posture, ...]:
    """Return the postures of robot `index` of a batch, one per row."""
    segment, fraction = places(robot)
    turn = turns([robot])[0]
    p_w, R_w = points_on_arcs(
        states.bend[index], robots.length[index], segment, fraction, turn if turn.any() else None,
        robots.lead[index],
    )  # fmt: skip
    p_w = p_w.copy()
    p_w[..., 2] -= states.shift[index][:, None]
    hinges = joint_values(robot, states.bend[index], turn)
    runs = _runs(robot)
    spans = np.where(runs[None], states.span_tension[index], np.nan)[:, :, segment]
    return tuple(
        Posture(p_w[row], R_w[row], hinges[row], states.tension[index, row], spans[row])
        for row in range(len(p_w))
    )


def joint_values(robot: ContinuumRobot, bend: Array, turn: Array) -> Array:
    """Return the hinges' angles of a chain bent like the arcs, in the order of `Outputs.joints`.

    Args:
        robot: the robot.
        bend: in the middle of each segment, shape (..., s, 2) [rad].
        turn: by which the holes turn over it, broadcast to (..., s) [rad].

    A segment's bend is shared equally by its hinges, each toward where the holes are there; a hinge that
    twists stays at zero.
    """
    columns = []
    for s, segment in enumerate(robot.segments):
        count = disks(robot, segment) * robot.links_per_subsegment
        x, y = bend[..., s, 0] / count, bend[..., s, 1] / count
        axes = axes_of(segment)
        for hinge in range(count):
            angle = ((hinge + 0.5) / count - 0.5) * turn[..., s]
            if "x" in axes:
                columns.append(x * np.cos(angle) - y * np.sin(angle))
            if "y" in axes:
                columns.append(x * np.sin(angle) + y * np.cos(angle))
            if math.isfinite(segment.torsion_stiffness_N_m2):
                columns.append(np.zeros(bend.shape[:-2]))
    return np.stack(columns, axis=-1)
