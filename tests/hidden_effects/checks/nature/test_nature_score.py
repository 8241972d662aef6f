"""What is right, what is claimed, and whether promises hold."""

from __future__ import annotations

import math

import pytest

from hidden_effects.natural import (
    NOT_MADE,
    answers_of,
    as_text,
    interval_of,
    reliability,
    scored,
    share_line,
    summary,
)

RUN = {"seconds": 12.0, "failure": ""}


def hidden(cause: str, known: bool = True, also: tuple[str, ...] = (), **parameters: float) -> dict:
    return {
        "cause": cause,
        "form": "form",
        "known": known,
        "also": list(also),
        "over_noise": 9.0,
        "parameters": parameters,
    }


def answer(story: str, *causes: dict) -> dict:
    return {
        "index": 3,
        "story": story,
        "robot": "robot",
        "hidden": list(causes),
        "noise": {"mm": 0.2},
        "noise_kind": "white",
        "rows": 200,
    }


def found(verdict: str, *names: str, **more: object) -> dict:
    causes = [{"name": name, "parameters": {"width_N": {"value": 0.4, "ci95": [0.3, 0.5]}}} for name in names]
    heldout = {"rmse_after": 0.21}
    return {"verdict": verdict, "causes": causes, "unit": "mm", "heldout": heldout, **more}


def judged(*arguments: dict) -> tuple[bool, bool]:
    result = scored(*arguments, RUN)
    return result["right"], result["exact"]


def test_single_is_right_where_named_first():
    """By its own name or by one that says the same; not second, and unexplained only where it is foreign."""
    play = hidden("backlash", also=("tendon_friction",))
    assert judged(answer("single", play), found("cause_found", "backlash", "drift")) == (True, True)
    assert judged(answer("single", play), found("cause_found", "tendon_friction")) == (True, False)
    assert judged(answer("single", play), found("cause_found", "drift", "backlash")) == (False, False)
    assert judged(answer("single", play), found("unexplained")) == (False, False)
    foreign = hidden("backlash", known=False)
    assert judged(answer("single", foreign), found("unexplained")) == (True, False)
    sure = found("no_discrepancy", probabilities={"outside": 0.7})
    assert judged(answer("single", foreign), sure) == (True, False)
    assert judged(answer("single", foreign), found("improved")) == (True, False)


def test_a_wrong_name_is_never_outside():
    """Another cause named for a foreign form is wrong, however probable something outside is."""
    foreign = answer("single", hidden("backlash", known=False))
    result = scored(foreign, found("cause_found", "drift", probabilities={"outside": 0.9}), RUN)
    assert (result["right"], result["named_right"], result["another_named"]) == (False, False, True)
    result = scored(foreign, found("cause_found", "backlash", "drift"), RUN)
    assert (result["right"], result["named_right"], result["another_named"]) == (True, True, True)


def test_a_group_that_holds_the_cause_names_it():
    """One entry for two causes is right if either is at work; it is one answer, not two, for a pair."""
    group = {"name": "stiffness", "one_of": ["stiffness", "rate"], "probability": 0.8, "parameters": {}}
    said = found("cause_found") | {"causes": [group]}
    result = scored(answer("single", hidden("rate")), said, RUN)
    assert (result["right"], result["exact"], result["grouped"]) == (True, False, True)
    assert not result["another_named"]
    assert scored(answer("single", hidden("drift")), said, RUN)["another_named"]
    both = answer("pair", hidden("rate"), hidden("stiffness"))
    assert not scored(both, said, RUN)["right"]
    result["probabilities"] = {"stiffness": 0.5, "rate": 0.3}
    assert sorted(answers_of([result])) == [(0.3, True), (0.5, False), (0.8, True)]


def test_pair_needs_both_under_two_names():
    """One name that stands for either does not stand for both."""
    pair = answer("pair", hidden("backlash", also=("drift",)), hidden("rate", also=("drift",)))
    assert judged(pair, found("cause_found", "rate", "backlash")) == (True, True)
    assert judged(pair, found("cause_found", "drift", "rate")) == (True, False)
    assert judged(pair, found("cause_found", "drift")) == (False, False)


def test_nothing_and_outside():
    """A cause named where nothing is hidden is a false alarm; unexplained is none, but not exact."""
    nothing = answer("none")
    assert judged(nothing, found("no_discrepancy")) == (True, True)
    assert judged(nothing, found("unexplained")) == (True, False)
    assert scored(nothing, found("cause_found", "drift"), RUN)["false_alarm"]
    outside = answer("outside", hidden("kinked_cell", known=False))
    assert judged(outside, found("unexplained"))[0]
    assert not judged(outside, found("cause_found", "drift"))[0]


