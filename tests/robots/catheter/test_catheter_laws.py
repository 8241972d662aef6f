"""Simulated catheters with friction, slack, play, stretching tendons and measured resistance."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.robots.catheter.kinematics import arm_m
from catheter_sim.robots.catheter.laws import SHAKE, StretchingTendon, _slipping
from catheter_sim.robots.catheter.measured import LAWS, PRINTED, loading_N, tension_along, unloading_N
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.catheter.statics import balance
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation.lines import given
from catheter_sim.validation.mitral import joint_angles_deg

pytestmark = pytest.mark.slow

STILL = np.zeros(3)


def largest_differences(
    name: str, pair: int, joint: str, values_mm: list[float], *settings: str
) -> tuple[float, float]:
    """Return how far simulation and `balance` differ along a history: in angle [deg], in tension [N]."""
    robot = load_robot(name, settings)
    assert isinstance(robot, CatheterRobot)
    rows = np.zeros((len(values_mm), 4))
    rows[:, pair] = np.array(values_mm) * 1e-3
    inputs = given(rows, "displacement")
    simulated, static = simulate(robot, inputs, STILL).postures, balance(robot, inputs, STILL).postures
    angles = [joint_angles_deg(robot, postures)[joint] for postures in (simulated, static)]
    tensions = [np.array([p.actuator_tension[pair] for p in postures]) for postures in (simulated, static)]
    assert np.ptp(angles[1]) > 20.0
    return float(np.abs(angles[0] - angles[1]).max()), float(np.abs(tensions[0] - tensions[1]).max())


LOOP = [0.0, 1.0, 2.0, 4.0, 6.0, 4.7, 3.0, 1.0, 0.0]


@pytest.mark.parametrize("settings", [(), ("friction.mu=0.1", "path_deg=120")])
def test_elastic_tendon_with_friction_as_statics(settings: tuple[str, ...]) -> None:
    """Slack, stretch and capstan friction along a loop: where the joint slips, 0.03 deg from statics."""
    angle, tension = largest_differences("mitral_transseptal@tube", 0, "bending", LOOP, *settings)
    assert angle < 0.03
    assert tension < 0.01


def test_joint_lets_go_gap_by_gap() -> None:
    """After a turn the simulation's gaps let go one by one, the static joint as a whole."""
    angle, _ = largest_differences("mitral_transseptal@tube", 0, "bending", [0.0, 6.0, 5.9])
    assert 0.1 < angle < 1.0


@pytest.mark.parametrize(
    ("pair", "joint", "settings"),
    [
        (0, "bending_proximal", ()),
        (1, "bending_distal", ()),
        (1, "bending_distal", ("friction.mu=0",)),
    ],
)
def test_measured_laws_as_statics(pair: int, joint: str, settings: tuple[str, ...]) -> None:
    """Algorithms 1 and 2 of Nayar 2023 in the simulation and in statics: within 0.3 deg of 50 over a loop."""
    values = [0.0, 2.0, 4.0, 7.0, 10.0, 9.0, 7.0, 6.0, 11.0, 12.0, 8.0, 0.0, -4.0, -9.0, -6.0]
    angle, tension = largest_differences("mitral_4dof@elongation", pair, joint, values, *settings)
    assert angle < 0.3
    assert tension < 0.03


def test_play_of_a_torsion_drive_as_statics() -> None:
    """Play between drive and torsion joint, in the simulation as a play."""
    values = [0.0, 2.0, 3.0, 2.0, 1.0, -2.0, -1.0]
    angle, _ = largest_differences("mitral_transseptal@tube", 1, "torsion_proximal", values)
    assert angle < 1e-3


def test_stretching_tendon_is_the_law() -> None:
    """A simulated tendon's tension along large cycles is Algorithm 1's."""
    strains = np.concatenate(
        [
            np.linspace(a, b, 40)[1:]
            for a, b in ((0, 0.03), (0.03, 0.01), (0.01, 0.05), (0.05, 0), (0, 0.05), (0.05, 0), (0, 0.04))
        ]
    )
    tendon = StretchingTendon(0.35, np.inf)
    found = np.array([tendon.at(0.35 * strain).tension_N for strain in strains])
    assert np.maximum(found, 0.0) == pytest.approx(tension_along(PRINTED, strains), abs=1e-9)


