"""The compiled loops of a rolling joint's step are the NumPy statics, at drawn postures."""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import LinkForce
from catheter_sim.core.law import Pulls, RobotInModel, Step
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots.rolling import complete
from catheter_sim.robots.rolling.complete import compressions, frames, loads
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.robots.rolling.laws import RodElasticity, RodTurns, Rolling

SEED = 20250611
GRAVITY = np.array([1.0, -2.0, -9.81])
LAW = ("stiffness_cubic_mm2=-300", "stiffness_quintic_mm4=5e4", "rest_curvature_x_per_m=4")
SLEEVE = "sleeve.bending_stiffness_N_mm2=2e3"
ROBOTS = {
    "section": ("chest_tube_section", ()),
    "soft links": ("chest_tube_section@prototype", ()),
    "bent section, polynomial law, sleeve": (
        "chest_tube_section",
        (*(f"segments.section.{setting}" for setting in LAW), SLEEVE),
    ),
    "countersinks, two planes": ("chest_tube", ()),
    "the same with all of it, links of two lengths": (
        "chest_tube",
        (
            *(f"segments.{name}.{setting}" for name in ("middle", "tip") for setting in LAW),
            "segments.tip.rest_curvature_y_per_m=-3",
            "segments.middle.length_mm=60",
            *(f"segments.{name}.link_modulus_Pa=25e6" for name in ("base", "middle", "tip")),
            SLEEVE,
        ),
    ),
}


@cache
def written(reference, settings):
    """Return a robot, its arrays, and its model as text."""
    robot = load_robot(reference, settings)
    return robot, rolling_chain(robot), build_mjcf(robot, "tension", False)


@pytest.fixture(params=ROBOTS.values(), ids=ROBOTS.keys())
def parts(request):
    """Return a robot, its arrays, and its model with fresh data."""
    robot, chain, text = written(*request.param)
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.gravity[:] = GRAVITY
    return robot, chain, model, mujoco.MjData(model)


def postures(chain, share=0.9, count=10):
    """Return drawn bend angles to both sides, up to `share` of the limits, shape (count, n) [rad]."""
    draw = np.random.default_rng(SEED)
    theta = draw.uniform(share * chain.low, share * chain.high, (count, chain.joints))
    assert (theta.min(axis=0) < 0.0).all()
    assert (theta.max(axis=0) > 0.0).all()
    return theta


def step_of(data):
    """Return a step in which nobody pulls."""
    nobody, none = np.zeros(0, dtype=int), np.zeros(0)
    pulls = Pulls(nobody, nobody, True, none, none, none)
    return Step(data, pulls, np.zeros(3), np.zeros((0, 3)), lambda: np.zeros((0, 0)))


def moments(chain, theta):
    """Return the statics' elastic moments, shape (n,) [N m]."""
    return complete.elastic_moments(chain, theta, complete.spans(chain, theta))[0]


def test_elastic_moments_are_the_statics(parts):
    """Both signs, every part of the law: 1e-13 of each moment; taken from what is there already."""
    robot, chain, model, data = parts
    elasticity = RodElasticity(robot, RobotInModel(model))
    for theta in postures(chain):
        data.qpos[:] = theta
        data.qfrc_applied[:] = 0.0
        elasticity.between(step_of(data))
        expected = -moments(chain, theta)
        assert data.qfrc_applied == pytest.approx(expected, rel=1e-13, abs=0.0)
        elasticity.between(step_of(data))
        assert data.qfrc_applied == pytest.approx(2.0 * expected, rel=1e-13, abs=0.0)


@pytest.mark.parametrize("side", ["low", "high"])
def test_elastic_moments_stay_finite_beyond_a_closed_gap(parts, side):
    """Beyond the angle at which the first gap closes they stay what they are there, and resist."""
    robot, chain, model, data = parts
    elasticity = RodElasticity(robot, RobotInModel(model))
    limit = getattr(chain, side)
    torques = []
    for share in (1.0, 1.3):
        data.qpos[:] = share * limit
        data.qfrc_applied[:] = 0.0
        elasticity.between(step_of(data))
        torques.append(data.qfrc_applied.copy())
    assert (torques[0] == torques[1]).all()
    # a millionth of the gap is left, and with it a millionth of the digits
    assert torques[0] == pytest.approx(-moments(chain, limit), rel=1e-8)
    assert (torques[0] * limit < 0.0).all()


