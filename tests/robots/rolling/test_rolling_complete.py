"""Claims about the complete balance of rolling joints: the compiled Newton-Euler one and virtual work."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rolling_cases import HANGING, NO_GRAVITY, SHAPE_TABLE, pulls
from scipy.optimize import minimize

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.channels import joint_names
from catheter_sim.core.inputs import LinkForce
from catheter_sim.core.statics import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling import complete as history
from catheter_sim.robots.rolling import complete as rods
from catheter_sim.robots.rolling.complete import (
    LinkLoads,
    balance,
    complete,
    equilibrium,
    frames,
    loads,
    reactions,
    solve_history,
    solve_history_by_virtual_work,
    solve_loaded,
    virtual_work,
)
from catheter_sim.robots.rolling.description import RollingChain, rolling_chain
from catheter_sim.robots.rolling.kernels import ChainBalance, RodPulls, evaluate, pack, workspace
from catheter_sim.theory.static_models import STATIC_MODELS

ROBOTS = ("chest_tube_section", "chest_tube_section@prototype", "chest_tube")
TENSIONS = [row[0] for row in SHAPE_TABLE]
GRAVITIES = {"none": NO_GRAVITY, "down": np.array([0, 0, -9.81]), "across": np.array([9.81, 0, 0])}


def chain_of(reference: str, *settings: str) -> RollingChain:
    """Return a robot as arrays."""
    return rolling_chain(load_robot(reference, settings))


def angles(run: StaticRun) -> Array:
    """Return the joints' angles of every row [deg]."""
    return np.degrees([posture.joint_angles for posture in run.postures])


def tips(run: StaticRun) -> Array:
    """Return the tips of every row [mm]."""
    return np.array([posture.p_w[-1] for posture in run.postures]) * 1e3


def something(chain: RollingChain, seed: int) -> tuple[Array, Array, Array, LinkLoads, Array]:
    """Return drawn angles, tensions, history, loads in all directions, and compressed lengths."""
    draw = np.random.default_rng(seed)
    acting = loads(
        chain,
        np.array([3.0, 2.0, -9.81]),
        np.array([0.1, 0.2, -0.3]),
        np.array([1e-3, 2e-3, 5e-4]),
        [LinkForce(2, (1e-3, 2e-3, 5e-3), (0.2, -0.1, 0.05))],
    )
    theta = draw.uniform(0.6 * chain.low, 0.6 * chain.high)
    drive, kept = draw.uniform(0, 20, chain.pulled), draw.uniform(0, 20, (chain.pulled, chain.joints))
    return theta, drive, kept, acting, chain.link_length * draw.uniform(0.95, 1.0, chain.joints)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["complete", "virtual_work"])
@pytest.mark.parametrize("weight", [False, True])
def test_table_of_the_section(model: str, weight: bool) -> None:
    """Loading, unloading, reloading: every row of the independent reference within 0.01 mm."""
    robot = load_robot("chest_tube_section")
    run = STATIC_MODELS[model].solve(robot, pulls(TENSIONS), HANGING if weight else NO_GRAVITY)
    for posture, (_, light, heavy) in zip(run.postures, SHAPE_TABLE, strict=True):
        p = posture.p_w * 1e3
        ours = (p[14, 0], p[14, 2]) if weight else (p[14, 0], p[14, 2], p[5, 0], p[5, 2])
        assert ours == pytest.approx(heavy if weight else light, abs=0.01)
    assert run.residual.max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize(
    ("reference", "gravity"),
    [
        *(("chest_tube_section", gravity) for gravity in GRAVITIES),
        ("chest_tube_section@prototype", "down"),
        *(pytest.param("chest_tube", name, marks=pytest.mark.slow) for name in ("across", "down")),
    ],
)
def test_newton_euler_and_virtual_work_agree(reference: str, gravity: str) -> None:
    """Both balances give each joint the same angle within 1e-6 deg, with friction, weight and tip load.

    So they do by a rule on tensions, each along a way of its own.
    """
    robot = load_robot(reference)
    tension = np.zeros((4, len(robot.tendons)))
    tension[:, 0] = [5.0, 30.0, 10.0, 20.0]
    tension[1:, -1] += [3.0, 8.0, 2.0]
    inputs = pulls(tension, force_tip=(0.02, 0.01, -0.03), moment_tip=(1e-3, -1e-3, 0.0))
    one = complete(robot, inputs, GRAVITIES[gravity])
    other = virtual_work(robot, inputs, GRAVITIES[gravity])
    assert np.abs(angles(one) - angles(other)).max() < 1e-6
    assert np.abs(tips(one) - tips(other)).max() < 1e-6
    assert np.abs(angles(one)).max() > 5.0
    ours, theirs = (
        solve(rolling_chain(robot), inputs, GRAVITIES[gravity])
        for solve in (solve_history, solve_history_by_virtual_work)
    )
    assert np.degrees(np.abs(ours.theta - theirs.theta)).max() < 1e-6


