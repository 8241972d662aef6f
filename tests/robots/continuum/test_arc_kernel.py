"""The compiled balance of arcs against the same equations written out, one robot and row at a time."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction, Mount
from catheter_sim.mechanics.arcs import points_on_arcs
from catheter_sim.robots.continuum.arc_kernels import PRE_SLIDING_M
from catheter_sim.robots.continuum.arcs import solve_rows
from catheter_sim.robots.continuum.constant_curvature import arc_robots, loads, places
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

ROWS = 8
GRAVITY = np.array([1.0, -2.0, -9.0])
_SMOOTHED_RAD = 1e-4  # |b| at zero in the friction's turn


def robot_of(generator: np.random.Generator, mu: float, stiffness_N_per_m: float = 6e3) -> ContinuumRobot:
    """Return a robot of two segments with everything that the balance knows."""
    segments = tuple(
        Segment(
            name,
            generator.uniform(0.04, 0.06),
            5,
            5e-3,
            generator.uniform(1.5e-3, 2.5e-3),
            3e-3,
            stiffness_cubic_m2=1e-4,
            stiffness_quintic_m4=1e-8,
            rest_curvature_x_per_m=generator.uniform(-2.0, 2.0),
            rest_curvature_y_per_m=generator.uniform(-2.0, 2.0),
        )
        for name in ("s0", "s1")
    )
    tendons = tuple(
        Tendon(f"{name}_{k}", 4e-3, math.radians(120.0 * k + turn), name, stiffness_N_per_m, 1.0)
        for name, turn in (("s0", 0.0), ("s1", 40.0))
        for k in range(3)
    )
    return ContinuumRobot(
        name="arc",
        description="",
        segments=segments,
        tendons=tendons,
        friction=Friction(mu),
        mount=Mount(4e4),
        actuation="displacement",
    )


def inputs_of(generator: np.random.Generator, actuation: str) -> Inputs:
    """Return a wandering history of six tendons with loads on the tip."""
    way = np.cumsum(generator.normal(size=(ROWS, 6)), axis=0)
    tendon = 0.4e-3 * way if actuation == "displacement" else np.abs(0.4 * way)
    force, moment = 0.05 * generator.normal(size=(ROWS, 3)), 1e-3 * generator.normal(size=(ROWS, 3))
    return Inputs(np.arange(float(ROWS)), actuation, tendon, force, moment)


def work_per_bend(robot: ContinuumRobot, bend: np.ndarray, force: np.ndarray, moment: np.ndarray):
    """Return the loads' virtual work by central differences of frames on the arcs, shape (S, 2) [N m]."""
    segment, fraction = places(robot)
    length = np.array([item.length_m for item in robot.segments])
    mass = np.array([item.mass_kg / 5 for item in robot.segments])[segment]
    weights, back = mass[:, None] * GRAVITY, 0.5 / 5 if robot.masses == "along" else 0.0
    result = np.zeros(bend.shape)
    step = 1e-5
    for index in np.ndindex(bend.shape):
        shift = np.zeros(bend.shape)
        shift[index] = step
        high, turned_high = points_on_arcs(bend + shift, length, segment, fraction)
        low, turned_low = points_on_arcs(bend - shift, length, segment, fraction)
        heavy_high, _ = points_on_arcs(bend + shift, length, segment, fraction - back)
        heavy_low, _ = points_on_arcs(bend - shift, length, segment, fraction - back)
        weighing = ((heavy_high - heavy_low) * weights).sum() + (high[-1] - low[-1]) @ force
        turn = turned_high[-1] @ turned_low[-1].T
        vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        result[index] = (weighing + vector @ moment) / (2.0 * step)
    return result


