"""The bench of next experiments: how often one settles what first data could not."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.channels import input_channels
from catheter_sim.closed_loop.loop import Recording, dataset_from, minutes_of, plays_of, recorded, sure_causes
from catheter_sim.diagnosis.pipeline import Investigation, best_after, investigate
from catheter_sim.diagnosis.programmes import Programme, bench_of, programmes_within
from catheter_sim.effects import EFFECTS
from catheter_sim.errors import InputError
from catheter_sim.lab.simulated import RANDOM, SimulatedRig, stand_in
from catheter_sim.tables import Table
from hidden_effects.natural import TOLD_APART, commit, distance, whole_code
from hidden_effects.running import read_json, write_json

# ----------------------------------------------------------------------------------------------------
# A draw: a stand-in with a hidden cause whose first data cannot tell which, and what one experiment brings.
#
# First data are what somebody takes who has little time: five single pulls of two channels, none to the end
# of its range and none back. A draw counts if two causes or more are then believed above `UNDECIDED`, and
# rich data would tell the hidden one from the other open ones. The hidden cause follows `nature`'s laws;
# the diagnosis has no part in what is hidden or how large it is. Stand-ins that not even rich data would
# tell are kept apart, each with what the proposed experiment brings: what it settles there, it settles by
# chance.

UNDECIDED = 0.2
ARMS = ("proposed", "fixed", "random")
ATTEMPTS = 20  # stand-ins made for one draw
_KEY = 83
_PULLS = (("train", 0), ("train", 1), ("train", 0), ("heldout", 1), ("heldout", 0))  # role, which channel
_PULL_ROWS = 14
_PULL_SIZE = (0.4, 0.8)  # of the range
_ROW_S = 1.0
_SHARE = 0.1  # of what is hidden, at which it is compared with others


def drawn(seed: int, index: int, robots: Sequence[str]) -> dict[str, Any]:
    """Return the result of one draw; the arguments decide everything but the seconds.

    Args:
        seed, index: of the draw.
        robots: names of the bench's robots, dealt in turn.
    """
    begun = time.monotonic()
    robot = robots[index % len(robots)]
    result: dict[str, Any] = {"seed": seed, "index": index, "robot": robot, "refused": [], "untellable": []}
    for attempt in range(ATTEMPTS):
        generator = np.random.default_rng((_KEY, seed, index, attempt))
        try:
            rig = stand_in(robot, [RANDOM], seed=int(generator.integers(2**31)))
            recordings = first_data(rig, generator)
            found = investigate(dataset_from(rig, recordings, "first"))
        except InputError as error:
            result["refused"].append(str(error))
            continue
        beliefs = found.diagnosis.probabilities
        if len(open_causes(beliefs)) < 2:
            hidden = rig.answer()["hidden"][0]
            result["refused"].append(f"{hidden['cause']}.{hidden['form']}: {found.diagnosis.verdict}")
            continue
        told: dict[str, Any] = {"hidden": rig.answer()["hidden"][0], "first": said(found)}
        told["apart"] = apart(rig, open_causes(beliefs))
        if tellable(told):
            told["arms"] = _arms(rig, recordings, found, generator, ARMS)
            result |= {"attempt": attempt, **told}
            break
        told["arms"] = _arms(rig, recordings, found, generator, ARMS[:1])
        result["untellable"].append(told)
    result["seconds"] = round(time.monotonic() - begun, 1)
    return result


def open_causes(beliefs: Mapping[str, float]) -> list[str]:
    """Return the causes that are believed above `UNDECIDED`."""
    return [name for name in EFFECTS if beliefs.get(name, 0.0) > UNDECIDED]


def apart(rig: SimulatedRig, causes: Sequence[str]) -> dict[str, float | None]:
    """Return how far each open cause stays from what is hidden on rich trials, over the noise.

    By nature's own arithmetic (`hidden_effects.natural`) on four trials of loops, walks and holds over the
    whole reach: below `TOLD_APART` nobody could tell the two apart by these outputs, however the robot is
    driven. None where too many numbers are free. A tenth of what is hidden is asked about, and the distance
    taken ten times, with either sign: forms end at a largest size, and some have one sign, which is no reason
    why one could not be the other.
    """
    right = accepted(rig.answer()["hidden"][0])
    found: dict[str, float | None] = {}
    for name in causes:
        if name in right:
            continue
        for side in (_SHARE, -_SHARE):
            small = [replace(item, size=side * item.size) for item in rig.planted]
            value = distance(rig.ground, small, [name])
            if value is not None:
                found[name] = min(found.get(name) or np.inf, value / _SHARE)
            found.setdefault(name, None)
    return found


def tellable(result: Mapping[str, Any]) -> bool:
    """Return whether rich data would tell the hidden cause from every open one."""
    return all(value is None or value >= TOLD_APART for value in result["apart"].values())


def accepted(hidden: Mapping[str, Any]) -> set[str]:
    """Return the names that are right for what is hidden."""
    return {hidden["cause"], *hidden["also"]}


def said(found: Investigation) -> dict[str, Any]:
    """Return what a diagnosis says, as a document."""
    diagnosis = found.diagnosis
    beliefs = diagnosis.probabilities
    return {
        "verdict": diagnosis.verdict,
        "named": [cause.name for cause in diagnosis.causes],
        "indistinguishable": [list(group) for group in diagnosis.indistinguishable],
        "probabilities": {name: round(float(p), 4) for name, p in diagnosis.probabilities.items()},
        "believed": {name: round(float(p), 4) for name, p in beliefs.items()},
        "sure": list(sure_causes(beliefs)),
    }


def first_data(rig: SimulatedRig, generator: np.random.Generator) -> list[Recording]:
    """Return five single pulls of two channels, or of the only one."""
    columns = list(input_channels(rig.robot))
    order = generator.permutation(len(columns))
    found = []
    for number, (role, which) in enumerate(_PULLS, start=1):
        column = columns[int(order[which % len(columns)])]
        size = generator.uniform(*_PULL_SIZE) * rig.limits.inputs[column][1]
        values = {name: np.zeros(_PULL_ROWS) for name in columns}
        values[column] = np.round(np.linspace(0.0, size, _PULL_ROWS), 4)
        inputs = Table(_ROW_S * np.arange(float(_PULL_ROWS)), values, f"first_{number}")
        recording = recorded(rig, f"first_{number}", role, inputs)
        assert recording is not None  # a simulated bench answers at once
        found.append(recording)
    return found


def _arms(
    rig: SimulatedRig,
    first: list[Recording],
    found: Investigation,
    generator: np.random.Generator,
    arms: Sequence[str],
) -> dict[str, Any]:
    """Return what each way of choosing an experiment brings; all take as long as the proposed one."""
    proposal = best_after(found, rig.limits.inputs, rig.limits.duration_s)
    best = proposal.best.programme
    length_s = float(best.table.time_s[-1])
    bench = bench_of(input_channels(rig.robot), rig.limits.inputs, _ROW_S, rig.limits.duration_s)
    library = programmes_within(bench)
    other = library[int(generator.integers(len(library)))]
    chosen = {
        "proposed": best,
        "fixed": lasting(_fixed(library), length_s),
        "random": lasting(other, length_s),
    }
    result: dict[str, Any] = {}
    for arm in arms:
        programme = chosen[arm]
        if arm == "fixed" and programme.words == best.words:
            result[arm] = dict(result["proposed"])
            continue
        begun = time.monotonic()
        try:
            plays = plays_of(programme.table, rig.robot, arm)
            recordings = [recorded(rig, name, role, inputs) for name, role, inputs in plays]
            data = dataset_from(rig, [*first, *(item for item in recordings if item is not None)], arm)
            end = said(investigate(data))
        except InputError as error:
            end = {"failure": str(error), "sure": [], "believed": {}}
        end |= {"programme": programme.words, "minutes": round(minutes_of(programme.table), 2)}
        result[arm] = end | {"seconds": round(time.monotonic() - begun, 1)}
    result["proposed"] |= {
        "nats": round(proposal.best.information.nats, 3),
        "alive": {item.about: round(item.belief, 3) for item in proposal.hypotheses},
        "sensors": [item.words for item in proposal.sensors],
    }
    return result


def _fixed(library: Sequence[Programme]) -> Programme:
    """Return what everybody plays who does not choose: each channel's loops, one after the other."""
    return next((item for item in library if item.words.startswith("each channel alone")), library[-1])


