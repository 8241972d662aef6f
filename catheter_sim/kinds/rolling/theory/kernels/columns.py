"""Columns of the arrays in which the compiled loops take a chain."""

from __future__ import annotations

# Columns of `joint`: as in `RollingChain`; COMPLIANCE is of the link along its axis [m/N].
AXIS, RADIUS_POSITIVE, RADIUS_NEGATIVE, LINE, LENGTH, COMPLIANCE = range(6)
REST, SLEEVE, CUBIC, QUINTIC, LOW, HIGH = range(6, 12)
# Columns of `rod`: CLEARANCE carries the sign of the rod's side, OFFSET is NaN where it does not pass.
OFFSET, MOUTH, SINK, CLEARANCE, REST_CURVATURE, X, Y = range(7)
