"""What a picture is read by: a scale bar, the base frame's axes, and what the colours of tensions mean."""

from __future__ import annotations

import math

import numpy as np
from PIL import Image, ImageDraw

from catheter_sim.modelling.scene import View
from catheter_sim.pictures.images import INK, Picture, font_of, gap_of
from catheter_sim.pictures.tendon_paint import tension_colours

_SHARE = 0.2  # of the picture's height, that a scale bar takes at most
_AXIS = 0.055  # an axis's length over the picture's height
_AXIS_COLOURS = ((176, 48, 48), (46, 125, 60), (40, 84, 168))  # x, y, z
_BAR = (0.018, 0.16)  # width and height of the bar of colours over the picture's height
_AWAY = 0.3  # an axis that points so nearly at the reader (share of its length seen) has no letter


def round_length(longest: float) -> float:
    """Return the longest of 1, 2 and 5 times a power of ten that is no longer than `longest`."""
    power = 10.0 ** math.floor(math.log10(longest))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= longest * (1.0 + 1e-9))


def scale_size(height: int) -> tuple[int, int]:
    """Return width and height that `with_scale` takes in a picture so high, margins included [pixels]."""
    gap = gap_of(height)
    return round((_SHARE + 3.0 * _AXIS) * height) + 2 * gap, round(2.6 * _AXIS * height) + 2 * gap


def with_scale(image: Picture, view: View, corner: tuple[int, int]) -> Picture:
    """Return `image` with a scale bar and the base frame's axes in a corner (row, column: 0 first, 1 last).

    The bar is true in the plane through the view's target; nearer to the camera things are a little larger.
    """
    height, width = image.shape[:2]
    canvas = Image.fromarray(image)
    draw = ImageDraw.Draw(canvas)
    font, gap = font_of(height), gap_of(height)
    across, along = scale_size(height)
    left = width - across + gap if corner[1] else gap
    bottom = height - gap if corner[0] else along - gap
    pixels_per_m = height / view.height
    length_mm = round_length(1e3 * _SHARE * height / pixels_per_m)
    end = left + round(1e-3 * length_mm * pixels_per_m)
    thick = max(2, height // 240)
    draw.line([(left, bottom), (end, bottom)], fill=INK, width=thick)
    for at in (left, end):
        draw.line([(at, bottom - 3 * thick), (at, bottom)], fill=INK, width=thick)
    draw.text((left, bottom - 4 * thick), f"{length_mm:g} mm", fill=INK, font=font, anchor="ls")
    middle = (left + round((_SHARE + 1.4 * _AXIS) * height), bottom - round(1.1 * _AXIS * height))
    right, up = view.axes
    for name, colour, direction in zip("xyz", _AXIS_COLOURS, np.eye(3), strict=True):
        way = np.array([direction @ right, -(direction @ up)]) * _AXIS * height
        tip = (middle[0] + way[0], middle[1] + way[1])
        draw.line([middle, tip], fill=colour, width=thick)
        if np.linalg.norm(way) > _AWAY * _AXIS * height:
            place = (middle[0] + 1.35 * way[0], middle[1] + 1.35 * way[1])
            draw.text(place, name, fill=colour, font=font, anchor="mm")
    return np.asarray(canvas)


def legend_size(height: int) -> tuple[int, int]:
    """Return width and height that `with_tension_legend` takes in a picture so high [pixels]."""
    letters = font_of(height).getbbox("tension 00.00 N")
    return round(letters[2]) + 2 * gap_of(height), round((_BAR[1] + 0.05) * height) + 2 * gap_of(height)


def with_tension_legend(image: Picture, full_N: float, corner: tuple[int, int]) -> Picture:
    """Return `image` with the colours of tensions from 0 to `full_N` in a corner, figures beside them."""
    height, width = image.shape[:2]
    canvas = Image.fromarray(image)
    draw = ImageDraw.Draw(canvas)
    font, gap = font_of(height), gap_of(height)
    across, along = legend_size(height)
    left = width - across + gap if corner[1] else gap
    top = height - along + gap if corner[0] else gap
    draw.text((left, top), "tension", fill=INK, font=font, anchor="lt")
    top += round(0.05 * height)
    bar_width, bar_height = (max(4, round(size * height)) for size in _BAR)
    colours = np.round(255 * tension_colours(np.linspace(1.0, 0.0, bar_height))[:, :3]).astype(np.uint8)
    bar = np.repeat(colours[:, np.newaxis], bar_width, axis=1)
    canvas.paste(Image.fromarray(bar), (left, top))
    beside = left + bar_width + gap // 2
    for share in (1.0, 0.5, 0.0):
        at = top + round((1.0 - share) * (bar_height - 1))
        draw.text((beside, at), f"{share * full_N:.3g} N", fill=INK, font=font, anchor="lm")
    return np.asarray(canvas)
