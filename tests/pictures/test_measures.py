"""What a picture is read by says what is there: lengths, directions, tensions."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.modelling.build import View
from catheter_sim.pictures.images import (
    INK,
    in_corner,
    legend_size,
    round_length,
    scale_size,
    with_scale,
    with_tension_legend,
)

PLAIN = np.full((720, 1280, 3), 255, dtype=np.uint8)
SIDE = View("side", np.zeros(3), np.array([0.0, -1.0, 0.0]), 0.12)
CORNERS = [(0, 0), (0, 1), (1, 0), (1, 1)]


@pytest.mark.parametrize(
    ("longest", "shown"), [(24.0, 20.0), (5.0, 5.0), (4.99, 2.0), (1.0, 1.0), (0.7, 0.5), (199.0, 100.0)]
)
def test_lengths_are_round_and_no_longer_than_there_is_room(longest: float, shown: float) -> None:
    assert round_length(longest) == pytest.approx(shown)


@pytest.mark.parametrize("height_m", [0.03, 0.12, 0.5])
def test_the_bar_is_as_long_as_it_says(height_m: float) -> None:
    """Its pixels over the picture's pixels a metre are the round length, to a pixel at either end."""
    view = View("side", np.zeros(3), np.array([0.0, -1.0, 0.0]), height_m)
    image = with_scale(PLAIN, view, in_corner(PLAIN, scale_size(720), (1, 0)))
    ink = (image == INK).all(axis=2)
    row = int(np.argmax(ink.sum(axis=1)))
    pixels_per_m = 720 / height_m
    expected_mm = round_length(1e3 * 0.2 * height_m)
    assert abs(ink[row].sum() - 1e-3 * expected_mm * pixels_per_m) <= 4
    assert 0.08 * 720 <= ink[row].sum() <= 0.2 * 720 + 4


def coloured(image: np.ndarray, channel: int) -> np.ndarray:
    """Return rows and columns of the pixels in which one channel is far above the others, shape (n, 2)."""
    others = [other for other in range(3) if other != channel]
    return np.argwhere(image[:, :, channel].astype(int) - image[:, :, others].max(axis=2) > 60)


def test_axes_point_where_the_base_frames_do() -> None:
    """Seen along +y, x is to the right and z up; seen along -y, x is to the left of where z begins."""
    for backward, side in (((0.0, -1.0, 0.0), 1), ((0.0, 1.0, 0.0), -1)):
        image = with_scale(PLAIN, View("any", np.zeros(3), np.array(backward), 0.1), (0, 0))
        x, z = coloured(image, 0), coloured(image, 2)
        assert np.ptp(x[:, 1]) > 30
        assert np.ptp(z[:, 0]) > 30
        assert side * (x[:, 1].mean() - z[:, 1].mean()) > 15
        assert z[:, 0].mean() < x[:, 0].mean() - 15
        assert len(coloured(image, 1)) < 40  # y points at the reader


@pytest.mark.parametrize("corner", CORNERS)
def test_scale_and_legend_stay_where_they_are_put(corner: tuple[int, int]) -> None:
    """Within the sizes by which the picture's corners are shared out."""
    sizes = (scale_size(720), legend_size(720))
    places = [in_corner(PLAIN, size, corner) for size in sizes]
    pictures = (with_scale(PLAIN, SIDE, places[0]), with_tension_legend(PLAIN, 0.4, places[1]))
    for image, (width, height) in zip(pictures, sizes, strict=True):
        rows, columns = np.nonzero((image != PLAIN).any(axis=2))
        assert len(rows) > 100
        assert (rows.max() < height) if corner[0] == 0 else (rows.min() >= 720 - height)
        assert (columns.max() < width) if corner[1] == 0 else (columns.min() >= 1280 - width)


def test_the_legends_colours_run_from_full_above_to_slack_below() -> None:
    """Red at the top, yellow in the middle, grey at the bottom, as the tendons are painted."""
    image = with_tension_legend(PLAIN, 0.4, (0, 0)).astype(int)
    coloured = (image.max(axis=2) - image.min(axis=2)) > 100
    column = int(np.argmax(coloured.sum(axis=0)))
    rows = np.flatnonzero(coloured[:, column])
    top, middle = image[rows[0], column], image[rows[0] + len(rows) * 5 // 9, column]
    assert top[0] > 180
    assert top[1] < 60
    assert middle[:2].min() > 150
    assert middle[2] < 120
