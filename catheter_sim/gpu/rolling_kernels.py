"""The laws of a robot of rolling joints as Warp kernels, one thread for each copy."""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import warp as wp

from catheter_sim.robots.rolling import laws as columns

# ----------------------------------------------------------------------------------------------------
# The loops of `catheter_sim.robots.rolling.laws` as Warp kernels, one thread for each copy.
#
# The numbers are theirs in double precision; what MuJoCo Warp hands over and takes is single.


_RADIUS_POSITIVE = wp.constant(columns.RADIUS_POSITIVE)
_RADIUS_NEGATIVE = wp.constant(columns.RADIUS_NEGATIVE)
_LINE = wp.constant(columns.LINE)
_LENGTH = wp.constant(columns.LENGTH)
_REST = wp.constant(columns.REST)
_SLEEVE = wp.constant(columns.SLEEVE)
_CUBIC = wp.constant(columns.CUBIC)
_QUINTIC = wp.constant(columns.QUINTIC)
_LOW = wp.constant(columns.LOW)
_HIGH = wp.constant(columns.HIGH)
_STIFFNESS = wp.constant(columns.STIFFNESS)
_REST_CURVATURE = wp.constant(columns.REST_CURVATURE)
_OFFSET = wp.constant(columns.OFFSET)
_MOUTH = wp.constant(columns.MOUTH)
_SINK = wp.constant(columns.SINK)
_CLEARANCE = wp.constant(columns.CLEARANCE)
_ZERO = wp.constant(wp.float64(0.0))
_ONE = wp.constant(wp.float64(1.0))


@wp.func
def _radius(joint: wp.array2d(dtype=wp.float64), k: int, theta: wp.float64) -> wp.float64:
    """Return the radius of the arc of the side that joint k leans to [m]."""
    if theta >= _ZERO:
        return joint[k, _RADIUS_POSITIVE]
    return joint[k, _RADIUS_NEGATIVE]


@wp.kernel(enable_backward=False)
def place(
    qpos: wp.array2d(dtype=float),
    qpos_index: wp.array(dtype=int),
    joint: wp.array2d(dtype=wp.float64),
    axis: wp.array(dtype=int),
    length: wp.array2d(dtype=wp.float64),
    joint_index: wp.array(dtype=int),
    body_index: wp.array(dtype=int),
    jnt_pos: wp.array2d(dtype=wp.vec3),
    body_pos: wp.array2d(dtype=wp.vec3),
):
    """Move hinges and links to where pure rolling has them."""
    world = wp.tid()
    face = wp.float64(0.0)
    for k in range(joint.shape[0]):
        theta = wp.float64(qpos[world, qpos_index[k]])
        radius = _radius(joint, k, theta)
        sine = wp.sin(theta)
        rise = radius * (_ONE - wp.cos(theta))
        hinge = jnt_pos[world, joint_index[k]]
        hinge[axis[k]] = float(joint[k, _LINE] + radius * sine)
        hinge[2] = float(rise)
        jnt_pos[world, joint_index[k]] = hinge
        link = body_pos[world, body_index[k]]
        link[axis[k]] = float(radius * (theta - sine))
        link[2] = float(face - rise)
        body_pos[world, body_index[k]] = link
        face = length[world, k]


@wp.kernel(enable_backward=False)
def resist(
    qpos: wp.array2d(dtype=float),
    qpos_index: wp.array(dtype=int),
    joint: wp.array2d(dtype=wp.float64),
    rod: wp.array3d(dtype=wp.float64),
    dof_index: wp.array(dtype=int),
    torque: wp.array2d(dtype=float),
):
    """Take the moments with which rods and sleeve resist bending from `torque`, shape (m, nv) [N m]."""
    world, k = wp.tid()
    low = joint[k, _LOW]
    theta = wp.min(wp.max(wp.float64(qpos[world, qpos_index[k]]), low), joint[k, _HIGH])
    radius = _radius(joint, k, theta)
    sine = wp.sin(theta)
    cosine = wp.cos(theta)
    rise = radius * (_ONE - cosine)
    moment = wp.float64(0.0)
    for j in range(rod.shape[1]):
        if rod[k, j, _STIFFNESS] != _ZERO:
            height = rise - rod[k, j, _OFFSET] * sine + rod[k, j, _MOUTH] * cosine + rod[k, j, _SINK]
            moment += rod[k, j, _STIFFNESS] * (sine / height - rod[k, j, _REST_CURVATURE])
    mean = (theta - joint[k, _REST]) / joint[k, _LENGTH]
    square = mean * mean
    moment *= _ONE + square * (joint[k, _CUBIC] + square * joint[k, _QUINTIC])
    i = dof_index[k]
    torque[world, i] = torque[world, i] - float(moment + joint[k, _SLEEVE] * (theta - joint[k, _REST]))


