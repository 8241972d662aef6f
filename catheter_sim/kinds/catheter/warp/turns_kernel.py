"""By how much the tendons of all copies' bending joints turn, as a Warp kernel, in double precision."""

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.

import warp as wp


@wp.kernel(enable_backward=False)
def pair_turns(
    path: wp.float64,
    qpos: wp.array2d(dtype=float),
    gaps: wp.array2d(dtype=int),
    ends: wp.array(dtype=int),
    passes: wp.array2d(dtype=int),
    turn: wp.array3d(dtype=wp.float64),
):
    """As `kinds.catheter.forces.paths.PairTurns`, one thread for each copy and pair.

    Args:
        path: by which all turn before the base [rad].
        qpos: MuJoCo's positions.
        gaps: where in them the pairs' gaps are, shape (p, n).
        ends: number of gaps of each, shape (p,) or more.
        passes: 1 where a pair passes the joint of another one, shape (p, p).
        turn: out, the pairs' tendons and then their antagonists', shape (m, 2 p, n) [rad].
    """
    world, pair = wp.tid()
    pairs = gaps.shape[0]
    first = wp.float64(path)
    for other in range(pairs):
        if passes[pair, other] > 0:
            bend = wp.float64(0.0)
            for k in range(ends[other]):
                bend += wp.float64(qpos[world, gaps[other, k]])
            first += wp.abs(bend)
    before = wp.float64(0.0)
    for k in range(ends[pair]):
        angle = wp.float64(qpos[world, gaps[pair, k]])
        value = wp.float64(0.5) * wp.abs(before + angle)
        if k == 0:
            value += first
        turn[world, pair, k] = value
        turn[world, pairs + pair, k] = value
        before = angle
