"""Causes that are not on the list."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.lab import memory
from catheter_sim.lab.engine import Acting, LabForm, Numbers, Scale, Shapes, of_cells, one_channel, rebent
from catheter_sim.lab.specimen import Course, Specimen

_PERCENT = 0.01
_SLIPS = 0.12  # share of the rows at which a clamp slips


def _one_cell(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    count = specimen.elements
    return {
        "cell": int(generator.integers(round(0.2 * count), max(round(0.7 * count), round(0.2 * count) + 1))),
        "knee": float(generator.uniform(0.2, 0.5)),
    }


def _kinked(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """One cell folds: beyond a small bend it bends several times as far."""
    cell, knee = acting.numbers["cell"], acting.numbers["knee"] * acting.scale.bend_rad

    def folded(bends: Array) -> Array:
        found = np.array(bends)
        size = np.linalg.norm(bends[:, cell], axis=-1, keepdims=True)
        more = 0.1 * acting.size * np.maximum(size - knee, 0.0)
        found[:, cell] *= 1.0 + more / np.maximum(size, 1e-12)
        return found

    return rebent(shapes, folded)


def _loose(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """One cell's hinge has come loose: it flops over by a free angle, the way in which the cell goes.

    It has flopped over when the cell has gone back by 0.3 of its largest bend (the stop operator: what a play
    is behind).
    """
    cell, turn = acting.numbers["cell"], 0.15 * acting.scale.bend_rad

    def late(bends: Array) -> Array:
        found = np.array(bends)
        behind = bends[:, cell] - memory.play(bends[:, cell], 2.0 * turn)
        found[:, cell] += np.radians(0.1 * acting.size) * behind / turn
        return found

    return rebent(shapes, late)


def _eccentric(acting: Acting, course: Course, u: Array) -> Array:
    period = acting.numbers["period"] * acting.specimen.reach
    phase = acting.numbers["phase_rad"]
    wave = np.sin(2.0 * np.pi * u / period + phase) - np.sin(phase)
    steepest = _PERCENT * acting.size  # of the slope: below one, so that a pull never lets go
    return u + steepest * period / (2.0 * np.pi) * wave * acting.specimen.pulls


def _pulley(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {
        "period": float(generator.uniform(0.15, 0.45)),
        "phase_rad": float(generator.uniform(0.0, 2.0 * np.pi)),
    }


def _slipped(acting: Acting, course: Course, u: Array) -> Array:
    """At some rows a clamp slips, and the share of the input that arrives is another until the next slip."""
    repeated = 0 if course.repeats is None else 100
    generator = np.random.default_rng((int(acting.numbers["seed"]), course.number + repeated))
    share = np.zeros_like(u)
    for column in range(u.shape[1]):
        for row in np.flatnonzero(generator.random(len(u)) < _SLIPS):
            share[row:, column] = generator.uniform(-1.0, 1.0)
    return u * (1.0 - min(_PERCENT * acting.size, 0.9) * share * acting.specimen.pulls)


def _seed(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {"seed": int(generator.integers(2**31))}


def _cross_talk(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """What is seen sways aside with the height, as through a lens with rings."""
    height = (shapes.p[..., 2] / acting.specimen.length_m)[..., np.newaxis]
    wave = np.sin(2.0 * np.pi * acting.numbers["waves"] * height + acting.numbers["phase_rad"])
    axis = np.array([1.0 if letter == acting.numbers["axis"] else 0.0 for letter in "xyz"])
    return replace(shapes, p=shapes.p + acting.size * 1e-4 * wave * axis)


def _camera(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {
        "axis": str(generator.choice(list(specimen.seen_axes))),
        "waves": float(generator.uniform(1.5, 3.0)),
        "phase_rad": float(generator.uniform(0.0, 2.0 * np.pi)),
    }


def _jumped(acting: Acting, course: Course, u: Array) -> Array:
    """From some time on in each trial a tendon lies in another groove, on another arm."""
    repeated = 0 if course.repeats is None else 100
    generator = np.random.default_rng((int(acting.numbers["seed"]), course.number + repeated))
    since = generator.uniform(0.25, 0.75) * course.time_s[-1]
    up = 1.0 if generator.random() < 0.5 else -1.0
    jumped = (course.time_s >= since)[:, np.newaxis]
    return u * (1.0 + up * min(_PERCENT * acting.size, 0.8) * jumped * acting.mask())


def _groove(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {**one_channel(specimen, scale, generator), **_seed(specimen, scale, generator)}


def _obstacle(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """A soft wall beside the robot: what goes beyond a plane is pushed back by a share of how far."""
    side = np.array([1.0 if letter == acting.numbers["axis"] else 0.0 for letter in "xyz"])
    side = side * acting.numbers["sign"]
    beyond = np.maximum(shapes.p @ side - acting.numbers["at"] * acting.scale.tip_m, 0.0)
    pushed = min(_PERCENT * acting.size, 1.0) * beyond
    return replace(shapes, p=shapes.p - pushed[..., np.newaxis] * side)


def _wall(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {
        "axis": str(generator.choice(list(specimen.bench.trials.axes.replace("z", "")))),
        "sign": float(generator.choice([-1.0, 1.0])),
        "at": float(generator.uniform(0.2, 0.5)),
    }


_OUTSIDE = LabForm(cause="", name="outside", law="", purpose="tune", outside=True, start=5.0)
FORMS = (
    replace(
        _OUTSIDE,
        cause="kinked_cell",
        law="one cell bends several times as far beyond a small bend",
        applies=of_cells,
        draw=_one_cell,
        most=300.0,
        shape=_kinked,
    ),
    replace(
        _OUTSIDE,
        cause="eccentric_pulley",
        law="u' = u + e (sin(2 pi u / P + phase) - sin(phase))",
        draw=_pulley,
        start=20.0,
        most=90.0,
        command=_eccentric,
    ),
    replace(
        _OUTSIDE,
        cause="random_slip",
        law="u' = u (1 - s x), x uniform in -+1, drawn again after each of many random slips",
        draw=_seed,
        most=90.0,
        command=_slipped,
    ),
    replace(
        _OUTSIDE,
        cause="height_cross_talk",
        law="p' = p + a sin(2 pi n z / L + phase) along an axis: a lens with rings",
        draw=_camera,
        most=100.0,
        seen=_cross_talk,
    ),
    replace(
        _OUTSIDE,
        cause="loose_cell",
        law="one cell's hinge is loose and flops over the way it goes",
        purpose="judge",
        applies=of_cells,
        draw=_one_cell,
        most=300.0,
        shape=_loose,
    ),
    replace(
        _OUTSIDE,
        cause="jumped_channel",
        law="from some time on in each trial u' = (1 -+ s) u of one channel",
        purpose="judge",
        draw=_groove,
        start=8.0,
        most=80.0,
        command=_jumped,
    ),
    replace(
        _OUTSIDE,
        cause="obstacle",
        law="p' = p - s max(p n - d, 0) n: a soft wall beside the robot",
        purpose="judge",
        draw=_wall,
        start=10.0,
        most=100.0,
        seen=_obstacle,
    ),
)