@wp.kernel(enable_backward=False)
def turns_of_copies(
    qpos: wp.array2d(dtype=float),
    qpos_index: wp.array(dtype=int),
    joint: wp.array2d(dtype=wp.float64),
    rod: wp.array3d(dtype=wp.float64),
    ends: wp.array(dtype=int),
    turn: wp.array3d(dtype=wp.float64),
):
    """Write the turn of each pulled rod before each gap into `turn`, shape (m, t, n) [rad]."""
    world, k = wp.tid()
    theta = wp.float64(qpos[world, qpos_index[k]])
    radius = _radius(joint, k, theta)
    sine = wp.sin(theta)
    cosine = wp.cos(theta)
    rise = radius * (_ONE - cosine)
    below = joint[0, _LENGTH]
    if k > 0:
        below = joint[k - 1, _LENGTH]
    for j in range(turn.shape[1]):
        if k + 1 < ends[j]:
            offset = rod[k, j, _OFFSET]
            clearance = rod[k, j, _CLEARANCE]
            reach = offset + clearance - radius * theta
            x3 = radius * sine + reach * cosine + below * sine
            z3 = rise + reach * sine - below * cosine
            x1 = offset + clearance - x3
            z1 = joint[k, _LENGTH] - rod[k, j, _SINK] - z3
            x2 = offset - clearance - x3
            z2 = rod[k, j, _MOUTH] - z3
            angle = wp.abs(wp.atan2(x1 * z2 - z1 * x2, x1 * x2 + z1 * z2))
            turn[world, j, k + 1] = wp.float64(2.0) * angle


@wp.struct
class LinksOnDevice:
    """As the arguments of `robots.rolling.laws.compress` and `place_tops` that do not change."""

    ends: wp.array(dtype=int)
    body_index: wp.array(dtype=int)
    free_length: wp.array(dtype=wp.float64)
    compliance: wp.array(dtype=wp.float64)
    top_link: wp.array(dtype=int)
    top_depth: wp.array(dtype=wp.float64)
    top_site: wp.array(dtype=int)


@wp.kernel(enable_backward=False)
def compress(
    link: LinksOnDevice,
    tension: wp.array3d(dtype=wp.float64),
    gravity: wp.array(dtype=wp.vec3),
    body_mass: wp.array2d(dtype=float),
    xmat: wp.array2d(dtype=wp.mat33),
    length: wp.array2d(dtype=wp.float64),
    site_pos: wp.array2d(dtype=wp.vec3),
):
    """Write the links' lengths under tensions and weight, shape (m, n) [m], and move what is at their tops.

    Args: as of `compress` and `place_tops` there, without forces on links; `tension` has shape (m, t, n).
    """
    world = wp.tid()
    pull = wp.vec3d(gravity[world % gravity.shape[0]])
    beyond = wp.float64(0.0)  # mass of this link and those beyond it
    links = link.free_length.shape[0]
    for place in range(links):
        k = links - 1 - place
        body = link.body_index[k]
        beyond += wp.float64(body_mass[world % body_mass.shape[0], body])
        turned = xmat[world, body]
        along = wp.vec3d(wp.float64(turned[0, 2]), wp.float64(turned[1, 2]), wp.float64(turned[2, 2]))
        inside = -beyond * wp.dot(pull, along)
        for j in range(tension.shape[1]):
            if k < link.ends[j]:
                above = tension[world, j, k]
                if k + 1 < link.ends[j]:
                    above = tension[world, j, k + 1]
                inside += wp.float64(0.5) * (tension[world, j, k] + above)
        length[world, k] = link.free_length[k] - inside * link.compliance[k]
    for i in range(link.top_site.shape[0]):
        site = site_pos[world, link.top_site[i]]
        site[2] = float(length[world, link.top_link[i]] - link.top_depth[i])
        site_pos[world, link.top_site[i]] = site


@wp.kernel(enable_backward=False)
def pull_evenly(entering: wp.array2d(dtype=wp.float64), tension: wp.array3d(dtype=wp.float64)):
    """Write the tensions without friction into `tension`, one thread for each copy, rod and gap [N]."""
    world, j, k = wp.tid()
    tension[world, j, k] = wp.max(entering[world, j], _ZERO)
