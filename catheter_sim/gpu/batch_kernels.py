"""What pulls tendons, and the capstan law, as Warp kernels, one thread for each copy."""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import warp as wp

from catheter_sim.gpu.device_types import vec10
from catheter_sim.mechanics.capstan import LEAST_RESPONSE

# ----------------------------------------------------------------------------------------------------
# Tensions and clamps of actuators that pull tendons, as Warp kernels, one thread for each copy and
# actuator.
#
# As in `catheter_sim.simulation.simulator`, in double precision; what MuJoCo Warp hands over and takes is
# single.


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
        unlimited: largest force of a tendon that was taut (`mechanics.hysteresis.clamp_of_slack`).
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


# ----------------------------------------------------------------------------------------------------
# The capstan law of `catheter_sim.mechanics.capstan` as a Warp kernel, one thread for each copy.
#
# The numbers are those of `solve_tensions` in double precision, to its tolerance. What saves passes there
# without changing where they end (`start_from_last_change`, `extrapolate_passes`, `slip_as_before`) is left
# out. MuJoCo Warp's own arrays are in single precision.


_LEAST_RESPONSE = wp.constant(wp.float64(LEAST_RESPONSE))


@wp.func
def _span_tensions(
    world: int,
    tendon: int,
    count: int,
    entering: wp.float64,
    drive: wp.float64,
    drawn: wp.float64,
    factor: wp.array3d(dtype=wp.float64),
    response: wp.array3d(dtype=wp.float64),
    rate: wp.array2d(dtype=wp.float64),
    knots: wp.array2d(dtype=wp.float64),
    steps: wp.array2d(dtype=wp.float64),
    goal: wp.array2d(dtype=wp.float64),
    tension: wp.array3d(dtype=wp.float64),
):
    """Update one tendon's tensions and return the actuator's, as `mechanics.capstan.span_tensions` does."""
    width = knots.shape[1]
    left = int(0)  # noqa: UP018, RUF046 - a literal would be a constant to Warp
    right = int(width)
    left_shift = wp.float64(0.0)
    right_shift = wp.float64(0.0)
    reached = wp.float64(entering)
    rounds = count
    if drive > _ZERO:
        rounds = count + 1
    for k in range(rounds):
        span = count - 1 - k
        slope = wp.float64(0.0)
        offset = wp.float64(0.0)
        if span >= 0:
            slope = response[world, tendon, span]
            offset = -(slope * tension[world, tendon, span] + rate[world, span])
        else:
            slope = wp.float64(1.0) / drive
            offset = -entering / drive
        while left > 0:
            knot = knots[world, left - 1] + left_shift
            if slope * knot + offset <= _ZERO:
                break
            left -= 1
            right -= 1
            step = steps[world, left]
            slope += step
            offset -= step * knot
            knots[world, right] = knot - right_shift
            steps[world, right] = -step
        while right < width:
            knot = knots[world, right] + right_shift
            if slope * knot + offset >= _ZERO:
                break
            step = steps[world, right]
            slope += step
            offset -= step * knot
            knots[world, left] = knot - left_shift
            steps[world, left] = -step
            left += 1
            right += 1
        wish = -offset / slope
        if span < 0:
            reached = wish
        else:
            goal[world, span] = wish
            right -= 1
            knots[world, left] = wish - left_shift
            steps[world, left] = slope
            knots[world, right] = wish - right_shift
            steps[world, right] = slope
            left += 1
            before = wp.float64(drawn)
            if span > 0:
                before = tension[world, tendon, span - 1]
            left_shift -= before * factor[world, tendon, span] - before
            right_shift -= before / factor[world, tendon, span] - before
    reached = wp.max(reached, _ZERO)
    below = wp.float64(reached)
    for k in range(count):
        held = factor[world, tendon, k]
        below = wp.min(wp.max(goal[world, k], below / held), below * held)
        tension[world, tendon, k] = below
    return reached


