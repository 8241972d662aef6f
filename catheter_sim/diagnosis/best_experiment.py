"""The best next experiment after a diagnosis: hypotheses that are still alive, and what a bench can play."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from catheter_sim.channels import input_channels
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers
from catheter_sim.diagnosis.next_experiment.alive import alive_hypotheses
from catheter_sim.diagnosis.next_experiment.best import BestExperiment, best_experiment
from catheter_sim.diagnosis.next_experiment.within_limits import bench_of
from catheter_sim.diagnosis.pipeline import Investigation
from catheter_sim.diagnosis.thresholds import NATS_PER_MINUTE


def best_after(
    found: Investigation,
    ranges: Mapping[str, tuple[float, float]],
    longest_s: float,
    price: float = NATS_PER_MINUTE,
    pool: Workers = SERIAL,
) -> BestExperiment:
    """Return the experiment that tells most between the hypotheses that a diagnosis leaves alive.

    Args:
        found: the diagnosis with its hypotheses.
        ranges: least and most of each input that can be played, in its column's unit.
        longest_s: of one programme [s].
        price: of a minute of it [nat].
        pool: where to compute.
    """
    problem = found.posed.train
    steps = np.concatenate([np.diff(trial.inputs.time_s) for trial in problem.trials])
    columns = input_channels(problem.robot, problem.trials[0].inputs.actuation)
    bench = bench_of(columns, ranges, float(np.median(steps)), longest_s)
    alive = alive_hypotheses(found.diagnosis.probabilities, found.settled, found.equals, found.hypotheses)
    noise = {unit: result.noise_floor for unit, result in found.diagnosis.by_unit.items()}
    return best_experiment(problem, alive, bench, noise, found.posed.dataset.gravity_mps2, price, pool)
