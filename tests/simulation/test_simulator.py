"""Claims about a simulated robot without its friction: equilibrium, actuation, weight, divergence."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest
from drive import rows_to_inputs, tips_mm

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import joint_names
from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator

NO_GRAVITY = np.zeros(3)


def section(*changes):
    return load_robot("neuroendoscope_section", ("friction.mu=0", *changes))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["neuroendoscope", "neuroendoscope_section", "spacer_disk"])
def test_compiled_model_holds_the_declared_numbers(name):
    """Hinges, lengths, masses and stiffness of the compiled model are those of the specification."""
    robot = load_robot(name)
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot))
    assert model.njnt == len(joint_names(robot))
    assert model.ntendon == model.nu == len(robot.tendons)
    assert model.body_mass.sum() == pytest.approx(sum(segment.mass_kg for segment in robot.segments))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    length = sum(segment.length_m for segment in robot.segments)
    assert data.site("tip").xpos == pytest.approx([0.0, 0.0, length], abs=1e-12)
    # Hinges in series: their compliances add up to L / EI.
    bending = [
        model.jnt_stiffness[model.joint(name).id].item() for name in joint_names(robot) if name[0] == "x"
    ]
    expected = sum(segment.length_m / segment.bending_stiffness_N_m2 for segment in robot.segments)
    assert sum(1.0 / k for k in bending) == pytest.approx(expected, rel=1e-6)


def test_cells_balance_the_tendons():
    """At rest K theta = D d cos(theta/2) + S a sin(theta/2) holds in every cell."""
    run = simulate(section(), rows_to_inputs([(0.35, 0.1)]), NO_GRAVITY)
    theta = run.postures[0].joint_angles
    difference, total = 0.25, 0.45
    torque = difference * 1.4e-3 * np.cos(theta / 2) + total * 1e-3 * np.sin(theta / 2)
    assert 8.6e-3 * theta == pytest.approx(torque, rel=1e-4)


def test_a_tip_force_bends_like_a_chain_of_hinges():
    """A small sideways force moves the tip by F sum((L - z_k)^2) / K."""
    force = 1e-4
    run = simulate(section(), rows_to_inputs([(0, 0)], force=[(force, 0, 0)]), NO_GRAVITY)
    arms = 0.06 - (2 * np.arange(1, 31) - 1) * 1e-3
    assert run.postures[0].p_w[-1][0] == pytest.approx(force * np.sum(arms**2) / 8.6e-3, rel=1e-3)


def test_weight_bends_like_a_chain_of_hinges():
    """A weak sideways gravity moves the tip as the masses' moments at the hinges say."""
    weak = 0.01
    run = simulate(section(), rows_to_inputs([(0, 0)]), np.array([weak, 0, 0]))
    hinges = (2 * np.arange(1, 31) - 1) * 1e-3
    masses = 2 * np.arange(1, 31) * 1e-3
    moments = np.array([15e-6 * weak * np.sum((masses - z)[masses > z]) for z in hinges])
    assert run.postures[0].p_w[-1][0] == pytest.approx(np.sum(moments * (0.06 - hinges)) / 8.6e-3, rel=1e-3)


@pytest.mark.slow
def test_weight_is_the_same_with_and_without_inertia():
    """Taking the inertia away keeps every weight: the same sag."""
    tips = []
    for inertia in (True, False):
        simulator = Simulator(section(), gravity_mps2=(9.81, 0, 0), inertia=inertia)
        simulator.settle(20.0)
        tips.append(simulator.posture().p_w[-1])
    assert tips[0] == pytest.approx(tips[1], abs=2e-6)


@pytest.mark.slow
def test_displacement_reproduces_the_tension_that_it_takes():
    """Pulled by displacement, then by the tension found: the same posture."""
    pulled = simulate(section(), rows_to_inputs([(1.5e-3, -1.5e-3)], "displacement"), NO_GRAVITY)
    tension = pulled.postures[0].actuator_tension
    assert tension[0] > 0.1
    assert tension[1] == 0.0
    again = simulate(section(), rows_to_inputs([tension]), NO_GRAVITY)
    assert tips_mm(again)[0] == pytest.approx(tips_mm(pulled)[0], abs=0.01)


@pytest.mark.slow
def test_inextensible_tendon_keeps_its_length():
    """The displaced tendon's path shortens by the displacement, to 0.2 %."""
    simulator = Simulator(section(), "displacement", inertia=False)
    rest = simulator.data.ten_length[0]
    simulator.set_inputs(np.array([1e-3, -1e-3]))
    simulator.settle()
    simulator.posture()
    mujoco.mj_fwdPosition(simulator.model, simulator.data)
    assert rest - simulator.data.ten_length[0] == pytest.approx(1e-3, rel=2e-3)


def test_elastic_tendon_stretches_by_its_tension():
    """Displacement = shortening of the path + tension / stiffness."""
    robot = section("tendons.right.stiffness_N_per_mm=0.5")
    simulator = Simulator(robot, "displacement", inertia=False)
    rest = simulator.data.ten_length[0]
    simulator.set_inputs(np.array([1e-3, 0.0]))
    simulator.settle()
    tension = simulator.actuator_tension()[0]
    mujoco.mj_fwdPosition(simulator.model, simulator.data)
    shortening = rest - simulator.data.ten_length[0]
    assert shortening + tension / 500.0 == pytest.approx(1e-3, rel=1e-3)


