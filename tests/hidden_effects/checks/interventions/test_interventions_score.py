"""What counts as right of a comparison, and how draws add up."""

from __future__ import annotations

from typing import Any

from hidden_effects.interventions import as_text, scored_change, summary

RUN = {"seconds": 20.0, "failure": ""}


def answer(story: str, *causes: str) -> dict[str, Any]:
    """Return the answer of a draw in which these changed."""
    hidden = [
        {
            "cause": cause,
            "form": "common",
            "known": True,
            "also": [],
            "over_noise": 8.0,
            "parameters": {"scale": 0.1},
        }
        for cause in causes
    ]
    return {
        "index": 4,
        "story": story,
        "robot": "spacer_disk",
        "commands": "same",
        "hidden": hidden,
        "shared": [{"cause": "obstacle"}],
        "noise": {"mm": 0.2},
        "noise_kind": "white",
        "rows": 300,
    }


def told(verdict: str, *names: str, low: float = 0.05, high: float = 0.15) -> dict[str, Any]:
    """Return a comparison's document."""
    number = {"scale": {"value": 0.1, "ci95": [low, high]}}
    return {
        "verdict": verdict,
        "causes": [],
        "changes": [{"name": name, "parameters": number} for name in names],
        "unit": "mm",
        "since": {"rows": 300, "paired_rows": 150},
    }


def test_the_change_first_is_right() -> None:
    """The first of what is told counts, its interval too."""
    found = scored_change(answer("single", "actuation_gain"), told("changed", "actuation_gain", "twist"), RUN)
    assert (found["right"], found["exact"], found["verdict"]) == (True, True, "changed")
    assert [row["inside"] for row in found["intervals"]] == [True]
    assert (found["commands"], found["shared"], found["paired_rows"]) == ("same", ["obstacle"], 150)
    other = scored_change(answer("single", "actuation_gain"), told("changed", "twist", "actuation_gain"), RUN)
    assert not other["right"]


def test_both_of_two_are_needed() -> None:
    """One of two is not enough."""
    hidden = answer("pair", "actuation_gain", "twist")
    assert scored_change(hidden, told("changed", "twist", "actuation_gain"), RUN)["right"]
    assert not scored_change(hidden, told("changed", "twist"), RUN)["right"]


def test_only_changed_is_a_false_alarm() -> None:
    """Nothing changed: "changed" is a false alarm; "unexplained" is none, but not the answer either."""
    for verdict, alarm, exact in (
        ("changed", True, False),
        ("unexplained", False, False),
        ("unchanged", False, True),
    ):
        names = ("twist",) if alarm else ()
        found = scored_change(answer("none"), told(verdict, *names), RUN)
        assert (found["false_alarm"], found["exact"]) == (alarm, exact)
    assert scored_change(answer("none"), None, RUN | {"failure": "out of time"})["verdict"] == "failed"


def test_table_counts_and_lists_misses() -> None:
    """Shares by story and commands; what is not told unchanged is listed, though it is no false alarm."""
    single, nothing = answer("single", "actuation_gain"), answer("none")
    scores = [
        scored_change(single, told("changed", "actuation_gain"), RUN),
        scored_change(single, told("changed", "actuation_gain", low=0.11), RUN),
        scored_change(nothing, told("unexplained"), RUN),
    ]
    table = summary(scores)
    lines = {line["what"]: line for line in table["lines"]}
    assert lines["one changed: told first"]["reached"] == 1.0
    assert lines["one changed, same commands: told first"]["of"] == 2
    assert lines["nothing changed: called changed"]["count"] == 0
    assert lines["true change in its 95 % interval"]["reached"] == 0.5
    assert [item["story"] for item in table["misses"]] == ["none"]
    assert "both hide obstacle" in as_text(table)
