"""Measurements without frozen readings, in the robot's base frame, parted for the test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.base_frame.move import registered
from catheter_sim.diagnosis.base_frame.register import register
from catheter_sim.diagnosis.base_frame.registration import Registration, unmoved
from catheter_sim.diagnosis.data.enough import can_be_fitted, too_little
from catheter_sim.diagnosis.data.frozen_readings import without_frozen_readings, without_old_readings
from catheter_sim.diagnosis.data.parting import split
from catheter_sim.diagnosis.data.resolution import resolution_of
from catheter_sim.diagnosis.data.same_readings import without_copies
from catheter_sim.diagnosis.data.trials import Dataset, Trial
from catheter_sim.diagnosis.data_faults.beyond_robot import beyond_robot, within_robot
from catheter_sim.diagnosis.data_faults.copied import copied_rows
from catheter_sim.diagnosis.data_faults.mistakes import most_likely_mistake
from catheter_sim.diagnosis.data_faults.model_error import relative_error_of
from catheter_sim.diagnosis.fitting.twins import twin_of
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import MISTAKE_SURER
from catheter_sim.theory.predict import Prediction

BEYOND = "beyond_robot"  # the code of notes on numbers that are far beyond the robot


@dataclass(frozen=True)
class Prepared:
    """Measurements that can be fitted.

    Attributes:
        dataset: without frozen readings, in the robot's base frame.
        train, heldout: its trials, parted.
        registration: how positions were moved into the base frame.
        twin: what its fits go by.
        notes: on the files, on frozen sensors and on the twin.
        faults: what looks wrong with the files themselves, before anything is computed.
        lacking: what was measured too little to name any cause.
    """

    dataset: Dataset
    train: tuple[Trial, ...]
    heldout: tuple[Trial, ...]
    registration: Registration
    twin: Prediction
    notes: tuple[Note, ...]
    faults: tuple[DataFault, ...] = ()
    lacking: tuple[DataFault, ...] = ()


@dataclass(frozen=True)
class Readings:
    """Measurements as the files have them, before any model is asked.

    Attributes:
        dataset: without copies and frozen readings.
        train, heldout: its trials, parted.
        notes: on the files and on frozen sensors.
        faults: what looks wrong with the files themselves.
        lacking: what was measured too little to name any cause.
    """

    dataset: Dataset
    train: tuple[Trial, ...]
    heldout: tuple[Trial, ...]
    notes: tuple[Note, ...]
    faults: tuple[DataFault, ...]
    lacking: tuple[DataFault, ...]

    @property
    def can_be_fitted(self) -> bool:
        """Return whether there is enough to fit anything, if nothing can be named."""
        return can_be_fitted(self.train, self.heldout, self.dataset.output_channels)


def readings_of(dataset: Dataset) -> Readings:
    """Return what a data set's files hold that can be used."""
    single, twice, copies = without_copies(replace(dataset, resolution=resolution_of(dataset)))
    new, old = without_old_readings(single)
    readings, frozen = without_frozen_readings(new)
    train, heldout = split(readings)
    notes, faults = (*readings.notes, *twice, *old, *frozen), copied_rows(single.trials, copies)
    return Readings(readings, train, heldout, notes, faults, lacking_in(readings, train, heldout))


def lacking_in(dataset: Dataset, train: Sequence[Trial], heldout: Sequence[Trial]) -> tuple[DataFault, ...]:
    """Return what was measured too little to name any cause; (): nothing."""
    said = too_little(train, heldout, dataset.output_channels, dataset.motion.moving)
    return tuple(DataFault(text, is_lack=True) for text in said)


def prepare(dataset: Dataset, read: Readings | None = None) -> Prepared:
    """Return a data set as it can be fitted; `read`: what `readings_of` makes of it, if known."""
    read = read or readings_of(dataset)
    chosen = twin_of(read.dataset, read.train)
    readings, impossible, far = within_reach(read.dataset, chosen.predict)
    moved, registration = in_base_frame(readings, chosen.predict)
    train, heldout = split(moved)
    short = (Note("too_little", item.words) for item in read.lacking)
    notes, faults = (*far, *read.notes, *chosen.notes, *short), impossible or read.faults
    return Prepared(moved, train, heldout, registration, chosen.predict, notes, faults, read.lacking)


def within_reach(
    dataset: Dataset, twin: Prediction
) -> tuple[Dataset, tuple[DataFault, ...], tuple[Note, ...]]:
    """Return a data set that a model can follow, why it is impossible as it was measured, and notes.

    Commands or motions far beyond the robot are a note. They are a fault where no such robot can have been
    measured, or no model follows them. Commands are cut off then, so that a model can be shown beside them.

    Args:
        dataset: as measured.
        twin: what its fits go by.
    """
    beyond = beyond_robot(dataset.robot, dataset.trials)
    train, _ = split(dataset)
    robot = replace(dataset.robot, actuation=train[0].inputs.actuation)

    def predict(inputs: Inputs) -> Array:
        return twin([robot], inputs, 1)[0]

    def followed() -> bool:
        return all(bool(np.isfinite(predict(trial.inputs)).all()) for trial in dataset.trials)

    if not beyond or not (any(item.impossible for item in beyond) or not followed()):
        return dataset, (), tuple(Note(BEYOND, f"{item.words()}.") for item in beyond)
    found = most_likely_mistake(train, dataset.output_channels, robot, predict, shifted=True)
    words = [item.words() for item in beyond] if found is None else [f"{beyond[0].what}: {found.words}"]
    trials = tuple(replace(trial, inputs=within_robot(robot, trial.inputs)) for trial in dataset.trials)
    note = Note(BEYOND, "Commands are cut off at what bends the robot fully.")
    return replace(dataset, trials=trials), tuple(map(DataFault, words)), (note,)


def in_base_frame(dataset: Dataset, twin: Prediction | None = None) -> tuple[Dataset, Registration]:
    """Return the data set with its positions in the robot's base frame, and how they were moved there.

    A mistake in the data, such as inches for mm, may look like a tracker far away. Where putting it right
    does better than any motion, nothing is moved, and `find_data_faults` will name the mistake.

    Args:
        dataset: as measured.
        twin: what its fits go by; None: it is chosen.
    """
    train, _ = split(dataset)
    twin = twin or twin_of(dataset, train).predict
    robot, columns = replace(dataset.robot, actuation=train[0].inputs.actuation), dataset.output_channels
    registration = register(train, columns, robot, twin)
    if not registration.applied:
        return dataset, registration

    def predict(inputs: Inputs) -> Array:
        return twin([robot], inputs, 1)[0]

    moved_there = registered(dataset, registration)
    found = most_likely_mistake(train, columns, robot, predict, solved=math.inf)
    there = relative_error_of(split(moved_there)[0], columns, predict, shifted=True)
    if found is not None and found.error < MISTAKE_SURER * there:
        return dataset, unmoved(registration)
    return moved_there, registration
