"""Where a report comes from: version, time, command, and a digest of the data."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from catheter_sim.catalogue import read_toml
from catheter_sim.diagnosis.data.trials import Dataset
from catheter_sim.diagnosis.report.result import Diagnosis, Provenance
from catheter_sim.errors import InputError


def stamped(diagnosis: Diagnosis, command: str = "") -> Diagnosis:
    """Return a diagnosis with its provenance; one that has it already keeps it.

    `made` is the time now, or that of the environment variable `SOURCE_DATE_EPOCH`, by which two runs can be
    made alike to the last byte (reproducible-builds.org).
    """
    if diagnosis.provenance.made:
        return diagnosis
    given = os.environ.get("SOURCE_DATE_EPOCH", "")
    moment = time.gmtime(int(given) if given.isdecimal() else None)
    made = time.strftime("%Y-%m-%dT%H:%M:%SZ", moment)
    return replace(
        diagnosis, provenance=Provenance(_version(), made, command, data_digest(diagnosis.dataset))
    )


def _version() -> str:
    """Return the version of this package; "" where it is not installed."""
    try:
        return version("catheter-sim")
    except PackageNotFoundError:
        return ""


def data_digest(dataset: Dataset) -> str:
    """Return the SHA-256 of `dataset.toml` and the files that it names; of tables without a folder."""
    digest = hashlib.sha256()
    try:
        parts = list(_files(dataset) if dataset.source else _tables(dataset))  # a file must name its source
    except (OSError, InputError):
        parts = list(_tables(dataset))
    for name, content in parts:
        digest.update(f"{name}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()


def _files(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    listing = dataset.folder / "dataset.toml"
    yield listing.name, listing.read_bytes()
    for entry in read_toml(listing).get("trials", ()):
        for key in ("file", "inputs"):
            if key in entry:
                yield entry[key], (dataset.folder / entry[key]).read_bytes()


def _tables(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    for trial in dataset.trials:
        inputs = trial.inputs
        given = {
            "time_s": inputs.time_s,
            "tendon": inputs.tendon,
            "loads": np.hstack([inputs.force_tip, inputs.moment_tip]),
            "body_loads": np.stack([inputs.force_body, inputs.moment_body]),
        }
        for name, values in (given | dict(trial.outputs.columns)).items():
            yield f"{trial.file}:{name}", np.ascontiguousarray(values).tobytes()
