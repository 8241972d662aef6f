"""What a bench plants: on which robot, which form, whether two can be told apart; the outputs with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import unknown
from catheter_sim.lab.engine import (
    CannotMake,
    Ground,
    LabForm,
    Planted,
    Scale,
    columns_of,
    looked_at,
    rms,
    simulated,
)
from catheter_sim.lab.forms import CAUSES, FORMS, OUTSIDE
from catheter_sim.lab.robots import BENCH_ROBOTS
from catheter_sim.lab.simulated import Sized
from catheter_sim.lab.specimen import KINDS, Specimen
from hidden_effects import in_part

SEPARATE = 1.0  # times the noise: what one of a pair leaves at least when the other's forms have taken theirs
_NO_SCALE = Scale(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)

PURPOSES = ("tune", "judge")
IN_PART: Mapping[str, str] = {"tune_in_part": "tune", "judge_in_part": "judge"}
"""Purposes of draws whose causes act in part only (`in_part`), with whose parts they are."""


def named_robots(text: str | None, where: str) -> tuple[str, ...]:
    """Return the robots of the bench that an argument names, comma-separated; all where there is none.

    Raises:
        InputError: no such robot; the line names `where` it stands.
    """
    names = tuple(text.split(",")) if text else tuple(BENCH_ROBOTS)
    for name in names:
        if name not in BENCH_ROBOTS:
            raise unknown("robot", name, BENCH_ROBOTS, where)
    return names


def forms_for(purpose: str, cause: str | None = None) -> tuple[LabForm, ...]:
    """Return the forms that may be drawn for a purpose: known ones, and the foreign ones that are its own."""
    found = FORMS if cause is None else tuple(form for form in FORMS if form.cause == cause)
    return tuple(form for form in found if form.purpose in ("both", purpose))


def outside_for(purpose: str) -> tuple[LabForm, ...]:
    """Return the causes outside the list that may be drawn for a purpose."""
    return tuple(form for form in OUTSIDE if form.purpose == purpose)


def drawn_kind(generator: np.random.Generator) -> str:
    """Return a kind of noise."""
    share = np.array(list(KINDS.values()), dtype=float)
    return str(generator.choice(list(KINDS), p=share / share.sum()))


def clean_outputs(ground: Ground, planted: Sequence[Planted]) -> list[Array]:
    """Return the outputs of all trials without noise.

    Raises:
        CannotMake: the robot finds no posture.
    """
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


def drawn_form(
    specimen: Specimen,
    purpose: str,
    share_foreign: float,
    generator: np.random.Generator,
    before: Sequence[LabForm],
) -> LabForm | None:
    """Return a form that makes sense on a specimen: first its cause is drawn, then whether it is foreign.

    Args:
        specimen: the robot.
        purpose: of the draw; in part, the form is one of `in_part`.
        share_foreign: of the forms that the diagnosis does not know, where a cause has such.
        generator: draws it.
        before: forms that are planted already. None is returned where one of these says the same.
    """
    if purpose in IN_PART:
        parts = [form for form in in_part.FORMS if form.purpose == IN_PART[purpose]]
        causes = sorted({form.cause for form in parts})
        cause = causes[int(generator.integers(len(causes)))]
        parts = [form for form in parts if form.cause == cause and form.applies(specimen)]
        return parts[int(generator.integers(len(parts)))] if parts else None
    cause = CAUSES[int(generator.integers(len(CAUSES)))]
    foreign = bool(generator.random() < share_foreign)
    own = [form for form in forms_for(purpose, cause) if form.applies(specimen)]
    choices = [form for form in own if form.known is not foreign] or own
    if not choices or any(overlap(form, cause) for form in before):
        return None
    form = choices[int(generator.integers(len(choices)))]
    return None if any(overlap(form, other.cause) for other in before) else form


def overlap(form: LabForm, cause: str) -> bool:
    """Return whether a form is of a cause, or says the same as that one's."""
    return cause == form.cause or cause in form.also


def in_order(chosen: Sequence[Sized]) -> list[Sized]:
    """Return what was chosen in the order in which it acts."""
    return sorted(chosen, key=lambda item: _place(item[0].form))


def separate(ground: Ground, first: Sized, second: Sized) -> bool:
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


def _place(form: LabForm) -> int:
    """Return where a form acts among all."""
    return FORMS.index(form) if form in FORMS else 0
