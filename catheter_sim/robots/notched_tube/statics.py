"""The static models of notched tubes: `york` as printed, and `kinetostatic`, complete."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.posture import Posture
from catheter_sim.core.statics import StaticModel, StaticRun, unless
from catheter_sim.errors import InputError
from catheter_sim.robots.notched_tube import kernels
from catheter_sim.robots.notched_tube.description import Notch, notches
from catheter_sim.robots.notched_tube.kernels import Bends, NotchedTube, faces, march, spans
from catheter_sim.robots.notched_tube.section import (
    closed_stiffness,
    closing_angle,
    fibres,
    knees,
    section,
    stress,
    torsion_stiffness,
)
from catheter_sim.robots.notched_tube.spec import NotchedSegment, NotchedTubeRobot, Superelastic

# ----------------------------------------------------------------------------------------------------
# A notched tube as the arrays that the kinetostatic model takes, many robots at once.

# Points over the wall's thickness and over its angle. Against 24 by 48 the notches of `notched_wrist`, whose
# flat plateau makes them softest, bend alike to 0.03 deg in the root mean square of all tensions.
RADIAL, AROUND = 8, 24


@dataclass(frozen=True)
class Chains:
    """B robots that differ in numbers only, as arrays.

    Attributes:
        tubes: as the compiled code takes them.
        spatial: whether their notches could bend any way, loads or none.
        drive: displacement (NaN), compliance [m/N], pretension [N], scale [N/m], (B, 4).
        mass: of the elements, (B, n) [kg].
        mount_stiffness: (B,) [N/m].
    """

    tubes: NotchedTube
    spatial: bool
    drive: Array
    mass: Array
    mount_stiffness: Array


def chains(robots: Sequence[NotchedTubeRobot], axes: int) -> Chains:
    """Return `robots` as arrays.

    Args:
        robots: alike but for their numbers.
        axes: 1 or 3; 1 is right where nothing bends the tube out of its plane.
    """
    rows = [notches(robot) for robot in robots]
    notch = np.array([_notch_table(robot, row) for robot, row in zip(robots, rows, strict=True)])
    arm = notch[:, :, kernels.TENDON] + notch[:, :, kernels.CENTROID]
    pairs = list(zip(robots, rows, strict=True))
    bending = np.array([[_bending_stiffness(robot, item) for item in row] for robot, row in pairs])
    drive = np.full((len(robots), 4), math.nan)
    drive[:, [kernels.COMPLIANCE, kernels.PRETENSION]] = [_spring(robot) for robot in robots]
    drive[:, kernels.SCALE] = 1.0 / (arm**2 / bending).sum(axis=1)
    return Chains(
        tubes=NotchedTube(
            notch=notch,
            fibre=np.array([_fibre_table(row, axes) for row in rows]),
            metal=np.array([_metal_row(robot.material, robot.stiffness_scale) for robot in robots]),
            axes=axes,
            mu=np.array([robot.friction.mu for robot in robots]),
        ),
        spatial=robots[0].bending_axes == "xy",
        drive=drive,
        mass=np.array([[item.mass_kg for item in row] for row in rows]),
        mount_stiffness=np.array([robot.mount.axial_stiffness_N_per_m for robot in robots]),
    )


def _spring(robot: NotchedTubeRobot) -> tuple[float, float]:
    """Return compliance [m/N] and tension unpulled [N] of the tendon, a mount that gives way in series.

    The tendon's pretension is that on a mount that holds: T / k and T / K_mount, of which the first begins at
    the pretension, are one spring that begins at its share.
    """
    tendon = robot.tendons[0]
    own, mount = 1.0 / tendon.stiffness_N_per_m, 1.0 / robot.mount.axial_stiffness_N_per_m
    share = own / (own + mount) if own > 0.0 else 0.0
    return own + mount, share * tendon.pretension_N


def rest_vector(notch: Notch) -> tuple[float, float, float]:
    """Return the rotation vector of an unloaded notch [rad]: about x, y and the tube."""
    segment = notch.segment
    curved = (-segment.rest_curvature_y_per_m, segment.rest_curvature_x_per_m, segment.rest_twist_rad_per_m)
    x, y, twist = (value * notch.pitch_m for value in curved)
    return x, y, twist


def _bending_stiffness(robot: NotchedTubeRobot, notch: Notch) -> float:
    modulus = robot.material.modulus_Pa * robot.stiffness_scale
    return modulus * section(notch.segment).second_moment_m4 / notch.segment.notch_height_m


def _notch_table(robot: NotchedTubeRobot, row: Sequence[Notch]) -> Array:
    modulus = robot.material.modulus_Pa * robot.stiffness_scale
    of_segment = {
        segment.name: (
            torsion_stiffness(segment, modulus, robot.material.poisson_ratio),
            closed_stiffness(segment, modulus),
            closing_angle(segment),
            segment.stiffness_cubic_m2,
            segment.stiffness_quintic_m4,
        )
        for segment in robot.segments
    }
    arm = robot.tendons[0].radius_m
    table = np.array(
        [
            (
                *(item.segment.notch_height_m, item.uncut_m, section(item.segment).centroid_m, arm),
                *of_segment[item.segment.name],
                item.pitch_m,
                *rest_vector(item),
                0.0,
            )
            for item in row
        ]
    )
    table[:, kernels.SPAN] = spans(table, table[:, kernels.REST : kernels.REST + 3].copy())
    return table


def _fibre_table(row: Sequence[Notch], axes: int) -> Array:
    """Return the fibres of every notch; of a planar robot half of each section, at twice the area."""
    tables = {}
    for item in row:
        if item.segment.name not in tables:
            table = fibres(item.segment, RADIAL, AROUND)
            tables[item.segment.name] = table[table[:, 1] > 0.0] * [1.0, 1.0, 2.0] if axes == 1 else table
    return np.array([tables[item.segment.name] for item in row])


def _metal_row(metal: Superelastic, scale: float) -> Array:
    """Return modulus, knees and lost slope; a metal without plateaus has knees that no strain reaches."""
    return np.array([metal.modulus_Pa * scale, *knees(metal), 1.0 - metal.plateau_slope])


# ----------------------------------------------------------------------------------------------------
# The kinetostatic model along rows of inputs, for many robots at once, as the fits of a diagnosis ask.

# A step's change of inputs would bend the unbent tube by at most this much. Without a load, inputs that move
# one way between rows make the same history in one step (to 1e-9 rad).
STEP_BEND_RAD = 0.2
_MOST_STEPS = 500  # between two rows


@dataclass(frozen=True)
class TubeStates:
    """Equilibria of B robots that differ in numbers only, along r rows; NaN from where none was found.

    Attributes:
        chains: the robots.
        w: rotation vector of each notch, from its lower edge to its upper one, shape (B, r, n, 3) [rad].
        stretch: of the notches' centroid lines, share of their height, shape (B, r, n).
        tension: at the actuator, shape (B, r) [N].
        notch_tension: in each notch, shape (B, r, n) [N].
        shift: of the whole tube along z, by its mount, shape (B, r) [m].
        residual: largest moment that no balance accounts for, shape (B, r) [N m].
    """

    chains: Chains
    w: Array
    stretch: Array
    tension: Array
    notch_tension: Array
    shift: Array
    residual: Array

    def every(self, step: int) -> TubeStates:
        """Return the states at each `step`-th row."""
        shown = slice(None, None, step)
        w, stretch, residual = self.w[:, shown], self.stretch[:, shown], self.residual[:, shown]
        tensions = self.tension[:, shown], self.notch_tension[:, shown]
        return TubeStates(self.chains, w, stretch, *tensions, self.shift[:, shown], residual)

    def faces(self) -> tuple[Array, Array]:
        """Return the elements' distal faces in the base frame, (B, r, n, 3) [m] and (B, r, n, 3, 3)."""
        p_w, R_w = np.empty(self.w.shape), np.empty((*self.w.shape, 3))
        faces(self.chains.tubes.notch, self.w, self.stretch, p_w, R_w)
        p_w[..., 2] += self.shift[..., None]
        return p_w, R_w

    def joint_angles(self) -> Array:
        """Return the notches' angles, shape (B, r, j) [rad], in the order of `layout.joint_names`.

        Toward +x; of a tube that bends any way then toward +y, and about the tube.
        """
        x, y, twist = self.w[..., 1], -self.w[..., 0], self.w[..., 2]
        return np.concatenate([x, y, twist], axis=2) if self.chains.spatial else x