@pytest.mark.parametrize("reference", ROBOTS)
def test_moments_left_are_the_same_in_three_ways(reference: str) -> None:
    """Away from equilibrium: compiled, link by link and by virtual work, at drawn postures and loads."""
    chain = chain_of(reference, "segments.0.stiffness_cubic_mm2=3000", "sleeve.bending_stiffness_N_mm2=400")
    packed = pack(chain)
    n, t = chain.joints, chain.pulled
    for seed in range(4):
        theta, drive, kept, acting, length = something(chain, seed)
        worked = balance(chain, theta, drive, kept, acting, length)
        by_link = reactions(chain, theta, worked.tension, acting, length)
        at_joint, above, value = np.empty((t, n)), np.empty((1, t, n)), np.empty(n)
        jacobian, lengths, work = np.empty((n, n)), length.copy(), workspace(n, t)
        found = ChainBalance(theta, lengths, at_joint, value)
        without, loaded = (
            RodPulls(drive, acting.link, acting.point, factor * acting.force, acting.tip_moment)
            for factor in (0.0, 1.0)
        )
        assert not evaluate(packed, 0.0, without, kept[None], theta, found, above, jacobian, work)
        assert not np.triu(jacobian, 1).any(), "without loads a joint feels nothing above it"
        lengths[:] = length
        assert evaluate(packed, 0.0, loaded, kept[None], theta, found, above, jacobian, work)
        size = np.abs(worked.unbalanced).max()
        np.testing.assert_allclose(by_link.unbalanced, worked.unbalanced, atol=1e-13 * size + 1e-14)
        np.testing.assert_allclose(value, worked.unbalanced, atol=1e-13 * size + 1e-14)
        np.testing.assert_allclose(jacobian, worked.jacobian, atol=1e-12 * np.abs(jacobian).max())
        np.testing.assert_allclose(at_joint, worked.tension.at_joint, rtol=1e-12)
        np.testing.assert_allclose(above[0], worked.tension.above, rtol=1e-12)
        np.testing.assert_allclose(lengths, worked.link_length, rtol=1e-12)


@pytest.mark.parametrize("reference", ROBOTS)
def test_derivative_is_that_of_the_moments(reference: str) -> None:
    """The Jacobian agrees with central differences: rods slipping and sticking, loads in all directions."""
    chain = chain_of(reference, "segments.0.stiffness_cubic_mm2=3000")
    rigid = replace(chain, link_stiffness=np.full(chain.joints, np.inf))
    draw, e = np.random.default_rng(8), 1e-6
    for seed in range(6):
        theta, *acting = something(rigid, seed)
        way = draw.normal(size=chain.joints)
        ahead, behind = (balance(rigid, theta + s * e * way, *acting).unbalanced for s in (1, -1))
        exact = balance(rigid, theta, *acting).jacobian
        np.testing.assert_allclose(exact @ way, (ahead - behind) / (2 * e), atol=1e-6 * np.abs(exact).max())


