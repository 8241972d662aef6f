"""The table of scores: what counts as a hit, and that every miss is listed."""

from __future__ import annotations

import math

import pytest

from hidden_effects.first_bench import _accounted, _coverage, _stands_for, as_text, miss_text, summary


def draw(index, story, right, verdict="cause_found", named=(), true=(), **more):
    """Return a score with what the table needs."""
    return {
        "index": index,
        "story": story,
        "robot": "chest_tube_section",
        "true": list(true),
        "size": 10.0,
        "rows": 300,
        "seconds": 30.0,
        "verdict": verdict,
        "failure": "",
        "named": list(named),
        "right": right,
    } | more


def line(table, what):
    """Return the table's line that begins with `what`."""
    (found,) = (item for item in table["lines"] if item["what"].startswith(what))
    return found


def test_wrong_name_is_a_miss_that_is_listed():
    """One of two single effects named otherwise: half are right, the miss stands there with both names."""
    good = draw(0, "single", True, named=["backlash"], true=["backlash"])
    bad = draw(1, "single", False, named=["drift"], true=["rate"])
    table = summary([good, bad])
    assert line(table, "single effect named first")["reached"] == 0.5
    assert line(table, "single effect named first")["met"] is False
    assert "rate (10 x noise, 300 rows) -> cause_found drift" in as_text(table)
    assert [item["index"] for item in table["misses"]] == [1]


def test_cause_for_nothing_is_held_against_the_two_percent():
    """A cause named where nothing was hidden counts; "unexplained" there is a miss of another line."""
    scores = [
        draw(0, "none", False, named=["drift"]),
        draw(1, "none", False, verdict="unexplained"),
        draw(2, "none", True, verdict="no_discrepancy"),
    ]
    table = summary(scores)
    assert line(table, "nothing hidden: a cause named")["reached"] == pytest.approx(1 / 3)
    assert line(table, "nothing hidden: a cause named")["met"] is False
    assert line(table, "nothing hidden: no discrepancy")["count"] == 1


def test_what_was_never_measured_is_not_met():
    """Without a draw of a kind, its line is not met: undefined passes nothing."""
    table = summary([draw(0, "none", True, verdict="no_discrepancy")])
    found = line(table, "single effect named first")
    assert math.isnan(found["reached"])
    assert found["met"] is False


def test_true_cause_may_stand_in_the_group_of_a_named_one():
    """Named itself, or in one group with a named cause; a group without a named cause does not count."""
    assert _accounted("stiffness", ["stiffness"], [])
    assert _accounted("stiffness", ["actuation_gain"], [["actuation_gain", "stiffness"]])
    assert not _accounted("stiffness", ["backlash"], [["actuation_gain", "stiffness"]])
    assert not _accounted("stiffness", [], [["actuation_gain", "stiffness"]])


def test_what_calibration_does_as_well_needs_no_name():
    """Nothing named is right where the calibrated model is as near; another name must stand in a group."""
    assert _stands_for([], "no_discrepancy", False, 0.5)
    assert not _stands_for([], "no_discrepancy", False, 6.0)
    assert not _stands_for([], "unexplained", False, 0.5)
    assert _stands_for(["stiffness"], "cause_found", True, 0.5)
    assert not _stands_for(["stiffness"], "cause_found", False, 0.5)


def test_coverage_asks_for_the_true_value_in_the_interval():
    """Inside, outside, each of what was hidden for all, and not comparable where others were fitted."""

    def cause(name, low, high):
        return {"name": name, "parameters": {"scale": {"value": 1.0, "ci95": [low, high]}}}

    (inside,) = _coverage({"stiffness": {"scale": 0.9}}, [cause("stiffness", 0.8, 1.0)])
    (outside,) = _coverage({"stiffness": {"scale": 0.7}}, [cause("stiffness", 0.8, 1.0)])
    (unbounded,) = _coverage({"stiffness": {"scale": 7.0}}, [cause("stiffness", 0.8, None)])
    (other,) = _coverage({"actuation_gain": {"scale_right": 0.9}}, [cause("actuation_gain", 0.8, 1.0)])
    assert (inside["inside"], outside["inside"], unbounded["inside"]) == (True, False, True)
    assert (other["comparable"], other["inside"]) == (False, False)
    gain = {
        "name": "actuation_gain",
        "parameters": {
            "scale_right": {"value": 1.0, "ci95": [0.8, 1.0]},
            "scale_left": {"value": 1.0, "ci95": [0.95, 1.1]},
        },
    }
    detailed = _coverage({"actuation_gain": {"scale": 0.9}}, [gain])
    assert [(row["parameter"][-5:], row["inside"]) for row in detailed] == [("right", True), ("_left", False)]
    assert _coverage({"backlash": {"width_N": 1.0}}, [cause("stiffness", 0.8, 1.0)]) == []


def test_gain_outside_the_claimed_interval_is_listed():
    """The third set's gain outside the claimed interval counts against the claim and is shown."""
    gain = {"claimed": 80.0, "low": 78.0, "high": 82.0, "third": 60.0, "third_low": 55.0, "third_high": 65.0}
    off = draw(0, "single", True, gain=gain | {"inside": False, "overlap": False})
    table = summary([off])
    assert line(table, "gain on a third set")["count"] == 0
    assert "claimed 80.0 (78.0 to 82.0), third 60.0" in as_text(table)


def test_failed_diagnosis_says_why():
    """A diagnosis that ended in an error is a miss with its message."""
    text = miss_text(
        draw(4, "pair", False, verdict="failed", true=["rate", "drift"]) | {"failure": "no time"}
    )
    assert "rate + drift" in text
    assert "failed: no time" in text
