"""What acts about each hinge of a planar chain whose tendons run straight between eyelets.

With the hinge halfway along a cell of length h, bent by t, a tendon at the offset d has the length
h cos(t/2) - 2 d sin(t/2) between its two eyelets; minus its derivative is the moment arm.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.planar import (
    hinge_chain,
    hinge_moment_slopes,
    hinge_moments,
    hinge_points,
)
from catheter_sim.kinds.continuum.theory.planar_chain import (
    PlanarChain,
    PlanarDrive,
    elastic_moment,
    elastic_slope,
)


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
