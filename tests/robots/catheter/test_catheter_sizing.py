"""Claims about what a drive must give, and what preconditioning does (Nayar 2023)."""

from __future__ import annotations

import math

import pytest

from catheter_sim.controllers.motors import BENDING_GEAR, LeadScrew
from catheter_sim.robots.catheter.measured import (
    PRINTED,
    SIMPLIFIED,
    StretchingJoint,
    envelope_N,
    need,
    preconditioned,
    repeats_m,
    stretching_joints,
)
from catheter_sim.robots.catheter.published import mitral_4dof


@pytest.fixture(params=["bending_proximal", "bending_distal"])
def joint(request: pytest.FixtureRequest) -> StretchingJoint:
    return stretching_joints(mitral_4dof())[request.param]


def test_displacement_is_eq_12_and_the_envelope(joint: StretchingJoint) -> None:
    """A new tendon at 60 deg: Eq. 12 plus the strain at which the printed cubic has the tension, by hand."""
    found = need(joint, 60.0)
    strain = (found.new_m - found.pure_m) / joint.length_m
    assert envelope_N(PRINTED, strain) == pytest.approx(joint.on_N(60.0), rel=1e-6)


def test_preconditioning_saves_stroke(joint: StretchingJoint) -> None:
    """Its set is gamma times the strain, and the displacement left lies between Eq. 12's and a new
    tendon's."""
    found = need(joint, 60.0)
    strain = (found.new_m - found.pure_m) / joint.length_m
    assert found.set_m == pytest.approx(PRINTED.gamma * strain * joint.length_m, rel=1e-6)
    assert found.pure_m < found.ready_m < found.new_m


def test_a_preconditioned_tendon_repeats_itself(joint: StretchingJoint) -> None:
    """Without cycle effects exactly; with the printed ones better than a new one."""
    assert abs(repeats_m(joint, 60.0, SIMPLIFIED, ready=True)) < 1e-9
    new, ready = (abs(repeats_m(joint, 60.0, PRINTED, ready=item)) for item in (False, True))
    assert ready < new


def test_more_cycles_shift_the_foot_and_not_the_set(joint: StretchingJoint) -> None:
    """The set does not heal and does not grow: it is of the largest strain."""
    once, often = (preconditioned(joint, 5.0, cycles, PRINTED)[1] for cycles in (1, 5))
    assert often == pytest.approx(once, rel=1e-9)


def test_torque_is_the_screws_work_without_friction() -> None:
    """Of a screw and a gearbox without loss a turn of the motor does the work of the nut's way."""
    screw = LeadScrew(BENDING_GEAR, friction=0.0, gear_efficiency=1.0)
    work = 2.0 * math.pi * screw.torque_Nm(10.0)
    assert work == pytest.approx(10.0 * screw.lead_m / screw.gear, rel=1e-12)
    assert not screw.locks_itself
    assert LeadScrew(BENDING_GEAR).locks_itself
