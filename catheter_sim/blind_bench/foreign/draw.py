"""A draw: a data set of a foreign model with one hidden cause, and whether a diagnosis names it."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from catheter_sim.blind_bench.foreign.nature import SUBJECTS, Hidden, Subject, hide, recordings
from catheter_sim.foreign.diagnose import ForeignDiagnosis, diagnose_foreign
from catheter_sim.foreign.model import ForeignModel
from catheter_sim.tables import Table, write_table

_KEY = 97
NOTHING_EVERY = 6  # each so-many-th draw hides nothing
SETTLE_S = 1.0


def drawn(models: Path, seed: int, index: int, work: Path) -> dict[str, Any]:
    """Return the result of one draw; the arguments decide everything but the seconds.

    Args:
        models: folder with a folder for each subject.
        seed, index: of the draw.
        work: folder in which the data set is written.
    """
    subject, hidden, generator = hidden_of(seed, index)
    folder = write_dataset(models, subject, hidden, generator, work / f"draw_{index:03d}")
    begun = time.monotonic()
    found = diagnose_foreign(folder)
    return {
        "seed": seed,
        "index": index,
        "model": subject.name,
        "hidden": None if hidden is None else {"cause": hidden.cause, "size": round(hidden.size, 4)},
        **said(found),
        "seconds": round(time.monotonic() - begun, 1),
    }


def hidden_of(seed: int, index: int) -> tuple[Subject, Hidden | None, np.random.Generator]:
    """Return the subject of a draw, what it hides and the generator of the rest."""
    generator = np.random.default_rng((_KEY, seed, index))
    names = list(SUBJECTS)
    subject = SUBJECTS[names[index % len(names)]]
    nothing = index % NOTHING_EVERY == NOTHING_EVERY - 1
    return subject, None if nothing else hide(subject, generator), generator


def said(found: ForeignDiagnosis) -> dict[str, Any]:
    """Return what a diagnosis says, as a document."""
    gain, low, high = found.gain_percent()
    return {
        "verdict": found.verdict,
        "named": list(found.causes),
        "best": {number.name: round(value, 5) for number, value in found.best.fit.values.items()},
        "indistinguishable": [list(group) for group in found.indistinguishable],
        "times_noise": [round(found.before.times_noise, 2), round(found.best.times_noise, 2)],
        "gain_percent": [round(value, 1) for value in (gain, low, high)],
        "weights": {name: round(value, 3) for name, value in found.weights.items() if value > 1e-3},
    }


def write_dataset(
    models: Path, subject: Subject, hidden: Hidden | None, generator: np.random.Generator, folder: Path
) -> Path:
    """Write a data set of three trials, the last held out; return its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    file = f"{subject.name}.xml"
    shutil.copyfile(models / subject.name / file, folder / file)
    inputs = ForeignModel(folder / file).input_columns
    trials = recordings(models / subject.name, subject, hidden, generator)
    entries = []
    for number, (time_s, controls, readings) in enumerate(trials, start=1):
        columns = {name: controls[:, k] for k, name in enumerate(inputs)}
        columns |= {name: np.round(readings[:, k], 4) for k, name in enumerate(subject.columns)}
        write_table(Table(time_s, columns), folder / f"trial_{number}.csv")
        role = "heldout" if number == len(trials) else "train"
        entries.append({"file": f"trial_{number}.csv", "role": role})
    document = {
        "dataset": {"name": subject.name, "robot": file, "source": "simulated", "licence": "CC0-1.0"},
        "conditions": {"gravity_mps2": [0.0, 0.0, -9.81], "motion": "dynamic", "settle_s": SETTLE_S},
        "channels": {"inputs": list(inputs), "outputs": subject.columns},
        "trials": entries,
    }
    (folder / "dataset.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    return folder
