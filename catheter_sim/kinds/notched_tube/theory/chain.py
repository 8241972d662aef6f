"""A notched tube as the arrays that the kinetostatic model takes, many robots at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.notched_tube.layout import Notch, notches
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot, Superelastic
from catheter_sim.kinds.notched_tube.theory.kernels import columns
from catheter_sim.kinds.notched_tube.theory.kernels.geometry import spans
from catheter_sim.kinds.notched_tube.theory.section import (
    closed_stiffness,
    closing_angle,
    fibres,
    section,
    torsion_stiffness,
)
from catheter_sim.kinds.notched_tube.theory.stress import knees

# Points over the wall's thickness and over its angle. Against 24 by 48 the notches of `notched_wrist`, whose
# flat plateau makes them softest, bend alike to 0.03 deg in the root mean square of all tensions.
RADIAL, AROUND = 8, 24


@dataclass(frozen=True)
class Chains:
    """B robots that differ in numbers only, as arrays. See `kernels` for the columns.

    Attributes:
        axes: 1 where notches bend toward +-x only, 3 where any way.
        spatial: whether the robots could, loads or none.
        notch: (B, n, 14). fibre: (B, n, f, 3). metal: (B, 4). mu: (B,).
        drive: displacement (NaN), compliance [m/N], pretension [N], scale [N/m], (B, 4).
        mass: of the elements, (B, n) [kg].
        mount_stiffness: (B,) [N/m].
    """

    axes: int
    spatial: bool
    notch: Array
    fibre: Array
    metal: Array
    mu: Array
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
    arm = notch[:, :, columns.TENDON] + notch[:, :, columns.CENTROID]
    pairs = list(zip(robots, rows, strict=True))
    bending = np.array([[_bending_stiffness(robot, item) for item in row] for robot, row in pairs])
    drive = np.full((len(robots), 4), math.nan)
    drive[:, [columns.COMPLIANCE, columns.PRETENSION]] = [_spring(robot) for robot in robots]
    drive[:, columns.SCALE] = 1.0 / (arm**2 / bending).sum(axis=1)
    return Chains(
        axes=axes,
        spatial=robots[0].bending_axes == "xy",
        notch=notch,
        fibre=np.array([_fibre_table(row, axes) for row in rows]),
        metal=np.array([_metal_row(robot.material, robot.stiffness_scale) for robot in robots]),
        mu=np.array([robot.friction.mu for robot in robots]),
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
    table[:, columns.SPAN] = spans(table, table[:, columns.REST : columns.REST + 3].copy())
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
