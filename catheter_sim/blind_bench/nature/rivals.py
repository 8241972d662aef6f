"""Whether other names say the same in a draw's data, whoever looks: nature's own answer to a miss.

The named causes' known forms are fitted, all at once and with the specimen's uncertain numbers in their
ranges, to the change that the hidden ones make. What they leave, rooted over all values of the training
trials, is the distance d of the two explanations: one who knew both and the noise would take one for the
other with probability Phi(-d / 2).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.nature.courses import TRAINING
from catheter_sim.blind_bench.nature.engine import CannotMake, columns_of, looked_at, simulated
from catheter_sim.blind_bench.nature.form import Form, Numbers, Planted
from catheter_sim.blind_bench.nature.forms import FORMS
from catheter_sim.blind_bench.nature.ground import Ground, rms

TOLD_APART = 4.0  # distance from which on 2 % would be mistaken
_PASSES = 4
_STEP = 0.2  # of a form's first size
_MOST_FREE = 24

Atom = tuple[Form, Numbers]


def distance(ground: Ground, hidden: Sequence[Planted], causes: Sequence[str]) -> float | None:
    """Return how far the nearest combination of the causes' known forms stays from what is hidden.

    None where there are too many numbers to fit, or no posture is found.
    """
    atoms = atoms_of(ground, causes)
    if len(atoms) > _MOST_FREE:
        return None
    values = sum(len(course) for course in ground.courses[:TRAINING]) * len(ground.specimen.columns)
    try:
        wanted = together(ground, hidden)
        if not atoms:
            return float(rms(ground.left(wanted)) * np.sqrt(values))
        sizes = np.zeros(len(atoms))
        best = np.inf
        for _ in range(_PASSES):
            now = together(ground, _sized(atoms, sizes))
            best = min(best, rms(ground.left(wanted - now)))
            steps = np.array([_STEP * form.start for form, _ in atoms])
            slopes = [
                (together(ground, _sized(atoms, sizes + step * unit)) - now) / step
                for step, unit in zip(steps, np.eye(len(atoms)), strict=True)
            ]
            sizes = _kept(atoms, sizes + _fitted(ground, wanted - now, slopes))
        best = min(best, rms(ground.left(wanted - together(ground, _sized(atoms, sizes)))))
    except CannotMake:
        return None
    return float(best * np.sqrt(values))


def atoms_of(ground: Ground, causes: Sequence[str]) -> list[Atom]:
    """Return the known forms of causes, each with every choice of channel, axis or part that it has."""
    specimen, scale = ground.specimen, ground.scale
    return [
        (form, numbers)
        for form in FORMS
        if form.known and form.cause in causes and form.applies(specimen)
        for numbers in form.every(specimen, scale)
    ]


def together(ground: Ground, planted: Sequence[Planted]) -> Array:
    """Return the change over the noise that all of them make, on the ground's few rows, shape (n,)."""
    if not planted:
        return np.zeros(sum(len(rows) for _, rows in ground.picked) * len(ground.specimen.columns))
    specimen, scale, found = ground.specimen, ground.scale, []
    inside = [item for item in planted if not item.form.looks_only]
    watched = len(inside) < len(planted)
    for number, (course, rows) in enumerate(ground.picked):
        if watched:  # who looks remembers all rows
            plain = ground.plain[number]
            shapes = simulated(specimen, scale, inside, course, without=plain) if inside else plain
            seen = looked_at(specimen, scale, planted, course, shapes)
            change = columns_of(specimen, seen.at(rows)) - columns_of(specimen, plain.at(rows))
        else:
            shapes = simulated(specimen, scale, inside, course, rows, ground.few[number])
            change = columns_of(specimen, shapes) - ground.few_outputs[number]
        found.append(change / specimen.noise)
    return np.concatenate(found).ravel()


def _sized(atoms: Sequence[Atom], sizes: Array) -> list[Planted]:
    """Return the atoms that do something."""
    pairs = zip(atoms, sizes.tolist(), strict=True)
    return [Planted(form, size, numbers) for (form, numbers), size in pairs if size != 0.0]


def _kept(atoms: Sequence[Atom], sizes: Array) -> Array:
    """Return sizes within what each form may have."""
    most = np.array([form.most for form, _ in atoms])
    least = np.where([form.signed for form, _ in atoms], -most, 0.0)
    return np.clip(sizes, 0.98 * least, 0.98 * most)


def _fitted(ground: Ground, wanted: Array, slopes: Sequence[Array]) -> Array:
    """Return how much of each slope, calibration beside it, comes nearest to what is wanted."""
    known = ground.calibrations
    directions = np.concatenate([np.stack(slopes, axis=1), known], axis=1)
    left = wanted - ground.left(wanted, slopes)  # what calibration and slopes together explain
    return np.asarray(np.linalg.lstsq(directions, left, rcond=1e-8)[0][: len(slopes)])
