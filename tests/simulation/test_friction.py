"""Claims about the tendons' friction in the simulation."""

from __future__ import annotations

import numpy as np
import pytest
from drive import ANTAGONISTIC, PARTIAL, SINGLE, rows_to_inputs, tips_mm
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear, minimize

from catheter_sim.catalogue import load_robot
from catheter_sim.mechanics import tendons
from catheter_sim.mechanics.capstan import (
    NUMBERS,
    capstan_factors,
    new_block,
    slip_as_before,
    solve_tensions,
    span_tensions,
    start_from_last_change,
)
from catheter_sim.mechanics.tendons import TendonRows
from catheter_sim.simulation import friction
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator

pytestmark = pytest.mark.slow

NO_GRAVITY = np.zeros(3)
PUSHES = [(0, 0, 0), (0.02, 0, 0), (0.05, 0, 0), (0, 0, 0), (-0.03, 0, 0), (-0.06, 0, 0), (0, 0, 0)]


def section(*changes):
    return load_robot("neuroendoscope_section", changes)


def hold(simulator, tension):
    for i in range(200):
        simulator.set_inputs(np.array(tension) * (i + 1) / 200)
        simulator.step()
    simulator.settle()


def span_problem(rng, count):
    return {
        "entering": rng.uniform(0.0, 1.0),
        "factor": np.exp(rng.uniform(0.0, 0.1, count)),
        "rate": rng.normal(0.0, 0.1, count),
        "response": rng.uniform(0.2, 2.0, count),
        "tension": rng.uniform(0.1, 1.0, count),
    }


def solved(case, tension, rate=None, slip=None, drawn=None):
    """Return what `span_tensions` finds, where it slips, and the actuator's tension.

    With `slip`, what `slip_as_before` finds; None if that is nothing.
    """
    count = len(tension)
    solve = span_tensions if slip is None else slip_as_before
    slip = np.zeros(count, dtype=np.int8) if slip is None else slip
    found, scratch = np.zeros(count), np.zeros((3, 2 * count + 2))
    factor, rate = case["factor"], case["rate"] if rate is None else rate
    first = [case["entering"], case.get("drive", 0.0)]
    rates = [np.full(count, 2.0), 0.5 * rate]  # as a product, of which nothing is rounded
    if solve is span_tensions:
        first.append(case["entering"] if drawn is None else drawn)
        rates = [rate]
    reached = solve(
        *first, factor, 1.0 / factor, *rates, case["response"], count, tension, found, slip, scratch
    )
    return (found, slip, reached) if reached >= 0.0 else (None, slip, reached)


def settled(case):
    """Return the tensions at which `span_tensions` leaves all as it is, and where the tendon slips then."""
    tension, old, drawn = case["tension"], case["tension"], None
    for _ in range(500):
        rate = case["rate"] - case["response"] * (tension - old)
        found, slip, drawn = solved(case, tension, rate, drawn=drawn)
        if np.abs(found - tension).max() < 1e-13:
            return found, slip
        tension = found
    raise AssertionError("no end")


