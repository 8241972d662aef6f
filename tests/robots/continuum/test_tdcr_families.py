"""The survey's other families: end loads, one joint or no twist, curvature by energy, four-bar linkages.

Each by its limits (closed forms), and against the reference within what Rao et al. 2021 says of it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lumped_cases import (
    ALL_PULLS,
    FULL_PULL_N,
    LENGTH,
    NO_GRAVITY,
    benchmark,
    mean_errors,
    pulled,
    rod,
    rod_tips,
    tips,
)
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipj

from catheter_sim.core.robot import Friction
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum import four_bar, lumped, modal, rods
from catheter_sim.robots.continuum.lumped_kernels import LINKS_ONE
from catheter_sim.robots.continuum.rods import load, problem
from catheter_sim.robots.continuum.solvers import LUMPED, MODAL, RODS
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.lines import given
from catheter_sim.validation.spacer_disk import FAMILIES, rigid_along

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("tdcr")]  # compiled once, half a minute

EI = 4e-3  # of `rod` [N m^2]
IN_PLANE, ACROSS = (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)
SETS = ALL_PULLS[[1, 4, 5, 7, 13]]


def solve(name, robot, inputs):
    return STATIC_MODELS[name].solve(robot, inputs, NO_GRAVITY)


def percents(name, robot, force, pulls=SETS):
    inputs = pulled(pulls, force)
    return mean_errors(solve(name, robot, inputs), rod_tips(robot, inputs))


# ----------------------------------------------------------------------------------------------------
# Tendons that act at their ends alone.


def test_a_moment_at_the_end_makes_an_arc():
    """Tip of an arc of T r L / EI, by one tendon toward +x, to rounding of the integration."""
    turn = 6.0 * 8e-3 * LENGTH / EI
    (posture,) = solve("VC_moment", rod(4, ((0.0, 8e-3),)), pulled([[6.0]])).postures
    arc = [LENGTH * (1.0 - math.cos(turn)) / turn, 0.0, LENGTH * math.sin(turn) / turn]
    assert turn > 1.0
    np.testing.assert_allclose(posture.p_w[-1], arc, atol=1e-7 * LENGTH)


@pytest.mark.parametrize("tension", [1.0, 6.0, 20.0])
def test_a_force_at_the_end_makes_a_pendulums_curve(tension):
    """EI psi'' = -T sin(psi) from the tip, psi' = T r / EI there: sin(psi / 2) = k sn(w L), k = r w / 2."""
    w = math.sqrt(tension / EI)
    k = 0.5 * 8e-3 * w
    turn = 2.0 * math.asin(k * float(ellipj(w * LENGTH, k * k)[0]))
    (posture,) = solve("VC_tip_force", rod(4, ((0.0, 8e-3),)), pulled([[tension]])).postures
    ours = math.atan2(posture.R_w[-1][0, 2], posture.R_w[-1][2, 2])
    assert ours == pytest.approx(turn, abs=3e-6)  # what eighty steps of integration leave at 20 N
    assert abs(ours) < 0.95 * tension * 8e-3 * LENGTH / EI  # less than the moment alone would


def test_end_loads_do_as_the_survey_says():
    """A moment is right in the plane and wrong across it, where what runs along the way matters."""
    robot = benchmark(10)
    for force, low, high in ((IN_PLANE, 0.05, 0.3), (ACROSS, 1.0, 5.0)):
        assert low < percents("VC_moment", robot, force)[0] < high
    assert percents("VC", robot, ACROSS)[0] < 0.4
    assert percents("VC_tip_force", robot, (0.0, 0.0, 0.0))[0] > 10.0


# ----------------------------------------------------------------------------------------------------
# Pseudo-rigid bodies.


def test_one_joint_is_a_hinge_in_the_middle():
    """A moment M on one subsegment turns it by M L / EI about its middle."""
    inputs = pulled(np.zeros((1, 0)))
    inputs.moment_tip[:] = [0.0, 0.03, 0.0]
    (posture,) = solve("PRB_one", rod(1), inputs).postures
    turn = 0.03 * LENGTH / EI
    expected = [0.5 * LENGTH * math.sin(turn), 0.0, 0.5 * LENGTH * (1.0 + math.cos(turn))]
    np.testing.assert_allclose(posture.p_w[-1], expected, atol=1e-12)


