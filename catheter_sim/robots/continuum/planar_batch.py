"""The exact-arm statics of many planar robots at once, along their inputs.

The same model as `fkm_exact_arm`, in compiled form, for a fit that asks for many robots differing in a few
numbers. It has one pair of tendons by the rule of tensions (`tension_march`), tendons that end in
several segments by their motion (`sliding_march`). The steps between rows are longer than those
of the model, and the same for all robots of a batch, so that the outputs change smoothly with a number.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.robots.continuum.planar import (
    PlanarChain,
    bends_in_plane,
    largest_angles,
    planar_chain,
    step_counts,
)
from catheter_sim.robots.continuum.planar_kernels import march_by_sliding, march_by_tension
from catheter_sim.robots.continuum.spec import ContinuumRobot

# Of the whole robot between two steps. Over a loop of whole bends the tip is at most 0.04 mm from where the
# steps of `fkm_exact_arm` lead it; over 48 of two sections, 0.1 mm, and 0.015 mm in the root mean square.
STEP_BEND_RAD = 0.1
# The same of the tendons of one end that move alone, where tendons slide and nothing else acts: these make
# the same history in one step, to 1e-6 mm over random histories (to 0.06 mm where all tendons move).
ALONE_STEP_BEND_RAD = 1.0
_SAME_OFFSET_M = 1e-12


def knows(robot: ContinuumRobot) -> bool:
    """Return whether `solve_planar` takes `robot`.

    It is planar with one hinge a cell, and has either two tendons to its tip, one on each side, or
    tendons that end in several segments.
    """
    if not bends_in_plane(robot):
        return False
    if _ends_apart(robot):
        return True
    if len(robot.tendons) != 2 or robot.tendons[0].ends_at != robot.segments[-1].name:
        return False
    sides = [np.cos(item.angle_rad) for item in robot.tendons]
    return bool(sides[0] > 0.5 and sides[1] < -0.5)


def solve_planar(
    robots: Sequence[ContinuumRobot], inputs: Sequence[Inputs], gravity_mps2: Array
) -> tuple[Array, Array]:
    """Return the cells' angles and the base's shift of many robots along their inputs.

    Args:
        robots: alike but for their numbers; `knows` holds of each.
        inputs: tensions and tip loads, one per robot, of the same rows.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].

    Returns:
        Angles, shape (B, r, n) [rad], NaN from the row on at which nothing balances; shift of the
        base along z, shape (B, r) [m].
    """
    chains = [planar_chain(robot, "exact-arm batch") for robot in robots]
    cell = np.array([_cell_table(chain) for chain in chains])
    mu = np.array([chain.mu for chain in chains], dtype=float)
    weight = np.array([chain.face_mass[:, None] * gravity_mps2[[0, 2]] for chain in chains])
    tension = np.array([item.tendon for item in inputs], dtype=float)
    wrench = np.array([_planar_wrench(item) for item in inputs])
    offset = np.array([chain.offset[:, 0] for chain in chains])
    slides, unloaded = _ends_apart(robots[0]), not (weight.any() or wrench.any())
    alone_rad = ALONE_STEP_BEND_RAD if slides and unloaded else None
    steps = np.max([step_counts(chains[0], item, STEP_BEND_RAD, alone_rad) for item in inputs], axis=0)
    angles = np.empty((*tension.shape[:2], cell.shape[1]))
    if slides:
        reach = chains[0].reaches.sum(axis=1)
        groups = _alike(offset, reach)
        passing = (reach[[group[0] for group in groups]][:, None] > np.arange(cell.shape[1])).sum(axis=0)
        pulled = np.stack([tension[:, :, group].sum(axis=2) for group in groups], axis=2)
        march_by_sliding(
            cell,
            np.ascontiguousarray(offset[:, [group[0] for group in groups]]),
            passing,
            mu,
            weight,
            np.concatenate([pulled, wrench], axis=2),
            steps,
            unloaded,
            angles,
        )
    else:
        march_by_tension(cell, np.abs(offset), mu, weight, tension, wrench, steps, unloaded, angles)
    load = weight[:, :, 1].sum(axis=1)[:, None] + wrench[:, :, 1] - tension.sum(axis=2)
    return angles, load / np.array([[chain.mount_stiffness] for chain in chains])


def _ends_apart(robot: ContinuumRobot) -> bool:
    return len({tendon.ends_at for tendon in robot.tendons}) > 1


def _cell_table(chain: PlanarChain) -> Array:
    """Return the columns of the kernels' `cell`, shape (n, 6)."""
    law = (chain.stiffness, chain.cubic, chain.quintic, chain.rest_curvature)
    return np.stack([chain.cell_length, *law, largest_angles(chain)], axis=1)


def _planar_wrench(inputs: Inputs) -> Array:
    """Return force along x and z on the tip and moment about y, shape (r, 3)."""
    return np.stack([inputs.force_tip[:, 0], inputs.force_tip[:, 2], inputs.moment_tip[:, 1]], axis=1)


def _alike(offset: Array, reach: NDArray[np.intp]) -> list[list[int]]:
    """Return the tendons that slip alike, those that reach furthest first.

    Tendons with the same offset and end move alike over each eyelet, whatever their tensions; so their
    tensions act as one.

    Args:
        offset: x of the eyelets, shape (B, t) [m].
        reach: how many cells each tendon passes, shape (t,).
    """
    groups: list[list[int]] = []
    for tendon in np.argsort(-reach, kind="stable").tolist():
        for group in groups:
            apart = np.abs(offset[:, tendon] - offset[:, group[0]]).max()
            if reach[tendon] == reach[group[0]] and apart < _SAME_OFFSET_M:
                group.append(tendon)
                break
        else:
            groups.append([tendon])
    return groups
