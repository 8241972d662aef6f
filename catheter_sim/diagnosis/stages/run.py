"""What every stage of a diagnosis may use: where fits run, and how to say what is being done."""

from __future__ import annotations

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
    """

    pool: Workers
    say: Callable[[str], None]


@contextmanager
def running(place: Workers, progress: bool) -> Iterator[Run]:
    """Give a run whose processes or cluster stay up until it ends.

    Args:
        place: where to fit.
        progress: show what is being done where standard error is a terminal.

    Raises:
        InputError: no scheduler answers, or Dask is not installed.
    """
    with Stages("diagnose", progress) as stages, workers(place) as pool:
        yield Run(pool, stages.say)
