"""Claims about what is found in a model that somebody else made, on two links in MuJoCo alone."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from catheter_sim.diagnosis.result import CAUSE_FOUND, IMPROVED, NO_DISCREPANCY, UNEXPLAINED
from catheter_sim.foreign.diagnose import diagnose_foreign, diagnosed
from catheter_sim.foreign.model import ForeignData, ForeignModel, ForeignTrial, Runner, variants_of
from tests.foreign.recorded import OUTPUTS, write_dataset

pytestmark = pytest.mark.slow

BALL_G, PLACE_MM = 200.0, -125.0  # below the lower link's centre, which is half its length down


def heavier(spec: mujoco.MjSpec) -> None:
    ball = spec.body("lower").add_body(name="ball", pos=[0, 0, -0.25])
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.02, 0, 0], mass=1e-3 * BALL_G, contype=0)


def longer(spec: mujoco.MjSpec) -> None:
    spec.body("lower").pos = [0, 0, -0.33]


def softer(spec: mujoco.MjSpec) -> None:
    for joint in spec.joints:
        joint.stiffness = 6.0 * np.asarray(joint.stiffness)


def more_gain(controls: np.ndarray) -> np.ndarray:
    return controls * (1.0, 1.15)


def late(controls: np.ndarray) -> np.ndarray:
    return np.concatenate([np.repeat(controls[:1], 40, axis=0), controls[:-40]])


def test_a_model_that_is_right_is_left_alone(tmp_path: Path) -> None:
    found = diagnose_foreign(write_dataset(tmp_path))
    assert (found.verdict, found.causes) == (NO_DISCREPANCY, ())
    assert found.before.times_noise < 1.25


@pytest.mark.parametrize(
    ("command", "cause", "number", "value"),
    [(more_gain, "actuation_gain", "scale_two", 1.15), (late, "delay", "delay_s", 0.04)],
)
def test_what_happens_to_commands_is_named_with_its_size(
    command: Callable[[np.ndarray], np.ndarray], cause: str, number: str, value: float, tmp_path: Path
) -> None:
    found = diagnose_foreign(write_dataset(tmp_path, command=command))
    assert (found.verdict, found.causes) == (CAUSE_FOUND, (cause,))
    own = {item.name: fitted for item, fitted in found.best.fit.values.items()}
    assert own[number] == pytest.approx(value, rel=0.02)
    assert found.best.times_noise < 1.25


def test_a_ball_on_a_link_is_weighed_and_found_where_it_hangs(tmp_path: Path) -> None:
    found = diagnose_foreign(write_dataset(tmp_path, heavier))
    assert found.causes == ("payload",)
    own = {item.name: fitted for item, fitted in found.best.fit.values.items()}
    assert own["mass_lower_g"] == pytest.approx(BALL_G, rel=0.03)
    assert own["place_lower_z_mm"] == pytest.approx(PLACE_MM, rel=0.05)
    assert abs(own["place_lower_y_mm"]) < 60.0  # along the hinges' axes, where data say nothing


def test_a_cause_that_is_on_no_list_is_not_explained_by_one(tmp_path: Path) -> None:
    found = diagnose_foreign(write_dataset(tmp_path, longer))
    assert found.causes == ()
    assert found.verdict in (IMPROVED, UNEXPLAINED)
    assert found.best.times_noise > 5.0
    assert found.probabilities["outside"] > 0.5
    assert all(item.probability < 0.5 for item in found.likely)


def test_springs_are_told_from_servos(tmp_path: Path) -> None:
    found = diagnose_foreign(write_dataset(tmp_path, softer))
    own = {item.name: fitted for item, fitted in found.best.fit.values.items()}
    assert found.causes == ("stiffness",)
    assert own["scale_springs"] == pytest.approx(6.0, rel=0.05)


def test_data_that_come_from_the_files_own_coarse_step_are_met_with_it(tmp_path: Path) -> None:
    """A simulation of the file as it stands has its step's errors; these are no cause either."""
    text = (Path(__file__).parent / "two_link.xml").read_text().replace('timestep="0.002"', 'timestep="0.01"')
    (tmp_path / "two_link.xml").write_text(text)
    model = ForeignModel(tmp_path / "two_link.xml", (0.0, 0.0, -9.81)).measured(OUTPUTS, "test")
    generator, time_s, trials = np.random.default_rng(5), np.arange(0.0, 3.0, 0.02), []
    gain = next(n for item in variants_of(model) for n in item.numbers if n.name == "scale_two")
    for role in ("train", "heldout"):
        phases = generator.uniform(0.0, 6.0, 2)
        controls = 0.8 * np.sin(5.0 * time_s[:, None] + phases) * np.minimum(time_s / 0.3, 1.0)[:, None]
        trial = ForeignTrial(role, role, time_s, controls, np.zeros((len(time_s), 4)))
        seen = Runner(model).outputs([{gain: 1.2}], [trial])[0][0]
        trials.append(replace(trial, outputs=seen + generator.normal(size=seen.shape) * 0.02))
    found = diagnosed(ForeignData("coarse", "two_link.xml", model, tuple(trials), 0.0))
    assert found.causes == ("actuation_gain",)
    assert found.best.times_noise < 1.25
    assert found.data.model.simulated.opt.timestep == 0.01


