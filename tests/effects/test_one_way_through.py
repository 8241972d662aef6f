"""A robot's effects act alike wherever it is driven: command line, Python, statics, environment, replay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot, robot_toml
from catheter_sim.channels import input_channels, read_inputs
from catheter_sim.cli.main import main
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.diagnosis.verdict import replay
from catheter_sim.effects.apply import in_force, outside_the_robot, with_built_in_effects
from catheter_sim.envs.robots import Plant
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.tables import Table, read_table, write_table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import by_static_model

NO_GRAVITY = np.zeros(3)
TIP = ["tip_x_mm", "tip_y_mm", "tip_z_mm"]


@dataclass(frozen=True)
class Case:
    """A robot, what pulls it, and the static model that agrees with its simulation.

    Attributes:
        settings: without friction, so that a tip depends on no way.
        peak: of each tendon's input, SI.
        close_mm: how far simulation and statics may be from each other.
    """

    robot: str
    settings: Sequence[str]
    peak: Sequence[float]
    model: str
    close_mm: float


SECTION = Case("neuroendoscope_section", ("friction.mu=0",), (0.3, 0.05), "fkm_exact_arm", 0.05)
CHEST = Case("chest_tube_section", ("friction.mu=0",), (20.0,), "complete", 0.5)
MITRAL = Case("mitral_transseptal", (), (3e-3, 1e-3, 1e-3, 20e-3), "balance", 0.1)

# One effect at each place: on the way in (a zero, play, a lag), in the robot, on the way out.
CASES = [
    (case, effect)
    for case, channel, unit, size, in_it in (
        (SECTION, "right_", "N", 0.05, "stiffness.scale=1.2"),
        (CHEST, "", "N", 3.0, "stiffness.scale=1.2"),
        (MITRAL, "", "mm", 0.5, "precurvature.bending_deg=5"),
    )
    for effect in (
        f"actuation_offset.offset_{channel}{unit}={size}",
        f"backlash.width_{unit}={size}",
        "rate.delay_s=0.5",
        "measurement_frame.translation_x_mm=7",
        in_it,
    )
]


def ids(value: object) -> str:
    return value.robot if isinstance(value, Case) else str(value).split(".")[0]


def way(case: Case) -> Inputs:
    """Return rows up and half way back, a second apart."""
    share = np.array([0.0, 0.5, 1.0, 0.5])
    nothing = np.zeros((4, 3))
    actuation = load_robot(case.robot).actuation
    return Inputs(np.arange(4.0), actuation, share[:, np.newaxis] * np.array(case.peak), nothing, nothing)


def tips_mm(postures: Sequence) -> np.ndarray:
    return np.array([posture.p_w[-1] for posture in postures]) * 1e3


def file_of(robot, inputs: Inputs, path: Path) -> str:
    """Write the inputs as a file, and return its name."""
    factor = 1.0 if inputs.actuation == "tension" else 1e3
    columns = dict(zip(input_channels(robot), factor * inputs.tendon.T, strict=True))
    write_table(Table(inputs.time_s, columns), str(path))
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "effect"), CASES, ids=ids)
def test_an_effect_gives_the_same_tip_everywhere(case: Case, effect: str, tmp_path: Path) -> None:
    """As the command line from a file of the robot, so `simulate`, replay and environment; statics nearly."""
    robot = load_robot(case.robot, [*case.settings, f"effects.{effect}"])
    inputs = way(case)
    run = simulate(robot, inputs, NO_GRAVITY)
    ours = tips_mm(run.postures)
    assert np.array_equal(run.inputs.tendon, inputs.tendon)

    # it acts: the robot without it is elsewhere
    plain = tips_mm(simulate(replace(robot, effects={}), inputs, NO_GRAVITY).postures)
    assert np.abs(ours - plain).max() > 0.3

    (tmp_path / "robot.toml").write_text(robot_toml(robot))
    file = file_of(robot, inputs, tmp_path / "in.csv")
    out = str(tmp_path / "out.csv")
    assert main(["simulate", str(tmp_path / "robot.toml"), "--inputs", file, "-o", out]) == 0
    written = read_table(out).columns
    assert np.stack([written[name] for name in TIP], axis=1) == pytest.approx(ours, abs=2e-4)

    solved = tips_mm(STATIC_MODELS[case.model].solve(robot, inputs, NO_GRAVITY).postures)
    assert np.abs(solved - ours).max() < case.close_mm
    words = ["statics", str(tmp_path / "robot.toml"), "--model", case.model]
    assert main([*words, "--inputs", file, "-o", out]) == 0
    written = read_table(out).columns
    assert np.stack([written[name] for name in TIP], axis=1) == pytest.approx(solved, abs=1e-6)
    twin = by_static_model(case.model, robot, TIP, NO_GRAVITY)([robot], inputs, 1)[0]
    assert twin == pytest.approx(solved, abs=1e-9)

    trial = Trial("a.csv", "heldout", inputs, Table(inputs.time_s, dict.fromkeys(TIP, ours[:, 0])))
    assert replay(robot, trial, TIP, NO_GRAVITY).outputs == pytest.approx(ours, abs=2e-3)

    plant = Plant(robot, None, NO_GRAVITY)
    levels = np.linalg.lstsq(plant.drives.tendon, inputs.tendon.T, rcond=None)[0].T
    for row in range(1, len(inputs)):
        plant.move(levels[row], 1.0)
        plant.settle()
        posture = plant.posture()
        seen, _ = plant.measured(posture.p_w[-1], posture.R_w[-1])
        assert seen * 1e3 == pytest.approx(ours[row], abs=2e-3)


@pytest.mark.parametrize(("axis", "shift"), [("x", (7.0, 0.0, 0.0)), ("z", (0.0, 0.0, -2.0))])
def test_statics_in_python_observe_through_the_trackers_frame(axis: str, shift: tuple[float, ...]) -> None:
    """What the frame is shifted by is in the tip, once."""
    solve, inputs = STATIC_MODELS[SECTION.model].solve, way(SECTION)
    plain = solve(load_robot(SECTION.robot), inputs, NO_GRAVITY)
    robot = load_robot(SECTION.robot, [f"effects.measurement_frame.translation_{axis}_mm={sum(shift)}"])
    solved = solve(robot, inputs, NO_GRAVITY)
    moved = tips_mm(solved.postures) - tips_mm(plain.postures)
    assert moved == pytest.approx(np.array([shift] * 4), abs=1e-9)
    assert solved.inputs is inputs
    again = solve(with_built_in_effects(robot), inputs, NO_GRAVITY)
    assert np.array_equal(tips_mm(again.postures), tips_mm(plain.postures))


def test_a_robot_without_effects_is_itself() -> None:
    """Nothing is copied, nothing is computed."""
    robot, inputs = load_robot(SECTION.robot), way(SECTION)
    acting = in_force(robot, inputs)
    assert acting.robot is robot
    assert acting.inputs is inputs


def test_units_are_those_of_the_inputs() -> None:
    """An offset in newtons is none of a robot driven by displacement: refused, not added as metres."""
    robot = load_robot("neuroendoscope_section", ["effects.actuation_offset.offset_N=0.05"])
    moved = replace(way(SECTION), actuation="displacement", tendon=np.full((4, 2), 1e-3))
    with pytest.raises(InputError, match="unknown parameter 'offset_N'; choices: offset_mm"):
        simulate(robot, moved, NO_GRAVITY)


@pytest.mark.parametrize("solve", [simulate, STATIC_MODELS["fkm_exact_arm"].solve])
def test_an_impossible_effect_is_an_error(solve) -> None:
    """In Python as on the command line: the name and the choices."""
    robot = replace(load_robot(SECTION.robot), effects={"backlsh": {"width_N": 0.1}})
    with pytest.raises(InputError, match=r"effects: unknown effect 'backlsh'; choices: .*backlash"):
        solve(robot, way(SECTION), NO_GRAVITY)


def test_a_stepped_simulator_has_the_robots_own_effects_and_refuses_others() -> None:
    """Friction taken away as an effect is friction taken away; an offset is no part of a step."""
    plain = load_robot(SECTION.robot, ["friction.mu=0"])
    simulator = Simulator(
        load_robot(SECTION.robot, ["effects.tendon_friction.mu=0", "effects.stiffness.scale=2"])
    )
    assert simulator.robot.friction == plain.friction
    assert simulator.robot.stiffness_scale == 2.0 * plain.stiffness_scale
    mixed = load_robot(SECTION.robot, ["effects.stiffness.scale=2", "effects.rate.lag_s=0.1"])
    with pytest.raises(InputError, match=r"neuroendoscope_section: effects\.rate: acts on inputs or outputs"):
        Simulator(mixed)


@pytest.mark.parametrize(
    ("robot", "effect", "outside"),
    [
        ("neuroendoscope_section", "backlash.width_N=0.05", ["backlash"]),
        ("mitral_transseptal", "backlash.width_mm=0.5", ["backlash"]),
        ("mitral_transseptal", "backlash.slack_bending_mm=0.5", []),  # of the tendons, which the model has
        ("mitral_transseptal", "rate.delay_s=0.01", ["rate"]),
        ("chest_tube", "measurement_frame.rotation_z_deg=1", ["measurement_frame"]),
        ("chest_tube", "payload.force_z_N=-0.1", ["payload"]),
        ("neuroendoscope", "coupling.distal_to_proximal=0.01", ["coupling"]),
        ("neuroendoscope", "drift.zero_N_per_min=0", []),  # does nothing
        ("neuroendoscope", "stiffness.scale=1.1", []),
    ],
)
def test_what_a_model_cannot_hold_is_named(robot: str, effect: str, outside: list[str]) -> None:
    """By what it does to this robot, not by what it may do to another."""
    assert outside_the_robot(load_robot(robot, [f"effects.{effect}"])) == outside


@pytest.mark.slow
def test_a_file_driven_the_other_way_takes_effects_in_its_unit(tmp_path: Path) -> None:
    """Displacements of a robot whose default is tension: an offset in mm, as a diagnosis writes it."""
    robot = load_robot(SECTION.robot)
    (tmp_path / "in.csv").write_text("time_s,displacement_right_mm,displacement_left_mm\n0,0,0\n1,1,-1\n")
    words = ["--inputs", str(tmp_path / "in.csv"), "-o", str(tmp_path / "out.csv"), "--columns", "tip_x_mm"]
    words += ["--set", "friction.mu=0"]
    tips = []
    for more in ([], ["--set", "effects.actuation_offset.offset_right_mm=-0.5"]):
        assert main(["simulate", SECTION.robot, *words, *more]) == 0
        tips.append(read_table(str(tmp_path / "out.csv")).columns["tip_x_mm"][-1])
    assert 0.4 < tips[1] / tips[0] < 0.7
    assert read_inputs(robot, read_table(str(tmp_path / "in.csv"))).actuation == "displacement"


def test_a_models_text_is_written_with_the_effects_in_it() -> None:
    """A text without them and laws with them would be two robots."""
    robot = load_robot(SECTION.robot, ["effects.stiffness.scale=2"])
    with pytest.raises(InputError, match="build them in before the model's text is written"):
        Simulator(robot, model_text=build_mjcf(robot))
