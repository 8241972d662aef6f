"""What every stage of a diagnosis may use: where fits run, and how to say what is being done."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from catheter_sim.diagnosis.fitting.workers import Workers, workers
from catheter_sim.progress import Stages


@dataclass(frozen=True)
class Run:
    """A diagnosis that is under way.

    Attributes:
        pool: where to fit.
        say: called with a line where a stage, or a step of it, begins.
        deadline: on the clock of `time.monotonic`, when a search for causes ends with the best so far [s].
        search_anyway: look for causes where too little was measured to name any, too.
    """

    pool: Workers
    say: Callable[[str], None]
    deadline: float = math.inf
    search_anyway: bool = False


@contextmanager
def running(
    place: Workers, progress: bool, budget_s: float = math.inf, search_anyway: bool = False
) -> Iterator[Run]:
    """Give a run whose processes or cluster stay up until it ends.

    Args:
        place: where to fit.
        progress: show what is being done where standard error is a terminal.
        budget_s: seconds after which a search for causes ends with the best so far.
        search_anyway: look for causes where too little was measured to name any, too.

    Raises:
        InputError: no scheduler answers, or Dask is not installed.
    """
    with Stages("diagnose", progress, budget_s=budget_s) as stages, workers(place) as pool:
        yield Run(pool, stages.say, time.monotonic() + budget_s, search_anyway)
