"""Rods in the joints' gaps, compiled: their turns, tensions, pulls and elastic moments."""

from __future__ import annotations

import math

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
from catheter_sim.mechanics.arrays import Array
from catheter_sim.mechanics.compiled import compiled


@compiled
def _turn(
    theta: float,
    sine: float,
    cosine: float,
    radius: float,
    offset: float,
    mouth: float,
    clearance: float,
    hole_end: float,
    below: float,
) -> tuple[float, float]:
    """Return phi and its derivative at theta, of that sine and cosine: `joint.turn` for one rod."""
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
    jacobian[:, :] = 0.0
    for k in range(n):
        t = theta[k]
        sines[k], cosines[k] = math.sin(t), math.cos(t)
        elastic[k] = joint[k, SLEEVE] * (t - joint[k, REST])
        jacobian[k, k] = -joint[k, SLEEVE]
    for r in range(m):
        tension = drive[r] if r < pulled else 0.0
        grows[:] = 0.0  # derivative of the tension by the angles from `first` to the joint below
        first = 0
        for k in range(n):
            offset = rod[r, k, OFFSET]
            if math.isnan(offset):
                if r < pulled:
                    at_joint[r, k:] = 0.0
                    above[r, k:] = 0.0
                    wrench[r, k:, :] = 0.0
                break
            t = theta[k]
            radius = joint[k, RADIUS_POSITIVE] if t >= 0.0 else joint[k, RADIUS_NEGATIVE]
            mouth, sink = rod[r, k, MOUTH], rod[r, k, SINK]
            sine, cosine = sines[k], cosines[k]
            across = radius * (t - sine) + offset * cosine + mouth * sine - offset
            along = radius * (1.0 - cosine) - offset * sine + mouth * cosine + sink
            across_slope = along - sink
            along_slope = radius * t - offset - across
            curvature = sine / along
            bent = curvature - rod[r, k, REST_CURVATURE]
            mean = (t - joint[k, REST]) / joint[k, LENGTH]
            square = mean * mean
            law = 1.0 + square * (joint[k, CUBIC] + square * joint[k, QUINTIC])
            steeper = mean * (2.0 * joint[k, CUBIC] + 4.0 * square * joint[k, QUINTIC]) / joint[k, LENGTH]
            elastic[k] += stiffness[r] * bent * law
            jacobian[k, k] -= stiffness[r] * (
                law * (cosine - curvature * along_slope) / along + bent * steeper
            )
            if r >= pulled:
                continue
            at_joint[r, k] = tension
            if tension == 0.0 and kept[r, k] == 0.0:  # a slack rod neither pulls nor rubs
                wrench[r, k, 0], wrench[r, k, 1], wrench[r, k, 2] = across, along, 0.0
                above[r, k] = 0.0
                first = k + 1
                continue
            length = math.hypot(across, along)
            slope = (across * across_slope + along * along_slope) / length
            second = (
                across_slope * across_slope
                + along_slope * along_slope
                + across * along_slope
                + along * (radius - across_slope)
                - slope * slope
            ) / length
            wrench[r, k, 0], wrench[r, k, 1], wrench[r, k, 2] = across, along, tension / length
            jacobian[k, k] -= tension * second
            for j in range(first, k):
                jacobian[k, j] -= grows[j] * slope
            below = joint[k - 1, LENGTH] if k > 0 else joint[0, LENGTH]
            phi, phi_slope = _turn(
                *(t, sine, cosine, radius, offset, mouth),
                *(rod[r, k, CLEARANCE], joint[k, LENGTH] - sink, below),
            )
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
