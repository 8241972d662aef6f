"""What bends a robot by a radian, against the rods' statics at a hundredth of it, where they are linear."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.robots.continuum.description import sizes
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.theory.static_models import STATIC_MODELS

SHARE = 0.01


def rod(length_m: float, stiffness_N_m2: float, scale: float) -> ContinuumRobot:
    return ContinuumRobot(
        name="rod",
        description="for the tests",
        segments=(Segment("arm", length_m, 12, 5e-3, stiffness_N_m2, 1e-3),),
        tendons=tuple(Tendon(f"t{k}", 4e-3 - 1e-3 * k, k * math.pi, "arm") for k in range(2)),
        friction=Friction(0.0),
        stiffness_scale=scale,
    )


def bend_rad(robot: ContinuumRobot, tension: float, force: float) -> float:
    """Return by how much the tip is turned toward +x."""
    forces = np.array([[force, 0.0, 0.0]])
    inputs = Inputs(np.zeros(1), "tension", np.array([[tension, 0.0]]), forces, np.zeros((1, 3)))
    R = STATIC_MODELS["VC_ref_noproj"].solve(robot, inputs, np.zeros(3)).postures[0].R_w[-1]
    return math.atan2(R[0, 2], R[2, 2])


@pytest.mark.parametrize(("length_m", "stiffness_N_m2", "scale"), [(0.1, 2e-3, 1.0), (0.25, 5e-3, 0.7)])
def test_a_hundredth_of_it_bends_by_a_hundredth(length_m: float, stiffness_N_m2: float, scale: float) -> None:
    """A force across the tip turns it by F L^2 / 2 EI, a tendon by T r L / EI: by a radian, were it linear.

    Of several tendons the one of the largest arm is meant.
    """
    robot = rod(length_m, stiffness_N_m2, scale)
    assert bend_rad(robot, 0.0, SHARE * sizes(robot).tip_force_N) == pytest.approx(SHARE, rel=0.01)
    assert bend_rad(robot, SHARE * sizes(robot).tension_N, 0.0) == pytest.approx(SHARE, rel=0.01)


def test_the_softest_segment_counts() -> None:
    """Two segments of one length: the sizes are those of a robot that is all as soft as its softer one."""
    soft = rod(0.1, 2e-3, 1.0)
    (segment,) = soft.segments
    half = replace(segment, length_m=0.05)
    stiffer = replace(half, name="base", bending_stiffness_N_m2=7e-3)
    both = replace(soft, segments=(stiffer, half))
    assert sizes(both).tip_force_N == pytest.approx(sizes(soft).tip_force_N)
    assert sizes(both).tension_N == pytest.approx(sizes(soft).tension_N)