def test_span_tensions_minimise_their_cost():
    """The chain solver's tensions are those of a general constrained optimiser."""
    rng = np.random.default_rng(7)
    for count in (1, 2, 5, 12):
        case = span_problem(rng, count)
        entering, factor, old = case["entering"], case["factor"], case["tension"]
        # Bounds frozen at the old tensions, as the dynamic programme has them.
        before = np.concatenate([[entering], old[:-1]])
        low, high = before / factor - before, before * factor - before

        def cost(t, case=case, old=old):
            return np.sum(case["response"] * (t - old) ** 2 / 2 - case["rate"] * (t - old))

        def slack(t, entering=entering, low=low, high=high):
            steps = np.diff(np.concatenate([[entering], t]))
            return np.concatenate([steps - low, high - steps])

        expected = minimize(
            cost,
            np.full(count, entering),
            constraints={"type": "ineq", "fun": slack},
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 500},
        ).x
        # With bounds that do not depend on the solution, the solver must agree: freeze them by
        # iterating from its own solution.
        tension, _ = settled(case)
        before = np.concatenate([[entering], tension[:-1]])
        ratio = tension / before
        assert (ratio <= factor * (1 + 1e-9)).all()
        assert (ratio >= 1 / factor * (1 - 1e-9)).all()
        # Sliding speeds, from the tip: zero where it sticks, outward where the tension rises.
        speed = np.cumsum((case["rate"] - case["response"] * (tension - old))[::-1])[::-1]
        slips_out, slips_in = ratio > factor * (1 - 1e-9), ratio < 1 / factor * (1 + 1e-9)
        stuck = ~slips_out & ~slips_in
        assert np.abs(speed[stuck]).max(initial=0.0) < 1e-8
        assert (speed[slips_out] > -1e-8).all()
        assert (speed[slips_in] < 1e-8).all()
        # The first pass, with the same frozen bounds, is the optimiser's solution wherever the
        # relative bounds of the forward pass coincide with them.
        if count == 1:
            first, _, _ = solved(case, old)
            assert first == pytest.approx(expected, abs=1e-6)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 30))
def test_capstan_bounds_always_hold(seed, count):
    """Whatever the motion, no tension changes by more than the capstan factor over a hole."""
    case = span_problem(np.random.default_rng(seed), count)
    tension, _, _ = solved(case, case["tension"])
    ratio = tension / np.concatenate([[case["entering"]], tension[:-1]])
    assert (ratio <= case["factor"] * (1 + 1e-12)).all()
    assert (ratio >= 1 / case["factor"] * (1 - 1e-12)).all()


@settings(max_examples=200, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 30),
    drive=st.sampled_from((0.0, 0.3)),
    wrong=st.booleans(),
)
def test_slipping_as_before_is_believed_only_where_it_is_right(seed, count, drive, wrong):
    """One solution with the right slips, from wherever it starts; with wrong ones that solution or none.

    Of a tendon that the actuator leaves slack it says nothing.
    """
    rng = np.random.default_rng(seed)
    case = span_problem(rng, count) | {"drive": drive}
    expected, slip = settled(case)
    if wrong:
        slip = rng.integers(-1, 2, count)
    start = case["tension"] * rng.uniform(0.5, 2.0, count)
    rate = case["rate"] - case["response"] * (start - case["tension"])
    found, _, _ = solved(case, start, rate, slip)
    assert found is not None or wrong or not expected.any()
    if found is not None:
        assert found == pytest.approx(expected, rel=1e-9)


def test_tensions_go_on_only_as_far_as_what_is_pulled_does():
    """A step like the last one, half of one, none, one back; none below zero, none of a tendon left alone."""
    ends = np.array([2, 0])
    for share, expected in ((1.0, (1.5, 0.0)), (0.5, (1.25, 0.05)), (0.0, (1.0, 0.1)), (-1.0, (1.0, 0.1))):
        entering, tension = np.array([2.0 + 0.4 * share, 1.0]), np.array([[1.0, 0.1], [1.0, 1.0]])
        past = np.array([[0.5, -0.1, 2.0, 0.4], [0.5, 0.5, 1.0, 0.0]])
        start_from_last_change(entering, ends, tension, past)
        assert tension == pytest.approx(np.array([expected, (1.0, 1.0)]), abs=1e-12)
        assert past == pytest.approx(
            np.array([[1.0, 0.1, entering[0], 0.4 * share], [1.0, 1.0, 1.0, 0.0]]), abs=1e-12
        )


def test_passes_end_near_enough_to_where_they_would_end(monkeypatch):
    """Eight rods pulled to and fro at random: against passes to 1e-9 of the tension, no tip by 0.03 mm."""
    robot = load_robot("chest_tube")

    def moved():
        simulator, rng, tips = Simulator(robot), np.random.default_rng(0), []
        level = np.zeros(len(robot.tendons))
        for _ in range(15):
            before = level
            level = np.clip(level + rng.uniform(-2.0, 3.0, len(level)), 0.0, 20.0)
            for share in np.linspace(0.01, 1.0, 100):
                simulator.set_inputs(before + share * (level - before))
                simulator.step()
            tips.append(simulator.posture().p_w[-1])
        return np.array(tips)

    ours = moved()
    monkeypatch.setattr(friction, "SWEEPS", 1000)
    monkeypatch.setattr(friction, "SWEEP_TOLERANCE", 1e-9)
    ended = moved()
    assert np.ptp(ended, axis=0).max() > 0.02
    assert np.linalg.norm(ours - ended, axis=1).max() < 3e-5


