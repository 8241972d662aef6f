"""Two solvers of the same rods: compiled shooting against collocation of the printed equations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.core.robot import Friction
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.published import spacer_disk
from catheter_sim.robots.continuum.rods import RodLoad, RodProblem, equilibria, problem
from reference.collocation import collocate

pytestmark = pytest.mark.slow


def robot(disks: int) -> RodProblem:
    """Return the benchmark robot, its second segment softer."""
    whole = spacer_disk()
    first, second = whole.segments
    soft = replace(
        second,
        bending_stiffness_N_m2=0.7 * second.bending_stiffness_N_m2,
        torsion_stiffness_N_m2=0.5 * second.torsion_stiffness_N_m2,
    )
    return problem(replace(whole, segments=(first, soft), disks_per_segment=disks))


@pytest.mark.parametrize(
    ("path", "disks"),
    [
        pytest.param("continuous", 1, marks=pytest.mark.long),
        pytest.param("continuous", 2, marks=pytest.mark.long),
        ("projected", 2),
        ("eyelets", 2),
    ],
)
def test_shooting_and_collocation_agree(path: str, disks: int) -> None:
    """Forces at two disks, bending and torque at the tip, four tensions: the same disks to 1e-8.

    The shooting's steps are refined until its own error is below that.
    """
    rod = robot(disks)
    n = len(rod.length_m)
    tension = np.array([3.0, 0.5, 4.0, 1.0])
    force, moment = np.zeros((n, 3)), np.zeros((n, 3))
    force[-1], force[0], moment[-1] = (0.4, 0.3, -0.2), (0.1, 0.0, 0.05), (0.0, 0.005, 0.01)
    slow = collocate(rod, tension, force, moment, path, tolerance=1e-10)
    fast = equilibria(rod, RodLoad(tension[None], force[None], moment[None]), path, steps=640)
    np.testing.assert_allclose(fast.p_w[0], slow.p_w, atol=1e-8 * 0.1)
    np.testing.assert_allclose(fast.R_w[0], slow.R_w, atol=1e-8)
    assert slow.residual <= 1e-10
    usual = equilibria(rod, RodLoad(tension[None], force[None], moment[None]), path)
    np.testing.assert_allclose(usual.p_w[0], slow.p_w, atol=1e-6 * 0.1)


def test_collocation_names_what_it_does_not_take() -> None:
    """Friction is refused in one line."""
    rod = problem(replace(spacer_disk(), disks_per_segment=1, friction=Friction(0.1)))
    with pytest.raises(InputError, match="frictionless"):
        collocate(rod, np.zeros(4), np.zeros((2, 3)), np.zeros((2, 3)), "eyelets")
