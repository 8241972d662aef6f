"""Sound recordings to spoil: a robot of the bench, few rows, a known cause in every other one or none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.nature.courses import drawn_courses
from catheter_sim.blind_bench.nature.engine import CannotMake, columns_of, looked_at, simulated
from catheter_sim.blind_bench.nature.form import Form, Planted
from catheter_sim.blind_bench.nature.forms import FORMS
from catheter_sim.blind_bench.nature.ground import Ground, rms
from catheter_sim.blind_bench.nature.noise import measured
from catheter_sim.blind_bench.nature.specimen import drawn_specimen
from catheter_sim.blind_bench.places import read_json, write_json
from catheter_sim.blind_bench.robots import BENCH_ROBOTS
from catheter_sim.blind_bench.spoiled.recording import Recording, Trial
from catheter_sim.channels import input_channels
from catheter_sim.units import si_factor

ROWS = (220, 420)  # of all trials together
_CLEAN, _ROBOT = 31, 32
_ATTEMPTS = 40
_FORMS = 12  # drawn for one recording
_SIZE = (8.0, 20.0)  # of a hidden cause, times the noise, beyond what a calibration takes
_POOL = 2 * len(BENCH_ROBOTS)


@dataclass(frozen=True)
class Clean:
    """A sound recording.

    Attributes:
        recording: the measurements.
        robot: the bench's name of it.
        hidden: what is at work: cause, form, other names that say the same, and its size over the noise.
    """

    recording: Recording
    robot: str
    hidden: tuple[Mapping[str, Any], ...]


def clean_number(kind: int, draw: int, step: int = 0) -> int:
    """Return the number of the recording that a draw of a kind spoils; even ones hide nothing.

    Args:
        kind: its place in the list.
        draw: of that kind, from 0.
        step: how many recordings before it could not be spoiled so.
    """
    return (2 * kind + draw + 2 * step + 2 * (draw // _POOL)) % _POOL


def clean_recording(seed: int, number: int, cache: Path, code: str) -> Clean:
    """Return a sound recording, from the cache where this very code made it.

    Raises:
        CannotMake: none of the attempts gave data.
    """
    place = cache / f"clean_{number:02d}"
    known = read_json(place.with_suffix(".json"))
    if known is None or known["made_by"] != code:
        known = _made(seed, number, place) | {"made_by": code}
        write_json(known, place.with_suffix(".json"))
    ground = _ground(seed, number, known["attempt"])
    with np.load(place.with_suffix(".npz")) as file:
        outputs = [file[f"trial_{k}"] for k in range(len(ground.courses))]
    return Clean(_recording(ground, outputs), known["robot"], tuple(known["hidden"]))


def _made(seed: int, number: int, place: Path) -> dict[str, Any]:
    refused = []
    for attempt in range(_ATTEMPTS):
        ground = _ground(seed, number, attempt)
        rows = sum(len(course) for course in ground.courses)
        if not ROWS[0] <= rows <= ROWS[1]:
            continue
        generator = np.random.default_rng((_CLEAN, seed, number, attempt, 1))
        try:
            hidden = (_planted(ground, generator),) if number % 2 else ()
            outputs = [_outputs(ground, [item[0] for item in hidden], k) for k in range(len(ground.courses))]
        except CannotMake as error:
            refused.append(str(error))
            continue
        noisy = [measured(values, ground.specimen.noise, "white", generator) for values in outputs]
        place.parent.mkdir(parents=True, exist_ok=True)
        arrays: dict[str, Any] = {f"trial_{k}": values for k, values in enumerate(noisy)}
        np.savez_compressed(place.with_suffix(".npz"), **arrays)
        return {
            "attempt": attempt,
            "robot": _robot(seed, number),
            "rows": rows,
            "hidden": [_told(planted, size) for planted, size in hidden],
        }
    raise CannotMake(f"recording {number}, {_robot(seed, number)}: {'; '.join(refused)}")


def _robot(seed: int, number: int) -> str:
    """Return the robot of a recording: each once without a cause and once with one."""
    names = tuple(BENCH_ROBOTS)
    order = np.random.default_rng((_ROBOT, seed)).permutation(len(names))
    return names[int(order[(number // 2 + number % 2 * (len(names) // 2)) % len(names)])]


def _ground(seed: int, number: int, attempt: int) -> Ground:
    generator = np.random.default_rng((_CLEAN, seed, number, attempt, 0))
    specimen = drawn_specimen(generator, _robot(seed, number))
    return Ground(specimen, drawn_courses(specimen, generator))


def _planted(ground: Ground, generator: np.random.Generator) -> tuple[Planted, float]:
    """Return a cause in a form that the diagnosis knows, and what of it a calibration leaves."""
    for _ in range(_FORMS):
        form = _drawn_form(ground, generator)
        numbers = form.draw(ground.specimen, ground.scale, generator)
        target = math.exp(generator.uniform(*np.log(_SIZE)))
        sign = float(generator.choice([-1.0, 1.0])) if form.signed else 1.0
        found = ground.sized(form, numbers, target, sign)
        if found is not None:
            return found[0], rms(ground.left(found[1]))
    raise CannotMake("no cause of a fitting size was drawn")


def _drawn_form(ground: Ground, generator: np.random.Generator) -> Form:
    choices = [form for form in FORMS if form.known and form.applies(ground.specimen)]
    causes = list(dict.fromkeys(form.cause for form in choices))
    cause = causes[int(generator.integers(len(causes)))]
    own = [form for form in choices if form.cause == cause]
    return own[int(generator.integers(len(own)))]


def _outputs(ground: Ground, planted: list[Planted], number: int) -> Array:
    """Return a trial's outputs without noise."""
    specimen, course = ground.specimen, ground.courses[number]
    shapes = ground.plain[number]
    if any(not item.form.looks_only for item in planted):
        shapes = simulated(specimen, ground.scale, planted, course, without=shapes)
    return columns_of(specimen, looked_at(specimen, ground.scale, planted, course, shapes))


def _recording(ground: Ground, outputs: list[Array]) -> Recording:
    specimen = ground.specimen
    names = tuple(input_channels(specimen.bench.robot))
    unit = np.array([si_factor(name) for name in names])
    trials = tuple(
        Trial(course.role, course.time_s, course.commands / unit, values)
        for course, values in zip(ground.courses, outputs, strict=True)
    )
    return Recording(specimen.bench, names, specimen.columns, specimen.gravity_mps2, specimen.noise, trials)


def _told(planted: Planted, size: float) -> dict[str, Any]:
    form = planted.form
    return {
        "cause": form.cause,
        "form": form.name,
        "also": list(form.also),
        "size": planted.size,
        "numbers": dict(planted.numbers),
        "over_noise": size,
    }
