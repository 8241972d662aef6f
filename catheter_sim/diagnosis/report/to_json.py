"""A diagnosis as the document of `diagnosis.json`.

It follows the project's contract; a number that is not finite becomes null there, and `undefined` says why.
Undefined never passes a check.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from catheter_sim.diagnosis.report.next_experiment import NEXT_EXPERIMENT_FILE
from catheter_sim.diagnosis.report.result import Cause, Diagnosis, FittedParameter, UnitResult


def to_json(diagnosis: Diagnosis) -> dict[str, Any]:
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
        "causes": _causes(diagnosis.causes),
        "corrections": _causes(diagnosis.corrections),
        "absorbs": _causes(diagnosis.absorbs),
        "unproved": _causes(diagnosis.unproved.causes if diagnosis.unproved else ()),
        "probabilities": dict(diagnosis.probabilities),
        "evidence": {name: dict(numbers) for name, numbers in diagnosis.evidence.items()},
        "ranking": _ranking(diagnosis),
        "indistinguishable": [list(group) for group in diagnosis.indistinguishable],
        "suspicions": [
            {"what": item.what, "where": item.where, "rows": list(item.rows)}
            for item in diagnosis.data_faults
        ],
        "registration": dict(diagnosis.registration),
        "next_experiment": diagnosis.next_experiment.words,
        "next_experiment_inputs": NEXT_EXPERIMENT_FILE if diagnosis.next_experiment.inputs else None,
        "next_experiment_over_noise": {
            name: {"twin": item.twin, "simulation": item.simulation}
            for name, item in diagnosis.next_experiment.apart.items()
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
    undefined: dict[str, str] = {}
    finite: dict[str, Any] = _finite(document, "", undefined)
    if undefined:
        finite["undefined"] = undefined
    return finite


def tip_mm(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """Return the tip's distance in space, root mean square over held-out rows; None: it was not measured."""
    before, after, aligned_before, aligned_after = (
        diagnosis.extra.get(f"heldout_tip_distance_rmse{aligned}_{stage}_mm")
        for aligned in ("", "_aligned")
        for stage in ("before", "after")
    )
    if before is None or after is None:
        return None
    aligned = None if aligned_after is None else {"before": aligned_before, "after": aligned_after}
    return {"before": before, "after": after, "of": "held-out", "aligned": aligned}


def causes_document(causes: Sequence[Cause], key: str) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Return causes as they stand in `diagnosis.json` under `key`, and why numbers of it are not finite."""
    return finite_document(_causes(causes), key)


def finite_document(value: Any, key: str) -> tuple[Any, dict[str, str]]:
    """Return what stands in `diagnosis.json` under `key`, and why numbers of it are not finite."""
    undefined: dict[str, str] = {}
    return _finite(value, key, undefined), undefined


def _causes(causes: Sequence[Cause]) -> list[dict[str, Any]]:
    return [
        {
            "name": cause.name,
            "parameters": _parameters(cause.parameters),
            "gain_percent": cause.gain_percent,
            "form": cause.form,
            "forms_as_good": list(cause.forms_as_good),
            "probability": cause.probability,
            "plausible": cause.plausible,
            **({"one_of": list(cause.one_of), "members": dict(cause.members)} if cause.members else {}),
        }
        for cause in causes
    ]


def _ranking(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    return [
        {
            "causes": list(candidate.causes),
            "heldout_rmse": candidate.heldout_rmse,
            "cross_validated_rmse": candidate.cross_validated_rmse,
        }
        for candidate in diagnosis.ranking
    ]


def _residual_tests(diagnosis: Diagnosis) -> dict[str, list[dict[str, Any]]]:
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
    if isinstance(value, list):
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
