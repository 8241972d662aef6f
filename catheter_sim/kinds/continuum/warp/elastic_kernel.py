"""`catheter_sim.kinds.continuum.forces.elastic_law` as a Warp kernel, one thread for each copy and link."""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import warp as wp


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
