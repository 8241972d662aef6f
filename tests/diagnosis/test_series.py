"""Claims about several recordings of one robot: how a number went over them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from test_comparisons import HIDDEN, recording

import catheter_sim as cs
from catheter_sim.diagnosis.changes.differences import (
    DRIFT,
    IRREGULAR,
    OPEN,
    STEADY,
    STEP,
    NumberCourse,
    course_of,
)


def course(*changes: float, deviation: float = 0.05) -> NumberCourse:
    return course_of(np.array(changes), np.full(len(changes), deviation))


def test_step_and_drift_are_told_apart() -> None:
    """A number that stays at a new level stepped, one that goes on by as much drifted."""
    assert course(1.0, 1.02, 0.98) == NumberCourse(STEP, 0)
    assert course(0.02, -0.03, 1.0) == NumberCourse(STEP, 2)
    assert course(0.5, 1.02, 1.48) == NumberCourse(DRIFT)
    assert course(0.02, -0.05, 0.01) == NumberCourse(STEADY)
    assert course(1.0, -1.0, 1.0) == NumberCourse(IRREGULAR)


def test_what_the_data_do_not_tell_is_left_open() -> None:
    """One later recording cannot tell a step from a drift; nor can wide intervals, nor infinite ones."""
    assert course(1.0) == NumberCourse(OPEN)
    assert course(0.7, 1.0, deviation=0.25) == NumberCourse(OPEN)
    assert course(1.0, 2.0, deviation=np.inf) == NumberCourse(OPEN)


@pytest.mark.slow
def test_noise_is_seldom_called_a_course() -> None:
    """Of a thousand steady numbers, whose first recording scatters as the others do, one in seven is called
    anything else; of a thousand drifts nearly none is called a step, of a thousand steps few a drift."""
    generator = np.random.default_rng(1)
    scatter = generator.normal(size=(1000, 4))
    changes = scatter[:, 1:] - scatter[:, :1]
    deviation = np.full(3, np.sqrt(2.0))
    kinds = [course_of(row, deviation).kind for row in changes]
    assert 840 < kinds.count(STEADY) < 900
    drifts = [course_of(row + 8.0 * np.arange(1.0, 4.0), deviation).kind for row in changes]
    assert drifts.count(STEP) < 5
    assert drifts.count(DRIFT) > 900
    steps = [course_of(row + np.array([0.0, 0.0, 5.0]), deviation).kind for row in changes]
    assert steps.count(STEP) > 650
    assert steps.count(DRIFT) < 20


@pytest.mark.slow
def test_a_series_tells_what_stepped(tmp_path: Path) -> None:
    """A dead-band that comes before the third of four recordings is a step there, with its width; the wrong
    gain and frame that all share are not told."""
    widths = (0.0, 0.0, 0.4, 0.4)
    days = [
        recording(seed, {**HIDDEN, **({"effects.backlash.width_mm": width} if width else {})})
        for seed, width in enumerate(widths, start=1)
    ]
    found = cs.compare(days[:3], days[3], out=tmp_path)
    assert found.verdict == "changed"
    rows = list(found.series())
    assert {row["change"] for row in rows} == {"backlash"}
    assert {row["course"] for row in rows} == {"step after recording 2"}
    assert [row["recording"] for row in rows] == [f"recording {number}" for number in (1, 2, 3, 4)]
    for row, width in zip(rows, widths, strict=True):
        assert row["low"] <= width <= row["high"]
    document = json.loads((tmp_path / "diagnosis.json").read_text())
    assert document["series"]["parameters"][0]["step_after"] == "recording 2"
    assert [item["verdict"] for item in document["series"]["since_first"]] == [
        "unchanged",
        "changed",
        "changed",
    ]
    assert (tmp_path / "series.png").stat().st_size > 1000
    assert len((tmp_path / "series.csv").read_text().splitlines()) == 5
    assert found.plot_series().axes[0].get_title() == "backlash: step after recording 2"


def test_two_recordings_are_no_series() -> None:
    """There is no table of a series and no picture of it."""
    with pytest.raises(cs.InputError, match="no earlier recording"):
        cs.compare([], recording(1, {}))
