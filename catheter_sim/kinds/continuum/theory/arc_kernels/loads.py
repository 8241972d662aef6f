"""The generalised loads of a robot of arcs, compiled.

The generalised load of segment s follows from what its end carries, force F and moment M, and from the
weights on it: with its end at q(b) and turned by R(b) in the frame of its start, component a of it is

    F . dq/db_a + M . w_a + sum over disks of weight . dq_k/db_a,    hat(w_a) = dR/db_a R^T.
"""

from __future__ import annotations

from catheter_sim.mechanics.arc_turns import arc_series, turn_by_arc
from catheter_sim.mechanics.compiled import compiled


@compiled
def _along_arc(bend_x, bend_y, length, lead, share, force):
    """Return where a point at `share` of an arc is, (3,), and its work on `force` by the bend, (2,).

    The arc begins after a straight `lead`, and the point lies as far before its place on it.
    """
    x, y, reach = share * bend_x, share * bend_y, share * length
    sine, versine, sine_slope, versine_slope, _ = arc_series(x * x + y * y)
    along = 2.0 * (versine_slope * (x * force[0] + y * force[1]) + sine_slope * force[2])
    if lead != 0.0:
        u = x * x + y * y
        turned = 2.0 * (sine_slope * (x * force[0] + y * force[1]) - (versine + u * versine_slope) * force[2])
        return (
            (reach * versine - lead * sine) * x,
            (reach * versine - lead * sine) * y,
            reach * sine + lead * versine * u,
            share * (reach * (versine * force[0] + along * x) - lead * (sine * force[0] + turned * x)),
            share * (reach * (versine * force[1] + along * y) - lead * (sine * force[1] + turned * y)),
        )
    return (
        reach * versine * x,
        reach * versine * y,
        reach * sine,
        share * reach * (versine * force[0] + along * x),
        share * reach * (versine * force[1] + along * y),
    )


@compiled
def find_generalised_load(bend, length, lead, count, weight, tip_force, tip_moment, frames, out):
    """Set `out` (2S,) to the power of the loads per rate of each bend component [N m].

    Args: bend (2S,); length, lead (S,); count (S,) disks; weight (S, 4) of each disk, and how far before the
    disk it acts, of a subsegment; tip_force, tip_moment (3,); frames (S + 1, 3, 3) working space.
    """
    segments = len(length)
    for i in range(3):
        for j in range(3):
            frames[0, i, j] = 1.0 if i == j else 0.0
    for s in range(segments):
        x, y = bend[2 * s], bend[2 * s + 1]
        sine, versine, _, _, _ = arc_series(x * x + y * y)
        turn_by_arc(x, y, sine, versine, frames[s], frames[s + 1])
    fx, fy, fz = tip_force
    mx, my, mz = tip_moment
    for s in range(segments - 1, -1, -1):
        x, y = bend[2 * s], bend[2 * s + 1]
        R = frames[s]
        force = (
            R[0, 0] * fx + R[1, 0] * fy + R[2, 0] * fz,
            R[0, 1] * fx + R[1, 1] * fy + R[2, 1] * fz,
            R[0, 2] * fx + R[1, 2] * fy + R[2, 2] * fz,
        )
        m0 = R[0, 0] * mx + R[1, 0] * my + R[2, 0] * mz
        m1 = R[0, 1] * mx + R[1, 1] * my + R[2, 1] * mz
        m2 = R[0, 2] * mx + R[1, 2] * my + R[2, 2] * mz
        px, py, pz, qx, qy = _along_arc(x, y, length[s], lead[s], 1.0, force)
        # The end turns by w_a = J e_a, J = 1 + versine [r] + third [r]^2, r = (-y, x, 0).
        _, versine, _, _, third = arc_series(x * x + y * y)
        qx += m1 * (1.0 - third * y * y) - third * x * y * m0 - versine * y * m2
        qy += third * x * y * m1 - m0 * (1.0 - third * x * x) + versine * x * m2
        # what the start of the segment carries, in its frame
        m0 += py * force[2] - pz * force[1]
        m1 += pz * force[0] - px * force[2]
        m2 += px * force[1] - py * force[0]
        wx, wy, wz = weight[s, 0], weight[s, 1], weight[s, 2]
        if wx != 0.0 or wy != 0.0 or wz != 0.0:
            own = (
                R[0, 0] * wx + R[1, 0] * wy + R[2, 0] * wz,
                R[0, 1] * wx + R[1, 1] * wy + R[2, 1] * wz,
                R[0, 2] * wx + R[1, 2] * wy + R[2, 2] * wz,
            )
            for disk in range(count[s]):
                place = (disk + 1.0 - weight[s, 3]) / count[s]
                back = lead[s] if weight[s, 3] == 0.0 else 0.0  # a disk; the rest stands on the arc
                px, py, pz, dx, dy = _along_arc(x, y, length[s], back, place, own)
                pz += lead[s] - back
                qx += dx
                qy += dy
                m0 += py * own[2] - pz * own[1]
                m1 += pz * own[0] - px * own[2]
                m2 += px * own[1] - py * own[0]
            fx, fy, fz = fx + count[s] * wx, fy + count[s] * wy, fz + count[s] * wz
        mx = R[0, 0] * m0 + R[0, 1] * m1 + R[0, 2] * m2
        my = R[1, 0] * m0 + R[1, 1] * m1 + R[1, 2] * m2
        mz = R[2, 0] * m0 + R[2, 1] * m1 + R[2, 2] * m2
        out[2 * s], out[2 * s + 1] = qx, qy


@compiled
def acts(tip_force, tip_moment, weight):
    """Return whether anything acts: tip force and moment (3,), weights (S, 4)."""
    for i in range(3):
        if tip_force[i] != 0.0 or tip_moment[i] != 0.0:
            return True
        for s in range(weight.shape[0]):
            if weight[s, i] != 0.0:
                return True
    return False
