"""A diagnosis whose series come from a robot's twin, without a search, for pages that move."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Marker
from catheter_sim.diagnosis.problem import Problem, Term, fitted_numbers, start_of
from catheter_sim.diagnosis.result import (
    Candidate,
    Cause,
    DiagnosisResult,
    FittedParameter,
    NextExperiment,
    UnitResult,
)
from catheter_sim.diagnosis.trials import Dataset, Trial
from catheter_sim.diagnosis.verdict import trial_fits
from catheter_sim.tables import Table
from catheter_sim.theory.twins import twin_for

TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
SEVERAL = (*TIP, "body_5_x_mm", "body_5_z_mm", "marker_ring_x_mm", "marker_ring_z_mm")
GRAVITY = np.zeros(3)


def _inputs(rows: int, size_N: float) -> Inputs:
    pull = size_N * np.abs(np.sin(np.linspace(0.0, 9.0, rows)))
    zeros = np.zeros((rows, 3))
    return Inputs(np.arange(float(rows)), "tension", np.stack([pull, 0.0 * pull], axis=1), zeros, zeros)


def fitted(dataset: Dataset, term: Term, value: float) -> DiagnosisResult:
    """Return a diagnosis of a data set whose series are the model's as specified, and with one number."""
    predict = twin_for(
        dataset.robot, dataset.trials[0].inputs.actuation, dataset.output_channels, dataset.gravity_mps2
    )
    columns = dataset.output_channels
    problem = Problem(dataset.robot, (), (), columns, np.ones(len(columns)), predict)
    fits = trial_fits(problem, dataset.trials, *_with_number(problem, term, value))
    return replace(moving_diagnosis(), dataset=dataset, fits=fits, extended_robot=dataset.robot)


def _with_number(problem: Problem, term: Term, value: float) -> Any:
    """Return the fits of nothing, and of one number at a value."""
    numbers = fitted_numbers(problem, (term,))
    return (
        SimpleNamespace(numbers=(), x=np.zeros(0)),
        SimpleNamespace(numbers=numbers, x=start_of(numbers, {(term.effect, term.free[0]): value})),
    )


def moving_diagnosis(rows: int = 60, columns: tuple[str, ...] = TIP, name: str = "loops") -> DiagnosisResult:
    """Return a diagnosis of two trials, the last held out, with a gain of 1.2 in it; rows in all: `rows`."""
    robot = replace(
        load_robot("neuroendoscope_section"),
        actuation="tension",
        markers=(Marker("ring", 4, 5e-3, 0.0, 1e-3),),
    )
    predict = twin_for(robot, "tension", columns, GRAVITY)
    problem = Problem(robot, (), (), columns, np.ones(len(columns)), predict)
    values = _with_number(problem, Term("actuation_gain", ("scale",)), 1.2)
    gained = replace(robot, effects={"actuation_gain": {"scale": 1.2}})
    generator = np.random.default_rng(5)
    trials = []
    for file, role, count in (("a.csv", "train", rows - rows // 4), (f"{name}.csv", "heldout", rows // 4)):
        inputs = _inputs(count, 0.4 if role == "train" else 0.35)
        truth = predict([gained], inputs)[0]
        seen = truth + generator.normal(0.0, 0.05, truth.shape)
        seen[3] = np.nan
        table = Table(inputs.time_s, dict(zip(columns, seen.T, strict=True)), file)
        trials.append(Trial(file, role, inputs, table))
    dataset = Dataset(
        folder=Path(name),
        name=name,
        robot=robot,
        robot_reference="neuroendoscope_section",
        source="made for a test",
        licence="CC0",
        gravity_mps2=GRAVITY,
        input_channels=("tension_right_N",),
        output_channels=columns,
        trials=tuple(trials),
    )
    gain = Cause(
        "actuation_gain",
        {"scale": FittedParameter(1.2, (1.18, 1.22), 1.0)},
        95.0,
        probability=0.94,
        members={"actuation_gain": 0.71, "stiffness": 0.23},
    )
    return DiagnosisResult(
        dataset=dataset,
        verdict="cause_found",
        unit="mm",
        by_unit={"mm": UnitResult("mm", 0.05, 3.1, 0.06, 98.0, (97.0, 99.0))},
        causes=(gain,),
        ranking=(
            Candidate(("actuation_gain",), 0.06, 0.06),
            Candidate(("stiffness",), 0.9, 0.8),
            Candidate(("backlash", "stiffness"), 0.7, 1.2),
            Candidate((), 3.1, 3.0),
        ),
        indistinguishable=(("actuation_gain", "stiffness"),),
        next_experiment=NextExperiment("Nothing more is needed."),
        extended_robot=gained,
        fits=trial_fits(problem, trials, *values),
        probabilities={"actuation_gain": 0.71, "stiffness": 0.23, "backlash": 0.12, "outside": 0.05},
    )