@dataclass(frozen=True)
class FaceLoads:
    """Forces and moments on elements' distal faces besides those on the tip, in the base frame, row by row.

    Attributes:
        element: counted from 1 at the base, shape (p,).
        force, moment: of B robots, shape (B, r, p, 3) [N, N m].
    """

    element: NDArray[np.intp]
    force: Array
    moment: Array


def solve_rows(
    robots: Sequence[NotchedTubeRobot],
    inputs: Sequence[Inputs],
    gravity_mps2: Array,
    loads: FaceLoads | None = None,
    step_bend_rad: float = STEP_BEND_RAD,
) -> TubeStates:
    """Return the equilibria of `robots` along their inputs, each from rest under its weight.

    Args:
        robots: alike but for their numbers.
        inputs: tensions or displacements, of the same rows and kind, one per robot.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        loads: further loads.
        step_bend_rad: see `STEP_BEND_RAD`.
    """
    gravity = np.asarray(gravity_mps2, dtype=float)
    planar = all(robot.bending_axes == "x" for robot in robots) or (
        all(_rests_in_plane(robot) for robot in robots) and _acts_in_plane(inputs, gravity, loads)
    )
    axes = 1 if planar else 3
    made = chains(robots, axes)
    if inputs[0].actuation == "displacement":
        made.drive[:, kernels.DISPLACEMENT] = 0.0
    count, rows = made.mass.shape[1], len(inputs[0])
    element, force, moment = _face_loads(inputs, loads, count)
    drives = np.array([np.concatenate([[0.0], item.tendon[:, 0]]) for item in inputs])
    weight = made.mass[:, :, None] * gravity
    pressed = weight[:, :, 2].sum(axis=1)[:, None] + force[:, :, :, 2].sum(axis=2)  # besides the tendon
    if inputs[0].actuation == "displacement":  # a mount that gives way takes its part of the tendon's path
        drives = drives + pressed / made.mount_stiffness[:, None]
    shape = (len(robots), rows)
    w, stretch = np.empty((*shape, count, 3)), np.empty((*shape, count))
    tension, residual = np.empty((*shape, count + 1)), np.empty(shape)
    march(
        *(made.tubes, made.drive, drives, weight, element, force, moment),
        _steps(made, drives, force, moment, step_bend_rad),
        *(Bends(w, stretch), tension, residual),
    )
    shift = (pressed[:, 1:] - tension[:, :, 0]) / made.mount_stiffness[:, None]
    return TubeStates(made, w, stretch, tension[:, :, 0], tension[:, :, 1:], shift, residual)


