"""The curves beside a video: the line stands where the time is, and what does not change is left out."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.pictures.curves import Curves, strip_width
from catheter_sim.pictures.images import INK
from catheter_sim.tables import Table

ROBOT = load_robot("neuroendoscope_section")
FRAME = np.full((360, 448, 3), 200, dtype=np.uint8)


def driven(left: list[float]) -> Inputs:
    table = Table(
        np.array([0.0, 1.0, 3.0]),
        {"tension_right_N": np.array([0, 0.4, 0.2]), "tension_left_N": np.array(left)},
    )
    return read_inputs(ROBOT, table)


def line_at(strip: np.ndarray) -> float:
    """Return the column of the upright line, which is the only ink from an axis's top to its bottom."""
    ink = (strip == INK).all(axis=2).sum(axis=0)
    return float(np.flatnonzero(ink > 0.6 * ink.max()).mean())


def test_the_line_runs_with_the_time() -> None:
    """A third of the time is a third of the way, and the picture to the left stays as it was."""
    curves = Curves(ROBOT, driven([0.0, 0.1, 0.3]), 192, 360)
    pictures = [curves.beside(FRAME, time_s) for time_s in (0.0, 1.0, 3.0)]
    assert all(picture.shape == (360, 640, 3) for picture in pictures)
    assert all((picture[:, :448] == FRAME).all() for picture in pictures)
    first, third, last = (line_at(picture[:, 448:]) for picture in pictures)
    assert first < third < last < 192
    assert third - first == pytest.approx((last - first) / 3.0, abs=1.5)
    assert last - first > 100


@pytest.mark.slow
def test_inputs_that_do_not_change_have_no_panel() -> None:
    """One panel for one that moves, two for two; where none moves all are shown."""
    still = read_inputs(ROBOT, Table(np.array([0.0]), {"tension_right_N": np.array([0.1])}))
    cases = ((driven([0.0, 0.0, 0.0]), 1), (driven([0.0, 0.1, 0.3]), 2), (still, 2))
    for inputs, panels in cases:
        strip = Curves(ROBOT, inputs, 192, 360).beside(FRAME, 1.0)[:, 448:]
        line = (strip == INK).all(axis=2)[:, round(line_at(strip))]
        assert (np.diff(line.astype(int)) == 1).sum() == panels


@pytest.mark.parametrize("width", [640, 1280, 1000])
def test_the_strips_width_is_even(width: int) -> None:
    """As a video's pictures must be."""
    assert strip_width(width) % 2 == 0
    assert 0.25 < strip_width(width) / width < 0.35
