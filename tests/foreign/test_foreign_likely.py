"""Claims about how probable generic causes are: evidence, groups, and what is left."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from catheter_sim.diagnosis.result import CAUSE_FOUND, IMPROVED, UNEXPLAINED
from catheter_sim.foreign import diagnose
from catheter_sim.foreign.diagnose import NONE, OUTSIDE, Tried, likely, outside, probabilities

BEFORE = Tried((), 0.0, 40.0)
GAIN = Tried(("actuation_gain",), 300.0, 1.0)


def test_what_explains_all_and_alone_is_near_one() -> None:
    """Far more evidence than any other, the noise left: 0.98 or more, and nothing else is probable."""
    (found,) = likely(GAIN, BEFORE, [BEFORE, GAIN, Tried(("delay",), 50.0, 20.0)])
    assert (found.name, dict(found.members)) == ("actuation_gain", {})
    assert found.probability > 0.98
    chances = probabilities([found], GAIN, BEFORE)
    assert max(chances[NONE], chances[OUTSIDE]) < 0.05


def test_what_leaves_much_is_not_more_probable_than_not() -> None:
    """At a quarter of the error before, where a model no longer explains the data, it is one half at most."""
    for left, most, least in ((10.0, 0.5, 0.4), (30.0, 0.05, 0.0), (2.0, 1.0, 0.98)):
        chosen = Tried(("actuation_gain",), 300.0, left)
        (found,) = likely(chosen, BEFORE, [BEFORE, chosen])
        assert least <= found.probability <= most
        assert outside(chosen, BEFORE) == pytest.approx(1.0 - found.probability, abs=0.02)


def test_causes_that_explain_alike_are_one_answer() -> None:
    """Evidence within five nats and as little left: a group; with more left on held-out data it is none."""
    rival, worse = Tried(("stiffness",), 298.0, 1.05), Tried(("stiffness",), 298.0, 2.0)
    (found,) = likely(GAIN, BEFORE, [BEFORE, GAIN, rival])
    assert list(found.members) == ["actuation_gain", "stiffness"]
    assert found.probability > 0.98
    assert sum(found.members.values()) == pytest.approx(found.probability)
    (alone,) = likely(GAIN, BEFORE, [BEFORE, GAIN, worse])
    assert dict(alone.members) == {}
    assert 0.5 < alone.probability < 0.7  # two nats are few


def test_a_group_has_three_members_at_most() -> None:
    """Of more that explain alike, the best; the others then speak against the group."""
    names = ("stiffness", "damping", "payload")
    (found,) = likely(GAIN, BEFORE, [BEFORE, GAIN, *(Tried((name,), 300.0, 1.0) for name in names)])
    assert len(found.members) == 3
    assert found.probability < 0.55


@pytest.mark.parametrize(
    ("left", "evidence", "named", "harmful", "verdict"),
    [
        (1.0, 300.0, True, False, CAUSE_FOUND),
        (1.0, 300.0, False, False, IMPROVED),
        (1.0, 300.0, True, True, UNEXPLAINED),
        (39.0, 300.0, True, False, UNEXPLAINED),
        (1.0, 4.0, True, False, UNEXPLAINED),
    ],
)
def test_what_is_likely_is_a_cause_and_what_helps_is_not(
    left: float, evidence: float, named: bool, harmful: bool, verdict: str
) -> None:
    """Named, and less left: a cause. Not named: improved. Harm, no gain or no evidence: unexplained."""
    before, chosen = (
        SimpleNamespace(times_noise=times, fit=SimpleNamespace(evidence=nats))
        for times, nats in ((40.0, 0.0), (left, evidence))
    )
    assert diagnose._verdict(before, chosen, named, harmful) == verdict  # type: ignore[arg-type]
