"""The cloud of reachable tips."""

from __future__ import annotations

import re

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.planning.models import plan_drives


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


def test_a_seed_has_no_bound_and_numpys_numbers_are_numbers() -> None:
    """A seed beyond the number of samples is one; NumPy's whole numbers give what Python's give."""
    samples, seed = np.int64(5), np.uint32(4_000_000_000)
    found = cs.workspace("mitral_4dof", samples=samples, seed=seed)  # type: ignore[arg-type]
    again = cs.workspace("mitral_4dof", samples=5, seed=4_000_000_000)
    np.testing.assert_array_equal(found.tip_mm, again.tip_mm)
    assert len(found) == 5


@pytest.mark.parametrize(
    ("name", "value", "needed"),
    [
        ("samples", True, "a whole number of 1 to 100000"),
        ("samples", np.True_, "a whole number of 1 to 100000"),
        ("samples", 2.0, "a whole number of 1 to 100000"),
        ("samples", 0, "a whole number of 1 to 100000"),
        ("samples", 100_001, "a whole number of 1 to 100000"),
        ("seed", False, "a whole number from 0"),
        ("seed", -1, "a whole number from 0"),
        ("seed", "3", "a whole number from 0"),
    ],
)
def test_what_is_no_number_of_samples_or_seed_is_refused(name: str, value: object, needed: str) -> None:
    """One line names the argument and what it needs; a boolean is no number."""
    with pytest.raises(cs.InputError, match=re.escape(f"{name} = {value!r}: {needed} is needed")):
        cs.workspace("mitral_4dof", **{name: value})  # type: ignore[arg-type]
