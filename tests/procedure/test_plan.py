"""Claims about the plan: it reaches the whole pose, keeps its limits, and refuses what it cannot do."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.errors import InputError
from catheter_sim.procedure.heart import (
    Anatomy,
    base_frame,
    coaptation_axes,
    depth_m,
    free_edge_z_m,
    inward,
    median_anatomy,
    pose_error,
    random_anatomy,
)
from catheter_sim.procedure.plan import (
    CLEARANCE_M,
    GRASP_M,
    SHEATH_RAD,
    Plan,
    plan,
    target_frame,
    tip_to_end_m,
)
from catheter_sim.robots.catheter import kinematics
from catheter_sim.robots.catheter.kinematics import within_limits
from catheter_sim.robots.catheter.published import mitral_4dof, mitral_transseptal

ROBOT = mitral_transseptal()


@pytest.fixture(scope="module", params=[None, 1, 6])
def planned(request: pytest.FixtureRequest) -> Plan:
    seed = request.param
    anatomy = median_anatomy() if seed is None else random_anatomy(np.random.default_rng(seed))
    return plan(ROBOT, anatomy)


def test_printed_closed_form_reaches_the_target(planned: Plan) -> None:
    """Nayar 2022, Eqs 14-15, at the planned values: the whole pose to 1e-7 m and rad."""
    tool = kinematics.transseptal_tool(ROBOT, planned.q[np.newaxis])
    place, R = kinematics.in_base_frame(*tool)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = R[0], place[0]
    reached = planned.base(planned.insertion_m) @ pose
    assert np.abs(pose_error(planned.target, reached)).max() < 1e-7


def test_plan_keeps_limits_fossa_and_sheath(planned: Plan) -> None:
    """Joints, also under the leaflets; the puncture within the fossa; the sheath's deflection."""
    anatomy = planned.anatomy
    deep = planned.q + np.array([0.0, 0.0, planned.below_m, 0.0])
    assert within_limits(ROBOT, planned.q)
    assert within_limits(ROBOT, deep)
    aside = planned.puncture[1:] - (anatomy.fossa_y_m, anatomy.fossa_z_m)
    assert np.linalg.norm(aside) <= anatomy.fossa_radius_m
    assert depth_m(anatomy, planned.puncture) == pytest.approx(0.0, abs=1e-9)
    normal = inward(anatomy, planned.puncture)
    assert math.acos(planned.direction @ normal) <= SHEATH_RAD
    assert planned.q[0] == pytest.approx(anatomy.roll_rad, abs=1e-6)  # the valve's axis leaves no other


def test_straight_robot_keeps_clear_of_the_opposite_wall(planned: Plan) -> None:
    """Where it stops being straight its end is inside the wall, by no less than nearly the clearance."""
    reach = sum(segment.length_m for segment in ROBOT.segments) + tip_to_end_m(ROBOT)
    end = planned.puncture + (planned.straight_m + reach) * planned.direction
    assert depth_m(planned.anatomy, end) > 0.9 * CLEARANCE_M


def test_target_stands_across_the_coaptation_line_with_the_edges_on_the_arms() -> None:
    """Tool x across the line, z into the ventricle, the arms' hinges just below the free edges."""
    anatomy = random_anatomy(np.random.default_rng(8))
    target = target_frame(ROBOT, anatomy)
    along, _ = coaptation_axes(anatomy)
    assert abs(target[:3, 0] @ along) < 1e-12
    assert target[:3, 2] == pytest.approx((0.0, 0.0, -1.0))
    assert np.linalg.det(target[:3, :3]) == pytest.approx(1.0)
    # the hinges lie at 95 % of the implant's 9.5 mm beyond the holder, which ends at the tool frame
    assert target[2, 3] - 0.95 * 9.5e-3 == pytest.approx(free_edge_z_m(anatomy) - GRASP_M)


def test_base_frame_needs_a_proximal_torsion_of_the_roll() -> None:
    """Turned by the roll about the sheath, its x points toward the valve."""
    direction = np.array([-0.8, 0.0, -0.6])
    base = base_frame(np.zeros(3), direction, 0.5, 0.01)
    turned = base[:3, :3] @ (math.cos(0.5), math.sin(0.5), 0.0)
    assert turned == pytest.approx((0.6, 0.0, -0.8))
    assert base[:3, 3] == pytest.approx(0.01 * direction)


def _short_stroke() -> tuple[object, Anatomy]:
    segments = tuple(
        replace(item, stroke_m=5e-3) if item.joint == "prismatic" else item for item in ROBOT.segments
    )
    return replace(ROBOT, segments=segments), median_anatomy()


@pytest.mark.parametrize(
    ("case", "told"),
    [
        (_short_stroke, "stroke is shorter"),
        (lambda: (mitral_4dof(), median_anatomy()), "mitral_4dof: the procedure is for the transseptal"),
        (
            lambda: (ROBOT, replace(median_anatomy(), coaptation_rad=math.radians(140.0))),
            r"no plan: .* from its target",
        ),
    ],
)
def test_what_cannot_be_planned_is_told_in_a_line(case, told: str) -> None:
    """A short stroke, another design, a coaptation line beyond the distal torsion's reach."""
    with pytest.raises(InputError, match=told):
        plan(*case())
