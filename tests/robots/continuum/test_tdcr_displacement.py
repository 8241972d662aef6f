"""Rod models driven by displacement: tensions come back, antagonists, CC's limit, simulation, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lumped_cases import FULL_PULL_N, LENGTH, NO_GRAVITY, benchmark

from catheter_sim.core.inputs import Inputs
from catheter_sim.core.statics import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum import lumped, rods
from catheter_sim.robots.continuum.constant_curvature import drive_stiffness
from catheter_sim.robots.continuum.lumped_kernels import ARC, LINKS, LINKS_MIDDLE
from catheter_sim.robots.continuum.rods import load, problem, straight_lengths, taut
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.simulation.replay import simulate
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.lines import given

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("tdcr")]  # compiled once, half a minute

RODS = {"VC": "continuous", "VC_ref": "projected", "VC_ref_noproj": "eyelets"}
LUMPED = {"CC_sub": ARC, "PRB": LINKS, "PRB_middle": LINKS_MIDDLE}
MODELS = (*RODS, *LUMPED)


def shortening(name: str, robot: ContinuumRobot, inputs: Inputs) -> np.ndarray:
    """Return by how much the tendons' paths are shorter than at rest under tensions, shape (r, t) [m]."""
    body = problem(robot)
    loads = load(body, inputs, NO_GRAVITY)
    if name in RODS:
        length = rods.path_lengths(rods.equilibria(body, loads, RODS[name]))
    else:
        length = straight_lengths(lumped.equilibria(body, loads, LUMPED[name]), body)
    return body.disk_z_m[body.last_disk] - length


def springs(robot: ContinuumRobot) -> np.ndarray:
    """Return the tendons' stiffnesses, shape (t,) [N/m]."""
    return np.array([drive_stiffness(robot, tendon) for tendon in robot.tendons])


def elastic(robot: ContinuumRobot, stiffness: float, pretension: float = 0.0) -> ContinuumRobot:
    """Return `robot` with elastic, pretensioned tendons."""
    tendons = tuple(
        replace(item, stiffness_N_per_m=stiffness, pretension_N=pretension) for item in robot.tendons
    )
    return replace(robot, tendons=tendons)


def rigid_axis(robot: ContinuumRobot) -> ContinuumRobot:
    """Return `robot` with a backbone that neither stretches nor shears."""
    segments = tuple(
        replace(item, axial_stiffness_N=np.inf, shear_stiffness_N=np.inf) for item in robot.segments
    )
    return replace(robot, segments=segments)


def actuator(run: StaticRun) -> np.ndarray:
    return np.array([posture.actuator_tension for posture in run.postures])


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("disks", [2, 10])
@pytest.mark.parametrize("stiff", [True, False])
def test_tensions_come_back_from_their_displacements(name: str, disks: int, stiff: bool) -> None:
    """Tensions shorten the paths; driven by shortening and stretch, the robot has them again, to 1e-8.

    With a force across, with antagonists both taut, with slack tendons, inextensible or elastic.
    """
    robot = benchmark(disks) if stiff else elastic(benchmark(disks), 3e4, 0.7)
    rng = np.random.default_rng(11)
    pulls = rng.uniform(0.1, FULL_PULL_N, (6, 4))
    pulls[[1, 2, 3], [0, 3, 1]] = 0.0
    force = rng.uniform(-0.3, 0.3, (6, 3))
    pretension = np.array([item.pretension_N for item in robot.tendons])
    by_tension = given(pulls, force_tip=force)
    displacement = shortening(name, robot, by_tension) + (pulls - pretension) / springs(robot)
    displacement[pulls == 0.0] -= 2e-4
    run = STATIC_MODELS[name].solve(robot, given(displacement, "displacement", force), NO_GRAVITY)
    np.testing.assert_allclose(actuator(run), pulls, rtol=1e-8, atol=0.0)
    expected = STATIC_MODELS[name].solve(robot, by_tension, NO_GRAVITY)
    for ours, theirs in zip(run.postures, expected.postures, strict=True):
        np.testing.assert_allclose(ours.p_w, theirs.p_w, atol=1e-9 * LENGTH)
        np.testing.assert_allclose(ours.tendon_tension, theirs.tendon_tension, rtol=1e-7)


@pytest.mark.parametrize("name", MODELS)
def test_a_tendon_that_is_let_out_is_slack(name: str) -> None:
    """Zero displacement is rest; with two tendons pulled, their antagonists, let out, are at zero."""
    inputs = given(1e-3 * np.array([[0, 0, 0, 0], [3, -9, 5, -9], [-9, 3, -9, 5]], float), "displacement")
    run = STATIC_MODELS[name].solve(benchmark(5), inputs, NO_GRAVITY)
    tension = actuator(run)
    np.testing.assert_array_equal(tension[0], 0.0)
    np.testing.assert_array_equal(tension[1, [1, 3]], 0.0)
    assert (tension[1, [0, 2]] > 0.5).all()
    np.testing.assert_allclose(tension[2, [1, 0, 3, 2]], tension[1], rtol=1e-8)  # mirror image
    np.testing.assert_allclose(run.postures[0].p_w[:, :2], 0.0, atol=1e-15)


