"""What acts beyond each notch, and what it makes of one notch's bend in another's balance."""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.kinds.notched_tube.theory.kernels.columns import UNCUT
from catheter_sim.mechanics.compiled import compiled_in_place
from catheter_sim.mechanics.vectors import cross3, dot3


@compiled_in_place
def loads_beyond(notch: Array, weight: Array, force: Array, moment: Array, work: tuple[Array, ...]) -> bool:
    """Fill force, moment about the centroid line's upper end, and arms times forces, of all beyond a notch.

    `weight`, `force` and `moment`, shape (n, 3), act on the elements: in the middle of the uncut piece, and
    on the distal face. Returned is whether there are any.
    """
    R, top, face = work[:3]
    pull, torque, tensor = work[12:15]
    small, sums = work[20], work[21]
    arm, product, total, about = small[0], small[1], small[2], small[3]
    total[:] = 0.0
    about[:] = 0.0
    sums[:, :] = 0.0
    loaded = False
    for i in range(notch.shape[0] - 1, -1, -1):
        for part in range(2):
            acting = force[i] if part == 0 else weight[i]
            if acting[0] == 0.0 and acting[1] == 0.0 and acting[2] == 0.0:
                continue
            loaded = True
            back = 0.5 * notch[i, UNCUT] * part
            for k in range(3):
                arm[k] = face[i, k] - back * R[i + 1, k, 2]
            cross3(arm, acting, product)
            for k in range(3):
                total[k] += acting[k]
                about[k] += product[k]
                for j in range(3):
                    sums[k, j] += arm[k] * acting[j]
        for k in range(3):
            loaded = loaded or moment[i, k] != 0.0
            about[k] += moment[i, k]
        cross3(top[i], total, product)
        for k in range(3):
            pull[i, k] = total[k]
            torque[i, k] = about[k] - product[k]
            for j in range(3):
                tensor[i, k, j] = sums[k, j] - top[i, k] * total[j]
    return loaded


@compiled_in_place
def swung_moment(tensor: Array, turn: Array, out: Array) -> None:
    """Fill the change of the moment of forces where their arms turn; `tensor`: arms times forces."""
    trace = tensor[0, 0] + tensor[1, 1] + tensor[2, 2]
    for k in range(3):
        out[k] = dot3(tensor[k], turn) - trace * turn[k]


@compiled_in_place
def couple(axes: int, n: int, jacobian: Array, work: tuple[Array, ...]) -> None:
    """Add to the Jacobian what loads make of one notch's bend in another's balance."""
    pull, torque, tensor, moves, turns = work[12:17]
    product, change = work[20][4], work[20][5]
    for i in range(n):
        for a in range(axes):
            for m in range(n):
                if m == i:
                    continue
                for b in range(axes):
                    turn = turns[m, b]
                    gain = 0.0
                    if m < i:
                        cross3(turn, moves[i, a], product)
                        gain += dot3(product, pull[i])
                        cross3(turn, turns[i, a], product)
                        gain += dot3(product, torque[i])
                        swung_moment(tensor[i], turn, change)
                    else:
                        swung_moment(tensor[m], turn, change)
                        cross3(moves[m, b], pull[m], product)
                        for k in range(3):
                            change[k] += product[k]
                    jacobian[i * axes + a, m * axes + b] -= gain + dot3(turns[i, a], change)
