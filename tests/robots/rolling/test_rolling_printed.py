"""Claims about the printed balance of chest_tube_2025, what it leaves out, and constant curvature."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from rolling_cases import HANGING, NO_GRAVITY, pulls
from scipy.integrate import quad

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling import complete as rods
from catheter_sim.robots.rolling.complete import complete
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.robots.rolling.pcc import pcc
from catheter_sim.robots.rolling.printed import Terms, printed, printed_balance, rod_tensions, solve_printed

pytestmark = pytest.mark.slow

SECTION = rolling_chain(load_robot("chest_tube_section"))
SWEEP_N = np.arange(0.0, 30.01, 0.25)


@pytest.fixture(scope="module")
def sweep() -> Array:
    """Return the printed balance's joint angles over the sweep of tensions [deg]."""
    theta, _ = solve_printed(SECTION, pulls(SWEEP_N), NO_GRAVITY)
    return np.degrees(theta)


def test_even_joints_buckle_as_in_fig_13(sweep: Array) -> None:
    """Median even joint: least, -1.3 to -1.5 deg, at 5.5 to 8.5 N; back through zero at 18 to 22 N."""
    even = np.median(sweep[:, 1::2], axis=1)
    lowest = int(even.argmin())
    assert -1.5 < even[lowest] < -1.3
    assert 5.5 < SWEEP_N[lowest] < 8.5
    after = lowest + int(np.argmax(even[lowest:] > 0.0))
    share = -even[after - 1] / (even[after] - even[after - 1])
    assert 18.0 < SWEEP_N[after - 1] + share * (SWEEP_N[after] - SWEEP_N[after - 1]) < 22.0


def test_odd_joints_bend_fast_then_slower(sweep: Array) -> None:
    """Fig. 13: every odd joint bends toward the rod all along, beyond 20 N at half the rate below 10 N."""
    odd = sweep[:, 0::2]
    assert np.all(np.diff(odd, axis=0) > 0.0)
    start, end = odd[SWEEP_N == 10.0] - odd[SWEEP_N == 0.0], odd[SWEEP_N == 30.0] - odd[SWEEP_N == 20.0]
    assert np.all(end < 0.5 * start)
    assert sweep[-1].sum() > 90.0  # Table I: 90 deg reachable


def test_reaction_at_the_base_grows_beyond_the_tension() -> None:
    """At 50 N the printed reaction at the base is 1.28 times the tension, where the tension alone acts."""
    _, found = solve_printed(SECTION, pulls([50.0]), NO_GRAVITY)
    assert found.reaction[0, 0] / 50.0 == pytest.approx(1.28, abs=0.015)
    _, whole = solve_printed(SECTION, pulls([50.0]), NO_GRAVITY, Terms(True, True, True))
    theta = complete(load_robot("chest_tube_section"), pulls([50.0]), NO_GRAVITY).postures[0].joint_angles
    span = rods.spans(SECTION, theta)
    upright = span.along[0, 0] / span.length[0, 0]  # part of the tension along the base's normal
    assert whole.reaction[0, 0] / 50.0 == pytest.approx(upright, rel=1e-9)


@pytest.mark.parametrize(
    ("reference", "gravity"),
    [("chest_tube_section", NO_GRAVITY), ("chest_tube_section", HANGING), ("chest_tube", NO_GRAVITY)],
    ids=["light", "heavy", "full"],
)
def test_with_all_terms_it_is_the_complete_balance(reference: str, gravity: Array) -> None:
    """With the next joint's moment, the balance across and the rods' true forces: 1e-6 deg under loading.

    Of the full robot without weight: a joint's printed balance knows its own plane only.
    """
    robot = load_robot(reference)
    tension = np.zeros((3, len(robot.tendons)))
    tension[:, 0] = [3.0, 15.0, 45.0]
    whole = printed(robot, pulls(tension), gravity, Terms(True, True, True))
    for one, row in zip(whole.postures, tension, strict=True):
        other = complete(robot, pulls([row]), gravity).postures[0]
        assert np.degrees(np.abs(one.joint_angles - other.joint_angles)).max() < 1e-6


def test_the_next_joints_moment_ends_the_buckling_of_the_even_joints() -> None:
    """With that moment nothing buckles, whatever else is added; without it even joints do.

    One exception: the balance across alone hides the buckling, one fault against another, for with the
    rods' span forces beside it the even joints buckle more than ever.
    """
    for across, span_forces in itertools.product([False, True], repeat=2):
        with_it, _ = solve_printed(SECTION, pulls([6.0]), NO_GRAVITY, Terms(True, across, span_forces))
        without, _ = solve_printed(SECTION, pulls([6.0]), NO_GRAVITY, Terms(False, across, span_forces))
        assert np.median(np.degrees(with_it[0, 1::2])) > 0.0
        hidden = across and not span_forces
        assert bool(np.median(np.degrees(without[0, 1::2])) > -1.0) is hidden


