"""Claims about catheters under control in simulation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.controllers import loop, motors
from catheter_sim.controllers.loop import along, feedforward, through, ticks_s
from catheter_sim.controllers.motors import Pid
from catheter_sim.errors import InputError
from catheter_sim.robots import kind_of
from catheter_sim.robots.catheter.published import mitral_transseptal
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator

pytestmark = pytest.mark.slow

STRETCHING = tuple(f"tendons.bending_{name}.stiffness_N_per_mm=0.6" for name in ("proximal", "distal"))


def catheter(*settings: str) -> CatheterRobot:
    robot = load_robot("mitral_4dof", settings)
    assert isinstance(robot, CatheterRobot)
    return robot


def bends(seconds: float = 8.0, top_deg: float = 40.0, columns: tuple[int, ...] = (0, 1, 2)) -> Array:
    """Return joint values of a 4-DoF robot that go out and back once in some columns, shape (r, 4)."""
    ticks = ticks_s(seconds, 40.0)
    desired = np.zeros((len(ticks), 4))
    wave = np.radians(through((0.0, top_deg, 0.0), (seconds / 2, seconds / 2), ticks))
    desired[:, list(columns)] = wave[:, np.newaxis]
    return desired


def made(desired: Array, reached: Array, model_m: Array, controller_m: Array) -> loop.ControlRun:
    joints = ("bending", "prismatic")
    times = np.arange(len(desired)) / 40.0
    return loop.ControlRun("made", joints, times, desired, reached, model_m, controller_m, model_m)


def test_a_trajectory_goes_through_its_corners_at_rest() -> None:
    """At each corner's time the value is the corner's, it hardly moves there, and stays after the last."""
    ticks = ticks_s(10.0, 100.0)
    values = through((0.0, 3.0, -1.0), (2.0, 5.0), ticks)
    assert values[[0, 200, 700, 1000]] == pytest.approx([0.0, 3.0, -1.0, -1.0], abs=1e-12)
    for corner in (0, 200, 700):
        assert abs(values[corner + 1] - values[corner]) < 1e-3
    assert values[100] == pytest.approx(1.5)


def test_rmse_and_share_are_what_they_say() -> None:
    """Errors of 3 and 4 deg: sqrt(12.5); displacements of 3 and 1 mm, whatever their sign: a quarter."""
    desired = np.zeros((2, 2))
    reached = np.radians([[3.0, 0.0], [-4.0, 0.0]])
    model, controller = np.array([[3e-3, 0.0], [-3e-3, 0.0]]), np.array([[-1e-3, 0.0], [1e-3, 0.0]])
    run = made(desired, reached, model, controller)
    assert run.rmse_deg()[0] == pytest.approx(math.sqrt(12.5))
    assert math.isnan(run.rmse_deg()[1])
    assert run.controller_share()[0] == pytest.approx(0.25)
    assert math.isnan(run.controller_share()[1])


def test_pk_alone_moves_the_nominal_robot() -> None:
    """Without stretch, PK alone keeps every joint within 0.6 deg of the way, which is the lag: the largest
    speed, 16 deg/s, for a tick and the robot's own time; the tube goes where it is pushed.
    """
    robot, desired = catheter(), bends()
    desired[:, 3] = 0.02
    run = loop.run(Simulator(robot), desired, along(feedforward(robot, "pk"), desired))
    assert np.degrees(np.abs(run.reached - desired)[:, :3]).max() < 0.6
    assert run.reached[-1, 3] == pytest.approx(0.02, abs=1e-5)
    assert not run.controller_m.any()


def test_pid_makes_up_for_a_stretch_that_pk_does_not_know() -> None:
    """On springs as tendons PK falls short by a third and more; PID leaves less than a fifth of that."""
    robot, desired = catheter(*STRETCHING), bends(16.0, columns=(0, 1))
    way = along(feedforward(robot, "pk"), desired)
    open_loop = loop.run(Simulator(robot), desired, way)
    names = ("bending_proximal", "bending_distal")
    closed = loop.run(Simulator(robot), desired, way, feedback={name: Pid() for name in names})
    middle = len(desired) // 2
    assert (open_loop.reached[middle, :2] < 0.67 * desired[middle, :2]).all()
    assert (closed.rmse_deg()[:2] < 0.2 * open_loop.rmse_deg()[:2]).all()
    assert (open_loop.controller_share()[:2] == 0.0).all()
    assert (closed.controller_share()[:2] > 0.33).all()


def test_controller_finds_the_stretch() -> None:
    """Held at 40 deg, what PID adds is the tendon's stretch: tension K theta / arm over its stiffness."""
    robot = catheter(*STRETCHING)
    ticks = ticks_s(25.0, 40.0)
    desired = np.zeros((len(ticks), 4))
    desired[:, 0] = np.radians(through((0.0, 40.0, 40.0), (5.0, 20.0), ticks))
    way = along(feedforward(robot, "pk"), desired)
    run = loop.run(Simulator(robot), desired, way, feedback={"bending_proximal": Pid()})
    joint, bend = robot.segments[0], math.radians(40.0)
    half = bend / 8.0
    arm = 0.69e-3 * math.sin(half) + 2.1e-3 * math.cos(half)
    stretch = joint.bending_stiffness_N_m_per_rad * bend / arm / 600.0
    assert run.controller_m[-1, 0] == pytest.approx(stretch, rel=5e-3)
    assert math.degrees(run.reached[-1, 0]) == pytest.approx(40.0, abs=0.05)


