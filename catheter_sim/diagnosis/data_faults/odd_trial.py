"""One trial that errs where all others agree: another robot, or another set-up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.data_faults.model_error import errors_in_noise
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import OTHERS_NEAR_NOISE, OUTLYING_FACTOR


def odd_trial(
    problem: Problem, before: Fit, heldout: Sequence[Trial], noise: Mapping[str, float]
) -> tuple[DataFault, ...]:
    """Return what to say of one trial that errs where all others agree with a model calibrated to them."""
    trials = (*problem.trials, *heldout)
    if len(trials) < 3:
        return ()
    errors = errors_in_noise(problem, before, trials, noise)
    odd = int(np.argmax(errors))
    others = [trial for index, trial in enumerate(trials) if index != odd]
    if errors[odd] <= OUTLYING_FACTOR:
        return ()
    if odd < len(problem.trials):
        rest = replace(problem, trials=tuple(item for item in problem.trials if item is not trials[odd]))
        if not rest.trials:
            return ()
        before = fit(rest, (), cross_validate=False)
    most = errors_in_noise(problem, before, others, noise).max()
    alone = float(errors_in_noise(problem, before, [trials[odd]], noise)[0])
    if alone <= OUTLYING_FACTOR * max(most, 1.0) or most > OTHERS_NEAR_NOISE:
        return ()
    return (
        DataFault(
            f"The model misses this trial by {alone:.0f} times the noise and agrees with all other trials "
            f"(at most {most:.1f} times). Was it another robot or set-up?",
            trials[odd].file,
        ),
    )
