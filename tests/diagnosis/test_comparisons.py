"""Claims about what is told of two recordings of one robot."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.diagnosis.changes.compare import (
    change_of,
    is_report,
    new_shapes_as_they_are,
    recording_of_report,
)
from catheter_sim.diagnosis.result import Cause, FittedParameter
from catheter_sim.diagnosis.trials import Dataset

ROBOT = "mitral_transseptal"
TIME_S = np.arange(24.0)
HIDDEN = {"effects.actuation_gain.scale": 1.15, "effects.measurement_frame.translation_x_mm": 3.0}


def recording(seed: int, settings: dict[str, float], sizes: tuple[float, ...] = (1.8, 2.1, 2.4)) -> Dataset:
    """Return trials of a catheter with effects in it, noise of 0.05 mm on the tip."""
    noise = np.random.default_rng(seed)
    specimen = cs.load_robot(ROBOT, settings)
    trials = {}
    for most_mm in sizes:
        pull = {"time_s": TIME_S, "displacement_bending_mm": most_mm * np.sin(0.42 * TIME_S)}
        seen = cs.statics(specimen, pull, model="pk").to_table(["tip_x_mm", "tip_z_mm"])
        noisy = {name: tip + noise.normal(0.0, 0.05, 24) for name, tip in seen.columns.items()}
        trials[f"bend_{most_mm}"] = pull | noisy
    return cs.dataset(ROBOT, trials, name=f"recording {seed}")


@pytest.mark.slow
def test_what_both_share_is_not_told() -> None:
    """Two recordings of a robot that is wrong in the same way: unchanged, though each alone is off."""
    first, second = recording(1, HIDDEN), recording(2, HIDDEN)
    found = cs.compare(first, second)
    assert found.verdict == "unchanged"
    assert found.changes == ()
    assert found.result.paired_rows == found.result.rows == 72
    assert cs.diagnose(second).verdict == "cause_found"


@pytest.mark.slow
@pytest.mark.parametrize("sizes", [(1.8, 2.1, 2.4), (1.6, 2.0, 2.3)])
def test_what_changed_is_told_with_its_change(sizes: tuple[float, ...]) -> None:
    """A dead-band that comes beside a wrong gain and frame is named alone, its width in the interval; with
    the same commands or with others."""
    first = recording(1, HIDDEN)
    second = recording(2, {**HIDDEN, "effects.backlash.width_mm": 0.4}, sizes)
    found = cs.compare(first, second)
    assert found.verdict == "changed"
    assert [cause.name for cause in found.changes] == ["backlash"]
    (width,) = found.changes[0].parameters.values()
    assert width.ci95[0] <= 0.4 <= width.ci95[1]


def test_what_went_away_is_told_with_the_other_sign() -> None:
    """Value and interval, which the model's own error widens; what was infinite is told as it is."""
    had = FittedParameter(0.6, (0.5, 0.8), 0.1)
    assert change_of(had, 0.0, backward=True) == FittedParameter(
        pytest.approx(-0.5), pytest.approx((-0.7, -0.4)), 0.0
    )
    assert change_of(had, 0.1).ci95 == pytest.approx((0.35, 0.75))
    spring = FittedParameter(3.0, (2.0, 4.0), np.inf)
    assert change_of(spring, 0.1, backward=True) is spring


def test_a_time_constant_that_is_new_is_told_as_it_is() -> None:
    """It has changed from nothing; of a robot that crept already it has changed."""
    size, constant_s = FittedParameter(0.08, (0.07, 0.09), 0.0), FittedParameter(16.0, (13.0, 19.0), 60.0)
    creep = Cause("drift", {"creep": size, "creep_time_s": constant_s}, 80.0)
    plain = cs.load_robot(ROBOT)
    told = new_shapes_as_they_are(creep, plain)
    assert change_of(told.parameters["creep_time_s"], 0.1).value == 16.0
    assert change_of(told.parameters["creep"], 0.0).value == pytest.approx(0.08)
    had = cs.load_robot(ROBOT, {"effects.drift.creep": 0.1, "effects.drift.creep_time_s": 60.0})
    assert change_of(new_shapes_as_they_are(creep, had).parameters["creep_time_s"], 0.0).value == -44.0


