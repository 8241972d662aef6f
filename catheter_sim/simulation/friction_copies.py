"""The shipped friction law of many copies of one robot: `friction.CapstanFriction`, each with its history."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco.batch import Batch

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import TendonPaths
from catheter_sim.mechanics.capstan import solve_tensions_of_copies
from catheter_sim.simulation.friction import SWEEP_TOLERANCE, SWEEPS, CapstanFriction


class CapstanCopies(CapstanFriction):
    """The law in the copies of a batch, one compiled loop over them; the numbers are those of one copy."""

    def __init__(
        self,
        mu: float,
        paths: TendonPaths,
        model: mujoco.MjModel,
        batch: Batch,
        drive_stiffness: Array,
        ten_J: Array | None = None,
    ) -> None:
        """Prepare the law.

        Args:
            mu: friction coefficient.
            paths: where the tendons rub.
            model: what they are in.
            batch: its copies.
            drive_stiffness: as of `CapstanFriction`.
            ten_J: where the copies' tendon Jacobians are, shape (m, e); default: in the batch.
        """
        super().__init__(mu, paths, model, drive_stiffness)
        self._turns_of = self._turns.of_copies
        tendons, spans = self._tension.shape
        self._of = np.zeros((2, batch.nsim, tendons, spans))  # tensions and turns
        self._pasts = np.zeros((batch.nsim, tendons, spans + 2))
        self._slips = np.zeros((batch.nsim, tendons, spans), dtype=np.int8)
        names = "qpos", "qvel", "site_xpos", "qfrc_passive", "qfrc_bias", "qfrc_constraint"
        self._bound = {name: batch.bind(name) for name in names}
        self._bound["ten_J"] = batch.bind("ten_J") if ten_J is None else ten_J

    @property
    def tension(self) -> Array:
        """Tension of every tendon in every span after a step, shape (m, t, n) [N]; of use inside its end."""
        return self._of[0]

    def forget(self, copies: Index) -> None:
        """Forget the history of some copies."""
        self._of[0, copies], self._slips[copies], self._pasts[copies] = 0.0, 0, 0.0

    def apply_copies(self, copies: Index, entering: Array, applied: Array) -> None:
        """`apply` in some of the m copies.

        Args:
            copies: which.
            entering: tensions at the actuators now, shape (m, t) [N].
            applied: in and out: applied forces, shape (m, nv).
        """
        rows, bound = self._rows, self._bound
        tension, turn = self._of
        self._turns_of(copies, bound["qpos"], bound["site_xpos"], turn)
        solve_tensions_of_copies(
            copies,
            self._mu,
            entering,
            self._drive,
            turn,
            self._ends,
            bound["ten_J"],
            rows.starts,
            rows.entries,
            rows.columns,
            self._span,
            self._lines,
            bound["qvel"],
            bound["qfrc_passive"],
            bound["qfrc_bias"],
            bound["qfrc_constraint"],
            applied,
            self._yielding,
            SWEEPS,
            SWEEP_TOLERANCE,
            tension,
            self._slips,
            self._pasts,
            self._holes,
            self._pulls,
            self._scratch,
            self._shared,
            self._busy,
            np.zeros((0, 0)),
        )
