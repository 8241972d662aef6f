"""The lumped models of a subsegment and their numbers."""

from __future__ import annotations

import numpy as np

# Models: one arc per subsegment (d = 3); four rigid links (d = 5), the bending plane and the twist
# balanced at the subsegment's base; the same, balanced at its middle and its end.
ARC, LINKS, LINKS_MIDDLE = 0, 1, 2
DEGREES = (3, 5, 5)
PLANE = 3  # which unknown of the links is the bending plane's angle
# Rao 2021, Table 1, divided by their sum 0.999 so that the links are as long as the subsegment.
LINK_SHARES = np.array([0.125, 0.35, 0.388, 0.136]) / 0.999
SPRING_FACTORS = np.array([3.25, 2.84, 2.95])