def test_failed_diagnosis_is_a_miss():
    """Whatever was hidden, and it is no false alarm."""
    result = scored(answer("none"), None, {"seconds": 900.0, "failure": "out of time, 900 s"})
    assert (result["right"], result["false_alarm"], result["verdict"]) == (False, False, "failed")


def test_intervals_count_where_parameters_are_one_to_one():
    """The true width lies inside or not; other parameters than the hidden ones are not compared."""
    (row,) = scored(answer("single", hidden("backlash", width_N=0.45)), found("c", "backlash"), RUN)[
        "intervals"
    ]
    assert row["inside"]
    (row,) = scored(answer("single", hidden("backlash", width_N=0.6)), found("c", "backlash"), RUN)[
        "intervals"
    ]
    assert not row["inside"]
    for other in (hidden("backlash", slack_mm=0.4), hidden("backlash", known=False, width_N=0.45)):
        assert scored(answer("single", other), found("c", "backlash"), RUN)["intervals"] == []


def test_brier_and_reliability_by_hand():
    """Two answers of 0.8, one of which holds, and one of 0.1 that does not."""
    chances = {"backlash": 0.8, "drift": 0.8, "rate": 0.1}
    result = scored(answer("single", hidden("backlash")), found("c", "backlash", probabilities=chances), RUN)
    answers = answers_of([result])
    assert sorted(answers) == [(0.1, False), (0.8, False), (0.8, True)]
    table = summary([result])
    assert table["brier"] == pytest.approx((0.01 + 0.64 + 0.04) / 3)
    row = table["reliability"][4]
    assert (row["count"], row["promised"], row["held"], row["met"]) == (2, pytest.approx(0.8), 0.5, None)


def test_a_bin_of_twenty_is_held_to_its_promise():
    """Nineteen say nothing; twenty that hold half of 0.9 miss, and so do hundred that hold all of 0.85."""
    assert reliability([(0.95, False)] * 19)[4]["met"] is None
    assert reliability([(0.95, index % 2 == 0) for index in range(20)])[4]["met"] is False
    assert reliability([(0.95, index > 0) for index in range(20)])[4]["met"] is True
    assert reliability([(0.85, True)] * 100)[4]["met"] is False
    assert reliability([(0.05, True)] * 100)[0]["met"] is None
    assert reliability([(1.0, True)])[4]["count"] == 1


def test_a_line_is_met_where_its_interval_holds_what_is_asked():
    """Of 20 draws 18 may be 97 % by chance, 15 may not; 2 of 100 false may be 1 %, 6 may not."""
    shares = [share_line("x", [True] * hits + [False] * (20 - hits), 0.97)["met"] for hits in (18, 15)]
    assert shares == [True, False]
    alarms = [share_line("x", [True] * hits + [False] * (100 - hits), at_most=0.01)["met"] for hits in (2, 6)]
    assert alarms == [True, False]
    low, high = interval_of(5, 10)
    assert (low, high) == (pytest.approx(0.2366, abs=1e-3), pytest.approx(0.7634, abs=1e-3))


def test_name_that_says_the_same_is_neither_right_nor_wrong():
    """It is left out of the pairs, as outside is for a foreign form."""
    item = hidden("backlash", known=False, also=("drift",))
    chances = {"backlash": 0.5, "drift": 0.5, "outside": 0.5, "none": 0.1}
    result = scored(answer("single", item), found("c", "backlash", probabilities=chances), RUN)
    result["either"] = ["drift"]
    assert sorted(answers_of([result])) == [(0.1, False), (0.5, True)]


def test_table_says_what_is_missed_and_what_is_not_given():
    """A line of nothing is not met by silence; a miss is listed with what was said."""
    good = scored(answer("single", hidden("backlash")), found("cause_found", "backlash"), RUN)
    bad = scored(answer("none"), found("cause_found", "drift"), RUN)
    table = summary([good, bad, {**bad, "verdict": NOT_MADE, "failure": "no size", "named": []}])
    by_name = {line["what"]: line for line in table["lines"]}
    assert by_name["nothing hidden: a cause named"]["reached"] == 1.0
    assert by_name["single, known form: named first"]["met"] is True
    assert by_name["single, foreign form: named"]["met"] is None
    text = as_text(table)
    for part in ("2 of 3 draws made", "not given", "-> cause_found drift"):
        assert part in text
    assert math.isnan(by_name["both of two named, known forms"]["reached"])