def test_two_causes_share_the_gain(tmp_path: Path) -> None:
    """A large gain and a smaller delay: both are named, and their shares are the whole gain."""
    found = diagnose_foreign(write_dataset(tmp_path, command=lambda u: late(u * (1.4, 1.4))))
    assert set(found.causes) == {"actuation_gain", "delay"}
    shares = found.gain_shares()
    assert set(shares) == set(found.causes)
    assert sum(shares.values()) == pytest.approx(found.gain_percent()[0])
    assert min(shares.values()) > 5.0


SERVO = """<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody><body>
<joint name="horn" axis="0 0 1" armature="0.01" damping="0.3"/>
<geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.005" mass="0.05" contype="0"/></body></worldbody>
<actuator><position name="five" joint="horn" kp="15" kv="0.5"/></actuator></mujoco>"""
LOGGED = """[dataset]
name = "a servo's log"
robot = "servo.xml"
source = "simulated"
licence = "MIT"
[conditions]
gravity_mps2 = [0.0, 0.0, 0.0]
motion = "dynamic"
[channels]
inputs = ["control_five"]
outputs = ["joint_horn_deg"]
[map]
time_s = { column = "stamp", unit = "date" }
control_five = { column = "target", unit = "counts", counts_per_turn = 4096, zero = 2047 }
joint_horn_deg = { column = "pos", unit = "counts", counts_per_turn = 4096, zero = 2047 }
[[trials]]
file = "log.csv"
"""


def test_a_servos_log_of_steps_in_counts_shows_its_play(tmp_path: Path) -> None:
    """One file, ten rows a second, whole counts and dates; steps are no noise, so that a play shows."""
    model, play = mujoco.MjModel.from_xml_string(SERVO), 0.06
    data, held, lines = mujoco.MjData(model), 0.0, ["stamp,target,pos"]
    targets = np.repeat(np.append(0, np.random.default_rng(3).integers(-500, 500, 19)), 6)
    time_s = 0.1 * np.arange(len(targets))
    for step in range(50 * (len(targets) - 1) + 1):
        command = np.interp(0.002 * step, time_s, targets) * np.pi / 2048
        held = min(max(held, command - play / 2), command + play / 2)
        data.ctrl[0] = held
        if step % 50 == 0:
            stamp = f"2025-01-01T09:00:{0.002 * step:06.3f}Z"
            lines.append(f"{stamp},{2047 + targets[step // 50]},{2047 + round(data.qpos[0] / np.pi * 2048)}")
        mujoco.mj_step(model, data)
    for name, text in (("servo.xml", SERVO), ("dataset.toml", LOGGED), ("log.csv", "\n".join(lines) + "\n")):
        (tmp_path / name).write_text(text)
    found = diagnose_foreign(tmp_path)
    assert "backlash" in found.causes
    rounded_deg = 360.0 / 4096.0 / math.sqrt(12.0)  # by whole counts; a step is tens of degrees
    assert 0.5 * rounded_deg < found.noise[0] < 5.0 * rounded_deg