def test_one_joint_is_the_simulated_chain_of_one_link():
    """Without Eq. 58 and in a plane, to what the chain's rest is known to; one tendon, and a force."""
    robot = replace(benchmark(5), links_per_subsegment=1)
    body = problem(robot)
    loads = load(body, pulled(ALL_PULLS[[4]], IN_PLANE), NO_GRAVITY)
    found = lumped.equilibria(body, loads, LINKS_ONE, projected=False)
    simulator = Simulator(robot, inertia=False)
    simulator.set_inputs(ALL_PULLS[4], IN_PLANE)
    assert simulator.settle(60.0)
    simulator.step(10 * round(robot.dynamics.relaxation_time_s / robot.dynamics.timestep_s))
    np.testing.assert_allclose(found.p_w[0, -1], simulator.posture().p_w[-1], atol=2e-5 * LENGTH)


def test_one_joint_converges_in_second_order():
    """Refined from 5 to 10 disks its error falls to a quarter, in the plane and across it."""
    for force in ((0.0, 0.0, 0.0), ACROSS):
        coarse, fine = (
            np.linalg.norm(
                np.subtract(
                    tips(solve("PRB_one", robot, pulled(SETS, force)))[0],
                    tips(solve("VC_ref", robot, pulled(SETS, force)))[0],
                ),
                axis=1,
            ).mean()
            for robot in (rigid_along(benchmark(n)) for n in (5, 10))
        )
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.3)
        assert 1e-3 < fine / LENGTH < 1e-2


def test_without_torsion_it_is_prb_in_a_plane_and_off_across_it():
    """No subsegment twists; nothing changes in the plane; across it errs by several times PRB's error."""
    robot = benchmark(10)
    inputs = pulled(SETS, IN_PLANE)
    one, other = (tips(solve(name, robot, inputs))[0] for name in ("PRB", "PRB_no_twist"))
    np.testing.assert_allclose(one, other, atol=1e-11)
    (posture,) = solve("PRB_no_twist", robot, pulled(SETS[1:2], ACROSS)).postures
    R = np.concatenate([np.eye(3)[None], posture.R_w])
    between = Rotation.from_matrix(np.swapaxes(R[:-1], 1, 2) @ R[1:]).as_rotvec()
    assert np.abs(between[:, :2]).max() > 0.01
    assert np.abs(between[:, 2]).max() < 1e-10
    assert 5.0 * percents("PRB", robot, ACROSS)[0] < percents("PRB_no_twist", robot, ACROSS)[0] < 10.0


# ----------------------------------------------------------------------------------------------------
# Curvature by energy.


@pytest.mark.parametrize(
    ("name", "share"), [("polynomial", 1.0), ("haar", 1.0 - 1.0 / 64.0), ("taylor", 0.75)]
)
def test_a_small_force_deflects_by_what_the_functions_hold(name, share):
    """Of F L^3 / 3 EI: all of it where curvature may be linear, 63/64 of quarters, 3/4 of one arc."""
    inputs = pulled(np.zeros((1, 0)), (1e-3, 0.0, 0.0))
    (posture,) = solve(name, rod(10), inputs).postures
    assert posture.p_w[-1, 0] == pytest.approx(share * 1e-3 * LENGTH**3 / (3.0 * EI), rel=1e-3)


@pytest.mark.parametrize(
    ("name", "low", "high"), [("polynomial", 0.0, 0.02), ("haar", 0.2, 1.0), ("taylor", 0.5, 4.0)]
)
def test_one_disk(name, low, high):
    """A straight tendon bends one subsegment as a column: parabolas hold nearly all of it, others less."""
    robot, inputs = rod(1, ((0.0, 8e-3),)), pulled([[2.0]])
    error, _ = mean_errors(solve(name, robot, inputs), tips(solve("VC_ref_noproj", robot, inputs)))
    assert low < error < high
    assert mean_errors(solve("VC_moment", robot, inputs), rod_tips(robot, inputs))[0] > 10.0


@pytest.mark.parametrize("name", list(MODAL))
def test_straight_without_load(name):
    """All zero: the straight robot, exactly, its tip at its length."""
    (posture,) = solve(name, benchmark(3), pulled(np.zeros((1, 4)))).postures
    np.testing.assert_allclose(posture.p_w[-1], [0.0, 0.0, LENGTH], atol=1e-15)


