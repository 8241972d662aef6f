"""A real cable-driven joint: the effects that its makers describe are found in what they measured.

The joint is no robot of this project, so that its model stands here: a spindle and a jaw on inextensible
cables. Effects act on it as on any robot: on the way in, and on the cables.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.noise import errors_of, residual_series, white_noise
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.search import candidates_for, select
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.effects.apply import arriving_inputs, with_built_in_effects
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.tables import Table

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).resolve().parents[1] / "data" / "mrdlab_wrist"
TRAINING, HELDOUT = ("00", "01", "02", "10", "20", "23"), ("03", "12", "21")
ARM_M = 5e-3  # of spindle and jaw: of the two, only the ratio shows
ZERO_DEG = 80.0  # of the jaw's reading at spindle and load zero, about
COLUMN = "angle_jaw_deg"
JAW = ContinuumRobot(
    name="jaw",
    description="",
    segments=(Segment("jaw", 5e-3, 1, 6e-3, 1e-6, 0.0, bending_axes="x"),),
    tendons=(Tendon("close", ARM_M, 0.0, "jaw"),),
    friction=Friction(0.0),
    actuation="displacement",
)


def recording(name: str) -> Trial:
    """Return one recording: the spindle's turn as a pull, the load as a moment, both toward closing."""
    with (FOLDER / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    time_s, spindle, jaw, torque = (
        np.array([float(row[key]) for row in rows])
        for key in ("t_s", "spindle_deg", "jaw_deg", "jaw_torque_mNm")
    )
    moment = np.zeros((len(rows), 3))
    moment[:, 1] = -1e-3 * torque
    pull = ARM_M * np.radians(spindle)[:, np.newaxis]
    inputs = Inputs(time_s, "displacement", pull, np.zeros_like(moment), moment)
    return Trial(f"{name}.csv", "train", inputs, Table(time_s, {COLUMN: ZERO_DEG - jaw}, name))


def joint(robots: Sequence[ContinuumRobot], inputs: Inputs, every: int) -> np.ndarray:
    """Return the jaw's angle, shape (B, r, 1) [deg]: what the cable brings, and its stretch by the load."""
    found = []
    for robot in robots:
        arrived = arriving_inputs(robot, inputs)
        (cable,) = with_built_in_effects(robot).tendons
        stretched = arrived.moment_tip[:, 1] / (cable.stiffness_N_per_m * ARM_M**2)
        found.append(np.degrees(arrived.tendon[:, 0] / ARM_M + stretched))
    return np.array(found)[:, ::every, np.newaxis]


def problem(names: Sequence[str]) -> Problem:
    """Return the fit of the joint to some recordings, in units of the white noise of the jaw's angle."""
    trials = tuple(recording(name) for name in names)
    made = Problem(JAW, (), trials, (COLUMN,), np.ones(1), joint)
    noise = white_noise(residual_series(made, fit(made, (), cross_validate=False)))["deg"]
    return replace(made, weight=np.array([noise]))


def rmse_deg(result: Fit) -> float:
    """Return the root mean square error on the held-out recordings."""
    return float(np.sqrt(np.mean(errors_of(problem(HELDOUT), result) ** 2)))


def test_dead_band_and_stretch_of_a_real_joint_are_found():
    """They are named beside the drive's ratio, which is not published; 0.35 deg is left, held out.

    The dead-band is soft: a spring lets a quarter of the input through it.
    """
    train = problem(TRAINING)
    chosen = select(train, candidates_for(train)).chosen
    assert set(chosen.causes) == {"backlash", "tendon_elongation", "actuation_gain"}
    assert 2.0 < math.degrees(chosen.values["backlash", "soft_width_mm"] * 1e-3 / ARM_M) < 4.0
    assert 0.15 < chosen.values["backlash", "soft_through"] < 0.4
    stiffness_N_m = chosen.values["tendon_elongation", "stiffness_N_per_mm"] * 1e3 * ARM_M**2
    assert 0.08 < math.degrees(1e-3 / stiffness_N_m) < 0.12
    assert rmse_deg(chosen) < 0.37
    plain = [item for item in select(train, ("actuation_gain", "actuation_offset")).path if item.terms]
    assert 1.5 < rmse_deg(plain[-1]) < 2.3
