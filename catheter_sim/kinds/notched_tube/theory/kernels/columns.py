"""Columns of the tables that the compiled kernels take."""

from __future__ import annotations

# Columns of `notch` [m, N m/rad, rad, m^2, m^4, m].
HEIGHT, UNCUT, CENTROID, TENDON, TORSION, STOP, CLOSING, CUBIC, QUINTIC = range(9)
PITCH, REST, SPAN = 9, 10, 13  # REST: rotation vector without load, three columns; SPAN: tendon's then
COLUMNS = 14
# Entries of `drive`: NaN where the tension is given; SCALE [N/m] weighs lengths against forces.
DISPLACEMENT, COMPLIANCE, PRETENSION, SCALE = range(4)
