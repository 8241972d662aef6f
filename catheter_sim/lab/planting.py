"""What can be planted: which form, how large, whether two can be told apart; and the outputs with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.lab.engine import (
    LARGEST,
    SMALLEST,
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
from catheter_sim.lab.forms import CAUSES, FORMS, forms_for
from catheter_sim.lab.specimen import Specimen

_INNER = 1.2  # sizes are aimed at so far inside of `SMALLEST` to `LARGEST`
SEPARATE = 1.0  # times the noise: what one of a pair leaves at least when the other's forms have taken theirs
_NO_SCALE = Scale(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)

Sized = tuple[Planted, Array]  # with its change of the outputs over the noise


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
        purpose: of the draw.
        share_foreign: of the forms that the diagnosis does not know, where a cause has such.
        generator: draws it.
        before: forms that are planted already. None is returned where one of these says the same.
    """
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


def sized(ground: Ground, form: LabForm, generator: np.random.Generator) -> Sized | None:
    """Return a form of a drawn size, and its change; None where no size leaves as much as is asked."""
    numbers = form.draw(ground.specimen, ground.scale, generator)
    low, high = np.log(SMALLEST * _INNER), np.log(LARGEST / _INNER)
    target = float(np.exp(generator.uniform(low, high)))
    sign = float(generator.choice([-1.0, 1.0])) if form.signed else 1.0
    return ground.sized(form, numbers, target, sign)


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
