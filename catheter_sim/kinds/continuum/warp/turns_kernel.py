"""By how much the tendons of all copies turn at their disks' holes, as Warp kernels, in double precision."""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import warp as wp


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
