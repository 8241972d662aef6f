"""Claims about a catheter's drives and stops in its MJCF, from the papers' geometry."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots.catheter.spec import CatheterRobot

ROBOTS = ("mitral_transseptal", "mitral_4dof")


def compiled(name: str) -> tuple[CatheterRobot, mujoco.MjModel]:
    robot = load_robot(name)
    assert isinstance(robot, CatheterRobot)
    return robot, mujoco.MjModel.from_xml_string(build_mjcf(robot))


@pytest.mark.parametrize("name", ROBOTS)
def test_gaps_close_together_at_the_printed_bend(name: str) -> None:
    """tan(bend / (2 (n + 1))) = t / rim radius (Nayar 2022, II-A): what all gaps can turn is that bend."""
    robot, model = compiled(name)
    for segment in robot.segments:
        if segment.joint != "bending":
            continue
        gaps = [model.joint(f"{segment.name}_{k}").range for k in range(1, segment.rings + 2)]
        half = math.atan(segment.half_gap_m / segment.rim_radius_m)
        closed = 2.0 * (segment.rings + 1) * half
        assert np.sum(gaps, axis=0) == pytest.approx([-closed, closed], rel=1e-6)


@pytest.mark.parametrize("name", ROBOTS)
def test_torsion_drive_comes_to_rest_where_the_wrapped_tendon_has_it(name: str) -> None:
    """A displacement of 0.1 mm turns the joint until so much is unwound from the helix of Eq. 6."""
    robot, model = compiled(name)
    for pair in robot.tendons:
        segment = next(item for item in robot.segments if item.name == pair.moves)
        if segment.joint != "torsion":
            continue
        drive = model.actuator(f"tendon_{pair.name}").id
        gain, bias = model.actuator_gainprm[drive, 0], model.actuator_biasprm[drive, 1]
        angle = gain * 1e-4 / -bias  # at which the actuator's moment is nothing

        def wrapped(turn: float, part: object = segment) -> float:
            around = part.tendon_radius_m * (part.wrap_rad - turn)  # type: ignore[attr-defined]
            return math.hypot(around, part.wrap_height_m)  # type: ignore[attr-defined]

        assert wrapped(0.0) - wrapped(angle) == pytest.approx(1e-4, rel=0.01)
