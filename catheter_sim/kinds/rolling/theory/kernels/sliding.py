"""Dry friction of rods by how they slide in the links' holes, compiled.

A rod is fixed where it ends, so what it slides in the hole of link k is the change of its length in the gaps
beyond. Drawn in, it comes out of the hole with T exp(-mu phi); run out, with T exp(+mu phi); while it sticks,
with anything between, T exp(-mu s phi) with -1 < s < 1. So a rod that another section draws in rubs the right
way even while its own tension rises, which no rule on tensions alone can know.

The share s is an unknown beside the angles: with the length drawn in since the step before, d,

    s = s_before + d / pre_sliding_m  where |s + (d - pre_sliding_m (s - s_before)) / CHOICE_M| < 1: sticking,
    s = -1 or 1                       elsewhere: slipping.

Newton's method renews s and this choice with every step, as active-set methods for contact do, so that stiff
sticking costs no short steps. The less pre-sliding, the truer and the slower; that there is some shares the
tension of rods that stick together out alike.
"""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory.kernels.columns import OFFSET, RADIUS_NEGATIVE, RADIUS_POSITIVE
from catheter_sim.kinds.rolling.theory.kernels.rods import (
    bend_rod,
    bend_sleeve,
    cross_gap,
    stretch_of,
    turn_of,
)
from catheter_sim.mechanics.compiled import compiled

CHOICE_M = (
    1e-1  # weighs how far a rod slides against what it lacks to slip: a choice of the way, not of the end
)
ALONE_SHARE = 0.8  # of all changes of tension: of a rod that moves all but alone
# Layers of what a chain remembers, each of shape (t, n): tension above each joint [N]; how the rod slid in
# the hole there, 1: drawn in, -1: run out; its length in the gap below [m]. Without the last two, friction
# keeps tensions instead (`rods.pull_and_bend_rods`).
ABOVE, SLIP, SPAN = range(3)
SLOPE, LACK, STICKS = range(3)  # layers of `rods` in `slide_and_bend_rods`


@compiled
def slide_and_bend_rods(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive: Array,
    memory: Array,
    theta: Array,
    at_joint: Array,
    renewed: Array,
    wrench: Array,
    elastic: Array,
    sines: Array,
    cosines: Array,
    pre_sliding_m: float,
    rods: Array,
    along: Array,
    jacobian: Array,
) -> None:
    """As `rods.pull_and_bend_rods`, with friction by sliding at the shares in `renewed[SLIP]`.

    `jacobian` takes with it that the shares change as the module's text says. `renewed` gets tensions and
    spans. Further filled are

        rods: for each pulled rod and joint, shape (3, t, n): `SLOPE`, how its span's length changes with the
            angle [m/rad]; `LACK`, by how much the share has to change, were the angles to stay; `STICKS`, 1
            where it does, 0 where it slips.
        along: worked in, but its last row, shape (3, n): what `LACK` adds to the moments [N m].
    """
    n, m = joint.shape[0], rod.shape[0]
    gives, rates, lacks = along[0], along[1], along[2]
    bend_sleeve(joint, theta, elastic, sines, cosines, jacobian)
    lacks[:] = 0.0
    for r in range(m):
        ends = n
        for k in range(n):
            if math.isnan(rod[r, k, OFFSET]):
                ends = k
                break
            t, sine, cosine = theta[k], sines[k], cosines[k]
            across, away, across_slope, away_slope = cross_gap(joint, rod, r, k, t, sine, cosine)
            bend_rod(joint, rod, stiffness, r, k, t, sine, cosine, away, away_slope, elastic, jacobian)
            if r < pulled:
                radius = joint[k, RADIUS_POSITIVE] if t >= 0.0 else joint[k, RADIUS_NEGATIVE]
                length, slope, second = stretch_of(radius, across, away, across_slope, away_slope)
                wrench[r, k, 0], wrench[r, k, 1], wrench[r, k, 2] = across, away, second
                renewed[SPAN, r, k], rods[SLOPE, r, k] = length, slope
        if r >= pulled:
            continue
        slopes = rods[SLOPE, r]
        drawn = 0.0
        for k in range(ends - 1, -1, -1):
            share, before = renewed[SLIP, r, k], memory[SLIP, r, k]
            rods[LACK, r, k], rods[STICKS, r, k] = 0.0, 0.0
            if k < ends - 1:
                left = drawn - pre_sliding_m * (share - before)
                choice = share + left / CHOICE_M
                if abs(choice) < 1.0:
                    rods[LACK, r, k], rods[STICKS, r, k] = left / pre_sliding_m, 1.0
                else:
                    rods[LACK, r, k] = (1.0 if choice > 0.0 else -1.0) - share
            drawn += memory[SPAN, r, k] - renewed[SPAN, r, k]
        tension, give, lack = drive[r], 0.0, 0.0
        for k in range(ends):
            at_joint[r, k] = tension
            jacobian[k, k] -= tension * wrench[r, k, 2]
            wrench[r, k, 2] = tension / renewed[SPAN, r, k]
            gives[k], rates[k] = give, 0.0
            if tension > 0.0:
                pull = tension * slopes[k]
                lacks[k] += pull * lack
                for j in range(k):
                    jacobian[k, j] += pull * (rates[j] - slopes[j] * gives[j])
                for j in range(k, ends):
                    jacobian[k, j] -= pull * slopes[j] * give
                if mu > 0.0 and k < ends - 1:
                    share = renewed[SLIP, r, k]
                    phi, phi_slope = turn_of(joint, rod, r, k, theta[k], sines[k], cosines[k])
                    rates[k] = mu * share * (phi_slope if phi >= 0.0 else -phi_slope)
                    lack += mu * abs(phi) * rods[LACK, r, k]
                    give += mu * abs(phi) / pre_sliding_m * rods[STICKS, r, k]
                    tension *= math.exp(-mu * share * abs(phi))
            renewed[ABOVE, r, k] = tension
        for k in range(ends, n):
            at_joint[r, k] = 0.0
            renewed[:, r, k] = 0.0
            wrench[r, k, :] = 0.0


