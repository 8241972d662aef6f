"""Tensions and clamps of actuators that pull tendons, as Warp kernels, one thread for each copy and actuator.

As in `catheter_sim.simulation.actuation`, in double precision; what MuJoCo Warp hands over and takes is
single.
"""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import warp as wp

from catheter_sim.mechanics.device_types import vec10

_ZERO = wp.constant(wp.float64(0.0))


@wp.kernel(enable_backward=False)
def given(pulls: wp.array(dtype=int), ctrl: wp.array2d(dtype=float), entering: wp.array2d(dtype=wp.float64)):
    """Write the tensions of tendons whose tension is the control into `entering`, shape (m, k) [N]."""
    world, place = wp.tid()
    entering[world, place] = wp.float64(ctrl[world, pulls[place]])


@wp.kernel(enable_backward=False)
def slacken(
    timestep: wp.float64,
    unlimited: float,
    pulls: wp.array(dtype=int),
    tendons: wp.array(dtype=int),
    gainprm: wp.array2d(dtype=vec10),
    biasprm: wp.array2d(dtype=vec10),
    ten_length: wp.array2d(dtype=float),
    ctrl: wp.array2d(dtype=float),
    ctrl_before: wp.array2d(dtype=float),
    forcerange: wp.array2d(dtype=wp.vec2),
    entering: wp.array2d(dtype=wp.float64),
    drive: wp.array2d(dtype=wp.float64),
):
    """Clamp the forces of tendons that were slack, and find the tensions of all.

    Args:
        timestep: [s].
        unlimited: largest force of a tendon that was taut (`mechanics.slack.clamp_of_slack`).
        pulls, tendons: actuators of the driven tendons and these, shape (k,).
        gainprm, biasprm, ten_length, ctrl: MuJoCo Warp's.
        ctrl_before: in and out: the controls of the step before, shape (m, k).
        forcerange: out.
        entering: out: tensions, below zero where slack, shape (m, k) [N].
        drive: out: what they grow by per unit of the rate of lengthening in a step, shape (m, k) [N s/m].
    """
    world, place = wp.tid()
    actuator = pulls[place]
    gain = wp.float64(gainprm[world % gainprm.shape[0], actuator][0])
    affine = biasprm[world % biasprm.shape[0], actuator]
    length_gain = wp.float64(affine[1])
    passive = wp.float64(affine[0]) + length_gain * wp.float64(ten_length[world, tendons[place]])
    largest = float(0.0)  # noqa: UP018 - a literal would be a constant to Warp
    if gain * wp.float64(ctrl_before[world, place]) + passive < _ZERO:
        largest = unlimited
    clamp = forcerange[world, actuator]
    clamp[1] = largest
    forcerange[world, actuator] = clamp
    control = ctrl[world, actuator]
    ctrl_before[world, place] = control
    entering[world, place] = -(gain * wp.float64(control) + passive)
    drive[world, place] = -length_gain * timestep
