"""How the simulation agrees with the measurements and with the twin, on the held-out trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.diagnosis.data.columns import TIP, unit_of
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.fitting.evidence import tip_errors
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import TrialFit
from catheter_sim.diagnosis.verdict.replay import Replay


def agreement_with_simulation(
    problem: Problem, heldout: Sequence[Trial], replays: Sequence[Replay], fits: Sequence[TrialFit]
) -> tuple[dict[str, float], list[Note]]:
    """Return the errors of MuJoCo, with the causes in it, on the held-out trials, and notes where a run
    failed."""
    extra: dict[str, float] = {}
    notes: list[Note] = []
    for trial, item in zip(heldout, replays, strict=True):
        if item.failure:
            notes.append(
                Note("simulation_failed", f"MuJoCo could not simulate {trial.file}: {item.failure}.")
            )
        if item.restless:
            said = f"In MuJoCo, {item.restless} rows of {trial.file} had not come to rest."
            notes.append(Note("simulation_restless", said))
    twins = [
        np.stack([item.after.columns[name] for name in problem.columns], axis=1)
        for item in fits
        if item.role == "heldout"
    ]
    for unit in dict.fromkeys(unit_of(name) for name in problem.columns):
        mine = np.array([unit_of(name) == unit for name in problem.columns])
        error = np.concatenate([(item.outputs - item.measured)[:, mine].ravel() for item in replays])
        apart = np.concatenate(
            [(item.outputs - twin)[:, mine].ravel() for item, twin in zip(replays, twins, strict=True)]
        )
        suffix = "" if unit == "1" else f"_{unit}"
        if np.isfinite(error).any():
            extra[f"heldout_simulation_rmse_after{suffix}"] = float(np.sqrt(np.nanmean(error**2)))
            extra[f"heldout_simulation_minus_twin_rms{suffix}"] = float(np.sqrt(np.nanmean(apart**2)))
    if all(name in problem.columns for name in TIP) and all(item.failure is None for item in replays):
        columns = {
            name: [
                (
                    item.outputs[:, problem.columns.index(name)],
                    item.measured[:, problem.columns.index(name)],
                )
                for item in replays
            ]
            for name in TIP
        }
        extra |= {
            f"heldout_simulation_{name.format('after')}": value for name, value in tip_errors(columns).items()
        }
    return extra, notes