@pytest.mark.parametrize("actuation", ["displacement", "tension"])
@pytest.mark.parametrize("mu", [0.0, 0.25])
def test_states_are_in_balance_by_the_equations_written_out(actuation, mu):
    """Elastic moments, tendons with friction and chords, mount and loads balance to 1e-9 rad in every row.

    The history of the friction is worked out anew from the states: a tendon's anchor follows its path.
    """
    generator = np.random.default_rng(11)
    robots = [robot_of(generator, mu) for _ in range(3)]
    robots[1] = replace(robots[1], masses="faces")
    inputs = inputs_of(generator, actuation)
    arcs = arc_robots(robots, straight_between_disks=True)
    acting = loads(robots, [inputs] * 3, GRAVITY)
    states = solve_rows(arcs, np.tile(inputs.tendon, (3, 1, 1)), actuation == "tension", acting)

    def path_of(b: int, bend: np.ndarray) -> np.ndarray:
        sagging = 0.5 * arcs.chord[b] * (bend**2).sum(axis=1)
        return np.einsum("tsa,sa->ts", arcs.arm[b], bend) + sagging

    for b, robot in enumerate(robots):
        anchor = path_of(b, arcs.rest[b])
        for row in range(ROWS):
            bend, shift = states.bend[b, row], states.shift[b, row]
            path = path_of(b, bend)
            since_rest = (path - path_of(b, arcs.rest[b])).sum(axis=1)
            stretch = inputs.tendon[row] + arcs.pretension[b] / arcs.stiffness[b] - since_rest - shift
            tension = np.maximum(arcs.stiffness[b] * stretch, 0.0)
            if actuation == "tension":
                tension = inputs.tendon[row]
            np.testing.assert_allclose(states.tension[b, row], tension, rtol=1e-12, atol=1e-12)
            size = np.sqrt((bend**2).sum(axis=1) + _SMOOTHED_RAD**2) - _SMOOTHED_RAD
            turn = mu * (np.cumsum(size) - 0.5 * size)
            slip = np.clip((path - anchor) / PRE_SLIDING_M, -1.0, 1.0)
            anchor = path - PRE_SLIDING_M * slip
            span = tension[:, None] * (np.cosh(turn) - slip * np.sinh(turn))
            gradient = arcs.arm[b] + arcs.chord[b][:, :, None] * bend
            away = bend - arcs.rest[b]
            k2 = ((away / arcs.length[b][:, None]) ** 2).sum(axis=1)
            law = 1.0 + arcs.cubic[b] * k2 + arcs.quintic[b] * k2**2
            stiffness = arcs.bending[b] / arcs.length[b]
            moment = (
                (stiffness * law)[:, None] * away
                - np.einsum("ts,tsa->sa", span, gradient)
                - work_per_bend(robot, bend, inputs.force_tip[row], inputs.moment_tip[row])
            )
            assert np.abs(moment / stiffness[:, None]).max() < 1e-9
            assert shift == pytest.approx(tension.sum() / 4e4, rel=1e-9)


@pytest.mark.parametrize("mu", [0.0, 0.25])
def test_rows_between_count_for_the_history_only(mu):
    """Every third row is that of all rows, with friction and without."""
    generator = np.random.default_rng(12)
    arcs = arc_robots([robot_of(generator, mu)])
    way = inputs_of(generator, "displacement").tendon[None]
    full, some = solve_rows(arcs, way, False), solve_rows(arcs, way, False, every=3)
    np.testing.assert_allclose(some.bend, full.bend[:, ::3], atol=1e-9)
    np.testing.assert_allclose(some.tension, full.tension[:, ::3], atol=1e-6)


def test_inextensible_antagonists_hold_a_joint_against_a_moment():
    """A joint between two inextensible tendons stays where they put it; their tensions carry the moment.

    With T1 - T2 = (k b - M) / r and one of them slack: the held angle differs from u / r by a thousandth
    of what the moment alone would bend.
    """
    radius, stiffness = 5e-3, 2e-3
    robot = ContinuumRobot(
        name="jaw",
        description="",
        segments=(Segment("jaw", 0.01, 1, 4e-3, stiffness * 0.01, 1e-6, bending_axes="x"),),
        tendons=(Tendon("close", radius, 0.0, "jaw"), Tendon("open", radius, math.pi, "jaw")),
        friction=Friction(0.0),
        actuation="displacement",
    )
    wanted = np.array([0.0, 0.3, 0.9, -0.5])
    moment = np.zeros((4, 3))
    moment[:, 1] = [0.05, -0.05, 0.04, 0.03]
    zeros = np.zeros((4, 3))
    drawn = radius * np.stack([wanted, -wanted], axis=1)
    inputs = Inputs(np.arange(4.0), "displacement", drawn, zeros, moment)
    states = solve_rows(arc_robots([robot]), drawn[None], False, loads([robot], [inputs], np.zeros(3)))
    bend, tension = states.bend[0, :, 0, 0], states.tension[0]
    alone = moment[:, 1] / stiffness - wanted
    np.testing.assert_allclose(bend - wanted, alone / 1001.0, rtol=1e-6)
    np.testing.assert_allclose(
        (tension[:, 0] - tension[:, 1]) * radius, stiffness * bend - moment[:, 1], atol=1e-9
    )
    assert not tension.min(axis=1).any()


