"""The benchmark measures what it says; no test here judges a time."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot, robots_of
from catheter_sim.cli.main import main
from catheter_sim.core.robot import Friction
from catheter_sim.robots.catheter.description import moving
from catheter_sim.robots.rolling.complete import solve_loaded
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.speed import benchmark
from catheter_sim.speed.benchmark import as_dict, input_cycle, measure, table_text
from catheter_sim.speed.chain import CELLS, chain, exponent, with_cells

pytestmark = pytest.mark.slow

ROBOT = "neuroendoscope_section"


@pytest.mark.parametrize("reference", [name for name in benchmark.ROBOTS if name in robots_of("continuum")])
def test_tensions_bend_by_a_radian_to_and_fro(reference: str) -> None:
    """No tendon pushes, antagonists take turns, and a peak asks a radian of its last segment."""
    robot = robots_of("continuum")[reference]()
    cycle = input_cycle(robot)
    assert cycle.min() == 0.0
    segments = {segment.name: segment for segment in robot.segments}
    for index, tendon in enumerate(robot.tendons):
        segment = segments[tendon.ends_at]
        bend_rad = cycle[:, index].max() * tendon.radius_m * segment.length_m / segment.bending_stiffness_N_m2
        assert bend_rad == pytest.approx(1.0, rel=1e-9)
        for other, opposite in enumerate(robot.tendons):
            if math.cos(tendon.angle_rad - opposite.angle_rad) < -0.99:
                assert not (cycle[:, index] * cycle[:, other]).any()


@pytest.mark.parametrize("reference", ["chest_tube_section", "chest_tube"])
def test_tensions_of_rolling_joints_bend_by_a_radian_in_first_order(reference: str) -> None:
    """At a thousandth of its peak a rod alone bends its last segment by a thousandth of a radian."""
    robot = robots_of("rolling")[reference]()
    cycle = input_cycle(robot)
    assert cycle.min() == 0.0
    chain = rolling_chain(replace(robot, friction=Friction(0.0)))
    theta = solve_loaded(chain, np.diag(1e-3 * cycle.max(axis=0)), np.zeros(3)).theta
    segment = np.repeat([item.name for item in robot.segments], [item.joints for item in robot.segments])
    for index, rod in enumerate(robot.tendons):
        own = (segment == rod.ends_at) & (chain.axis == "xy".index(rod.side[1]))
        toward = 1.0 if rod.side[0] == "+" else -1.0
        assert toward * theta[index, own].sum() == pytest.approx(1e-3, rel=2e-3)
        for other, opposite in enumerate(robot.tendons):
            if rod.side[1] == opposite.side[1] and rod.side[0] != opposite.side[0]:
                assert not (cycle[:, index] * cycle[:, other]).any()


MITRAL = ("mitral_transseptal", "mitral_4dof")


@pytest.mark.parametrize("reference", MITRAL)
def test_displacements_turn_a_catheters_joints_by_a_radian_to_either_side(reference: str) -> None:
    """At the cycle's peaks the simulated joints are a radian from rest, and the tube is out by its stroke."""
    robot = robots_of("catheter")[reference]()
    cycle = input_cycle(robot)
    assert cycle[:, 3].min() >= 0.0
    assert cycle[benchmark._LEVELS // 2, 3] == pytest.approx(60e-3, rel=1e-12)
    for level, wanted in ((benchmark._LEVELS // 4, 1.0), (3 * benchmark._LEVELS // 4, -1.0)):
        simulator = benchmark.Simulator(robot, inertia=False)
        simulator.set_inputs(cycle[level])
        simulator.settle()
        for place in moving(robot):
            segment = robot.segments[place]
            if segment.joint == "prismatic":
                continue
            names = [segment.name]
            if segment.joint == "bending":
                names = [f"{segment.name}_{gap}" for gap in range(1, segment.rings + 2)]
            angle = sum(float(simulator.data.joint(name).qpos[0]) for name in names)
            assert angle == pytest.approx(wanted, abs=2e-3), segment.name


@pytest.mark.parametrize("reference", MITRAL)
def test_both_loops_of_a_catheter_move_it_alike(reference: str) -> None:
    """A quarter of the cycle: tips within 3 mm of each other, which the linear torsion joints are apart."""
    robot = load_robot(reference)
    cycle = input_cycle(robot)[: benchmark._LEVELS // 4]
    tips = []
    for loop in (benchmark._run_simulator, benchmark._run_plain):
        simulator = benchmark.Simulator(robot)
        rest = simulator.posture().p_w[-1]
        loop(simulator, cycle)
        tips.append(simulator.posture().p_w[-1])
        assert np.linalg.norm(tips[-1] - rest) > 30e-3
    assert np.linalg.norm(tips[0] - tips[1]) < 3e-3


@pytest.mark.long
def test_a_catheter_has_rows_with_friction_only_where_it_has_friction() -> None:
    """The nominal robot: two rows and nulls in JSON; with friction in its specification: three rows."""
    nominal = measure("mitral_4dof", turns=1)
    assert nominal.plain_pulled
    assert nominal.links == 13  # 3 and 6 rings, two rigid links, the tube's module, the torsion module
    shown = as_dict(nominal)
    assert shown["steps_per_s_friction"] is shown["friction_cost"] is shown["real_time_friction"] is None
    assert nominal.of_plain == pytest.approx(nominal.python_cost)
    first, second = table_text([nominal]).splitlines()[2:4]
    assert first.split()[:2] == ["mitral_4dof", "off"]
    assert second.split()[0] == "mj_step"
    rubbing = measure("mitral_4dof@elongation", turns=1)
    assert rubbing.friction_cost is not None
    assert table_text([rubbing]).splitlines()[2].split()[:2] == ["mitral_4dof@elongation", "on"]


def test_ratios_belong_to_the_measured_times() -> None:
    """With one turn the ratios follow from the speeds, and the real-time factor from the time step."""
    speed = measure(ROBOT, turns=1)
    assert speed.links == 30
    assert speed.plain_pulled
    assert speed.friction_cost == pytest.approx(speed.steps_per_s_frictionless / speed.steps_per_s_friction)
    assert speed.python_cost == pytest.approx(speed.steps_per_s_plain / speed.steps_per_s_frictionless)
    assert speed.of_plain == pytest.approx(speed.friction_cost * speed.python_cost)
    assert speed.real_time_friction == pytest.approx(speed.steps_per_s_friction * speed.timestep_s)


def test_all_three_loops_move_the_robot() -> None:
    """What is timed is work: each loop bends the robot, with friction less readily than without."""
    robot = load_robot(ROBOT)
    pulled = input_cycle(robot)[: benchmark._LEVELS // 4]
    bends = []
    for reference, loop in (
        (["friction.mu=0.3"], benchmark._run_simulator),
        (["friction.mu=0"], benchmark._run_simulator),
        (["friction.mu=0"], benchmark._run_plain),
    ):
        simulator = benchmark.Simulator(load_robot(ROBOT, reference))
        loop(simulator, pulled)
        bends.append(float(np.sum(simulator.posture().joint_angles)))
    assert 0.05 < bends[0] < 0.95 * bends[1]
    assert bends[1] == pytest.approx(bends[2], rel=1e-9)


def test_the_plain_loop_of_rolling_joints_is_measured_at_rest_and_the_table_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Rods resist in the simulator only: the plain loop leaves the links straight, after bending too."""
    monkeypatch.setattr(benchmark, "_STEPS_PER_LEVEL", 2)
    speed = measure("chest_tube_section", turns=1)
    assert not speed.plain_pulled
    assert speed.links == 15
    assert "mj_step of chest_tube_section: at rest, unpulled" in table_text([speed])
    simulator = benchmark.Simulator(load_robot("chest_tube_section", ["friction.mu=0"]))
    benchmark._run_simulator(simulator, input_cycle(simulator.robot)[:10])
    assert float(np.sum(simulator.posture().joint_angles)) > 0.05
    benchmark._run_plain_at_rest(simulator, 10)
    assert simulator.data.qpos == pytest.approx(np.zeros(15), abs=1e-12)


@pytest.mark.long
def test_bench_prints_a_table_and_json(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The table and the JSON hold the same figures' names and every robot asked for."""
    monkeypatch.setattr(benchmark, "ROBOTS", (ROBOT,))
    monkeypatch.setattr(benchmark, "CELLS", (10, 20))
    assert main(["bench", "--turns", "1", "--json"]) == 0
    (speed,) = json.loads(capsys.readouterr().out)
    assert speed["robot"] == ROBOT
    assert {"friction_cost", "python_cost", "of_plain", "real_time_friction"} <= set(speed)
    assert min(speed["batch_cost_1"], speed["batch_cost_2"]) > 0.0
    assert math.isfinite(speed["growth"]["exponent_friction"])  # of two lengths, timed once: of any sign
    assert main(["bench", "--turns", "1"]) == 0
    text = capsys.readouterr().out
    assert ROBOT in text
    assert "friction cost" in text


def test_table_shows_the_figures() -> None:
    """The table's figures are those of the result, rounded."""
    speed = benchmark.Speed(ROBOT, 0.005, 30, True, 2000.0, 3000.0, 3300.0, 1.5, 1.1, 1.65)
    on, off, plain = table_text([speed]).splitlines()[2:5]
    assert on.split() == [ROBOT, "on", "2000", "10.0x", "1.65x", "1.50x"]
    assert off.split() == ["off", "3000", "15.0x", "1.10x", "1.10x"]
    assert plain.split() == ["mj_step", "3300", "16.5x", "1.00x"]
    assert as_dict(speed)["real_time_frictionless"] == 15.0
    assert "at rest" not in table_text([speed])


@pytest.mark.long
def test_the_chain_has_sixty_degrees_of_freedom_and_nine_tendons() -> None:
    """Three tendons end at each of three segments; all pull, and the whole chain moves in space."""
    robot = chain(0.3)
    simulator = benchmark.Simulator(robot)
    assert (simulator.model.nv, simulator.model.ntendon) == (60, 9)
    cycle = input_cycle(robot)
    assert (cycle.max(axis=0) > 0.0).all()
    benchmark._run_simulator(simulator, cycle[: benchmark._LEVELS // 4])
    tip = simulator.posture().p_w[-1]
    assert np.linalg.norm(tip[:2]) > 5e-3
    speed = measure(benchmark.CHAIN, turns=1)
    assert speed.links == 30
    assert speed.friction_cost is not None


def test_batches_do_the_plain_loops_steps() -> None:
    """Each copy ends where a plain loop under the same inputs ends, on one thread and on two."""
    robot = load_robot(ROBOT, ["friction.mu=0"])
    plain = benchmark.Simulator(robot)
    inputs = input_cycle(robot)[benchmark._BATCH_LEVELS]
    assert benchmark._COPIES * len(inputs) == benchmark._LEVELS  # as many steps as the other loops take
    controls = benchmark._controls(plain, inputs)
    assert controls == pytest.approx(inputs)
    benchmark._run_plain(plain, inputs)
    for threads in (1, 2):
        batch, run = benchmark._batch_loop(plain.model, controls, threads)
        run()
        for row in batch.bind("qpos"):
            assert row == pytest.approx(plain.data.qpos, abs=1e-12)
    assert abs(plain.data.qpos).max() > 1e-3


def test_the_cost_of_batching_is_shown() -> None:
    """A row each for one and two threads, from the plain speed and the ratio."""
    speed = benchmark.Speed(ROBOT, 0.005, 30, True, 2e3, 3e3, 3300.0, 1.5, 1.1, 1.65, 1.1, 0.55)
    one, two = table_text([speed]).splitlines()[5:7]
    assert one.split() == ["batch", "1", "3000", "15.0x", "1.10x"]
    assert two.split() == ["batch", "2", "6000", "30.0x", "0.55x"]
    assert (as_dict(speed)["batch_cost_1"], as_dict(speed)["growth"]) == (1.1, None)


def test_the_exponent_of_a_power_is_found() -> None:
    """Of c n^p it is p, whatever c."""
    assert exponent(CELLS, [3.0 * n**1.3 for n in CELLS]) == pytest.approx(1.3)
    assert min(CELLS) == 10
    assert max(CELLS) == 120


def test_more_cells_are_more_of_the_same_cell() -> None:
    """Length, mass and cells grow alike, so that a cell's stiffness stays."""
    short, long = (with_cells(n, 0.3).segments[0] for n in (10, 120))
    assert long.length_m / short.length_m == pytest.approx(12.0)
    assert long.mass_kg / short.mass_kg == pytest.approx(12.0)
    assert long.bending_stiffness_N_m2 == short.bending_stiffness_N_m2
    assert with_cells(30, 0.3) == replace(robots_of("continuum")[ROBOT](), friction=Friction(0.3))


def test_growth_is_measured_and_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """A figure for each size, with and without friction; the exponents are those of the figures."""
    monkeypatch.setattr(benchmark, "CELLS", (10, 20))
    monkeypatch.setattr(benchmark, "_STEPS_PER_LEVEL", 2)
    growth = benchmark.measure_growth(turns=1)
    assert growth.cells == (10, 20)
    assert growth.exponent_friction == pytest.approx(exponent((10, 20), growth.us_per_step_friction))
    assert growth.exponent_plain == pytest.approx(exponent((10, 20), growth.us_per_step_plain))
    speed = benchmark.Speed(ROBOT, 0.005, 30, True, 2e3, 3e3, 3300.0, 1.5, 1.1, 1.65, growth=growth)
    friction, plain = table_text([speed]).splitlines()[-2:]
    assert friction.split()[-1] == f"n^{growth.exponent_friction:.2f}"
    assert plain.split()[-1] == f"n^{growth.exponent_plain:.2f}"
    assert as_dict(speed)["growth"]["cells"] == (10, 20)