def test_stretching_tendon_in_series() -> None:
    """With a spring in series the stretch is shared: the law's strain and the spring's share add up."""
    tendon = StretchingTendon(0.35, 5e3)
    tension = tendon.at(10e-3).tension_N
    assert 0.35 * tendon.state.strain + tension / 5e3 == pytest.approx(10e-3, abs=1e-9)
    assert 0.0 < tendon.state.strain < 10e-3 / 0.35


def test_shaking_is_no_cycle() -> None:
    """A tremble far below any real cycle leaves the history as it is; a real turn does not."""
    tendon = StretchingTendon(0.35, np.inf)
    tendon.at(0.35 * 0.04)
    for shake in np.random.default_rng(0).uniform(-0.5, 0.0, 50) * SHAKE:
        tendon.at(0.35 * (0.04 + shake))
    assert (tendon.state.phase, tendon.state.cycle) == ("loading", 0)
    tendon.at(0.35 * 0.02)
    assert (tendon.state.phase, tendon.state.cycle) == ("unloading", 1)


def test_reset_gives_new_tendons_and_unbent_joints() -> None:
    """After a reset the same inputs give the same posture as from the start, to the last bit."""
    simulator = Simulator(load_robot("mitral_4dof@elongation"), inertia=False)
    seen = []
    for _ in range(2):
        simulator.reset()
        for way in (4e-3, 1e-3):
            simulator.set_inputs(np.array([way, way, 0.0, 0.0]))
            simulator.step(60)
        seen.append(simulator.posture().joint_angles)
    assert np.array_equal(seen[0], seen[1])
    assert np.abs(seen[0]).max() > 0.01


def test_measured_resistance_holds_between_its_curves() -> None:
    """Let go a little, a joint that resists as measured keeps nearly its angle while the tension falls."""
    robot = load_robot("mitral_4dof@elongation", ["friction.mu=0"])
    rows = np.zeros((4, 4))
    rows[:, 1] = [
        10e-3,
        8e-3,
        8.1e-3,
        8.2e-3,
    ]  # back, and on again: from the lower curve toward the upper one
    postures = simulate(robot, given(rows, "displacement"), STILL).postures
    assert isinstance(robot, CatheterRobot)
    bend = joint_angles_deg(robot, postures)["bending_distal"]
    tension = [posture.actuator_tension[1] for posture in postures]
    assert bend[3] - bend[1] < 0.05 * (bend[0] - bend[1])
    assert tension[3] > 1.2 * tension[1]


@pytest.mark.parametrize("law", ["measured_proximal", "measured_distal"])
def test_compiled_curves_are_the_static_ones(law: str) -> None:
    """The compiled slip moments are Algorithm 2's tensions times the tendons' arm, to rounding."""
    robot = load_robot("mitral_4dof@elongation")
    segment = next(item for item in robot.segments if getattr(item, "resistance", "") == law)
    force, gaps = LAWS[law], segment.rings + 1
    rng = np.random.default_rng(5)
    bend = rng.uniform(5.0, 110.0, gaps) * rng.choice([-1.0, 1.0], gaps)
    turn = rng.uniform(5.0, 120.0, (2, gaps))
    low, high = np.empty(gaps), np.empty(gaps)
    numbers = (np.array(item) for item in (force.loading, force.bounds_deg, force.c_1, force.c_2))
    arms = np.array([segment.arm_m, segment.half_gap_m])
    _slipping(np.radians(bend) / gaps, turn, 0.0, arms, *numbers, low, high)
    own = np.where(bend >= 0.0, turn[0], turn[1])
    arm, side = arm_m(segment, np.radians(bend)), np.sign(bend)
    on, back = loading_N(force, np.abs(bend)) * arm, unloading_N(force, np.abs(bend), own) * arm
    assert np.where(side > 0, high, -low) == pytest.approx(on, rel=1e-12)
    assert np.where(side > 0, low, -high) == pytest.approx(back, rel=1e-9)
