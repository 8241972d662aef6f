"""Whether a cause's fitted numbers are likely at all: a fit also uses causes to soak up what is missing."""

from __future__ import annotations

from collections.abc import Sequence

from catheter_sim.core.effect import Parameter
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import Cause


def implausible(result: Fit) -> dict[str, tuple[str, ...]]:
    """Return the numbers that are not likely, by cause; a cause all of whose numbers are is not in it.

    A number is not if it stands at a bound that is not the value that does nothing, or beyond what is likely
    of a robot that was built to its specification (`Parameter.likely`).
    """
    found: dict[str, tuple[str, ...]] = {}
    for fitted, held in zip(result.numbers, result.held, strict=True):
        value = result.values[fitted.key]
        bound = held and value != fitted.parameter.null
        if fitted.effect and (bound or not _likely(fitted.parameter, value)):
            found[fitted.effect] = (*found.get(fitted.effect, ()), fitted.parameter.name)
    return found


def soaking_notes(soaked: Sequence[Cause]) -> list[Note]:
    """Return what to say of causes that are not plausible."""
    return [
        Note(
            "not_plausible",
            f"{cause.name.replace('_', ' ').capitalize()} lowers the error only with implausible numbers: "
            f"{', '.join(cause.parameters)}. The fit uses it to take up an error of another origin, so it is "
            "left out of the corrected robot.",
        )
        for cause in soaked
    ]


def _likely(parameter: Parameter, value: float) -> bool:
    low, high = parameter.likely or (parameter.lower, parameter.upper)
    return low <= value <= high
