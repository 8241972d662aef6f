"""PRB: published poses, the bending plane's balance in its three forms, beams, buckling."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lumped_cases import (
    ALL_PULLS,
    LENGTH,
    NO_GRAVITY,
    benchmark,
    mean_errors,
    published,
    pulled,
    rod,
    rod_tips,
    tips,
    turned_deg,
)

from catheter_sim.robots.continuum.lumped import equilibria, prb, prb_middle, prb_printed
from catheter_sim.robots.continuum.lumped_kernels import (
    LINK_SHARES,
    LINKS,
    LINKS_MIDDLE,
    SPRING_FACTORS,
    frames,
)
from catheter_sim.robots.continuum.rods import load, problem

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("tdcr")]  # compiled once, half a minute

EI = 4e-3
ACROSS = (0.5, 0.0, 0.0)  # the tendons bend the robot in the yz plane


@pytest.mark.parametrize("disks", ["3", "10"])
def test_published_poses(disks):
    """Every published pose of PRB is met to 1e-7 of the length in the robot's plane, to 1e-4 and 0.01 deg
    in space: their x is what their solver left, and ours is zero.
    """
    pulls, p_w, R_w = published("spacer_disk_lumped_tip_poses.csv", model="PRB", n=disks)
    assert len(pulls) == 16
    p, R = tips(prb(benchmark(int(disks)), pulled(pulls), NO_GRAVITY))
    assert np.abs(p - p_w)[:, 1:].max() < 1e-7 * LENGTH
    assert np.linalg.norm(p - p_w, axis=1).max() < 1e-4 * LENGTH
    assert turned_deg(R_w, R).max() < 0.01
    assert np.abs(p[:, 0]).max() < 1e-12


def test_links_are_as_long_as_the_subsegment():
    """Table 1's lengths sum to 0.999; divided by it a straight robot has its length."""
    assert LINK_SHARES.sum() == pytest.approx(1.0, abs=1e-15)
    assert pytest.approx([0.125, 0.35, 0.388, 0.136]) == LINK_SHARES * 0.999
    p, _ = tips(prb(benchmark(3), pulled(np.zeros((1, 4))), NO_GRAVITY))
    assert p[0] == pytest.approx([0.0, 0.0, LENGTH], abs=1e-15)


@pytest.mark.parametrize("form", [LINKS, LINKS_MIDDLE])
def test_joints_balance_in_the_plane(form):
    """Eq. 48 by another way: the springs' energy plus the work of the forces on the tip is stationary.

    Without tendons the loads are conservative; in a plane the joints' balance is its gradient.
    """
    body = problem(rod(3))
    force = np.array([0.0, 0.6, -0.8])
    found = equilibria(body, load(body, pulled(np.zeros((1, 0)), force), NO_GRAVITY), form)
    x = found.unknowns[0]

    def potential(unknowns):
        p, R = np.empty((4, 3)), np.empty((4, 3, 3))
        frames(form, unknowns, body.length_m, p, R)
        springs = SPRING_FACTORS * (body.bending_N_m2 / body.length_m)[:, None]
        return 0.5 * (springs * unknowns[:, :3] ** 2).sum() - force @ p[-1]

    assert np.abs(x[:, :3]).sum() > 0.4
    for k in range(3):
        for q in range(3):
            step = np.zeros_like(x)
            step[k, q] = 1e-5
            assert abs(potential(x + step) - potential(x - step)) / 2e-5 < 1e-9


def test_balance_at_the_middle_is_nearly_stationary_in_space():
    """Bent across its plane the form balanced at the middle and the end leaves a tenth or less of the
    virtual work that the printed form leaves for the bending planes.
    """
    body = problem(rod(10, ((90.0, 8e-3),)))
    turn = []
    for form in (LINKS, LINKS_MIDDLE):
        found = equilibria(body, load(body, pulled(np.array([[6.0]]), ACROSS), NO_GRAVITY), form)
        x, R, p = found.unknowns[0], found.R_w[0], found.p_w[0]
        force, moment = found.wrench[0, :, :3], found.wrench[0, :, 3:]
        at_end = moment - np.cross(np.diff(p, axis=0), force)
        work = (moment * R[:-1, :, 2]).sum(axis=1) - (at_end * R[1:, :, 2]).sum(axis=1)
        turn.append(np.abs(work / np.linalg.norm(x[:, :3], axis=1)).max())
    assert turn[1] < 0.1 * turn[0]


