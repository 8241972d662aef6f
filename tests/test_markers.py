"""Markers beside their elements: simulation, static models, twin and built model say where they are alike."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import catheter_sim as cs
from catheter_sim.catalogue import load_robot
from catheter_sim.channels import body_count, output_channels, posture_columns, read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import Marker, RobotSpec
from catheter_sim.effects.apply import in_force, with_effects
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import twin_for

FOLDER = Path(__file__).parent.parent / "assets" / "examples"
NO_GRAVITY = np.zeros(3)
ROWS = {
    "continuum": {"displacement_upper_1_mm": (0.0, 4.0), "displacement_lower_2_mm": (0.0, 2.0)},
    "rolling": {"tension_up_N": (0.0, 6.0), "tension_aside_N": (0.0, 2.0)},
    "catheter": {"displacement_bend_x_mm": (0.0, 1.0), "displacement_roll_mm": (0.0, 0.5)},
    "notched_tube": {"tension_pull_N": (0.0, 3.5)},
}
MODEL = {"continuum": "VC", "rolling": "complete", "catheter": "balance", "notched_tube": "kinetostatic"}
RING, TOOL = (7e-3, -2e-3, 1e-3), (0.0, 0.0, 25e-3)  # in the frames of an element in the middle, of the last
COLUMNS = tuple(f"marker_{name}_{axis}_mm" for name in ("ring", "tool") for axis in "xyz")
POINTS = ("tip_x_mm", "tip_y_mm", "tip_z_mm", "tip_qw", "tip_qx", "tip_qy", "tip_qz")
TURNED = {
    "measurement_frame": {"rotation_y_deg": 20.0, "translation_x_mm": 3.0, "scale": 1.1, "shear_xz": 0.1}
}


def marked(kind: str) -> RobotSpec:
    """Return the example of a kind with a ring beside a disk in the middle, and a tool at its end."""
    robot = load_robot(FOLDER / f"{kind}_robot.toml")
    last = body_count(robot)
    return replace(robot, markers=(Marker("ring", last // 2, *RING), Marker("tool", last, *TOOL)))


def rows_of(robot: RobotSpec, kind: str) -> Inputs:
    return read_inputs(robot, Table(np.arange(2.0), {k: np.array(v) for k, v in ROWS[kind].items()}))


def expected_mm(robot: RobotSpec, posture: Posture) -> np.ndarray:
    """Return p + R offset of both markers one below the other, written without the package's own, [mm]."""
    middle = body_count(robot) // 2 - 1
    ring = posture.p_w[middle] + sum(posture.R_w[middle][:, axis] * RING[axis] for axis in range(3))
    tool = posture.p_w[-1] + TOOL[2] * posture.R_w[-1][:, 2]
    return 1e3 * np.concatenate([ring, tool])


def shown_mm(robot: RobotSpec, postures: tuple[Posture, ...]) -> np.ndarray:
    columns = posture_columns(robot, postures, COLUMNS)
    return np.stack([columns[name] for name in COLUMNS], axis=1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ROWS)
