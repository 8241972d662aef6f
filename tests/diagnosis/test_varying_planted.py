"""A number that varies is found where it does: data whose robot changes by code of this file alone.

Each robot's outputs are those of the twin that the diagnosis fits; how they change is not.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.variation import MARK, variation_of
from catheter_sim.diagnosis.choose import without_explained_faults
from catheter_sim.diagnosis.comparison import noise_in_weights
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.prepare import (
    DiagnosisRun,
    Faults,
    calibrate,
    find_data_faults,
    prepare,
    split_problem,
)
from catheter_sim.diagnosis.problem import Term, with_fewer_rows
from catheter_sim.diagnosis.search import Selection, select
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.diagnosis.variations import Promise, along_rows, beside_fit, courses, promises, telling
from catheter_sim.diagnosis.varying import may_settle
from catheter_sim.diagnosis.workers import SERIAL
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.theory.twins import twin_for

ROBOT = "neuroendoscope_section"
TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
SHAPE = (*TIP, "body_12_x_mm", "body_12_z_mm", "body_20_x_mm", "body_20_z_mm")
NOISE_MM = 0.15
LENGTH_S, ROWS, TRIALS = 120.0, 110, 6
Law = Callable[[Inputs], np.ndarray]


def specified(friction: bool = True) -> ContinuumRobot:
    robot = load_robot(ROBOT)
    assert isinstance(robot, ContinuumRobot)
    return robot if friction else replace(robot, friction=replace(robot.friction, mu=0.0))


def tips(robot: ContinuumRobot, inputs: Inputs) -> np.ndarray:
    predict = twin_for(robot, "tension", SHAPE, np.zeros(3))
    return predict([robot], inputs)[0]


def measured(
    law: Law,
    robot: ContinuumRobot | None = None,
    names: Sequence[str] = TIP,
    lengths_s: Sequence[float] = (LENGTH_S,) * TRIALS,
) -> Dataset:
    """Return trials in which both tendons are pulled slowly, with white noise."""
    draw = np.random.default_rng(1)
    tables = []
    for length_s in lengths_s:
        time_s = np.linspace(0.0, length_s, round(ROWS * length_s / LENGTH_S))
        columns: dict[str, Any] = {"time_s": time_s}
        for side in ("right", "left"):
            pace, turn, size = draw.uniform(0.03, 0.12), draw.uniform(0.0, 6.0), draw.uniform(0.12, 0.25)
            wave = np.clip(np.sin(pace * time_s + turn) * np.cos(0.3 * pace * time_s), 0.0, None)
            columns[f"tension_{side}_N"] = size * wave * np.clip(time_s / 5.0, 0.0, 1.0)
        what = law(cs.inputs(ROBOT, columns))
        noisy = what + NOISE_MM * draw.normal(size=what.shape)
        tables.append(columns | {name: noisy[:, SHAPE.index(name)] for name in names})
    return cs.dataset(robot or ROBOT, tables)


def softens_at_47_s(inputs: Inputs) -> np.ndarray:
    """Return the tip of a robot that gives way all at once: three quarters as stiff from 47 s on."""
    (segment,) = specified().segments
    soft = replace(segment, bending_stiffness_N_m2=0.75 * segment.bending_stiffness_N_m2)
    before, after = tips(specified(), inputs), tips(replace(specified(), segments=(soft,)), inputs)
    return np.where((inputs.time_s > 47.0)[:, np.newaxis], after, before)


def fades(inputs: Inputs) -> np.ndarray:
    """Return the tip of a robot that is pulled less and less: by 30 % in two minutes."""
    kept = 1.0 - 0.3 * inputs.time_s / LENGTH_S
    return tips(specified(), replace(inputs, tendon=inputs.tendon * kept[:, np.newaxis]))


def far_half_is_soft(inputs: Inputs) -> np.ndarray:
    """Return the tip of a robot of two segments, the far one 0.65 times as stiff, without friction."""
    robot = specified(friction=False)
    (whole,) = robot.segments
    size = {"length_m": whole.length_m / 2.0, "disks": whole.disks // 2, "mass_kg": whole.mass_kg / 2.0}
    near = replace(whole, name="near", **size)
    far = replace(near, name="far", bending_stiffness_N_m2=0.65 * whole.bending_stiffness_N_m2)
    tendons = tuple(replace(item, ends_at="far") for item in robot.tendons)
    return tips(replace(robot, segments=(near, far), tendons=tendons), inputs)


def jumps_at_100_s(inputs: Inputs) -> np.ndarray:
    """Return the tip of a robot whose right drive pulls by 0.05 N more from 100 s on."""
    more = np.where((inputs.time_s > 100.0)[:, np.newaxis], [0.05, 0.0], 0.0)
    return tips(specified(), replace(inputs, tendon=inputs.tendon + more))


def is_bumped_at_100_s(inputs: Inputs) -> np.ndarray:
    """Return the same of a robot whose tracker is moved by 3 mm then."""
    moved = [{"x": 3.0, "y": 1.0, "z": -2.0}[name.split("_")[-2]] for name in SHAPE]
    return tips(specified(), inputs) + np.where((inputs.time_s > 100.0)[:, np.newaxis], moved, 0.0)


def softens_late_and_far(inputs: Inputs) -> np.ndarray:
    """Return the tip of a robot that is half as stiff from 47 s on, beyond 0.06 N of the right drive."""
    (segment,) = specified().segments
    soft = replace(segment, bending_stiffness_N_m2=0.5 * segment.bending_stiffness_N_m2)
    before, after = tips(specified(), inputs), tips(replace(specified(), segments=(soft,)), inputs)
    both = (inputs.time_s > 47.0) & (inputs.tendon[:, 0] > 0.06)
    return np.where(both[:, np.newaxis], after, before)


ONE_LONG_TRIAL = (80.0, 80.0, LENGTH_S, 80.0, 80.0, LENGTH_S)  # and one that is held out


@pytest.mark.parametrize(("law", "sound"), [(jumps_at_100_s, True), (is_bumped_at_100_s, False)])
def test_a_drive_that_jumps_late_is_no_tracker_that_was_moved(law: Law, sound: bool) -> None:
    """Both look like a jump of all positions, in one training trial; a drive's number explains the first."""
    split = split_problem(prepare(measured(law, lengths_s=ONE_LONG_TRIAL)))
    before = calibrate(split)
    faults = find_data_faults(split, before)
    assert "jump" in faults.found[0].what
    run = DiagnosisRun(SERIAL, lambda line: None)
    assert (without_explained_faults(run, split, before, faults) == Faults(())) is sound