def energy(body, basis, x, pulls, force):
    """Return strain energy plus tensions times lengths less the tip force's work, by other means.

    Poses by the exponentials of four by four matrices, or by Taylor's terms one by one.
    """
    p, R, total = [np.zeros(3)], [np.eye(3)], 0.0
    fine = len(modal.pieces(body, basis).segment) // len(body.length_m)  # one of Taylor's
    for s in range(len(x)):
        own = np.flatnonzero(body.segment == s)
        length = body.length_m[own].sum()
        stiffness = np.array([body.bending_N_m2[own[0]]] * 2 + [body.torsion_N_m2[own[0]]]) / length
        start, turned = p[-1], R[-1]
        count = len(own) * fine
        for i, at in enumerate((np.arange(count) + 0.5) / count):
            w = x[s] @ basis.values(np.array([at]))[0]
            total += 0.5 * (stiffness * w * w).sum() / count
            if basis.from_segment:
                end = (i + 1.0) / count
                W = end * np.cross(np.eye(3), w)
                power, turn, shift = np.eye(3), np.zeros((3, 3)), np.zeros((3, 3))
                for j in range(basis.order + 1):
                    turn, shift = turn + power, shift + power / (j + 1)
                    power = power @ W / (j + 1)
                here, now = start + end * length * turned @ shift[:, 2], turned @ turn
            else:
                twist = np.zeros((4, 4))
                twist[:3, :3], twist[2, 3] = np.cross(np.eye(3), w) / count, length / count
                step = expm(twist)
                here, now = p[-1] + R[-1] @ step[:3, 3], R[-1] @ step[:3, :3]
            p.append(here)
            R.append(now)
    p, R = np.array(p)[::fine], np.array(R)[::fine]
    for tension, hole, last in zip(pulls, body.hole_m, body.last_disk, strict=True):
        at = (p + np.einsum("jab,jb->ja", R[:, :, :2], hole))[: last + 1]
        total += tension * np.linalg.norm(np.diff(at, axis=0), axis=1).sum()
    return total - np.dot(force, p[-1])


@pytest.mark.parametrize("name", list(MODAL))
def test_the_energy_is_stationary(name):
    """At the posture that is found, and not with a coefficient changed by a hundredth."""
    body, basis = problem(benchmark(2)), MODAL[name]
    pulls, force = np.array([4.0, 0.0, 3.0, 0.5]), np.array([0.2, 0.1, -0.1])
    found = modal.equilibria(body, load(body, pulled([pulls], force), NO_GRAVITY), basis)
    x = found.unknowns[0]
    assert np.abs(x).max() > 0.2

    def slopes(at):
        result = []
        for place in list(zip(*np.nonzero(x), strict=True))[::3]:
            step = np.zeros_like(x)
            step[place] = 1e-4
            up, down = (energy(body, basis, at + side * step, pulls, force) for side in (1.0, -1.0))
            result.append((up - down) / 2e-4)
        return np.abs(result).max()

    off = x.copy()
    off[0, 0, 0] += 0.01
    assert slopes(x) < 1e-8
    assert slopes(off) > 3e-4
    assert found.residual[0] < 1e-11


def test_bases_come_to_the_rod_in_eyelets():
    """Ten disks, no stretch: parabolas to 0.01 % of the length, quarters to 0.3 %, arcs not under a load."""
    robot = rigid_along(benchmark(10))
    for force, low, high in (((0.0, 0.0, 0.0), 0.01, 0.1), (ACROSS, 1.0, 10.0)):
        inputs = pulled(SETS, force)
        reference = tips(solve("VC_ref_noproj", robot, inputs))
        found = {name: mean_errors(solve(name, robot, inputs), reference)[0] for name in MODAL}
        assert found["polynomial"] < 0.01
        assert found["haar"] < 0.3
        assert low < found["taylor"] < high
        if force == ACROSS:
            assert 5.0 * found["polynomial"] < found["haar"]


def test_taylors_axes_are_made_rotations():
    """The series' axes are off by 1e-6 and more where it bends, the posture's are not."""
    robot = benchmark(3)
    found = modal.equilibria(
        problem(robot), load(problem(robot), pulled([[FULL_PULL_N, 0, 0, 0]]), NO_GRAVITY), modal.TAYLOR
    )
    assert 1e-6 < np.abs(found.R_w[0, -1].T @ found.R_w[0, -1] - np.eye(3)).max() < 1e-2
    (posture,) = solve("taylor", robot, pulled([[FULL_PULL_N, 0, 0, 0]])).postures
    np.testing.assert_allclose(posture.R_w[-1].T @ posture.R_w[-1], np.eye(3), atol=1e-12)
    assert np.linalg.det(posture.R_w[-1]) == pytest.approx(1.0)


def test_friction_has_no_energy():
    robot = replace(benchmark(3), friction=Friction(0.1))
    assert all("friction" in STATIC_MODELS[name].lacks(robot) for name in MODAL)
    assert not any(STATIC_MODELS[name].lacks(benchmark(3)) for name in FAMILIES)


# ----------------------------------------------------------------------------------------------------
# Four-bar linkages.


