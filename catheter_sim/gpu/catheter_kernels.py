"""A catheter's laws as Warp kernels, one thread for each copy and gap, tendon, pair or tube.

The same as `catheter_sim.robots.catheter.laws`, `.measured` and `.kinematics`, in double precision; what
MuJoCo Warp hands over and takes is single.
"""

# mypy: disable-error-code="valid-type, index"
# Warp states the type of an array, or of a vector of so many numbers, by a call.

import math

import warp as wp

from catheter_sim.gpu.device_types import vec10
from catheter_sim.robots.catheter import kinematics, laws, measured

# ----------------------------------------------------------------------------------------------------
# By how much the tendons of bending joints turn.


@wp.kernel(enable_backward=False)
def pair_turns_of_copies(
    path: wp.float64,
    qpos: wp.array2d(dtype=float),
    gaps: wp.array2d(dtype=int),
    ends: wp.array(dtype=int),
    passes: wp.array2d(dtype=int),
    turn: wp.array3d(dtype=wp.float64),
):
    """As `robots.catheter.laws.PairTurns`, one thread for each copy and pair.

    Of p pairs where their gaps are in `qpos` (p, n), number of gaps (p,) or more, and 1 where one passes the
    joint of another (p, p). Out: turns of the pairs' tendons and then their antagonists' (m, 2 p, n) [rad].
    """
    world, pair = wp.tid()
    pairs = gaps.shape[0]
    first = wp.float64(path)
    for other in range(pairs):
        if passes[pair, other] > 0:
            bend = wp.float64(0.0)
            for k in range(ends[other]):
                bend += wp.float64(qpos[world, gaps[other, k]])
            first += wp.abs(bend)
    before = wp.float64(0.0)
    for k in range(ends[pair]):
        angle = wp.float64(qpos[world, gaps[pair, k]])
        value = wp.float64(0.5) * wp.abs(before + angle)
        if k == 0:
            value += first
        turn[world, pair, k] = value
        turn[world, pairs + pair, k] = value
        before = angle


# ----------------------------------------------------------------------------------------------------
# Joints that resist as measured.


_STICK_RATIO = wp.constant(wp.float64(laws.STICK_RATIO))
_LEAST_RATIO = wp.constant(wp.float64(laws.LEAST_RATIO))
_DIFFERENCE = wp.constant(wp.float64(math.radians(laws.DIFFERENCE_DEG)))  # [rad]
_APART = wp.constant(wp.float64(laws.APART))
_DEGREES = wp.constant(wp.float64(math.degrees(1.0)))
_ZERO = wp.constant(wp.float64(0.0))
_HALF = wp.constant(wp.float64(0.5))
_ONE = wp.constant(wp.float64(1.0))


@wp.struct
class GapsOnDevice:
    """The gaps of joints that resist as measured, g of them."""

    joint_index: wp.array(dtype=int)  # in MuJoCo, as the next two
    qpos_index: wp.array(dtype=int)
    dof_index: wp.array(dtype=int)
    gaps: wp.array(dtype=wp.float64)  # number of the gap's joint
    scale: wp.array(dtype=wp.float64)  # moment per radian of a gap [N m/rad]
    arms: wp.array2d(dtype=wp.float64)  # of the joint's tendons and half of a gap, (g, 2) [m]
    loading: wp.array2d(dtype=wp.float64)  # Algorithm 2, (g, 4)
    bounds: wp.array2d(dtype=wp.float64)  # (g, 2)
    c_1: wp.array2d(dtype=wp.float64)  # (g, 3)
    c_2: wp.array2d(dtype=wp.float64)  # (g, 3)


