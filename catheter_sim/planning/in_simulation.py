"""A file's rows in the simulation itself, which shares nothing with the twin that found them.

A twin that keeps tensions by their own history may stick where the robot slides. A row that the simulation
misses by little is therefore searched for in the simulation: from what was found, and where that leads
nowhere and the robot has inputs to spare, from other inputs by which the twin reaches the target.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.columns import posture_columns
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import SimulationDiverged
from catheter_sim.planning.bounded import Found, least_squares
from catheter_sim.planning.drives import inputs_at
from catheter_sim.planning.forward import REMEMBERED
from catheter_sim.planning.rows import Rows
from catheter_sim.simulation.replay import simulate

GOOD = 0.3  # share of the tolerance below which the simulation's miss is left alone
_STEPS = 8  # of a search in the simulation
_OTHERS = 3  # ways of the twin, those that the simulation misses by least, from which it is searched


class InSimulation:
    """The rows of a file, simulated."""

    def __init__(self, rows: Rows, robot: RobotSpec, gravity_mps2: Array) -> None:
        self._rows, self._robot, self._gravity_mps2 = rows, robot, gravity_mps2

    def reached(self, found: Sequence[Found], progress: bool = False) -> Array:
        """Return the targets' columns by the simulation, shape (r, m).

        Raises:
            SimulationDiverged: the simulation left the finite numbers.
        """
        run = simulate(self._robot, self._rows.inputs(found), self._gravity_mps2, progress=progress)
        if run.failure is not None:
            raise SimulationDiverged(run.failure)
        return self._columns(run.postures)

    def row(self, found: Sequence[Found], row: int) -> Found | None:
        """Return inputs that reach a row's target after those of the rows before; None: none were found.

        Of the rows before, those are simulated that a twin is given.
        """
        other = self._search(found, row, found[row].point)
        if other is not None or not self._rows.spare:
            return other
        points = np.array([item.point for item in self._rows.others(found, row)])
        if not len(points):
            return None
        size = np.linalg.norm(self._misses(found, row, points), axis=1)
        for index in np.argsort(np.where(np.isfinite(size), size, np.inf))[:_OTHERS]:
            other = self._search(found, row, points[index])
            if other is not None:
                return other
        return None

    def _search(self, found: Sequence[Found], row: int, start: Array) -> Found | None:
        def misses(levels: Array) -> Array:
            return self._misses(found, row, levels)

        if not np.isfinite(misses(start[np.newaxis])).all():
            return None
        drives, tolerance = self._rows.drives, self._rows.tolerance
        other = least_squares(misses, start, drives.least, drives.most, GOOD * tolerance, steps=_STEPS)
        return other if other.size <= tolerance else None

    def _misses(self, found: Sequence[Found], row: int, levels: Array) -> Array:
        way = found[max(row - REMEMBERED, 0) if self._rows.remembers else row : row]
        seen = [self._last(way, row, level) for level in levels]
        return self._rows.targets.misses(np.array(seen), self._rows.targets.asked[row])

    def _last(self, way: Sequence[Found], row: int, level: Array) -> Array:
        """Return the targets' columns of one row by the simulation, after a way from rest; NaN: diverged."""
        levels = np.array([*(item.point for item in way), level])
        clock = self._rows.clock[row - len(way) : row + 1]
        inputs = inputs_at(self._rows.drives, levels, clock - clock[0])
        run = simulate(self._robot, inputs, self._gravity_mps2)
        if run.failure is not None:
            return np.full(len(self._rows.targets.names), np.nan)
        return self._columns(run.postures[-1:])[0]

    def _columns(self, postures: Sequence[Posture]) -> Array:
        targets = self._rows.targets
        columns = posture_columns(self._robot, postures, targets.observed)
        return targets.seen(np.stack([columns[name] for name in targets.observed], axis=1))
