"""Causes that are not on the list of effects: a kinked cell, an eccentric pulley, random slip.

No effect of `effects` has their form. Each has one size, and does nothing at size zero.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.drive import pulls_alone
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture

_SLIPS_A_ROW = 0.12  # share of the rows at which a tendon slips


@dataclass(frozen=True)
class Outside:
    """A cause outside the list; this one does nothing.

    Attributes:
        size: how much of it.
        numbers: what else was drawn, by name.
    """

    size: float
    numbers: Mapping[str, float]

    def change_inputs(self, inputs: Inputs) -> Inputs:
        """Return what arrives instead of `inputs`."""
        return inputs

    def change_postures(self, postures: tuple[Posture, ...]) -> tuple[Posture, ...]:
        """Return where the robot is instead of `postures`."""
        return postures


@dataclass(frozen=True)
class KinkedCell(Outside):
    """One element folds: beyond a small bend (`fold_from_rad`) it bends by `size` times what exceeds that.

    `element` counts from 0 at the base. All that is distal to it turns with it.
    """

    def change_postures(self, postures: tuple[Posture, ...]) -> tuple[Posture, ...]:
        """Return the postures with the fold in them."""
        return tuple(self._folded(posture) for posture in postures)

    def _folded(self, posture: Posture) -> Posture:
        index = int(self.numbers["element"])
        hinge = posture.p_w[index - 1]
        base = posture.R_w[index - 1]
        bend = Rotation.from_matrix(base.T @ posture.R_w[index]).as_rotvec()
        angle = float(np.linalg.norm(bend))
        excess = self.size * max(angle - self.numbers["fold_from_rad"], 0.0)
        if excess == 0.0:
            return posture
        turn = base @ Rotation.from_rotvec(bend / angle * excess).as_matrix() @ base.T
        p_w, R_w = posture.p_w.copy(), posture.R_w.copy()
        p_w[index:] = hinge + (p_w[index:] - hinge) @ turn.T
        R_w[index:] = turn @ R_w[index:]
        return replace(posture, p_w=p_w, R_w=R_w)


@dataclass(frozen=True)
class EccentricPulley(Outside):
    """A pulley that runs out of true: every input u arrives as u + `size` times the amplitude
    `wave` (sin(2 pi u / `period` + `phase_rad`) - sin(`phase_rad`)), zero at zero; never a push."""

    def change_inputs(self, inputs: Inputs) -> Inputs:
        """Return the inputs with the wave on them."""
        period, phase = self.numbers["period"], self.numbers["phase_rad"]
        wave = np.sin(2.0 * np.pi * inputs.tendon / period + phase) - np.sin(phase)
        return _replaced(inputs, self.size * self.numbers["wave"] * wave, int(self.numbers["pulled"]))


@dataclass(frozen=True)
class RandomSlip(Outside):
    """A clamp that slips at random under load: at some rows each tendon loses, for all rows of the cycle
    that follow, a share of its input, drawn anew; `size` is the share's scale. `seed` and the trial's
    inputs and clock make the draw, `again` makes that of a repeated trial another one."""

    def change_inputs(self, inputs: Inputs) -> Inputs:
        """Return the inputs with the slips in them."""
        key = zlib.crc32(inputs.tendon.tobytes()), int(self.numbers["seed"]), int(self.numbers["again"])
        generator = np.random.default_rng(key)
        share = np.zeros_like(inputs.tendon)
        for column in range(share.shape[1]):
            now = 0.0
            slips = generator.random(len(share)) < _SLIPS_A_ROW
            levels = generator.uniform(-1.0, 1.0, len(share))
            for row in range(len(share)):
                now = levels[row] if slips[row] else now
                share[row, column] = now
        return _replaced(inputs, -self.size * share * inputs.tendon, int(self.numbers["pulled"]))


OUTSIDE: Mapping[str, type[Outside]] = {
    "kinked_cell": KinkedCell,
    "eccentric_pulley": EccentricPulley,
    "random_slip": RandomSlip,
}


def drawn_numbers(
    name: str,
    generator: np.random.Generator,
    elements: tuple[int, ...],
    bends_rad: Array,
    reach: float,
    pulled: int,
) -> dict[str, float]:
    """Return what a cause outside the list has besides its size.

    Args:
        name: in `OUTSIDE`.
        generator: draws.
        elements: those that may fold, counted from 0.
        bends_rad: bend of each element at each row without the cause, shape (n, r).
        reach: largest input of any channel that pulls [N, or m].
        pulled: so many inputs, the first ones, are tendons' (a tube's advance is none).
    """
    if name == "kinked_cell":
        element = int(generator.choice(elements))
        largest = float(np.abs(bends_rad[element]).max())
        return {"element": element, "fold_from_rad": generator.uniform(0.2, 0.5) * largest}
    if name == "eccentric_pulley":
        return {
            "period": generator.uniform(0.2, 0.5) * reach,
            "phase_rad": generator.uniform(0.0, 2.0 * np.pi),
            "wave": 0.01 * reach,
            "pulled": pulled,
        }
    return {"seed": float(generator.integers(2**31)), "again": 0.0, "pulled": pulled}


def _replaced(inputs: Inputs, added: Array, pulled: int) -> Inputs:
    tendon = inputs.tendon.copy()
    tendon[:, :pulled] += added[:, :pulled]
    return replace(inputs, tendon=pulls_alone(inputs.actuation, tendon))
