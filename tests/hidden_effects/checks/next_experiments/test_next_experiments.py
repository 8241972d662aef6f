"""Claims about the bench of next experiments: what it counts, and that experiments are alike in length."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from catheter_sim.diagnosis.programmes import Programme
from catheter_sim.lab.simulated import stand_in
from catheter_sim.tables import Table
from hidden_effects.next_experiments import (
    as_text,
    drawn,
    first_data,
    interval,
    lasting,
    met_lines,
    open_causes,
    settles,
    summary,
    tellable,
)


def draw(index: int, proposed: list[str], random: list[str]) -> dict[str, Any]:
    """Return a draw in which play is hidden and path friction says the same."""
    hidden = {"cause": "backlash", "form": "play", "also": ["tendon_friction"]}
    arms = {
        arm: {"sure": sure, "believed": {}, "programme": "loops", "verdict": "cause_found"}
        for arm, sure in (("proposed", proposed), ("fixed", []), ("random", random))
    }
    return {
        "index": index,
        "robot": "r",
        "hidden": hidden,
        "arms": arms,
        "refused": ["told"],
        "untellable": [],
    }


def test_what_is_settled_and_what_falsely() -> None:
    """Another name that says the same is right; one wrong cause beside a right one is false."""
    draws = [
        draw(0, ["backlash"], []),
        draw(1, ["tendon_friction"], ["backlash"]),
        draw(2, ["backlash", "drift"], ["drift"]),
        draw(3, [], []),
    ]
    assert [settles(item, "proposed") for item in draws] == [True, True, False, False]
    found = summary(draws)
    assert found["arms"]["proposed"] == {"settled": 2, "false": 1, "of": 4}
    assert found["arms"]["random"] == {"settled": 1, "false": 1, "of": 4}
    assert found["stand_ins"] == 8
    assert list(met_lines(found).values()) == [False, True, False]
    text = as_text(found, draws)
    assert "settled   2 of   4 (50 %" in text
    assert text.count("draw ") == 2  # the misses
    assert "so far MISSED" in text
    assert "nothing is decided" in text


def test_a_bench_without_draws_meets_nothing() -> None:
    """Nothing measured is neither met nor missed."""
    assert list(met_lines(summary([])).values()) == [None]


def test_the_interval_of_a_share() -> None:
    """Wilson's, as Newcombe 1998 prints it for 81 of 263: 0.2553 to 0.3662; and inside 0 to 1."""
    assert interval(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert interval(0, 20)[0] == 0.0
    assert interval(20, 20)[1] == pytest.approx(1.0)


@pytest.mark.parametrize("length_s", [3.0, 7.0, 40.0])
def test_programmes_are_made_alike_in_length(length_s: float) -> None:
    """Cut where too long, repeated where too short; the clock goes on evenly."""
    table = Table(np.arange(6.0), {"a_mm": np.array([0.0, 1.0, 2.0, 1.0, 0.5, 0.0])}, "p")
    found = lasting(Programme("p", table), length_s).table
    assert found.time_s[-1] == pytest.approx(length_s)
    np.testing.assert_allclose(np.diff(found.time_s), 1.0)
    np.testing.assert_array_equal(found.columns["a_mm"], np.resize(table.columns["a_mm"], len(found.time_s)))


def test_open_causes_are_causes() -> None:
    """Neither "none" nor "outside" is one, and 0.2 is not above 0.2."""
    assert open_causes({"none": 0.9, "outside": 0.5, "drift": 0.2, "rate": 0.21}) == ["rate"]


def test_what_rich_data_cannot_tell_is_no_draw() -> None:
    """One rival within nature's bound is enough; where nature cannot say, it stays."""
    assert tellable({"apart": {"drift": 9.0, "rate": None}})
    assert not tellable({"apart": {"drift": 9.0, "rate": 3.9}})


@pytest.mark.slow
def test_first_data_are_single_pulls() -> None:
    """Of two channels, out and not back, within the range; some held out."""
    rig = stand_in("mitral_4dof", ["actuation_gain.common=20"], seed=1)
    found = first_data(rig, np.random.default_rng(1))
    assert [role for _, role, _ in found] == ["train", "train", "train", "heldout", "heldout"]
    moved = set()
    for _, _, table in found:
        for name, (_, most) in rig.limits.inputs.items():
            steps = np.diff(table.columns[name])
            assert (steps >= 0.0).all()
            assert table.columns[name].max() < most
            moved |= {name} if steps.any() else set()
    assert len(moved) == 2


@pytest.mark.slow
def test_a_draw_repeats_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """The seed decides what is hidden and what is refused."""
    monkeypatch.setattr("hidden_effects.next_experiments.ATTEMPTS", 1)
    first, again = (drawn(5, 2, ["mitral_4dof"]) for _ in range(2))
    for found in (first, again):
        found.pop("seconds")
        for arm in found.get("arms", {}).values():
            arm.pop("seconds")
    assert first == again
