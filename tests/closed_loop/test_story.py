"""Claims about the story of a closed loop: it says what a person would say, and only what happened."""

from __future__ import annotations

from catheter_sim.closed_loop.loop import NO_MORE, SURE, WAITING, LoopFinding, LoopOutcome, LoopStep, Proposed
from catheter_sim.closed_loop.story import paragraphs_of, rows_of, title_of, write_story

OPEN = LoopFinding(
    "cause_found",
    {"actuation_gain": 0.45, "tendon_elongation": 0.45, "none": 0.01},
    "The model is wrong about tendon elongation.",
    [],
    alike=[["tendon_elongation", "actuation_gain"]],
)
TOLD = LoopFinding(
    "cause_found",
    {"actuation_gain": 0.97},
    "The model is wrong about actuation gain.",
    ["actuation_gain"],
    [("actuation_gain", "scale_torsion", 1.4, 1.39, 1.41)],
)
PLAYED = Proposed(
    "experiment_1",
    "all channels pulled together",
    1.8,
    0.61,
    0.9,
    20,
    {"tendon_elongation": 0.5, "actuation_gain": 0.5},
    {"actuation_gain": 6.0},
    ["a tension sensor at each tendon"],
)
FIRST, LAST = LoopStep(5, OPEN, PLAYED), LoopStep(9, TOLD, None, SURE)


def test_a_story_with_an_end() -> None:
    """What could not be told apart, what was chosen and why, what it showed, and the numbers."""
    outcome = LoopOutcome((FIRST, LAST), SURE, ("actuation_gain",), "one cause stands at 0.95 or more")
    assert title_of(outcome, "robot") == "What is wrong with robot is actuation gain, after one experiment"
    first, chosen, after, end = paragraphs_of(outcome)
    assert "could not tell apart tendon elongation and actuation gain" in first
    assert "Of 20 programmes" in chosen
    assert "all channels pulled together, 108 seconds, 0.61 nat" in chosen
    assert "If tendon elongation is right" in chosen
    assert "actuation gain by 6.0 times the noise" in chosen
    assert "a tension sensor" in chosen
    assert after.endswith("Actuation gain stood at 0.97.")
    assert "1.4 (95 %: 1.39 to 1.41)" in end
    assert [row["believed"] for row in rows_of(outcome.steps)][-1] == "actuation gain 0.97"


def test_a_story_without_an_end_promises_nothing(tmp_path) -> None:
    """Neither the title nor the last words say more than is known."""
    spent = LoopOutcome((LoopStep(5, OPEN, None, NO_MORE),), NO_MORE, (), "the budget is spent")
    assert title_of(spent, "robot") == "What is wrong with robot is not known from the first data"
    assert paragraphs_of(spent)[-1].startswith("It ends here, as the budget is spent.")
    waits = LoopOutcome((FIRST,), WAITING, (), "experiment_1_1.csv: not there yet")
    assert "not known yet" in title_of(waits, "robot")
    assert "experiment_1_1.csv" in paragraphs_of(waits)[-1]
    write_story(waits, "robot <1>", tmp_path)
    assert "robot &lt;1&gt;" in (tmp_path / "story.html").read_text()