@wp.func
def _slipping(gap: GapsOnDevice, k: int, angle: wp.float64, turn: wp.float64, least: wp.float64) -> wp.vec2d:
    """Return the moments at which a gap slips back and on, with the angle's sign [N m]."""
    size = wp.abs(angle)
    bend = size * _DEGREES * gap.gaps[k]
    arm = gap.arms[k, 0] * wp.cos(_HALF * size) + gap.arms[k, 1] * wp.sin(_HALF * size)
    tension = gap.loading[k, 0] + bend * (
        gap.loading[k, 1] + bend * (gap.loading[k, 2] + bend * gap.loading[k, 3])
    )
    tension = wp.max(tension, _ZERO)
    piece = int(2)  # noqa: UP018, RUF046 - a literal would be a constant to Warp
    if turn <= gap.bounds[k, 0]:
        piece = 0
    elif turn <= gap.bounds[k, 1]:
        piece = 1
    back = wp.float64(0.0)
    if turn > _ZERO:
        power = wp.pow(wp.min(bend, turn) / (turn + wp.float64(0.01)), gap.c_2[k, piece])
        inverse = _HALF * wp.log((_ONE + power) / (_ONE - power))
        back = wp.min(tension / gap.c_1[k, piece] * inverse, tension)
    on = wp.max(tension * arm, least * size)
    back = wp.max(back * arm, least * size)
    if angle >= _ZERO:
        return wp.vec2d(back, on)
    return wp.vec2d(-on, -back)


