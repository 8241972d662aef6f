"""Claims about simulated catheters: displacements to angles, tips, tensions, loads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from drive import rows_to_inputs

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.cli.main import main
from catheter_sim.core.inputs import LinkForce
from catheter_sim.core.posture import Posture
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter import kinematics
from catheter_sim.robots.catheter.description import hinge_counts, moved_segment, moving, turning
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator

ROBOTS = ("mitral_transseptal", "mitral_4dof")
NO_GRAVITY = np.zeros(3)


def catheter(name: str, *settings: str) -> CatheterRobot:
    robot = load_robot(name, settings)
    assert isinstance(robot, CatheterRobot)
    return robot


def moved(robot: CatheterRobot) -> list[CatheterSegment]:
    return [robot.segments[moved_segment(robot, pair)] for pair in range(len(robot.tendons))]


def drawn(segment: CatheterSegment, value: Array) -> Array:
    """Return the displacement for a joint value, written out from the papers' equations [m]."""
    size = np.abs(value)
    if segment.joint == "prismatic":
        return np.asarray(value)
    if segment.joint == "bending":  # 2022 Eq. 3, 2023 Eq. 12
        half = size / (2 * (segment.rings + 1))
        t, a = segment.half_gap_m, segment.arm_m
        return np.sign(value) * 2 * (segment.rings + 1) * (t * (1 - np.cos(half)) + a * np.sin(half))
    r, h, at = segment.tendon_radius_m, segment.wrap_height_m, segment.wrap_rad  # 2022 Eq. 6, 2023 Eq. 13
    return np.sign(value) * (np.hypot(r * at, h) - np.hypot(r * (at - size), h))


def angles(robot: CatheterRobot, posture: Posture) -> dict[str, float]:
    """Return the joints' angles, a bending joint's gaps summed [rad]."""
    ends = np.cumsum(hinge_counts(robot))[:-1]
    parts = np.split(posture.joint_angles, ends)
    return {segment.name: float(part.sum()) for segment, part in zip(turning(robot), parts, strict=True)}


def at_rest(robot: CatheterRobot, displacement_mm: tuple[float, ...], **loads: object) -> Posture:
    """Return the posture at rest, one row from rest, under `loads` of `Simulator.set_inputs`."""
    simulator = Simulator(robot, inertia=False)
    simulator.set_inputs(np.array(displacement_mm) * 1e-3)
    assert simulator.settle()
    simulator.set_inputs(np.array(displacement_mm) * 1e-3, **loads)
    assert simulator.settle()
    return simulator.posture()


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_displacement_turns_every_joint_as_the_papers_say(name: str) -> None:
    """Over the whole range, both signs, loading and back: within 0.05 deg of Eqs 3, 6, 12, 13 (0.5 asked)."""
    robot = catheter(name)
    share = np.array([0.2, 0.6, 1.0, 0.5, 0.0, -0.4, -1.0, -0.3])
    limit = [segment.limit_rad or 0.5 * segment.stroke_m for segment in moved(robot)]
    wanted = share[:, np.newaxis] * limit
    wanted[:, [segment.joint == "prismatic" for segment in moved(robot)]] = 0.03
    rows = np.stack([drawn(segment, wanted[:, k]) for k, segment in enumerate(moved(robot))], axis=1)
    run = simulate(robot, rows_to_inputs(rows, "displacement"), NO_GRAVITY)
    assert run.at_rest.all()
    for row, posture in enumerate(run.postures):
        found = angles(robot, posture)
        for k, segment in enumerate(moved(robot)):
            if segment.joint != "prismatic":
                assert np.degrees(found[segment.name]) == pytest.approx(
                    np.degrees(wanted[row, k]), abs=0.05
                ), (row, segment.name)


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_tip_is_where_the_closed_form_has_it(name: str) -> None:
    """Twelve random postures within the limits (seed 7): within 0.05 mm and 0.05 deg of 2022 Eqs 14-15 and
    2023 Eqs 6-7 (0.3 mm asked). What is left is the chain of hinges and the drives' small yield.
    """
    robot = catheter(name)
    generator = np.random.default_rng(7)
    segments = [robot.segments[index] for index in moving(robot)]
    low = [0.0 if segment.joint == "prismatic" else -segment.limit_rad for segment in segments]
    high = [segment.stroke_m or segment.limit_rad for segment in segments]
    q = generator.uniform(low, high, size=(12, 4))
    order = [segments.index(segment) for segment in moved(robot)]
    rows = np.stack([drawn(segments[joint], q[:, joint]) for joint in order], axis=1)
    run = simulate(robot, rows_to_inputs(rows, "displacement"), NO_GRAVITY)
    if name == "mitral_transseptal":
        tool = kinematics.transseptal_tool(robot, q)
    else:
        tool = kinematics.four_dof_tool(robot, q)
    place, R = kinematics.in_base_frame(*tool)
    ours = np.array([posture.p_w[-1] for posture in run.postures])
    assert np.linalg.norm(ours - place, axis=1).max() < 5e-5
    turned = np.array([posture.R_w[-1] for posture in run.postures]) @ R.swapaxes(-1, -2)
    assert np.degrees(np.arccos(np.clip((np.trace(turned, axis1=1, axis2=2) - 1) / 2, -1, 1))).max() < 0.05


