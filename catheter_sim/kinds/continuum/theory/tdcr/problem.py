"""What the rod models of a tendon-driven robot need, as arrays: the robot and the loads of each row.

Everything is in the base frame of the straight robot, SI units. Subsegment j (0 at the base) lies
between the disks j and j + 1; the fixed disk at z = 0 is disk 0. Weight and whatever else is
distributed acts at the disks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.kinds.continuum.layout import disk_masses, disks, last_disk
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Segment


@dataclass(frozen=True)
class Problem:
    """A robot of n subsegments and t tendons; `stiffness_scale` is already in the stiffnesses.

    Attributes:
        name: of the robot, for messages.
        length_m: of each subsegment, shape (n,) [m].
        bending_N_m2: EI, shape (n,) [N m^2].
        torsion_N_m2: GJ, shape (n,) [N m^2]; inf: cannot twist.
        axial_N: EA, shape (n,) [N]; inf: cannot stretch.
        shear_N: GA, shape (n,) [N]; inf: cannot shear.
        planar: whether a subsegment bends in the xz plane only, shape (n,).
        segment: index of the segment that it belongs to, shape (n,).
        disk_z_m: heights of the disks in the straight robot, disk 0 first, shape (n + 1,) [m].
        disk_mass_kg: of disks 1 to n, shape (n,) [kg].
        hole_m: (x, y) of each tendon's holes in the disks' frames, shape (t, 2) [m].
        last_disk: number of the disk in which each tendon ends, 1 to n, shape (t,).
        mu: capstan coefficient at every hole, the base's included.
    """

    name: str
    length_m: Array
    bending_N_m2: Array
    torsion_N_m2: Array
    axial_N: Array
    shear_N: Array
    planar: NDArray[np.bool_]
    segment: NDArray[np.intp]
    disk_z_m: Array
    disk_mass_kg: Array
    hole_m: Array
    last_disk: NDArray[np.intp]
    mu: float


@dataclass(frozen=True)
class Load:
    """What acts on a robot at each of r rows, in the base frame; the loads keep their direction.

    Attributes:
        tension_N: of each tendon at the base, shape (r, t) [N].
        force_N: on the centres of disks 1 to n, shape (r, n, 3) [N].
        moment_N_m: on the same disks, shape (r, n, 3) [N m].
    """

    tension_N: Array
    force_N: Array
    moment_N_m: Array

    def __len__(self) -> int:
        return len(self.tension_N)


def problem(robot: ContinuumRobot) -> Problem:
    """Return `robot` as arrays; its `effects`, `dynamics` and `links_per_subsegment` are not read.

    `stiffness_scale` multiplies all four stiffnesses, as a change of Young's modulus does.

    Raises:
        InputError: it has what no rod model carries (`unsupported`).
    """
    reason = unsupported(robot)
    if reason:
        raise InputError(f"{robot.name}: {reason}: the rod models do not carry it; 'CC' does")
    parts = [segment for segment in robot.segments for _ in range(disks(robot, segment))]
    length = np.array([segment.length_m / disks(robot, segment) for segment in parts])

    def scaled(name: str) -> Array:
        return robot.stiffness_scale * np.array([float(getattr(segment, name)) for segment in parts])

    return Problem(
        name=robot.name,
        length_m=length,
        bending_N_m2=scaled("bending_stiffness_N_m2"),
        torsion_N_m2=scaled("torsion_stiffness_N_m2"),
        axial_N=scaled("axial_stiffness_N"),
        shear_N=scaled("shear_stiffness_N"),
        planar=np.array([segment.bending_axes == "x" for segment in parts]),
        segment=np.repeat(
            np.arange(len(robot.segments)), [disks(robot, segment) for segment in robot.segments]
        ),
        disk_z_m=np.concatenate([[0.0], np.cumsum(length)]),
        disk_mass_kg=disk_masses(robot),
        hole_m=np.array(
            [
                [item.radius_m * math.cos(item.angle_rad), item.radius_m * math.sin(item.angle_rad)]
                for item in robot.tendons
            ]
        ).reshape(-1, 2),
        last_disk=np.array([last_disk(robot, item) for item in robot.tendons], dtype=np.intp),
        mu=robot.friction.mu,
    )


def unsupported(robot: ContinuumRobot) -> str:
    """Return what of `robot` no rod model carries, in words; empty where they carry it."""
    for segment in robot.segments:
        reason = _unsupported_segment(segment)
        if reason:
            return f"segments.{segment.name}: {reason}"
    if math.isfinite(robot.mount.axial_stiffness_N_per_m):
        return "mount: a mount that gives way"
    return ""


def _unsupported_segment(segment: Segment) -> str:
    if segment.bending_axes in ("y", "none"):
        return f"bending_axes = {segment.bending_axes}"
    if segment.hinge_share != 0.5:
        return "hinges off the middles"
    if segment.stiffness_cubic_m2 or segment.stiffness_quintic_m4:
        return "an elastic law that is not linear"
    if segment.rest_curvature_x_per_m or segment.rest_curvature_y_per_m:
        return "rest curvature"
    if segment.rest_twist_rad_per_m:
        return "rest twist"
    return ""


def is_rod(robot: ContinuumRobot) -> bool:
    """Return whether the rod models carry `robot`: linear, straight at rest, on a mount that holds."""
    return not unsupported(robot)


def load(rod: Problem, inputs: Inputs, gravity_mps2: Array) -> Load:
    """Return the tensions, weights and tip loads of every row of `inputs`.

    Displacement inputs leave the tensions at zero: see `displacement.driven`.
    """
    rows, count = len(inputs), len(rod.length_m)
    force = np.zeros((rows, count, 3))
    moment = np.zeros((rows, count, 3))
    force += rod.disk_mass_kg[:, None] * np.asarray(gravity_mps2, dtype=float)
    force[:, -1] += inputs.force_tip
    moment[:, -1] += inputs.moment_tip
    tension = np.array(inputs.tendon, dtype=float)
    if inputs.actuation != "tension":
        tension[:] = 0.0
    return Load(tension_N=tension, force_N=force, moment_N_m=moment)


def linear_bends(rod: Problem, loads: Load) -> Array:
    """Return the bends toward +x and +y that the straight robot's moments give, shape (r, n, 2) [rad]."""
    runs = np.arange(len(rod.length_m)) < rod.last_disk[:, None]  # (t, n)
    by_tendon = loads.tension_N @ (rod.hole_m[:, :, None] * runs[:, None]).transpose(1, 0, 2)  # (2, r, n)

    def beyond(value: Array) -> Array:
        return np.cumsum(value[:, ::-1], axis=1)[:, ::-1]

    force = loads.force_N[:, :, :2]
    moment = beyond(force * rod.disk_z_m[1:, None]) - beyond(force) * rod.disk_z_m[:-1, None]
    moment += np.moveaxis(by_tendon, 0, 2)
    twist = beyond(loads.moment_N_m)
    moment[:, :, 0] += twist[:, :, 1]
    moment[:, :, 1] -= twist[:, :, 0]
    return moment * (rod.length_m / rod.bending_N_m2)[:, None]