def test_a_known_dead_band_is_compensated() -> None:
    """Torsion behind a play of 0.6 mm lags by its half, 8.2 deg; compensated, it keeps to 1.5 deg but for
    the ticks after a reversal.
    """
    robot = catheter("tendons.torsion.play_mm=0.6")
    ticks = ticks_s(12.0, 40.0)
    desired = np.zeros((len(ticks), 4))
    desired[:, 2] = np.radians(through((0.0, 40.0, -30.0), (6.0, 6.0), ticks))
    errors = []
    for bands in (None, {"torsion": 0.6e-3}):
        way = along(feedforward(catheter(), "te", bands), desired)
        run = loop.run(Simulator(robot), desired, way)
        errors.append(np.degrees(np.abs(run.reached - desired)[:, 2]))
    assert np.median(errors[0]) == pytest.approx(math.degrees(0.3 / 2.1), abs=0.8)
    assert np.mean(errors[1] > 1.5) < 0.03


def test_tracker_noise_reaches_the_controller_and_nothing_else() -> None:
    """Without feedback noise changes nothing; with it the same seed (3) gives the same run, exact another."""
    robot, desired = catheter(), bends(1.0)
    way = along(feedforward(robot, "pk"), desired)

    def run(seed: int | None, controlled: bool) -> Array:
        tracker = None
        if seed is not None:
            tracker = loop.Tracker(math.radians(0.5), np.random.default_rng(seed))
        feedback = {"torsion": Pid()} if controlled else {}
        return loop.run(Simulator(robot), desired, way, feedback=feedback, tracker=tracker).reached

    np.testing.assert_array_equal(run(3, False), run(None, False))
    np.testing.assert_array_equal(run(3, True), run(3, True))
    assert np.abs(run(3, True) - run(None, True)).max() > 1e-4


def test_a_run_repeats_itself() -> None:
    """The same simulator and the same controllers, used again, start from rest without a past."""
    robot, desired = catheter(*STRETCHING), bends(2.0)
    way, simulator = along(feedforward(robot, "pk"), desired), Simulator(robot)
    feedback = {name: Pid() for name in ("bending_proximal", "torsion")}
    first, second = (loop.run(simulator, desired, way, feedback=feedback) for _ in range(2))
    np.testing.assert_array_equal(second.reached, first.reached)
    np.testing.assert_array_equal(second.controller_m, first.controller_m)


