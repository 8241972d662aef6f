"""Writes a made draw: the two data sets in one folder, the answer in another."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from catheter_sim.blind_bench.interventions.make import Made
from catheter_sim.blind_bench.nature.courses import Course
from catheter_sim.blind_bench.nature.form import Planted
from catheter_sim.blind_bench.nature.ground import Ground, rms
from catheter_sim.blind_bench.nature.planting import Sized
from catheter_sim.blind_bench.nature.write import hidden_of, table_of
from catheter_sim.blind_bench.places import ANSWER, Folders, write_json, write_tables

OLD, NEW = "old", "new"  # folders of the two data sets in a draw's


def write_made(made: Made, folders: Folders, code: str) -> None:
    """Write a draw; the answer, last, says which code made it."""
    specimen = made.recordings.before.specimen
    courses = (made.recordings.before.courses, made.recordings.courses)
    for name, trials, outputs in zip((OLD, NEW), courses, made.outputs, strict=True):
        tables = [
            (table_of(specimen, course, values), course.role)
            for course, values in zip(trials, outputs, strict=True)
        ]
        about = f"{folders.name}, {name}"
        write_tables(
            folders.data / name, about, specimen.bench, specimen.columns, specimen.gravity_mps2, tables
        )
    write_json(answer_of(made) | {"made_by": code}, folders.answer / ANSWER)


def answer_of(made: Made) -> dict[str, Any]:
    """Return what changed in a draw, and what both recordings hide."""
    before, after = made.recordings.before, made.recordings.after
    specimen = before.specimen
    units = ["deg" if name.endswith("_deg") else "mm" for name in specimen.columns]
    return {
        "purpose": made.purpose,
        "seed": made.seed,
        "index": made.index,
        "attempt": made.attempt,
        "story": made.story,
        "commands": made.commands,
        "robot": made.robot,
        "hidden": [_change(after, item) for item in made.changed],
        "shared": [hidden_of(before, planted, rms(change)) for planted, change in made.shared],
        "noise": dict(zip(units, specimen.noise.tolist(), strict=True)),
        "noise_kind": made.noise_kind,
        "calibration": dict(specimen.factors),
        "gravity_mps2": specimen.gravity_mps2.tolist(),
        "rows": _rows(made.recordings.courses),
        "rows_before": _rows(before.courses),
        "refused": list(made.refused),
    }


def _change(ground: Ground, item: Sized) -> dict[str, Any]:
    """Return what changed, its parameters as changes of those that the specimen had.

    What a form has at no size, too, is how it acts, such as a time constant: it is told as it is.
    """
    planted, change = item
    found = hidden_of(ground, planted, rms(change))
    null = _parameters_at_rest(ground, planted)
    return found | {
        "parameters": {
            name: value - null[name]
            if math.isfinite(null.get(name, math.inf)) and value != null[name]
            else value
            for name, value in found["parameters"].items()
        }
    }


def _parameters_at_rest(ground: Ground, planted: Planted) -> Mapping[str, Any]:
    """Return the parameters of a form of no size; those that are infinite then may be missing."""
    nothing = Planted(planted.form, 0.0, planted.numbers)
    try:
        with np.errstate(divide="ignore"):
            return planted.form.parameters(nothing.acting(ground.specimen, ground.scale))
    except ZeroDivisionError:
        return {}


def _rows(courses: Sequence[Course]) -> int:
    return sum(len(course) for course in courses)
