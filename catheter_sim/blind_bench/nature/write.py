"""Writes a made draw: the data set in one folder, the answer in another."""

from __future__ import annotations

from typing import Any

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.nature.courses import Course
from catheter_sim.blind_bench.nature.form import Planted
from catheter_sim.blind_bench.nature.ground import Ground
from catheter_sim.blind_bench.nature.make import Made
from catheter_sim.blind_bench.nature.specimen import Specimen
from catheter_sim.blind_bench.places import ANSWER, Folders, write_json, write_tables
from catheter_sim.channels import input_channels
from catheter_sim.tables import Table
from catheter_sim.units import si_factor


def write_made(made: Made, folders: Folders, code: str) -> None:
    """Write a draw; the answer, last, says which code made it."""
    specimen = made.ground.specimen
    tables = [
        (table_of(specimen, course, outputs), course.role)
        for course, outputs in zip(made.ground.courses, made.outputs, strict=True)
    ]
    write_tables(folders.data, folders.name, specimen.bench, specimen.columns, specimen.gravity_mps2, tables)
    write_json(answer_of(made) | {"made_by": code}, folders.answer / ANSWER)


def table_of(specimen: Specimen, course: Course, outputs: Array) -> Table:
    """Return a trial as a file's table: commands, then outputs."""
    found = {
        name: course.commands[:, index] / si_factor(name)
        for index, name in enumerate(input_channels(specimen.bench.robot))
    }
    found |= {name: outputs[:, index] for index, name in enumerate(specimen.columns)}
    return Table(course.time_s, found)


def answer_of(made: Made) -> dict[str, Any]:
    """Return what a draw hides."""
    specimen = made.ground.specimen
    units = ["deg" if name.endswith("_deg") else "mm" for name in specimen.columns]
    return {
        "purpose": made.purpose,
        "seed": made.seed,
        "index": made.index,
        "attempt": made.attempt,
        "story": made.story,
        "robot": made.robot,
        "hidden": [
            hidden_of(made.ground, planted, size)
            for planted, size in zip(made.planted, made.sizes, strict=True)
        ],
        "noise": dict(zip(units, specimen.noise.tolist(), strict=True)),
        "noise_kind": made.noise_kind,
        "calibration": dict(specimen.factors),
        "gravity_mps2": specimen.gravity_mps2.tolist(),
        "rows": sum(len(course) for course in made.ground.courses),
        "refused": list(made.refused),
    }


def hidden_of(ground: Ground, planted: Planted, size: float) -> dict[str, Any]:
    """Return what a planted form is; `size` is what it changes over the noise."""
    form = planted.form
    acting = planted.acting(ground.specimen, ground.scale)
    return {
        "cause": form.cause,
        "form": form.name,
        "known": form.known,
        "outside": form.outside,
        "law": form.law,
        "also": list(form.also),
        "size": planted.size,
        "numbers": dict(planted.numbers),
        "over_noise": size,
        "parameters": {name: float(value) for name, value in form.parameters(acting).items()},
    }
