"""A written file in MuJoCo alone goes where the package goes, on loops that it was not fitted to."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.core.inputs import Inputs, slice_inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.exporting import write
from catheter_sim.exporting.elements import EXACT, FITTED, LEFT, without
from catheter_sim.exporting.judge import PERCENT, moving_loop
from catheter_sim.exporting.write import ExportedModel, PlainRun, write_model
from catheter_sim.simulation.replay import simulate

# Robots with friction that are quick to replay; the whole ones are in the guide's table.
WITH_FRICTION = (
    pytest.param("neuroendoscope_section", "mujoco", marks=pytest.mark.long),
    ("notched_wrist", "mujoco"),
    ("notched_wrist", "mjx"),
)
# Forms that run apart: each has another of its kind beside it.
LONG = (("backlash", "uneven"), ("tendon_friction", "drive"), ("nonlinear_stiffness", "quintic"))
SMALL = {"segments.section.disks": 5, "friction.mu": 0.0}
FINE_MM = 0.25  # of 60 mm: what a cause that is in the file as it is may leave of itself
# Values that move the small robot by millimetres, where a form's start does not.
VALUES = {
    "lag_s": 0.1,
    "delay_s": 0.1,
    "output_lag_s": 0.1,
    "output_delay_s": 0.1,
    "damping_time_s": 0.03,
    "creep": 0.3,
    "response_creep": 0.3,
    "zero_N_per_min": 2.0,
    "offset_N": 0.05,
    "quintic_mm4": 6.5e5,
}


def package(robot: RobotSpec, inputs: Inputs, moving: bool = False) -> np.ndarray:
    """Return where the package sees the faces, shape (r, n, 3) [m]."""
    return np.array([now.p_w for now in simulate(robot, inputs, np.zeros(3), dynamic=moving).postures])


def apart_mm(first: np.ndarray, second: np.ndarray) -> float:
    return float(1e3 * np.linalg.norm(first - second, axis=2).max())


@pytest.mark.slow
@pytest.mark.parametrize(("name", "engine"), WITH_FRICTION)
def test_the_file_alone_is_within_two_percent_on_other_loops(name: str, engine: str, tmp_path: Path) -> None:
    """The file as it lies on disk; without what was fitted it is not: the loops can tell."""
    robot = cs.load_robot(name)
    model = write_model(robot, engine)
    path = tmp_path / "model.xml"
    path.write_text(model.text, encoding="utf-8")
    inputs, _ = write.judged_loops(model.drives)
    inputs = slice_inputs(inputs, slice(0, 18))
    truth = package(robot, inputs)
    length_mm = 1e3 * truth[0, -1, 2]
    got = PlainRun(path.read_text(encoding="utf-8"), model.shares).held(inputs.tendon)
    bare = PlainRun(model.bare, model.shares).held(inputs.tendon)
    assert 100.0 * apart_mm(got, truth) / length_mm < PERCENT
    assert 100.0 * apart_mm(bare, truth) / length_mm > 2.0 * PERCENT


def forms() -> list[tuple[str, str]]:
    small = cs.load_robot("neuroendoscope_section", SMALL)
    return [
        (name, form.name)
        for name, effect in EFFECTS.items()
        for form in effect.forms
        if form.parameters(small)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "form"),
    [pytest.param(*form, marks=[pytest.mark.long] if form in LONG else []) for form in forms()],
)
def test_each_cause_alone_travels_or_is_listed(
    effect: str, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Either the file goes where the package goes with the cause, or the list has it, and it costs."""
    monkeypatch.setattr(write, "ROWS_A_WAY", 10)
    small = cs.load_robot("neuroendoscope_section", SMALL)
    item = next(own for own in EFFECTS[effect].forms if own.name == form).parameters(small)[0]
    value = item.start + 4.0 * item.scale if np.isfinite(item.null) else 0.05 / item.scale
    settings = {f"effects.{effect}.{item.name}": VALUES.get(item.name, value)}
    if item.name.endswith("creep"):
        settings[f"effects.{effect}.{item.name}_time_s"] = 10.0
    robot = cs.load_robot("neuroendoscope_section", SMALL | settings)
    model = write_model(robot)
    (cause,) = model.causes
    assert (cause.effect, cause.form) == (effect, form)
    inputs, moved = loop_for(model, cause.timed)
    truth, none = package(robot, inputs, cause.timed), package(without(robot, (cause,)), inputs, cause.timed)
    run = PlainRun(model.text, model.shares)
    got = run.followed(inputs.time_s, inputs.tendon) if cause.timed else run.held(inputs.tendon, ramp_s=0.5)
    assert moved > 1.0
    if cause.way == LEFT:
        assert apart_mm(truth, none) > 0.05, "a cause that moves nothing is not one to list"
        assert apart_mm(got, truth) > 0.5 * apart_mm(truth, none), "it is listed, and travelled"
    else:
        assert cause.way in (EXACT, FITTED)
        assert apart_mm(got, truth) < max(FINE_MM, 0.5 * apart_mm(truth, none) * (cause.way == FITTED))


def loop_for(model: ExportedModel, timed: bool) -> tuple[Inputs, float]:
    """Return a loop of the first drive, with a clock where one is needed, and how far it goes [mm]."""
    inputs, _ = write.judged_loops(model.drives)
    inputs = slice_inputs(inputs, slice(0, 12))
    path = package(cs.load_robot("neuroendoscope_section", SMALL), inputs)
    return (moving_loop(inputs) if timed else inputs), apart_mm(path[:1], path[5:6])


@pytest.mark.slow
def test_a_file_runs_in_mujoco_alone_and_says_what_its_controls_are(tmp_path: Path) -> None:
    """Nothing of the package is asked for: the XML loads, starts at rest, and moves by its controls."""
    robot = cs.load_robot("neuroendoscope_section", SMALL | {"effects.actuation_gain.scale": 1.5})
    model = write_model(replace(robot))
    loaded = mujoco.MjModel.from_xml_string(model.text)
    data = mujoco.MjData(loaded)
    mujoco.mj_resetDataKeyframe(loaded, data, loaded.key("rest").id)
    data.ctrl[loaded.actuator("tendon_right").id] = 0.1
    mujoco.mj_step(loaded, data, 2000)
    own = cs.simulate(robot, {"time_s": [0.0, 1.0], "tension_right_N": [0.0, 0.1]}).to_table(["tip_x_mm"])
    mujoco.mj_forward(loaded, data)
    assert 1e3 * data.sensor("tip_position").data[0] == pytest.approx(own.columns["tip_x_mm"][-1], abs=0.05)
    assert {item.actuator: item.column for item in model.controls} == {
        "tendon_right": "tension_right_N",
        "tendon_left": "tension_left_N",
    }
    assert json.dumps([item.share for item in model.controls]) == "[1.0, 1.0]"
