"""What an eyelet with dry friction does to the tensions of the tendons that run through it.

A tendon that turns by `phi` at an eyelet with friction coefficient mu comes out with a tension in
[T/E, T E], E = exp(mu phi), T the tension before the eyelet (capstan; Coulomb). It comes out with
T/E while it is pulled toward the base, with T E while it runs toward the tip.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

_NEUTRAL = 2.0**-500  # of the farthest eyelet's place: nearer to the neutral plane is in it


def tensions_behind(
    before: Sequence[float], kept: Sequence[float], offset: Sequence[float], capstan: float
) -> list[float]:
    """Return the tensions behind an eyelet for tendons that end together, so that they slip together.

    What bends the robot beyond the eyelet is the moment sum(offset * tension). It keeps its value
    while it can. It can between two limits: where the tendons on the +x side come out lowest and
    those on the -x side highest (bending further toward +x), and the reverse (coming back). A moment
    that left these limits is moved to the one it crossed, and all tendons slip. Otherwise they
    stick: each keeps its tension as far as all then stay inside their own intervals; where one does
    not, they take the nearest tensions with the same moment. With one tendon this is: it keeps its
    tension unless the interval pushes it.

    Args:
        before: tensions before the eyelet [N].
        kept: tensions behind it a moment ago [N].
        offset: x of the eyelets, one a tendon [m].
        capstan: E = exp(mu phi) >= 1.
    """
    offset = _scaled(offset)
    low = [tension / capstan for tension in before]
    high = [tension * capstan for tension in before]
    moment = forward = backward = 0.0
    inside = True
    for lo, hi, old, d in zip(low, high, kept, offset, strict=True):
        moment += d * old
        forward += d * (lo if d > 0.0 else hi)
        backward += d * (hi if d > 0.0 else lo)
        inside = inside and lo <= old <= hi
    if inside:
        return list(kept)
    if moment <= forward:
        ends = zip(low, high, strict=True)
    elif moment >= backward:
        ends = zip(high, low, strict=True)
    else:
        return _nearest(low, high, kept, offset, moment)
    # A tendon in the neutral plane is moved by neither: it keeps its tension as far as it can.
    return [
        right if d > 0.0 else left if d < 0.0 else min(max(old, min(right, left)), max(right, left))
        for (right, left), old, d in zip(ends, kept, offset, strict=True)
    ]


def _scaled(offset: Sequence[float]) -> list[float]:
    """Return the places with the farthest between 0.5 and 1.

    Nothing depends on their scale, and a power of two rounds nothing; places of 1e-311 m would lose the
    digits that their moments need.
    """
    exponent = math.frexp(max((abs(d) for d in offset), default=0.0))[1]
    scaled = [math.ldexp(d, -exponent) for d in offset]
    return [0.0 if abs(d) < _NEUTRAL else d for d in scaled]


def _nearest(
    low: Sequence[float], high: Sequence[float], kept: Sequence[float], offset: Sequence[float], moment: float
) -> list[float]:
    """Return the tensions inside their intervals, nearest to `kept`, whose moment is `moment`.

    Least squares under one equality: tension = clip(kept + multiplier * offset). The moment grows
    with the multiplier, linearly between the values at which a tendon meets an end of its interval.
    """

    def at(multiplier: float) -> tuple[list[float], float]:
        tensions = [
            min(max(old + multiplier * d, lo), hi)
            for lo, hi, old, d in zip(low, high, kept, offset, strict=True)
        ]
        return tensions, sum(d * tension for d, tension in zip(offset, tensions, strict=True))

    knees = sorted(
        (end - old) / d
        for ends, old, d in zip(zip(low, high, strict=True), kept, offset, strict=True)
        if d != 0.0
        for end in ends
    )
    left, (tensions, left_moment) = knees[0], at(knees[0])
    for right in knees[1:]:
        if left_moment >= moment:
            break
        tensions, right_moment = at(right)
        if right_moment >= moment:
            share = (moment - left_moment) / (right_moment - left_moment)
            return at(left + share * (right - left))[0]
        left, left_moment = right, right_moment
    return tensions
