"""The cloud of reachable tips."""

from __future__ import annotations

import numpy as np

import catheter_sim as cs
from catheter_sim.planning.drives import plan_drives


def test_points_are_where_a_static_model_puts_them() -> None:
    """Inputs in the cloud, one by one from rest, give its tips by the closed-form kinematics."""
    found = cs.workspace("mitral_4dof", samples=20)
    again = cs.statics("mitral_4dof", found.cloud.inputs, model="pk")
    tips = np.array([posture.p_w[-1] for posture in again.postures])
    np.testing.assert_allclose(1e3 * tips, found.tip_mm, atol=0.02)
    axes = np.array([posture.R_w[-1][:, 2] for posture in again.postures])
    np.testing.assert_allclose(axes, found.cloud.direction, atol=1e-3)


def test_no_tip_is_farther_than_the_robot_is_long() -> None:
    """A planar robot's cloud stays in its plane, within its length, and mirrors in its antagonists."""
    found = cs.workspace("neuroendoscope_section", samples=300)
    length = 1e3 * plan_drives(found.robot).length_m
    assert np.linalg.norm(found.tip_mm, axis=1).max() <= length + 1e-6
    assert np.abs(found.tip_mm[:, 1]).max() < 1e-9
    low, high = found.extent()["tip_x_mm"]
    assert abs(low + high) < 0.1 * high


def test_the_seed_decides() -> None:
    """Same seed, same points; another, others."""
    first, again, other = (cs.workspace("mitral_4dof", samples=5, seed=seed).tip_mm for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.allclose(first, other)