def test_mount_gives_way_under_the_summed_tension():
    """A compliant mount sinks by the sum of the tensions over its stiffness."""
    robot = section("mount.axial_stiffness_N_per_mm=2.0")
    run = simulate(robot, rows_to_inputs([(0.3, 0.3)]), NO_GRAVITY)
    assert run.postures[0].p_w[-1][2] == pytest.approx(0.06 - 0.6 / 2000.0, abs=1e-6)


@pytest.mark.slow
def test_unloaded_precurved_robot_rests_in_its_curve():
    """A rest curvature of 10 / m is the unloaded shape, whichever way the tendons are driven."""
    robot = section("segments.section.rest_curvature_x_per_m=10")
    for actuation in ("tension", "displacement"):
        run = simulate(robot, rows_to_inputs([(0.0, 0.0)], actuation), NO_GRAVITY)
        assert run.postures[0].joint_angles == pytest.approx(0.02, abs=1e-6)


@pytest.mark.slow
def test_stiffening_law_in_space_does_not_depend_on_direction():
    """With a cubic law the bend under a tendon is the same in every bending direction."""
    bends = []
    for angle in (0.0, 20.0, 45.0):
        changes = (
            "links_per_subsegment=1",
            "segments.first.stiffness_cubic_mm2=10000",
            "segments.second.stiffness_cubic_mm2=10000",
            f"tendons.3.angle_deg={90 + angle}",
        )
        robot = load_robot("spacer_disk", changes)
        run = simulate(robot, rows_to_inputs([(0, 0, 2.0, 0)]), NO_GRAVITY)
        bends.append(np.arccos(run.postures[0].R_w[-1][2, 2]))
    plain = load_robot("spacer_disk", ("links_per_subsegment=1",))
    linear = simulate(plain, rows_to_inputs([(0, 0, 2.0, 0)]), NO_GRAVITY)
    assert bends == pytest.approx([bends[0]] * 3, rel=1e-3)
    assert bends[0] < 0.95 * np.arccos(linear.postures[0].R_w[-1][2, 2])


@pytest.mark.slow
def test_bending_toward_plus_x_and_plus_y():
    """The right tendon moves the tip toward +x; a tendon at +y moves it toward +y."""
    assert tips_mm(simulate(section(), rows_to_inputs([(0.2, 0)]), NO_GRAVITY))[0, 0] > 5.0
    disk = load_robot("spacer_disk", ("links_per_subsegment=1",))
    tip = tips_mm(simulate(disk, rows_to_inputs([(0, 0, 1.0, 0)]), NO_GRAVITY))[0]
    assert tip[1] > 5.0
    assert abs(tip[0]) < 1e-6


def test_divergence_keeps_the_rows_before_it():
    """A robot that diverges reports row and time; the rows before it are there."""
    robot = section()
    wild = dataclasses.replace(
        robot, dynamics=dataclasses.replace(robot.dynamics, timestep_s=0.005, relaxation_time_s=1e-9)
    )
    inputs = rows_to_inputs([(0.1, 0.0), (0.2, 0.0), (1e9, 0.0)])
    run = simulate(wild, inputs, NO_GRAVITY)
    assert run.failure is not None
    assert "row 3" in run.failure
    assert "time_s = 2" in run.failure
    assert len(run.postures) == 2


def test_state_that_is_not_finite_is_an_error():
    """A NaN in the state is met on purpose: it is raised, not reset."""
    simulator = Simulator(section())
    simulator.data.qpos[3] = np.nan
    with pytest.raises(SimulationDiverged, match="diverged"):
        simulator.settle()


def test_unknown_friction_route_names_the_choices():
    """One line with the choices."""
    with pytest.raises(InputError, match="capstan, nested, none"):
        Simulator(section(), friction="grease")


@pytest.mark.parametrize(
    ("name", "tension"),
    [
        ("neuroendoscope_section", (0.3, 0.1)),
        ("chest_tube_section", (20.0,)),
        ("chest_tube_section@prototype", (20.0,)),
    ],
)
def test_reset_forgets_everything(name, tension):
    """After reset the same inputs give the same numbers, bit for bit; soft links included."""
    simulator = Simulator(load_robot(name))
    results = []
    for _ in range(2):
        simulator.reset()
        simulator.set_inputs(np.array(tension), force_tip=(0.01, 0, 0))
        simulator.step(300)
        results.append(simulator.posture().p_w.copy())
    assert (results[0] == results[1]).all()


@pytest.mark.slow
def test_dynamic_run_follows_the_clock():
    """In a dynamic run the simulated time is the table's, and fast inputs lag behind."""
    inputs = dataclasses.replace(rows_to_inputs([(0, 0), (0.3, 0)]), time_s=np.array([0.0, 0.05]))
    quick = tips_mm(simulate(section(), inputs, NO_GRAVITY, dynamic=True))
    held = tips_mm(simulate(section(), inputs, NO_GRAVITY))
    assert 0.5 < quick[1, 0] < 0.8 * held[1, 0]


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [150.0, 400.0, 1000.0])
def test_rows_closer_than_a_step_move_the_robot_as_the_clock_says(rate_hz):
    """A pull that rises for half a second bends the robot as far, however finely it was recorded."""
    robot = load_robot("neuroendoscope_section")

    def end_mm(rate):
        time_s = np.arange(round(0.5 * rate) + 1) / rate
        inputs = rows_to_inputs(np.column_stack([0.6 * time_s, 0.0 * time_s]))
        inputs = dataclasses.replace(inputs, time_s=time_s)
        return tips_mm(simulate(robot, inputs, np.zeros(3), dynamic=True))[-1]

    assert end_mm(rate_hz) == pytest.approx(end_mm(20.0), abs=0.5)
    assert end_mm(20.0)[0] > 5.0
