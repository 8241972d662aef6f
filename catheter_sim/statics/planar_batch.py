"""The exact-arm statics of one antagonistic pair of tendons, for many robots at once.

The same model as `fkm_exact_arm` (arms d cos(t/2) + (h/2) sin(t/2), capstan friction with history by
`slip.tensions_behind`), written for a fit that asks for many robots differing in a few numbers. A
cell's balance in a row needs the cell before it in the same row and itself in the row before; so all
cells with the same sum of row and cell number are solved together, and a history of r rows and n
cells takes r + n - 1 passes instead of r n.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.posture import Array
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.statics.planar import hinge_chain, hinge_points
from catheter_sim.statics.planar_chain import PlanarChain, planar_chain

STEP_BEND_RAD = 0.1  # of the whole robot between two steps; see the test against fkm_exact_arm
_MAX_STEPS = 500
_ITERATIONS = 12
_TOLERANCE_RAD = 1e-7
_LARGEST_ANGLE_RAD = 1.5  # of a cell: beyond it nothing balances
_LOAD_ROUNDS = 60
_LOAD_TOLERANCE_RAD = 1e-7
_ASTRAY_RAD = 1e-4  # still moving after so many rounds: no balance


def knows(robot: ContinuumRobot) -> bool:
    """Return whether `robot` is planar with two tendons, one on each side, that end at its tip."""
    if any(segment.bending_axes != "x" for segment in robot.segments) or robot.links_per_subsegment != 1:
        return False
    if len(robot.tendons) != 2 or any(item.ends_at != robot.segments[-1].name for item in robot.tendons):
        return False
    sides = [np.cos(item.angle_rad) for item in robot.tendons]
    return bool(sides[0] > 0.5 and sides[1] < -0.5)


def solve_pairs(
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
    command = np.array([item.tendon for item in inputs])  # (B, r, 2)
    wrench = np.array([_planar_wrench(item) for item in inputs])  # (B, r, 3): Fx, Fz, My
    weight = np.array([chain.face_mass[:, None] * gravity_mps2[[0, 2]] for chain in chains])  # (B, n, 2)
    counts = _substeps(chains, command)
    fine = _refined(command, counts)
    pull = fine.sum(axis=2)
    rows = np.cumsum(counts) - 1
    loads_fine = _refined(wrench, counts)
    angles = _march(chains, fine, np.zeros((*fine.shape[:2], len(chains[0].cell_length))))
    if weight.any() or wrench.any():
        angles = _with_loads(chains, fine, loads_fine, weight, angles)
    total = (weight[:, None, :, 1].sum(axis=2) + loads_fine[:, :, 1] - pull)[:, rows]
    shift = total / np.array([[chain.mount_stiffness] for chain in chains])
    return angles[:, rows], shift


def _planar_wrench(inputs: Inputs) -> Array:
    return np.stack([inputs.force_tip[:, 0], inputs.force_tip[:, 2], inputs.moment_tip[:, 1]], axis=1)


def _substeps(chains: Sequence[PlanarChain], command: Array) -> NDArray[np.intp]:
    """Return into how many steps each row is cut, shape (r,)."""
    chain = chains[0]
    compliance = float(np.sum(chain.cell_length / chain.stiffness))
    arm = float(np.abs(chain.offset).max())
    change = np.diff(command, axis=1, prepend=0.0)
    largest = np.abs(change).sum(axis=2).max(axis=0)
    return np.clip(np.ceil(compliance * arm * largest / STEP_BEND_RAD), 1, _MAX_STEPS).astype(np.intp)


def _refined(values: Array, counts: NDArray[np.intp]) -> Array:
    """Return rows (B, r, c), reached linearly from zero, cut into steps, (B, sum(counts), c)."""
    before = np.concatenate([np.zeros_like(values[:, :1]), values[:, :-1]], axis=1)
    row = np.repeat(np.arange(len(counts)), counts)
    start = np.repeat(np.cumsum(counts) - counts, counts)
    part = ((np.arange(len(row)) - start + 1) / counts[row])[None, :, None]
    return before[:, row] + (values - before)[:, row] * part


def _march(chains: Sequence[PlanarChain], command: Array, load: Array) -> Array:
    """Return the cells' angles under tensions (B, r, 2) and load moments (B, r, n), (B, r, n)."""
    batch, rows, cells = load.shape

    def stack(name: str) -> Array:
        return np.array([getattr(chain, name) for chain in chains])

    length = stack("cell_length")
    stiffness, cubic, quintic = stack("stiffness"), stack("cubic"), stack("quintic")
    rest = stack("rest_curvature")
    offset = np.array([chain.offset[:, 0] for chain in chains])  # (B, 2)
    right, left = offset[:, :1], -offset[:, 1:]
    half_mu = 0.5 * np.array([[chain.mu] for chain in chains])
    behind = np.zeros((batch, cells, 2))
    angle = rest * length
    found = np.empty((batch, rows, cells))
    for wave in range(rows + cells - 1):
        first, last = max(0, wave - rows + 1), min(cells, wave + 1)
        here = slice(first, last)
        row = wave - np.arange(first, last)
        before = np.empty((batch, last - first, 2))
        angle_before = np.zeros((batch, last - first))
        if first == 0:
            before[:, 0] = command[:, wave]
            before[:, 1:] = behind[:, : last - 1]
            angle_before[:, 1:] = angle[:, : last - 1]
        else:
            before[:] = behind[:, first - 1 : last - 1]
            angle_before[:] = angle[:, first - 1 : last - 1]
        kept = behind[:, here]
        now = angle[:, here]
        moment_load = load[:, row, np.arange(first, last)]
        h = 0.5 * length[:, here]
        for _ in range(_ITERATIONS):
            capstan = np.exp(half_mu * np.abs(angle_before + now))
            out = _slip(before, kept, right, left, capstan)
            difference = right * out[..., 0] - left * out[..., 1]
            total = out[..., 0] + out[..., 1]
            cosine, sine = np.cos(0.5 * now), np.sin(0.5 * now)
            k = now / length[:, here] - rest[:, here]
            k2 = k * k
            elastic = stiffness[:, here] * k * (1.0 + k2 * (cubic[:, here] + k2 * quintic[:, here]))
            slope = stiffness[:, here] / length[:, here]
            slope = slope * (1.0 + k2 * (3.0 * cubic[:, here] + 5.0 * k2 * quintic[:, here]))
            excess = difference * cosine + total * h * sine + moment_load - elastic
            slope = slope - 0.5 * (total * h * cosine - difference * sine)
            step = excess / slope
            now = now + step
            if not (np.abs(step) > _TOLERANCE_RAD).any():
                break
        now = np.where(np.abs(now) < _LARGEST_ANGLE_RAD, now, np.nan)
        angle[:, here] = now
        behind[:, here] = out
        found[:, row, np.arange(first, last)] = now
    return found