@wp.kernel(enable_backward=False)
def update_resistance(
    gap: GapsOnDevice,
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
        gap: all of them.
        qpos, actuated, applied: MuJoCo's; forces of the step before.
        angles, moments: in and out: history, shape (m, g).
        turns: in and out: to which each was last loaded, toward + and toward -, shape (m, 2, g) [deg].
        jnt_stiffness, qpos_spring: out.
    """
    world, k = wp.tid()
    angle = wp.float64(qpos[world, gap.qpos_index[k]])
    stick = _STICK_RATIO * gap.scale[k]
    least = _LEAST_RATIO * gap.scale[k]
    stuck = moments[world, k] + stick * (angle - angles[world, k])
    side = int(0)  # noqa: UP018, RUF046
    if angle < _ZERO:
        side = 1
    nudge = _DIFFERENCE / gap.gaps[k]
    onward = angle + nudge
    side_on = int(0)  # noqa: UP018, RUF046
    if onward < _ZERO:
        side_on = 1
    here = _slipping(gap, k, angle, turns[world, side, k], least)
    there = _slipping(gap, k, onward, turns[world, side_on, k], least)
    moment = wp.min(wp.max(stuck, here[0]), here[1])
    i = gap.dof_index[k]
    pulled = wp.float64(actuated[world, i]) + wp.float64(applied[world, i])
    slope = wp.float64(stick)
    if stuck > here[1] and pulled >= moment:
        slope = (there[1] - here[1]) / nudge
    if stuck < here[0] and pulled <= moment:
        slope = (there[0] - here[0]) / nudge
    slope = wp.max(slope, least)
    bend = wp.abs(angle) * _DEGREES * gap.gaps[k]
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
    jnt_stiffness[world, gap.joint_index[k]] = float(slope)
    qpos_spring[world, gap.qpos_index[k]] = float(angle - moment / slope)


# ----------------------------------------------------------------------------------------------------
# Tendons that stretch by Nayar 2023, Algorithm 1.

# A tendon's law: the envelope's p_1 to p_4, gamma, a_n, b_n, phi, beta (`measured.TendonLaw`).
Law = wp.types.vector(length=9, dtype=wp.float64)
# Its history: strain, tension, phase, cycle, most (strain, tension), anchor (strain, tension).
State = wp.types.vector(length=8, dtype=wp.float64)

_LARGEST_STRAIN = wp.constant(wp.float64(measured.LARGEST_STRAIN))
_UNTOUCHED = wp.constant(wp.float64(measured.UNTOUCHED))
_TOUCH = wp.constant(wp.float64(measured.TOUCH))
_SHAKE = wp.constant(wp.float64(laws.SHAKE))
_STRAIN_DIFFERENCE = wp.constant(wp.float64(laws.DIFFERENCE))
_SEARCHED = wp.constant(wp.float64(laws.LARGEST_STRAIN))
_BISECTIONS = wp.constant(60)
_NEVER = wp.constant(wp.float64(1e30))  # strain: beyond all
_THIRD_TURN = wp.constant(wp.float64(2.0 * math.pi / 3.0))
_LOADING = wp.constant(wp.float64(0.0))
_UNLOADING = wp.constant(wp.float64(1.0))
_RELOADING = wp.constant(wp.float64(2.0))
_TWO = wp.constant(wp.float64(2.0))
_THREE = wp.constant(wp.float64(3.0))


@wp.func
def _envelope(law: Law, strain: wp.float64) -> wp.float64:
    """As `measured.envelope_N`."""
    if strain <= _ZERO:
        return _ZERO
    e = wp.min(strain, _LARGEST_STRAIN)
    slope = _THREE * law[0] * e * e + _TWO * law[1] * e + law[2]
    return ((law[0] * e + law[1]) * e + law[2]) * e + law[3] + slope * (strain - e)


@wp.func
def _foot(law: Law, state: State) -> wp.float64:
    """As `measured._foot`."""
    slack = law[4] * state[4]
    return wp.min(slack + (state[3] - _ONE) * law[8], _HALF * (slack + state[4]))


@wp.func
def _moved(state: State, strain: wp.float64, tension: wp.float64) -> State:
    """Return the same history at another strain and tension."""
    moved = state
    moved[0] = strain
    moved[1] = tension
    return moved


@wp.func
def _let_go(law: Law, state: State, strain: wp.float64) -> State:
    """As `measured._let_go`."""
    slack = law[4] * state[4]
    turn = state[6]
    top = state[7]
    tension = wp.float64(0.0)
    if strain > slack and top > _ZERO:
        q = law[5] * state[4] + law[6]
        at_slack = wp.pow(slack, q)
        flat = q * wp.pow(slack, q - _ONE)
        rise = wp.pow(turn, q) - at_slack - flat * (turn - slack)
        here = wp.pow(strain, q) - at_slack - flat * (strain - slack)
        tension = top
        if rise > _ZERO:
            tension = top * wp.max(here, _ZERO) / rise
    return _moved(state, strain, tension)


@wp.func
def _nearest(best: wp.float64, root: wp.float64, start: wp.float64) -> wp.float64:
    """Return the smaller one of `best` and of a root beyond the start."""
    if root > start and root < best:
        return root
    return best


@wp.func
def _meeting(law: Law, start: wp.float64, start_N: wp.float64, slope: wp.float64) -> wp.float64:
    """As `measured._meeting`: the first real root, beyond the start, of a cubic."""
    a = law[1] / law[0]
    b = (law[2] - slope) / law[0]
    c = (law[3] - start_N + slope * start) / law[0]
    q = (a * a - _THREE * b) / wp.float64(9.0)
    r = (_TWO * a * a * a - wp.float64(9.0) * a * b + wp.float64(27.0) * c) / wp.float64(54.0)
    shift = a / _THREE
    best = wp.float64(_NEVER)
    if r * r < q * q * q:
        size = wp.sqrt(q)
        third = wp.acos(r / (q * size)) / _THREE
        best = _nearest(best, -_TWO * size * wp.cos(third) - shift, start)
        best = _nearest(best, -_TWO * size * wp.cos(third + _THIRD_TURN) - shift, start)
        return _nearest(best, -_TWO * size * wp.cos(third - _THIRD_TURN) - shift, start)
    outer = wp.pow(wp.abs(r) + wp.sqrt(r * r - q * q * q), _ONE / _THREE)
    if r > _ZERO:
        outer = -outer
    inner = wp.float64(0.0)
    if outer != _ZERO:
        inner = q / outer
    return _nearest(best, outer + inner - shift, start)


@wp.func
def _pulled_again(law: Law, state: State, strain: wp.float64) -> State:
    """As `measured._pulled_again`."""
    foot = _foot(law, state)
    start = state[6]
    start_N = state[7]
    turn = state[4]
    top = wp.pow(law[7], state[3] - _ONE) * state[5]
    slope = top / (turn - foot)
    if start < turn - _TOUCH:
        slope = wp.max(slope, (top - start_N) / (turn - start))
    if strain > _meeting(law, start, start_N, slope) + _TOUCH:
        fresh = State()
        return _moved(fresh, strain, _envelope(law, strain))
    return _moved(state, strain, wp.max(start_N + slope * (strain - start), _ZERO))


@wp.func
def _stretched(law: Law, state: State, strain: wp.float64) -> State:
    """As `measured.stretched`."""
    changed = state
    if state[2] == _LOADING:
        if strain >= state[0] or state[0] <= _UNTOUCHED:
            return _moved(state, strain, _envelope(law, strain))
        changed[2] = _UNLOADING
        changed[3] = _ONE
        changed[4] = state[0]
        changed[5] = state[1]
        changed[6] = state[0]
        changed[7] = state[1]
        return _let_go(law, changed, strain)
    if state[2] == _UNLOADING:
        if strain <= state[0]:
            return _let_go(law, state, strain)
        changed[2] = _RELOADING
        changed[6] = _foot(law, state)
        changed[7] = _ZERO
        if state[1] > _ZERO:
            changed[6] = state[0]
            changed[7] = state[1]
        return _pulled_again(law, changed, strain)
    if strain >= state[0]:
        return _pulled_again(law, state, strain)
    changed[2] = _UNLOADING
    changed[6] = state[0]
    changed[7] = state[1]
    if state[0] > state[4] + _TOUCH:
        changed[3] = _ONE
        changed[4] = state[0]
        changed[5] = state[1]
    elif state[1] > _ZERO:
        changed[3] = state[3] + _ONE
    return _let_go(law, changed, strain)


@wp.func
def _strain(
    law: Law, state: State, stretch: wp.float64, length: wp.float64, compliance: wp.float64
) -> wp.float64:
    """As `laws.StretchingTendon._strain`, by halving."""
    if compliance == _ZERO or stretch <= _ZERO:
        return stretch / length
    low = wp.float64(0.0)
    high = wp.min(stretch / length, _SEARCHED)
    for _ in range(_BISECTIONS):
        middle = _HALF * (low + high)
        reached = _stretched(law, state, middle)
        if middle * length + reached[1] * compliance > stretch:
            high = middle
        else:
            low = middle
    return _HALF * (low + high)


@wp.kernel(enable_backward=False)
def update_stretch(
    law: Law,
    actuators: wp.array(dtype=int),
    tendons: wp.array(dtype=int),
    rest: wp.array(dtype=wp.float64),
    lengths: wp.array(dtype=wp.float64),
    compliances: wp.array(dtype=wp.float64),
    ctrl: wp.array2d(dtype=float),
    ten_length: wp.array2d(dtype=float),
    states: wp.array2d(dtype=State),
    gainprm: wp.array2d(dtype=vec10),
    biasprm: wp.array2d(dtype=vec10),
):
    """Make the actuators the tangents of the law at the present lengths and controls.

    Lengths unstretched [m], and `lengths`, `compliances` as of `StretchingTendon`, (k,) [m, m/N]. In and out:
    the states (m, k). Out: force = gain control + bias + length gain length.
    """
    world, k = wp.tid()
    actuator = actuators[k]
    drawn = wp.float64(ctrl[world, actuator]) + wp.float64(ten_length[world, tendons[k]])
    stretch = drawn - rest[k]
    length = lengths[k]
    before = states[world, k]
    strain = _strain(law, before, stretch, length, compliances[k])
    slack = wp.float64(0.0)
    if before[2] != _LOADING:
        slack = law[4] * before[4]
    elif before[0] > _ZERO and strain <= _ZERO:
        slack = law[4] * before[0]
    state = _stretched(law, before, strain)
    soft = _ONE / (length / law[2] + compliances[k])
    tension = soft * wp.min(stretch - slack * length, _ZERO)
    stiffness = soft
    if state[1] > _ZERO:
        step = wp.float64(_STRAIN_DIFFERENCE)
        if strain < before[0]:
            step = -_STRAIN_DIFFERENCE
        beside = _stretched(law, before, strain + step)
        slope = wp.max((beside[1] - state[1]) / step, law[2]) / length
        tension = state[1]
        stiffness = _ONE / (_ONE / slope + compliances[k])
    onward = strain - before[0]
    goes_on = onward >= _ZERO
    if before[2] == _UNLOADING:
        goes_on = onward <= _ZERO
    if goes_on or wp.abs(onward) > _SHAKE:
        states[world, k] = state
    gain = gainprm[world, actuator]
    gain[0] = float(-stiffness)
    gainprm[world, actuator] = gain
    affine = biasprm[world, actuator]
    affine[0] = float(stiffness * drawn - tension)
    affine[1] = float(-stiffness)
    biasprm[world, actuator] = affine


# ----------------------------------------------------------------------------------------------------
# Torsion pairs.


@wp.kernel(enable_backward=False)
def turn_pairs(
    actuators: wp.array(dtype=int),
    qpos_index: wp.array(dtype=int),
    law: wp.array2d(dtype=wp.float64),
    qpos: wp.array2d(dtype=float),
    ctrl: wp.array2d(dtype=float),
    biasprm: wp.array2d(dtype=vec10),
):
    """As `robots.catheter.laws.tangents`, which says what `law` (k, 6) holds."""
    world, k = wp.tid()
    radius = law[k, 0]
    height = law[k, 1]
    angle = wp.float64(qpos[world, qpos_index[k]])
    control = wp.float64(ctrl[world, actuators[k]])
    around = radius * wp.max(law[k, 2] - wp.abs(angle), _ZERO)
    wrapped = wp.sqrt(around * around + height * height)
    drawn = wp.abs(law[k, 3] - wrapped)
    if angle < _ZERO:
        drawn = -drawn
    arm = wp.float64(radius)
    if height > _ZERO:
        arm = radius * around / wrapped
    moment = law[k, 4] * (control - drawn) * arm
    slope = law[k, 4] * arm * arm
    affine = biasprm[world, actuators[k]]
    affine[0] = float(moment + slope * angle - law[k, 5] * control)
    affine[1] = float(-slope)
    biasprm[world, actuators[k]] = affine


# ----------------------------------------------------------------------------------------------------
# Exposed tubes that bend.

# Columns of `TubesOnDevice.places`.
_EXIT_X, _EXIT_Y, _INLET_X, _INLET_Y, _SLIDE = (wp.constant(column) for column in range(5))
_TWIST, _SLIDE_DOF, _DRIVE, _BEND, _SKEW = (wp.constant(column) for column in (5, 6, 7, 8, 10))
_SKEW_STIFFNESS = wp.constant(wp.float64(kinematics.SKEW_STIFFNESS))
_SKEW_SHORTENING = wp.constant(wp.float64(kinematics.SKEW_SHORTENING))
_SMALL = wp.constant(wp.float64(kinematics.SMALL_RAD))
_SHORTEST = wp.constant(wp.float64(laws.SHORTEST_M))
_SIX = wp.constant(wp.float64(6.0))
_TWELVE = wp.constant(wp.float64(12.0))

Turned = wp.types.vector(length=6, dtype=wp.float64)  # turn and slopes of `kinematics.end_turn`


@wp.func
def _end_turn(x: wp.float64, y: wp.float64) -> Turned:
    """As `kinematics.end_turn`."""
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
    """As `kinematics.end_twist_rad`."""
    return _TWO * wp.atan(wp.tan(_HALF * x) * wp.tan(_HALF * y))


@wp.func
def _chord_share(bend: wp.float64, skew: wp.float64) -> wp.vec2d:
    """Return the first two of what `kinematics.chord_share` does."""
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
    """As `laws.Tube._set`."""
    rest = float(length + moment / stiffness)
    tendon_stiffness[world, spring] = float(stiffness)
    lengthspring[world, spring] = wp.vec2(rest, rest)


@wp.struct
class TubesOnDevice:
    """As `robots.catheter.laws.TubeArrays`, of k tubes."""

    places: wp.array2d(dtype=int)
    curvature: wp.array2d(dtype=wp.float64)
    beyond: wp.array(dtype=wp.float64)
    springs: wp.array2d(dtype=wp.float64)
    drive_stiffness: wp.array(dtype=wp.float64)


@wp.kernel(enable_backward=False)
def update_tubes(
    tube: TubesOnDevice,
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
    """Let springs and drives be those of the tubes' present lengths and angles, by the last step's forces.

    The last five are written.
    """
    world, t = wp.tid()
    exit_x = wp.float64(qpos[world, tube.places[t, _EXIT_X]])
    exit_y = wp.float64(qpos[world, tube.places[t, _EXIT_Y]])
    inlet_x = wp.float64(qpos[world, tube.places[t, _INLET_X]])
    inlet_y = wp.float64(qpos[world, tube.places[t, _INLET_Y]])
    chord = wp.float64(qpos[world, tube.places[t, _SLIDE]])
    a = _end_turn(exit_x, exit_y)
    b = _end_turn(inlet_x, inlet_y)
    bend = wp.vec2d(a[0] + b[0], a[1] + b[1])
    skew = wp.vec2d(a[0] - b[0], a[1] - b[1])
    shared = _chord_share(wp.length(bend), wp.length(skew))
    share = shared[0]
    length = wp.max(chord / share, _ZERO)
    stiffness = tube.springs[t, 0] / wp.max(length, _SHORTEST) + tube.springs[t, 1]
    dof = tube.places[t, _SLIDE_DOF]
    load = wp.float64(smooth[world, dof]) - wp.float64(passive[world, dof])
    load = load - wp.float64(actuated[world, dof]) + wp.float64(constraint[world, dof])
    axial = load * length
    rest = wp.vec2d(tube.curvature[t, 0], tube.curvature[t, 1])
    m = (axial * shared[1]) * bend - stiffness * (bend - length * rest)
    n = (-_TWO * _SKEW_SHORTENING * axial - _SKEW_STIFFNESS * stiffness) * skew
    held = wp.max(load, _ZERO) * (length + tube.beyond[t])
    on_bend = stiffness + held
    on_skew = _SKEW_STIFFNESS * stiffness + held
    exit_on_x = a[2] * (m[0] + n[0]) + a[4] * (m[1] + n[1])
    exit_on_y = a[3] * (m[0] + n[0]) + a[5] * (m[1] + n[1])
    inlet_on_x = b[2] * (m[0] - n[0]) + b[4] * (m[1] - n[1])
    inlet_on_y = b[3] * (m[0] - n[0]) + b[5] * (m[1] - n[1])
    whole_x = exit_x + inlet_x - rest[0] * chord
    whole_y = exit_y + inlet_y - rest[1] * chord
    bend_x = tube.places[t, _BEND]
    bend_y = tube.places[t, _BEND + 1]
    skew_x = tube.places[t, _SKEW]
    skew_y = tube.places[t, _SKEW + 1]
    mean_x = _HALF * (exit_on_x + inlet_on_x)
    mean_y = _HALF * (exit_on_y + inlet_on_y)
    half_x = _HALF * (exit_on_x - inlet_on_x)
    half_y = _HALF * (exit_on_y - inlet_on_y)
    _set(world, bend_x, whole_x, mean_x, on_bend, tendon_stiffness, lengthspring)
    _set(world, bend_y, whole_y, mean_y, on_bend, tendon_stiffness, lengthspring)
    _set(world, skew_x, exit_x - inlet_x, half_x, on_skew, tendon_stiffness, lengthspring)
    _set(world, skew_y, exit_y - inlet_y, half_y, on_skew, tendon_stiffness, lengthspring)
    twist = _end_twist(inlet_x, inlet_y) - _end_twist(exit_x, exit_y)
    qpos_spring[world, tube.places[t, _TWIST]] = float(twist)
    drive = tube.places[t, _DRIVE]
    gain = gainprm[world, drive]
    gain[0] = float(tube.drive_stiffness[t] / share)
    gainprm[world, drive] = gain
    affine = biasprm[world, drive]
    affine[1] = float(-tube.drive_stiffness[t] / (share * share))
    biasprm[world, drive] = affine
