"""A planar robot as static models read it: cells, elastic law, tendons, moments about each hinge."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.posture import Posture
from catheter_sim.core.statics import StaticRun, require_tensions
from catheter_sim.errors import InputError
from catheter_sim.mechanics.hysteresis import counts_where_alone
from catheter_sim.robots.continuum.description import (
    face_masses,
    is_centred,
    last_disk,
    link_lengths,
    outputs,
    per_link,
    winds_or_converges,
)
from catheter_sim.robots.continuum.spec import ContinuumRobot

# ----------------------------------------------------------------------------------------------------
# Where a planar chain's cells are, from their bend angles: hinge at mid-cell, or circular arc.
#
# A cell bends by `angle` about +y, so that a positive angle leans it toward +x. Every function takes one
# chain, or many at once (leading axes), and starts at the origin along +z.

_SMALL_ANGLE_RAD = 1e-4  # below it the chord's series is exact to the last bit


def headings(angles: Array) -> tuple[Array, Array]:
    """Return each cell's lean before and behind its bend, shape (..., n) each [rad].

    Args:
        angles: bend angle of each cell, base to tip, shape (..., n) [rad].
    """
    behind = np.cumsum(angles, axis=-1)
    return behind - angles, behind


def hinge_faces(angles: Array, cell_length: Array, cells: Sequence[int] | slice = slice(None)) -> Array:
    """Return the centres of the distal faces of `cells`, shape (..., c, 3) [m]; see `hinge_chain`."""
    before, behind = headings(angles)
    half = 0.5 * cell_length
    x = np.cumsum(half * (np.sin(before) + np.sin(behind)), axis=-1)
    z = np.cumsum(half * (np.cos(before) + np.cos(behind)), axis=-1)
    return _in_space(x[..., cells], z[..., cells])


def hinge_chain(angles: Array, cell_length: Array) -> tuple[Array, Array]:
    """Return the cells' distal faces where each cell bends at a hinge halfway along it.

    Args:
        angles: bend angle of each cell, base to tip, shape (..., n) [rad].
        cell_length: shape (n,), or one that broadcasts to `angles` [m]; in cells of equal length h, cell
            k's hinge is at (k - 1/2) h.

    Returns:
        Centres `p_w`, shape (..., n, 3) [m], and orientations `R_w`, shape (..., n, 3, 3).
    """
    return hinge_faces(angles, cell_length), rotations(np.cumsum(angles, axis=-1))


def hinge_points(angles: Array, cell_length: Array) -> Array:
    """Return the cells' hinges, shape (..., n, 3) [m]; arguments as in `hinge_chain`."""
    faces = hinge_faces(angles, cell_length)
    _, behind = headings(angles)
    half = 0.5 * cell_length
    return faces - _in_space(half * np.sin(behind), half * np.cos(behind))


def arc_chain(angles: Array, cell_length: Array) -> tuple[Array, Array]:
    """Return the cells' distal faces where each cell bends into a circular arc (Kato 2016, A2).

    A cell of length s that bends by t spans the chord s sin(t/2) / (t/2) at half its bend angle.

    Args:
        angles: bend angle of each cell, base to tip, shape (..., n) [rad].
        cell_length: arc length of each cell, shape (n,) [m].

    Returns:
        Centres `p_w`, shape (..., n, 3) [m], and orientations `R_w`, shape (..., n, 3, 3).
    """
    before, behind = headings(angles)
    half = 0.5 * angles
    bent = np.where(np.abs(half) > _SMALL_ANGLE_RAD, half, 1.0)
    ratio = np.where(np.abs(half) > _SMALL_ANGLE_RAD, np.sin(bent) / bent, 1.0 - half**2 / 6.0)
    chord = cell_length * ratio
    x = np.cumsum(chord * np.sin(before + half), axis=-1)
    z = np.cumsum(chord * np.cos(before + half), axis=-1)
    return _in_space(x, z), rotations(behind)


def rotations(lean: Array) -> Array:
    """Return the rotations about +y by `lean` [rad], shape (..., n, 3, 3)."""
    R_w = np.zeros((*np.shape(lean), 3, 3))
    R_w[..., 0, 0] = R_w[..., 2, 2] = np.cos(lean)
    R_w[..., 0, 2] = np.sin(lean)
    R_w[..., 2, 0] = -np.sin(lean)
    R_w[..., 1, 1] = 1.0
    return R_w