def test_batch_is_each_configuration_alone() -> None:
    """Virtual work solves a batch at once as one by one, and `solve_loaded` as rows loaded from rest."""
    chain = chain_of("chest_tube_section")
    tension = np.array([[20.0], [1.0], [45.0], [0.0], [20.0]])
    batch = solve_loaded(chain, tension, HANGING)
    alone = [solve_history(chain, pulls(row), HANGING).theta[0] for row in tension]
    np.testing.assert_allclose(batch.theta, alone, atol=1e-10)
    np.testing.assert_allclose(batch.at_joint[:, 0, 0], tension[:, 0])
    assert np.abs(batch.unbalanced).max() < 1e-12
    start = batch.theta + 0.01
    together = equilibrium(chain, tension, loads(chain, HANGING), start, np.zeros((5, 1, 15)))
    np.testing.assert_allclose(together.theta, batch.theta, atol=1e-10)


def test_without_weight_one_rod_pulls_at_the_base_as_hard_as_the_actuator() -> None:
    """The base's reaction is F0, along the rod, at every tension; with weight it carries that too."""
    chain = chain_of("chest_tube_section")
    for force in (5.0, 50.0):
        for gravity in (NO_GRAVITY, np.array([3.0, 0.0, -9.81])):
            solved = solve_history(chain, pulls([force]), gravity)
            acting = loads(chain, gravity)
            tension = rods.tensions(
                chain, np.array([force]), np.zeros((1, 15)), *rods.turns(chain, solved.theta[0])
            )
            carried = reactions(chain, solved.theta[0], tension, acting)
            assert np.abs(carried.unbalanced).max() < 1e-12
            span = rods.spans(chain, solved.theta[0])
            down = -np.array([span.across[0, 0], 0.0, span.along[0, 0]]) / span.length[0, 0]
            expected = -force * down - chain.mass.sum() * gravity
            np.testing.assert_allclose(carried.force[0], expected, atol=1e-10)
            if not gravity.any():
                assert np.linalg.norm(carried.force[0]) == pytest.approx(force, rel=1e-12)


def test_no_moment_crosses_a_planar_chain() -> None:
    """All reactions of the planar section lie in its plane and carry no moment about a joint's axis."""
    chain = chain_of("chest_tube_section")
    solved = solve_history(chain, pulls([30.0]), HANGING)
    tension = rods.tensions(chain, np.array([30.0]), np.zeros((1, 15)), *rods.turns(chain, solved.theta[0]))
    carried = reactions(chain, solved.theta[0], tension, loads(chain, HANGING))
    assert np.abs(carried.force[:, 1]).max() < 1e-12
    assert np.abs(carried.moment).max() < 1e-12


def energy_mm(angle: Array, force: float, weight: Array) -> float:
    """Return the potential energy [N mm] of the frictionless section, from rolled points alone.

    Everything in mm and N. The elastic energy of a rod is the integral of EI sin(t) / h(t) dt, by
    Gauss's rule; heights, spans and centres of mass come from turning points about the arcs' centres.
    """
    nodes, weights = np.polynomial.legendre.leggauss(24)
    total, tilt, face = 0.0, 0.0, np.zeros(2)
    for k, theta in enumerate(angle):
        odd = k % 2 == 0
        arcs = {1: (6.7, 3.0) if odd else (2.275, 1.0), -1: (2.275, 1.0) if odd else (6.7, 3.0)}
        line = -1.0 if odd else 1.0

        def place(t: Array, x: float, z: float, arcs: dict[int, tuple[float, float]] = arcs) -> Array:
            radius = np.where(t >= 0, arcs[1][0], arcs[-1][0])
            return np.array(
                [
                    radius * t + x * np.cos(t) + (z - radius) * np.sin(t),
                    radius - x * np.sin(t) + (z - radius) * np.cos(t),
                ]
            )

        for side in (1, -1):
            radius, arm = arcs[side]
            mouth = radius - np.sqrt(radius**2 - arm**2)
            t = 0.5 * theta * (nodes + 1.0)
            height = place(t, side * arm, mouth)[1]
            total += 25.6 * 0.5 * theta * float(weights @ (np.sin(t) / height))
            if side == 1:
                x, z = place(np.array(theta), arm, mouth)
                total += force * float(np.hypot(x - arm, z))
        turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
        centre = face + turn @ (np.array([line, 0.0]) + place(np.array(theta), -line, 15.0 - 7.3))
        total -= float(weight @ centre)
        face = face + turn @ (np.array([line, 0.0]) + place(np.array(theta), -line, 15.0))
        tilt += theta
    return total


