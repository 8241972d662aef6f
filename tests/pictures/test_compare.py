"""Claims about the distance between drawn pixels and a curve, on made-up pictures."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.pictures.images import compare


@pytest.mark.parametrize("drawn_px", [360, 400, 440])
def test_a_robot_drawn_too_short_or_too_long_is_off_by_its_share(drawn_px: int) -> None:
    """A bar beside a line of 400 px: at every share of the length off by that share of what is missing."""
    mask = np.zeros((200, 600), bool)
    mask[95:106, 50 : 50 + drawn_px] = True
    found = compare(mask, np.array([[50.0, 100.5], [250.0, 100.5], [450.0, 100.5]]))
    missing = abs(400 - drawn_px)
    assert found.mean_px == pytest.approx(missing / 2.0, abs=0.3)
    assert found.largest_px == pytest.approx(missing, rel=0.05, abs=0.6)
    assert found.length_ratio == pytest.approx(drawn_px / 400.0, abs=0.005)
    assert found.passed is (missing == 0)