def hinge_moments(hinges: Array, faces: Array, force: Array) -> Array:
    """Return the moment about +y at each hinge of the forces on the faces beyond it, shape (n,) [N m].

    Args:
        hinges: shape (n, 3) [m].
        faces: points at which the forces act, shape (n, 3) [m]; face k belongs to cell k.
        force: shape (n, 3) [N]; its y parts bend nothing.
    """
    fx, fz = force[:, 0], force[:, 2]
    about_origin = _beyond(faces[:, 2] * fx - faces[:, 0] * fz)
    return about_origin - hinges[:, 2] * _beyond(fx) + hinges[:, 0] * _beyond(fz)


def hinge_moment_slopes(hinges: Array, faces: Array, force: Array) -> Array:
    """Return how `hinge_moments` changes with the bend angles, shape (n, n) [N m/rad].

    Turning hinge m swings everything beyond it. The moment at hinge k sees the part beyond both, so
    that entry (k, m) depends on the outer one of the two alone, and the matrix is symmetric.
    """
    fx, fz = force[:, 0], force[:, 2]
    along = _beyond(faces[:, 0] * fx + faces[:, 2] * fz)
    outer = hinges[:, 0] * _beyond(fx) + hinges[:, 2] * _beyond(fz) - along
    index = np.arange(len(outer))
    return outer[np.maximum.outer(index, index)]


def _beyond(values: Array) -> Array:
    """Return for each cell the sum from it to the tip."""
    return np.cumsum(values[::-1])[::-1]


def _in_space(x: Array, z: Array) -> Array:
    return np.stack([x, np.zeros_like(x), z], axis=-1)


# ----------------------------------------------------------------------------------------------------
# A planar robot as the static models read it: per cell its length, elastic law and tendons.
#
# This is the one place where the planar models check what they are asked: whether the robot bends in one
# plane, and whether its inputs are ones that they know.

# Between two rows of inputs the models go in steps of at most this much bending of the whole robot.
# Halving it moves the tip of `neuroendoscope_section` by at most 5 um over its nominal table.
STEP_BEND_RAD = 0.025
_MAX_STEPS = 2000  # between two rows; only inputs far beyond what a robot can bear ask for more


@dataclass(frozen=True)
class PlanarChain:
    """A robot that bends in the xz plane, cell by cell, base to tip.

    Attributes:
        robot: the specification that this was read from.
        cell_length: shape (n,) [m].
        stiffness: EI of each cell, `stiffness_scale` included, shape (n,) [N m^2].
        cubic, quintic: of the elastic law M = EI (k + cubic k^3 + quintic k^5), k the curvature
            beyond the one at rest, shape (n,) [m^2] and [m^4].
        rest_curvature: toward +x, shape (n,) [1/m].
        offset: x of each tendon's eyelets, zero beyond its end, shape (t, n) [m] (Kato 2016, Eq. 6).
        reaches: whether the tendon passes the cell, shape (t, n).
        face_mass: at the centre of each distal face, shape (n,) [kg].
        mu: friction coefficient at every eyelet.
        mount_stiffness: of the base along z [N/m].
    """

    robot: ContinuumRobot
    cell_length: Array
    stiffness: Array
    cubic: Array
    quintic: Array
    rest_curvature: Array
    offset: Array
    reaches: np.ndarray
    face_mass: Array
    mu: float
    mount_stiffness: float


@dataclass(frozen=True)
class PlanarDrive:
    """What acts on the robot at one instant.

    Attributes:
        tension: of each tendon at the actuator, shape (t,) [N].
        face_force: on each distal face, weight and tip force, base frame, shape (n, 3) [N].
        tip_moment: about +y, on the last face [N m].
    """

    tension: Array
    face_force: Array
    tip_moment: float

    @property
    def loaded(self) -> bool:
        """Whether anything but the tendons bends the robot."""
        return bool(np.any(self.face_force[:, [0, 2]])) or self.tip_moment != 0.0


def bends_in_plane(robot: ContinuumRobot) -> bool:
    """Return whether `robot` bends in the xz plane only, one hinge a cell, in its middle, holes in a row."""
    plain = robot.links_per_subsegment == 1 and is_centred(robot) and not winds_or_converges(robot)
    return _in_plane(robot) and plain


