"""Rods in the joints' gaps, compiled: turns, pulls, elastic moments, and tensions that friction keeps."""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory.kernels.columns import (
    CLEARANCE,
    CUBIC,
    LENGTH,
    MOUTH,
    OFFSET,
    QUINTIC,
    RADIUS_NEGATIVE,
    RADIUS_POSITIVE,
    REST,
    REST_CURVATURE,
    SINK,
    SLEEVE,
)
from catheter_sim.mechanics.compiled import compiled


@compiled
def turn_of(
    joint: Array, rod: Array, r: int, k: int, theta: float, sine: float, cosine: float
) -> tuple[float, float]:
    """Return the turn phi of rod r at joint k, and its derivative at theta: `joint.turn`."""
    radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
    offset, mouth, clearance = rod[r, k, OFFSET], rod[r, k, MOUTH], rod[r, k, CLEARANCE]
    hole_end = joint[k, LENGTH] - rod[r, k, SINK]
    below = joint[k - 1, LENGTH] if k > 0 else joint[0, LENGTH]
    reach = offset + clearance - radius * theta
    x3 = radius * sine + reach * cosine + below * sine
    z3 = radius * (1.0 - cosine) + reach * sine - below * cosine
    x1, z1 = offset + clearance - x3, hole_end - z3
    x2, z2 = offset - clearance - x3, mouth - z3
    dx3, dz3 = -reach * sine + below * cosine, reach * cosine + below * sine
    phi = 2.0 * math.atan2(x1 * z2 - z1 * x2, x1 * x2 + z1 * z2)
    slope = (z2 * dx3 - x2 * dz3) / (x2 * x2 + z2 * z2) - (z1 * dx3 - x1 * dz3) / (x1 * x1 + z1 * z1)
    return phi, 2.0 * slope


@compiled
def cross_gap(
    joint: Array, rod: Array, r: int, k: int, theta: float, sine: float, cosine: float
) -> tuple[float, float, float, float]:
    """Return where rod r goes from mouth to mouth of gap k, and how that changes with theta.

    Across and along the flat below the gap, [m]; their derivatives, [m/rad].
    """
    radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
    offset, mouth, sink = rod[r, k, OFFSET], rod[r, k, MOUTH], rod[r, k, SINK]
    across = radius * (theta - sine) + offset * cosine + mouth * sine - offset
    along = radius * (1.0 - cosine) - offset * sine + mouth * cosine + sink
    return across, along, along - sink, radius * theta - offset - across


@compiled
def bend_rod(
    joint: Array,
    rod: Array,
    stiffness: Array,
    r: int,
    k: int,
    theta: float,
    sine: float,
    cosine: float,
    along: float,
    along_slope: float,
    elastic: Array,
    jacobian: Array,
) -> None:
    """Add the elastic moment of rod r in gap k, and its derivative."""
    curvature = sine / along
    bent = curvature - rod[r, k, REST_CURVATURE]
    mean = (theta - joint[k, REST]) / joint[k, LENGTH]
    square = mean * mean
    law = 1.0 + square * (joint[k, CUBIC] + square * joint[k, QUINTIC])
    steeper = mean * (2.0 * joint[k, CUBIC] + 4.0 * square * joint[k, QUINTIC]) / joint[k, LENGTH]
    elastic[k] += stiffness[r] * bent * law
    jacobian[k, k] -= stiffness[r] * (law * (cosine - curvature * along_slope) / along + bent * steeper)


@compiled
def stretch_of(
    radius: float, across: float, along: float, across_slope: float, along_slope: float
) -> tuple[float, float, float]:
    """Return the length of a rod in a gap, and its first and second derivative by the angle."""
    length = math.hypot(across, along)
    slope = (across * across_slope + along * along_slope) / length
    second = (
        across_slope * across_slope
        + along_slope * along_slope
        + across * along_slope
        + along * (radius - across_slope)
        - slope * slope
    ) / length
    return length, slope, second


@compiled
def bend_sleeve(
    joint: Array, theta: Array, elastic: Array, sines: Array, cosines: Array, jacobian: Array
) -> None:
    """Begin `elastic` and `jacobian` with the outer tube; fill sines and cosines."""
    jacobian[:, :] = 0.0
    for k in range(len(theta)):
        sines[k], cosines[k] = math.sin(theta[k]), math.cos(theta[k])
        elastic[k] = joint[k, SLEEVE] * (theta[k] - joint[k, REST])
        jacobian[k, k] = -joint[k, SLEEVE]


@compiled
def pull_and_bend_rods(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive: Array,
    kept: Array,
    theta: Array,
    at_joint: Array,
    above: Array,
    wrench: Array,
    elastic: Array,
    sines: Array,
    cosines: Array,
    grows: Array,
    jacobian: Array,
) -> None:
    """Fill tensions, the pull of all rods along their spans, elastic moments and their part of the Jacobian.

    `wrench`, shape (t, n, 3): across, along and tension over length of each pulled rod's span.
    """
    n, m = joint.shape[0], rod.shape[0]
    bend_sleeve(joint, theta, elastic, sines, cosines, jacobian)
    for r in range(m):
        tension = drive[r] if r < pulled else 0.0
        grows[:] = 0.0  # derivative of the tension by the angles from `first` to the joint below
        first = 0
        for k in range(n):
            if math.isnan(rod[r, k, OFFSET]):
                if r < pulled:
                    at_joint[r, k:] = 0.0
                    above[r, k:] = 0.0
                    wrench[r, k:, :] = 0.0
                break
            t, sine, cosine = theta[k], sines[k], cosines[k]
            across, along, across_slope, along_slope = cross_gap(joint, rod, r, k, t, sine, cosine)
            bend_rod(joint, rod, stiffness, r, k, t, sine, cosine, along, along_slope, elastic, jacobian)
            if r >= pulled:
                continue
            at_joint[r, k] = tension
            if tension == 0.0 and kept[r, k] == 0.0:  # a slack rod neither pulls nor rubs
                wrench[r, k, 0], wrench[r, k, 1], wrench[r, k, 2] = across, along, 0.0
                above[r, k] = 0.0
                first = k + 1
                continue
            radius = joint[k, RADIUS_POSITIVE] if t >= 0.0 else joint[k, RADIUS_NEGATIVE]
            length, slope, second = stretch_of(radius, across, along, across_slope, along_slope)
            wrench[r, k, 0], wrench[r, k, 1], wrench[r, k, 2] = across, along, tension / length
            jacobian[k, k] -= tension * second
            for j in range(first, k):
                jacobian[k, j] -= grows[j] * slope
            phi, phi_slope = turn_of(joint, rod, r, k, t, sine, cosine)
            factor = math.exp(mu * abs(phi))
            rate = mu * phi_slope if phi >= 0.0 else -mu * phi_slope
            held = kept[r, k]
            if held < tension / factor:
                for j in range(first, k):
                    grows[j] /= factor
                grows[k] = -rate * tension / factor
                tension = tension / factor
            elif held > tension * factor:
                for j in range(first, k):
                    grows[j] *= factor
                grows[k] = rate * tension * factor
                tension = tension * factor
            else:
                first = k + 1
                tension = held
            above[r, k] = tension