def _rests_in_plane(robot: NotchedTubeRobot) -> bool:
    return all(item.rest_curvature_y_per_m == 0 == item.rest_twist_rad_per_m for item in robot.segments)


def _acts_in_plane(inputs: Sequence[Inputs], gravity: Array, loads: FaceLoads | None) -> bool:
    forces = [item.force_tip[:, 1] for item in inputs] + [gravity[1:2]]
    moments = [item.moment_tip[:, [0, 2]] for item in inputs]
    if loads is not None:
        forces.append(loads.force[..., 1])
        moments.append(loads.moment[..., [0, 2]])
    return not any(np.any(part) for part in (*forces, *moments))


def _face_loads(
    inputs: Sequence[Inputs], loads: FaceLoads | None, count: int
) -> tuple[NDArray[np.intp], Array, Array]:
    """Return loaded elements from 0, and what acts on them, nothing first, (B, r + 1, p, 3)."""
    element = [count - 1]
    force = np.array([item.force_tip for item in inputs])[:, :, None]
    moment = np.array([item.moment_tip for item in inputs])[:, :, None]
    if loads is not None:
        element += [int(k) - 1 for k in loads.element]
        force = np.concatenate([force, loads.force], axis=2)
        moment = np.concatenate([moment, loads.moment], axis=2)
    nothing = np.zeros((force.shape[0], 1, *force.shape[2:]))
    return (
        np.array(element),
        np.concatenate([nothing, force], axis=1),
        np.concatenate([nothing, moment], axis=1),
    )


