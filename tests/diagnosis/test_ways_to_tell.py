"""Claims about when a further way of telling two recordings apart is taken, and when a change is doubted."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_comparisons import HIDDEN, recording

import catheter_sim as cs
from catheter_sim.diagnosis.changes import compare
from catheter_sim.diagnosis.changes.compare import (
    CHANGED,
    OneRobot,
    _backward,
    _Earlier,
    _of_paired_trials,
    _tells_more,
    compared,
)
from catheter_sim.diagnosis.changes.differences import LEFT_OUT, baseline, differences, shares_paired
from catheter_sim.diagnosis.prepare import DiagnosisRun, running
from catheter_sim.diagnosis.result import CAUSE_FOUND, Cause, FittedParameter
from catheter_sim.diagnosis.thresholds import ESTABLISHED
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.diagnosis.workers import SERIAL

OTHER_MM = (1.6, 2.0, 2.3)
MANY_MM = (1.6, 1.8, 2.0, 2.2, 2.4)


@pytest.fixture
def run() -> Iterator[DiagnosisRun]:
    with running(SERIAL, False, math.inf) as found:
        yield found


@dataclass
class _Told:
    """What a way told, as far as it is weighed."""

    verdict: str
    left: dict[str, float]
    changes: tuple[Cause, ...] = field(default=())
    diagnosis: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(corrections=()))


def told(left_mm: float, *causes: tuple[float, int], verdict: str = CHANGED) -> _Told:
    """Return what a way told; `causes`: probability and how many numbers."""
    number = FittedParameter(1.0, (0.5, 1.5), 0.0)
    changes = tuple(
        Cause(f"cause_{k}", {f"number_{i}": number for i in range(count)}, 10.0, probability=chance)
        for k, (chance, count) in enumerate(causes)
    )
    likely = tuple(cause for cause in changes if cause.probability >= ESTABLISHED)
    rest = tuple(cause for cause in changes if cause not in likely)
    return _Told(verdict, {"mm": left_mm}, likely, SimpleNamespace(corrections=rest))


def test_a_further_way_has_to_be_sure_and_as_good() -> None:
    """Taken: surely where nothing was named and less is left; by fewer numbers, or instead of an unsure name,
    where about as much is. Not taken: an unsure name, more numbers, or far more left."""
    nothing, two = told(1.0, verdict="unexplained"), told(1.0, (0.9, 1), (0.9, 1))
    assert _tells_more(told(0.6, (0.9, 1)), nothing)
    assert not _tells_more(told(0.6, (0.6, 1)), nothing)
    assert not _tells_more(told(1.1, (0.9, 1)), nothing)
    assert not _tells_more(told(0.6, verdict="unexplained"), two)
    assert _tells_more(told(1.1, (0.9, 1)), two)
    assert not _tells_more(told(1.4, (0.9, 1)), two)
    assert not _tells_more(told(1.0, (0.9, 3)), two)
    assert _tells_more(told(1.0, (0.9, 3)), told(1.0, (0.9, 1), (0.3, 1)))


@pytest.mark.parametrize(
    ("first", "further"),
    [
        (told(1.0, (0.9, 1)), False),
        (told(1.0, (0.6, 1), (0.3, 1)), True),
        (told(1.0, (0.9, 1), (0.9, 1)), True),
        (told(1.0, (0.4, 1), verdict="unexplained"), True),
        (told(1.0, verdict="unchanged"), False),
    ],
    ids=["one change", "a correction beside it", "two changes", "a correction alone", "unchanged"],
)
def test_further_ways_are_tried_until_one_change_tells_all(
    first: _Told, further: bool, run: DiagnosisRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One change ends it only where no correction stands beside it."""
    tried: list[str] = []
    for name in ("_from_best_causes", "_from_own_causes", "_backward"):
        monkeypatch.setattr(compare, name, lambda *_, name=name: tried.append(name))
    compare.best_comparison(run, None, None, first, None, False)  # type: ignore[arg-type]
    assert bool(tried) is further


@pytest.mark.slow
def test_one_robot_is_as_good_where_nothing_changed(run: DiagnosisRun) -> None:
    """A change claimed of one robot is taken back, with a note; one that is there is not."""
    first = recording(1, HIDDEN)
    for settings, as_good in ((HIDDEN, True), ({**HIDDEN, "effects.backlash.width_mm": 0.4}, False)):
        second = recording(2, settings, OTHER_MM)
        base = baseline(run, first, is_paired=False)
        later = differences(second, base)
        found = compared(run, base, later, simulation=False)
        claimed = replace(found, diagnosis=replace(found.diagnosis, verdict=CAUSE_FOUND))
        same = OneRobot(base, second, later)
        assert same.is_as_good(run, claimed) == as_good
        if as_good:
            taken_back = same.instead_of(run, claimed, simulation=False)
            assert taken_back.verdict == "unchanged"
            assert taken_back.changes == ()
            assert taken_back.diagnosis.notes[-1].code == "one_robot"


def with_a_leap(dataset: Dataset, trial: int) -> Dataset:
    """Return a recording in which the tip of one trial lies 40 mm off in six rows."""
    trials = list(dataset.trials)
    table = trials[trial].outputs
    away = 40.0 * ((np.arange(24) >= 9) & (np.arange(24) < 15))
    columns = {name: values + away for name, values in table.columns.items()}
    trials[trial] = replace(trials[trial], outputs=replace(table, columns=columns))
    return replace(dataset, trials=tuple(trials))


@pytest.mark.slow
def test_a_wrong_trial_of_the_earlier_recording_is_left_out() -> None:
    """One of five is, with a note, and the change is told; where three are, nothing can be compared."""
    sound = recording(1, HIDDEN, MANY_MM)
    second = recording(2, {**HIDDEN, "effects.backlash.width_mm": 0.4}, MANY_MM)
    found = cs.compare(with_a_leap(sound, 1), second)
    assert [cause.name for cause in found.changes] == ["backlash"]
    (note,) = [item for item in found.result.diagnosis.notes if item.code == LEFT_OUT]
    assert sound.trials[1].file in note.text
    with pytest.raises(cs.InputError, match=r"nothing can be compared with it: .*tip leaps"):
        cs.compare(with_a_leap(with_a_leap(with_a_leap(sound, 1), 0), 3), second)


def test_a_later_recording_that_looks_wrong_is_not_asked_backward(run: DiagnosisRun) -> None:
    """Nothing is told by it; what was told before stands."""
    first, second = recording(1, HIDDEN), recording(2, HIDDEN)
    silent = replace(second, trials=tuple(with_a_leap(second, 0).trials[:1] * 2))
    assert _backward(run, _Earlier(first, None), silent, False) is None


@pytest.mark.slow
def test_trials_that_pair_can_be_asked_alone(run: DiagnosisRun) -> None:
    """Three of five pair: they alone are compared, and a note names the others; None where all do."""
    first = recording(1, HIDDEN)
    second = recording(2, HIDDEN, (1.8, 2.1, 2.4, 0.9, 1.2))
    assert shares_paired(second, first)[:3] == [1.0, 1.0, 1.0]
    found = _of_paired_trials(run, first, second, simulation=False)
    assert found is not None
    assert (found.verdict, found.rows, found.paired_rows) == ("unchanged", 72, 72)
    (note,) = [item for item in found.diagnosis.notes if item.code == "unpaired_left_out"]
    assert all(item.file in note.text for item in second.trials[3:])
    assert _of_paired_trials(run, first, recording(3, HIDDEN), simulation=False) is None
