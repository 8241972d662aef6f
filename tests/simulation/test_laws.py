"""Claims about each law of a simulated robot, on robots so short that a moment suffices."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from drive import rows_to_inputs

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import LinkForce
from catheter_sim.core.robot import RobotSpec
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.friction import CapstanFriction
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator

SHORT = ("segments.section.length_mm=10", "segments.section.disks=5")
CELL_STIFFNESS = 8.6e-3  # [N m/rad]
SPATIAL = (
    "disks_per_segment=1",
    "links_per_subsegment=1",
    *(f"segments.{name}.torsion_stiffness_N_mm2=inf" for name in ("first", "second")),
)


def cells(*settings: str) -> RobotSpec:
    return load_robot("neuroendoscope_section", (*SHORT, *settings))


# --- elastic law ---


def elastic_moments(x: float, y: float, cubic_mm2: float, quintic_mm4: float) -> np.ndarray:
    """Return spring and remainder of the first link's hinges, toward +x and +y [N m]."""
    law = [
        f"segments.{name}.stiffness_{term}={value}"
        for name in ("first", "second")
        for term, value in (("cubic_mm2", cubic_mm2), ("quintic_mm4", quintic_mm4))
    ]
    simulator = Simulator(load_robot("spacer_disk", (*SPATIAL, *law)))
    model, data = simulator.model, simulator.data
    data.qpos[:] = 0.0
    for name, value in (("x1", x), ("y1", y)):
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_forward(model, data)
    data.qfrc_applied[:] = 0.0
    for act in simulator.laws.between:
        act(simulator._now)
    total = data.qfrc_passive + data.qfrc_applied
    return -np.array([total[model.joint(name).dofadr[0]] for name in ("x1", "y1")])


@pytest.mark.parametrize(("cubic_mm2", "quintic_mm4"), [(0.0, 0.0), (-400.0, 0.0), (300.0, 2e5), (0.0, -3e5)])
def test_elastic_moment_is_the_law_of_the_curvature_vector(cubic_mm2: float, quintic_mm4: float) -> None:
    """M = EI k (1 + c3 |k|^2 + c5 |k|^4) along the curvature, whatever its direction: 50 mm a link."""
    rigidity = 211e9 * np.pi * 0.4e-3**4 / 4.0
    for x, y in ((0.8, 0.0), (0.0, -0.7), (0.6, 0.5), (-0.4, 0.9)):
        k = np.array([x, y]) / 0.05
        square = float(k @ k)
        expected = rigidity * k * (1.0 + cubic_mm2 * 1e-6 * square + quintic_mm4 * 1e-12 * square**2)
        assert elastic_moments(x, y, cubic_mm2, quintic_mm4) == pytest.approx(expected, rel=1e-6, abs=1e-9)


# --- forces and moments ---


@pytest.mark.slow
@pytest.mark.parametrize("moment", [2e-3, -2e-3])
def test_tip_moment_bends_every_cell_alike(moment: float) -> None:
    """M / K a cell, toward +x for a moment about +y; what is about x or z bends no planar robot."""
    moments = np.array([[0, moment, 0], [0.003, moment, 0.002]])
    inputs = replace(rows_to_inputs([(0, 0), (0, 0)]), moment_tip=moments)
    for posture in simulate(cells("friction.mu=0"), inputs, np.zeros(3)).postures:
        assert posture.joint_angles == pytest.approx(np.full(5, moment / CELL_STIFFNESS), rel=1e-4)


@pytest.mark.slow
def test_force_on_an_element_acts_at_its_point_wherever_that_has_turned() -> None:
    """A force at a point of cell 2 that leans by 1 rad: its moments about the hinges, by cross products."""
    simulator = Simulator(cells("friction.mu=0"))
    model, data = simulator.model, simulator.data
    force, point = np.array([0.3, 0.0, -0.2]), np.array([0.5e-3, 0.0, 1.5e-3])
    simulator.set_inputs(np.zeros(2), others=[LinkForce(2, tuple(point), tuple(force))])
    data.qpos[:2] = 0.5
    mujoco.mj_forward(model, data)
    data.qfrc_applied[:] = 0.0
    simulator._loads.apply(model, data)
    first, second = np.array([0.0, 0.0, 1e-3]), np.array([2e-3 * np.sin(0.5), 0.0, 1e-3 + 2e-3 * np.cos(0.5)])
    turned = np.array([[np.cos(1.0), 0, np.sin(1.0)], [0, 1, 0], [-np.sin(1.0), 0, np.cos(1.0)]])
    place = second + turned @ point
    expected = [np.cross(place - hinge, force)[1] for hinge in (first, second)]
    assert data.qfrc_applied[:2] == pytest.approx(expected, rel=1e-9)
    assert data.qfrc_applied[2:5] == pytest.approx(np.zeros(3), abs=1e-12)