@pytest.mark.slow
@pytest.mark.parametrize("share", [1.2, 3.0])
def test_turns_are_the_statics(parts, share):
    """The turn before a gap is that in the link below, in size: to 1e-13 rad; 0 in the base's hole."""
    robot, chain, model, data = parts
    turns = RodTurns(robot, RobotInModel(model))
    for theta in postures(chain, share):
        data.qpos[:] = theta
        expected = np.zeros((chain.pulled, chain.joints))
        expected[:, 1:] = np.abs(complete.turns(chain, theta)[0][: chain.pulled, :-1])
        expected[~chain.passes[: chain.pulled]] = 0.0
        assert turns(data) == pytest.approx(expected, rel=0.0, abs=1e-13)
        assert share < 3.0 or expected.max() > 0.2, "turns for which the series is not enough"


@pytest.mark.slow
def test_links_stand_where_the_statics_puts_them(parts):
    """Links pressed by drawn tensions and loads, rolled to drawn angles: faces and holes to 1e-13 m.

    Rods that end before the tip are slack here.
    """
    robot, chain, model, data = parts
    rolling = Rolling(robot, RobotInModel(model))
    draw = np.random.default_rng(SEED + 1)
    faces = [model.site(f"face_{k}").id for k in range(1, chain.joints + 1)]
    rod, link = np.nonzero(chain.passes)
    names = [item.name for item in (*robot.tendons, *robot.passive_rods)]
    holes = [model.site(f"hole_{names[j]}_{k + 1}").id for j, k in zip(rod, link, strict=True)]
    reaches = chain.last[: chain.pulled, None] == chain.joints
    for theta in postures(chain):
        tip, push, pushed = draw.normal(size=3), draw.normal(size=3), int(draw.integers(chain.joints))
        on_link = np.zeros((chain.joints, 3))
        on_link[pushed] = push
        at_joint = np.where(reaches, draw.uniform(0.0, 30.0, (chain.pulled, chain.joints)), 0.0)
        above = np.concatenate([at_joint[:, 1:], at_joint[:, -1:]], axis=1)
        data.qpos[:] = theta
        mujoco.mj_kinematics(model, data)
        passes = chain.passes[: chain.pulled]
        rolling.compress(data, np.where(passes, at_joint, np.nan), tip, on_link)
        rolling.place(data)
        mujoco.mj_kinematics(model, data)

        tension = complete.Tensions(at_joint, above, np.zeros(0))
        acting = loads(chain, GRAVITY, tip, others=[LinkForce(pushed + 1, (0.0, 0.0, 0.0), tuple(push))])
        pressed = compressions(chain, frames(chain, theta), tension, acting)
        length = chain.link_length - pressed / chain.link_stiffness
        exact = frames(chain, theta, length)
        assert rolling.compressible == (length != chain.link_length).any()
        assert data.site_xpos[faces] == pytest.approx(exact.face, rel=0.0, abs=1e-13)
        local = np.concatenate(
            [chain.position[rod, link], (length[link] - chain.countersink[rod, link])[:, None]], axis=1
        )
        upper = exact.origin[link] + np.einsum("sij,sj->si", exact.R_w[link], local)
        assert data.site_xpos[holes] == pytest.approx(upper, rel=0.0, abs=1e-13)


def test_reset_gives_the_links_their_lengths_back(parts):
    """Pressed, reset and straight again, every face stands at the sum of the unloaded lengths."""
    robot, chain, model, data = parts
    rolling = Rolling(robot, RobotInModel(model))
    mujoco.mj_kinematics(model, data)
    rolling.compress(
        data, np.full((chain.pulled, chain.joints), 30.0), np.zeros(3), np.zeros((chain.joints, 3))
    )
    rolling.reset()
    data.qpos[:] = 0.0
    rolling.place(data)
    mujoco.mj_kinematics(model, data)
    faces = [model.site(f"face_{k}").id for k in range(1, chain.joints + 1)]
    assert data.site_xpos[faces][:, 2] == pytest.approx(np.cumsum(chain.link_length), rel=0.0, abs=1e-13)