def lasting(programme: Programme, length_s: float) -> Programme:
    """Return a programme repeated, or cut, such that it lasts as long as asked."""
    table, parts, start = programme.table, [], 0.0
    step_s = float(table.time_s[1] - table.time_s[0])
    while start <= length_s:
        parts.append((start + table.time_s, table.columns))
        start += float(table.time_s[-1]) + step_s
    time_s = np.concatenate([times for times, _ in parts])
    kept = time_s <= length_s + 1e-9
    kept[:2] = True
    columns = {name: np.concatenate([columns[name] for _, columns in parts])[kept] for name in table.columns}
    return Programme(programme.words, Table(time_s[kept], columns, table.where))


# ----------------------------------------------------------------------------------------------------
# Draws of the bench of next experiments, each in a file of its own: a run goes on where another stopped.


def drawn_once(root: Path, seed: int, robots: Sequence[str], index: int) -> dict[str, Any]:
    """Return the result of a draw; one that lies in `root` is not made again."""
    path = root / "draws" / f"draw_{index:03d}.json"
    known = read_json(path)
    if known is not None:
        return dict(known)
    result = drawn(seed, index, robots) | {"commit": commit(), "code": whole_code()}
    write_json(result, path)
    return result


def results_in(root: Path) -> list[dict[str, Any]]:
    """Return the draws that lie in a folder, in order."""
    found = [read_json(path) for path in sorted((root / "draws").glob("draw_*.json"))]
    return sorted((item for item in found if item is not None), key=lambda item: int(item["index"]))


# ----------------------------------------------------------------------------------------------------
# The table of the bench of next experiments: how many each way of choosing settles, and how many falsely.

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