def test_pretension_at_rest_is_what_the_axis_leaves_of_it() -> None:
    """Four alike elastic tendons held at zero: T = p - k d, d the compression of the path under them."""
    stiffness, pretension = 4e4, 3.0
    robot = elastic(benchmark(4), stiffness, pretension)
    run = STATIC_MODELS["VC"].solve(robot, given(np.zeros((1, 4)), "displacement"), NO_GRAVITY)
    one, two = 0.05 / robot.segments[0].axial_stiffness_N, 0.05 / robot.segments[1].axial_stiffness_N
    # Tendons 1, 2 to the first segment: a; 3, 4 to the tip: b. Compressions 2 (a + b) one, and 2 b two more.
    matrix = np.array(
        [[1.0 / stiffness + 2.0 * one, 2.0 * one], [2.0 * one, 1.0 / stiffness + 2.0 * (one + two)]]
    )
    a, b = np.linalg.solve(matrix, np.full(2, pretension / stiffness))
    np.testing.assert_allclose(actuator(run)[0], [a, a, b, b], rtol=1e-9)


def test_lumens_in_a_rod_that_only_bends_are_constant_curvature() -> None:
    """VC without stretch and shear of the backbone and CC take the same displacements to the same arcs."""
    robot = rigid_axis(benchmark(3))
    inputs = given(1e-3 * np.array([[3, -5, 1, -9], [-2, 1.5, 4, -5], [4, -9, -9, 2]], float), "displacement")
    rod, arcs = (STATIC_MODELS[name].solve(robot, inputs, NO_GRAVITY) for name in ("VC", "CC"))
    assert actuator(arcs).max() > 1.0
    np.testing.assert_allclose(actuator(rod), actuator(arcs), rtol=1e-5, atol=1e-5)
    for ours, theirs in zip(rod.postures, arcs.postures, strict=True):
        np.testing.assert_allclose(ours.p_w, theirs.p_w, atol=1e-6 * LENGTH)


@pytest.mark.parametrize("name", ["CC_sub", "VC_ref"])
def test_many_disks_come_to_constant_curvature(name: str) -> None:
    """Straight spans shorten a little more than the arc: the tensions' gap to CC's falls with 1 / n^2."""
    inputs = given(1e-3 * np.array([[0.0, -9.0, 6.0, -9.0]]), "displacement")
    gaps = []
    for disks in (8, 16):
        robot = rigid_axis(elastic(benchmark(disks), 5e3))
        ours, arcs = (actuator(STATIC_MODELS[m].solve(robot, inputs, NO_GRAVITY)) for m in (name, "CC"))
        gaps.append(np.abs(ours - arcs).max())
    assert gaps[0] / gaps[1] == pytest.approx(4.0, rel=0.05)
    assert gaps[1] < 0.01 * arcs.max()


def test_the_simulated_chain_comes_to_the_same_tensions() -> None:
    """Through eyelets, elastic tendons, a force across: the chain of K hinges between disks comes to the
    rod's tips and tensions with 1 / K^2. The chain neither stretches nor shears; nor does the rod here.
    """
    robot = rigid_axis(elastic(benchmark(10), 2e4, 1.0))
    inputs = given(1e-3 * np.array([[2.0, -2.0, 4.0, -4.0]]), "displacement", np.array([[0.2, 0.1, 0.0]]))
    (ours,) = STATIC_MODELS["VC_ref_noproj"].solve(robot, inputs, NO_GRAVITY).postures
    gaps = []
    for links in (2, 4):
        chain = simulate(replace(robot, links_per_subsegment=links), inputs, NO_GRAVITY).postures[-1]
        gaps.append(np.abs(ours.actuator_tension - chain.actuator_tension).max())
    assert ours.actuator_tension.max() > 2.0
    assert gaps[0] / gaps[1] == pytest.approx(4.0, rel=0.05)
    assert gaps[1] < 6e-3
    np.testing.assert_allclose(ours.p_w[-1], chain.p_w[-1], atol=3e-4 * LENGTH)


def test_what_no_posture_follows_is_one_line() -> None:
    """A tendon drawn in by half its length more than the robot can bend is refused by its row."""
    inputs = given(1e-3 * np.array([[1.0, 0, 0, 0], [300.0, 0, 0, 0]]), "displacement")
    with pytest.raises(InputError, match=r"VC_ref finds no posture that follows .* row 2 \(time_s = 1\)"):
        STATIC_MODELS["VC_ref"].solve(benchmark(3), inputs, NO_GRAVITY)


def test_taut_and_slack_solve_the_linear_problem() -> None:
    """T >= 0, w >= 0, T w = 0 for positive definite matrices of any size."""
    rng = np.random.default_rng(2)
    for size in (1, 2, 4, 9):
        for _ in range(50):
            half = rng.normal(size=(size, size))
            matrix, constant = half @ half.T + 1e-3 * np.eye(size), rng.normal(size=size)
            tension = taut(matrix, constant)
            gap = matrix @ tension + constant
            assert tension.min() >= 0.0
            assert gap.min() > -1e-8 * np.abs(tension).max() - 1e-12
            assert np.abs(tension * gap).max() < 1e-8 * max(1.0, np.abs(tension).max())
