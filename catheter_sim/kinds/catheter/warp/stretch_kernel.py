"""Tendons that stretch by Nayar 2023, Algorithm 1, as a Warp kernel, one thread for each copy and tendon.

The same as `catheter_sim.kinds.catheter.theory.elongation` and `catheter_sim.kinds.catheter.forces.stretch`,
in double precision; what MuJoCo Warp hands over and takes is single.
"""

# mypy: disable-error-code="valid-type, index"
# Warp states the type of an array, or of a vector of so many numbers, by a call.

import math

import warp as wp

from catheter_sim.kinds.catheter.forces import stretch as catheter_stretch
from catheter_sim.kinds.catheter.theory import elongation
from catheter_sim.mechanics.device_types import vec10

# A tendon's law: the envelope's p_1 to p_4, gamma, a_n, b_n, phi, beta (`elongation.TendonLaw`).
Law = wp.types.vector(length=9, dtype=wp.float64)
# Its history: strain, tension, phase, cycle, most (strain, tension), anchor (strain, tension).
State = wp.types.vector(length=8, dtype=wp.float64)

_LARGEST_STRAIN = wp.constant(wp.float64(elongation.LARGEST_STRAIN))
_UNTOUCHED = wp.constant(wp.float64(elongation.UNTOUCHED))
_TOUCH = wp.constant(wp.float64(elongation.TOUCH))
_SHAKE = wp.constant(wp.float64(catheter_stretch.SHAKE))
_DIFFERENCE = wp.constant(wp.float64(catheter_stretch.DIFFERENCE))
_SEARCHED = wp.constant(wp.float64(catheter_stretch.LARGEST_STRAIN))
_BISECTIONS = wp.constant(60)
_NEVER = wp.constant(wp.float64(1e30))  # strain: beyond all
_THIRD_TURN = wp.constant(wp.float64(2.0 * math.pi / 3.0))
_LOADING = wp.constant(wp.float64(0.0))
_UNLOADING = wp.constant(wp.float64(1.0))
_RELOADING = wp.constant(wp.float64(2.0))
_ZERO = wp.constant(wp.float64(0.0))
_HALF = wp.constant(wp.float64(0.5))
_ONE = wp.constant(wp.float64(1.0))
_TWO = wp.constant(wp.float64(2.0))
_THREE = wp.constant(wp.float64(3.0))


@wp.func
def _envelope(law: Law, strain: wp.float64) -> wp.float64:
    """As `elongation.envelope_N`."""
    if strain <= _ZERO:
        return _ZERO
    e = wp.min(strain, _LARGEST_STRAIN)
    slope = _THREE * law[0] * e * e + _TWO * law[1] * e + law[2]
    return ((law[0] * e + law[1]) * e + law[2]) * e + law[3] + slope * (strain - e)


@wp.func
def _foot(law: Law, state: State) -> wp.float64:
    """As `elongation._foot`."""
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
    """As `elongation._let_go`."""
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
    """As `elongation._meeting`: the first real root, beyond the start, of a cubic."""
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
    """As `elongation._pulled_again`."""
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
    """As `elongation.stretched`."""
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
    """As `catheter_stretch.StretchingTendon._strain`, by halving."""
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
def update(
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

    Args:
        law: of all.
        actuators, tendons: of each, shape (k,).
        rest: tendons' lengths unstretched [m], shape (k,).
        lengths, compliances: as of `catheter_stretch.StretchingTendon`, shape (k,) [m, m/N].
        ctrl, ten_length: MuJoCo's.
        states: in and out, shape (m, k).
        gainprm, biasprm: out: force = gain control + bias + length gain length.
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
        step = wp.float64(_DIFFERENCE)
        if strain < before[0]:
            step = -_DIFFERENCE
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
