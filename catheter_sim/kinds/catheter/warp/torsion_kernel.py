"""The torsion pairs of `kinds.catheter.forces.torsion` as a Warp kernel, one thread for each copy and pair.

In double precision; what MuJoCo Warp hands over and takes is single.
"""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import warp as wp

from catheter_sim.mechanics.device_types import vec10

_ZERO = wp.constant(wp.float64(0.0))


@wp.kernel(enable_backward=False)
def turn_pairs(
    actuators: wp.array(dtype=int),
    qpos_index: wp.array(dtype=int),
    radius: wp.array(dtype=wp.float64),
    height: wp.array(dtype=wp.float64),
    wrap: wp.array(dtype=wp.float64),
    home: wp.array(dtype=wp.float64),
    stiffness: wp.array(dtype=wp.float64),
    gain: wp.array(dtype=wp.float64),
    qpos: wp.array2d(dtype=float),
    ctrl: wp.array2d(dtype=float),
    biasprm: wp.array2d(dtype=vec10),
):
    """Let the torsion joints' actuators be the tangents that `TorsionPairs.tangent` finds."""
    world, k = wp.tid()
    angle = wp.float64(qpos[world, qpos_index[k]])
    control = wp.float64(ctrl[world, actuators[k]])
    around = radius[k] * wp.max(wrap[k] - wp.abs(angle), _ZERO)
    wrapped = wp.sqrt(around * around + height[k] * height[k])
    drawn = wp.abs(home[k] - wrapped)
    if angle < _ZERO:
        drawn = -drawn
    arm = radius[k]
    if height[k] > _ZERO:
        arm = radius[k] * around / wrapped
    moment = stiffness[k] * (control - drawn) * arm
    slope = stiffness[k] * arm * arm
    affine = biasprm[world, actuators[k]]
    affine[0] = float(moment + slope * angle - gain[k] * control)
    affine[1] = float(-slope)
    biasprm[world, actuators[k]] = affine
