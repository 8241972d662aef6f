"""The beginning of each trial that is played and not judged: a stretch cut out of a longer recording.

A trial is simulated from rest under its first row's inputs. A stretch of a longer recording does not begin
so: the robot was on its way, or had been bent before. With its inputs from a while earlier the simulation has
forgotten its own beginning when the first measured row comes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from catheter_sim.core.requirements import as_number
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.errors import InputError, shown


def judged_late(trials: Sequence[Trial], seconds: Any, where: str) -> tuple[Trial, ...]:
    """Return trials that are judged from `seconds` after their first row on, a value from a file or a caller.

    Raises:
        InputError: it is no time, or leaves no measured value of a trial.
    """
    checked = warm_up_time(seconds, where)
    return tuple(judged_after(trial, checked, where) for trial in trials)


def warm_up_time(value: Any, where: str) -> float:
    """Return the time [s] that a file or a caller states; raise `InputError` where it is none."""
    seconds = as_number(value)
    if seconds is None:
        raise InputError(f"{where}: a number of seconds is needed, not {shown(value)}")
    if not 0.0 <= seconds < math.inf:
        raise InputError(f"{where}: a finite number of seconds, 0 or more, is needed, not {shown(value)}")
    return seconds


def judged_after(trial: Trial, seconds: float, where: str) -> Trial:
    """Return a trial whose outputs are missing until `seconds` after its first row.

    Raises:
        InputError: no measured value is left.
    """
    if not seconds:
        return trial
    time_s = trial.outputs.time_s
    early = time_s - time_s[0] < seconds
    columns = {name: np.where(early, np.nan, values) for name, values in trial.outputs.columns.items()}
    if all(np.isnan(values).all() for values in columns.values()):
        raise InputError(
            f"{where}: {seconds:g} s leave no measured value of {trial.file}, "
            f"which lasts {time_s[-1] - time_s[0]:g} s"
        )
    return replace(trial, outputs=replace(trial.outputs, columns=columns))
