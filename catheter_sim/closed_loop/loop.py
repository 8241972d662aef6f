"""Diagnose, propose, measure, diagnose all together: until one cause is sure, or the budget ends."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from catheter_sim.channels import input_channels
from catheter_sim.closed_loop.experiment import (
    Recording,
    dataset_from,
    minutes_of,
    plays_of,
    recorded,
    sure_causes,
)
from catheter_sim.closed_loop.folder import Found, LoopFolder, Proposed, Step
from catheter_sim.diagnosis.pipeline import Investigation, best_after, investigate, write_diagnosis
from catheter_sim.diagnosis.programmes import bench_of, programmes_within
from catheter_sim.diagnosis.report import sentence
from catheter_sim.diagnosis.result import DATA_SUSPECT
from catheter_sim.diagnosis.thresholds import NATS_PER_MINUTE, SURE_BELIEF
from catheter_sim.diagnosis.workers import SERIAL, Workers
from catheter_sim.errors import InputError
from catheter_sim.lab.rig import Rig

SURE, NO_MORE, SUSPECT, NOTHING, WAITING = "sure", "budget", "suspect", "nothing to ask", "waiting"
LEAST_WORTH = 0.02  # nat: an experiment that promises less is none
_ROW_S = 1.0  # from row to row of the first experiment
_POLL_S = 0.5  # between two looks for a recording


@dataclass(frozen=True)
class Budget:
    """How much may be spent.

    Attributes:
        experiments: most experiments after the first data.
        minutes: of the bench's time, all plays.
        price: of a minute [nat].
        wait_s: how long to wait for a recording before the loop stops to be gone on with [s].
    """

    experiments: int = 5
    minutes: float = math.inf
    price: float = NATS_PER_MINUTE
    wait_s: float = 0.0


@dataclass(frozen=True)
class Outcome:
    """How a loop ended, or where it waits.

    Attributes:
        steps: diagnoses and proposals, in order.
        end: `SURE`, `NO_MORE` (the budget), `SUSPECT` (the data look wrong), `NOTHING` (no programme would
            tell anything), or `WAITING`.
        causes: the causes that are sure.
        words: what it waits for, or why it ended.
    """

    steps: tuple[Step, ...]
    end: str
    causes: tuple[str, ...]
    words: str


def run_loop(
    rig: Rig,
    folder: Path,
    first: Sequence[Recording] = (),
    budget: Budget | None = None,
    place: Workers = SERIAL,
    progress: bool = False,
    say: Callable[[str], None] = lambda line: None,
) -> Outcome:
    """Run a closed loop, or go on with one whose folder is given.

    Args:
        rig: the bench.
        folder: where recordings, steps and the last report are kept.
        first: recordings that there are already; without any, the loops of each channel are played first.
        budget: how much may be spent; default: `Budget()`.
        place: where to fit.
        progress: show what a diagnosis is doing.
        say: called with a line where something was found, proposed or measured.

    Raises:
        InputError: the folder holds another bench's loop, a recording is not what it must be, or the bench
            cannot do what is asked.
    """
    spend, kept = budget or Budget(), LoopFolder(folder)
    about = {
        "robot": rig.reference,
        "gravity_mps2": [float(value) for value in rig.gravity_mps2],
        "columns": list(rig.columns),
    }
    steps = kept.steps(about)
    if not steps:
        if first:
            kept.keep_recordings(rig, first)
        else:
            steps.append(Step(0, None, _first_experiment(rig, kept)))
            kept.keep(steps, about)
    while True:
        if steps and steps[-1].end:
            if steps[-1].end != NO_MORE or _spent(steps, spend):
                return _outcome(steps, steps[-1].end)
            steps.pop()  # the budget is larger now: what to do next is asked again
        if steps and steps[-1].proposed is not None:
            waits = _measure(rig, kept, steps[-1].proposed, spend.wait_s, say)
            if waits:
                return Outcome(tuple(steps), WAITING, (), waits)
        steps.append(_next_step(rig, kept, steps, spend, place, progress, say))
        kept.keep(steps, about)


def _outcome(steps: Sequence[Step], end: str) -> Outcome:
    found = steps[-1].found
    words = {
        SURE: f"one cause stands at {SURE_BELIEF:g} or more",
        NO_MORE: "the budget is spent",
        SUSPECT: "the data look wrong",
        NOTHING: "no programme that the bench can play would tell more",
    }
    return Outcome(tuple(steps), end, tuple(found.sure) if found is not None else (), words[end])


def _spent(steps: Sequence[Step], budget: Budget) -> bool:
    """Return whether no further experiment may be made."""
    made = [step.proposed for step in steps if step.proposed is not None and step.found is not None]
    return len(made) >= budget.experiments or sum(item.minutes for item in made) >= budget.minutes


def _first_experiment(rig: Rig, kept: LoopFolder) -> Proposed:
    """Return what is played where nothing is known: the loops of each channel."""
    library = programmes_within(
        bench_of(input_channels(rig.robot), rig.limits.inputs, _ROW_S, rig.limits.duration_s)
    )
    if not library:
        raise InputError(f"lab: no programme takes less than {rig.limits.duration_s:g} s; allow more time")
    loops = [item for item in library if "loops" in item.words]
    chosen = next(
        (item for item in loops if item.words.startswith("each channel alone")), (loops or library)[0]
    )
    kept.keep_programme("first", chosen.table)
    return Proposed("first", chosen.words, minutes_of(chosen.table), tried=1)


def _measure(
    rig: Rig, kept: LoopFolder, proposed: Proposed, wait_s: float, say: Callable[[str], None]
) -> str:
    """Record the plays of an experiment that are missing; return what the bench waits for, "" for nothing."""
    recordings, programme = kept.recordings(), kept.programme(proposed.name)
    there = {file for file, _, _ in recordings}
    waits = ""
    for name, role, inputs in plays_of(programme, rig.robot, proposed.name):
        if f"{name}.csv" in there:
            continue
        until = time.monotonic() + wait_s
        found = recorded(rig, name, role, inputs)
        while found is None and time.monotonic() < until:
            time.sleep(_POLL_S)
            table = rig.read()
            found = None if table is None else (f"{name}.csv", role, table)
        if found is None:  # the others may have arrived, in whatever order
            waits = waits or rig.waiting()
            continue
        recordings.append(found)
        kept.keep_recordings(rig, recordings)
        say(f"measured {name}: {len(found[2].time_s)} rows")
    return waits


def _next_step(
    rig: Rig,
    kept: LoopFolder,
    steps: Sequence[Step],
    budget: Budget,
    place: Workers,
    progress: bool,
    say: Callable[[str], None],
) -> Step:
    """Diagnose all that was recorded; return what was found and what to do next."""
    recordings = kept.recordings()
    say(f"diagnosing {len(recordings)} recordings")
    found = investigate(dataset_from(rig, recordings, "recordings of a closed loop"), place, progress)
    write_diagnosis(found.diagnosis, kept.report)
    told = _told(found)
    say(f"{found.diagnosis.verdict}: {_open_words(told)}")
    if told.sure:
        return Step(len(recordings), told, None, SURE)
    if found.diagnosis.verdict == DATA_SUSPECT:
        return Step(len(recordings), told, None, SUSPECT)
    if _spent(steps, budget):
        return Step(len(recordings), told, None, NO_MORE)
    proposed = _propose(rig, kept, found, steps, budget, place)
    if proposed is None:
        return Step(len(recordings), told, None, NOTHING)
    say(f"proposed {proposed.name}, {proposed.minutes:.3g} min: {proposed.words}")
    return Step(len(recordings), told, proposed)


def _propose(
    rig: Rig, kept: LoopFolder, found: Investigation, steps: Sequence[Step], budget: Budget, place: Workers
) -> Proposed | None:
    best = best_after(found, rig.limits.inputs, rig.limits.duration_s, budget.price, place)
    spent = sum(
        step.proposed.minutes for step in steps if step.proposed is not None and step.found is not None
    )
    played = {step.proposed.words for step in steps if step.proposed is not None}
    fits = [
        item
        for item in best.ranking
        if item.programme.words not in played
        and item.information.nats >= LEAST_WORTH
        and minutes_of(item.programme.table) <= budget.minutes - spent
    ]
    if not fits:
        return None
    chosen = fits[0]
    name = f"experiment_{sum(step.proposed is not None and step.found is not None for step in steps) + 1}"
    kept.keep_programme(name, chosen.programme.table)
    return Proposed(
        name,
        chosen.programme.words,
        minutes_of(chosen.programme.table),
        chosen.information.nats,
        chosen.information.settled,
        len(best.ranking),
        {item.about: item.belief for item in best.hypotheses},
        best.off if chosen is best.best else {},
        [item.words for item in best.sensors] if chosen is best.best else [],
    )


def _told(found: Investigation) -> Found:
    diagnosis = found.diagnosis
    beliefs = diagnosis.probabilities
    numbers = [
        (cause.name, name, float(item.value), float(item.ci95[0]), float(item.ci95[1]))
        for cause in diagnosis.causes
        for name, item in cause.parameters.items()
    ]
    return Found(
        diagnosis.verdict,
        {name: float(value) for name, value in beliefs.items()},
        sentence(diagnosis),
        list(sure_causes(beliefs)),
        numbers,
        [list(group) for group in diagnosis.indistinguishable],
    )


def _open_words(found: Found) -> str:
    shown = sorted(found.believed.items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {value:.2f}" for name, value in shown if value >= 0.1) or "nothing above 0.1"
