"""What to measure next: words for what cannot be told apart yet, and a series of inputs to play."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from catheter_sim.diagnosis.result import NextExperiment
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.robots.channels import channel_of, input_channels
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array
from catheter_sim.tables import Table

_ROW_S = 2.0  # time from row to row: slow enough to be quasi-static
_STEPS = 8  # rows of a ramp

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
    robot: Robot, trials: Sequence[Trial], causes: Sequence[str], groups: Sequence[Sequence[str]]
) -> NextExperiment:
    """Return what to measure next.

    Args:
        robot: its channels are driven.
        trials: what was played so far; the new inputs stay inside their range.
        causes: the named causes.
        groups: effects that these data cannot tell apart.
    """
    sentences = []
    for group in groups:
        sentences.append(f"To tell {' from '.join(name.replace('_', ' ') for name in group)}:")
        fitting = [text for names, text in _ADVICE if len(names & set(group)) > 1]
        sentences.append(
            fitting[0] if fitting else "Measure more of the robot: points along it, or tensions."
        )
    if causes and not groups:
        fitting = [text for names, text in _ADVICE if names & set(causes)]
        if fitting:
            sentences.append(f"To check {causes[0].replace('_', ' ')} by itself: {fitting[0]}")
    table = loops(robot, trials)
    sentences.append(
        "The CSV drives each channel alone through a full loop, a half loop and a reversal on the way, then "
        "plays the first channel's loops again: the repeat shows noise, drift and what slips at random."
    )
    return NextExperiment(" ".join(sentences), table)


def loops(robot: Robot, trials: Sequence[Trial]) -> Table:
    """Return nested loops of each channel alone, up to what was reached so far, in file units."""
    kind = trials[0].inputs.actuation
    columns = input_channels(robot, kind)
    channels = channel_of(robot)
    factor = 1e3 if kind == "displacement" else 1.0
    reach = []
    for channel in dict.fromkeys(channels):
        members = [index for index, name in enumerate(channels) if name == channel]
        share = len(members) if kind == "tension" else 1
        top = max(float(trial.inputs.tendon[:, members].max()) for trial in trials)
        reach.append(max(top, 0.0) * factor * share)
    shape = _nested_loops()
    order = [*range(len(columns)), 0]
    values: Array = np.zeros((len(shape) * len(order), len(columns)))
    for position, index in enumerate(order):
        values[position * len(shape) : (position + 1) * len(shape), index] = (
            np.floor(shape * reach[index] * 1e4) / 1e4
        )
    time_s = _ROW_S * np.arange(len(values), dtype=float)
    return Table(
        time_s, {name: values[:, index] for index, name in enumerate(columns)}, "next_experiment.csv"
    )


def _nested_loops() -> Array:
    """Return 0, up to 1, to 0, to 1/2, to 1/4, to 1/2 and back to 0, in equal rows."""
    corners = [0.0, 1.0, 0.0, 0.5, 0.25, 0.5, 0.0]
    parts = [np.zeros(1)]
    for start, end in pairwise(corners):
        count = max(2, round(_STEPS * abs(end - start)))
        parts.append(np.linspace(start, end, count + 1)[1:])
    return np.concatenate(parts)