def _steps(
    made: Chains, drives: Array, force: Array, moment: Array, step_bend_rad: float
) -> NDArray[np.int64]:
    """Return how many steps each row takes, the weight's first, shape (r + 1,); the same for all robots."""
    notch = made.tubes.notch
    arm = float((notch[:, :, kernels.TENDON] + notch[:, :, kernels.CENTROID]).max())
    by_length = not math.isnan(made.drive[0, kernels.DISPLACEMENT])
    softness = (1.0 / made.drive[:, kernels.SCALE]).max() / arm**2  # [rad/(N m)]
    per_drive = 1.0 / arm if by_length else arm * softness
    bend = (
        per_drive * np.abs(np.diff(drives, axis=1))
        + notch[:, :, kernels.PITCH].sum(axis=1).max()
        * softness
        * np.linalg.norm(np.diff(force, axis=1), axis=3).sum(axis=2)
        + softness * np.linalg.norm(np.diff(moment, axis=1), axis=3).sum(axis=2)
    ).max(axis=0)
    wanted = np.nan_to_num(bend / step_bend_rad, nan=1.0)  # what is no number has no balance in one step
    counted = np.clip(np.ceil(wanted), 1, _MOST_STEPS).astype(np.int64)
    return np.concatenate([[1], counted])


# ----------------------------------------------------------------------------------------------------
# The printed model: equal arcs of constant curvature, and Castigliano's theorem with friction at corners.
#
# York et al. 2015 (doi 10.1109/ICRA.2015.7139423), Swaney et al. 2017 (doi 10.1115/1.4034575). The papers
# were read in abstract only; the equations are those of the authors' statics script as it stands, with
# their equation numbers, in the public repository nepacheco/MastersThesis (Wrist_statics.m, 2020), and
# derived again here. Angles are of one notch. kappa is the curvature of the tube's axis, ybar as in
# `section`.


def bend_of_displacement(
    displacement_m: Array, height_m: float, centroid_m: float, tendon_radius_m: float
) -> Array:
    """Return the bend that shortens a notch's tendon by so much [rad].

    Printed: h - 2 (1 / kappa - r_i) sin(kappa h / (2 (1 + ybar kappa))), the tendon straight from edge to
    edge; with theta it is h (1 - sinc) + 2 (ybar + r_i) sin(theta / 2). Inverted by Newton's method from the
    printed approximation. Below zero displacement, where a tendon is slack, 0.
    """
    pulled = np.maximum(np.asarray(displacement_m, dtype=float), 0.0)
    arm = tendon_radius_m + centroid_m
    bend = pulled / arm
    for _ in range(30):
        half = 0.5 * bend
        error = height_m * (1.0 - np.sinc(half / np.pi)) + 2.0 * arm * np.sin(half) - pulled
        bend = bend - error / (arm * np.cos(half) + height_m * _arc_slope(bend))
    return np.asarray(bend)


def _arc_slope(bend: Array) -> Array:
    """Return the derivative of 1 - sinc(bend / 2) by the bend."""
    small = np.abs(bend) < 1e-3
    safe = np.where(small, 1.0, bend)
    exact = (2.0 * np.sin(0.5 * safe) / safe - np.cos(0.5 * safe)) / safe
    return np.where(small, bend / 12.0, exact)


def corner_loss(bend_rad: Array | float, mu: float) -> Array:
    """Return what share of its tension the tendon keeps at one of a notch's two corners, eta.

    Printed: eta = (sin(g / 2) - mu cos(g / 2)) / (sin(g / 2) + mu cos(g / 2)), g = pi - theta / 2, from the
    balance of a corner that touches in one point: (1 - mu tan(theta / 4)) / (1 + mu tan(theta / 4)). The
    capstan's exp(-mu theta / 2) is the same to second order; at theta = 0.48, mu = 0.2, to 2e-4.
    """
    touch = mu * np.tan(0.25 * np.asarray(bend_rad))
    return np.asarray((1.0 - touch) / (1.0 + touch))


