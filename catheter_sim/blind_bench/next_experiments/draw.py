"""A draw: a stand-in with a hidden cause whose first data cannot tell which, and what one experiment brings.

First data are what somebody takes who has little time: five single pulls of two channels, none to the end of
its range and none back. A draw counts if two causes or more are then believed above `UNDECIDED`, and rich
data would tell the hidden one from the other open ones. The hidden cause follows `nature`'s laws; the
diagnosis has no part in what is hidden or how large it is. Stand-ins that not even rich data would tell are
kept apart, each with what the proposed experiment brings: what it settles there, it settles by chance.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from catheter_sim.blind_bench.nature.rivals import TOLD_APART, distance
from catheter_sim.channels import input_channels
from catheter_sim.closed_loop.experiment import (
    Recording,
    dataset_from,
    minutes_of,
    plays_of,
    recorded,
    sure_causes,
)
from catheter_sim.diagnosis.pipeline import Investigation, best_after, investigate
from catheter_sim.diagnosis.programmes import Programme, bench_of, programmes_within
from catheter_sim.effects import EFFECTS
from catheter_sim.errors import InputError
from catheter_sim.lab.simulated import RANDOM, SimulatedRig, stand_in
from catheter_sim.tables import Table

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

    By nature's own arithmetic (`nature.rivals`) on four trials of loops, walks and holds over the whole
    reach: below `TOLD_APART` nobody could tell the two apart by these outputs, however the robot is driven.
    None where too many numbers are free. A tenth of what is hidden is asked about, and the distance taken ten
    times, with either sign: forms end at a largest size, and some have one sign, which is no reason why one
    could not be the other.
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