@pytest.mark.slow
@pytest.mark.parametrize(
    ("force", "gravity"),
    [(8.0, HANGING), pytest.param(30.0, np.array([9.81, 0.0, 0.0]), marks=pytest.mark.slow)],
)
def test_energy_is_least_at_the_equilibrium(force: float, gravity: Array) -> None:
    """Without friction, minimising the energy from the straight robot ends within 1e-4 deg of it."""
    robot = load_robot("chest_tube_section", ("friction.mu=0",))
    weight = 0.38e-3 * gravity[[0, 2]]

    def slope(angle: Array) -> Array:
        e = 1e-5
        return np.array(
            [
                (energy_mm(angle + e * row, force, weight) - energy_mm(angle - e * row, force, weight))
                / (2 * e)
                for row in np.eye(15)
            ]
        )

    start = np.full(15, 0.1)
    found = minimize(
        energy_mm, start, (force, weight), method="L-BFGS-B", jac=lambda a, *_: slope(a),
        bounds=[(-0.4, 0.44)] * 15, options={"ftol": 1e-16, "gtol": 1e-8, "maxiter": 500},
    )  # fmt: skip
    expected = angles(complete(robot, pulls([force]), gravity))[0]
    assert np.degrees(found.x) == pytest.approx(expected, abs=1e-4)


def test_friction_interval_bounds_every_tension() -> None:
    """There and back the ratio across each link stays in [e^-mu|phi|, e^mu|phi|], both ends met."""
    chain = chain_of("chest_tube_section")
    solved = solve_history(chain, pulls([10.0, 40.0, 30.0, 5.0]), NO_GRAVITY)
    turn, _ = rods.turns(chain, solved.theta)
    ratio = np.log(solved.at_joint[:, 0, 1:] / solved.at_joint[:, 0, :-1]) / (
        chain.mu * np.abs(turn[:, 0, :-1])
    )
    assert np.abs(ratio).max() < 1.0 + 1e-9
    np.testing.assert_allclose(ratio[:2], -1.0)
    assert ratio[2].min() < 0.0 < ratio[2].max()  # the first links have slipped back, the last still stick
    assert ratio[3, 0] == pytest.approx(1.0)


def test_friction_goes_with_mu() -> None:
    """As mu goes to zero the postures go to those of mu = 0, where unloading retraces loading."""
    there_and_back = pulls([10.0, 40.0, 10.0, 0.0])

    def tip(mu: float) -> Array:
        return tips(
            complete(load_robot("chest_tube_section", (f"friction.mu={mu}",)), there_and_back, HANGING)
        )

    none, little, less = tip(0.0), tip(1e-3), tip(1e-4)
    assert np.abs(none[0] - none[2]).max() < 1e-6
    assert np.abs(less - none).max() < 0.11 * np.abs(little - none).max()
    assert np.abs(little - none).max() < 0.5