# --- friction ---


@pytest.mark.parametrize("mu", [0.2, 0.5])
def test_pulled_tendon_loses_tension_by_the_capstan(mu: float) -> None:
    """At rest under 1.2 N: each hole takes exp(-mu turn), the turn half of both cells' bends."""
    run = simulate(cells(f"friction.mu={mu}"), rows_to_inputs([(1.2, 0.0)]), np.zeros(3))
    posture = run.postures[0]
    angles = posture.joint_angles
    turn = 0.5 * (angles + np.concatenate([[0.0], angles[:-1]]))
    assert angles.sum() > 0.5
    assert posture.tendon_tension[0] == pytest.approx(1.2 * np.exp(-mu * np.cumsum(turn)), rel=2e-3)


def test_reset_forgets_tensions_and_commands() -> None:
    """After a pull and a reset nothing is left of it: spans without tension, the command before at zero."""
    simulator = Simulator(cells("friction.mu=0.4"), "displacement")
    simulator.set_inputs(np.array([1e-3, -1e-3]))
    simulator.step(60)
    assert simulator.span_tension()[0].max() > 0.1
    assert simulator._actuation._ctrl_before == pytest.approx([1e-3, -1e-3])
    simulator.reset()
    assert not simulator.span_tension().any()
    assert not simulator._actuation._ctrl_before.any()


def test_what_a_joint_yields_is_what_the_step_makes_of_it() -> None:
    """A unit moment over a step turns a hinge by h / (I + h (d + h k)) rad/s: inertia, damper, spring."""
    simulator = Simulator(cells("friction.mu=0.4", "dynamics.relaxation_time_s=0.01"), inertia=False)
    model = simulator.model
    law = simulator.laws.friction
    assert isinstance(law, CapstanFriction)
    step = model.opt.timestep
    expected = step / (CELL_STIFFNESS * (0.01**2 + step * (0.01 + step)))
    assert law.yielding[:5] == pytest.approx(np.full(5, expected), rel=1e-6)


def test_tension_of_a_driven_tendon_is_that_of_now() -> None:
    """At every step of a fast pull: stiffness times what the drive has drawn beyond the path's shortening."""
    robot = cells(
        "friction.mu=0.3", "tendons.right.stiffness_N_per_mm=2", "tendons.left.stiffness_N_per_mm=2"
    )
    simulator = Simulator(robot, "displacement")
    data, model = simulator.data, simulator.model
    seen = []
    for share in (0.25, 0.5, 0.75, 1.0, 0.6, 0.2):
        simulator.set_inputs(np.array([share * 1e-3, 0.0]))
        simulator.step(3)
        mujoco.mj_fwdPosition(model, data)
        drawn = share * 1e-3 + data.ten_length[model.tendon("tendon_right").id] - 0.01
        expected = max(2e3 * drawn, 0.0)
        seen.append(expected)
        assert simulator.actuator_tension()[0] == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert np.ptp(seen) > 0.2


def test_tension_without_friction_is_one_all_along_a_driven_tendon_that_moves() -> None:
    """In a fast pull, at every step: that of the drive, not that of a step before."""
    simulator = Simulator(cells("friction.mu=0"), "displacement")
    moved = []
    for step in range(1, 21):
        simulator.set_inputs(step * np.array([2e-5, -2e-5]))
        simulator.step()
        posture = simulator.posture()
        moved.append(posture.actuator_tension[0])
        for tension, spans in zip(posture.actuator_tension, posture.tendon_tension, strict=True):
            assert spans[np.isfinite(spans)] == pytest.approx(tension, rel=1e-12)
    assert np.ptp(moved) > 1e-3


# --- runs ---


