"""Which hypotheses are still alive after a diagnosis, and how much each is believed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from catheter_sim.diagnosis.causes.comparison import rivals_of
from catheter_sim.diagnosis.causes.scored import Scored
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.thresholds import ALIVE_BELIEF, IDLE_BELIEF
from catheter_sim.effects import EFFECTS

NONE = "none"


@dataclass(frozen=True)
class Alive:
    """A hypothesis that is still alive.

    Attributes:
        causes: its causes; (): the calibrated model.
        about: the cause, or "none", by which it differs from the others.
        fit: to the data so far.
        belief: its weight beside the others, which add up to one.
    """

    causes: tuple[str, ...]
    about: str
    fit: Fit
    belief: float


def alive_hypotheses(
    believed: Mapping[str, float],
    settled: Fit,
    equals: Sequence[Fit],
    tried: Sequence[Scored],
) -> tuple[Alive, ...]:
    """Return the hypotheses that are worth an experiment, most believed first.

    They are the settled one; for each of its causes that is not sure, the best without it; and for each other
    cause that is believed at all, the best with it in a settled one's place. Where fewer than two are left,
    single causes that the data have never asked about stand beside them, little believed.

    Args:
        believed: of every cause and "none".
        settled: the hypothesis at which the diagnosis ended.
        equals: those that explain the data as well, another cause in a settled one's place.
        tried: every set of causes that was fitted.
    """
    named = set(settled.causes)
    ordered = sorted(tried, key=lambda item: float(item.squares.sum()))
    found: list[Alive] = []

    def add(fit: Fit, about: str, belief: float) -> None:
        causes = tuple(sorted(fit.causes))
        if belief >= ALIVE_BELIEF and all((item.causes, item.about) != (causes, about) for item in found):
            found.append(Alive(causes, about, fit, belief))

    if named:
        weakest = min(named, key=lambda name: believed.get(name, 0.0))
        add(settled, weakest, believed.get(weakest, 0.0))
        for gone, come, fit in rivals_of(settled, sorted(equals, key=lambda item: item.cross_validated_rms)):
            about = come if come != gone else f"{come}, other numbers"
            if all(item.about != about for item in found):
                add(fit, about, believed.get(come, 0.0))
    for name in EFFECTS:
        if name in named or any(item.about == name for item in found):
            continue
        mine = [
            item.fit for item in ordered if name in item.causes and len(item.causes) <= max(len(named), 1)
        ]
        if mine:
            add(mine[0], name, believed.get(name, 0.0))
    for name in named:
        without = [item.fit for item in ordered if name not in item.causes]
        doubt = 1.0 - believed.get(name, 0.0) - sum(item.belief for item in found if name not in item.causes)
        if without and all(item.fit is not without[0] for item in found):
            add(without[0], NONE if not without[0].causes else "+".join(without[0].causes), doubt)
    if not named:
        nulls = [item.fit for item in ordered if not item.causes]
        add(nulls[0], NONE, max(believed.get(NONE, 0.0), ALIVE_BELIEF))
    if len(found) < 2:
        for item in ordered:
            if len(item.causes) == 1 and item.causes[0] not in named:
                found.append(Alive(item.causes, item.causes[0], item.fit, IDLE_BELIEF))
    total = sum(item.belief for item in found)
    shares = [Alive(item.causes, item.about, item.fit, item.belief / total) for item in found]
    return tuple(sorted(shares, key=lambda item: -item.belief))
