"""Claims about the steps' commands and the tracker's corrections."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from catheter_sim.core.inputs import Inputs
from catheter_sim.procedure.heart import median_anatomy, pose_error
from catheter_sim.procedure.operate import corrected, ideal, is_ideal, measured
from catheter_sim.procedure.plan import ProcedureStep, between, displacements_m, duration_s, plan, steps
from catheter_sim.robots.catheter.kinematics import pk, tool_frame
from catheter_sim.robots.catheter.published import mitral_transseptal, mitral_transseptal_tube

ROBOT = mitral_transseptal()
Q = np.array([0.5, 1.1, 0.025, -0.4])


def test_displacements_are_the_inverse_of_pure_kinematics() -> None:
    """`pk` of the displacements has its tip where the joint values have it, to a nanometre."""
    row = displacements_m(ROBOT, Q, np.ones(4))[np.newaxis]
    none = np.zeros((1, 3))
    posture = pk(ROBOT, Inputs(np.zeros(1), "displacement", row, none, none), np.zeros(3)).postures[0]
    assert posture.p_w[-1] == pytest.approx(tool_frame(ROBOT, Q)[:3, 3], abs=1e-9)


def test_known_losses_are_made_up_for() -> None:
    """Half of the play in the direction of motion, the slack with the bend's sign; nothing where ideal."""
    tube = mitral_transseptal_tube()
    names = [pair.name for pair in tube.tendons]
    pure = displacements_m(ideal(tube), Q, np.ones(4))
    both = [displacements_m(tube, Q, way * np.ones(4)) for way in (1.0, -1.0)]
    proximal = names.index("torsion_proximal")
    assert (both[0] - pure)[proximal] == pytest.approx(0.5 * 1.35e-3)
    assert (both[1] - pure)[proximal] == pytest.approx(-0.5 * 1.35e-3)
    bending = names.index("bending")
    bent = displacements_m(replace(tube, stiffness_scale=1e-9), Q, np.zeros(4))
    assert (bent - pure)[bending] == pytest.approx(tube.tendons[bending].slack_m, rel=1e-6)
    assert pure == pytest.approx(displacements_m(ROBOT, Q, np.ones(4)), abs=1e-15)
    assert is_ideal(ROBOT)
    assert not is_ideal(tube)


def test_steps_are_those_of_the_paper_in_order() -> None:
    """Only what a step is named after moves in it; the last place is the plan's."""
    way = plan(ROBOT, median_anatomy())
    every = steps(way)
    names = ["insert", "align", "bend", "advance", "orient", "open", "clip", "close"]
    assert [step.name for step in every] == names
    moved = [set(np.flatnonzero(np.abs(after.q - before.q) > 1e-12)) for before, after in pairwise(every)]
    assert moved == [{0}, {1}, {2}, {3}, set(), {2}, set()]
    assert every[-1].q == pytest.approx(way.q)
    assert [step.opening for step in every] == [0, 0, 0, 0, 0, 1, 1, 0]
    assert every[3].q[2] - every[-1].q[2] == pytest.approx(way.below_m)


def test_slowest_motion_sets_the_time() -> None:
    """30 deg at 30 deg/s takes longer than 10 mm at 20 mm/s."""
    start = ProcedureStep("a", 0.0, np.zeros(4), 0.0)
    end = ProcedureStep("b", 0.0, np.array([0.0, math.radians(30.0), 10e-3, 0.0]), 0.0)
    assert duration_s(ROBOT, start, end) == pytest.approx(1.0)
    assert between(start, end, 0.5).q == pytest.approx(0.5 * end.q)


def test_correction_takes_a_joint_error_away() -> None:
    """Joints that lag by up to 4 deg and 2 mm: what is asked for on top is that lag, to a tenth of it."""
    way = plan(ROBOT, median_anatomy())
    base = way.base(way.insertion_m)
    lag = np.array([math.radians(3.0), math.radians(4.0), -2e-3, math.radians(-2.0)])
    wanted = ProcedureStep("clip", way.insertion_m, way.q, 1.0)
    reached = base @ tool_frame(ROBOT, way.q - lag)
    after = corrected(ROBOT, base, wanted, wanted, reached, base @ tool_frame(ROBOT, way.q), 1.0)
    again = way.base(after.insertion_m) @ tool_frame(ROBOT, after.q - lag)
    before, left = (pose_error(way.target, pose) for pose in (reached, again))
    assert np.linalg.norm(left[:3]) < 0.1 * np.linalg.norm(before[:3])
    assert np.linalg.norm(left[3:]) < 0.1 * np.linalg.norm(before[3:])


def test_trackers_noise_is_as_stated() -> None:
    """Root mean square over 2000 readings (seed 0): 0.3 mm and 0.5 deg to 5 %."""
    rng, pose = np.random.default_rng(0), tool_frame(ROBOT, Q)
    errors = np.array([pose_error(pose, measured(pose, rng)) for _ in range(2000)])
    size = np.sqrt((errors**2).reshape(-1, 2, 3).sum(axis=2).mean(axis=0))
    assert size == pytest.approx((0.3e-3, math.radians(0.5)), rel=0.05)
