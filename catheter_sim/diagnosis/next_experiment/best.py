"""The best next experiment: of what a bench can play, what tells most between the hypotheses still alive.

The information of each programme (`information`) less a price for its duration (`NATS_PER_MINUTE`). For the
best one, whether one more sensor would tell more; and, as in `propose`, by how much each rival, fitted anew
to the data and to what the most believed one says of the programme, would still be off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers, map_calls
from catheter_sim.diagnosis.next_experiment.alive import Alive
from catheter_sim.diagnosis.next_experiment.information import Information
from catheter_sim.diagnosis.next_experiment.predictives import told_by
from catheter_sim.diagnosis.next_experiment.programmes import Programme
from catheter_sim.diagnosis.next_experiment.refits import by_fits, off_by
from catheter_sim.diagnosis.next_experiment.sensors import Sensor, further_sensors, sizes_of
from catheter_sim.diagnosis.next_experiment.within_limits import Bench, programmes_within
from catheter_sim.diagnosis.thresholds import NATS_PER_MINUTE, REFITTED_PROGRAMMES


@dataclass(frozen=True)
class Worth:
    """A programme with what it is expected to tell.

    Attributes:
        programme: the inputs.
        minutes: its duration.
        information: between hypothesis and data.
        score: the information less the price of the duration [nat].
    """

    programme: Programme
    minutes: float
    information: Information
    score: float


@dataclass(frozen=True)
class BestExperiment:
    """The experiment to make next.

    Attributes:
        hypotheses: those that it is to tell apart.
        ranking: every programme that could be played, best first; (): none could.
        sensors: what one more sensor would tell with the best one, most first; only what is worth it.
        off: by how many times the noise each other hypothesis, fitted anew, would be off on the best
            programme if the most believed one were right, by what it is about.
    """

    hypotheses: tuple[Alive, ...]
    ranking: tuple[Worth, ...]
    sensors: tuple[Sensor, ...] = ()
    off: Mapping[str, float] = field(default_factory=dict)

    @property
    def best(self) -> Worth:
        """The first of the ranking."""
        return self.ranking[0]


def best_experiment(
    problem: Problem,
    hypotheses: Sequence[Alive],
    bench: Bench,
    noise: Mapping[str, float],
    gravity_mps2: Array,
    price: float = NATS_PER_MINUTE,
    pool: Workers = SERIAL,
) -> BestExperiment:
    """Return the experiment that tells most between hypotheses.

    Args:
        problem: the training trials so far.
        hypotheses: those alive, fitted to them.
        bench: what can be played.
        noise: floor of each unit, in it.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        price: of a minute [nat].
        pool: where to compute.
    """
    choices = programmes_within(bench)
    size = sizes_of(problem.columns, noise)
    work = [(problem, tuple(hypotheses), item, size) for item in choices]
    worths = []
    for programme, found in zip(choices, map_calls(pool, told_by, work), strict=True):
        if found is not None:
            minutes = float(programme.table.time_s[-1] - programme.table.time_s[0]) / 60.0
            worths.append(Worth(programme, minutes, found, found.nats - price * minutes))
    worths.sort(key=lambda item: -item.score)
    if not worths:
        return BestExperiment(tuple(hypotheses), ())
    worths = _checked_by_fits(problem, tuple(hypotheses), worths, size, price, pool)
    best = worths[0].programme
    sensors = further_sensors(problem, hypotheses, best, noise, gravity_mps2, worths[0].information.nats)
    return BestExperiment(tuple(hypotheses), tuple(worths), sensors, off_by(problem, hypotheses, best, size))


def _checked_by_fits(
    problem: Problem,
    hypotheses: tuple[Alive, ...],
    worths: Sequence[Worth],
    noise: Array,
    price: float,
    pool: Workers,
) -> list[Worth]:
    """Return the ranking with information no more than fits confirm, of the first programmes.

    The first is fitted until the one that comes first has been.
    """
    ranking, done = list(worths), set()
    for _ in range(REFITTED_PROGRAMMES):
        if ranking[0].programme.words in done:
            break
        item = ranking.pop(0)
        found = by_fits(problem, hypotheses, item.programme, noise, pool)
        told = min(found, item.information, key=lambda one: one.nats)
        ranking.append(Worth(item.programme, item.minutes, told, told.nats - price * item.minutes))
        ranking.sort(key=lambda one: -one.score)
        done.add(item.programme.words)
    return ranking
