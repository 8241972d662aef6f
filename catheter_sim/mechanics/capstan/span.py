"""The tensions of one tendon's spans under the capstan law, compiled."""

from __future__ import annotations

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled_in_place


@compiled_in_place
def span_tensions(
    entering: float,
    drive: float,
    drawn: float,
    factor: Array,
    shrink: Array,
    rate: Array,
    response: Array,
    count: int,
    tension: Array,
    found: Array,
    slip: Index,
    scratch: Array,
) -> float:
    """Find the tensions of one tendon with which it sticks where it can and slips where it must.

    The tensions minimise sum_k response_k (T_k - old_k)^2 / 2 - rate_k (T_k - old_k), which is zero
    slope where no span changes its length, within T_k - T_(k-1) in [low_k, high_k], what friction
    allows at hole k. The multiplier of that bound is the sliding speed at hole k. Solved exactly by
    dynamic programming from the tip: the slope of the cost-to-go is a rising, piecewise linear
    function of the tension before the hole, kept as its knots. They lie on two stacks, left and right
    of the flat piece that friction leaves at each hole; each stack shifts as a whole, so that the cost
    grows with the number of spans and not with its square.

    Args:
        entering: tension at the actuator now; below zero where a driven tendon is slack [N].
        drive: what the actuator's tension grows by per unit of the tendon's rate of lengthening in
            one step [N s/m]; 0 where the tension is given.
        drawn: the actuator's tension at the end of the step as far as it is known [N].
        factor, shrink: exp(mu turn) at each hole and one over it, shape (n,).
        rate: length rates of the spans under the old tensions [m/s], shape (n,).
        response: fall of a span's length rate per unit of its own tension, above zero [m/s/N], shape (n,).
        count: number of spans of this tendon.
        tension: old tensions, shape (n,) [N].
        found: out: new ones, shape (n,) [N].
        slip: out: 1 where the tension rises over a hole by all of `factor`, -1 where it falls by it, 0
            where the tendon sticks, shape (n,).
        scratch: workspace, shape (3, 2 n) or wider.

    Returns:
        The actuator's tension at the end of the step [N].
    """
    # Knots, and by how much the slope's own slope changes on the way outward there. The left stack's top
    # is at `left - 1`, the right one's, which grows downward, at `right`.
    knots, steps, goal = scratch[0], scratch[1], scratch[2]
    left, right = 0, knots.shape[0]
    left_shift, right_shift = 0.0, 0.0  # of the whole stacks
    for k in range(count + 1):
        span = count - 1 - k
        # the slope of the cost-to-go, slope * T + offset, on what was the flat piece
        if span >= 0:
            slope = response[span]
            offset = -(slope * tension[span] + rate[span])
        elif drive > 0.0:
            slope, offset = 1.0 / drive, -entering / drive
        else:
            break
        # where it crosses zero: the tension that this span, at last the actuator, would like
        while left > 0:
            knot = knots[left - 1] + left_shift
            if slope * knot + offset <= 0.0:
                break
            left -= 1
            right -= 1
            step = steps[left]
            slope += step
            offset -= step * knot
            knots[right], steps[right] = knot - right_shift, -step
        while right < knots.shape[0]:
            knot = knots[right] + right_shift
            if slope * knot + offset >= 0.0:
                break
            step = steps[right]
            slope += step
            offset -= step * knot
            knots[left], steps[left] = knot - left_shift, -step
            left += 1
            right += 1
        wish = -offset / slope
        if span < 0:
            entering = wish
            break
        goal[span] = wish
        # as a function of the tension before hole k: left of the wish shifted by the upper bound,
        # flat between, right of it shifted by the lower bound
        right -= 1
        knots[left], steps[left] = wish - left_shift, slope
        knots[right], steps[right] = wish - right_shift, slope
        left += 1
        before = tension[span - 1] if span > 0 else drawn
        left_shift -= before * factor[span] - before
        right_shift -= before * shrink[span] - before
    entering = max(entering, 0.0)
    before = entering
    for k in range(count):
        low, high = before * shrink[k], before * factor[k]
        slip[k] = (goal[k] >= high) - (goal[k] <= low)
        before = min(max(goal[k], low), high)
        found[k] = before
    return entering


@compiled_in_place
def slip_as_before(
    entering: float,
    drive: float,
    factor: Array,
    shrink: Array,
    arm: Array,
    speed: Array,
    response: Array,
    count: int,
    tension: Array,
    found: Array,
    slip: Index,
    scratch: Array,
) -> float:
    """Find one tendon's tensions as `span_tensions` does, if it slips where `slip` says.

    Between two holes where it sticks, one tension then fixes all, and its size is that for which nothing
    slides over the first of them. Much faster than to find out where a tendon slips, and from pass to
    pass, and step to step, that seldom changes. Here what friction allows follows the new tensions, there
    the old ones: the passes end at the same.

    Args: as of `span_tensions`, but `slip` is only read, and `arm` times `speed`, shape (n,) each, is `rate`.

    Returns:
        The actuator's tension at the end of the step [N]; below zero where it slips elsewhere or the other
        way, and then `found` is of no use.
    """
    wish, weight = scratch[0], scratch[1]
    offset, slope = 0.0, 0.0  # sliding speed at hole k: wish_k - weight_k T_k
    for k in range(count - 1, -1, -1):
        offset += arm[k] * speed[k] + response[k] * tension[k]
        slope += response[k]
        wish[k], weight[k] = offset, slope
        if slip[k] == 0:
            offset, slope = 0.0, 0.0
        else:
            slope *= factor[k] if slip[k] > 0 else shrink[k]
    before = entering
    if drive > 0.0:
        before = (entering / drive + offset) / (1.0 / drive + slope)
    if before <= 0.0:
        return -1.0
    entering = before
    for k in range(count):
        if slip[k] == 0:
            goal = wish[k] / weight[k]
            if goal > before * factor[k] or goal < before * shrink[k]:
                return -1.0
            before = goal
        else:
            before *= factor[k] if slip[k] > 0 else shrink[k]
            if (wish[k] - weight[k] * before) * slip[k] < 0.0 and factor[k] > 1.0:
                return -1.0
        found[k] = before
    return entering