def test_inertia_goes_and_the_weight_stays() -> None:
    """A quasi-static model: masses and moments of inertia a thousandth, mass times gravity as before."""
    robot = cells("friction.mu=0")
    gravity = (1.0, 0.0, -9.81)
    heavy, light = (Simulator(robot, gravity_mps2=gravity, inertia=kept) for kept in (True, False))
    assert light.model.body_mass[1:] == pytest.approx(heavy.model.body_mass[1:] / 1e3)
    assert light.model.body_inertia[1:] == pytest.approx(heavy.model.body_inertia[1:] / 1e3)
    weights = [item.model.body_mass.sum() * item.model.opt.gravity for item in (heavy, light)]
    assert weights[1] == pytest.approx(weights[0])
    assert weights[0] == pytest.approx(450e-6 * np.array(gravity))


def test_held_rows_are_reached_from_the_row_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Between two rows every input lies between them, and moves toward the second one."""
    given: list[np.ndarray] = []
    original = Simulator.put_inputs

    def recorded(self: Simulator, tendon: np.ndarray, *rest: object, **named: object) -> None:
        given.append(np.array(tendon))
        original(self, tendon, *rest, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(Simulator, "put_inputs", recorded)
    simulate(cells("friction.mu=0"), rows_to_inputs([(0.2, 0.1), (0.3, 0.05)]), np.zeros(3), ramp_s=0.05)
    table = np.array(given)
    start = int(np.flatnonzero((table == (0.2, 0.1)).all(axis=1))[-1])
    way = table[start:]
    assert (np.diff(way[:, 0]) >= 0.0).all()
    assert (np.diff(way[:, 1]) <= 0.0).all()
    assert way[:, 0].min() == pytest.approx(0.2)
    assert way[-1] == pytest.approx([0.3, 0.05])


# --- catheters ---


def catheter(*settings: str) -> CatheterRobot:
    robot = load_robot("mitral_transseptal", settings)
    assert isinstance(robot, CatheterRobot)
    return robot


def test_play_lets_the_drive_go_half_its_width_to_either_side() -> None:
    """0.4 mm of play about rest: 1 mm out arrives as 0.8 mm, back to 0.7 mm as 0.8, to 0.3 mm as 0.5."""
    simulator = Simulator(catheter("tendons.torsion_distal.play_mm=0.4"))
    arrived = []
    for commanded in (1.0, 0.7, 0.3, -1.0):
        simulator.set_inputs(np.array([0.0, 0.0, commanded * 1e-3, 0.0]))
        arrived.append(float(simulator.data.ctrl[2]) * 1e3)
    assert arrived == pytest.approx([0.8, 0.8, 0.5, -0.8])


@pytest.mark.parametrize("way_mm", [0.8, -1.5])
def test_torsion_drive_lets_go_at_the_angle_of_the_unwound_tendon(way_mm: float) -> None:
    """At the angle of Eq. 6 the actuator's moment is nothing, and its slope there holds the joint."""
    robot = catheter()
    segment = next(item for item in robot.segments if item.name == "torsion_proximal")
    place = [pair.moves for pair in robot.tendons].index("torsion_proximal")
    simulator = Simulator(robot)
    model, data = simulator.model, simulator.data
    row = np.zeros(4)
    row[place] = way_mm * 1e-3
    simulator.set_inputs(row)
    whole = np.hypot(segment.tendon_radius_m * segment.wrap_rad, segment.wrap_height_m)
    around = np.sqrt((whole - abs(way_mm) * 1e-3) ** 2 - segment.wrap_height_m**2)
    angle = np.sign(way_mm) * (segment.wrap_rad - around / segment.tendon_radius_m)
    data.qpos[model.joint("torsion_proximal").qposadr[0]] = angle
    mujoco.mj_fwdPosition(model, data)
    drive = model.actuator(f"tendon_{robot.tendons[place].name}").id
    for act in simulator.laws.actuate:
        act(simulator._now)

    def moment(turn: float) -> float:
        bias = model.actuator_biasprm[drive]
        return float(model.actuator_gainprm[drive, 0] * data.ctrl[place] + bias[0] + bias[1] * turn)

    assert moment(angle) == pytest.approx(0.0, abs=1e-6)
    assert moment(angle + 0.01) < -1e-3 < 1e-3 < moment(angle - 0.01)
