"""Claims about a robot in motion: how it starts, what drives it, friction, energy, what a file holds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import read_inputs
from catheter_sim.core.inputs import Inputs, require_tip_loads_alone
from catheter_sim.core.motion import IMPLICIT_SPRINGS, LEAPFROG, SMOOTH
from catheter_sim.core.robot import Dynamics
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots import kind_of
from catheter_sim.robots.rolling.complete import elastic_moments, spans
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.simulation.motion import ServoLag
from catheter_sim.simulation.replay import Commands, simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.tables import Table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.rod import tpu_rod

ZERO = np.zeros(3)
GRAVITY = np.array([9.81, 0.0, 0.0])


def rows(time_s: list[float], **columns: list[float]) -> Table:
    return Table(np.array(time_s), {name: np.array(values, float) for name, values in columns.items()})


@pytest.mark.slow
@pytest.mark.parametrize("reference", ["neuroendoscope_section", "chest_tube_section", "mitral_4dof"])
def test_motion_starts_at_rest_under_the_first_row_and_stays_there(reference: str) -> None:
    """Inputs that do not change move nothing: the tip stays within a micrometre of the held row for 0.2 s."""
    robot = load_robot(reference)
    names = {"neuroendoscope_section": "tension_right_N", "chest_tube_section": "tension_active_N"}
    first = {names.get(reference, "displacement_bending_distal_mm"): [0.3, 0.3, 0.3]}
    inputs = read_inputs(robot, rows([0.0, 0.1, 0.2], **first))
    moving = simulate(robot, inputs, GRAVITY, dynamic=True)
    held = simulate(robot, inputs, GRAVITY)
    assert moving.at_rest[0]
    for posture in moving.postures:
        assert posture.p_w[-1] == pytest.approx(held.postures[0].p_w[-1], abs=2e-6)
    assert np.linalg.norm(held.postures[0].p_w[-1][:2]) > 1e-4


@pytest.mark.slow
def test_held_rows_know_nothing_of_damping_and_motion() -> None:
    """A robot with any damping, servo or step in motion rests at the same postures, digit by digit."""
    robot = load_robot("neuroendoscope_section")
    inputs = read_inputs(robot, rows([0.0, 1.0], tension_right_N=[0.2, 0.4]))
    other = replace(
        robot,
        dynamics=replace(robot.dynamics, damping_time_s=0.1, servo_lag_s=0.2, tendon_damping_N_s_per_m=3.0),
    )
    one, two = (simulate(item, inputs, ZERO, ramp_s=0.2).postures[-1].p_w for item in (robot, other))
    assert (one == two).all()


@pytest.mark.slow
@pytest.mark.parametrize("reference", ["neuroendoscope_section", "spacer_disk", "chest_tube", "mitral_4dof"])
def test_the_built_file_moves_as_the_simulator_does(reference: str) -> None:
    """What `let_go` makes of the live model is, number by number, the model that is built for motion."""
    robot = load_robot(reference)
    simulator = Simulator(robot, inertia=False)
    simulator.let_go()
    built = mujoco.MjModel.from_xml_string(build_mjcf(robot, motion=True))
    for name in (
        "dof_damping",
        "dof_armature",
        "body_mass",
        "body_inertia",
        "tendon_damping",
        "jnt_stiffness",
    ):
        assert getattr(simulator.model, name) == pytest.approx(getattr(built, name), rel=1e-12), name
    assert simulator.model.opt.timestep == built.opt.timestep == 0.0005
    assert simulator.model.opt.integrator == built.opt.integrator
    simulator.hold()
    assert simulator.model.opt.timestep == robot.dynamics.timestep_s


def test_integrators_are_chosen_by_what_a_robot_is() -> None:
    """Damped springs leap, undamped ones go by RK4; friction, stiff tendons, laws want implicit springs."""
    rod = tpu_rod(5)

    def chosen(robot, actuation: str = "tension") -> str:
        return kind_of(robot).model.integration(robot, actuation).integrator

    assert chosen(rod) == SMOOTH
    assert chosen(replace(rod, dynamics=Dynamics(damping_time_s=0.003))) == LEAPFROG
    assert chosen(load_robot("neuroendoscope_section")) == IMPLICIT_SPRINGS
    assert chosen(load_robot("spacer_disk"), "displacement") == IMPLICIT_SPRINGS
    assert chosen(load_robot("spacer_disk", ["segments.first.stiffness_cubic_mm2=10"])) == IMPLICIT_SPRINGS


def test_a_force_on_the_last_body_is_one_on_the_tip() -> None:
    """In motion and held; and one further down bends less."""
    robot = tpu_rod(6, Dynamics(damping_time_s=0.01))
    table = {"force_body_6_x_N": [0.1, 0.0], "moment_body_6_y_Nm": [0.01, 0.02]}
    on_body = read_inputs(robot, rows([0.0, 0.05], **table))
    on_tip = read_inputs(robot, rows([0.0, 0.05], force_tip_x_N=[0.1, 0.0], moment_tip_y_Nm=[0.01, 0.02]))
    assert on_body.bodies == (6,)
    assert on_body.force_body.shape == on_body.moment_body.shape == (2, 1, 3)
    for dynamic in (False, True):
        one, two = (simulate(robot, item, ZERO, dynamic).postures[-1].p_w for item in (on_body, on_tip))
        assert one == pytest.approx(two, abs=1e-12)
    lower = read_inputs(robot, rows([0.0], force_body_3_x_N=[0.1]))
    higher = read_inputs(robot, rows([0.0], force_body_6_x_N=[0.1]))
    low, high = (simulate(robot, item, ZERO).postures[0].p_w[-1][0] for item in (lower, higher))
    assert 0.0 < low < 0.5 * high


def test_forces_on_bodies_that_are_not_there_or_not_known_are_named() -> None:
    """A body beyond the last one, a wrong unit, and a static model that knows forces on the tip alone."""
    robot = load_robot("neuroendoscope_section")
    with pytest.raises(InputError, match="force_body_31_x_N: the robot's bodies are 1 to 30"):
        read_inputs(robot, rows([0.0], force_body_31_x_N=[1.0]))
    with pytest.raises(InputError, match="force_body_3_x_Nm"):
        read_inputs(robot, rows([0.0], force_body_3_x_Nm=[1.0]))
    inputs = read_inputs(robot, rows([0.0], force_body_3_x_N=[1e-3]))
    with pytest.raises(InputError, match="body 3"):
        STATIC_MODELS["fkm_sliding"].solve(robot, inputs, ZERO)
    require_tip_loads_alone(read_inputs(robot, rows([0.0])), "anything")


def test_a_step_is_given_what_its_inputs_are_on_average() -> None:
    """On a straight line that is the value in the middle; a jump within the step counts by its time."""
    nothing = np.zeros((4, 3))
    tension = np.array([[1.0], [3.0], [3.0], [0.0]])
    commands = Commands(Inputs(np.array([5.0, 6.0, 7.0, 7.0 + 1e-9]), "tension", tension, nothing, nothing))
    means = commands.means(np.array([0.0, 0.5, 1.5, 2.0, 3.0]), 0.1)[:, 0]
    assert means == pytest.approx([1.025, 2.0, 3.0, 1.5, 0.0], abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "reference", ["neuroendoscope_section", "spacer_disk", "mitral_4dof", "notched_wrist"]
)
def test_actuators_of_a_built_model_follow_by_the_servos_lag(reference: str) -> None:
    """Whatever drives a robot: each actuator in plain MuJoCo has the lag, and its name as without."""
    lagging, plain = (
        mujoco.MjModel.from_xml_string(
            build_mjcf(load_robot(reference, (f"dynamics.servo_lag_s={lag}",)), motion=True)
        )
        for lag in (0.05, 0.0)
    )
    assert (lagging.actuator_dyntype == mujoco.mjtDyn.mjDYN_FILTEREXACT).all()
    assert lagging.actuator_dynprm[:, 0] == pytest.approx(0.05)
    assert plain.na == 0
    names = [[model.actuator(k).name for k in range(model.nu)] for model in (lagging, plain)]
    assert names[0] == names[1]
    np.testing.assert_array_equal(lagging.actuator_gear, plain.actuator_gear)


def test_a_servo_follows_by_its_time_constant() -> None:
    """After one time constant 1 - 1/e of a step has arrived; without a lag all of it, at once."""
    lag = ServoLag(0.05, 0.001, np.zeros(1))
    for _ in range(50):
        arrived = lag.arriving(np.ones(1))
    assert arrived[0] == pytest.approx(1.0 - np.exp(-1.0), rel=1e-9)
    assert ServoLag(0.0, 0.001, np.zeros(1)).arriving(np.ones(1))[0] == 1.0


@pytest.mark.slow
def test_a_tendon_resists_in_its_channel() -> None:
    """Of a robot that is let go each pulled tendon takes c v^2 a second, the joints the rest of what is lost.

    Without damping of its own the robot is stepped with that of one step.
    """
    settings = [
        "dynamics.damping_time_s=0",
        "dynamics.tendon_damping_N_s_per_m=2",
        "dynamics.timestep_s=5e-5",
    ]
    robot = load_robot("spacer_disk", settings)
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot, motion=True))
    assert model.tendon_damping == pytest.approx([2.0] * 4)
    assert mujoco.MjModel.from_xml_string(build_mjcf(robot)).tendon_damping == pytest.approx([0.0] * 4)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    data.qpos[:] = 0.002
    energy, power = [], []
    for _ in range(400):
        mujoco.mj_forward(model, data)
        energy.append(data.energy.sum())
        joints = model.dof_damping.reshape(model.nv, -1)[:, 0] @ data.qvel**2
        power.append((2.0 * (data.ten_velocity**2).sum(), joints))
        mujoco.mj_step(model, data)
    tendons, joints = np.trapezoid(np.array(power), axis=0) * model.opt.timestep
    assert energy[0] - energy[-1] == pytest.approx(tendons + joints, rel=0.05)
    assert tendons > 0.5 * (tendons + joints) > 0.1 * energy[0]


@pytest.mark.slow
@pytest.mark.parametrize("damping_time_s", [0.001, pytest.param(0.005, marks=pytest.mark.long)])
def test_friction_in_motion_is_the_nested_references(damping_time_s: float) -> None:
    """Pulled to and fro in a second, with stick and slip: tips within 0.2 % of the length of each other.

    With each hinge's own inertia alone in the law they were up to 60 % apart.
    """
    robot = load_robot("neuroendoscope_section", [f"dynamics.damping_time_s={damping_time_s}"])
    time_s = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
    pull = {"tension_right_N": [0.12, 0.35, 0.5, 0.5, 0.2, 0.2], "tension_left_N": [0.12] * 6}
    inputs = read_inputs(robot, rows(time_s, **pull))
    ours, reference, free = (
        np.array([item.p_w[-1] for item in simulate(robot, inputs, ZERO, True, friction=law).postures])
        for law in ("capstan", "nested", "none")
    )
    assert np.linalg.norm(ours - reference, axis=1).max() < 0.002 * 0.06
    assert np.linalg.norm(ours - free, axis=1).max() > 0.05 * 0.06


@pytest.mark.slow
def test_robot_with_friction_comes_to_rest_where_statics_sticks() -> None:
    """Pulled slowly and let go half way, it sticks in motion as it does held, away from rest without."""
    robot = load_robot("neuroendoscope_section")
    pull = {"tension_right_N": [0.12, 0.4, 0.25, 0.25], "tension_left_N": [0.12] * 4}
    inputs = read_inputs(robot, rows([0.0, 1.0, 2.0, 2.2], **pull))
    moving, held = (simulate(robot, inputs, ZERO, dynamic).postures[-1].p_w[-1] for dynamic in (True, False))
    free = simulate(robot, inputs, ZERO, friction="none").postures[-1].p_w[-1]
    assert moving == pytest.approx(held, abs=0.3e-3)
    assert np.linalg.norm(held - free) > 1e-3


def test_rolling_links_keep_their_energy() -> None:
    """Three joints thrown at 60 rad/s, without damping: 2e-4 in 4 ms; with hinges that stand still, 4e-3.

    The elastic part is the integral of the statics' moments; the kinetic one takes the speeds on both sides
    of a step, as the leapfrog rule keeps it.
    """

    def spread(contacts_move: bool) -> float:
        settings = ["joints=3", "length_mm=45"]
        robot = load_robot(
            "chest_tube_section",
            [
                "friction.mu=0",
                "dynamics.motion_timestep_s=2e-5",
                *(f"segments.section.{s}" for s in settings),
            ],
        )
        simulator = Simulator(robot, inertia=False)
        simulator.let_go()
        model, data, chain = simulator.model, simulator.data, rolling_chain(robot)
        model.dof_damping[:] = model.dof_armature[:] = 0.0
        if not contacts_move:
            simulator.laws.between = tuple(
                act for act in simulator.laws.between if "ContactMotion" not in type(act.__self__).__name__
            )
        data.qvel[:] = (60.0, -30.0, 48.0)
        share, inertia, found = np.linspace(0.0, 1.0, 101), np.zeros((3, 3)), []
        for _ in range(200):
            for place in simulator.laws.place:
                place(data)
            mujoco.mj_fwdPosition(model, data)
            _dense(model, data, inertia)
            way = np.outer(share, data.qpos)
            moment, _ = elastic_moments(chain, way, spans(chain, way))
            stored, before = float((np.trapezoid(moment, share, axis=0) * data.qpos).sum()), data.qvel.copy()
            simulator.step()
            found.append(0.5 * before @ inertia @ data.qvel + stored)
        return float(np.ptp(found) / found[0])

    assert spread(True) < 3e-4
    assert spread(False) > 3e-3


def _dense(model: mujoco.MjModel, data: mujoco.MjData, inertia: np.ndarray) -> None:
    """Write the inertia of all joints into `inertia`: by the columns that `mj_mulM` gives."""
    for column in range(model.nv):
        unit, result = np.zeros(model.nv), np.zeros(model.nv)
        unit[column] = 1.0
        mujoco.mj_mulM(model, data, result, unit)
        inertia[:, column] = result


@pytest.mark.slow
def test_a_catheters_joint_that_is_let_go_returns_without_swinging_through() -> None:
    """Its rings weigh next to nothing: with the tendons slackened in 5 ms it is at rest in half a second."""
    robot = load_robot("mitral_4dof")
    inputs = read_inputs(
        robot, rows([0.0, 0.005, 0.1, 0.5, 0.6], displacement_bending_distal_mm=[2.0, 0.0, 0.0, 0.0, 0.0])
    )
    run = simulate(robot, inputs, ZERO, dynamic=True)
    bend = np.array([np.abs(posture.joint_angles).max() for posture in run.postures])
    assert bend[0] > 0.02
    assert bend[-1] < 1e-3 * bend[0]
    assert bend[-2] == pytest.approx(bend[-1], abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("reference", ["chest_tube_section", "neuroendoscope_section"])
def test_energy_never_grows_with_friction_and_damping_on(reference: str) -> None:
    """A robot whose tip is let go swings ever less far: each turning point lies nearer to rest."""
    robot = load_robot(reference)
    force = {"chest_tube_section": 0.02, "neuroendoscope_section": 2e-3}[reference]
    time_s = [0.0, 1e-6, *np.arange(0.005, 1.5, 0.005)]
    push = np.zeros(len(time_s))
    push[0] = force
    run = simulate(robot, read_inputs(robot, rows(time_s, force_tip_x_N=list(push))), ZERO, dynamic=True)
    x = np.array([posture.p_w[-1][0] for posture in run.postures])
    turning = np.abs(x[2:-1][(np.diff(x)[2:] * np.diff(x)[1:-1]) < 0.0])
    turning = turning[turning > 1e-4]
    assert len(turning) >= 2
    assert (np.diff(turning) < 0.0).all()
    assert turning[0] < abs(x[0])


@pytest.mark.slow
@pytest.mark.parametrize("reference", ["mitral_4dof@elongation", "mitral_4dof"])
def test_stretching_tendons_and_play_do_in_slow_motion_what_they_do_held(reference: str) -> None:
    """Bent and half let back in a second, the tip is within 0.1 mm of where held rows have it."""
    robot = load_robot(reference, ["tendons.bending_distal.play_mm=0.2"])
    way = {"displacement_bending_distal_mm": [0.0, 2.0, 1.0]}
    inputs = read_inputs(robot, rows([0.0, 0.5, 1.0], **way))
    moving, held = (
        np.array([item.p_w[-1] for item in simulate(robot, inputs, ZERO, dynamic).postures])
        for dynamic in (True, False)
    )
    assert np.linalg.norm(moving - held, axis=1).max() < 1e-4
    assert np.linalg.norm(held[1] - held[2]) > 1e-3


ROD = """
name = "rod"
description = "a rod of TPU"
[[segments]]
name = "rod"
length_mm = 400
disks = {disks}
outer_radius_mm = 5
bending_stiffness_N_mm2 = 34361
torsion_stiffness_N_mm2 = 24544
mass_g = 37.7
[friction]
mu = 0
[dynamics]
damping_time_s = 0.004
"""


@pytest.mark.slow
def test_a_rod_from_a_file_moves_alike_in_plain_mujoco(tmp_path: Path) -> None:
    """Let go from the same posture: within 0.3 % of the length of the simulation."""
    (tmp_path / "rod.toml").write_text(ROD.format(disks=20))
    robot = load_robot(str(tmp_path / "rod.toml"))
    time_s = [0.0, 1e-9, *np.arange(0.01, 0.5, 0.01)]
    push = [0.3, *[0.0] * (len(time_s) - 1)]
    starts: list[np.ndarray] = []
    run = simulate(
        robot,
        read_inputs(robot, rows(time_s, force_tip_x_N=push)),
        ZERO,
        dynamic=True,
        on_row=lambda simulator, row: starts.append(simulator.data.qpos.copy()) if row == 0 else None,
    )
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot, motion=True))
    data = mujoco.MjData(model)
    data.qpos[:] = starts[0]
    away = []
    for posture in run.postures[2:]:
        mujoco.mj_step(model, data, 20)
        mujoco.mj_kinematics(model, data)
        away.append(np.linalg.norm(data.site("tip").xpos - posture.p_w[-1]))
    assert max(away) < 0.005 * 0.4
    assert np.mean(away) < 0.003 * 0.4
    assert np.ptp([posture.p_w[-1][0] for posture in run.postures]) > 0.1


def test_a_rod_that_does_not_say_its_links_has_enough(tmp_path: Path) -> None:
    """Two disks, or `tendons = []`: fifty links all the same."""
    (tmp_path / "rod.toml").write_text("tendons = []\n" + ROD.format(disks=2))
    robot = load_robot(str(tmp_path / "rod.toml"))
    assert robot.links_per_subsegment == 25
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot, motion=True))
    assert (model.nv, model.ntendon, model.nu) == (150, 0, 0)