@wp.func
def _couple_driven(
    world: int,
    drive: wp.array2d(dtype=wp.float64),
    row_start: wp.array(dtype=int),
    entry: wp.array(dtype=int),
    dof: wp.array(dtype=int),
    yielding: wp.array2d(dtype=wp.float64),
    ten_J: wp.array2d(dtype=float),
    shared: wp.array3d(dtype=wp.float64),
):
    """As `mechanics.capstan.couple_driven`."""
    tendons = drive.shape[1]
    first = 2 * tendons + 4
    driven = int(0)  # noqa: UP018, RUF046 - a literal would be a constant to Warp
    for j in range(tendons):
        if drive[world, j] > _ZERO:
            driven += 1
    if driven > 1:
        for i in range(yielding.shape[1]):
            for j in range(tendons):
                shared[world, first + i, j] = _ZERO
        for j in range(tendons):
            if drive[world, j] > _ZERO:
                for place in range(row_start[j], row_start[j + 1]):
                    row = first + dof[place]
                    shared[world, row, j] = shared[world, row, j] + wp.float64(ten_J[world, entry[place]])
        for j in range(tendons):
            if drive[world, j] > _ZERO:
                for other in range(tendons):
                    shared[world, j, other] = _ZERO
                for place in range(row_start[j], row_start[j + 1]):
                    i = dof[place]
                    gain = yielding[world, i] * wp.float64(ten_J[world, entry[place]])
                    for other in range(tendons):
                        shared[world, j, other] = (
                            shared[world, j, other] + gain * shared[world, first + i, other]
                        )
                shared[world, j, j] = shared[world, j, j] + wp.float64(1.0) / drive[world, j]
    return driven