def test_the_coupler_has_turned_least():
    """One subsegment, a tendon 5 mm shorter: over all crank angles no linkage's coupler turns less."""
    r, short = 8e-3, 5e-3
    (posture,) = solve("four_bar", rod(1, ((0.0, r),)), given([[short]], "displacement")).postures
    turn = math.atan2(posture.R_w[-1][0, 2], posture.R_w[-1][2, 2])

    def missing(coupler, crank):
        end = np.array([LENGTH * math.sin(crank), LENGTH * math.cos(crank)])
        span = end + r * np.array([math.cos(coupler) - 1.0, -math.sin(coupler)])
        return float(np.linalg.norm(span)) - (LENGTH - short)

    turns = []
    for crank in np.linspace(0.0, 0.8, 401):
        grid = np.linspace(0.0, 2.0, 201)
        values = [missing(coupler, crank) for coupler in grid]
        turns += [
            brentq(missing, a, b, args=(crank,))
            for a, b, at, beyond in zip(grid, grid[1:], values, values[1:], strict=False)
            if at * beyond < 0.0
        ][:1]
    assert turn == pytest.approx(min(turns), abs=1e-5)
    assert turn == pytest.approx(2.0 * math.asin(short / (2.0 * r)), rel=1e-5)
    half = short / (2.0 * r)
    np.testing.assert_allclose(
        posture.p_w[-1], [LENGTH * half, 0.0, LENGTH * math.sqrt(1.0 - half**2)], rtol=1e-5, atol=1e-12
    )


def test_four_bars_slack_tendons_and_lengths_that_do_not_close():
    """A tendon let out too far bends nothing, antagonists share what they miss, too short is refused."""
    robot = rod(4, ((0.0, 8e-3), (180.0, 8e-3)))
    inputs = given(1e-3 * np.array([[5.0, -5.0], [5.0, -9.0], [5.0, -4.0], [0.0, -3.0]]), "displacement")
    run = solve("four_bar", robot, inputs)
    turn = [math.atan2(posture.R_w[0][0, 2], posture.R_w[0][2, 2]) for posture in run.postures]
    expected = [2.0 * math.asin(d / (4.0 * 2.0 * 8e-3)) for d in (5e-3, 5e-3, 4.5e-3, 0.0)]
    np.testing.assert_allclose(turn, expected, atol=1e-5)
    np.testing.assert_allclose(run.residual, [0.0, 0.0, 5e-4, 0.0], atol=1e-7)
    with pytest.raises(InputError, match=r"four_bar finds no equilibrium at row 1"):
        solve("four_bar", robot, given([[0.07, -0.1]], "displacement"))


def test_four_bars_come_to_the_reference_without_load_alone():
    """With VC_ref's lengths its error falls as 1 / n^2; across the plane no tendon tells of the load."""
    gaps = []
    for n in (4, 8):
        robot = rigid_along(benchmark(n))
        gaps.append(percents("four_bar", robot, (0.0, 0.0, 0.0)))
    assert math.log2(gaps[0][0] / gaps[1][0]) == pytest.approx(2.0, abs=0.3)
    assert 1e-3 < gaps[1][0] < 0.05
    assert gaps[1][1] < 1e-3
    assert percents("four_bar", benchmark(8), ACROSS)[0] > 10.0


# ----------------------------------------------------------------------------------------------------
# All of them: tension and length.


@pytest.mark.parametrize("name", [name for name in FAMILIES if name != "four_bar"])
def test_tensions_come_back_from_their_lengths(name):
    """Driven by what tensions shorten its paths by, a model has these tensions again."""
    robot = benchmark(3)
    body = problem(robot)
    inputs = pulled([[4.0, 1.0, 2.0, 0.5]], (0.1, 0.1, 0.0))
    loads = load(body, inputs, NO_GRAVITY)
    if name in RODS:
        length = rods.path_lengths(rods.equilibria(body, loads, RODS[name]))
    elif name in MODAL:
        length = rods.straight_lengths(modal.equilibria(body, loads, MODAL[name]), body)
    else:
        untwisted = lumped.untwisted(body) if name == "PRB_no_twist" else body
        length = rods.straight_lengths(lumped.equilibria(untwisted, loads, LUMPED[name]), body)
    springs = [rods.drive_stiffness(robot, tendon) for tendon in robot.tendons]
    displacement = body.disk_z_m[body.last_disk] - length + inputs.tendon / springs
    again = given(displacement, "displacement", inputs.force_tip)
    (posture,) = solve(name, robot, again).postures
    np.testing.assert_allclose(posture.actuator_tension, inputs.tendon[0], rtol=1e-6)


def test_linkages_take_no_lengths_of_none():
    """A rod without tendons stands straight."""
    body = problem(rod(2))
    loads = load(body, pulled(np.zeros((1, 0))), NO_GRAVITY)
    bars = four_bar.linkages(body, loads, np.zeros((1, 0)), np.zeros((1, 0, 2)))
    np.testing.assert_allclose(bars.p_w[0, -1], [0.0, 0.0, LENGTH])