def test_stiff_tendons_under_weight_find_their_balance():
    """Nine inextensible tendons, straight from disk to disk, and weight: each of sixty random rows balances.

    Newton's method alone goes to and fro here between tendons that are slack and taut.
    """
    names = ("s0", "s1", "s2")
    robot = ContinuumRobot(
        name="stiff",
        description="",
        segments=tuple(Segment(name, 0.06, 8, 5e-3, 2e-3, 3e-3) for name in names),
        tendons=tuple(
            Tendon(f"{name}_{k}", 4e-3, math.radians(120.0 * k + 17.0 * s), name)
            for s, name in enumerate(names)
            for k in range(3)
        ),
        friction=Friction(0.0),
        actuation="displacement",
    )
    arcs = arc_robots([robot], straight_between_disks=True)
    time = np.arange(60.0)
    bend = np.random.default_rng(13).uniform(-0.8, 0.8, size=(60, 6))
    drawn = np.einsum("tsa,rsa->rt", arcs.arm[0], bend.reshape(-1, 3, 2))
    zeros = np.zeros((60, 3))
    acting = loads([robot], [Inputs(time, "displacement", drawn, zeros, zeros)], np.array([0.0, 0.0, -9.81]))
    states = solve_rows(arcs, drawn[None], False, acting)
    assert states.residual.max() < 1e-9


@pytest.mark.parametrize("mu", [0.0, 0.25])
def test_robots_solved_together_are_found_as_alone(mu):
    """Like and unlike ones, some rows coming again: the first one's derivative serves or is left."""
    generator = np.random.default_rng(4)
    robot, inputs = robot_of(generator, mu), inputs_of(generator, "displacement")
    softer = [
        replace(
            robot,
            segments=tuple(
                replace(item, bending_stiffness_N_m2=factor * item.bending_stiffness_N_m2)
                for item in robot.segments
            ),
        )
        for factor in (0.99, 0.8, 0.3)
    ]
    again = np.array([0, 1, 2, 1, 0, 3, 4, 5, 5, 2, 6, 7, 0])
    commands = inputs.tendon[again]
    rows = Inputs(
        np.arange(float(len(again))),
        "displacement",
        commands,
        inputs.force_tip[again],
        inputs.moment_tip[again],
    )
    found = []
    for robots in ([robot, *softer], *([item] for item in softer)):
        acting = loads(robots, [rows] * len(robots), GRAVITY)
        found.append(solve_rows(arc_robots(robots), np.array([commands] * len(robots)), False, acting))
    together, *alone = found
    for b, one in enumerate(alone, 1):
        np.testing.assert_allclose(together.bend[b], one.bend[0], atol=1e-8)
        np.testing.assert_allclose(together.tension[b], one.tension[0], atol=1e-5)
    if mu == 0.0:
        np.testing.assert_array_equal(together.bend[:, again == 0], together.bend[:, :1].repeat(3, axis=1))
        assert np.abs(np.diff(together.bend[0, again != 0], axis=0)).max() > 1e-3


def test_a_robot_behind_one_without_balance_is_found_as_alone():
    """The first robot softens until nothing holds it: the second's balance is sought briefly, and found."""
    generator = np.random.default_rng(3)
    robot, inputs = robot_of(generator, 0.0), inputs_of(generator, "displacement")
    soft = replace(robot, segments=tuple(replace(item, stiffness_cubic_m2=-0.05) for item in robot.segments))
    found = []
    for together in ([soft, robot], [robot]):
        acting = loads(together, [inputs] * len(together), GRAVITY)
        commands = np.array([inputs.tendon] * len(together))
        found.append(solve_rows(arc_robots(together), commands, False, acting))
    pair, alone = found
    stiffness = robot.segments[0].bending_stiffness_N_m2 / robot.segments[0].length_m
    assert (pair.residual[0] > 1e-5 * stiffness).sum() >= 3
    assert (pair.residual[1] < 1e-9 * stiffness).all()
    np.testing.assert_allclose(pair.bend[1], alone.bend[0], atol=1e-9)
