"""Makes a draw: a specimen, its trials, what is planted and how large, and the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.blind_bench.nature.courses import drawn_courses
from catheter_sim.blind_bench.nature.deal import FOREIGN, generator_of, robot_of, story_of
from catheter_sim.blind_bench.nature.engine import CannotMake, columns_of, looked_at, simulated
from catheter_sim.blind_bench.nature.form import Form, Planted, Scale
from catheter_sim.blind_bench.nature.forms import CAUSES, FORMS, forms_for, outside_for
from catheter_sim.blind_bench.nature.ground import LARGEST, SMALLEST, Ground, rms
from catheter_sim.blind_bench.nature.noise import drawn_kind, measured
from catheter_sim.blind_bench.nature.specimen import Specimen, drawn_specimen
from catheter_sim.blind_bench.robots import BENCH_ROBOTS
from catheter_sim.core.posture import Array

_ATTEMPTS = 6
_DRAWS = 30  # of causes, for one data set
_INNER = 1.2  # sizes are aimed at so far inside of `SMALLEST` to `LARGEST`
SEPARATE = 1.0  # times the noise: what one of a pair leaves at least when the other's forms have taken theirs
_NO_SCALE = Scale(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)


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
            outputs = _outputs(ground, chosen)
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


def _outputs(ground: Ground, planted: Sequence[Planted]) -> list[Array]:
    """Return the outputs of all trials without noise."""
    specimen = ground.specimen
    scale = ground.scale if planted else _NO_SCALE
    inside = [item for item in planted if not item.form.looks_only]
    found = []
    for number, course in enumerate(ground.courses):
        if not inside:
            shapes = ground.plain[number]
        elif any(item.form.tether is not None for item in inside):
            shapes = simulated(specimen, scale, inside, course, without=ground.plain[number])
        else:
            shapes = simulated(specimen, scale, inside, course)
        found.append(columns_of(specimen, looked_at(specimen, scale, planted, course, shapes)))
    return found


def _planted(
    ground: Ground, story: str, purpose: str, generator: np.random.Generator, refused: list[str]
) -> tuple[tuple[Planted, ...], tuple[float, ...]]:
    if story == "none":
        return (), ()
    wanted = 2 if story == "pair" else 1
    chosen: list[tuple[Planted, Array]] = []
    for _ in range(_DRAWS):
        form = _drawn_form(ground.specimen, story, purpose, generator, [item.form for item, _ in chosen])
        if form is None:
            continue
        found = _sized(ground, form, generator)
        if found is None:
            refused.append(f"{form.key}: no size of {SMALLEST:g} to {LARGEST:g} times the noise")
            continue
        if chosen and not _separate(ground, chosen[0], found):
            refused.append(f"{chosen[0][0].form.key} + {form.key}: one does what the other does")
            continue
        chosen.append(found)
        if len(chosen) == wanted:
            order = sorted(chosen, key=lambda item: _place(item[0].form))
            sizes = tuple(rms(ground.left(change)) for _, change in order)
            return tuple(item for item, _ in order), sizes
    raise CannotMake(
        f"nothing more was drawn that could be planted besides {[p.form.key for p, _ in chosen]}"
    )


def _place(form: Form) -> int:
    """Return where a form acts among all."""
    return FORMS.index(form) if form in FORMS else 0


def _drawn_form(
    specimen: Specimen,
    story: str,
    purpose: str,
    generator: np.random.Generator,
    before: Sequence[Form],
) -> Form | None:
    """Return a form that makes sense on a specimen: first its cause is drawn, then whether it is foreign."""
    if story == "outside":
        choices = [form for form in outside_for(purpose) if form.applies(specimen)]
        return choices[int(generator.integers(len(choices)))]
    cause = CAUSES[int(generator.integers(len(CAUSES)))]
    foreign = bool(generator.random() < FOREIGN)
    own = [form for form in forms_for(purpose, cause) if form.applies(specimen)]
    choices = [form for form in own if form.known is not foreign] or own
    if not choices or any(_overlap(form, cause) for form in before):
        return None
    form = choices[int(generator.integers(len(choices)))]
    return None if any(_overlap(form, other.cause) for other in before) else form


def _overlap(form: Form, cause: str) -> bool:
    return cause == form.cause or cause in form.also


def _sized(ground: Ground, form: Form, generator: np.random.Generator) -> tuple[Planted, Array] | None:
    numbers = form.draw(ground.specimen, ground.scale, generator)
    low, high = np.log(SMALLEST * _INNER), np.log(LARGEST / _INNER)
    target = float(np.exp(generator.uniform(low, high)))
    sign = float(generator.choice([-1.0, 1.0])) if form.signed else 1.0
    return ground.sized(form, numbers, target, sign)


def _separate(ground: Ground, first: tuple[Planted, Array], second: tuple[Planted, Array]) -> bool:
    """Return whether each of two effects leaves something when the other's cause has taken what it can."""
    return all(
        rms(ground.left(change, _family(ground, other))) >= SEPARATE
        for (_, change), (other, _) in ((first, second), (second, first))
    )


def _family(ground: Ground, planted: Planted) -> list[Array]:
    """Return the changes by a planted form and by the known forms of its cause, at sizes of about its own."""
    found = [ground.change(planted)]
    for form in FORMS:
        if form.cause != planted.form.cause or not form.known or form is planted.form:
            continue
        if form.applies(ground.specimen) and "channel" not in planted.numbers:
            generator = np.random.default_rng(0)
            numbers = form.draw(ground.specimen, ground.scale, generator)
            try:
                change = ground.change(Planted(form, form.start, numbers))
            except CannotMake:
                continue
            if rms(change) > 0.0:
                found.append(change)
    return found
