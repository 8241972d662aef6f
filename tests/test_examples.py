"""The example files of own robots: each is read, built, simulated, computed, and refused where wrong."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import body_count, input_channels, joint_names, read_inputs
from catheter_sim.core.document import to_document
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots import kind_of
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table
from catheter_sim.theory.static_models import STATIC_MODELS

FOLDER = Path(__file__).parent.parent / "assets" / "examples"
ROWS = {
    "rolling": {"tension_up_N": (0.0, 3.0, 6.0, 2.0), "tension_aside_N": (0.0, 0.0, 2.0, 4.0)},
    "catheter": {
        "displacement_bend_x_mm": (0.0, 0.5, 1.0, 1.0),
        "displacement_bend_y_mm": (0.0, 0.0, 0.5, -0.5),
        "tube_mm": (0.0, 5.0, 10.0, 20.0),
        "displacement_roll_mm": (0.0, 0.5, 0.5, -0.5),
    },
    "notched_tube": {"tension_pull_N": (0.0, 3.5, 4.0, 3.0)},
}
MODEL = {"rolling": "complete", "catheter": "balance", "notched_tube": "kinetostatic"}
LENGTH = {"rolling": "length", "catheter": "length", "notched_tube": "spacing"}  # of a segment
KINDS = tuple(ROWS)


def path_of(kind: str) -> Path:
    return FOLDER / f"{kind}_robot.toml"


def robot_of(kind: str) -> RobotSpec:
    return load_robot(path_of(kind))


@pytest.mark.parametrize("kind", KINDS)
def test_example_is_of_its_kind_and_builds(kind: str) -> None:
    """MuJoCo reads the model that the example makes; it has the joints and the faces that outputs name."""
    robot = robot_of(kind)
    assert kind_of(robot).name == kind
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot))
    for name in joint_names(robot):
        assert model.joint(name).id >= 0
    assert model.site(f"face_{body_count(robot)}").id >= 0
    assert np.isfinite(model.site_pos).all()


@pytest.mark.parametrize("kind", KINDS)
def test_example_shows_every_key(kind: str) -> None:
    """The example's tables name every key that such a file may have, once at least."""
    text = path_of(kind).read_text()
    complete = to_document(robot_of(kind))
    keys = set(complete) | {key for part in complete["segments"] for key in part}
    keys |= {key for part in complete["tendons"] for key in part}
    keys |= {key for part in ("sleeve", "material", "mount", "dynamics") for key in complete.get(part, ())}
    missing = [key for key in keys if key not in text]
    assert not missing


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_simulation_of_the_example_agrees_with_its_statics(kind: str) -> None:
    """Along some rows the tip moves by millimetres, and lies within 0.05 mm of the static model's."""
    robot = robot_of(kind)
    rows = {name: np.array(values) for name, values in ROWS[kind].items()}
    assert set(rows) <= set(input_channels(robot))
    inputs = read_inputs(robot, Table(np.arange(4.0), rows))
    run = simulate(robot, inputs, np.zeros(3))
    assert run.failure is None
    simulated = np.array([posture.p_w[-1] for posture in run.postures])
    solved = STATIC_MODELS[MODEL[kind]].solve(robot, inputs, np.zeros(3)).postures
    computed = np.array([posture.p_w[-1] for posture in solved])
    assert np.linalg.norm(simulated[1:] - simulated[0], axis=1).min() > 5e-3
    assert np.linalg.norm(simulated - computed, axis=1).max() < 5e-5


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("kind = ", 'kind = "rollling"  #', "choices: continuum, rolling, catheter"),
        ("actuation = ", 'actuation = "pressure"  #', "actuation"),
        ("[friction]\nmu = ", "[friction]\nmy = ", "my"),
        ("[friction]\nmu = ", "[friction]\nmu = -1.0  #", "friction.mu = -1"),
    ],
)
def test_wrong_example_is_refused_by_key_and_choices(
    kind: str, old: str, new: str, message: str, tmp_path: Path
) -> None:
    """One line names the file, the key and what may stand there."""
    text = path_of(kind).read_text()
    assert text.count(old) == 1
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        load_robot(wrong)
    assert str(caught.value).startswith(str(wrong))
    assert "\n" not in str(caught.value)


def test_rod_on_a_joints_line_needs_mouths_that_lie_back(tmp_path: Path) -> None:
    """Where links touch, a rod through holes that are not countersunk has no length to bend over."""
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(path_of("rolling").read_text().replace("countersink_mm = 0.8", "countersink_mm = 0.0"))
    with pytest.raises(InputError, match=r"tendons.up.countersink_mm = 0: .* joint 2 in segment lower"):
        load_robot(wrong)


@pytest.mark.parametrize("kind", KINDS)
def test_examples_numbers_are_those_that_are_loaded(kind: str) -> None:
    """What the file says of a segment stands in the loaded robot, in SI units."""
    given = tomllib.loads(path_of(kind).read_text())
    robot = robot_of(kind)
    for table, segment in zip(given["segments"], robot.segments, strict=True):
        name = LENGTH[kind]
        assert math.isclose(getattr(segment, f"{name}_m"), 1e-3 * table[f"{name}_mm"])
