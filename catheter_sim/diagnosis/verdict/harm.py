"""No harm: named causes may make no unit, no output and no held-out trial worse.

A hypothesis that fits one output at another one's cost has found something else than what is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.fitting.evidence import chance_of_gain, errors_of
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.residuals import column_of
from catheter_sim.diagnosis.fitting.stretches import blocks_of, trial_of
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.thresholds import HARM_CHANCE, HARM_NOISE, HARM_SHARE


@dataclass(frozen=True)
class Harm:
    """What a hypothesis makes worse on the held-out trials.

    Attributes:
        what: a unit, an output or a trial, in words.
        before, after: root mean square errors there, in `unit`.
        unit: of the errors.
    """

    what: str
    before: float
    after: float
    unit: str


def harms(test: Problem, before: Fit, after: Fit, noise: Mapping[str, float]) -> tuple[Harm, ...]:
    """Return what gets worse on the held-out trials by more than its noise and chance; worst first.

    Worse is an error that rises by more than `HARM_SHARE`, to more than `HARM_NOISE` times the noise, and in
    more stretches than chance explains (`HARM_CHANCE`, shared among what is looked at). Of a model that is
    known to be wrong, by more than that besides (`Problem.model_share`).

    Args:
        test: the held-out trials.
        before: the calibrated model.
        after: the hypothesis.
        noise: of each unit.
    """
    errors = errors_of(test, before), errors_of(test, after)
    block = blocks_of(test)
    parts = list(_parts(test))
    units = np.array([unit_of(name) for name in test.columns])[column_of(test)]
    found = []
    for what, unit, mine in parts:
        rms = [float(np.sqrt(np.mean(error[mine] ** 2))) for error in errors]
        known = test.model_share * float(np.sqrt(np.mean(errors[0][units == unit] ** 2)))
        if rms[1] <= max((1.0 + HARM_SHARE) * rms[0], HARM_NOISE * noise[unit], known):
            continue
        labels = np.unique(block[mine], return_inverse=True)[1]
        rise = np.bincount(labels, weights=errors[1][mine] ** 2 - errors[0][mine] ** 2).astype(float)
        if len(rise) < 2 or chance_of_gain(rise) <= HARM_CHANCE / len(parts):
            found.append(Harm(what, rms[0], rms[1], unit))
    return tuple(sorted(found, key=lambda item: item.before / max(item.after, 1e-300)))


def harm_note(after: Fit, found: tuple[Harm, ...]) -> Note:
    """Return what to say of causes that are not named because of what they make worse."""
    names = ", ".join(name.replace("_", " ") for name in after.causes)
    worst = found[0]
    return Note(
        "causes_do_harm",
        f"The best set found is {names}. It raises the held-out error of {worst.what} from "
        f"{worst.before:.3g} to {worst.after:.3g} {worst.unit}, so it is not used. Something else is wrong.",
    )


def _parts(test: Problem) -> Iterator[tuple[str, str, Array]]:
    """Yield units, outputs and trials: in words, the unit, and which residuals they have, shape (n,)."""
    columns = column_of(test)
    units = np.array([unit_of(name) for name in test.columns])
    trials = trial_of(test)
    for unit in dict.fromkeys(units.tolist()):
        mine = units[columns] == unit
        if len(set(units.tolist())) > 1 and mine.any():
            yield f"the outputs in {unit}", unit, mine
        for index, trial in enumerate(test.trials):
            if len(test.trials) > 1 and (mine & (trials == index)).any():
                yield f"{trial.file}", unit, mine & (trials == index)
    for index, name in enumerate(test.columns):
        if (columns == index).any():
            yield name, str(units[index]), columns == index
