"""What one trial shows is no fault of the data where a cause leaves no trial more than its noise."""

from __future__ import annotations

from dataclasses import replace

import pytest
from planted import small_data

from catheter_sim.diagnosis.choose import without_explained_faults
from catheter_sim.diagnosis.prepare import DiagnosisRun, Faults, calibrate, prepare, split_problem
from catheter_sim.diagnosis.result import DataFault
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.diagnosis.workers import SERIAL

pytestmark = pytest.mark.slow
JUMP = DataFault("all positions jump here", "trial_0.csv", (10, 40))


def acquitted(dataset: Dataset, faults: Faults, said: list[str] | None = None) -> Faults:
    """Return what is left of these faults; `said` gets what is told meanwhile."""
    split = split_problem(prepare(dataset))
    say = (lambda line: None) if said is None else said.append
    return without_explained_faults(DiagnosisRun(SERIAL, say), split, calibrate(split), faults)


def bumped(dataset: Dataset, size_mm: float) -> Dataset:
    """Return the data with the first trial's tracker moved halfway."""
    trial = dataset.trials[0]
    columns = {name: values.copy() for name, values in trial.outputs.columns.items()}
    for values in columns.values():
        values[len(values) // 2 :] += size_mm
    changed = replace(trial, outputs=replace(trial.outputs, columns=columns))
    return replace(dataset, trials=(changed, *dataset.trials[1:]))


def test_a_jump_that_a_cause_accounts_for_is_no_fault() -> None:
    """A robot whose drives give 0.8 of what is told: what looked like a jump is the gain's."""
    assert acquitted(small_data({"actuation_gain": {"scale": 0.8}}), Faults((JUMP,))) == Faults(())


def test_a_bump_is_a_fault_whatever_is_fitted() -> None:
    """A tracker that was moved by 4 mm halfway, with a cause beside it."""
    data = bumped(small_data({"actuation_gain": {"scale": 0.8}}), 4.0)
    assert acquitted(data, Faults((JUMP,))).found == (JUMP,)


def test_what_is_wrong_with_all_data_is_not_asked_about() -> None:
    """A fault of no trial, or of every one, stays, though a cause accounts for all."""
    data = small_data({"actuation_gain": {"scale": 0.8}})
    for faults in (
        Faults((DataFault("inches for mm"),)),
        Faults(tuple(replace(JUMP, where=f"trial_{k}.csv", rows=()) for k in range(3))),
    ):
        assert acquitted(data, faults) is faults


def test_where_nothing_looks_wrong_nothing_is_asked() -> None:
    """No fit is made."""
    said: list[str] = []
    assert acquitted(small_data({}), Faults(()), said) == Faults(())
    assert said == []
