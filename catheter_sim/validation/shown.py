"""What the validation's pictures show, as values: the checks make them, `plots` draws them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture


@dataclass(frozen=True)
class Against:
    """One history with friction, answered by the simulation, the complete statics, and a rule on tensions."""

    name: str
    rows_N: Array
    simulated: tuple[Posture, ...]
    analytic: tuple[Posture, ...]
    by_tensions: tuple[Posture, ...]


@dataclass(frozen=True)
class TermCurves:
    """The answers of every balance to the same tensions.

    Attributes:
        weight: "without weight" or "hanging".
        balances: name -> joint angles at `chest_tube_terms.TENSIONS_N`, shape (r, n) [deg].
        tips_mm: name -> tips at `chest_tube_terms.TENSIONS_N`, shape (r, 3) [mm].
        complete, simulated: joint angles at `chest_tube_terms.TENSIONS_N` and at
            `SIMULATED_N` [deg].
        complete_tips_mm: tips by the complete balance at `chest_tube_terms.TENSIONS_N`, shape (r, 3) [mm].
    """

    weight: str
    balances: dict[str, Array]
    tips_mm: dict[str, Array]
    complete: Array
    simulated: Array
    complete_tips_mm: Array


@dataclass(frozen=True)
class Loop:
    """One loop of the section, answered by the simulation and the static models."""

    name: str
    rows_N: Array
    simulated: tuple[Posture, ...]
    analytic: tuple[Posture, ...]
    local: tuple[Posture, ...]
    printed: tuple[Posture, ...]


@dataclass(frozen=True)
class Profiles:
    """Tension along the right tendon at three inputs, in arching and extending, and PCCA's."""

    inputs_N: tuple[float, ...]
    arching: Array
    extending: Array
    analytic_arching: Array
    analytic_extending: Array
    constant: Array


@dataclass(frozen=True)
class Motion:
    """A simulated motion and what the models say of it.

    Attributes:
        time_s: shape (r,).
        tip_mm: simulated, shape (r, 3).
        model_mm: by name, shape (r, 3) each.
    """

    time_s: Array
    tip_mm: Array
    model_mm: dict[str, Array]

    def rmse_mm(self, model: str) -> Array:
        """Return a model's root mean square error in x, y, z and in space, shape (4,) [mm]."""
        squared = ((self.model_mm[model] - self.tip_mm) ** 2).mean(axis=0)
        return np.sqrt(np.append(squared, squared.sum()))
