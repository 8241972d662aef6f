"""A history of inputs as what a simulator is given: its rows, or their means over steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.loads import LinkForce
from catheter_sim.simulation.simulator import Simulator


class Commands:
    """Inputs of a run.

    Attributes:
        time_s: of the rows, shape (r,).
        rows: inputs of all kinds in one row, SI, shape (r, c).
    """

    def __init__(self, inputs: Inputs, others: Sequence[LinkForce] = ()) -> None:
        """Take inputs over; `others` are forces on elements that stay as they are."""
        count = len(inputs)
        self.time_s = inputs.time_s
        self.rows = np.concatenate(
            [
                inputs.tendon,
                inputs.force_tip,
                inputs.moment_tip,
                np.concatenate([inputs.force_body, inputs.moment_body], axis=2).reshape(count, -1)
                if inputs.bodies
                else np.zeros((count, 0)),
            ],
            axis=1,
        )
        self._tendons, self._bodies, self._others = inputs.tendon.shape[1], inputs.bodies, tuple(others)
        self._times = self.time_s - self.time_s[0]
        self._slopes = np.zeros_like(self.rows)
        self._slopes[:-1] = np.diff(self.rows, axis=0) / np.diff(self.time_s)[:, np.newaxis]
        between = 0.5 * np.diff(self.time_s)[:, np.newaxis] * (self.rows[:-1] + self.rows[1:])
        self._integral = np.concatenate([np.zeros((1, self.rows.shape[1])), np.cumsum(between, axis=0)])

    def set(self, simulator: Simulator, values: Array) -> None:
        """Give a simulator the numbers of one row, shape (c,)."""
        t = self._tendons
        on_bodies = [
            LinkForce(body, None, _plain(part[:3]), _plain(part[3:]))
            for body, part in zip(self._bodies, values[t + 6 :].reshape(-1, 6), strict=True)
        ]
        others = (*self._others, *on_bodies)
        simulator.put_inputs(values[:t], values[t : t + 3], values[t + 3 : t + 6], others)

    def means(self, at_s: Array, width_s: float) -> Array:
        """Return the inputs' means over windows about times since the first row, shape (k, c).

        On the line between two rows that is the value itself; where rows are closer than a step, each
        counts as long as it lasts. Before the first row and after the last one inputs stay as they are there.

        Args:
            at_s: middles of the windows, shape (k,) [s].
            width_s: of each window [s].
        """
        half = 0.5 * width_s
        return np.asarray((self._integrals(at_s + half) - self._integrals(at_s - half)) / width_s)

    def _integrals(self, at_s: Array) -> Array:
        """Return the inputs' integrals from the first row to times since then, shape (k, c)."""
        times, rows = self._times, self.rows
        row = np.clip(np.searchsorted(times, at_s, side="right") - 1, 0, len(times) - 1)
        beyond = (at_s - times[row])[:, np.newaxis]
        slope = np.where(beyond >= 0.0, self._slopes[row], 0.0)
        return np.asarray(self._integral[row] + beyond * (rows[row] + 0.5 * slope * beyond))


def _plain(vector: Array) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
