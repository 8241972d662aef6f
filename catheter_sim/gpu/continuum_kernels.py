"""A continuum robot's laws as Warp kernels, one thread for each copy and link or tendon."""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import warp as wp

# ----------------------------------------------------------------------------------------------------
# `catheter_sim.robots.continuum.laws` as a Warp kernel, one thread for each copy and link.


@wp.kernel(enable_backward=False)
def resist(
    qpos_x: wp.array(dtype=int),
    dof_x: wp.array(dtype=int),
    qpos_y: wp.array(dtype=int),
    dof_y: wp.array(dtype=int),
    stiffness: wp.array(dtype=wp.float64),
    cubic: wp.array(dtype=wp.float64),
    quintic: wp.array(dtype=wp.float64),
    rest: wp.array(dtype=wp.float64),
    qpos: wp.array2d(dtype=float),
    applied: wp.array2d(dtype=float),
):
    """Take what the hinges lack from `applied`, shape (m, nv); below zero of y means: no such hinge."""
    world, k = wp.tid()
    x = wp.float64(qpos[world, qpos_x[k]]) - rest[qpos_x[k]]
    y = wp.float64(0.0)
    if qpos_y[k] >= 0:
        y = wp.float64(qpos[world, qpos_y[k]]) - rest[qpos_y[k]]
    square = x * x + y * y
    fifth = quintic[k] * square * square
    on_x = stiffness[k] * x * (cubic[k] * y * y + fifth)
    applied[world, dof_x[k]] = applied[world, dof_x[k]] - float(on_x)
    if dof_y[k] >= 0:
        on_y = stiffness[k] * y * (cubic[k] * x * x + fifth)
        applied[world, dof_y[k]] = applied[world, dof_y[k]] - float(on_y)


# ----------------------------------------------------------------------------------------------------
# By how much the tendons of all copies turn at their disks' holes, as Warp kernels, in double precision.


@wp.kernel(enable_backward=False)
def planar_turns(
    qpos: wp.array2d(dtype=float), joints: wp.array(dtype=int), turn: wp.array3d(dtype=wp.float64)
):
    """As `turns_kernel.planar_turns`, one thread for each copy."""
    world = wp.tid()
    before = wp.float64(0.0)
    for k in range(joints.shape[0]):
        angle = wp.float64(qpos[world, joints[k]])
        for j in range(turn.shape[1]):
            turn[world, j, k] = wp.abs(wp.float64(0.5) * (before + angle))
        before = angle


@wp.kernel(enable_backward=False)
def spatial_turns(
    site_xpos: wp.array2d(dtype=wp.vec3),
    sites: wp.array2d(dtype=int),
    ends: wp.array(dtype=int),
    turn: wp.array3d(dtype=wp.float64),
):
    """As `turns_kernel.spatial_turns`, one thread for each copy and tendon."""
    world, tendon = wp.tid()
    before = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(1.0))
    for k in range(ends[tendon]):
        after = wp.vec3d(site_xpos[world, sites[tendon, k + 1]]) - wp.vec3d(
            site_xpos[world, sites[tendon, k]]
        )
        turn[world, tendon, k] = wp.atan2(wp.length(wp.cross(before, after)), wp.dot(before, after))
        before = after