def elastic_moment(segment: NotchedSegment, metal: Superelastic, bend_rad: Array) -> Array:
    """Return the moment that bends a notch, its strain zero on the centroid, shape as `bend_rad` [N m].

    Printed: the derivative by theta of h times the integral of the energy at the strain
    kappa (y - ybar) / (1 + ybar kappa). That strain is theta (y - ybar) / h, so the derivative is the
    integral of stress times (y - ybar). The neutral plane stays on the centroid: where tension reaches its
    plateau before compression does, the section's forces do not add up to the tendon's pull.
    """
    points = fibres(segment, 24, 48)
    distance = -points[:, 0]
    strain = np.multiply.outer(np.asarray(bend_rad, dtype=float), distance) / segment.notch_height_m
    result: Array = stress(metal, strain) @ (distance * points[:, 2])
    return result


def tension_of_bend(
    segment: NotchedSegment, metal: Superelastic, mu: float, notches: int, bend_rad: Array
) -> Array:
    """Return the tension at the actuator that bends each of `notches` notches by `bend_rad` [N].

    Printed: F = (dU / dtheta) / (L eta^(2 n)), L = (r_o + r_i) / 2 + ybar: every notch carries the tension
    that is left behind all 2 n corners, though only the last one does; so all bend alike. L puts the tendon
    in the wall's middle, where the kinematics puts it on the inner wall (r_i): kept as printed.
    """
    arm = 0.5 * (segment.outer_radius_m + segment.inner_radius_m) + section(segment).centroid_m
    return elastic_moment(segment, metal, bend_rad) / (arm * corner_loss(bend_rad, mu) ** (2 * notches))


def bend_of_tension(
    segment: NotchedSegment, metal: Superelastic, mu: float, notches: int, tension_N: Array
) -> Array:
    """Return `tension_of_bend` inverted, up to where the notches close [rad]."""
    closed = segment.notch_height_m / (segment.outer_radius_m + section(segment).centroid_m)
    grid = np.linspace(0.0, closed, 2001)
    needed = np.maximum.accumulate(tension_of_bend(segment, metal, mu, notches, grid))
    return np.interp(tension_N, needed, grid)


# ----------------------------------------------------------------------------------------------------
# The public static models of a notched tube: `york`, as printed, and `kinetostatic`, complete.


def kinetostatic(
    robot: NotchedTubeRobot, inputs: Inputs, gravity_mps2: Array, loads: FaceLoads | None = None
) -> StaticRun:
    """Return the postures by virtual work: superelastic notches, capstan friction with history, all loads.

    Args:
        robot: a notched tube.
        inputs: its tendon's tension or displacement, and optionally tip force and moment.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        loads: further loads.

    Raises:
        InputError: nothing balances a row.
    """
    states = solve_rows([robot], [inputs], gravity_mps2, loads)
    lost = np.isnan(states.residual[0])
    if lost.any():
        row = row_name(inputs, int(np.argmax(lost)))
        raise InputError(f"{robot.name}: static model 'kinetostatic' finds no equilibrium at {row}")
    (p_w,), (R_w,) = states.faces()
    found = tuple(
        Posture(
            p_w=p_w[row],
            R_w=R_w[row],
            joint_angles=angles,
            actuator_tension=states.tension[0, row : row + 1],
            tendon_tension=states.notch_tension[0, row : row + 1],
        )
        for row, angles in enumerate(states.joint_angles()[0])
    )
    return StaticRun("kinetostatic", inputs, np.asarray(gravity_mps2), found, states.residual[0])