@pytest.mark.parametrize("terms", [Terms(*flags) for flags in itertools.product([False, True], repeat=3)])
def test_derivative_is_that_of_the_balance(terms: Terms) -> None:
    """The Jacobian agrees with central differences, for every choice of terms and loads in all directions."""
    draw, e = np.random.default_rng(2), 1e-6
    for chain in (SECTION, rolling_chain(load_robot("chest_tube"))):
        theta = draw.uniform(0.5 * chain.low, 0.5 * chain.high, (3, chain.joints))
        way = draw.normal(size=theta.shape)
        acting = (
            draw.uniform(0, 20, (3, chain.pulled)),
            np.array([1.0, 2.0, -9.0]),
            draw.normal(size=(3, 3)) * 0.1,
            draw.normal(size=(3, 3)) * 1e-3,
            terms,
        )
        ahead, behind = (printed_balance(chain, theta + s * e * way, *acting).unbalanced for s in (1, -1))
        exact = printed_balance(chain, theta, *acting).jacobian
        along = np.einsum("bij,bj->bi", exact, way)
        np.testing.assert_allclose(along, (ahead - behind) / (2 * e), atol=1e-6 * np.abs(exact).max())


def test_normal_force_has_a_limit_without_friction() -> None:
    """Eq. 7, f / mu, goes to F phi as mu goes to zero, where it is 0/0 as printed; there f is zero."""
    theta = np.full((1, 15), 0.1)
    turn, _ = rods.turns(SECTION, theta)
    forces = {
        mu: rod_tensions(
            rolling_chain(load_robot("chest_tube_section", (f"friction.mu={mu}",))), theta, np.array([[10.0]])
        )
        for mu in (0.0, 1e-6)
    }
    np.testing.assert_allclose(forces[0.0].normal.value[0, 0], 10.0 * turn[0, 0], rtol=1e-12)
    np.testing.assert_allclose(forces[1e-6].normal.value, forces[0.0].normal.value, rtol=1e-5)
    np.testing.assert_array_equal(forces[0.0].above.value, forces[0.0].below.value)
    frictionless = solve_printed(
        rolling_chain(load_robot("chest_tube_section", ("friction.mu=0",))), pulls([10.0]), NO_GRAVITY
    )
    nearly = solve_printed(
        rolling_chain(load_robot("chest_tube_section", ("friction.mu=1e-7",))), pulls([10.0]), NO_GRAVITY
    )
    np.testing.assert_allclose(frictionless[0], nearly[0], atol=1e-5)


def test_printed_balance_has_no_memory() -> None:
    """A row's posture does not depend on the rows before it."""
    robot = load_robot("chest_tube_section")
    there, back = printed(robot, pulls([10.0, 40.0, 10.0]), HANGING).postures[::2]
    np.testing.assert_allclose(there.p_w, back.p_w, atol=1e-12)


def test_constant_curvature_of_one_joint_is_exact_but_for_its_arc() -> None:
    """A segment of one joint bends as in the complete balance without friction; it is drawn as an arc."""
    one = ("segments.section.joints=1", "segments.section.length_mm=15", "friction.mu=0")
    robot = load_robot("chest_tube_section", one)
    for force in (5.0, 40.0):
        arc = pcc(robot, pulls([force]), NO_GRAVITY).postures[0]
        whole = complete(robot, pulls([force]), NO_GRAVITY).postures[0]
        assert arc.joint_angles == pytest.approx(whole.joint_angles, abs=1e-9)
        bend = float(arc.joint_angles[0])
        x, _ = quad(lambda s, bend=bend: np.sin(bend * s / 0.015), 0.0, 0.015)
        z, _ = quad(lambda s, bend=bend: np.cos(bend * s / 0.015), 0.0, 0.015)
        assert arc.p_w[0] == pytest.approx([x, 0.0, z])


def test_constant_curvature_bends_every_joint_of_a_segment_alike() -> None:
    """One angle a segment and plane; orientations turn evenly; it bends more than a robot that rubs."""
    robot = load_robot("chest_tube")
    tension = np.zeros((1, 8))
    tension[0, [4, 6]] = 10.0  # tip right and front
    run = pcc(robot, pulls(tension), NO_GRAVITY)
    posture = run.postures[0]
    assert run.residual.max() < 1e-12
    assert np.ptp(posture.joint_angles[:15]) == 0.0
    assert np.ptp(posture.joint_angles[18::2]) == 0.0 == np.ptp(posture.joint_angles[19::2])
    assert posture.joint_angles[18] > 0.0 < posture.joint_angles[19]
    turns = np.swapaxes(posture.R_w[:-1], 1, 2) @ posture.R_w[1:]
    np.testing.assert_allclose(turns[1:14], np.tile(turns[0], (13, 1, 1)), atol=1e-12)
    steps = np.linalg.norm(np.diff(posture.p_w, axis=0), axis=1)
    assert np.all(steps < 15e-3)
    section = load_robot("chest_tube_section")
    bend = [
        model(section, pulls([20.0]), NO_GRAVITY).postures[0].joint_angles.sum() for model in (pcc, complete)
    ]
    assert bend[0] > bend[1]


def test_constant_curvature_refuses_what_it_does_not_have() -> None:
    """Weight and tip loads end in one line that names the row and the model that has them."""
    robot = load_robot("chest_tube_section")
    with pytest.raises(InputError, match="'pcc': has no weight, so gravity must be 0; take 'complete'"):
        pcc(robot, pulls([1.0]), HANGING)
    with pytest.raises(InputError, match=r"row 1 \(time_s = 0\): static model 'pcc': has no tip force"):
        pcc(robot, pulls([1.0], force_tip=(0.1, 0, 0)), NO_GRAVITY)
