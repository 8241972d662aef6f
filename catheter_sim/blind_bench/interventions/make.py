"""Makes a draw: two recordings of one specimen, what both hide, and what changed between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.interventions.deal import (
    FOREIGN,
    commands_of,
    generator_of,
    robot_of,
    shares_unknown,
    story_of,
)
from catheter_sim.blind_bench.interventions.recordings import Recordings, drawn_recordings
from catheter_sim.blind_bench.nature.engine import CannotMake, columns_of, looked_at
from catheter_sim.blind_bench.nature.form import Planted
from catheter_sim.blind_bench.nature.forms import forms_for, outside_for
from catheter_sim.blind_bench.nature.ground import LARGEST, SMALLEST, Ground
from catheter_sim.blind_bench.nature.noise import drawn_kind, measured
from catheter_sim.blind_bench.nature.planting import (
    Sized,
    clean_outputs,
    drawn_form,
    in_order,
    separate,
    sized,
)
from catheter_sim.blind_bench.robots import BENCH_ROBOTS

_ATTEMPTS = 6
_DRAWS = 30  # of forms, for one data set
_ANOTHER = 50  # is added to a trial's number


@dataclass(frozen=True)
class Made:
    """A draw with its data.

    Attributes:
        purpose, seed, index: of the draw.
        attempt: of those made for it, the one that gave data.
        story, commands, robot: as dealt (`deal`).
        recordings: specimen and trials.
        shared: what both recordings hide; (): nothing but the specimen's own errors.
        changed: what the later recording hides besides, with its change of the outputs over the noise.
        noise_kind: one of `noise.KINDS`, of both.
        outputs: measured, of the earlier and of the later recording's trials, in file units; NaN: missing.
        refused: what was drawn before and could not be used, and why.
    """

    purpose: str
    seed: int
    index: int
    attempt: int
    story: str
    commands: str
    robot: str
    recordings: Recordings
    shared: tuple[Sized, ...]
    changed: tuple[Sized, ...]
    noise_kind: str
    outputs: tuple[tuple[Array, ...], tuple[Array, ...]]
    refused: tuple[str, ...]


def make(
    purpose: str, seed: int, index: int, robots: Sequence[str] = tuple(BENCH_ROBOTS), bare: bool = False
) -> Made:
    """Return a draw with its data; the arguments decide everything.

    Args:
        purpose, seed, index: of the draw.
        robots: that are dealt.
        bare: without what both recordings hide, all else as it is.

    Raises:
        CannotMake: none of the attempts gave data.
    """
    story, commands = story_of(purpose, seed, index), commands_of(purpose, seed, index)
    robot = robot_of(purpose, seed, index, robots)
    refused: list[str] = []
    for attempt in range(_ATTEMPTS):
        generator = generator_of(purpose, seed, index, attempt)
        try:
            recordings = drawn_recordings(generator, robot, commands)
            shared: tuple[Sized, ...] = ()
            if shares_unknown(purpose, seed, index):
                shared = (_unknown(recordings.before, purpose, generator, refused),)
            changed = _changed(recordings.after, story, purpose, shared, generator, refused)
            shared = () if bare else shared
            clean = _outputs(recordings, shared, changed)
        except CannotMake as error:
            refused.append(str(error))
            continue
        kind = drawn_kind(generator)
        noise = recordings.before.specimen.noise
        first, second = (
            tuple(measured(values, noise, kind, generator) for values in outputs) for outputs in clean
        )
        return Made(
            purpose,
            seed,
            index,
            attempt,
            story,
            commands,
            robot,
            recordings,
            shared,
            changed,
            kind,
            (first, second),
            tuple(refused),
        )
    raise CannotMake(f"draw {index}, {robot}, {story}: {'; '.join(refused)}")


def _outputs(
    recordings: Recordings, shared: Sequence[Sized], changed: Sequence[Sized]
) -> tuple[list[Array], list[Array]]:
    first = clean_outputs(recordings.before, [planted for planted, _ in shared])
    planted = [planted for planted, _ in in_order((*shared, *changed))]
    return first, clean_outputs(recordings.after, planted)


def _unknown(ground: Ground, purpose: str, generator: np.random.Generator, refused: list[str]) -> Sized:
    """Return what both recordings hide: a form that no diagnosis knows, or something outside the list.

    What is another one in every trial is not shared.
    """
    forms = [form for form in forms_for(purpose) if not form.known]
    choices = [form for form in (*forms, *outside_for(purpose)) if form.applies(ground.specimen)]
    for _ in range(_DRAWS):
        form = choices[int(generator.integers(len(choices)))]
        found = sized(ground, form, generator)
        if found is None:
            refused.append(f"shared {form.key}: no size of {SMALLEST:g} to {LARGEST:g} times the noise")
        elif _is_by_trial(ground, found[0]):
            refused.append(f"shared {form.key}: it is another one in every trial")
        else:
            return found
    raise CannotMake("nothing was drawn that both could hide")


def _is_by_trial(ground: Ground, planted: Planted) -> bool:
    """Return whether a form does something else in a trial of the same commands but another number."""
    course, rows = ground.picked[0]
    index = list(rows)
    cut = replace(course, time_s=course.time_s[index], commands=course.commands[index])
    acting, form, plain = planted.acting(ground.specimen, ground.scale), planted.form, ground.few[0]
    found = []
    for number in (course.number, course.number + _ANOTHER):
        here = replace(cut, number=number)
        u = cut.commands if form.command is None else form.command(acting, here, cut.commands)
        shapes = looked_at(ground.specimen, ground.scale, [planted], here, plain)
        found.append(np.concatenate([u.ravel(), columns_of(ground.specimen, shapes).ravel()]))
    return not np.array_equal(found[0], found[1])


def _changed(
    ground: Ground,
    story: str,
    purpose: str,
    shared: Sequence[Sized],
    generator: np.random.Generator,
    refused: list[str],
) -> tuple[Sized, ...]:
    """Return what changed. It is no form of what both hide: another law of one cause is hardly a change."""
    wanted = {"none": 0, "single": 1, "pair": 2}[story]
    chosen: list[Sized] = []
    for _ in range(_DRAWS if wanted else 0):
        before = [planted.form for planted, _ in (*shared, *chosen)]
        form = drawn_form(ground.specimen, purpose, FOREIGN, generator, before)
        if form is None:
            continue
        found = sized(ground, form, generator)
        if found is None:
            refused.append(f"{form.key}: no size of {SMALLEST:g} to {LARGEST:g} times the noise")
        elif chosen and not separate(ground, chosen[0], found):
            refused.append(f"{chosen[0][0].form.key} + {form.key}: one does what the other does")
        else:
            chosen.append(found)
        if len(chosen) == wanted:
            break
    if len(chosen) < wanted:
        raise CannotMake(f"nothing more was drawn that could change besides {len(chosen)}")
    return tuple(in_order(chosen))