def york(robot: NotchedTubeRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures as printed by York 2015: all notches bend alike; every row stands alone.

    A displacement bends by the kinematics alone; a tension by the printed statics, loading only.

    Args:
        robot: a notched tube of one segment, straight without load.
        inputs: its tendon's tension or displacement.
        gravity_mps2: none, shape (3,) [m/s^2].

    Raises:
        InputError: a load that the model does not have, or several segments.
    """
    _require_printed(robot, inputs, gravity_mps2)
    segment, tendon = robot.segments[0], robot.tendons[0]
    count, centroid = segment.notches, section(segment).centroid_m
    drive = inputs.tendon[:, 0]
    if inputs.actuation == "displacement":
        each = np.maximum(drive, 0.0) / count
        bend = bend_of_displacement(each, segment.notch_height_m, centroid, tendon.radius_m)
        bend = np.minimum(bend, closing_angle(segment))
        tension = _tension(robot, bend)
    else:
        bend = _bend(robot, drive)
        tension = drive
    found = tuple(_posture(robot, angle, force) for angle, force in zip(bend, tension, strict=True))
    return StaticRun("york", inputs, np.asarray(gravity_mps2), found, np.zeros(len(inputs)))


def _require_printed(robot: NotchedTubeRobot, inputs: Inputs, gravity_mps2: Array) -> None:
    if len(robot.segments) > 1:
        raise InputError(f"{robot.name}: static model 'york' takes one segment; take 'kinetostatic'")
    segment = robot.segments[0]
    rest = (segment.rest_curvature_x_per_m, segment.rest_curvature_y_per_m, segment.rest_twist_rad_per_m)
    if any(rest) or segment.stiffness_cubic_m2 or segment.stiffness_quintic_m4:
        raise InputError(
            f"{robot.name}: static model 'york' takes a straight tube of its metal's law; take 'kinetostatic'"
        )
    if np.any(gravity_mps2):
        raise InputError("static model 'york': has no weight, so gravity must be 0; take 'kinetostatic'")
    loaded = inputs.force_tip.any(axis=1) | inputs.moment_tip.any(axis=1)
    if loaded.any():
        row = row_name(inputs, int(np.argmax(loaded)))
        raise InputError(f"{row}: static model 'york': has no tip force or moment; take 'kinetostatic'")


def _bend(robot: NotchedTubeRobot, tension_N: Array) -> Array:
    segment = robot.segments[0]
    metal_tension = np.asarray(tension_N, dtype=float) / robot.stiffness_scale
    return bend_of_tension(segment, robot.material, robot.friction.mu, segment.notches, metal_tension)


def _tension(robot: NotchedTubeRobot, bend_rad: Array) -> Array:
    segment = robot.segments[0]
    found = tension_of_bend(segment, robot.material, robot.friction.mu, segment.notches, bend_rad)
    return robot.stiffness_scale * found


def _posture(robot: NotchedTubeRobot, bend: float, tension: float) -> Posture:
    """Return equal arcs of the tube's axis, s = h - ybar theta long, with the uncut pieces between them."""
    here, heading, faces = np.zeros(3), 0.0, []
    row = notches(robot)
    for item in row:
        length = item.segment.notch_height_m - section(item.segment).centroid_m * bend
        chord, middle = length * np.sinc(0.5 * bend / np.pi), heading + 0.5 * bend
        heading += bend
        here = here + chord * np.array([np.sin(middle), 0.0, np.cos(middle)])
        here = here + item.uncut_m * np.array([np.sin(heading), 0.0, np.cos(heading)])
        faces.append(here)
    turns = np.arange(1, len(row) + 1) * bend
    zero, one = np.zeros_like(turns), np.ones_like(turns)
    R_w = np.array(
        [[np.cos(turns), zero, np.sin(turns)], [zero, one, zero], [-np.sin(turns), zero, np.cos(turns)]]
    ).transpose(2, 0, 1)
    shift = np.array([0.0, 0.0, -tension / robot.mount.axial_stiffness_N_per_m])
    angles = np.full(len(row), bend)
    if robot.bending_axes == "xy":
        angles = np.concatenate([angles, np.zeros(2 * len(row))])
    loss = corner_loss(bend, robot.friction.mu) ** (2 * len(row))
    return Posture(
        p_w=np.array(faces) + shift,
        R_w=R_w,
        joint_angles=angles,
        actuator_tension=np.array([tension]),
        tendon_tension=np.full((1, len(row)), tension * loss),
    )


# ----------------------------------------------------------------------------------------------------
# The static models of notched tubes.


def _is_uniform(robot: NotchedTubeRobot) -> bool:
    return len(robot.segments) == 1


MODELS: tuple[StaticModel[NotchedTubeRobot], ...] = (
    StaticModel(
        "york",
        "equal arcs and Castigliano's theorem, as printed in York 2015; knows no unloading, load or weight",
        york,
        unless(_is_uniform, "several segments"),
    ),
    StaticModel(
        "kinetostatic",
        "virtual work of every notch: superelastic metal, friction with history, weight and tip load",
        kinetostatic,
    ),
)
