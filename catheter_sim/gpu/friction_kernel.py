"""The capstan law of `catheter_sim.simulation.capstan` as a Warp kernel, one thread for each copy.

The numbers are those of `capstan.confine` in double precision; what MuJoCo Warp hands over is single. It
starts from the last step's tensions always, not from `capstan.foresee`'s.
"""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import warp as wp

_LEAST_RESPONSE = wp.constant(wp.float64(1e-12))  # as `capstan.LEAST_RESPONSE`


@wp.func
def _turn(
    world: int,
    tendon: int,
    k: int,
    planar: bool,
    joints: wp.array(dtype=int),
    sites: wp.array2d(dtype=int),
    qpos: wp.array2d(dtype=float),
    site_xpos: wp.array2d(dtype=wp.vec3),
) -> wp.float64:
    """Return the turn of a tendon at hole k [rad], as `capstan.planar_turns` and `spatial_turns` do."""
    if planar:
        angle = wp.float64(qpos[world, joints[k]])
        if k > 0:
            angle += wp.float64(qpos[world, joints[k - 1]])
        return wp.abs(wp.float64(0.5) * angle)
    before = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(1.0))
    here = wp.vec3d(site_xpos[world, sites[tendon, k]])
    if k > 0:
        before = here - wp.vec3d(site_xpos[world, sites[tendon, k - 1]])
    after = wp.vec3d(site_xpos[world, sites[tendon, k + 1]]) - here
    return wp.atan2(wp.length(wp.cross(before, after)), wp.dot(before, after))


@wp.func
def _span_tensions(
    world: int,
    tendon: int,
    count: int,
    entering: wp.float64,
    factor: wp.array3d(dtype=wp.float64),
    response: wp.array3d(dtype=wp.float64),
    rate: wp.array2d(dtype=wp.float64),
    knots: wp.array2d(dtype=wp.float64),
    steps: wp.array2d(dtype=wp.float64),
    goal: wp.array2d(dtype=wp.float64),
    tension: wp.array3d(dtype=wp.float64),
):
    """As `capstan.span_tensions` where the tension is given."""
    width = knots.shape[1]
    left = int(0)  # noqa: UP018, RUF046 - a literal would be a constant to Warp
    right = int(width)
    left_shift = wp.float64(0.0)
    right_shift = wp.float64(0.0)
    for k in range(count):
        span = count - 1 - k
        slope = response[world, tendon, span]
        offset = -(slope * tension[world, tendon, span] + rate[world, span])
        while left > 0:
            knot = knots[world, left - 1] + left_shift
            if slope * knot + offset <= wp.float64(0.0):
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
            if slope * knot + offset >= wp.float64(0.0):
                break
            step = steps[world, right]
            slope += step
            offset -= step * knot
            knots[world, left] = knot - left_shift
            steps[world, left] = -step
            left += 1
            right += 1
        wish = -offset / slope
        goal[world, span] = wish
        right -= 1
        knots[world, left] = wish - left_shift
        steps[world, left] = slope
        knots[world, right] = wish - right_shift
        steps[world, right] = slope
        left += 1
        before = entering
        if span > 0:
            before = tension[world, tendon, span - 1]
        left_shift -= before * factor[world, tendon, span] - before
        right_shift -= before / factor[world, tendon, span] - before
    below = entering
    for k in range(count):
        held = factor[world, tendon, k]
        below = wp.min(wp.max(goal[world, k], below / held), below * held)
        tension[world, tendon, k] = below


@wp.kernel(enable_backward=False)
def confine(
    mu: wp.float64,
    planar: bool,
    joints: wp.array(dtype=int),
    sites: wp.array2d(dtype=int),
    ends: wp.array(dtype=int),
    row_start: wp.array(dtype=int),
    entry: wp.array(dtype=int),
    dof: wp.array(dtype=int),
    span: wp.array(dtype=int),
    yielding: wp.array(dtype=wp.float64),
    sweeps: int,
    tolerance: wp.float64,
    ctrl: wp.array2d(dtype=float),
    qpos: wp.array2d(dtype=float),
    site_xpos: wp.array2d(dtype=wp.vec3),
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
    applied: wp.array2d(dtype=float),
):
    """Update all copies' tensions, and apply what they pull beyond the actuators'; see `capstan.confine`.

    `applied` is overwritten: nothing else may apply generalised forces.
    """
    world = wp.tid()
    tendons = ends.shape[0]
    for i in range(qvel.shape[1]):
        force = wp.float64(passive[world, i]) - wp.float64(bias[world, i]) + wp.float64(constraint[world, i])
        ahead[world, i] = wp.float64(qvel[world, i]) + yielding[i] * force
        applied[world, i] = 0.0
    largest = wp.float64(0.0)
    for j in range(tendons):
        largest = wp.max(largest, wp.float64(ctrl[world, j]))
        for k in range(ends[j]):
            turn = _turn(world, j, k, planar, joints, sites, qpos, site_xpos)
            factor[world, j, k] = wp.exp(mu * turn)
            response[world, j, k] = _LEAST_RESPONSE
        for place in range(row_start[j], row_start[j + 1]):
            i = dof[place]
            k = span[place]
            arm = wp.float64(ten_J[world, entry[place]])
            response[world, j, k] = response[world, j, k] + yielding[i] * arm * arm
            ahead[world, i] = ahead[world, i] - yielding[i] * arm * tension[world, j, k]
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
            entering = wp.max(wp.float64(ctrl[world, j]), wp.float64(0.0))
            _span_tensions(
                world, j, ends[j], entering, factor, response, rate, knots, steps, goal, tension
            )  # fmt: skip
            for k in range(ends[j]):
                old[world, k] = tension[world, j, k] - old[world, k]
                change = wp.max(change, wp.abs(old[world, k]))
            for place in range(row_start[j], row_start[j + 1]):
                i = dof[place]
                arm = wp.float64(ten_J[world, entry[place]])
                ahead[world, i] = ahead[world, i] - yielding[i] * arm * old[world, span[place]]
        sweep += 1
        if change <= tolerance * largest:
            sweep = sweeps
    for j in range(tendons):
        entering = wp.max(wp.float64(ctrl[world, j]), wp.float64(0.0))
        for place in range(row_start[j], row_start[j + 1]):
            i = dof[place]
            beyond = tension[world, j, span[place]] - entering
            applied[world, i] = applied[world, i] - float(wp.float64(ten_J[world, entry[place]]) * beyond)
