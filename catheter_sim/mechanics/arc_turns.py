"""Arcs one by one in compiled loops; `arcs` has the same for many postures at once."""

from __future__ import annotations

import math

from catheter_sim.mechanics.compiled import compiled

_SMALL_RAD2 = 1e-2  # squared bend below which the series are exact to the last bits


@compiled
def arc_series(angle2):
    """Return sin(t)/t, (1 - cos t)/t^2, their slopes by t^2, and (t - sin t)/t^3 for `angle2` = t^2."""
    u = angle2
    if u < _SMALL_RAD2:
        sine = 1.0 - u / 6.0 * (1.0 - u / 20.0 * (1.0 - u / 42.0 * (1.0 - u / 72.0)))
        versine = 0.5 - u / 24.0 * (1.0 - u / 30.0 * (1.0 - u / 56.0 * (1.0 - u / 90.0)))
        sine_slope = -1.0 / 6.0 + u / 60.0 - u * u / 1680.0 + u * u * u / 90720.0
        versine_slope = -1.0 / 24.0 + u / 360.0 - u * u / 13440.0 + u * u * u / 907200.0
        third = (1.0 - u / 20.0 * (1.0 - u / 42.0 * (1.0 - u / 72.0))) / 6.0
        return sine, versine, sine_slope, versine_slope, third
    angle = math.sqrt(u)
    half = math.sin(0.5 * angle)
    sine = math.sin(angle) / angle
    versine = 2.0 * half * half / u
    return (
        sine,
        versine,
        (1.0 - u * versine - sine) / (2.0 * u),
        (sine - 2.0 * versine) / (2.0 * u),
        (1.0 - sine) / u,
    )


@compiled
def turn_by_arc(x, y, sine, versine, rotation, out):
    """Set `out` to `rotation` times the turn of an arc bent by (x, y), both (3, 3)."""
    for i in range(3):
        a, b, c = rotation[i, 0], rotation[i, 1], rotation[i, 2]
        toward = a * x + b * y
        out[i, 0] = a - (versine * toward + sine * c) * x
        out[i, 1] = b - (versine * toward + sine * c) * y
        out[i, 2] = c + sine * toward - versine * (x * x + y * y) * c