def test_transverse_weakness_of_the_root():
    """At 0.2 of the stiffness, a force across the plane: the equations' root errs by 0.16 % (an
    independent solver's figure); with the plane balanced at the subsegments' middle by a fifth of it.
    """
    robot, inputs = benchmark(10, 0.2), pulled(0.2 * ALL_PULLS, ACROSS)
    reference = rod_tips(robot, inputs)
    simple, _ = mean_errors(prb(robot, inputs, NO_GRAVITY), reference)
    assert simple == pytest.approx(0.16, abs=6e-3)
    middle, degrees = mean_errors(prb_middle(robot, inputs, NO_GRAVITY), reference)
    assert middle < 0.25 * simple
    assert degrees < 0.06


def test_forms_agree_in_a_plane():
    """Where nothing leaves the plane, both forms are one model."""
    inputs = pulled(ALL_PULLS, (0.0, 0.5, 0.0))
    one, other = (tips(model(benchmark(5), inputs, NO_GRAVITY))[0] for model in (prb, prb_middle))
    np.testing.assert_allclose(one, other, atol=1e-12)


@pytest.mark.parametrize("form", [LINKS, LINKS_MIDDLE])
def test_plane_balanced_at_the_base_errs_in_first_order(form):
    """Refined, the printed form's error across the plane falls as 1 / n, the middle's at least as 1 / n^2.

    Against the rod with the same tendons, tendon 3 and a force across.
    """
    gaps = []
    for disks in (4, 8):
        robot, inputs = benchmark(disks), pulled(ALL_PULLS[[4]], ACROSS)
        p, _ = rod_tips(robot, inputs)
        model = prb if form == LINKS else prb_middle
        gaps.append(np.linalg.norm(tips(model(robot, inputs, NO_GRAVITY))[0] - p) / LENGTH)
    if form == LINKS:
        assert gaps[0] / gaps[1] == pytest.approx(2.0, abs=0.3)
        assert gaps[1] > 2e-3
    else:
        assert gaps[1] < 1e-3


def test_printed_residual_has_the_same_root():
    """Levenberg-Marquardt on the printed residual ends at our root where it ends at one."""
    body = problem(benchmark(3))
    loads = load(body, pulled(ALL_PULLS[[1, 7]], ACROSS), NO_GRAVITY)
    ours = equilibria(body, loads, LINKS)
    for row in (0, 1):
        stopped, squares = prb_printed(body, loads, row)
        assert squares < 1e-25
        np.testing.assert_allclose(stopped.p_w[0], ours.p_w[row], atol=1e-7 * LENGTH)


def test_printed_residual_stalls_at_its_double_root():
    """At 0.2 of the stiffness it stops with the printed residual below 1e-4 N m, yet more than 3e-4 N m of
    the moment across the bending planes unbalanced, and the tip off the root by more than 0.5 %.
    """
    body = problem(benchmark(10, 0.2))
    loads = load(body, pulled(0.2 * ALL_PULLS[[13]], ACROSS), NO_GRAVITY)
    stopped, squares = prb_printed(body, loads)
    ours = equilibria(body, loads, LINKS)
    assert math.sqrt(squares) < 1e-4
    assert stopped.residual[0] > 3e-4
    assert ours.residual[0] < 1e-11
    assert np.linalg.norm(stopped.p_w[0, -1] - ours.p_w[0, -1]) > 5e-3 * LENGTH


def test_cantilever_and_beam_column():
    """A small tip force F deflects by F L^3 / 3 EI; under half of Euler's load by F (tan kL - kL) / (P k)."""
    small = 1e-4
    inputs = pulled(np.zeros((2, 0)))
    euler = math.pi**2 * EI / (4.0 * LENGTH**2)
    inputs.force_tip[:] = [[small, 0.0, 0.0], [small, 0.0, -0.5 * euler]]
    p, _ = tips(prb(rod(10), inputs, NO_GRAVITY))
    assert p[0, 0] == pytest.approx(small * LENGTH**3 / (3.0 * EI), rel=2e-3)
    k = math.sqrt(0.5 * euler / EI)
    column = small * (math.tan(k * LENGTH) - k * LENGTH) / (0.5 * euler * k)
    assert p[1, 0] == pytest.approx(column, rel=4e-3)
