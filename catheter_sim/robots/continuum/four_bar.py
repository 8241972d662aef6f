"""The static model four_bar: backbone and tendons of a subsegment as the bars of linkages, driven by lengths.

Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Sections 3.2.2 and 4.1, after Ashwin and Ghosal 2021). The
subsegment's backbone, a bar as long as it, a tendon's span and the two disks' radii make a four-bar linkage;
it stands where its coupler, the upper disk, has turned least. With a coupler that turns by t a span's end
moves by 2 r sin(t/2) along the direction at t/2. So a span d shorter than the backbone needs
2 r sin(t/2) >= d. Both are equal where the bar stands at t/2. In space, with b = sin(t/2) times the bending
plane's direction and a hole at r, two such linkages at right angles give

d = 2 r . b,    pose: bar (b_x, b_y, sqrt(1 - b^2)), turned by t about (-b_y, b_x).

All lengths of a segment's tendons together, no tendon longer than it is and the sum of the couplers' squares
of b the least: a linear problem of taut and slack tendons. Where antagonists together ask for more than the
linkage has, they share what is missing. No load, no stiffness and no stretch of tendons is in the model. By
tensions it takes the tendons' lengths from VC_ref, as the benchmark's CC takes VC's (Eq. 56): loads and
friction act through these alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.statics import StaticRun
from catheter_sim.robots.continuum.rods import (
    RodLoad,
    RodProblem,
    equilibria,
    load,
    path_lengths,
    problem,
    require_reached,
    run_of,
    taut,
)
from catheter_sim.robots.continuum.spec import ContinuumRobot

_GIVE = 1e-6  # of the tendons, over what the linkage gives: it shares what antagonists miss


@dataclass(frozen=True)
class FourBars:
    """Linkages of a robot at r rows of tendon lengths.

    Attributes:
        load: what acts; NaN tensions where lengths were given.
        p_w, R_w: of disks 0 to n, shapes (r, n + 1, 3) [m] and (r, n + 1, 3, 3).
        span_tension: shape (r, t, n) [N].
        missed: largest length by which a tendon is too short for the posture, shape (r,) [m].
        reached: 1 where the linkages close, 0 elsewhere, shape (r,).
    """

    load: RodLoad
    p_w: Array
    R_w: Array
    span_tension: Array
    missed: Array
    reached: Array


def four_bar(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` under `inputs`; see the module's text.

    Args:
        robot: any robot that `rods.unsupported_along` accepts; its `effects` are not read.
        inputs: displacements: what each tendon is shortened by, less its slack; or tensions and loads.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: tendons so short that no linkage closes, or tensions without an equilibrium of VC_ref.
    """
    rod = problem(robot)
    gravity = np.asarray(gravity_mps2, dtype=float)
    loads = load(rod, inputs, gravity)
    if inputs.actuation == "displacement":
        loads = RodLoad(np.full_like(loads.tension_N, np.nan), loads.force_N, loads.moment_N_m)
        short = inputs.tendon - [tendon.slack_m for tendon in robot.tendons]
        spans = np.full((*short.shape, len(rod.length_m)), np.nan)
    else:
        found = equilibria(rod, loads, "projected")
        require_reached("four_bar", robot, inputs, found.reached)
        short = rod.disk_z_m[rod.last_disk] - path_lengths(found)
        spans = found.span_tension
    bars = linkages(rod, loads, short, spans)
    return run_of("four_bar", robot, rod, inputs, gravity, bars, bars.missed)


def linkages(rod: RodProblem, loads: RodLoad, short: Array, spans: Array) -> FourBars:
    """Return the linkages of tendons that are `short`, shape (r, t) [m], by so much than straight ones."""
    n, count = len(rod.length_m), int(rod.segment[-1]) + 1
    cells = np.bincount(rod.segment, minlength=count)
    ends = rod.segment[rod.last_disk - 1]
    arm = 2.0 * rod.hole_m[:, :1] * (np.arange(count) <= ends[:, None])[:, :, None]  # (t, S, 2)
    arm[:, [rod.planar[rod.segment == s][0] for s in range(count)], 1] = 0.0
    matrix = np.einsum("tsi,s,usi->tu", arm, cells, arm)
    matrix += _GIVE * max(matrix.max(initial=0.0), 1e-12) * np.eye(len(arm))
    pull = np.array([taut(matrix, -row) for row in short]).reshape(short.shape)
    b = np.einsum("rt,tsi->rsi", pull, arm)
    missed = np.maximum(short - np.einsum("tsi,s,rsi->rt", arm, cells, b), 0.0).max(axis=1, initial=0.0)
    size = np.hypot(b[..., 0], b[..., 1])
    half = np.minimum(size, 1.0)
    bar = np.concatenate([b, np.sqrt(1.0 - half**2)[..., None]], axis=2)[:, rod.segment]
    axis = np.stack([-b[..., 1], b[..., 0], 0.0 * half], axis=2) / np.maximum(size, 1e-300)[..., None]
    turn = Rotation.from_rotvec((2.0 * np.arcsin(half)[..., None] * axis).reshape(-1, 3)).as_matrix()
    turn = turn.reshape(*b.shape[:2], 3, 3)[:, rod.segment]
    p_w, R_w = np.zeros((len(short), n + 1, 3)), np.tile(np.eye(3), (len(short), n + 1, 1, 1))
    for j in range(n):
        p_w[:, j + 1] = p_w[:, j] + rod.length_m[j] * np.einsum("rij,rj->ri", R_w[:, j], bar[:, j])
        R_w[:, j + 1] = R_w[:, j] @ turn[:, j]
    closes = (size <= 1.0).all(axis=1)
    return FourBars(loads, p_w, R_w, spans, missed, closes.astype(float))
