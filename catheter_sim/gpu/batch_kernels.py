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

    `unlimited`: largest force of a tendon that was taut (`mechanics.hysteresis.clamp_of_slack`). In and out:
    the controls of the step before (m, k). Out: `forcerange`; tensions, below zero where slack (m, k) [N];
    what they grow by per unit of the rate of lengthening in a step (m, k) [N s/m].
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


@wp.struct
class TendonsOnDevice:
    """As `mechanics.capstan.Tendons`, without `lines`."""

    ends: wp.array(dtype=int)
    row_start: wp.array(dtype=int)
    entry: wp.array(dtype=int)
    dof: wp.array(dtype=int)
    span: wp.array(dtype=int)


@wp.struct
class RoomOnDevice:
    """Workspace of m copies."""

    factor: wp.array3d(dtype=wp.float64)  # (m, t, n), as the next
    response: wp.array3d(dtype=wp.float64)
    rate: wp.array2d(dtype=wp.float64)  # (m, n)
    ahead: wp.array2d(dtype=wp.float64)  # (m, nv)
    old: wp.array2d(dtype=wp.float64)  # (m, n)
    knots: wp.array2d(dtype=wp.float64)  # (m, 2 n), as the next
    steps: wp.array2d(dtype=wp.float64)
    goal: wp.array2d(dtype=wp.float64)  # (m, n)
    reached: wp.array2d(dtype=wp.float64)  # (m, t)
    shared: wp.array3d(dtype=wp.float64)  # (m, 2 t + 4 + nv, t)


@wp.struct
class MotionOnDevice:
    """MuJoCo Warp's slopes of tendons, velocities and generalised forces of all copies."""

    ten_J: wp.array2d(dtype=float)
    qvel: wp.array2d(dtype=float)
    passive: wp.array2d(dtype=float)
    bias: wp.array2d(dtype=float)
    constraint: wp.array2d(dtype=float)


@wp.func
def _span_tensions(
    world: int,
    tendon: int,
    count: int,
    entering: wp.float64,
    drive: wp.float64,
    drawn: wp.float64,
    room: RoomOnDevice,
    tension: wp.array3d(dtype=wp.float64),
):
    """Update one tendon's tensions and return the actuator's, as `mechanics.capstan.span_tensions` does."""
    width = room.knots.shape[1]
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
            slope = room.response[world, tendon, span]
            offset = -(slope * tension[world, tendon, span] + room.rate[world, span])
        else:
            slope = wp.float64(1.0) / drive
            offset = -entering / drive
        while left > 0:
            knot = room.knots[world, left - 1] + left_shift
            if slope * knot + offset <= _ZERO:
                break
            left -= 1
            right -= 1
            step = room.steps[world, left]
            slope += step
            offset -= step * knot
            room.knots[world, right] = knot - right_shift
            room.steps[world, right] = -step
        while right < width:
            knot = room.knots[world, right] + right_shift
            if slope * knot + offset >= _ZERO:
                break
            step = room.steps[world, right]
            slope += step
            offset -= step * knot
            room.knots[world, left] = knot - left_shift
            room.steps[world, left] = -step
            left += 1
            right += 1
        wish = -offset / slope
        if span < 0:
            reached = wish
        else:
            room.goal[world, span] = wish
            right -= 1
            room.knots[world, left] = wish - left_shift
            room.steps[world, left] = slope
            room.knots[world, right] = wish - right_shift
            room.steps[world, right] = slope
            left += 1
            before = wp.float64(drawn)
            if span > 0:
                before = tension[world, tendon, span - 1]
            left_shift -= before * room.factor[world, tendon, span] - before
            right_shift -= before / room.factor[world, tendon, span] - before
    reached = wp.max(reached, _ZERO)
    below = wp.float64(reached)
    for k in range(count):
        held = room.factor[world, tendon, k]
        below = wp.min(wp.max(room.goal[world, k], below / held), below * held)
        tension[world, tendon, k] = below
    return reached


