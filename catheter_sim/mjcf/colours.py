"""Colours of what is drawn, red, green, blue and opacity."""

from __future__ import annotations

Colour = tuple[float, float, float, float]

PEEK: Colour = (0.86, 0.76, 0.60, 1.0)
PEEK_NEXT: Colour = (0.72, 0.62, 0.47, 1.0)  # every other segment, to tell them apart
NITI: Colour = (0.60, 0.63, 0.68, 1.0)
DISK: Colour = (0.83, 0.86, 0.90, 1.0)
DISK_NEXT: Colour = (0.66, 0.72, 0.80, 1.0)
FIXED: Colour = (0.33, 0.36, 0.41, 1.0)

# Pulled toward +x and -x in turn: warm and cool colours.
TENDON_COLOURS: tuple[Colour, ...] = (
    (0.84, 0.15, 0.16, 1.0),
    (0.12, 0.35, 0.75, 1.0),
    (0.93, 0.50, 0.10, 1.0),
    (0.10, 0.58, 0.62, 1.0),
    (0.75, 0.12, 0.50, 1.0),
    (0.30, 0.25, 0.65, 1.0),
)


def tendon_colour(index: int) -> Colour:
    """Return the colour of tendon `index`."""
    return TENDON_COLOURS[index % len(TENDON_COLOURS)]
