"""What to measure next: inputs that tell rivals apart, tried in the twin and the simulation, or words.

Causes that explain the measurements equally well may differ on other inputs. The twin plays each series of
inputs (`programmes`) with the chosen causes. The rival is then fitted anew to the measurements *and* to that
series, so that only what it cannot follow counts. The series on which the rival errs most is proposed, and
both are simulated on it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import read_inputs
from catheter_sim.diagnosis.causes.comparison import rivals_of
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.fitting.evidence import outputs_of
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.prediction import robot_with
from catheter_sim.diagnosis.fitting.problem import Problem, with_fewer_rows
from catheter_sim.diagnosis.fitting.workers import SERIAL, OutOfTime, Workers, map_calls
from catheter_sim.diagnosis.next_experiment.in_motion import moving_programmes
from catheter_sim.diagnosis.next_experiment.programmes import Programme, loops, programmes
from catheter_sim.diagnosis.report.next_experiment import NEXT_EXPERIMENT_FILE, NextExperiment, Separation
from catheter_sim.diagnosis.thresholds import ENOUGH_APART_NOISE, TELLS_APART_NOISE
from catheter_sim.diagnosis.verdict.replay import replays
from catheter_sim.effects import EFFECTS
from catheter_sim.errors import InputError
from catheter_sim.tables import Table

_LOOPS = (
    "The CSV drives each channel alone through a full loop, a half loop and a reversal on the way. Then it "
    "repeats the first channel's loops: the repeat shows noise, drift and random slip."
)


def next_experiment(
    problem: Problem,
    chosen: Fit,
    likeliest: Sequence[str],
    equals: Sequence[Fit],
    groups: Sequence[Sequence[str]],
    noise: Array,
    gravity_mps2: Array,
    simulation: bool = True,
    pool: Workers = SERIAL,
    deadline: float = math.inf,
) -> NextExperiment:
    """Return what to measure next.

    Args:
        problem: the training trials; new inputs stay inside their range.
        chosen: the hypothesis of the verdict, fitted to them.
        likeliest: its causes and corrections, the most probable first.
        equals: hypotheses that explain the data as well, with another effect in the place of one of its.
        groups: effects that these data cannot tell apart, the chosen one first.
        noise: of each output column, shape (o,), in file units.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        simulation: whether to try the proposal in the simulation too.
        pool: where to fit and simulate.
        deadline: on the clock of `time.monotonic`, after which no inputs are tried any more [s].
    """
    if not groups:
        checking = advice(likeliest[:1], f"To check {_said(likeliest[:1])}: ")
        table = loops(problem.robot, problem.trials)
        return NextExperiment(f"{checking} {_LOOPS}".strip(), table)
    rivals = _rivals(chosen, equals)
    choices = moving_programmes if problem.moving else programmes
    playable = [item for item in choices(problem.robot, problem.trials) if _played(problem, chosen, item)]
    if not playable:  # the twin follows none of them
        return _in_words(groups)
    few = with_fewer_rows(replace(problem, model_share=0.0))  # a plan needs no more of a motion than that
    work = [(few, chosen, rival, item, noise) for item in playable for rival in rivals.values()]
    try:
        found = map_calls(pool, _refitted, work, deadline)
    except OutOfTime:
        return _in_words(groups)
    apart = np.array([size for _, size in found]).reshape(len(playable), len(rivals))
    best = int(np.argmax(np.minimum(apart, ENOUGH_APART_NOISE).sum(axis=1)))
    trial = _played(problem, chosen, playable[best])
    assert trial is not None
    refits = [item for item, _ in found[best * len(rivals) : (best + 1) * len(rivals)]]
    simulated = [float("nan")] * len(rivals)
    if simulation and apart[best].max() >= TELLS_APART_NOISE:
        robots = [robot_with(problem, item.numbers, item.x) for item in (chosen, *refits)]
        runs = [(robot, [trial], problem.columns, gravity_mps2, SERIAL, problem.moving) for robot in robots]
        outputs = [item[0].outputs for item in map_calls(pool, replays, runs)]
        simulated = [_apart(outputs[0], other, noise) for other in outputs[1:]]
    checked = {
        name: Separation(float(twin), float(again))
        for name, twin, again in zip(rivals, apart[best], simulated, strict=True)
    }
    sentences = [f"Play the CSV: {playable[best].words}."] if apart[best].max() >= TELLS_APART_NOISE else []
    sentences += [_group_words(group, checked) for group in groups]
    return NextExperiment(" ".join(sentences), playable[best].table, checked)


def _in_words(groups: Sequence[Sequence[str]]) -> NextExperiment:
    """Return how groups of effects are told apart by other means than by inputs."""
    words = [advice(group, f"To tell {_said(group)} apart: ") for group in groups]
    return NextExperiment(" ".join(item for item in words if item))


def advice(names: Sequence[str], before: str = "") -> str:
    """Return how effects are told apart by other means, after the words `before`; "" where none is known.

    The effects' own advice is looked through from the measurement back to the command.
    """
    wanted = min(2, len(names))
    for effect in reversed(list(EFFECTS.values())):
        for others, words in effect.advice.items():
            if names and len({effect.name, *others} & set(names)) >= wanted:
                return before + words
    return ""


def _group_words(group: Sequence[str], checked: dict[str, Separation]) -> str:
    """Return what the proposed inputs would show of one group, and what else to do where they show
    nothing."""
    first, *others = group
    told = [name for name in others if checked[_for(name, first)].twin >= TELLS_APART_NOISE]
    words = []
    for name in told:
        item = checked[_for(name, first)]
        simulated = item.simulation
        again = f", {simulated:.1f} times in the simulation" if np.isfinite(simulated) else ""
        words.append(
            f"If the cause is {_said([first])}, a refitted {_said([name])} would miss the new data by "
            f"{item.twin:.1f} times the noise{again}."
        )
    left = [name for name in others if name not in told]
    if left:
        alone = advice([first, *left]) or "Measure more of the robot: points along it, or tensions."
        words.append(f"None of the inputs that were tried tells {_said([first])} from {_said(left)}. {alone}")
    return " ".join(words)


def _said(names: Sequence[str]) -> str:
    return " or ".join(name.replace("_", " ") for name in names)


def _for(rival: str, first: str) -> str:
    return f"{rival} for {first}"


def _rivals(chosen: Fit, equals: Sequence[Fit]) -> dict[str, Fit]:
    """Return the best of the fits in which one effect stands in the place of another, by both names."""
    found: dict[str, Fit] = {}
    for gone, come, item in rivals_of(chosen, sorted(equals, key=lambda other: other.cross_validated_rms)):
        found.setdefault(_for(come, gone), item)
    return found


def _played(problem: Problem, chosen: Fit, programme: Programme) -> Trial | None:
    """Return the programme with the twin's outputs, with the chosen causes, as measured; None: it fails on
    it."""
    robot = replace(problem.robot, actuation=problem.trials[0].inputs.actuation)
    try:
        inputs = read_inputs(robot, programme.table)
        trial = Trial(NEXT_EXPERIMENT_FILE, "train", inputs, Table(inputs.time_s, {}, NEXT_EXPERIMENT_FILE))
        outputs = outputs_of(problem, trial, chosen)
    except InputError:
        return None
    if not np.isfinite(outputs).all():
        return None
    columns = {name: outputs[:, index] for index, name in enumerate(problem.columns)}
    return replace(trial, outputs=Table(inputs.time_s, columns, NEXT_EXPERIMENT_FILE))


def _refitted(
    problem: Problem, chosen: Fit, rival: Fit, programme: Programme, noise: Array
) -> tuple[Fit, float]:
    """Return a rival fitted to measurements and a programme, and its error on the programme over the
    noise."""
    trial = _played(problem, chosen, programme)
    assert trial is not None
    result = fit(
        replace(problem, trials=(*problem.trials, trial)), rival.terms, rival.values, cross_validate=False
    )
    measured = np.stack([trial.outputs.columns[name] for name in problem.columns], axis=1)
    return result, _apart(outputs_of(problem, trial, result), measured, noise)


def _apart(first: Array, second: Array, noise: Array) -> float:
    """Return the root mean square difference of outputs (r, o) in units of the noise; 0 where none is
    finite."""
    difference = (first - second) / noise
    difference = difference[np.isfinite(difference)]
    return float(np.sqrt(np.mean(difference**2))) if len(difference) else 0.0
