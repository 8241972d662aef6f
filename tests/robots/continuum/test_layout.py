"""Claims about where a robot's parts lie when it is straight, from its data."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.robots.continuum.description import hole_angle_rad, last_disk, links
from catheter_sim.robots.continuum.spec import ContinuumRobot


def continuum(reference: str, *settings: str) -> ContinuumRobot:
    robot = load_robot(reference, settings)
    assert isinstance(robot, ContinuumRobot)
    return robot


def test_hinges_stand_at_the_middle_of_their_links() -> None:
    """Thirty cells of 2 mm: hinges at 1, 3, ... 59 mm, faces at 2, 4, ... 60 mm."""
    chain = links(continuum("neuroendoscope_section"))
    assert [link.hinge_z_m for link in chain] == pytest.approx(np.arange(1, 60, 2) * 1e-3)
    assert [link.face_z_m for link in chain] == pytest.approx(np.arange(2, 61, 2) * 1e-3)


@pytest.mark.parametrize("height_m", [0.0, 0.02, 0.05, 0.07, 0.1])
def test_holes_wind_by_twist_times_height(height_m: float) -> None:
    """+200 deg/m over the first 50 mm, -100 deg/m over the second."""
    robot = continuum(
        "spacer_disk",
        "segments.first.rest_twist_deg_per_m=200",
        "segments.second.rest_twist_deg_per_m=-100",
    )
    turned = 200.0 * min(height_m, 0.05) - 100.0 * max(height_m - 0.05, 0.0)
    angle = hole_angle_rad(robot, robot.tendons[0], height_m) - robot.tendons[0].angle_rad
    assert np.degrees(angle) == pytest.approx(turned, abs=1e-9)


def test_tendons_end_with_their_segment() -> None:
    """Ten disks a segment: 1 and 2 are fixed in disk 10, 3 and 4 in disk 20."""
    robot = continuum("spacer_disk")
    assert [last_disk(robot, tendon) for tendon in robot.tendons] == [10, 10, 20, 20]
