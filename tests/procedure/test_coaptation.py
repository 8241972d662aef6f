"""Claims about which way the valve's coaptation line is turned."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catheter_sim.procedure.heart import coaptation_axes, median_anatomy


@pytest.mark.parametrize("turn_deg", [0.0, 30.0, -40.0])
def test_line_is_turned_counter_clockwise_from_y(turn_deg: float) -> None:
    """+y turned about +z by the angle, and at a right angle to it what points toward the septum at +x."""
    anatomy = replace(median_anatomy(), coaptation_rad=math.radians(turn_deg))
    turned = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix()
    along, across = coaptation_axes(anatomy)
    assert along == pytest.approx(turned @ np.array([0.0, 1.0, 0.0]), abs=1e-12)
    assert across == pytest.approx(turned @ np.array([1.0, 0.0, 0.0]), abs=1e-12)
