"""Exposed tubes that bend, as a Warp kernel, one thread for each copy and tube.

The same as `catheter_sim.kinds.catheter.forces.tube` and `catheter_sim.kinds.catheter.theory.tube`, in double
precision; what MuJoCo Warp hands over and takes is single.
"""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import warp as wp

from catheter_sim.kinds.catheter.forces import tube as catheter_tube
from catheter_sim.kinds.catheter.theory import tube
from catheter_sim.mechanics.device_types import vec10

# Columns of `places`: see `update`.
EXIT_X, EXIT_Y, INLET_X, INLET_Y, SLIDE, TWIST, SLIDE_DOF, DRIVE, BEND, SKEW = (0, 1, 2, 3, 4, 5, 6, 7, 8, 10)

_EXIT_X, _EXIT_Y = wp.constant(EXIT_X), wp.constant(EXIT_Y)
_INLET_X, _INLET_Y = wp.constant(INLET_X), wp.constant(INLET_Y)
_SLIDE, _TWIST, _SLIDE_DOF = wp.constant(SLIDE), wp.constant(TWIST), wp.constant(SLIDE_DOF)
_DRIVE, _BEND, _SKEW = wp.constant(DRIVE), wp.constant(BEND), wp.constant(SKEW)
_SKEW_STIFFNESS = wp.constant(wp.float64(tube.SKEW_STIFFNESS))
_SKEW_SHORTENING = wp.constant(wp.float64(tube.SKEW_SHORTENING))
_SMALL = wp.constant(wp.float64(tube.SMALL_RAD))
_SHORTEST = wp.constant(wp.float64(catheter_tube.SHORTEST_M))
_ZERO = wp.constant(wp.float64(0.0))
_HALF = wp.constant(wp.float64(0.5))
_ONE = wp.constant(wp.float64(1.0))
_TWO = wp.constant(wp.float64(2.0))
_SIX = wp.constant(wp.float64(6.0))
_TWELVE = wp.constant(wp.float64(12.0))

Turned = wp.types.vector(length=6, dtype=wp.float64)  # the turn, then its slopes, as `tube.end_turn` has them


@wp.func
def _end_turn(x: wp.float64, y: wp.float64) -> Turned:
    """As `tube.end_turn`."""
    sx = wp.sin(x)
    cx = wp.cos(x)
    sy = wp.sin(y)
    cy = wp.cos(y)
    across_x = sx * cy
    across_y = sy
    sine = wp.sqrt(across_x * across_x + across_y * across_y)
    angle = wp.atan2(sine, cx * cy)
    ratio = _ONE + angle * angle / _SIX
    slope = _TWO / _SIX
    if angle >= _SMALL:
        ratio = angle / sine
        slope = (sine - angle * cx * cy) / (sine * sine * sine)
    by_x = slope * sx * cy
    by_y = slope * cx * sy
    return Turned(
        ratio * across_x,
        ratio * across_y,
        ratio * cx * cy + across_x * by_x,
        -ratio * sx * sy + across_x * by_y,
        across_y * by_x,
        ratio * cy + across_y * by_y,
    )


@wp.func
def _end_twist(x: wp.float64, y: wp.float64) -> wp.float64:
    """As `tube.end_twist_rad`."""
    return _TWO * wp.atan(wp.tan(_HALF * x) * wp.tan(_HALF * y))


@wp.func
def _chord_share(bend: wp.float64, skew: wp.float64) -> wp.vec2d:
    """Return the first two of what `tube.chord_share` does."""
    half = _HALF * bend
    share = _ONE - half * half / _SIX
    slope = -_ONE / _TWELVE
    if half >= _SMALL:
        share = wp.sin(half) / half
        slope = (half * wp.cos(half) - wp.sin(half)) / (wp.float64(4.0) * half * half * half)
    return wp.vec2d(share - _SKEW_SHORTENING * skew * skew, slope)


@wp.func
def _set(
    world: int,
    spring: int,
    length: wp.float64,
    moment: wp.float64,
    stiffness: wp.float64,
    tendon_stiffness: wp.array2d(dtype=float),
    lengthspring: wp.array2d(dtype=wp.vec2),
):
    """As `catheter_tube.Tube._set`."""
    rest = float(length + moment / stiffness)
    tendon_stiffness[world, spring] = float(stiffness)
    lengthspring[world, spring] = wp.vec2(rest, rest)