def _in_plane(robot: ContinuumRobot) -> bool:
    return all(segment.bending_axes == "x" for segment in robot.segments)


def planar_chain(robot: ContinuumRobot, model: str) -> PlanarChain:
    """Return `robot` cell by cell.

    `model`: name of the static model that asks, for errors.

    Raises:
        InputError: the robot does not bend in one plane, or a cell has more than one hinge.
    """
    if not _in_plane(robot):
        raise InputError(
            f"static model {model!r}: robot {robot.name!r} bends out of the xz plane; "
            "every segment needs bending_axes = 'x'"
        )
    if robot.links_per_subsegment != 1:
        raise InputError(
            f"static model {model!r}: links_per_subsegment = {robot.links_per_subsegment}: "
            "one hinge a cell is needed (1)"
        )
    if not is_centred(robot):
        raise InputError(f"static model {model!r}: hinge_share of 0.5 is needed")
    if winds_or_converges(robot):
        raise InputError(f"static model {model!r}: tendons that wind or converge are not in a planar model")
    for segment in robot.segments:
        for key in ("rest_curvature_y_per_m", "rest_twist_rad_per_m"):
            if getattr(segment, key) != 0.0:
                raise InputError(
                    f"static model {model!r}: segments.{segment.name}: a planar model needs "
                    "rest_curvature_y_per_m and rest_twist_deg_per_m = 0"
                )
    length = link_lengths(robot)
    last = np.array([last_disk(robot, tendon) for tendon in robot.tendons])
    x = [tendon.radius_m * math.cos(tendon.angle_rad) for tendon in robot.tendons]
    # A tendon at 90 deg sits in the neutral plane: cos leaves it 1e-19 m off, on a side of its own.
    x = [0.0 if abs(d) < 1e-9 * tendon.radius_m else d for d, tendon in zip(x, robot.tendons, strict=True)]
    reaches = np.arange(len(length))[None, :] < last[:, None]
    return PlanarChain(
        robot=robot,
        cell_length=length,
        stiffness=per_link(robot, lambda segment: segment.bending_stiffness_N_m2) * robot.stiffness_scale,
        cubic=per_link(robot, lambda segment: segment.stiffness_cubic_m2),
        quintic=per_link(robot, lambda segment: segment.stiffness_quintic_m4),
        rest_curvature=per_link(robot, lambda segment: segment.rest_curvature_x_per_m),
        offset=np.where(reaches, np.array(x)[:, None], 0.0),
        reaches=reaches,
        face_mass=face_masses(robot),
        mu=robot.friction.mu,
        mount_stiffness=robot.mount.axial_stiffness_N_per_m,
    )


def elastic_moment(chain: PlanarChain, angles: Array) -> Array:
    """Return each cell's elastic moment at its bend angle, shape (n,) [N m]."""
    k = angles / chain.cell_length - chain.rest_curvature
    return chain.stiffness * k * (1.0 + k**2 * (chain.cubic + k**2 * chain.quintic))


def elastic_slope(chain: PlanarChain, angles: Array) -> Array:
    """Return the derivative of `elastic_moment`, shape (n,) [N m/rad]."""
    k = angles / chain.cell_length - chain.rest_curvature
    slope = 1.0 + k**2 * (3.0 * chain.cubic + 5.0 * k**2 * chain.quintic)
    return chain.stiffness * slope / chain.cell_length


def rest_angles(chain: PlanarChain) -> Array:
    """Return the cells' bend angles without any load, shape (n,) [rad]."""
    return chain.rest_curvature * chain.cell_length


def require_tension_inputs(inputs: Inputs, model: str) -> None:
    """Raise `InputError` where the inputs are displacements."""
    instead = (
        "; displacement inputs are taken by the simulation and by the static model 'CC' where it applies"
    )
    require_tensions(inputs, model, instead)


