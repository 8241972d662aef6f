"""Makes a draw: a specimen, its trials, what is planted and how large, and the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.nature.courses import drawn_courses
from catheter_sim.blind_bench.nature.deal import FOREIGN, generator_of, robot_of, story_of
from catheter_sim.blind_bench.nature.engine import CannotMake
from catheter_sim.blind_bench.nature.form import Form, Planted
from catheter_sim.blind_bench.nature.forms import outside_for
from catheter_sim.blind_bench.nature.ground import LARGEST, SMALLEST, Ground, rms
from catheter_sim.blind_bench.nature.noise import drawn_kind, measured
from catheter_sim.blind_bench.nature.planting import (
    Sized,
    clean_outputs,
    drawn_form,
    in_order,
    separate,
    sized,
)
from catheter_sim.blind_bench.nature.specimen import Specimen, drawn_specimen
from catheter_sim.blind_bench.robots import BENCH_ROBOTS

_ATTEMPTS = 6
_DRAWS = 30  # of causes, for one data set


@dataclass(frozen=True)
class Made:
    """A draw with its data.

    Attributes:
        purpose, seed, index: of the draw.
        attempt: of those made for it, the one that gave data.
        story: one of `deal.STORIES`.
        robot: the bench's name of it.
        ground: specimen and trials.
        planted: what is hidden.
        sizes: of each, over the noise, beyond what a calibration takes.
        noise_kind: one of `noise.KINDS`.
        outputs: measured, shape (r, o) each, in file units; NaN: missing.
        refused: what was drawn before and could not be used, and why.
    """

    purpose: str
    seed: int
    index: int
    attempt: int
    story: str
    robot: str
    ground: Ground
    planted: tuple[Planted, ...]
    sizes: tuple[float, ...]
    noise_kind: str
    outputs: tuple[Array, ...]
    refused: tuple[str, ...]


def make(purpose: str, seed: int, index: int, robots: Sequence[str] = tuple(BENCH_ROBOTS)) -> Made:
    """Return a draw with its data; the arguments decide everything.

    Raises:
        CannotMake: none of the attempts gave data.
    """
    story, robot = story_of(purpose, seed, index), robot_of(purpose, seed, index, robots)
    refused: list[str] = []
    for attempt in range(_ATTEMPTS):
        generator = generator_of(purpose, seed, index, attempt)
        try:
            ground = drawn_ground(generator, robot)
            specimen = ground.specimen
            chosen, sizes = _planted(ground, story, purpose, generator, refused)
            outputs = clean_outputs(ground, chosen)
        except CannotMake as error:
            refused.append(str(error))
            continue
        kind = drawn_kind(generator)
        noisy = tuple(measured(values, specimen.noise, kind, generator) for values in outputs)
        return Made(
            purpose, seed, index, attempt, story, robot, ground, chosen, sizes, kind, noisy, tuple(refused)
        )
    raise CannotMake(f"draw {index}, {robot}, {story}: {'; '.join(refused)}")


def drawn_ground(generator: np.random.Generator, robot: str) -> Ground:
    """Return a specimen of a robot and its trials."""
    specimen = drawn_specimen(generator, robot)
    return Ground(specimen, drawn_courses(specimen, generator))


def _planted(
    ground: Ground, story: str, purpose: str, generator: np.random.Generator, refused: list[str]
) -> tuple[tuple[Planted, ...], tuple[float, ...]]:
    if story == "none":
        return (), ()
    wanted = 2 if story == "pair" else 1
    chosen: list[Sized] = []
    for _ in range(_DRAWS):
        form = _drawn(ground.specimen, story, purpose, generator, [item.form for item, _ in chosen])
        if form is None:
            continue
        found = sized(ground, form, generator)
        if found is None:
            refused.append(f"{form.key}: no size of {SMALLEST:g} to {LARGEST:g} times the noise")
            continue
        if chosen and not separate(ground, chosen[0], found):
            refused.append(f"{chosen[0][0].form.key} + {form.key}: one does what the other does")
            continue
        chosen.append(found)
        if len(chosen) == wanted:
            order = in_order(chosen)
            sizes = tuple(rms(ground.left(change)) for _, change in order)
            return tuple(item for item, _ in order), sizes
    raise CannotMake(
        f"nothing more was drawn that could be planted besides {[p.form.key for p, _ in chosen]}"
    )


def _drawn(
    specimen: Specimen,
    story: str,
    purpose: str,
    generator: np.random.Generator,
    before: Sequence[Form],
) -> Form | None:
    """Return a form that makes sense on a specimen."""
    if story == "outside":
        choices = [form for form in outside_for(purpose) if form.applies(specimen)]
        return choices[int(generator.integers(len(choices)))]
    return drawn_form(specimen, purpose, FOREIGN, generator, before)
