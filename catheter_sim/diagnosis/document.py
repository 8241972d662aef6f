"""A diagnosis as `diagnosis.json`, and where it comes from: version, date, command, digest of the data."""

from __future__ import annotations

import hashlib
import math
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from catheter_sim.catalogue import read_toml
from catheter_sim.core.variation import MARK, table_of, variation_of
from catheter_sim.diagnosis.result import (
    NEXT_EXPERIMENT_FILE,
    Cause,
    DiagnosisResult,
    FittedParameter,
    Provenance,
    UnitResult,
)
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.errors import InputError

# ----------------------------------------------------------------------------------------------------
# Where a report comes from: version, time, command, and a digest of the data.


def stamped(diagnosis: DiagnosisResult, command: str = "") -> DiagnosisResult:
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


# ----------------------------------------------------------------------------------------------------
# A diagnosis as the document of `diagnosis.json`.
#
# It follows the project's contract; a number that is not finite becomes null there, and `undefined` says
# why. Undefined never passes a check.


def to_json(diagnosis: DiagnosisResult) -> dict[str, Any]:
    """Return `diagnosis` as the document of `diagnosis.json`.

    Every number has six significant digits. One that is not finite is None, and its dotted key
    stands under `undefined` with the reason.
    """
    head = diagnosis.headline
    document: dict[str, Any] = {
        "dataset": diagnosis.dataset.name,
        "robot": diagnosis.dataset.robot_reference,
        "unit": diagnosis.unit,
        "verdict": diagnosis.verdict,
        "noise_floor": head.noise_floor,
        "repeatability": dict(diagnosis.repeatability),
        "resolution": dict(diagnosis.resolution),
        "heldout": _heldout(head),
        "tip_mm": tip_mm(diagnosis),
        "floor": dict(diagnosis.floor.rmse),
        "causes": cause_entries(diagnosis.causes),
        "corrections": cause_entries(diagnosis.corrections),
        "absorbs": cause_entries(diagnosis.absorbs),
        "unproved": cause_entries(diagnosis.unproved.causes if diagnosis.unproved else ()),
        "probabilities": dict(diagnosis.probabilities),
        "evidence": {name: dict(numbers) for name, numbers in diagnosis.evidence.items()},
        "ranking": [asdict(candidate) for candidate in diagnosis.ranking],
        "indistinguishable": [list(group) for group in diagnosis.indistinguishable],
        "suspicions": [
            {"what": item.what, "where": item.where, "rows": list(item.rows)}
            for item in diagnosis.data_faults
        ],
        "registration": dict(diagnosis.registration),
        "next_experiment": diagnosis.next_experiment.words,
        "next_experiment_inputs": NEXT_EXPERIMENT_FILE if diagnosis.next_experiment.inputs else None,
        "next_experiment_over_noise": {
            name: asdict(item) for name, item in diagnosis.next_experiment.apart.items()
        },
        "by_unit": {
            unit: {"noise_floor": result.noise_floor, **_heldout(result)}
            for unit, result in diagnosis.by_unit.items()
        },
        "notes": [note.text for note in diagnosis.notes],
        "extra": dict(diagnosis.extra),
        "calibrated": _parameters(diagnosis.calibrated),
        "residual": {
            unit: {"times_noise": item.times_noise, "of": "held-out", "structure": list(item.structure)}
            for unit, item in diagnosis.residual.items()
        },
        "residual_tests": _residual_tests(diagnosis),
        **{name: text or None for name, text in asdict(diagnosis.provenance).items()},
    }
    return with_undefined(document)