@compiled
def renew_shares(
    rod: Array, pre_sliding_m: float, part: float, step: Array, rods: Array, renewed: Array
) -> None:
    """Change the shares in `renewed[SLIP]` by `part` of what goes with `step` of the angles."""
    pulled, n = renewed.shape[1:]
    for r in range(pulled):
        drawn = 0.0
        for k in range(n - 1, -1, -1):
            if math.isnan(rod[r, k, OFFSET]):
                continue
            change = rods[LACK, r, k] + rods[STICKS, r, k] * drawn / pre_sliding_m
            renewed[SLIP, r, k] = min(max(renewed[SLIP, r, k] + part * change, -1.0), 1.0)
            drawn -= rods[SLOPE, r, k] * step[k]


@compiled
def guess_shares(
    joint: Array,
    rod: Array,
    pulled: int,
    mu: float,
    before: Array,
    drive: Array,
    memory: Array,
    theta: Array,
    renewed: Array,
) -> None:
    """Fill `renewed[SLIP]` with the shares from which to search on for those under `drive`.

    A rod whose own tension changes all but alone, from `before`, starts with the shares that keep the
    tensions along it, where the bounds let them. All others slide on as they did.
    """
    n, changes = len(theta), 0.0
    renewed[SLIP] = memory[SLIP]
    for r in range(pulled):
        changes += abs(drive[r] - before[r])
    for r in range(pulled):
        if abs(drive[r] - before[r]) <= ALONE_SHARE * changes:
            continue
        tension = drive[r]
        for k in range(n):
            if math.isnan(rod[r, k, OFFSET]) or tension == 0.0 or mu == 0.0:
                break
            phi, _ = turn_of(joint, rod, r, k, theta[k], math.sin(theta[k]), math.cos(theta[k]))
            turned, held = mu * abs(phi), memory[ABOVE, r, k]
            lost = math.log(tension / held) if held > 0.0 else math.inf
            if turned > 0.0:
                renewed[SLIP, r, k] = min(max(lost / turned, -1.0), 1.0)
            elif lost != 0.0:
                renewed[SLIP, r, k] = 1.0 if lost > 0.0 else -1.0
            tension *= math.exp(-turned * renewed[SLIP, r, k])