def require_unloaded(inputs: Inputs, gravity_mps2: Array, model: str) -> None:
    """Raise `InputError` where weight, tip force or tip moment would bend the robot in its plane."""
    instead = "take 'fkm_exact_arm' or 'fkm_sliding'"
    if gravity_mps2[0] != 0.0 or gravity_mps2[2] != 0.0:
        raise InputError(f"static model {model!r}: has no weight, so gravity x and z must be 0; {instead}")
    bends = inputs.force_tip[:, [0, 2]].any(axis=1) | (inputs.moment_tip[:, 1] != 0.0)
    if bends.any():
        row = row_name(inputs, int(np.argmax(bends)))
        raise InputError(f"{row}: static model {model!r}: has no tip force or moment; {instead}")


def drives(chain: PlanarChain, inputs: Inputs, gravity_mps2: Array) -> Iterator[tuple[PlanarDrive, ...]]:
    """Yield for each row of inputs the instants that lead to it from the row before, the row last.

    The first row is reached from rest: zero inputs, weight already acting. Between rows everything
    moves linearly; the steps are so small that a step's change of inputs bends a frictionless robot
    by no more than `STEP_BEND_RAD`.
    """
    weight = chain.face_mass[:, None] * gravity_mps2[None, :]
    counts = step_counts(chain, inputs, STEP_BEND_RAD)
    tension = np.zeros(inputs.tendon.shape[1])
    force, moment = np.zeros(3), 0.0
    for row in range(len(inputs)):
        d_tension = inputs.tendon[row] - tension
        d_force = inputs.force_tip[row] - force
        d_moment = float(inputs.moment_tip[row, 1]) - moment
        steps = []
        for part in np.arange(1, counts[row] + 1) / counts[row]:
            face_force = weight.copy()
            face_force[-1] += force + part * d_force
            steps.append(PlanarDrive(tension + part * d_tension, face_force, moment + part * d_moment))
        yield tuple(steps)
        tension, force, moment = inputs.tendon[row], inputs.force_tip[row], float(inputs.moment_tip[row, 1])


def step_counts(
    chain: PlanarChain, inputs: Inputs, step_bend_rad: float, alone_bend_rad: float | None = None
) -> NDArray[np.intp]:
    """Return in how many steps to go from row to row, from zero inputs to the first, shape (r,).

    A step's change of inputs bends a frictionless robot by no more than `step_bend_rad`, or by no more than
    `alone_bend_rad`, where that is given. The latter holds if all but the tendons of one end bend it by
    less than a tenth of `step_bend_rad`.
    """

    def changes(values: Array) -> Array:
        return np.abs(np.diff(values, axis=0, prepend=0.0))

    compliance = float(np.sum(chain.cell_length / chain.stiffness))  # rad per N m
    arm = max((tendon.radius_m for tendon in chain.robot.tendons), default=0.0)
    pulls = compliance * arm * changes(inputs.tendon)
    loads = changes(inputs.moment_tip[:, 1:2]).sum(axis=1)
    loads += float(np.sum(chain.cell_length)) * changes(inputs.force_tip[:, [0, 2]]).sum(axis=1)
    bend = pulls.sum(axis=1) + compliance * loads
    counts = np.ceil(bend / step_bend_rad)
    if alone_bend_rad is not None:
        ends = [tendon.ends_at for tendon in chain.robot.tendons]
        alone = np.max([pulls[:, [end == own for own in ends]].sum(axis=1) for end in ends], axis=0)
        counts = counts_where_alone(bend, alone, step_bend_rad, alone_bend_rad)
    return np.clip(counts, 1, _MAX_STEPS).astype(np.intp)


def at_rest(chain: PlanarChain, gravity_mps2: Array) -> PlanarDrive:
    """Return the state before the first row: no inputs, only weight."""
    weight = chain.face_mass[:, None] * gravity_mps2[None, :]
    return PlanarDrive(np.zeros(len(chain.robot.tendons)), weight, 0.0)


def posture(
    chain: PlanarChain, angles: Array, p_w: Array, R_w: Array, tension: Array, drive: PlanarDrive
) -> Posture:
    """Return the posture of a chain, its base pressed into the mount by everything that acts on it.

    The mount carries the actuators' tensions (the part that friction takes goes into it as well),
    the tip force and the weight of the cells.

    Args:
        chain: the robot.
        angles: bend angles, shape (n,) [rad].
        p_w, R_w: of the distal faces on a rigid mount, shapes (n, 3) [m] and (n, 3, 3).
        tension: of each tendon in each cell, shape (t, n) [N].
        drive: what acts.
    """
    load = float(drive.face_force[:, 2].sum() - drive.tension.sum())
    shift = np.array([0.0, 0.0, load / chain.mount_stiffness])
    return Posture(
        p_w=p_w + shift,
        R_w=R_w,
        joint_angles=joint_angles(chain.robot, angles),
        actuator_tension=np.array(drive.tension),
        tendon_tension=np.where(chain.reaches, tension, np.nan),
    )


