"""`catheter_sim.kinds.catheter.forces.resistance` as a Warp kernel, one thread for each copy and gap.

In double precision; what MuJoCo Warp hands over and takes is single.
"""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import math

import warp as wp

from catheter_sim.kinds.catheter.forces import resistance as law

_STICK_RATIO = wp.constant(wp.float64(law.STICK_RATIO))
_LEAST_RATIO = wp.constant(wp.float64(law.LEAST_RATIO))
_DIFFERENCE = wp.constant(wp.float64(math.radians(law.DIFFERENCE_DEG)))  # [rad]
_APART = wp.constant(wp.float64(law.APART))
_DEGREES = wp.constant(wp.float64(math.degrees(1.0)))
_ZERO = wp.constant(wp.float64(0.0))
_HALF = wp.constant(wp.float64(0.5))
_ONE = wp.constant(wp.float64(1.0))


@wp.func
def _slipping(
    k: int,
    angle: wp.float64,
    turn: wp.float64,
    gaps: wp.float64,
    least: wp.float64,
    arms: wp.array2d(dtype=wp.float64),
    loading: wp.array2d(dtype=wp.float64),
    bounds: wp.array2d(dtype=wp.float64),
    c_1: wp.array2d(dtype=wp.float64),
    c_2: wp.array2d(dtype=wp.float64),
) -> wp.vec2d:
    """Return the moments at which a gap slips back and on, with the angle's sign [N m]."""
    size = wp.abs(angle)
    bend = size * _DEGREES * gaps
    arm = arms[k, 0] * wp.cos(_HALF * size) + arms[k, 1] * wp.sin(_HALF * size)
    tension = loading[k, 0] + bend * (loading[k, 1] + bend * (loading[k, 2] + bend * loading[k, 3]))
    tension = wp.max(tension, _ZERO)
    piece = int(2)  # noqa: UP018, RUF046 - a literal would be a constant to Warp
    if turn <= bounds[k, 0]:
        piece = 0
    elif turn <= bounds[k, 1]:
        piece = 1
    back = wp.float64(0.0)
    if turn > _ZERO:
        power = wp.pow(wp.min(bend, turn) / (turn + wp.float64(0.01)), c_2[k, piece])
        inverse = _HALF * wp.log((_ONE + power) / (_ONE - power))
        back = wp.min(tension / c_1[k, piece] * inverse, tension)
    on = wp.max(tension * arm, least * size)
    back = wp.max(back * arm, least * size)
    if angle >= _ZERO:
        return wp.vec2d(back, on)
    return wp.vec2d(-on, -back)


@wp.kernel(enable_backward=False)
def update(
    joint_index: wp.array(dtype=int),
    qpos_index: wp.array(dtype=int),
    dof_index: wp.array(dtype=int),
    gaps: wp.array(dtype=wp.float64),
    scale: wp.array(dtype=wp.float64),
    arms: wp.array2d(dtype=wp.float64),
    loading: wp.array2d(dtype=wp.float64),
    bounds: wp.array2d(dtype=wp.float64),
    c_1: wp.array2d(dtype=wp.float64),
    c_2: wp.array2d(dtype=wp.float64),
    qpos: wp.array2d(dtype=float),
    actuated: wp.array2d(dtype=float),
    applied: wp.array2d(dtype=float),
    angles: wp.array2d(dtype=wp.float64),
    moments: wp.array2d(dtype=wp.float64),
    turns: wp.array3d(dtype=wp.float64),
    jnt_stiffness: wp.array2d(dtype=float),
    qpos_spring: wp.array2d(dtype=float),
):
    """Let the gaps' springs have the moments of the law at the present angles.

    Args:
        joint_index, qpos_index, dof_index: of the gaps in MuJoCo, shape (g,).
        gaps: number of the gap's joint, shape (g,).
        scale: moment per radian of a gap [N m/rad], shape (g,).
        arms: of the joint's tendons and half of a gap, shape (g, 2) [m].
        loading, bounds, c_1, c_2: Algorithm 2, shapes (g, 4), (g, 2), (g, 3), (g, 3).
        qpos, actuated, applied: MuJoCo's; forces of the step before.
        angles, moments: in and out: history, shape (m, g).
        turns: in and out: to which each was last loaded, toward + and toward -, shape (m, 2, g) [deg].
        jnt_stiffness, qpos_spring: out.
    """
    world, k = wp.tid()
    angle = wp.float64(qpos[world, qpos_index[k]])
    stick = _STICK_RATIO * scale[k]
    least = _LEAST_RATIO * scale[k]
    stuck = moments[world, k] + stick * (angle - angles[world, k])
    side = int(0)  # noqa: UP018, RUF046
    if angle < _ZERO:
        side = 1
    nudge = _DIFFERENCE / gaps[k]
    onward = angle + nudge
    side_on = int(0)  # noqa: UP018, RUF046
    if onward < _ZERO:
        side_on = 1
    here = _slipping(
        k, angle, turns[world, side, k], gaps[k], least, arms, loading, bounds, c_1, c_2
    )  # fmt: skip
    there = _slipping(
        k, onward, turns[world, side_on, k], gaps[k], least, arms, loading, bounds, c_1, c_2
    )  # fmt: skip
    moment = wp.min(wp.max(stuck, here[0]), here[1])
    i = dof_index[k]
    pulled = wp.float64(actuated[world, i]) + wp.float64(applied[world, i])
    slope = wp.float64(stick)
    if stuck > here[1] and pulled >= moment:
        slope = (there[1] - here[1]) / nudge
    if stuck < here[0] and pulled <= moment:
        slope = (there[0] - here[0]) / nudge
    slope = wp.max(slope, least)
    bend = wp.abs(angle) * _DEGREES * gaps[k]
    inner = wp.abs(here[0])
    outer = wp.abs(here[1])
    outward = stuck >= here[1]
    if side == 1:
        inner = wp.abs(here[1])
        outer = wp.abs(here[0])
        outward = stuck <= here[0]
    if (outward and inner < _APART * outer) or bend > turns[world, side, k]:
        turns[world, side, k] = bend
    angles[world, k] = angle
    moments[world, k] = moment
    jnt_stiffness[world, joint_index[k]] = float(slope)
    qpos_spring[world, qpos_index[k]] = float(angle - moment / slope)