@wp.func
def _couple_driven(
    world: int,
    tendons: TendonsOnDevice,
    room: RoomOnDevice,
    drive: wp.array2d(dtype=wp.float64),
    yielding: wp.array2d(dtype=wp.float64),
    ten_J: wp.array2d(dtype=float),
):
    """As `mechanics.capstan.couple_driven`."""
    count = drive.shape[1]
    first = 2 * count + 4
    driven = int(0)  # noqa: UP018, RUF046 - a literal would be a constant to Warp
    for j in range(count):
        if drive[world, j] > _ZERO:
            driven += 1
    if driven > 1:
        for i in range(yielding.shape[1]):
            for j in range(count):
                room.shared[world, first + i, j] = _ZERO
        for j in range(count):
            if drive[world, j] > _ZERO:
                for place in range(tendons.row_start[j], tendons.row_start[j + 1]):
                    row = first + tendons.dof[place]
                    room.shared[world, row, j] = room.shared[world, row, j] + wp.float64(
                        ten_J[world, tendons.entry[place]]
                    )
        for j in range(count):
            if drive[world, j] > _ZERO:
                for other in range(count):
                    room.shared[world, j, other] = _ZERO
                for place in range(tendons.row_start[j], tendons.row_start[j + 1]):
                    i = tendons.dof[place]
                    gain = yielding[world, i] * wp.float64(ten_J[world, tendons.entry[place]])
                    for other in range(count):
                        room.shared[world, j, other] = (
                            room.shared[world, j, other] + gain * room.shared[world, first + i, other]
                        )
                room.shared[world, j, j] = room.shared[world, j, j] + wp.float64(1.0) / drive[world, j]
    return driven