def test_a_marker_turns_with_its_element_in_every_solver(kind: str) -> None:
    """Simulation and statics: p + R offset to rounding; the twin: as far from them as its elements are."""
    robot = marked(kind)
    inputs = rows_of(robot, kind)
    runs = {
        "simulation": simulate(robot, inputs, NO_GRAVITY).postures,
        "statics": STATIC_MODELS[MODEL[kind]].solve(robot, inputs, NO_GRAVITY).postures,
    }
    for postures in runs.values():
        shown = shown_mm(robot, postures)
        np.testing.assert_allclose(shown, [expected_mm(robot, now) for now in postures], atol=1e-9)
        apart = np.linalg.norm(shown[1] - shown[0])
        assert apart > 2.0  # it moves
        straight_on = 1e3 * postures[1].p_w[-1] + [0.0, 0.0, 25.0]
        assert np.linalg.norm(shown[1, 3:] - straight_on) > 1.0  # and turns
    twin = twin_for(robot, robot.actuation, (*COLUMNS, *POINTS), NO_GRAVITY)([robot], inputs)[0]
    of_tip, turn = twin[:, 6:9], Rotation.from_quat(twin[:, 9:], scalar_first=True)
    np.testing.assert_allclose(twin[:, 3:6], of_tip + turn.apply([0.0, 0.0, 25.0]), atol=1e-6)
    middle = f"body_{body_count(robot) // 2}"
    names = tuple(f"{middle}_{axis}_mm" for axis in "xyz")
    body = twin_for(robot, robot.actuation, names, NO_GRAVITY)([robot], inputs)[0]
    posture = runs["simulation"][1]
    off = np.linalg.norm(body[1] - 1e3 * posture.p_w[body_count(robot) // 2 - 1])
    assert np.linalg.norm(twin[1, :3] - shown_mm(robot, (posture,))[0, :3]) < 0.1 + 1.5 * off


def test_what_is_seen_of_a_marker_is_what_is_seen_of_a_point() -> None:
    """A tracker's turned, stretched and sheared frame takes a marker where it takes any point: p' = S p."""
    robot = marked("continuum")
    inputs = rows_of(robot, "continuum")
    hidden = with_effects(robot, TURNED)
    true = STATIC_MODELS["VC"].solve(robot, inputs, NO_GRAVITY).postures
    force = in_force(hidden, inputs)
    seen = force.observed(STATIC_MODELS["VC"].solve(force.robot, force.inputs, NO_GRAVITY).postures)
    turn = Rotation.from_rotvec([0.0, 20.0, 0.0], degrees=True).as_matrix()
    share = np.eye(3)
    share[0, 2] = 0.1
    for before, after in zip(true, shown_mm(hidden, seen), strict=True):
        points = expected_mm(robot, before).reshape(2, 3)
        np.testing.assert_allclose(
            after.reshape(2, 3), 1.1 * (points @ turn.T + [3.0, 0.0, 0.0]) @ share.T, atol=1e-9
        )
    twin = twin_for(robot, "displacement", COLUMNS, NO_GRAVITY)
    own, other = twin([robot, hidden], inputs)
    expected = 1.1 * (own.reshape(-1, 3) @ turn.T + [3.0, 0.0, 0.0]) @ share.T
    np.testing.assert_allclose(other.reshape(-1, 3), expected, atol=1e-9)


def test_robots_of_a_fit_may_differ_in_where_a_marker_is() -> None:
    """The twin takes each robot's own offset: a straight robot's marker lies where the offset says."""
    robot = marked("continuum")
    other = replace(robot, markers=(robot.markers[0], replace(robot.markers[1], offset_x_m=4e-3)))
    still = rows_of(robot, "continuum")
    still = replace(still, tendon=np.zeros_like(still.tendon))
    one, two = twin_for(robot, "displacement", COLUMNS, NO_GRAVITY)([robot, other], still)
    np.testing.assert_allclose(two - one, np.tile([0, 0, 0, 4, 0, 0], (2, 1)), atol=1e-6)


@pytest.mark.parametrize("kind", ROWS)
def test_the_built_model_has_a_site_for_each_marker(kind: str) -> None:
    """At rest the site lies at the offset from its element's; without markers the model is as it was."""
    robot = marked(kind)
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    apart = data.site("marker_tool").xpos - data.site("tip").xpos
    np.testing.assert_allclose(apart, data.site("tip").xmat.reshape(3, 3) @ TOOL, atol=1e-9)
    bare = build_mjcf(replace(robot, markers=()))
    assert "marker_" not in bare
    assert model.nsite == mujoco.MjModel.from_xml_string(bare).nsite + 2


@pytest.mark.slow
def test_markers_stand_in_files_and_are_targets(tmp_path: Path) -> None:
    """Read from a file, changed by --set; inverse kinematics brings a tool's end to a point."""
    text = (FOLDER / "continuum_robot.toml").read_text()
    head = '[[markers]]\nname = "tool"\nelement = 12\noffset_z_mm = 25.0\n\n[friction]'
    path = tmp_path / "robot.toml"
    path.write_text(text.replace("[friction]", head))
    robot = load_robot(path)
    assert robot.markers == (Marker("tool", 12, 0.0, 0.0, 25e-3),)
    changed = load_robot(path, ["markers.tool.offset_x_mm=2"])
    assert changed.markers[0].offset_x_m == pytest.approx(2e-3)
    assert [name for name in output_channels(robot) if "marker" in name] == [
        f"marker_tool_{axis}_mm" for axis in "xyz"
    ]
    angle = math.radians(30.0)  # of one arc over both segments: where its end's tangent leads
    x = 120.0 * (1 - math.cos(angle)) / angle + 25.0 * math.sin(angle)
    z = 120.0 * math.sin(angle) / angle + 25.0 * math.cos(angle)
    target = {"marker_tool_x_mm": [x], "marker_tool_y_mm": [0.0], "marker_tool_z_mm": [z]}
    found = cs.inverse_kinematics(robot, target, corrections=None)
    assert found.reachable.all()
    at = cs.statics(robot, found.inputs, model="VC").to_table(list(target)).columns
    assert math.hypot(*(at[name][0] - target[name][0] for name in target)) < 1.0


@pytest.mark.slow
def test_a_marker_is_sensed_within_its_tolerance() -> None:
    """A ring whose offset is known to 0.5 mm lies within 0.475 mm, 19 times of 20; the tip within nothing."""
    robot = marked("continuum")
    pulled = {"time_s": [0.0, 1.0], "displacement_upper_1_mm": [0.0, 3.0]}
    names = ["marker_tool_x_mm", "tip_x_mm"]
    found = cs.sense(robot, pulled, uncertain={"markers.tool.offset_x_mm": 0.5}, columns=names)
    table = found.to_table().columns
    assert table["marker_tool_x_mm_high"][0] - table["marker_tool_x_mm"][0] == pytest.approx(0.475, abs=0.03)
    assert table["tip_x_mm_high"][0] == pytest.approx(table["tip_x_mm"][0], abs=1e-9)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("element = 0", "markers.ring.element = 0: the robot's elements are 1 to 12"),
        ("element = 13", "markers.ring.element = 13: the robot's elements are 1 to 12"),
        ("element = 3.0", "markers.ring: element: a whole number is needed"),
        ("offset_x_mm = 1", "markers.ring: element is missing"),
        ("element = 3\noffset_y_mm = nan", "markers.ring: offset_y_mm: a number is needed, not nan"),
        ("element = 3\noffset_y_mm = inf", "markers.ring.offset_y_mm = inf: must lie within 10000 mm"),
        ("element = 3\noffset_mm = [1, 2, 3]", "unknown key 'offset_mm'; choices: element, name, offset"),
        ('element = 3\n[[markers]]\nname = "ring"\nelement = 4', "marker 'ring' stands twice"),
        ('element = 3\n[[markers]]\nname = "a b"\nelement = 4', "marker 'a b': a name needs letters"),
    ],
)  # fmt: skip
def test_impossible_markers_are_named(line: str, message: str, tmp_path: Path) -> None:
    """One line names the file, the key and what may stand there."""
    path = tmp_path / "robot.toml"
    text = (FOLDER / "continuum_robot.toml").read_text()
    path.write_text(text.replace("[friction]", f'[[markers]]\nname = "ring"\n{line}\n\n[friction]'))
    with pytest.raises(InputError) as caught:
        load_robot(path)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
