"""Which causes the data cannot tell apart: each explains the stretches that it was not fitted to as well."""

from __future__ import annotations

from collections.abc import Sequence

from catheter_sim.diagnosis.causes.scored import Scored, cost_of, surety
from catheter_sim.diagnosis.fitting.evidence import chance_of_gain
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.thresholds import EQUAL_FACTOR, LARGEST_GROUP, PAYS_CHANCE


def alike_groups(
    hypotheses: Sequence[Scored], settled: Sequence[str], equals: Sequence[tuple[str, str, Fit]]
) -> dict[str, dict[str, float]]:
    """Return, by causes of a hypothesis, those that the data cannot tell from it, with how surely it does
    better than each [standard deviations of chance].

    A member stands in a cause's place and explains the training and the held-out stretches together as well:
    its error is within `EQUAL_FACTOR`, and what it errs more may be chance (`PAYS_CHANCE`). At most
    `LARGEST_GROUP` have a place; of more, those that err least.

    Args:
        hypotheses: every set that was tried.
        settled: the causes of the one that is asked about.
        equals: a cause of it, another one that stands in its place, and the hypothesis with that one.
    """
    by_causes = {item.causes: item for item in hypotheses}
    mine = by_causes[tuple(sorted(settled))]
    found: dict[str, dict[str, Scored]] = {}
    taken: set[str] = set()
    for name, rival, item in sorted(equals, key=lambda entry: entry[2].cross_validated_rms):
        other = by_causes.get(tuple(sorted(item.causes)))
        if rival in settled or rival in taken or other is None or not _explains_as_well(mine, other):
            continue
        group = found.setdefault(name, {})
        if len(group) < LARGEST_GROUP - 1:
            group[rival] = other
            taken.add(rival)
    return {
        name: {rival: surety(other.squares, mine.squares) for rival, other in group.items()}
        for name, group in found.items()
    }


def _explains_as_well(mine: Scored, other: Scored) -> bool:
    near = cost_of(other) <= EQUAL_FACTOR**2 * cost_of(mine)
    return near and chance_of_gain(other.squares - mine.squares) > PAYS_CHANCE
