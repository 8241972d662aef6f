"""The table of the bench of next experiments: how many each way of choosing settles, and how many falsely."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from catheter_sim.blind_bench.next_experiments.draw import ARMS, accepted

SETTLED_SHARE, FALSE_SHARE, ASKED_DRAWS = 0.9, 0.02, 60
_SIDES = 1.96  # standard deviations of a 95 % interval

Draw = Mapping[str, Any]


def settles(draw: Draw, arm: str) -> bool:
    """Return whether an arm's data make one cause sure, and a right one."""
    sure = draw["arms"][arm]["sure"]
    return bool(sure) and set(sure) <= accepted(draw["hidden"])


def settles_falsely(draw: Draw, arm: str) -> bool:
    """Return whether a cause is sure that is not at work, nor says the same."""
    return not set(draw["arms"][arm]["sure"]) <= accepted(draw["hidden"])


def summary(draws: Sequence[Draw]) -> dict[str, Any]:
    """Return counts by arm, and of the proposed experiments where no data would tell."""
    usable = [draw for draw in draws if "arms" in draw]
    beyond = [item for draw in draws for item in draw["untellable"]]
    refused = sum(len(draw["refused"]) for draw in draws)
    return {
        "draws": len(usable),
        "stand_ins": refused + len(beyond) + len(usable),
        "told_at_first": refused,
        "arms": {arm: _counts(usable, arm) for arm in ARMS},
        "untellable": _counts(beyond, ARMS[0]),
    }


def _counts(draws: Sequence[Draw], arm: str) -> dict[str, int]:
    return {
        "settled": sum(settles(draw, arm) for draw in draws),
        "false": sum(settles_falsely(draw, arm) for draw in draws),
        "of": len(draws),
    }


def as_text(found: Mapping[str, Any], draws: Sequence[Draw]) -> str:
    """Return the table for a reader, with every miss of the proposed experiments."""
    lines = [
        f"{found['draws']} draws whose first data cannot tell, of {found['stand_ins']} stand-ins; of "
        f"{found['told_at_first']} the first data told, or showed nothing, or could not be made"
    ]
    lines += [f"  {arm:10s} {_count_words(item)}" for arm, item in found["arms"].items() if item["of"]]
    if found["untellable"]["of"]:
        lines.append("stand-ins that not even rich data would tell, after the proposed experiment:")
        lines.append(f"  {ARMS[0]:10s} {_count_words(found['untellable'])}")
    enough = found["draws"] >= ASKED_DRAWS
    lines += ["", *(_line(words, met, enough) for words, met in met_lines(found).items()), ""]
    if not enough:
        lines.append(f"nothing is decided by fewer than {ASKED_DRAWS} draws")
    lines += [_miss(draw) for draw in draws if "arms" in draw and not settles(draw, ARMS[0])]
    return "\n".join(lines)


def _count_words(item: Mapping[str, int]) -> str:
    low, high = interval(item["settled"], item["of"])
    share, wrong = (f"{100 * item[key] / item['of']:.0f} %" for key in ("settled", "false"))
    return (
        f"settled {item['settled']:3d} of {item['of']:3d} "
        f"({share}; 95 %: {100 * low:.0f} to {100 * high:.0f}), falsely {item['false']} ({wrong})"
    )


def met_lines(found: Mapping[str, Any]) -> dict[str, bool | None]:
    """Return whether each line of the acceptance is met, None: there are no draws."""
    arms = found["arms"]
    count = arms["proposed"]["of"]
    if not count:
        return {"no draws": None}
    share = {arm: arms[arm]["settled"] / count for arm in ARMS}
    return {
        f"one proposed experiment settles at least {100 * SETTLED_SHARE:.0f} %": share["proposed"]
        >= SETTLED_SHARE,
        "a random programme of equal length settles at most half of that": share["random"]
        <= 0.5 * share["proposed"],
        f"false settlements of the proposed are at most {100 * FALSE_SHARE:.0f} %": arms["proposed"]["false"]
        <= FALSE_SHARE * count,
    }


def interval(count: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927)."""
    share, squared = count / of, _SIDES**2
    middle = (share + squared / (2 * of)) / (1 + squared / of)
    half = _SIDES * math.sqrt(share * (1 - share) / of + squared / (4 * of**2)) / (1 + squared / of)
    return max(0.0, middle - half), min(1.0, middle + half)


def _line(words: str, met: bool | None, enough: bool) -> str:
    if met is None:
        return f"not measured: {words}"
    return f"{'' if enough else 'so far '}{'met' if met else 'MISSED'}: {words}"


def _miss(draw: Draw) -> str:
    end, hidden = draw["arms"][ARMS[0]], draw["hidden"]
    open_now = {name: value for name, value in end.get("believed", {}).items() if value > 0.1}
    return (
        f"draw {draw['index']}, {draw['robot']}, hidden {hidden['cause']}.{hidden['form']}: "
        f"{end.get('verdict', end.get('failure'))} {open_now} after {end['programme']}"
    )