@pytest.mark.parametrize("largest", [0.09, 0.11, 3.0])
def test_tension_grows_exponentially_over_small_and_large_turns(largest):
    """exp(mu turn) and one over it to four roundings, on either side of where the series ends."""
    turn = np.linspace(0.0, 2.0 * largest, 101)
    factor, shrink = np.full(101, np.nan), np.full(101, np.nan)
    capstan_factors(0.5, turn, 100, factor, shrink)
    assert factor[:-1] == pytest.approx(np.exp(0.5 * turn[:-1]), rel=1e-15, abs=0.0)
    assert shrink[:-1] == pytest.approx(np.exp(-0.5 * turn[:-1]), rel=1e-15, abs=0.0)
    assert np.isnan([factor[-1], shrink[-1]]).all(), "beyond the count"


def test_turns_in_space_are_those_in_the_plane():
    """The turns computed from the holes' positions equal half the sum of adjoining cell angles."""
    robot = section()
    simulator = Simulator(robot)
    hold(simulator, (0.3, 0.1))
    simulator.posture()
    angles = simulator.data.qpos.copy()
    turn = np.zeros((1, 30))
    tendons.planar_turns(angles, np.arange(30), turn)
    sites = np.array([[simulator.model.site(f"hole_right_{k}").id for k in range(31)]])
    spatial = np.zeros((1, 30))
    along = np.array([0.0, 0.0, 1.0])
    tendons.spatial_turns(simulator.data.site_xpos, sites, np.array([30]), along, spatial)
    assert spatial == pytest.approx(turn, abs=1e-7)


def test_arching_follows_the_capstan_equation():
    """Pulled once from rest, the last span's tension is T exp(-mu Phi)."""
    posture = simulate(section(), rows_to_inputs([(0.4, 0.0)]), NO_GRAVITY, ramp_s=4.0).postures[0]
    turned = posture.joint_angles.sum() - posture.joint_angles[-1] / 2.0
    assert posture.tendon_tension[0, -1] == pytest.approx(0.4 * np.exp(-0.3 * turned), rel=1e-4)


def test_without_friction_the_tension_is_the_same_everywhere():
    """mu = 0: every span carries the actuator's tension, and the robot retraces its path."""
    run = simulate(section("friction.mu=0"), rows_to_inputs(SINGLE), NO_GRAVITY)
    for posture, row in zip(run.postures, SINGLE, strict=True):
        assert posture.tendon_tension[0] == pytest.approx(row[0])
    tips = tips_mm(run)
    assert tips[2] == pytest.approx(tips[4], abs=0.01)  # what counts as at rest leaves 0.003 mm


def test_held_posture_does_not_creep():
    """Sixty seconds under constant tension move the tip by less than 0.05 mm (in fact 0.001)."""
    simulator = Simulator(section(), inertia=False)
    hold(simulator, (0.4, 0.0))
    before = simulator.posture().p_w[-1]
    simulator.step(round(60.0 / simulator.model.opt.timestep))
    assert np.linalg.norm(simulator.posture().p_w[-1] - before) < 1e-6


def test_mirrored_tensions_give_the_mirrored_robot():
    """Right and left are equal: exchanging the tensions mirrors the posture, history included."""
    rows = np.array(PARTIAL)
    right = tips_mm(simulate(section(), rows_to_inputs(rows), NO_GRAVITY))
    left = tips_mm(simulate(section(), rows_to_inputs(rows[:, ::-1]), NO_GRAVITY))
    # Which of two stuck tendons gives way first is not fixed by statics: 0.05 mm is what it leaves.
    assert left * np.array([-1.0, 1.0, 1.0]) == pytest.approx(right, abs=0.05)