@pytest.mark.parametrize("gravity", [NO_GRAVITY, HANGING], ids=["light", "heavy"])
def test_steps_and_rows_between_do_not_matter(gravity: Array, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half the step, or rows in between, move no tip by more than 5 um."""
    robot = load_robot("chest_tube_section")
    given = tips(complete(robot, pulls([20.0, 50.0, 30.0, 5.0]), gravity))
    between = pulls([20.0, 41.0, 50.0, 44.0, 30.0, 13.0, 5.0])
    assert np.abs(tips(complete(robot, between, gravity))[[0, 2, 4, 6]] - given).max() < 0.005
    monkeypatch.setattr(history, "STEP_BEND_RAD", 0.5 * history.STEP_BEND_RAD)
    assert np.abs(tips(complete(robot, pulls([20.0, 50.0, 30.0, 5.0]), gravity)) - given).max() < 0.005


def test_even_joints_do_not_buckle() -> None:
    """Under rods alone no joint ever bends away from the pulled rod, up to 60 N."""
    robot = load_robot("chest_tube_section")
    assert angles(complete(robot, pulls(np.linspace(0.0, 60.0, 31)), NO_GRAVITY)).min() > -1e-9


def test_force_on_a_link_is_the_same_wherever_its_line_is_entered() -> None:
    """Forces on links: on the last face it is the tip force; a base link's force moves only what it must."""
    robot = load_robot("chest_tube_section")
    tip = complete(robot, pulls([5.0], force_tip=(0.05, 0.0, 0.02)), HANGING)
    link = complete(robot, pulls([5.0]), HANGING, [LinkForce(15, (0.0, 0.0, 15e-3), (0.05, 0.0, 0.02))])
    assert angles(tip) == pytest.approx(angles(link), abs=1e-9)
    low = angles(complete(robot, pulls([5.0]), NO_GRAVITY, [LinkForce(1, (0, 0, 15e-3), (0.5, 0.0, 0.0))]))
    free = angles(complete(robot, pulls([5.0]), NO_GRAVITY))
    assert low[0, 0] > free[0, 0] + 0.5
    # Links beyond feel it through the friction in the first link alone.
    assert np.abs(low - free)[0, 1:].max() < 0.2 * (low - free)[0, 0]


def test_pulls_on_opposite_sides_are_mirror_images() -> None:
    """The full robot's tip rods front and back: the same tip with y mirrored, in x the same."""
    robot = load_robot("chest_tube")
    names = [rod.name for rod in robot.tendons]
    rows = np.zeros((2, len(names)))
    rows[0, names.index("tip_front")] = rows[1, names.index("tip_back")] = 20.0
    front, back = (tips(complete(robot, pulls(rows[i : i + 1]), GRAVITIES["down"]))[0] for i in (0, 1))
    assert front == pytest.approx(back * [1, -1, 1], abs=1e-8)
    assert front[1] > 20.0
    rows[0] = rows[1] = 0.0
    rows[0, names.index("base_right")] = 10.0
    bent = angles(complete(robot, pulls(rows[:1]), NO_GRAVITY))[0]
    assert bent[:15].min() > 0.0
    assert np.abs(bent[15:]).max() < 1e-9


def test_sleeve_and_scale_stiffen_a_rest_angle_bends() -> None:
    """A sleeve and a stiffness scale reduce the bend; without load the joints stand at their rest angle."""
    tension = pulls([10.0])

    def bend(*settings: str, inputs: object = tension) -> Array:
        return angles(complete(load_robot("chest_tube_section", settings), inputs, NO_GRAVITY))[0]

    plain = bend().sum()
    assert bend("sleeve.bending_stiffness_N_mm2=2000").sum() < 0.8 * plain
    assert bend("stiffness_scale=2").sum() < 0.8 * plain
    half = complete(load_robot("chest_tube_section", ("stiffness_scale=0.5",)), pulls([5.0]), NO_GRAVITY)
    assert angles(half)[0] == pytest.approx(bend(), abs=1e-9)  # tension over stiffness is what counts
    rest = bend("segments.section.rest_curvature_x_per_m=2", inputs=pulls([0.0]))
    assert rest == pytest.approx(np.full(15, np.degrees(2 * 0.015)), abs=1e-9)


def test_compressed_links_are_shorter_by_what_they_carry() -> None:
    """Straight under two equal rods each link shortens by (F1 + F2) / k; the mount gives way by the sum."""
    robot = load_robot("chest_tube", ("friction.mu=0", "segments.base.link_modulus_Pa=25e6"))
    chain = rolling_chain(robot)
    tension = np.zeros((1, chain.pulled))
    tension[0, :2] = 10.0  # the base's two rods
    # Antagonists do not leave asymmetric joints straight; the lengths follow from the tensions alone.
    solved = solve_history(chain, pulls(tension), NO_GRAVITY)
    assert solved.link_length[0, :15] == pytest.approx(15e-3 - 20.0 / chain.link_stiffness[:15], rel=1e-12)
    assert solved.link_length[0, 15:] == pytest.approx(15e-3)
    assert np.isinf(chain.link_stiffness[15:]).all()
    stiff = load_robot("chest_tube_section")
    soft = load_robot("chest_tube_section", ("mount.axial_stiffness_N_per_mm=10",))
    shift = tips(complete(soft, pulls([20.0]), NO_GRAVITY)) - tips(complete(stiff, pulls([20.0]), NO_GRAVITY))
    assert shift[0] == pytest.approx([0.0, 0.0, -2.0])


@pytest.mark.slow
def test_postures_are_complete() -> None:
    """One joint angle a joint, one tension a gap up to the rod's end and none beyond, proper rotations."""
    robot = load_robot("chest_tube")
    tension = np.full((1, 8), 3.0)
    for model in ("complete", "virtual_work", "printed", "pcc"):
        posture = STATIC_MODELS[model].solve(robot, pulls(tension), NO_GRAVITY).postures[0]
        assert posture.p_w.shape == (25, 3)
        assert posture.joint_angles.shape == (len(joint_names(robot)),)
        assert posture.actuator_tension == pytest.approx(np.full(8, 3.0))
        np.testing.assert_array_equal(
            np.isfinite(posture.tendon_tension).sum(axis=1), [15, 15, 18, 18] + [25] * 4
        )
        np.testing.assert_allclose(
            posture.R_w @ np.swapaxes(posture.R_w, 1, 2), np.tile(np.eye(3), (25, 1, 1)), atol=1e-12
        )
        assert np.linalg.det(posture.R_w) == pytest.approx(np.ones(25))


def test_models_know_their_robots_and_inputs() -> None:
    """Rolling joints have the four models and no other; displacements and what snaps end in one line."""
    robot = load_robot("chest_tube_section")
    fitting = {name for name, model in STATIC_MODELS.items() if model.applies_to(robot)}
    assert fitting == {"printed", "complete", "complete_sliding", "virtual_work", "pcc"}
    assert not any(STATIC_MODELS[name].applies_to(load_robot("spacer_disk")) for name in fitting)
    for name in fitting:
        with pytest.raises(InputError, match=f"'{name}': takes tension inputs only"):
            STATIC_MODELS[name].solve(robot, replace(pulls([1.0]), actuation="displacement"), NO_GRAVITY)
    pushed = pulls(np.zeros((1, 8)), force_tip=(0.0, 0.5, -1.0))
    with pytest.raises(InputError, match=r"row 1 \(time_s = 0\): static model 'complete': no posture"):
        complete(load_robot("chest_tube"), pushed, NO_GRAVITY)


def test_frames_of_a_batch_are_those_of_each() -> None:
    """Kinematics of a batch equal those of its members."""
    chain = chain_of("chest_tube")
    draw = np.random.default_rng(0)
    theta = draw.uniform(0.5 * chain.low, 0.5 * chain.high, (3, 2, chain.joints))
    batch = frames(chain, theta)
    np.testing.assert_allclose(batch.face[2, 1], frames(chain, theta[2, 1]).face, atol=1e-15)
    np.testing.assert_allclose(batch.R_w[0, 1], frames(chain, theta[0, 1]).R_w, atol=1e-15)


@pytest.mark.slow
def test_histories_of_both_solvers_agree_on_drawn_robots() -> None:
    """Drawn stiffness, friction, sleeves, loads: where one finds equilibria so does the other, the same."""
    draw = np.random.default_rng(3)
    compared = 0
    for _ in range(12):
        settings = (
            f"friction.mu={draw.uniform(0, 0.6):.3g}",
            f"stiffness_scale={draw.uniform(0.5, 3):.3g}",
            f"sleeve.bending_stiffness_N_mm2={draw.uniform(0, 500):.3g}",
        )
        chain = chain_of(str(draw.choice(ROBOTS)), *settings)
        tension = draw.uniform(0, 30, (3, chain.pulled)) * (draw.random(chain.pulled) < 0.5)
        inputs = pulls(tension, draw.normal(size=3) * 0.02)
        gravity = draw.normal(size=3) * 5.0
        results = []
        for solve in (solve_history, solve_history_by_virtual_work):
            try:
                results.append(solve(chain, inputs, gravity).theta)
            except InputError:
                results.append(None)
        assert (results[0] is None) == (results[1] is None)
        if results[0] is not None:
            np.testing.assert_allclose(results[0], results[1], atol=1e-8)
            compared += 1
    assert compared > 8