@pytest.mark.slow
def test_a_dead_band_that_grew_keeps_its_simple_form() -> None:
    """From 0.1 to 0.6 mm: what it does is no sum, which looks like a soft one; told by how much it grew."""
    key = "effects.backlash.width_mm"
    found = cs.compare(recording(1, {key: 0.1}), recording(2, {key: 0.6}))
    assert found.verdict == "changed"
    ((name, width),) = found.changes[0].parameters.items()
    assert name == "width_mm"
    assert width.ci95[0] <= 0.5 <= width.ci95[1]


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), [(0.6, 0.0), (0.8, 0.3)])
def test_a_dead_band_that_was_taken_up_has_fallen(first: float, second: float, tmp_path: Path) -> None:
    """What the later recording has less of is told with a negative change, and its robot is the later one."""
    key = "effects.backlash.width_mm"
    found = cs.compare(recording(1, {key: first}), recording(2, {key: second}), out=tmp_path)
    assert found.verdict == "changed"
    assert [change.name for change in found.changes] == ["backlash"]
    (width,) = found.changes[0].parameters.values()
    assert width.ci95[0] <= second - first <= width.ci95[1]
    assert width.ci95[0] < width.value < width.ci95[1]
    kept = cs.load_robot(tmp_path / "robot.toml").effects.get("backlash", {}).get("width_mm", 0.0)
    assert kept == pytest.approx(second, abs=0.03)
    document = json.loads((tmp_path / "diagnosis.json").read_text())
    assert document["since"]["backward"] == found.result.backward
    assert "recording 1” to “recording 2" in found.sentence
    if found.result.backward:
        with pytest.raises(cs.InputError, match="the recording before"):
            recording_of_report(tmp_path, recording(3, {}))


@pytest.mark.long
def test_a_change_of_what_was_wrong_already_is_the_difference(tmp_path: Path) -> None:
    """A gain of 1.15 that becomes 1.25 has changed by 0.1, told so from Python and in the document."""
    first = recording(1, HIDDEN, (1.6, 2.0, 2.3))
    second = recording(2, {**HIDDEN, "effects.actuation_gain.scale": 1.25})
    found = cs.compare(first, second, out=tmp_path)
    document = json.loads((tmp_path / "diagnosis.json").read_text())
    assert document["verdict"] == "changed"
    assert document["causes"] == []
    (change,) = document["changes"]
    assert change["name"] == "actuation_gain"
    assert change["parameters"]["scale"]["value"] == pytest.approx(0.1, abs=0.02)
    assert found.to_table()[0]["change"] == "actuation_gain"
    assert 0.0 < change["probability"] <= 1.0
    assert "changed" in (tmp_path / "report.html").read_text()


@pytest.mark.slow
def test_a_finished_report_stands_for_its_data(tmp_path: Path) -> None:
    """The folder of a report does as well as the data set that it is about."""
    first = recording(1, {"effects.actuation_gain.scale": 1.15})
    second = recording(2, {"effects.actuation_gain.scale": 1.15, "effects.backlash.width_mm": 0.4})
    cs.diagnose(first, out=tmp_path)
    assert is_report(tmp_path)
    found = cs.compare(tmp_path, second)
    assert [cause.name for cause in found.changes] == ["backlash"]
    assert found.result.since == "recording 1"


def test_what_cannot_be_compared_is_said(tmp_path: Path) -> None:
    """Other outputs, another robot, another motion, a report that is none: one line each."""
    first = recording(1, {})
    fewer = replace(first, output_channels=("tip_x_mm",))
    with pytest.raises(cs.InputError, match="same outputs"):
        cs.compare(first, fewer)
    other = replace(first, robot=cs.load_robot("mitral_transseptal", {"friction.mu": 0.2}))
    with pytest.raises(cs.InputError, match="same robot"):
        cs.compare(first, other)
    (tmp_path / "diagnosis.json").write_text("{")
    with pytest.raises(cs.InputError, match="cannot be read"):
        recording_of_report(tmp_path, first)
