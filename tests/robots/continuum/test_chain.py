"""Claims about a chain of cells as it stands in its MJCF: places, rest, tendons that are driven."""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots.continuum.model import drive_stiffness
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.simulation.simulator import Simulator

COARSE = ("disks_per_segment=2", "links_per_subsegment=2")
SHORT = ("segments.section.length_mm=10", "segments.section.disks=5")


def continuum(reference: str, *settings: str) -> ContinuumRobot:
    robot = load_robot(reference, settings)
    assert isinstance(robot, ContinuumRobot)
    return robot


def at_rest(robot: ContinuumRobot, actuation: str = "tension") -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return the model and its state with every spring at rest."""
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot, actuation))
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos_spring
    mujoco.mj_forward(model, data)
    return model, data


def test_hinges_are_in_the_middle_and_holes_in_the_faces() -> None:
    """Cell k of 2 mm: its hinge at 2 k - 1 mm, its eyelets 1.4 mm to both sides at 2 k mm."""
    model, data = at_rest(continuum("neuroendoscope_section"))
    for k in range(1, 31):
        assert data.xanchor[model.joint(f"x{k}").id] == pytest.approx([0, 0, (2 * k - 1) * 1e-3], abs=1e-9)
        assert data.site(f"hole_right_{k}").xpos == pytest.approx([1.4e-3, 0, 2e-3 * k], abs=1e-9)
        assert data.site(f"hole_left_{k}").xpos == pytest.approx([-1.4e-3, 0, 2e-3 * k], abs=1e-9)


@pytest.mark.parametrize(("x", "y"), [(4.0, 0.0), (-4.0, 0.0), (0.0, 4.0), (0.0, -4.0)])
def test_rest_curvature_bends_toward_its_sign(x: float, y: float) -> None:
    """100 mm at 4 per m end in an arc of 0.4 rad toward +x or +y, or to the other side."""
    segments = [
        f"segments.{name}.rest_curvature_{axis}_per_m={value}"
        for name in ("first", "second")
        for axis, value in (("x", x), ("y", y))
    ]
    _, data = at_rest(continuum("spacer_disk", *COARSE, *segments))
    across = (1.0 - np.cos(0.4)) / 4.0
    expected = [np.sign(x) * across, np.sign(y) * across, np.sin(0.4) / 4.0]
    assert data.site("tip").xpos == pytest.approx(expected, abs=5e-5)


@pytest.mark.parametrize("twist_deg_per_m", [600.0, -600.0])
def test_holes_wind_with_the_rest_twist(twist_deg_per_m: float) -> None:
    """A hole at height z is turned by twist times z, counter-clockwise about +z for a positive twist."""
    settings = [f"segments.{name}.rest_twist_deg_per_m={twist_deg_per_m}" for name in ("first", "second")]
    _, data = at_rest(continuum("spacer_disk", *COARSE, *settings))
    start = data.site("hole_3_0").xpos
    end = data.site("hole_3_4").xpos
    assert end[2] - start[2] == pytest.approx(0.1, abs=1e-9)
    turned = np.arctan2(end[1], end[0]) - np.arctan2(start[1], start[0])
    assert np.degrees(np.angle(np.exp(1j * turned))) == pytest.approx(0.1 * twist_deg_per_m, abs=1e-6)


@pytest.mark.parametrize("scale", [0.1, 1.0, 10.0])
def test_inextensible_tendon_is_a_thousand_times_stiffer_than_its_bending(scale: float) -> None:
    """k = 1000 / (r^2 L / EI), with the scaled EI: of a robot ten times as stiff, ten times."""
    robot = continuum("spacer_disk", *COARSE, f"stiffness_scale={scale}")
    rigidity = 211e9 * np.pi * 0.4e-3**4 / 4.0 * scale
    for tendon, length in zip(robot.tendons, (0.05, 0.05, 0.1, 0.1), strict=True):
        expected = 1000.0 * rigidity / (length * tendon.radius_m**2)
        assert drive_stiffness(robot, tendon) == pytest.approx(expected, rel=1e-9)
    model, _ = at_rest(robot, "displacement")
    assert -model.actuator_gainprm[0, 0] == pytest.approx(drive_stiffness(robot, robot.tendons[0]))


@pytest.mark.parametrize("pretension", [0.0, 0.2])
def test_driven_tendon_pulls_with_its_pretension(pretension: float) -> None:
    """Straight and undisplaced, both tendons of a pair pull with just their pretension."""
    settings = [f"tendons.{name}.pretension_N={pretension}" for name in ("right", "left")]
    robot = continuum("neuroendoscope_section", *SHORT, "friction.mu=0", *settings)
    simulator = Simulator(robot, "displacement")
    assert simulator.actuator_tension() == pytest.approx([pretension, pretension], abs=1e-6)
    simulator.step(20)
    assert simulator.actuator_tension() == pytest.approx([pretension, pretension], abs=1e-6)


def test_friction_tails_run_from_their_hole_to_the_tendons_end() -> None:
    """Tail k of a straight robot of five cells is 10 - 2 k mm long."""
    robot = continuum("neuroendoscope_section", *SHORT)
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot, "tension", True))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for name in ("right", "left"):
        lengths = [data.ten_length[model.tendon(f"tail_{name}_{k}").id] for k in range(5)]
        assert lengths == pytest.approx([10e-3, 8e-3, 6e-3, 4e-3, 2e-3], abs=1e-9)


@cache
def two_planes() -> mujoco.MjModel:
    """Return the full robot of rolling joints, whose every segment bends in both planes."""
    settings = [f"segments.{name}.bending_axes=xy" for name in ("base", "middle")]
    return mujoco.MjModel.from_xml_string(build_mjcf(load_robot("chest_tube", settings)))


@pytest.mark.slow
@pytest.mark.parametrize(("joint", "axis"), [("x1", 0), ("y2", 1)])
@pytest.mark.parametrize("turn", [0.02, -0.02])
def test_rolling_joints_bend_toward_their_side(joint: str, axis: int, turn: float) -> None:
    """A positive angle of joint x<k> of the full robot leans what is beyond toward +x, of y<k> toward +y."""
    model = two_planes()
    data = mujoco.MjData(model)
    data.qpos[model.joint(joint).qposadr[0]] = turn
    mujoco.mj_forward(model, data)
    lean = data.site("tip").xmat.reshape(3, 3)[:, 2]
    assert lean[axis] == pytest.approx(np.sin(turn), abs=1e-9)
    assert lean[1 - axis] == pytest.approx(0.0, abs=1e-9)