@wp.func
def _raise_together(
    world: int,
    tendons: TendonsOnDevice,
    room: RoomOnDevice,
    entering: wp.array2d(dtype=wp.float64),
    drive: wp.array2d(dtype=wp.float64),
    yielding: wp.array2d(dtype=wp.float64),
    ten_J: wp.array2d(dtype=float),
    tension: wp.array3d(dtype=wp.float64),
):
    """As `mechanics.capstan.raise_together`."""
    count = drive.shape[1]
    slope = 2 * count
    goal = slope + 1
    shift = slope + 2
    held = slope + 3
    for j in range(count):
        room.shared[world, slope, j] = _ZERO
        room.shared[world, shift, j] = _ZERO
        room.shared[world, held, j] = wp.float64(1.0)
        if drive[world, j] > _ZERO:
            room.shared[world, held, j] = _ZERO
            fall = (room.reached[world, j] - entering[world, j]) / drive[world, j]
            for place in range(tendons.row_start[j], tendons.row_start[j + 1]):
                fall -= wp.float64(ten_J[world, tendons.entry[place]]) * room.ahead[world, tendons.dof[place]]
            room.shared[world, slope, j] = fall
    rounds = int(4 * count)
    while rounds > 0:
        rounds -= 1
        for j in range(count):
            free = room.shared[world, held, j] == _ZERO
            for other in range(count):
                value = wp.float64(0.0)
                if free and drive[world, other] > _ZERO:
                    value = room.shared[world, j, other]
                room.shared[world, count + j, other] = value
            room.shared[world, goal, j] = -room.shared[world, slope, j]
            if not free:
                room.shared[world, count + j, j] = wp.float64(1.0)
                room.shared[world, goal, j] = room.shared[world, shift, j]
        for j in range(count):
            for below in range(j + 1, count):
                ratio = room.shared[world, count + below, j] / room.shared[world, count + j, j]
                for other in range(j + 1, count):
                    room.shared[world, count + below, other] = (
                        room.shared[world, count + below, other]
                        - ratio * room.shared[world, count + j, other]
                    )
                room.shared[world, goal, below] = (
                    room.shared[world, goal, below] - ratio * room.shared[world, goal, j]
                )
        for back in range(count):
            j = count - 1 - back
            found = wp.float64(room.shared[world, goal, j])
            for other in range(j + 1, count):
                found -= room.shared[world, count + j, other] * room.shared[world, goal, other]
            room.shared[world, goal, j] = found / room.shared[world, count + j, j]
        part = wp.float64(1.0)
        first = int(-1)  # noqa: UP018, RUF046
        for j in range(count):
            if room.shared[world, held, j] == _ZERO and room.shared[world, goal, j] < -room.reached[world, j]:
                way = room.shared[world, goal, j] - room.shared[world, shift, j]
                share = (-room.reached[world, j] - room.shared[world, shift, j]) / way
                if share < part or first < 0:
                    part = wp.float64(share)
                    first = int(j)
        for j in range(count):
            way = room.shared[world, goal, j] - room.shared[world, shift, j]
            room.shared[world, shift, j] = room.shared[world, shift, j] + part * way
        if first >= 0:
            room.shared[world, shift, first] = -room.reached[world, first]
            room.shared[world, held, first] = wp.float64(1.0)
        else:
            strongest = wp.float64(0.0)
            for j in range(count):
                if drive[world, j] > _ZERO and room.shared[world, held, j] > _ZERO:
                    push = wp.float64(room.shared[world, slope, j])
                    for other in range(count):
                        if drive[world, other] > _ZERO:
                            push += room.shared[world, j, other] * room.shared[world, shift, other]
                    if push < strongest:
                        strongest = wp.float64(push)
                        first = int(j)
            if first >= 0:
                room.shared[world, held, first] = _ZERO
            else:
                rounds = int(0)  # noqa: UP018, RUF046
    change = wp.float64(0.0)
    for j in range(count):
        if drive[world, j] > _ZERO:
            rise = room.shared[world, shift, j]
            room.reached[world, j] = wp.max(room.reached[world, j] + rise, _ZERO)
            for place in range(tendons.row_start[j], tendons.row_start[j + 1]):
                i = tendons.dof[place]
                gain = yielding[world, i] * wp.float64(ten_J[world, tendons.entry[place]])
                room.ahead[world, i] = room.ahead[world, i] - gain * wp.max(
                    rise, -tension[world, j, tendons.span[place]]
                )
            for k in range(tendons.ends[j]):
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
    sweeps: int,
    tolerance: wp.float64,
    tendons: TendonsOnDevice,
    room: RoomOnDevice,
    motion: MotionOnDevice,
    entering: wp.array2d(dtype=wp.float64),
    drive: wp.array2d(dtype=wp.float64),
    turn: wp.array3d(dtype=wp.float64),
    yielding: wp.array2d(dtype=wp.float64),
    tension: wp.array3d(dtype=wp.float64),
    applied: wp.array2d(dtype=float),
):
    """Update all copies' tensions, and apply what they pull beyond the actuators'; as `solve_tensions` does.

    An axis of m before those of `entering`, `drive`, `turn` and `yielding` there.
    """
    world = wp.tid()
    count = tendons.ends.shape[0]
    for i in range(motion.qvel.shape[1]):
        force = (
            wp.float64(motion.passive[world, i])
            - wp.float64(motion.bias[world, i])
            + wp.float64(motion.constraint[world, i])
        )
        force += wp.float64(applied[world, i])
        room.ahead[world, i] = wp.float64(motion.qvel[world, i]) + yielding[world, i] * force
    largest = wp.float64(0.0)
    for j in range(count):
        largest = wp.max(largest, entering[world, j])
        room.reached[world, j] = wp.max(entering[world, j], _ZERO)
        for k in range(tendons.ends[j]):
            room.factor[world, j, k] = wp.exp(mu * turn[world, j, k])
            room.response[world, j, k] = _LEAST_RESPONSE
        for place in range(tendons.row_start[j], tendons.row_start[j + 1]):
            i = tendons.dof[place]
            k = tendons.span[place]
            arm = wp.float64(motion.ten_J[world, tendons.entry[place]])
            room.response[world, j, k] = room.response[world, j, k] + yielding[world, i] * arm * arm
            room.ahead[world, i] = room.ahead[world, i] - yielding[world, i] * arm * tension[world, j, k]
    driven = _couple_driven(world, tendons, room, drive, yielding, motion.ten_J)
    sweep = int(0)  # noqa: UP018, RUF046
    while sweep < sweeps:
        change = wp.float64(0.0)
        for j in range(count):
            for k in range(tendons.ends[j]):
                room.rate[world, k] = wp.float64(0.0)
                room.old[world, k] = tension[world, j, k]
            for place in range(tendons.row_start[j], tendons.row_start[j + 1]):
                k = tendons.span[place]
                arm = wp.float64(motion.ten_J[world, tendons.entry[place]])
                room.rate[world, k] = room.rate[world, k] + arm * room.ahead[world, tendons.dof[place]]
            drawn = room.reached[world, j]
            room.reached[world, j] = _span_tensions(
                world, j, tendons.ends[j], entering[world, j], drive[world, j], drawn, room, tension
            )
            for k in range(tendons.ends[j]):
                room.old[world, k] = tension[world, j, k] - room.old[world, k]
                change = wp.max(change, wp.abs(room.old[world, k]))
            for place in range(tendons.row_start[j], tendons.row_start[j + 1]):
                i = tendons.dof[place]
                arm = wp.float64(motion.ten_J[world, tendons.entry[place]])
                room.ahead[world, i] = (
                    room.ahead[world, i] - yielding[world, i] * arm * room.old[world, tendons.span[place]]
                )
        if driven > 1:
            risen = _raise_together(world, tendons, room, entering, drive, yielding, motion.ten_J, tension)
            change = wp.max(change, risen)
        sweep += 1
        if change <= tolerance * largest:
            sweep = sweeps
    for j in range(count):
        for place in range(tendons.row_start[j], tendons.row_start[j + 1]):
            i = tendons.dof[place]
            beyond = tension[world, j, tendons.span[place]] - room.reached[world, j]
            applied[world, i] = applied[world, i] - float(
                wp.float64(motion.ten_J[world, tendons.entry[place]]) * beyond
            )
