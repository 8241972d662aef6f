"""The story of a closed loop, as a person would tell it: in Markdown, and as a page that needs no network."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from catheter_sim.closed_loop.loop import (
    NO_MORE,
    NOTHING,
    SURE,
    SUSPECT,
    WAITING,
    LoopFinding,
    LoopOutcome,
    LoopStep,
    Proposed,
)
from catheter_sim.diagnosis.words import listed, number_words, spoken, words
from catheter_sim.files import placed_when_whole
from catheter_sim.page.render import rendered

STORY, PAGE = "story.md", "story.html"
_TEMPLATE = "story_template.html"
_LEAST_SAID = 0.1  # probability below which a cause is not spoken of
_FIRST = "first"


def write_story(outcome: LoopOutcome, robot: str, folder: Path) -> None:
    """Write `story.md` and `story.html` into a loop's folder.

    Raises:
        InputError: the folder cannot be written.
    """
    title, paragraphs = title_of(outcome, robot), paragraphs_of(outcome)
    rows = rows_of(outcome.steps)
    text = [f"# {title}", "", *(line for item in paragraphs for line in (item, "")), *_markdown(rows)]
    with placed_when_whole(folder / STORY) as path:
        path.write_text("\n".join(text) + "\n", encoding="utf-8")
    page = rendered(
        "catheter_sim.closed_loop",
        _TEMPLATE,
        {"title": title, "robot": robot, "end": outcome.words, "paragraphs": paragraphs, "rows": rows},
        {"spoken": spoken},
    )
    with placed_when_whole(folder / PAGE) as path:
        path.write_text(page, encoding="utf-8")


def title_of(outcome: LoopOutcome, robot: str) -> str:
    """Return the outcome in one line."""
    made = _made(outcome.steps)
    after = f"after {_counted(made, 'experiment')}" if made else "from the first data"
    if outcome.end == SURE:
        return f"What is wrong with {robot} is {listed([words(name) for name in outcome.causes])}, {after}"
    if outcome.end == WAITING:
        return f"What is wrong with {robot} is not known yet: the bench is waited for"
    return f"What is wrong with {robot} is not known {after}"


def paragraphs_of(outcome: LoopOutcome) -> list[str]:
    """Return the story, a paragraph a step."""
    found = [text for place, _ in enumerate(outcome.steps) for text in _step_words(outcome.steps, place)]
    return [*found, _ending(outcome)]


def rows_of(steps: Sequence[LoopStep]) -> list[dict[str, str]]:
    """Return a row for each diagnosis: what was played before it, and what was believed then."""
    rows, before = [], "the first data"
    for step in steps:
        if step.found is not None:
            rows.append(
                {
                    "played": before,
                    "recordings": str(step.recordings),
                    "verdict": step.found.verdict.replace("_", " "),
                    "believed": _believed(step.found) or "nothing above 0.1",
                }
            )
        if step.proposed is not None:
            before = f"{step.proposed.words} ({_minutes(step.proposed.minutes)})"
    return rows


def _made(steps: Sequence[LoopStep]) -> int:
    return sum(
        step.proposed is not None and step.found is not None and place + 1 < len(steps)
        for place, step in enumerate(steps)
    )


def _step_words(steps: Sequence[LoopStep], place: int) -> list[str]:
    step, texts = steps[place], []
    if step.found is not None:
        earlier = [item.found for item in steps[:place] if item.found is not None]
        texts.append(_found_words(step.found, step.recordings, earlier[-1] if earlier else None))
    if step.proposed is not None:
        texts.append(_proposed_words(step.proposed))
    return texts


def _found_words(found: LoopFinding, recordings: int, before: LoopFinding | None) -> str:
    begin = f"{_counted(recordings, 'recording').capitalize()} were diagnosed. " if before is None else ""
    begin = begin or f"Together with what was known, {_counted(recordings, 'recording')} in all: "
    text = begin + found.sentence
    open_now = _likely(found.believed)
    if found.sure:
        top = min((found.believed[name] for name in found.sure), default=math.nan)
        return f"{text} {listed([words(name) for name in found.sure]).capitalize()} stood at {top:.2f}."
    if found.alike:
        groups = "; ".join(listed([words(name) for name in group]) for group in found.alike)
        text += f" But the data could not tell apart {groups}: each explains them as well"
        return f"{text} ({_believed(found)})."
    if len(open_now) > 1:
        return f"{text} Nothing was sure: {_believed(found)}."
    if open_now:
        return f"{text} It was not sure yet: {_believed(found)}."
    return text


def _proposed_words(item: Proposed) -> str:
    if item.name == _FIRST:
        return f"Nothing was known, so the bench first played {item.words} ({_minutes(item.minutes)})."
    text = f"Of {_counted(item.tried, 'programme')} that the bench can play, one promised most: {item.words}"
    if item.nats is not None and item.settles is not None:
        text += f", {_minutes(item.minutes)}, {item.nats:.2f} nat (it decides with "
        text += f"{100 * item.settles:.0f} %)"
    text += "."
    if item.off and item.alive:
        first = _rival(next(iter(item.alive)))
        rivals = [f"{_rival(name)} by {value:.1f}" for name, value in item.off.items()]
        text += (
            f" If {first} is right, the others, after a refit, would still be off there: {listed(rivals)} "
            "times the noise."
        )
    if item.sensors:
        text += f" It would tell more still with {' or '.join(item.sensors[:2])}."
    return text


def _rival(about: str) -> str:
    """Return what to call a hypothesis by what it is about."""
    return "no cause at all" if about == "none" else listed([words(name) for name in about.split("+")])


def _ending(outcome: LoopOutcome) -> str:
    last = outcome.steps[-1].found if outcome.steps else None
    if outcome.end == SURE and last is not None:
        numbers = [
            f"{words(cause)}: {' '.join(part for part in number_words(name) if part)[:60]}, {value:.4g} "
            f"(95 %: {low:.4g} to {high:.4g})"
            for cause, name, value, low, high in last.numbers
            if cause in last.sure
        ]
        return f"That ends it: {outcome.words}. {'; '.join(numbers)}."
    if outcome.end == SUSPECT:
        return "It ends here, since the data themselves look wrong: see the last report."
    if outcome.end == NOTHING:
        return (
            "It ends here: no programme that the bench can play would tell more. What would help is another "
            "sensor, or the advice in the last report."
        )
    if outcome.end == NO_MORE:
        return "It ends here, as the budget is spent. With a larger one it goes on from here."
    return f"It waits: {outcome.words}. Started again with the same folder, it goes on from here."


def _likely(believed: Mapping[str, float]) -> list[tuple[str, float]]:
    found = [(name, value) for name, value in believed.items() if value >= _LEAST_SAID]
    return sorted(found, key=lambda item: -item[1])


def _believed(found: LoopFinding) -> str:
    return ", ".join(f"{words(name)} {value:.2f}" for name, value in _likely(found.believed))


def _minutes(minutes: float) -> str:
    return f"{minutes:.0f} minutes" if minutes >= 2.0 else f"{60.0 * minutes:.0f} seconds"


def _counted(number: int, noun: str) -> str:
    names = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
    return f"{names[number] if number < len(names) else number} {noun}{'' if number == 1 else 's'}"


def _markdown(rows: Sequence[Mapping[str, str]]) -> list[str]:
    lines = ["| after | recordings | verdict | believed |", "|---|---|---|---|"]
    return [*lines, *(f"| {' | '.join(row.values())} |" for row in rows)]
