"""What to measure next, as a value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from catheter_sim.tables import Table

NEXT_EXPERIMENT_FILE = "next_experiment.csv"


@dataclass(frozen=True)
class Separation:
    """How well inputs tell two causes apart: root mean square of their difference over the noise.

    Attributes:
        twin: between the chosen cause and the other one, fitted anew, in the analytic twin.
        simulation: between the two in the simulation; NaN if it was not asked.
    """

    twin: float
    simulation: float


@dataclass(frozen=True)
class NextExperiment:
    """What to measure next: in words, and as inputs to play, if that helps.

    Attributes:
        words: for a person.
        inputs: in file units; None: none helps.
        apart: what the inputs do to effects that these data cannot tell apart, by "rival for chosen".
    """

    words: str
    inputs: Table | None = None
    apart: Mapping[str, Separation] = field(default_factory=dict)