@wp.kernel(enable_backward=False)
def update(
    places: wp.array2d(dtype=int),
    curvature: wp.array2d(dtype=wp.float64),
    beyond: wp.array(dtype=wp.float64),
    springs: wp.array2d(dtype=wp.float64),
    drive_stiffness: wp.array(dtype=wp.float64),
    qpos: wp.array2d(dtype=float),
    smooth: wp.array2d(dtype=float),
    passive: wp.array2d(dtype=float),
    actuated: wp.array2d(dtype=float),
    constraint: wp.array2d(dtype=float),
    tendon_stiffness: wp.array2d(dtype=float),
    lengthspring: wp.array2d(dtype=wp.vec2),
    qpos_spring: wp.array2d(dtype=float),
    gainprm: wp.array2d(dtype=vec10),
    biasprm: wp.array2d(dtype=vec10),
):
    """Let springs and drives be those of the tubes' present lengths and angles.

    Args:
        places: of each tube in MuJoCo: positions of the hinges `exit` toward x and y, `inlet` likewise, of
            the slide and the twist; the slide's degree of freedom, its actuator, the springs against the
            whole bend and against skew, two each, shape (k, 12).
        curvature: at rest, toward x and y, shape (k, 2) [1/m].
        beyond: length of what is carried [m], shape (k,).
        springs: stiffness times length, and the part that no length changes, shape (k, 2) [N m^2, N m].
        drive_stiffness: of the drives, shape (k,) [N/m].
        qpos, smooth, passive, actuated, constraint: MuJoCo's; forces of the step before.
        tendon_stiffness, lengthspring, qpos_spring, gainprm, biasprm: out.
    """
    world, t = wp.tid()
    exit_x = wp.float64(qpos[world, places[t, _EXIT_X]])
    exit_y = wp.float64(qpos[world, places[t, _EXIT_Y]])
    inlet_x = wp.float64(qpos[world, places[t, _INLET_X]])
    inlet_y = wp.float64(qpos[world, places[t, _INLET_Y]])
    chord = wp.float64(qpos[world, places[t, _SLIDE]])
    a = _end_turn(exit_x, exit_y)
    b = _end_turn(inlet_x, inlet_y)
    bend = wp.vec2d(a[0] + b[0], a[1] + b[1])
    skew = wp.vec2d(a[0] - b[0], a[1] - b[1])
    shared = _chord_share(wp.length(bend), wp.length(skew))
    share = shared[0]
    length = wp.max(chord / share, _ZERO)
    stiffness = springs[t, 0] / wp.max(length, _SHORTEST) + springs[t, 1]
    dof = places[t, _SLIDE_DOF]
    load = wp.float64(smooth[world, dof]) - wp.float64(passive[world, dof])
    load = load - wp.float64(actuated[world, dof]) + wp.float64(constraint[world, dof])
    axial = load * length
    rest = wp.vec2d(curvature[t, 0], curvature[t, 1])
    m = (axial * shared[1]) * bend - stiffness * (bend - length * rest)
    n = (-_TWO * _SKEW_SHORTENING * axial - _SKEW_STIFFNESS * stiffness) * skew
    held = wp.max(load, _ZERO) * (length + beyond[t])
    on_bend = stiffness + held
    on_skew = _SKEW_STIFFNESS * stiffness + held
    exit_on_x = a[2] * (m[0] + n[0]) + a[4] * (m[1] + n[1])
    exit_on_y = a[3] * (m[0] + n[0]) + a[5] * (m[1] + n[1])
    inlet_on_x = b[2] * (m[0] - n[0]) + b[4] * (m[1] - n[1])
    inlet_on_y = b[3] * (m[0] - n[0]) + b[5] * (m[1] - n[1])
    whole_x = exit_x + inlet_x - rest[0] * chord
    whole_y = exit_y + inlet_y - rest[1] * chord
    bend_x = places[t, _BEND]
    bend_y = places[t, _BEND + 1]
    skew_x = places[t, _SKEW]
    skew_y = places[t, _SKEW + 1]
    mean_x = _HALF * (exit_on_x + inlet_on_x)
    mean_y = _HALF * (exit_on_y + inlet_on_y)
    half_x = _HALF * (exit_on_x - inlet_on_x)
    half_y = _HALF * (exit_on_y - inlet_on_y)
    _set(world, bend_x, whole_x, mean_x, on_bend, tendon_stiffness, lengthspring)
    _set(world, bend_y, whole_y, mean_y, on_bend, tendon_stiffness, lengthspring)
    _set(world, skew_x, exit_x - inlet_x, half_x, on_skew, tendon_stiffness, lengthspring)
    _set(world, skew_y, exit_y - inlet_y, half_y, on_skew, tendon_stiffness, lengthspring)
    twist = _end_twist(inlet_x, inlet_y) - _end_twist(exit_x, exit_y)
    qpos_spring[world, places[t, _TWIST]] = float(twist)
    drive = places[t, _DRIVE]
    gain = gainprm[world, drive]
    gain[0] = float(drive_stiffness[t] / share)
    gainprm[world, drive] = gain
    affine = biasprm[world, drive]
    affine[1] = float(-drive_stiffness[t] / (share * share))
    biasprm[world, drive] = affine