@wp.func
def _raise_together(
    world: int,
    ends: wp.array(dtype=int),
    row_start: wp.array(dtype=int),
    entry: wp.array(dtype=int),
    dof: wp.array(dtype=int),
    span: wp.array(dtype=int),
    entering: wp.array2d(dtype=wp.float64),
    drive: wp.array2d(dtype=wp.float64),
    yielding: wp.array2d(dtype=wp.float64),
    ten_J: wp.array2d(dtype=float),
    shared: wp.array3d(dtype=wp.float64),
    reached: wp.array2d(dtype=wp.float64),
    tension: wp.array3d(dtype=wp.float64),
    ahead: wp.array2d(dtype=wp.float64),
):
    """As `mechanics.capstan.raise_together`."""
    tendons = drive.shape[1]
    slope = 2 * tendons
    goal = slope + 1
    shift = slope + 2
    held = slope + 3
    for j in range(tendons):
        shared[world, slope, j] = _ZERO
        shared[world, shift, j] = _ZERO
        shared[world, held, j] = wp.float64(1.0)
        if drive[world, j] > _ZERO:
            shared[world, held, j] = _ZERO
            fall = (reached[world, j] - entering[world, j]) / drive[world, j]
            for place in range(row_start[j], row_start[j + 1]):
                fall -= wp.float64(ten_J[world, entry[place]]) * ahead[world, dof[place]]
            shared[world, slope, j] = fall
    rounds = int(4 * tendons)
    while rounds > 0:
        rounds -= 1
        for j in range(tendons):
            free = shared[world, held, j] == _ZERO
            for other in range(tendons):
                value = wp.float64(0.0)
                if free and drive[world, other] > _ZERO:
                    value = shared[world, j, other]
                shared[world, tendons + j, other] = value
            shared[world, goal, j] = -shared[world, slope, j]
            if not free:
                shared[world, tendons + j, j] = wp.float64(1.0)
                shared[world, goal, j] = shared[world, shift, j]
        for j in range(tendons):
            for below in range(j + 1, tendons):
                ratio = shared[world, tendons + below, j] / shared[world, tendons + j, j]
                for other in range(j + 1, tendons):
                    shared[world, tendons + below, other] = (
                        shared[world, tendons + below, other] - ratio * shared[world, tendons + j, other]
                    )
                shared[world, goal, below] = shared[world, goal, below] - ratio * shared[world, goal, j]
        for back in range(tendons):
            j = tendons - 1 - back
            found = wp.float64(shared[world, goal, j])
            for other in range(j + 1, tendons):
                found -= shared[world, tendons + j, other] * shared[world, goal, other]
            shared[world, goal, j] = found / shared[world, tendons + j, j]
        part = wp.float64(1.0)
        first = int(-1)  # noqa: UP018, RUF046
        for j in range(tendons):
            if shared[world, held, j] == _ZERO and shared[world, goal, j] < -reached[world, j]:
                way = shared[world, goal, j] - shared[world, shift, j]
                share = (-reached[world, j] - shared[world, shift, j]) / way
                if share < part or first < 0:
                    part = wp.float64(share)
                    first = int(j)
        for j in range(tendons):
            way = shared[world, goal, j] - shared[world, shift, j]
            shared[world, shift, j] = shared[world, shift, j] + part * way
        if first >= 0:
            shared[world, shift, first] = -reached[world, first]
            shared[world, held, first] = wp.float64(1.0)
        else:
            strongest = wp.float64(0.0)
            for j in range(tendons):
                if drive[world, j] > _ZERO and shared[world, held, j] > _ZERO:
                    push = wp.float64(shared[world, slope, j])
                    for other in range(tendons):
                        if drive[world, other] > _ZERO:
                            push += shared[world, j, other] * shared[world, shift, other]
                    if push < strongest:
                        strongest = wp.float64(push)
                        first = int(j)
            if first >= 0:
                shared[world, held, first] = _ZERO
            else:
                rounds = int(0)  # noqa: UP018, RUF046
    change = wp.float64(0.0)
    for j in range(tendons):
        if drive[world, j] > _ZERO:
            rise = shared[world, shift, j]
            reached[world, j] = wp.max(reached[world, j] + rise, _ZERO)
            for place in range(row_start[j], row_start[j + 1]):
                i = dof[place]
                gain = yielding[world, i] * wp.float64(ten_J[world, entry[place]])
                ahead[world, i] = ahead[world, i] - gain * wp.max(rise, -tension[world, j, span[place]])
            for k in range(ends[j]):
                risen = wp.max(rise, -tension[world, j, k])
                tension[world, j, k] = tension[world, j, k] + risen
                change = wp.max(change, wp.abs(risen))
    return change


@wp.kernel(enable_backward=False)
def know_joints(
    timestep: wp.float64,
    jnt_dofadr: wp.array(dtype=int),
    armature: wp.array(dtype=wp.float64),
    damping: wp.array(dtype=wp.float64),
    jnt_stiffness: wp.array2d(dtype=float),
    yielding: wp.array2d(dtype=wp.float64),
):
    """As `friction.CapstanFriction.know_joints`, one thread for each copy and joint."""
    world, joint = wp.tid()
    i = jnt_dofadr[joint]
    stiffness = wp.float64(jnt_stiffness[world % jnt_stiffness.shape[0], joint])
    yielding[world, i] = timestep / (armature[i] + timestep * (damping[i] + timestep * stiffness))


