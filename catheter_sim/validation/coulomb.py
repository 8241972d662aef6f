"""Does a history of postures obey Coulomb's law at every eyelet? Judged from the postures alone.

Where a tendon slides over an eyelet, its tension must change there by the full capstan factor,
against the sliding. Sliding is the change of the tendon's length beyond the eyelet.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.robots.continuum.published import CELL_LENGTH_M, EYELET_OFFSET_M

SLIDES_M = 2e-6  # what counts as sliding between two rows; rest leaves less
CLEAR_SHARE = 0.9  # a tension change below this share of the full one is not slipping


def violations(postures: Sequence[Posture], mu: float) -> int:
    """Return how often the right tendon slid over an eyelet while its tension said that it stuck.

    Args:
        postures: of `neuroendoscope_section`, at closely spaced rows.
        mu: friction coefficient.
    """
    count = 0
    for before, after in itertools.pairwise(postures):
        slid = _lengths_beyond(after) - _lengths_beyond(before)
        ratio = _slip_ratio(after, mu)
        count += int(np.sum((np.abs(slid) > SLIDES_M) & (ratio * np.sign(slid) < CLEAR_SHARE)))
    return count


def _lengths_beyond(posture: Posture) -> Array:
    """Return the right tendon's length beyond each eyelet, base first, shape (n,) [m]."""
    half = posture.joint_angles / 2.0
    chords = CELL_LENGTH_M * np.cos(half) - 2.0 * EYELET_OFFSET_M * np.sin(half)
    return np.cumsum(chords[::-1])[::-1]


def _slip_ratio(posture: Posture, mu: float) -> Array:
    """Return log(tension behind / before) over mu times the turn: +1 slips out, -1 slips in, shape (n,)."""
    angles, tension = posture.joint_angles, posture.tendon_tension[0]
    turn = np.abs(angles + np.concatenate([[0.0], angles[:-1]])) / 2.0
    before = np.concatenate([posture.actuator_tension[:1], tension[:-1]])
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(tension / before) / (mu * turn)
    return np.where(turn > 1e-3, ratio, np.nan)  # comparisons with NaN are false: no turn, no friction