def joint_angles(robot: ContinuumRobot, angles: Array) -> Array:
    """Return the bend angles (..., n) in the order of `Outputs.joints`; nothing twists a planar robot."""
    names = outputs(robot).joints
    result = np.zeros((*angles.shape[:-1], len(names)))
    result[..., [name.startswith("x") for name in names]] = angles
    return result


def static_run(
    model: str, inputs: Inputs, gravity_mps2: Array, postures: list[Posture], residual: list[float]
) -> StaticRun:
    """Return the results of one model along a history of inputs."""
    return StaticRun(model, inputs, gravity_mps2, tuple(postures), np.array(residual))


# ----------------------------------------------------------------------------------------------------
# What acts about each hinge of a planar chain whose tendons run straight between eyelets.
#
# With the hinge halfway along a cell of length h, bent by t, a tendon at the offset d has the length h
# cos(t/2) - 2 d sin(t/2) between its two eyelets; minus its derivative is the moment arm.


def moment_arms(chain: PlanarChain, angles: Array) -> Array:
    """Return each tendon's moment arm about each hinge, toward +x, shape (t, n) [m]."""
    half = 0.5 * angles
    arms = chain.offset * np.cos(half) + 0.5 * chain.cell_length * np.sin(half)
    return np.where(chain.reaches, arms, 0.0)


def arm_slopes(chain: PlanarChain, angles: Array) -> Array:
    """Return the derivative of `moment_arms` by the cell's own angle, shape (t, n) [m/rad]."""
    half = 0.5 * angles
    slopes = 0.25 * chain.cell_length * np.cos(half) - 0.5 * chain.offset * np.sin(half)
    return np.where(chain.reaches, slopes, 0.0)


def lengths(chain: PlanarChain, angles: Array) -> Array:
    """Return each tendon's length between the eyelets of each cell, shape (t, n) [m]."""
    half = 0.5 * angles
    return np.where(chain.reaches, chain.cell_length * np.cos(half) - 2.0 * chain.offset * np.sin(half), 0.0)


def load_moments(chain: PlanarChain, angles: Array, drive: PlanarDrive) -> Array:
    """Return the moment of weight and tip load about each hinge, shape (n,) [N m]."""
    faces, _ = hinge_chain(angles, chain.cell_length)
    hinges = hinge_points(angles, chain.cell_length)
    return hinge_moments(hinges, faces, drive.face_force) + drive.tip_moment


def load_slopes(chain: PlanarChain, angles: Array, drive: PlanarDrive) -> Array:
    """Return the derivative of `load_moments` by the bend angles, shape (n, n) [N m/rad]."""
    faces, _ = hinge_chain(angles, chain.cell_length)
    hinges = hinge_points(angles, chain.cell_length)
    return hinge_moment_slopes(hinges, faces, drive.face_force)


def cell_slopes(chain: PlanarChain, angles: Array, tension: Array) -> Array:
    """Return each cell's stiffness under constant tensions, shape (n,) [N m/rad]."""
    return elastic_slope(chain, angles) - (tension * arm_slopes(chain, angles)).sum(axis=0)


def unbalanced(chain: PlanarChain, angles: Array, tension: Array, drive: PlanarDrive) -> Array:
    """Return what each cell's elastic moment lacks to balance tendons and loads, shape (n,) [N m]."""
    acting = (tension * moment_arms(chain, angles)).sum(axis=0)
    return acting + load_moments(chain, angles, drive) - elastic_moment(chain, angles)


def largest_angles(chain: PlanarChain) -> Array:
    """Return the bend at which the innermost tendon of each cell has no length left, shape (n,) [rad]."""
    offset = np.abs(chain.offset).max(axis=0, initial=0.0)
    return 2.0 * np.arctan2(0.5 * chain.cell_length, offset)
