"""The tendons' paths in many copies of one robot whose pulls are given: `site_tendons`, for a batch.

More than half of MuJoCo's step of a chain goes into them. A batch lets nobody write a Jacobian into its
copies, so that these find no paths at all; the actuators' pulls come by the applied forces, through slopes
that are found here. Tension that does not depend on lengths is all that this can be for.
"""

from __future__ import annotations

import copy

import mujoco
import numpy as np
from mujoco.batch import Batch

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.simulation.site_tendons import SiteTendons, find_slopes_of


class PathCopies(SiteTendons):
    """The paths in the copies of a batch of `pathless(model)`.

    Attributes:
        ten_J: of each copy, as MuJoCo's sparse rows, shape (m, e).
    """

    def __init__(self, model: mujoco.MjModel, batch: Batch) -> None:
        """Prepare; `site_tendons.applies(model)` must hold, and each actuator pull its own tendon."""
        super().__init__(model)
        row, count = model.ten_J_rowadr, model.ten_J_rownnz
        self.ten_J = np.zeros((batch.nsim, int((row + count).max())))
        tendons = model.actuator_trnid[:, 0]
        self._pulled = np.stack([row[tendons], count[tendons]], axis=1).astype(np.int64)
        self._column = model.ten_J_colind.astype(np.int64)
        self._points, self._anchors, self._axes = (
            batch.bind(name) for name in ("site_xpos", "xanchor", "xaxis")
        )

    def find_in(self, copies: Index) -> None:
        """Fill in some copies' `ten_J` at their present positions."""
        find_slopes_of(
            copies,
            self._stretches,
            self._ends,
            self._parts,
            self._slides,
            self._points,
            self._anchors,
            self._axes,
            self.ten_J,
        )

    def pull_in(self, copies: Index, tension: Array, applied: Array) -> None:
        """Add what tendons pull to some copies' applied forces.

        Args:
            copies: which of the m.
            tension: at the actuators, shape (m, t) [N].
            applied: in and out, shape (m, nv).
        """
        _pull_in(copies, self._pulled, self._column, self.ten_J, tension, applied)


def pathless(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy of `model` whose tendons have no paths and pull nothing."""
    without = copy.copy(model)
    without.tendon_num[:] = 0
    return without


@compiled
def _pull_in(
    copies: Index, pulled: Index, column: Index, ten_J: Array, tension: Array, applied: Array
) -> None:
    """Take the pulls of actuators, `pulled` (t, 2): first entry and number of each one's row in `ten_J`."""
    for i in copies:
        for j in range(pulled.shape[0]):
            pull = max(tension[i, j], 0.0)
            for place in range(pulled[j, 0], pulled[j, 0] + pulled[j, 1]):
                applied[i, column[place]] -= ten_J[i, place] * pull