@pytest.mark.parametrize("rows", [SINGLE, ANTAGONISTIC, PARTIAL], ids=["single", "antagonistic", "partial"])
def test_posture_does_not_depend_on_step_or_ramp(rows):
    """A quasi-static answer: half the time step, or twice the ramp, moves no tip by 0.05 mm."""
    base = tips_mm(simulate(section(), rows_to_inputs(rows), NO_GRAVITY))
    finer = tips_mm(simulate(section("dynamics.timestep_s=0.0025"), rows_to_inputs(rows), NO_GRAVITY))
    slower = tips_mm(simulate(section(), rows_to_inputs(rows), NO_GRAVITY, ramp_s=2.0))
    assert np.linalg.norm(finer - base, axis=1).max() < 0.05
    assert np.linalg.norm(slower - base, axis=1).max() < 0.05


@pytest.mark.parametrize(
    ("rows", "force"),
    [
        (SINGLE, None),
        pytest.param(ANTAGONISTIC, None, marks=pytest.mark.long),
        pytest.param(PARTIAL, None, marks=pytest.mark.long),
        ([(0.3, 0.1)] * 7, PUSHES),
    ],
    ids=["single", "antagonistic", "partial", "tip pushed, tensions held"],
)
def test_shipped_friction_agrees_with_the_nested_reference(rows, force):
    """Shipped law against one element per hole: at most 0.1 mm at the tip, in every row."""
    inputs = rows_to_inputs(rows, force=force)
    ours = tips_mm(simulate(section(), inputs, NO_GRAVITY))
    reference = tips_mm(simulate(section(), inputs, NO_GRAVITY, friction="nested", ramp_s=2.0))
    assert np.linalg.norm(ours - reference, axis=1).max() < 0.1


@pytest.mark.long
def test_tip_pushed_while_the_tendons_are_held_in_place():
    """Displacements held, tip pushed: against the nested reference at a fine step, at most 0.1 mm."""
    inputs = rows_to_inputs([(1e-3, -1e-3)] * 7, "displacement", PUSHES)
    ours = tips_mm(simulate(section(), inputs, NO_GRAVITY))
    # The reference chatters on a stiffly held tendon; a fifth of the step calms it.
    reference = tips_mm(
        simulate(section("dynamics.timestep_s=0.001"), inputs, NO_GRAVITY, friction="nested", ramp_s=2.0)
    )
    assert np.linalg.norm(ours - reference, axis=1).max() < 0.1


@pytest.mark.long
def test_two_sections_agree_with_the_nested_reference():
    """S shapes of the full robot, distal tendons slipping through the bent proximal section."""
    rows = [
        (0, 0, 0.15, 0.15, 0, 0),
        (0.2, 0, 0.15, 0.15, 0, 0),
        (0.2, 0.1, 0.15, 0.15, 0, 0),
        (0.05, 0.3, 0.15, 0.15, 0, 0),
        (0.05, 0.3, 0.05, 0.05, 0.1, 0.1),
    ]
    robot = load_robot("neuroendoscope")
    ours = tips_mm(simulate(robot, rows_to_inputs(rows), NO_GRAVITY))
    reference = tips_mm(simulate(robot, rows_to_inputs(rows), NO_GRAVITY, friction="nested"))
    assert np.linalg.norm(ours - reference, axis=1).max() < 0.1


@pytest.mark.parametrize(("name", "most_N"), [("chest_tube", 20.0), ("neuroendoscope", 0.3)])
def test_tendons_whose_joints_lie_in_line_are_only_faster(name, most_N, monkeypatch):
    """Where nothing is known of the degrees of freedom, the shape is the same to the last bit."""

    def bent():
        simulator = Simulator(load_robot(name))
        for share in (0.5, 1.0, 0.2):
            simulator.set_inputs(share * np.linspace(0.0, most_N, len(simulator.robot.tendons)))
            simulator.step(50)
        return simulator.data.qpos.copy()

    find, found = TendonRows.lines, []
    monkeypatch.setattr(TendonRows, "lines", lambda *given: found.append(find(*given)) or found[0])
    known = bent()
    assert (found[0] >= 0).all(), "all of this robot's are in line"
    monkeypatch.setattr(TendonRows, "lines", lambda self, span, ends: np.full(len(ends), -1))
    assert np.abs(known).sum() > 0.1
    assert (bent() == known).all()


