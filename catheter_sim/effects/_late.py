"""A lag and a delay as an effect's memory, of commands or of what is observed."""

from __future__ import annotations

from dataclasses import dataclass

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Values
from catheter_sim.core.robot import RobotSpec
from catheter_sim.mechanics.hysteresis import Past, lagged, late_step


@dataclass(frozen=True)
class Late:
    """A first-order lag and a delay, all numbers alike.

    Attributes:
        lag, delay: names of the parameters that hold them [s].
    """

    lag: str
    delay: str
    timed = True

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> Past | None:
        """Return the state at rest; None without lag and delay."""
        lag_s, delay_s = values.get(self.lag, 0.0), values.get(self.delay, 0.0)
        return Past(lag_s, delay_s, rest) if lag_s > 0.0 or delay_s > 0.0 else None

    def step(self, state: Past, before: Array, after: Array, dt_s: float) -> tuple[Past, Array]:
        """Return the state and what comes out when what goes in has moved from `before` to `after`."""
        return late_step(state, before, after, dt_s)

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what comes out at each row, same shape as `rows`, from rest."""
        return lagged(time_s, rows, values.get(self.lag, 0.0), values.get(self.delay, 0.0), rest)
