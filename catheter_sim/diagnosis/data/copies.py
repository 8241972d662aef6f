"""A held-out trial that is a training trial once more is refused."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from catheter_sim.diagnosis.data.parting import split
from catheter_sim.diagnosis.data.trials import Dataset, Trial, all_inputs, measured_of
from catheter_sim.errors import InputError, shown


def refuse_copies(dataset: Dataset, digests: Mapping[str, bytes], where: str) -> None:
    """Refuse a held-out trial that is a training trial once more, byte for byte.

    Measured data never repeat to the last digit, so that such a trial was copied, and a fit would be tested
    on what it was fitted to. A repeated measurement is no copy, nor is a trial of one row or in which nothing
    changes.

    Args:
        dataset: the data.
        digests: of each trial's bytes.
        where: what to call the data in the error.
    """
    first: dict[bytes, str] = {}
    copies: dict[str, str] = {}
    changing = {trial.file for trial in dataset.trials if _changes(trial)}
    for file, digest in digests.items():
        if file in changing and first.setdefault(digest, file) != file:
            copies[file] = first[digest]
    if not copies or all(trial.role == "train" for trial in dataset.trials):
        return
    roles = {trial.file: trial.role for part in split(dataset) for trial in part}
    for copy, original in copies.items():
        if roles[copy] != roles[original]:
            raise InputError(
                f"{where}: trials: {shown(copy)} is a copy of {shown(original)}, byte for byte, and one of "
                "them trains while the other is held out; leave one of them out"
            )


def _changes(trial: Trial) -> bool:
    values = np.hstack([all_inputs(trial.inputs), measured_of(trial, tuple(trial.outputs.columns))])
    return bool((values != values[0]).any())