@pytest.mark.parametrize("line", [0, -1], ids=["simple", "any"])
@pytest.mark.parametrize("seed", range(12))
def test_tendons_on_stiff_drives_come_to_their_common_optimum(seed, line):
    """Without friction a bounded least-squares problem: antagonists, one slack, next to no joint in between.

    It is found of tendons whose degrees of freedom are known to lie in line, and of those of which nothing is
    known. What one tendon's tension does to the others through the joints is up to 1e5 times what its drive
    does.
    """
    generator = np.random.default_rng(seed)
    t, n = 4, 3
    gain = 10.0 ** generator.uniform(-3.0, 0.0, n)  # of each degree of freedom
    arm = generator.normal(size=(n, t))
    arm[:, 2] = -arm[:, 0] * (1.0 + 1e-3 * generator.normal())
    drive = 10.0 ** generator.uniform(2.0, 5.0, t)
    entering, velocity = 100.0 * generator.normal(size=t), 0.1 * generator.normal(size=n)
    zeros, applied = np.zeros(n), np.zeros(n)
    starts, entries = np.arange(0, n * t + 1, n, dtype=np.uint64), np.arange(n * t, dtype=np.uint64)
    columns = np.tile(np.arange(n, dtype=np.uint64), t)
    block, history = new_block((0.0, 20.0, 1e-4), t, n, n * t, n), np.zeros((3, t, n + 2))
    block[NUMBERS : NUMBERS + t + n] = [*drive, *gain]
    history[0] = 50.0
    counts = np.stack([np.full(t, n), np.full(t, n), np.full(t, line)])
    places = np.concatenate([starts, entries, columns, columns])
    solve_tensions(
        *(block, history, counts, places, arm.T.ravel(), entering, np.zeros((t, n)), velocity),
        *(zeros, zeros, zeros, applied),
    )
    tension = history[0, :, :n]
    # Velocities after the step and actuators' tensions are driven apart as little as possible.
    found = lsq_linear(
        np.concatenate([np.sqrt(gain)[:, None] * arm, np.diag(drive**-0.5)]),
        np.concatenate([velocity / np.sqrt(gain), entering * drive**-0.5]),
        bounds=(0.0, np.inf),
        tol=1e-14,
    ).x
    assert tension == pytest.approx(np.repeat(found[:, None], n, axis=1), abs=1e-3 * np.abs(entering).max())


def test_held_catheter_has_no_more_friction_than_its_tendons_tensions_allow():
    """Pairs on stiff cables, bent to and fro and held: what is slack carries nothing, the rest by the law."""
    robot = load_robot("mitral_4dof", ["friction.mu=0.064"])
    simulator = Simulator(robot, "displacement")
    rubbing = simulator.laws.friction
    for row in ((3.0, 0.0, 0.0, 10.0), (3.0, 2.0, 0.0, 10.0), (1.0, 2.0, 0.5, 20.0), (1.0, -2.0, 0.5, 20.0)):
        simulator.set_inputs(1e-3 * np.array(row))
        assert simulator.settle()
        drawn = -simulator.data.actuator_force[simulator.pulls.actuators]
        spans = rubbing.span_tension(simulator.data, drawn)
        most = np.exp(rubbing.mu * rubbing.turns(simulator.data, rubbing.tendons.ends).sum(axis=1))
        for tension, at_drive, bound in zip(spans, drawn, most, strict=True):
            last = tension[np.isfinite(tension)][-1]
            assert at_drive / bound - 0.1 <= last <= at_drive * bound + 0.1
        assert (drawn > 1.0).sum() == np.count_nonzero(row[:2]), "one of each bent pair is taut"