@pytest.mark.slow
def test_transseptal_robot_meets_the_reference_table() -> None:
    """Displacements [mm] to angles [deg] and tip [mm], computed independently: 0.3 mm and 0.5 deg asked."""
    rows = np.array([(0, 0, 0, 0), (1, 1, -1, 20), (3, 0, 2, 0), (-2, 1.5, 0, 50)])
    expected = [
        (0.000, 0.000, 0.000, 0.000, 0.000, 57.340),
        (31.719, 22.157, -21.432, 22.807, 9.288, 71.183),
        (94.558, 0.000, 43.583, 31.293, 0.000, 33.398),
        (-63.230, 33.612, 0.000, -58.190, -38.679, 68.009),
    ]
    robot = catheter("mitral_transseptal")
    run = simulate(robot, rows_to_inputs(rows * 1e-3, "displacement"), NO_GRAVITY)
    for posture, row in zip(run.postures, expected, strict=True):
        found = angles(robot, posture)
        names = ("bending", "torsion_proximal", "torsion_distal")
        assert np.degrees([found[item] for item in names]) == pytest.approx(row[:3], abs=0.02)
        assert posture.p_w[-1] * 1e3 == pytest.approx(row[3:], abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_pulled_tendon_balances_the_joint_and_the_released_one_is_slack(name: str) -> None:
    """Tension = joint stiffness * bend / (dl / dbend), to 0.1 %; nothing else carries any."""
    robot = catheter(name)
    rows = np.array([(1.5, 1.0, 1.0, 20.0), (-2.5, 2.0, -1.0, 0.0)]) * 1e-3
    run = simulate(robot, rows_to_inputs(rows, "displacement"), NO_GRAVITY)
    for posture in run.postures:
        found = angles(robot, posture)
        for k, segment in enumerate(moved(robot)):
            tension = posture.actuator_tension[k]
            if segment.joint != "bending":
                assert tension == pytest.approx(0.0, abs=1e-3)
                continue
            bend = abs(found[segment.name])
            step = 1e-6
            arm = (
                float(drawn(segment, np.array(bend + step)) - drawn(segment, np.array(bend - step)))
                / step
                / 2
            )
            assert tension == pytest.approx(segment.bending_stiffness_N_m_per_rad * bend / arm, rel=1e-3)
    simulator = Simulator(robot, inertia=False)
    simulator.set_inputs(rows[0])
    assert simulator.settle()
    for k, segment in enumerate(moved(robot)):
        if segment.joint == "bending":
            released = simulator.data.actuator(f"antagonist_{robot.tendons[k].name}").force[0]
            assert released == pytest.approx(0.0, abs=1e-6)
            data = simulator.data
            paid_out = float(data.tendon(f"tendon_{robot.tendons[k].name}_neg").length[0])
            number = simulator.model.tendon(f"tendon_{robot.tendons[k].name}_neg").id
            rest = float(simulator.model.tendon_length0[number])
            assert rest + rows[0, k] > paid_out + 1e-6  # the pulley let go of more


@pytest.mark.parametrize("name", ROBOTS)
def test_moment_against_the_pull_tightens_the_tendon_and_moves_nothing(name: str) -> None:
    """A moment M on the tip about the joint's axis: the angle stays to 0.05 deg; M / arm more tension."""
    robot = catheter(name)
    segment = next(item for item in robot.segments if item.joint == "bending")
    index = [item.name for item in moved(robot)].index(segment.name)
    displacement = tuple(2.0 if k == index else 0.0 for k in range(4))
    free = at_rest(robot, displacement)
    loaded = at_rest(robot, displacement, moment_tip=(0.0, -4e-3, 0.0))
    bend = angles(robot, free)[segment.name]
    assert np.degrees(angles(robot, loaded)[segment.name] - bend) == pytest.approx(0.0, abs=0.05)
    arm = float(kinematics.arm_m(segment, bend))
    more = loaded.actuator_tension[index] - free.actuator_tension[index]
    assert more == pytest.approx(4e-3 / arm, rel=2e-3)


@pytest.mark.slow
def test_moment_with_the_pull_bends_on_until_the_antagonist_is_taut() -> None:
    """The pulley has let go of more than the joint took up (Eq. 4): it gives way by just that play."""
    robot = catheter("mitral_transseptal")
    segment = robot.segments[1]
    loaded = at_rest(robot, (2.0, 0.0, 0.0, 0.0), moment_tip=(0.0, 0.05, 0.0))
    bend = angles(robot, loaded)["bending"]
    free = float(kinematics.angle_rad(segment, 2e-3))
    assert bend > free + np.radians(0.5)
    assert float(kinematics.released_m(segment, bend)) == pytest.approx(2e-3, rel=2e-3)
    balance = 0.05 - segment.bending_stiffness_N_m_per_rad * bend
    phi = bend / (2 * (segment.rings + 1))
    arm = segment.arm_m * np.cos(phi) - segment.half_gap_m * np.sin(phi)
    assert loaded.actuator_tension[0] == pytest.approx(balance / arm, rel=5e-3)


@pytest.mark.parametrize("moment", [1e-3, -1e-3])
@pytest.mark.parametrize(
    ("name", "joint"), [("mitral_4dof", "torsion"), ("mitral_transseptal", "torsion_distal")]
)
def test_torsion_joint_holds_against_moments_of_both_signs(name: str, joint: str, moment: float) -> None:
    """1 N mm on the tip turns it by less than 0.01 deg; the tension is M over the slope of Eq. 6 or 13."""
    robot = catheter(name)
    free = at_rest(robot, (0.0, 0.0, 2.0, 10.0))
    loaded = at_rest(robot, (0.0, 0.0, 2.0, 10.0), moment_tip=(0.0, 0.0, moment))
    angle = angles(robot, free)[joint]
    assert np.degrees(angles(robot, loaded)[joint] - angle) == pytest.approx(0.0, abs=0.01)
    segment = next(item for item in robot.segments if item.name == joint)
    step = 1e-6
    arm = float(drawn(segment, np.array(angle + step)) - drawn(segment, np.array(angle - step))) / step / 2
    assert arm < segment.tendon_radius_m * (0.95 if segment.wrap_height_m else 1.001)
    assert loaded.actuator_tension[2] == pytest.approx(1e-3 / arm, rel=1e-3)


def test_elastic_pair_stretches_by_its_tension() -> None:
    """20 N/mm: the pulled length at the drive is Eq. 3 plus T / k, with T from the elastic moment."""
    robot = catheter("mitral_transseptal", "tendons.bending.stiffness_N_per_mm=20")
    posture = at_rest(robot, (3.0, 0.0, 0.0, 0.0))
    bend = angles(robot, posture)["bending"]
    tension = 5.6e-3 * bend / float(kinematics.arm_m(robot.segments[1], bend))
    assert posture.actuator_tension[0] == pytest.approx(tension, rel=1e-4)
    assert float(drawn(robot.segments[1], np.array(bend))) + tension / 20e3 == pytest.approx(3e-3, abs=1e-8)
    assert np.degrees(bend) < 88.0


@pytest.mark.slow
def test_mount_gives_way_under_the_pulled_tendon() -> None:
    """10 N/mm: the base sinks by T / k, and the pair, fed from beyond it, bends the joint by as much less."""
    robot = catheter("mitral_transseptal", "mount.axial_stiffness_N_per_mm=10")
    posture = at_rest(robot, (3.0, 0.0, 0.0, 0.0))
    sunk = posture.actuator_tension[0] / 10e3
    assert sunk > 3e-4
    assert posture.p_w[0, 2] == pytest.approx(15e-3 - sunk, abs=1e-7)
    bend = angles(robot, posture)["bending"]
    assert float(drawn(robot.segments[1], np.array(bend))) == pytest.approx(3e-3 - sunk, abs=2e-6)


@pytest.mark.slow
def test_robot_has_no_weight_until_it_has_a_mass() -> None:
    """Gravity moves the nominal robot by less than a nanometre; 5 g in the holder act like their force."""
    robot = catheter("mitral_transseptal")
    free = at_rest(robot, (1.5, 1.0, 0.0, 30.0))
    simulator = Simulator(robot, gravity_mps2=(9.81, 0.0, 0.0), inertia=False)
    simulator.set_inputs(np.array([1.5, 1.0, 0.0, 30.0]) * 1e-3)
    assert simulator.settle()
    assert np.abs(simulator.posture().p_w - free.p_w).max() < 1e-9
    heavy = catheter("mitral_transseptal", "segments.torsion_distal.mass_g=5")
    simulator = Simulator(heavy, gravity_mps2=(9.81, 0.0, 0.0), inertia=False)
    simulator.set_inputs(np.array([1.5, 1.0, 0.0, 30.0]) * 1e-3)
    assert simulator.settle()
    weight = LinkForce(13, (0.0, 0.0, 2.25e-3), (5e-3 * 9.81, 0.0, 0.0))
    pushed = at_rest(robot, (1.5, 1.0, 0.0, 30.0), others=(weight,))
    assert np.abs(pushed.p_w - free.p_w).max() > 1e-4
    assert np.abs(simulator.posture().p_w - pushed.p_w).max() < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_posture_holds_and_does_not_depend_on_the_step_or_the_way(name: str) -> None:
    """Five more seconds move nothing by 10 nm; steps of 1 and 10 ms, and a detour, end within 1 um."""
    ways = ([(2.0, 1.5, -1.0, 40.0)], [(-2.0, 0.5, 2.0, 5.0), (3.0, -1.5, 0.0, 60.0), (2.0, 1.5, -1.0, 40.0)])
    ends = []
    for step in (0.001, 0.01):
        robot = catheter(name, f"dynamics.timestep_s={step}")
        for way in ways:
            run = simulate(robot, rows_to_inputs(np.array(way) * 1e-3, "displacement"), NO_GRAVITY)
            ends.append(run.postures[-1].p_w)
    assert np.abs(np.array(ends) - ends[0]).max() < 1e-6
    simulator = Simulator(catheter(name), inertia=False)
    simulator.set_inputs(np.array(ways[0][0]) * 1e-3)
    assert simulator.settle()
    before = simulator.posture().p_w
    simulator.step(1000)
    assert np.abs(simulator.posture().p_w - before).max() < 1e-8


@pytest.mark.slow
def test_dynamic_run_ends_in_the_same_posture() -> None:
    """Followed in time and then held for a second, the robot is where the quasi-static run has it."""
    robot = catheter("mitral_4dof")
    rows = np.array([(0.0, 0.0, 0.0, 0.0), (2.0, -1.0, 1.0, 30.0), (2.0, -1.0, 1.0, 30.0)]) * 1e-3
    inputs = rows_to_inputs(rows, "displacement")
    dynamic = simulate(robot, inputs, NO_GRAVITY, dynamic=True)
    assert (
        np.abs(dynamic.postures[-1].p_w - simulate(robot, inputs, NO_GRAVITY).postures[-1].p_w).max() < 1e-6
    )


def test_gaps_close_and_bear_the_rest() -> None:
    """Drawn by an elastic pair far beyond, no gap bends further than where the rims touch, to 1 %."""
    robot = catheter("mitral_transseptal", "tendons.bending.stiffness_N_per_mm=1")
    posture = at_rest(robot, (30.0, 0.0, 0.0, 0.0))
    assert np.degrees(angles(robot, posture)["bending"]) == pytest.approx(264.0, rel=0.01)


@pytest.mark.parametrize(
    ("settings", "row", "told"),
    [
        (("tendons.advance.slack_mm=1",), (1.0, 0.0, 0.0, 0.0), "slack_mm = 1: must be 0"),
        ((), (9.0, 0.0, 0.0, 0.0), "row 1 .*displacement_bending_mm: beyond its joint's range, -8.483 to"),
        ((), (0.0, 0.0, -6.0, 0.0), "displacement_torsion_distal_mm: beyond .* to 4.295 mm"),
    ],
)
def test_what_cannot_be_simulated_is_told_in_a_line(
    settings: tuple[str, ...], row: tuple[float, ...], told: str
) -> None:
    """A robot that cannot be, and displacements to which no angle belongs."""
    inputs = rows_to_inputs(np.array([row]) * 1e-3, "displacement")
    with pytest.raises(InputError, match=told):
        simulate(catheter("mitral_transseptal", *settings), inputs, NO_GRAVITY)


def test_command_line_simulates_a_file_of_displacements(tmp_path: Path) -> None:
    """Channels in, angles, tensions and tip out, all in the units of their names."""
    table, path = tmp_path / "in.csv", tmp_path / "out.csv"
    table.write_text("time_s,displacement_bending_mm,advance_mm,force_tip_x_N\n0,0,0,0\n1,1,20,0\n")
    columns = "angle_bending_deg,joint_bending_11_deg,tension_bending_N,tip_y_mm,body_13_z_mm"
    assert (
        main(
            ["simulate", "mitral_transseptal", "--inputs", str(table), "-o", str(path), "--columns", columns]
        )
        == 0
    )
    last = dict(zip(*[line.split(",") for line in path.read_text().splitlines()[::2]], strict=True))
    assert float(last["angle_bending_deg"]) == pytest.approx(31.719, abs=0.01)
    assert float(last["joint_bending_11_deg"]) == pytest.approx(31.719 / 11, abs=0.01)
    assert float(last["tension_bending_N"]) == pytest.approx(1.710, abs=0.002)
    assert float(last["tip_y_mm"]) == pytest.approx(0.0, abs=1e-6)
    assert float(last["body_13_z_mm"]) == pytest.approx(71.183, abs=0.02)