def test_what_jumps_in_one_stretch_is_found_between_its_rows() -> None:
    """Of one training trial's last 20 s no stretch outside tells; pieces of it do, and of all fits."""
    selection = select(
        split_problem(prepare(measured(jumps_at_100_s, lengths_s=ONE_LONG_TRIAL))).train,
        ["drift", "stiffness", "precurvature"],
    )
    causes, how, by = varied(selection)
    assert causes == ["drift"]
    assert (how.along, how.shape) == ("time", "step")
    assert how.at[0] == pytest.approx(100.0, abs=1.0)
    assert by == pytest.approx(0.05, abs=0.005)
    assert selection.interleaved
    assert len({len(np.unique(item.block)) for item in (selection.null, *selection.tried)}) == 1


def searched(
    law: Law, causes: list[str], robot: ContinuumRobot | None = None, names: Sequence[str] = TIP
) -> Selection:
    split = split_problem(prepare(measured(law, robot, names)))
    return select(split.train, causes)


def varied(selection: Selection) -> tuple[list[str], Any, float]:
    """Return the chosen causes, how a number of the first varies, and by how much."""
    (term,) = (item for item in selection.chosen.terms if any(MARK in name for name in item.free))
    (name,) = (name for name in term.free if MARK in name)
    return [*selection.chosen.causes], variation_of(name), selection.chosen.values[term.effect, name]


def test_a_step_in_time_is_found() -> None:
    """To a tenth of the record, among causes that do nearly the same."""
    causes, how, by = varied(searched(softens_at_47_s, ["stiffness", "tendon_friction"]))
    assert causes == ["stiffness"]
    assert (how.along, how.shape) == ("time", "step")
    assert abs(how.at[0] - 47.0) < 0.1 * LENGTH_S
    assert by == pytest.approx(-0.25, abs=0.04)


def test_a_soft_half_is_found() -> None:
    """Its place to 15 % of the length, where points on the way are measured; the tip alone hardly tells."""
    robot = specified(friction=False)
    causes, how, by = varied(searched(far_half_is_soft, ["stiffness", "nonlinear_stiffness"], robot, SHAPE))
    assert causes == ["stiffness"]
    assert how.along == "place"
    ends = (how.at[0], how.at[1]) if by < 0.0 else (how.at[1], 1.0)  # a stiff near half is a soft far one
    assert abs(ends[0] - 0.5) <= 0.15
    assert abs(ends[1] - 1.0) <= 0.15


