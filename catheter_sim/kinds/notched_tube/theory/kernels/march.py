"""The way through rows of inputs, from rest under the weight."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.notched_tube.theory.kernels.columns import COMPLIANCE, DISPLACEMENT, PRETENSION, REST
from catheter_sim.kinds.notched_tube.theory.kernels.equilibrium import equilibrium, let_go
from catheter_sim.kinds.notched_tube.theory.kernels.frames import workspace
from catheter_sim.mechanics.compiled import compiled

_SHORTEST_STEP = 1e-2  # share of the way between two rows


@compiled
def _follow(
    notch: Array, fibre: Array, metal: Array, axes: int, mu: float, drive: Array, drives: Array,
    weight: Array, element: np.ndarray, forces: Array, moments: Array, steps: np.ndarray,
    w_rows: Array, stretch_rows: Array, tension_rows: Array, left: Array,
) -> int:  # fmt: skip
    """Lead one robot from rest through rows of inputs; return how many were reached. See `march`."""
    n, rows = notch.shape[0], drives.shape[0] - 1
    size = n * axes + (0 if math.isnan(drive[DISPLACEMENT]) else 1)
    work = workspace(n)
    space = (
        np.empty(size), np.empty((size, size)), np.empty((n, 3)), np.empty(n), np.empty((n, 3)), np.empty(n),
    )  # fmt: skip
    w, stretch = notch[:, REST : REST + 3].copy(), np.zeros(n)
    w_try, stretch_try = np.empty((n, 3)), np.empty(n)
    kept, behind = np.zeros(2 * n), np.empty(2 * n)
    force, moment = np.zeros((n, 3)), np.zeros((n, 3))
    hanging, now = np.empty((n, 3)), drive.copy()
    by_length, tension, actuator = not math.isnan(drive[DISPLACEMENT]), 0.0, 0.0
    for row in range(rows + 1):  # the first way is to rest under the weight
        start, done, stride = max(row - 1, 0), 0.0, 1.0 / steps[row]
        while done < 1.0:
            part = done + stride
            if part > 1.0 - 1e-9:
                part = 1.0
            aim = drives[start] + part * (drives[row] - drives[start])
            for k in range(3):
                for i in range(n):
                    hanging[i, k] = weight[i, k] * (part if row == 0 else 1.0)
                    force[i, k] = moment[i, k] = 0.0
                for q in range(element.shape[0]):
                    i = element[q]
                    force[i, k] += forces[start, q, k] + part * (forces[row, q, k] - forces[start, q, k])
                    moment[i, k] += moments[start, q, k] + part * (moments[row, q, k] - moments[start, q, k])
            trying = tension if by_length else aim
            if by_length:
                now[DISPLACEMENT] = aim
                now[PRETENSION] = drive[PRETENSION] * (part if row == 0 else 1.0)
            w_try[:, :] = w
            stretch_try[:] = stretch
            found, trying, worst = equilibrium(
                notch, fibre, metal, axes, mu, trying, now, kept, hanging, force, moment,
                w_try, stretch_try, behind, 0.0, w, space, work,
            )  # fmt: skip
            if not found and stride > _SHORTEST_STEP:
                stride *= 0.5
                continue
            if not found:  # no equilibrium near by: let the tube go, slowly
                found, trying, worst = let_go(
                    notch, fibre, metal, axes, mu, tension if by_length else aim, now, kept, hanging, force,
                    moment, w, stretch, w_try, stretch_try, behind, space, work,
                )  # fmt: skip
                stride = 1.0 / steps[row]
            if not found:
                return max(row - 1, 0)
            actuator = trying
            if by_length and drive[COMPLIANCE] == 0.0:
                turn = math.exp(mu * work[7][0, 2])
                actuator = trying * turn if trying >= kept[0] else trying / turn
            w[:, :] = w_try
            stretch[:] = stretch_try
            kept[:] = behind
            tension, done = trying, part
            left[max(row - 1, 0)] = worst
        if row > 0:
            w_rows[row - 1] = w
            stretch_rows[row - 1] = stretch
            tension_rows[row - 1, 0] = actuator
            for i in range(n):
                tension_rows[row - 1, 1 + i] = behind[2 * i]
    return int(rows)


@compiled
def march(
    notch: Array, fibre: Array, metal: Array, axes: int, mu: Array, drive: Array, drives: Array,
    weight: Array, element: np.ndarray, forces: Array, moments: Array, steps: np.ndarray,
    w: Array, stretch: Array, tension: Array, left: Array,
) -> None:  # fmt: skip
    """Lead many robots from rest, first under their weight, then through rows of inputs.

    NaN from the row on at which a robot finds no equilibrium.

    Args:
        notch: shape (B, n, 14). fibre: (B, n, f, 3). metal: (B, 4).
        axes: 1: notches bend toward +-x only (`fibre` may then hold half of each, at twice the area);
            3: any way.
        mu: (B,). drive: (B, 4), its first entry NaN where the tension is given.
        drives: tension [N] or displacement [m], zero first, (B, r + 1).
        weight: of the elements, in the base frame, (B, n, 3) [N].
        element: which are loaded on their distal faces, (p,).
        forces, moments: on these, zero first, (B, r + 1, p, 3) [N, N m].
        steps: at least so many to each row, (r + 1,).
        w, stretch: filled, (B, r, n, 3) [rad] and (B, r, n).
        tension: filled, (B, r, n + 1): at the actuator, then in each notch [N].
        left: filled, what no balance accounts for, (B, r) [N m].
    """
    for b in range(notch.shape[0]):
        reached = _follow(
            notch[b], fibre[b], metal[b], axes, mu[b], drive[b], drives[b], weight[b], element,
            forces[b], moments[b], steps, w[b], stretch[b], tension[b], left[b],
        )  # fmt: skip
        w[b, reached:] = np.nan
        stretch[b, reached:] = np.nan
        tension[b, reached:] = np.nan
        left[b, reached:] = np.nan
