"""The problem that hypotheses are fitted to: robot, twin, calibrated numbers, weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.diagnosis.base_frame.numbers import frame_numbers
from catheter_sim.diagnosis.base_frame.registration import Registration
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.nuisance import Nuisance, nuisances_of
from catheter_sim.diagnosis.data.resolution import resolution_of
from catheter_sim.diagnosis.data.trials import Dataset, Trial, measured_of
from catheter_sim.diagnosis.fitting.fit import fit
from catheter_sim.diagnosis.fitting.noise import residual_noise
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.twins import twin_of
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.stages.prepare import Prepared
from catheter_sim.diagnosis.thresholds import SMALLEST_WEIGHT_SHARE
from catheter_sim.theory.predict import Predict


@dataclass(frozen=True)
class Posed:
    """What is to be fitted, and what it is tested on.

    Attributes:
        dataset: in the base frame.
        registration: how it was moved there.
        train: the problem of the training trials.
        heldout: the same with the held-out trials.
        thorough: whether fits search along valleys. The numbers that a data set itself wants calibrated
            may trade against one another, the others hardly do.
        faults: what looks wrong with the files themselves.
        lacking: what was measured too little to name any cause.
    """

    dataset: Dataset
    registration: Registration
    train: Problem
    heldout: Problem
    thorough: bool
    faults: tuple[DataFault, ...] = ()
    lacking: tuple[DataFault, ...] = ()


def pose(prepared: Prepared) -> Posed:
    """Return the problem of prepared measurements."""
    dataset = prepared.dataset
    frame = frame_numbers(prepared.registration)
    train = training_problem(dataset, prepared.train, frame, prepared.twin)
    heldout = replace(train, trials=prepared.heldout)
    thorough = bool(dataset.calibration)
    return Posed(dataset, prepared.registration, train, heldout, thorough, prepared.faults, prepared.lacking)


def _calibrated(dataset: Dataset) -> tuple[Nuisance, ...]:
    return nuisances_of(dataset.robot_reference) if dataset.calibration is None else dataset.calibration


def training_problem(
    dataset: Dataset,
    train: Sequence[Trial],
    frame: tuple[Nuisance, ...] = (),
    twin: Predict | None = None,
) -> Problem:
    """Return what is to be fitted: the nominal robot, its twin and the training trials.

    Units are weighed by the white part of the calibrated model's residual.

    Args:
        dataset: in the base frame.
        train: its training trials.
        frame: numbers of the tracker's frame to calibrate besides (`base_frame.numbers`).
        twin: what fits go by; None: it is chosen.
    """
    actuation = train[0].inputs.actuation
    robot = replace(dataset.robot, actuation=actuation)
    columns = dataset.output_channels
    twin = twin or twin_of(dataset, train).predict
    problem = Problem(
        robot=robot,
        nuisances=(*_calibrated(dataset), *frame),
        trials=tuple(train),
        columns=columns,
        weight=np.ones(len(columns)),
        twin=twin,
        moving=dataset.motion.moving,
        repeatability=dataset.repeatability,
        resolution=resolution_of(dataset),
        model_share=dataset.model_share,
    )
    spread: dict[str, float] = {}
    for index, name in enumerate(columns):
        values = np.concatenate([measured_of(trial, columns)[:, index] for trial in train])
        spread[unit_of(name)] = max(spread.get(unit_of(name), 0.0), float(np.nanstd(values)), 1e-9)
    problem = replace(problem, weight=np.array([spread[unit_of(name)] for name in columns]))
    noise = residual_noise(problem, fit(problem, (), cross_validate=False))
    weight = [
        max(noise.get(unit_of(name), 0.0), SMALLEST_WEIGHT_SHARE * spread[unit_of(name)]) for name in columns
    ]
    return replace(problem, weight=np.array(weight))