def with_undefined(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a whole document with finite numbers; `undefined` says why others are missing."""
    finite, undefined = finite_document(document, "")
    return {**finite, "undefined": undefined} if undefined else dict(finite)


def tip_mm(diagnosis: DiagnosisResult) -> dict[str, Any] | None:
    """Return the tip's distance in space, root mean square over held-out rows; None: it was not measured."""
    before, after, aligned_before, aligned_after = (
        diagnosis.extra.get(f"heldout_tip_distance_rmse{aligned}_{stage}_mm")
        for aligned in ("", "_aligned")
        for stage in ("before", "after")
    )
    if before is None or after is None:
        return None
    aligned = None if aligned_after is None else {"before": aligned_before, "after": aligned_after}
    floor = diagnosis.floor.tip_mm
    return {"before": before, "after": after, "of": "held-out", "aligned": aligned, "floor": floor}


def finite_document(value: Any, key: str) -> tuple[Any, dict[str, str]]:
    """Return what stands in `diagnosis.json` under `key`, and why numbers of it are not finite."""
    undefined: dict[str, str] = {}
    return _finite(value, key, undefined), undefined


def cause_entries(causes: Sequence[Cause]) -> list[dict[str, Any]]:
    """Return causes as they stand in `diagnosis.json`, numbers not rounded."""
    return [
        {
            "name": cause.name,
            "parameters": _parameters(
                {name: item for name, item in cause.parameters.items() if MARK not in name}
            ),
            **_varying(cause),
            "gain_percent": cause.gain_percent,
            "form": cause.form,
            "forms_as_good": list(cause.forms_as_good),
            "probability": cause.probability,
            "plausible": cause.plausible,
            **({"one_of": list(cause.one_of), "members": dict(cause.members)} if cause.members else {}),
        }
        for cause in causes
    ]


def _varying(cause: Cause) -> dict[str, Any]:
    """Return how a cause's numbers vary, by `varies`, and as a `curve` where it was found as one."""
    varied = {variation_of(name): item for name, item in cause.parameters.items() if MARK in name}
    tables = [table_of(way, item.value) | {"ci95": list(item.ci95)} for way, item in varied.items()]
    hats = [(way, item) for way, item in varied.items() if way.shape == "hat"]
    if len(hats) < 2:
        return {"varies": tables} if tables else {}
    first = hats[0][0]
    own = cause.parameters.get(first.number)
    at_first = 0.0 if own is None else own.value
    curve = {
        "number": first.number,
        "with": first.along,
        "channel": first.channel or None,
        "grid": [first.at[0], *(way.at[1] for way, _ in hats)],
        "value": [at_first, *(at_first + item.value for _, item in hats)],
        "ci95": [
            list(own.ci95) if own else [at_first, at_first],
            *([at_first + end for end in item.ci95] for _, item in hats),
        ],
    }
    return {"varies": tables, "curve": curve}


def _residual_tests(diagnosis: DiagnosisResult) -> dict[str, list[dict[str, Any]]]:
    return {
        stage: [
            {
                "test": test.name,
                "coordinate": test.coordinate,
                "share_percent": test.share_percent,
                "p_value": test.p_value,
            }
            for test in tests
        ]
        for stage, tests in diagnosis.structure.items()
    }


def _parameters(parameters: Mapping[str, FittedParameter]) -> dict[str, Any]:
    return {name: {"value": item.value, "ci95": list(item.ci95)} for name, item in parameters.items()}


def _heldout(result: UnitResult) -> dict[str, Any]:
    return {
        "rmse_before": result.rmse_before,
        "rmse_after": result.rmse_after,
        "gain_percent": result.gain_percent,
        "gain_percent_ci95": list(result.gain_percent_ci95),
    }


def _finite(value: Any, key: str, undefined: dict[str, str]) -> Any:
    """Return `value` with its numbers rounded; note in `undefined` those that are not finite."""
    if isinstance(value, Mapping):
        return {
            name: _finite(item, f"{key}.{name}" if key else name, undefined) for name, item in value.items()
        }
    if isinstance(value, list | tuple):
        return [_finite(item, f"{key}.{index}", undefined) for index, item in enumerate(value)]
    if isinstance(value, bool) or value is None or isinstance(value, str | int):
        return value
    number = float(value)
    if not math.isfinite(number):
        undefined[key] = (
            "no value could be computed from these data" if math.isnan(number) else "infinite: not bounded"
        )
        return None
    return float(f"{number:.{_DIGITS}g}")


_DIGITS = 6  # significant, in diagnosis.json