@wp.kernel(enable_backward=False)
def solve_tensions(
    mu: wp.float64,
    ends: wp.array(dtype=int),
    row_start: wp.array(dtype=int),
    entry: wp.array(dtype=int),
    dof: wp.array(dtype=int),
    span: wp.array(dtype=int),
    sweeps: int,
    tolerance: wp.float64,
    entering: wp.array2d(dtype=wp.float64),
    drive: wp.array2d(dtype=wp.float64),
    turn: wp.array3d(dtype=wp.float64),
    yielding: wp.array2d(dtype=wp.float64),
    ten_J: wp.array2d(dtype=float),
    qvel: wp.array2d(dtype=float),
    passive: wp.array2d(dtype=float),
    bias: wp.array2d(dtype=float),
    constraint: wp.array2d(dtype=float),
    tension: wp.array3d(dtype=wp.float64),
    factor: wp.array3d(dtype=wp.float64),
    response: wp.array3d(dtype=wp.float64),
    rate: wp.array2d(dtype=wp.float64),
    ahead: wp.array2d(dtype=wp.float64),
    old: wp.array2d(dtype=wp.float64),
    knots: wp.array2d(dtype=wp.float64),
    steps: wp.array2d(dtype=wp.float64),
    goal: wp.array2d(dtype=wp.float64),
    reached: wp.array2d(dtype=wp.float64),
    shared: wp.array3d(dtype=wp.float64),
    applied: wp.array2d(dtype=float),
):
    """Update all copies' tensions, and apply what they pull beyond the actuators'; as `solve_tensions` does.

    An axis of m before those of `entering`, `drive`, `turn` and `yielding` there.
    """
    world = wp.tid()
    tendons = ends.shape[0]
    for i in range(qvel.shape[1]):
        force = wp.float64(passive[world, i]) - wp.float64(bias[world, i]) + wp.float64(constraint[world, i])
        force += wp.float64(applied[world, i])
        ahead[world, i] = wp.float64(qvel[world, i]) + yielding[world, i] * force
    largest = wp.float64(0.0)
    for j in range(tendons):
        largest = wp.max(largest, entering[world, j])
        reached[world, j] = wp.max(entering[world, j], _ZERO)
        for k in range(ends[j]):
            factor[world, j, k] = wp.exp(mu * turn[world, j, k])
            response[world, j, k] = _LEAST_RESPONSE
        for place in range(row_start[j], row_start[j + 1]):
            i = dof[place]
            k = span[place]
            arm = wp.float64(ten_J[world, entry[place]])
            response[world, j, k] = response[world, j, k] + yielding[world, i] * arm * arm
            ahead[world, i] = ahead[world, i] - yielding[world, i] * arm * tension[world, j, k]
    driven = _couple_driven(world, drive, row_start, entry, dof, yielding, ten_J, shared)
    sweep = int(0)  # noqa: UP018, RUF046
    while sweep < sweeps:
        change = wp.float64(0.0)
        for j in range(tendons):
            for k in range(ends[j]):
                rate[world, k] = wp.float64(0.0)
                old[world, k] = tension[world, j, k]
            for place in range(row_start[j], row_start[j + 1]):
                k = span[place]
                arm = wp.float64(ten_J[world, entry[place]])
                rate[world, k] = rate[world, k] + arm * ahead[world, dof[place]]
            reached[world, j] = _span_tensions(
                world,
                j,
                ends[j],
                entering[world, j],
                drive[world, j],
                reached[world, j],
                factor,
                response,
                rate,
                knots,
                steps,
                goal,
                tension,
            )
            for k in range(ends[j]):
                old[world, k] = tension[world, j, k] - old[world, k]
                change = wp.max(change, wp.abs(old[world, k]))
            for place in range(row_start[j], row_start[j + 1]):
                i = dof[place]
                arm = wp.float64(ten_J[world, entry[place]])
                ahead[world, i] = ahead[world, i] - yielding[world, i] * arm * old[world, span[place]]
        if driven > 1:
            risen = _raise_together(
                world,
                ends,
                row_start,
                entry,
                dof,
                span,
                entering,
                drive,
                yielding,
                ten_J,
                shared,
                reached,
                tension,
                ahead,
            )
            change = wp.max(change, risen)
        sweep += 1
        if change <= tolerance * largest:
            sweep = sweeps
    for j in range(tendons):
        for place in range(row_start[j], row_start[j + 1]):
            i = dof[place]
            beyond = tension[world, j, span[place]] - reached[world, j]
            applied[world, i] = applied[world, i] - float(wp.float64(ten_J[world, entry[place]]) * beyond)