def test_pairs_move_evenly_between_ticks(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 40 Hz and steps of 5 ms a tick's displacement is reached in five equal steps, not in one."""
    simulator, given = Simulator(catheter()), []
    set_inputs = simulator.set_inputs

    def recorded(tendon: Array, *rest: object) -> None:
        given.append(float(tendon[2]))
        set_inputs(tendon, *rest)

    monkeypatch.setattr(simulator, "set_inputs", recorded)
    way = np.zeros((3, 4))
    way[:, 2] = (1e-3, 3e-3, 2e-3)
    loop.run(simulator, np.zeros((3, 4)), way)
    expected = np.interp(np.arange(1, 16) / 5.0, [0, 1, 2, 3], [0.0, 1e-3, 3e-3, 2e-3])
    assert given[-15:] == pytest.approx(expected, abs=1e-12)


def test_a_noisy_tracker_shakes_the_joint_less_than_itself() -> None:
    """With 0.5 deg of white noise (seed 5) the steepest joint, held, moves by less than 0.5 deg rms."""
    robot = catheter()
    desired = np.zeros((800, 4))
    tracker = loop.Tracker(math.radians(0.5), np.random.default_rng(5))
    run = loop.run(Simulator(robot), desired, desired, feedback={"torsion": Pid()}, tracker=tracker)
    assert 0.01 < run.rmse_deg()[2] < 0.5


@pytest.mark.parametrize("observes", [False, True])
def test_a_motor_gives_way_under_its_load_unless_it_observes_it(observes: bool) -> None:
    """The 2022 bending joint held at 60 deg by a motor of 0.8 times the nominal gain: with PD alone the
    pair gives way by tension times r_p, in V, over the gain, through gear and pulley; with the observer by
    less than a hundredth of that.
    """
    robot = mitral_transseptal()
    ticks = ticks_s(4.0, 40.0)
    desired = np.zeros((len(ticks), 4))
    desired[:, 0] = np.radians(through((0.0, 60.0, 60.0), (2.0, 2.0), ticks))
    way = along(feedforward(robot, "pk"), desired)
    servo = motors.servo(motors.Motor(gain=0.8 * 156.14), observes)
    simulator = Simulator(robot)
    run = loop.run(simulator, desired, way, servos={"bending": servo})
    tension = 5.6e-3 * run.reached[-1, 0] / 1.8e-3  # the arm is 0.7 % larger here
    expected = 6.0 / 0.245 * tension * 7.19e-3 / motors.pd_gains()[0] / 380.0 * 7.19e-3
    left = run.model_m[-1, 0] - run.displaced_m[-1, 0]
    if observes:
        assert abs(left) < 0.01 * expected
    else:
        assert left == pytest.approx(expected, rel=0.02)


def test_a_tip_force_that_starts_late_is_observed_too() -> None:
    """A force on the tip against the bend adds to the tension, and the observer keeps the pair in place."""
    robot = mitral_transseptal()
    desired = np.zeros((160, 4))
    desired[:, 0] = math.radians(40.0)
    way = along(feedforward(robot, "pk"), desired)
    left = {}
    for observes in (False, True):
        servos = {"bending": motors.servo(observes=observes)}
        run = loop.run(Simulator(robot), desired, way, servos=servos, force_tip_N=(-0.1, 0.0, 0.0))
        left[observes] = abs(run.model_m[-1, 0] - run.displaced_m[-1, 0])
    assert left[True] < 0.02 * left[False]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"feedback": {"tip": Pid()}}, "unknown pair 'tip'; choices: bending_proximal"),
        ({"rate_hz": 30.0}, "a tick at 30 Hz is 33.3333 ms: must be a whole number of 5 ms"),
        ({"model_m": np.zeros((3, 4))}, r"both must be \(rows, 4\)"),
        ({"servos": {"torsion": motors.servo(rate_hz=300.0)}}, "must be a whole number of 3.33333 ms"),
    ],
)
def test_what_does_not_fit_is_refused(arguments: dict[str, object], message: str) -> None:
    """An unknown pair, a rate that the simulation's steps do not meet, rows that do not match: one line."""
    given = {"desired": np.zeros((5, 4)), "model_m": np.zeros((5, 4))} | arguments
    with pytest.raises(InputError, match=message) as caught:
        loop.run(Simulator(catheter()), **given)
    assert "\n" not in str(caught.value)


def test_only_catheters_are_controlled() -> None:
    """Another kind of robot is refused with one line."""
    simulator = Simulator(load_robot("neuroendoscope_section"))
    with pytest.raises(InputError, match="kind 'catheter' alone"):
        loop.run(simulator, np.zeros((1, 2)), np.zeros((1, 2)))


def test_the_simulators_own_robot_is_controlled() -> None:
    """Joint values come in the order of the pairs, not of the segments: torsion is second in 2022's."""
    robot = replace(mitral_transseptal())
    simulator = Simulator(robot, inertia=False)
    simulator.set_inputs(np.array([1e-3, 0.5e-3, -0.5e-3, 10e-3]))
    assert simulator.settle()
    joints = kind_of(robot).face("joint_control", "joint control")
    values = joints.joint_matrix(robot, simulator.model) @ simulator.data.qpos
    assert np.degrees(values[0]) == pytest.approx(31.719, abs=0.05)
    assert values[1] > 0.0 > values[2]
    assert values[3] == pytest.approx(10e-3, abs=1e-5)
