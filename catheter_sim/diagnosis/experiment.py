"""What to measure next: inputs that would tell rivals apart, tried on both, and words where none does.

Causes that explain what was measured equally well need not do so in what is played next. Each series of
inputs (`programmes`) is played by the twin with the chosen causes; the rival is fitted anew to the
measurements *and* to that, so that only what it cannot follow counts. The series from which most is left is
proposed, and both are simulated on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.diagnosis.confirm import replays
from catheter_sim.diagnosis.evidence import outputs_of
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.hypothesis import Problem, robot_with, thinned
from catheter_sim.diagnosis.programmes import Programme, loops, programmes
from catheter_sim.diagnosis.result import NEXT_EXPERIMENT_FILE, NextExperiment, Separation
from catheter_sim.diagnosis.select import rivals_of
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.diagnosis.workers import HERE, Workers, each
from catheter_sim.errors import InputError
from catheter_sim.robots.channels import read_inputs
from catheter_sim.robots.posture import Array
from catheter_sim.tables import Table

TELLS = 2.0  # times the noise, root mean square, that tell two causes apart for sure
_ENOUGH = 10.0  # times the noise, beyond which more does not matter
_LOOPS = (
    "The CSV drives each channel alone through a full loop, a half loop and a reversal on the way, then "
    "plays the first channel's loops again: the repeat shows noise, drift and what slips at random."
)

_ADVICE: tuple[tuple[set[str], str], ...] = (
    (
        {"backlash", "tendon_friction"},
        "Repeat the loops at two pretensions: friction widens the loop with tension, backlash does not.",
    ),
    (
        {"stiffness", "actuation_gain", "nonlinear_stiffness"},
        "Hang a known weight on the tip at rest: the stiffness answers, the inputs' scale does not.",
    ),
    (
        {"tendon_elongation", "axial_compression", "stiffness"},
        "Measure the tendons' tensions and the shift of the base: they say which part gives way.",
    ),
    (
        {"measurement_frame", "precurvature", "actuation_offset", "twist"},
        "Track two points on the base and one in the middle of the robot: they show the frame and the "
        "shape at rest apart from each other.",
    ),
    (
        {"axial_compression", "nonlinear_stiffness", "tendon_elongation", "actuation_offset"},
        "Pull a segment's tendons together, without bending: only what gives way along the axis answers.",
    ),
    (
        {"payload", "precurvature", "measurement_frame"},
        "Measure the rest shape with the base turned by 180 deg: weight changes sides, shape does not.",
    ),
    (
        {"rate", "backlash", "tendon_friction"},
        "Play the same loops at half and at twice the speed, and hold still in the middle of each way: a "
        "lag's loop changes its width with the speed and closes in the hold, the others' do neither.",
    ),
    (
        {"drift", "actuation_offset", "actuation_gain", "stiffness", "tendon_elongation"},
        "Hold one input for several minutes, return to zero and wait as long: only drift goes on moving.",
    ),
    (
        {"coupling", "actuation_gain", "actuation_offset", "measurement_frame", "twist"},
        "Drive each section or joint alone while the others stand at zero, and then against a pretension of "
        "the others: only coupling moves them.",
    ),
)


def next_experiment(
    problem: Problem,
    chosen: Fit,
    equals: Sequence[Fit],
    groups: Sequence[Sequence[str]],
    noise: Array,
    gravity_mps2: Array,
    simulation: bool = True,
    pool: Workers = HERE,
) -> NextExperiment:
    """Return what to measure next.

    Args:
        problem: the training trials; new inputs stay inside their range.
        chosen: the hypothesis of the verdict, fitted to them.
        equals: hypotheses that explain the data as well, with another effect in the place of one of its.
        groups: effects that these data cannot tell apart, the chosen one first.
        noise: of each output column, shape (o,), in file units.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        simulation: whether to try the proposal in the simulation too.
        pool: where to fit and simulate.
    """
    if not groups:
        checking = advice(chosen.causes[:1], f"To check {_said(chosen.causes[:1])} by itself: ")
        table = loops(problem.robot, problem.trials)
        return NextExperiment(f"{checking} {_LOOPS}".strip(), table)
    rivals = _rivals(chosen, equals)
    playable = [item for item in programmes(problem.robot, problem.trials) if _played(problem, chosen, item)]
    if not playable:  # the twin follows none of them
        words = [advice(group, f"To tell {_said(group)} apart: ") for group in groups]
        return NextExperiment(" ".join(item for item in words if item))
    work = [(thinned(problem), chosen, rival, item, noise) for item in playable for rival in rivals.values()]
    found = each(pool, _refitted, work)
    apart = np.array([size for _, size in found]).reshape(len(playable), len(rivals))
    best = int(np.argmax(np.minimum(apart, _ENOUGH).sum(axis=1)))
    trial = _played(problem, chosen, playable[best])
    assert trial is not None
    refits = [item for item, _ in found[best * len(rivals) : (best + 1) * len(rivals)]]
    simulated = [float("nan")] * len(rivals)
    if simulation and apart[best].max() >= TELLS:
        robots = [robot_with(problem, item.frees, item.x) for item in (chosen, *refits)]
        runs = [(robot, [trial], problem.columns, gravity_mps2) for robot in robots]
        outputs = [item[0].outputs for item in each(pool, replays, runs)]
        simulated = [_apart(outputs[0], other, noise) for other in outputs[1:]]
    checked = {
        name: Separation(float(twin), float(again))
        for name, twin, again in zip(rivals, apart[best], simulated, strict=True)
    }
    sentences = [f"Play the CSV: {playable[best].words}."] if apart[best].max() >= TELLS else []
    sentences += [_group_words(group, checked) for group in groups]
    return NextExperiment(" ".join(sentences), playable[best].table, checked)


def advice(names: Sequence[str], before: str = "") -> str:
    """Return how effects are told apart by other means, after the words `before`; "" where none is known."""
    wanted = min(2, len(names))
    fitting = [text for known, text in _ADVICE if names and len(known & set(names)) >= wanted]
    return before + fitting[0] if fitting else ""


def _group_words(group: Sequence[str], checked: dict[str, Separation]) -> str:
    """Return what the proposed inputs would show of one group, and what else to do where they do not."""
    first, *others = group
    told = [name for name in others if checked[_for(name, first)].twin >= TELLS]
    words = []
    for name in told:
        item = checked[_for(name, first)]
        simulated = item.simulation
        again = f", {simulated:.1f} times in the simulation" if np.isfinite(simulated) else ""
        words.append(
            f"If it is {_said([first])}, {_said([name])}, fitted anew, would be off by "
            f"{item.twin:.1f} times the noise{again}."
        )
    left = [name for name in others if name not in told]
    if left:
        alone = advice([first, *left]) or "Measure more of the robot: points along it, or tensions."
        words.append(f"No inputs that were tried tell {_said([first])} from {_said(left)}. {alone}")
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
    """Return the programme with what the twin says under the chosen causes as measured; None: beyond it."""
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
    """Return a rival fitted to the measurements and a programme, and how far off it is there, in noises."""
    trial = _played(problem, chosen, programme)
    assert trial is not None
    result = fit(
        replace(problem, trials=(*problem.trials, trial)), rival.terms, rival.values, cross_validate=False
    )
    measured = np.stack([trial.outputs.columns[name] for name in problem.columns], axis=1)
    return result, _apart(outputs_of(problem, trial, result), measured, noise)


def _apart(first: Array, second: Array, noise: Array) -> float:
    """Return the root mean square difference of outputs, shape (r, o), in noises; 0 where none is finite."""
    difference = (first - second) / noise
    difference = difference[np.isfinite(difference)]
    return float(np.sqrt(np.mean(difference**2))) if len(difference) else 0.0