def test_two_things_at_once_are_found() -> None:
    """A robot softer late and far out: beyond one pull, from one moment on or from the turn before it on."""
    causes, how, by = varied(searched(softens_late_and_far, ["stiffness", "precurvature"]))
    assert causes == ["stiffness"]
    assert how.times is not None
    at = {item.along: item.at[0] for item in how.courses}
    assert at["level"] == pytest.approx(0.06, abs=0.015)
    assert at.get("time", 47.0) == pytest.approx(47.0, abs=6.0)
    assert set(at) in ({"level", "time"}, {"level", "turns"})
    assert by == pytest.approx(-0.5, abs=0.05)


def test_what_stays_the_same_does_not_vary() -> None:
    """A stiffness that is wrong alike everywhere and always is told so."""

    def soft(inputs: Inputs) -> np.ndarray:
        (segment,) = specified().segments
        changed = replace(segment, bending_stiffness_N_m2=0.75 * segment.bending_stiffness_N_m2)
        return tips(replace(specified(), segments=(changed,)), inputs)

    chosen = searched(soft, ["stiffness", "nonlinear_stiffness"]).chosen
    assert chosen.causes == ("stiffness",)
    assert not any(MARK in name for term in chosen.terms for name in term.free)


def test_a_derivative_promises_what_a_fit_keeps() -> None:
    """No course of rows stands for a soft half: with the half taken out none promises much less than is left.

    Calibrated numbers stay where they may be; free of that, they would take up most of it.
    """
    split = split_problem(prepare(measured(far_half_is_soft, specified(friction=False), SHAPE)))
    problem = with_fewer_rows(split.train)
    term = Term("stiffness", ("scale", "scale~place.between(0.5,1)"))
    found, uniform = fit(problem, (term,)), fit(problem, (Term("stiffness", ("scale",)),))
    at = beside_fit(found, term, None)
    best = promises(found, at, along_rows("scale", at.own["scale"], telling(problem, courses(problem))), 1)[0]
    promised = np.sqrt(best.cost / len(found.residual))
    assert 0.9 * uniform.cross_validated_rms < promised < 1.1 * uniform.cross_validated_rms
    assert uniform.cross_validated_rms > 1.3 * found.cross_validated_rms


@pytest.mark.parametrize(
    ("promised", "fixed", "may"),
    [(2.4, 5.0, True), (3.0, 4.0, False), (1.2, 1.4, True)],
    ids=["much less", "hardly less", "little left"],
)
def test_what_hardly_gains_by_varying_is_not_fitted(promised: float, fixed: float, may: bool) -> None:
    """Both errors in times of the noise. Where the cause leaves little without varying, it may settle."""
    problem = with_fewer_rows(split_problem(prepare(measured(softens_at_47_s))).train)
    null = fit(problem, ())
    per = len(null.left_out) * noise_in_weights(problem, null) ** 2
    found = Promise((), {}, promised**2 * per, fixed**2 * per, "stiffness", ())
    assert may_settle(problem, null, [], found) is may


@pytest.mark.slow  # whole diagnoses
@pytest.mark.parametrize(("law", "cause"), [(softens_at_47_s, "stiffness"), (fades, "drift")])
def test_a_diagnosis_names_it(law: Law, cause: str, tmp_path: Any) -> None:
    """With more than 0.5, and to the noise; a softening is as well a response that fades, and the reverse."""
    found = cs.diagnose(measured(law), tmp_path)
    assert found.verdict == "cause_found"
    named = found.causes[0]
    assert cause in named.one_of
    assert {variation_of(name).along for name in named.parameters if MARK in name} == {"time"}
    document = json.loads((tmp_path / "diagnosis.json").read_text(encoding="utf-8"))
    assert document["heldout"]["rmse_after"] < 0.5 * document["heldout"]["rmse_before"]
    assert document["heldout"]["rmse_after"] < 1.1 * NOISE_MM
    assert document["causes"][0]["varies"][0]["with"] == "time"
    assert load_robot(tmp_path / "robot.toml").effects[named.name]
    assert (tmp_path / "robot.toml").read_text().count("# cause, probability") == 1
    assert "robot.toml has how it varies" in (tmp_path / "model.xml").read_text()
    assert any("A number varies." in note for note in document["notes"])
