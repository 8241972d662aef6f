"""Types of MuJoCo Warp's fields that Warp has no name for."""

import warp as wp

vec10 = wp.types.vector(length=10, dtype=float)  # parameters of an actuator's gain or bias