def _slip(before: Array, kept: Array, right: Array, left: Array, capstan: Array) -> Array:
    """Return the tensions behind eyelets; the rule of `slip.tensions_behind` for two tendons.

    Args:
        before, kept: tensions before the eyelet, and behind it a moment ago, shape (..., 2) [N].
        right, left: arms of the two, both positive [m].
        capstan: exp(mu phi), shape (...).
    """
    low, high = before / capstan[..., None], before * capstan[..., None]
    moment = right * kept[..., 0] - left * kept[..., 1]
    forward = right * low[..., 0] - left * high[..., 1]
    backward = right * high[..., 0] - left * low[..., 1]
    # Sticking: on the line of this moment, as near to the kept tensions as both intervals allow.
    lowest = np.maximum(low[..., 0], (moment + left * low[..., 1]) / right)
    highest = np.minimum(high[..., 0], (moment + left * high[..., 1]) / right)
    first = np.minimum(np.maximum(kept[..., 0], lowest), np.maximum(highest, lowest))
    second = (right * first - moment) / left
    bending, returning = moment <= forward, moment >= backward
    first = np.where(bending, low[..., 0], np.where(returning, high[..., 0], first))
    second = np.where(bending, high[..., 1], np.where(returning, low[..., 1], second))
    return np.stack([first, second], axis=-1)


def _with_loads(
    chains: Sequence[PlanarChain], command: Array, wrench: Array, weight: Array, angles: Array
) -> Array:
    """Return the angles where weight and tip load act too: moments from the shape, and again."""
    length = chains[0].cell_length
    change = np.zeros(angles.shape)
    for _ in range(_LOAD_ROUNDS):
        p_w, _unused = hinge_chain(angles, length)
        hinges = hinge_points(angles, length)
        force = np.broadcast_to(weight[:, None], (*angles.shape, 2)).copy()
        force[:, :, -1] += wrench[:, :, :2]

        def beyond(values: Array) -> Array:
            return np.cumsum(values[..., ::-1], axis=-1)[..., ::-1]

        x, z = p_w[..., 0], p_w[..., 2]
        moment = beyond(z * force[..., 0] - x * force[..., 1])
        moment -= hinges[..., 2] * beyond(force[..., 0]) - hinges[..., 0] * beyond(force[..., 1])
        new = _march(chains, command, moment + wrench[:, :, 2:])
        change[:] = np.abs(new - angles)
        angles = new
        if not (change > _LOAD_TOLERANCE_RAD).any():
            return angles
    astray: Array = change.max(axis=(1, 2), keepdims=True)
    return np.where(astray <= _ASTRAY_RAD, angles, np.nan)
