"""Causes that act only in part of the robot, the time, the level or the past: forms that no list holds.

A form is a plain law times a share, w, that is drawn as a course in rows or a place along the robot. Courses
have kinks and steps, so that no spline holds them; half of those for judging are of two variables. What is
drawn for tuning has other shapes than what is drawn for judging.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.lab import memory
from catheter_sim.lab.engine import (
    Acting,
    LabForm,
    Numbers,
    Scale,
    Shapes,
    of_cells,
    per_channel,
    rebent,
    shortened,
)
from catheter_sim.lab.forms import BY_KEY
from catheter_sim.lab.specimen import Course, Specimen

_PERCENT = 0.01
_TENTH_MM = 1e-4

# ----------------------------------------------------------------------------------------------------
# Where and when: shares of rows, shape (r,), and of elements, shape (n,).

Rows = Callable[[Acting, Course], Array]
Places = Callable[[Acting], Array]


def _clock(acting: Acting, course: Course) -> Array:
    return course.time_s / acting.scale.duration_s


def _level(acting: Acting, course: Course) -> Array:
    """How far the channel that was drawn is pulled, in shares of its reach, with its sign."""
    channel = acting.numbers["of"]
    return np.asarray(course.commands[:, channel] / acting.specimen.reach[channel])


def _other(acting: Acting, course: Course) -> Array:
    """The largest of the other channels, in shares of their reach."""
    levels = np.abs(course.commands / acting.specimen.reach)
    levels[:, acting.numbers["of"]] = 0.0
    return np.asarray(levels.max(axis=1))


def _way(acting: Acting, course: Course) -> Array:
    """1 on the way out of the channel, 0 on the way back and before it moves."""
    steps, found, now = np.diff(np.abs(_level(acting, course)), prepend=0.0), [], 0.0
    for step in steps:
        now = 1.0 if step > 1e-6 else 0.0 if step < -1e-6 else now
        found.append(now)
    return np.array(found)


def _passed(acting: Acting, course: Course) -> Array:
    return np.maximum.accumulate(np.abs(_level(acting, course)))


def _travelled(acting: Acting, course: Course) -> Array:
    """In shares of the reach."""
    return np.cumsum(np.abs(np.diff(_level(acting, course), prepend=0.0)))


def _beyond(values: Array, knee: float) -> Array:
    return np.asarray(np.maximum(values - knee, 0.0) / (1.0 - knee))


def _along(acting: Acting) -> Array:
    count = acting.specimen.elements
    return np.asarray((np.arange(count) + 0.5) / count)


def _between(values: Array, ends: Sequence[float]) -> Array:
    return np.asarray((values >= ends[0]) & (values < ends[1]), dtype=float)


def _knee(low: float, high: float) -> Callable[[np.random.Generator], float]:
    return lambda generator: float(generator.uniform(low, high))


@dataclass(frozen=True)
class Part:
    """Where or when a law acts.

    Attributes:
        name: of the form.
        law: in words.
        purpose: "tune" or "judge".
        at: draws the place of its step or kink.
        rows: share of each row; None: all alike.
        places: share of each element; None: all alike.
        by: what a named cause may vary with and be right: "time", "level", "past", "place".
    """

    name: str
    law: str
    purpose: str
    at: Callable[[np.random.Generator], float]
    rows: Rows | None = None
    places: Places | None = None
    by: tuple[str, ...] = ()


PARTS = (
    Part("from_a_time", "from t0 on", "tune", _knee(0.2, 0.6), by=("time",),
         rows=lambda a, c: 1.0 * (_clock(a, c) >= a.numbers["at"])),
    Part("growing_late", "in proportion to t - t0, from t0 on", "tune", _knee(0.1, 0.5), by=("time",),
         rows=lambda a, c: _beyond(_clock(a, c), a.numbers["at"])),
    Part("fading", "by exp(-t / t0)", "tune", _knee(0.15, 0.5), by=("time",),
         rows=lambda a, c: np.exp(-_clock(a, c) / a.numbers["at"])),
    Part("beyond_a_level", "in proportion to |u| - u0 beyond u0", "tune", _knee(0.2, 0.6), by=("level",),
         rows=lambda a, c: _beyond(np.abs(_level(a, c)), a.numbers["at"])),
    Part("on_the_way_out", "while a channel is driven out", "tune", _knee(0.0, 1.0), by=("past",),
         rows=_way),
    Part("once_pulled", "once a channel has been at u0", "tune", _knee(0.3, 0.7), by=("past",),
         rows=lambda a, c: 1.0 * (_passed(a, c) >= a.numbers["at"])),
    Part("one_stretch", "in two fifths of the length", "tune", _knee(0.0, 0.6), by=("place",),
         places=lambda a: _between(_along(a), (a.numbers["at"], a.numbers["at"] + 0.4))),
    Part("a_while", "from t0 to t0 + T / 4", "judge", _knee(0.1, 0.6), by=("time",),
         rows=lambda a, c: _between(_clock(a, c), (a.numbers["at"], a.numbers["at"] + 0.25))),
    Part("between_levels", "where |u| lies between u0 and 2 u0", "judge", _knee(0.25, 0.45), by=("level",),
         rows=lambda a, c: _between(np.abs(_level(a, c)), (a.numbers["at"], 2.0 * a.numbers["at"]))),
    Part("worn_in", "in proportion to the way travelled, up to s0", "judge", _knee(1.0, 4.0), by=("past",),
         rows=lambda a, c: np.minimum(_travelled(a, c) / a.numbers["at"], 1.0)),
    Part("toward_the_tip", "in proportion to z - z0 beyond z0", "judge", _knee(0.1, 0.6), by=("place",),
         places=lambda a: _beyond(_along(a), a.numbers["at"])),
    Part("late_and_far", "from t0 on, and where |u| is above a half", "judge", _knee(0.2, 0.5),
         by=("time", "level"),
         rows=lambda a, c: (_clock(a, c) >= a.numbers["at"]) * (np.abs(_level(a, c)) > 0.5)),
    Part("beside_another", "by the product of |u| and the largest other channel", "judge", _knee(0.0, 1.0),
         by=("level",),
         rows=lambda a, c: np.abs(_level(a, c)) * (0.2 + _other(a, c))),
    Part("back_and_late", "on the way back, growing with time", "judge", _knee(0.0, 1.0), by=("past", "time"),
         rows=lambda a, c: (1.0 - _way(a, c)) * _clock(a, c)),
    Part("late_in_one_half", "in one half, from t0 on", "judge", _knee(0.2, 0.6), by=("place", "time"),
         rows=lambda a, c: 1.0 * (_clock(a, c) >= a.numbers["at"]),
         places=lambda a: _between(_along(a), (0.0, 0.5) if a.numbers["of"] % 2 else (0.5, 1.01))),
)  # fmt: skip
"""Courses and places that are drawn."""


def _share(part: Part, acting: Acting, course: Course) -> Array:
    """Return the share of each row and element, shape (r or 1, n or 1, 1)."""
    rows = np.ones(1) if part.rows is None else part.rows(acting, course)
    places = np.ones(1) if part.places is None else part.places(acting)
    return np.asarray(rows[:, np.newaxis, np.newaxis] * places[np.newaxis, :, np.newaxis])


# ----------------------------------------------------------------------------------------------------
# What acts there: plain laws of causes of the list, each with a share.


@dataclass(frozen=True)
class Law:
    """A plain law with a share of each row, or element.

    Attributes:
        form: of the same law all over; its cause, where it makes sense, its sizes and sign are taken.
        hook: at which hook of a form it acts.
        act: the hook with the share, shape (r or 1, n or 1, 1), before the hook's own arguments.
        along: whether it may differ along the robot.
        also: other right names, by what the share follows.
        draw: what is drawn besides; None: as the form does.
    """

    form: LabForm
    hook: str
    act: Callable[..., object]
    along: bool
    also: Mapping[str, tuple[str, ...]]
    draw: Callable[[Specimen, Scale, np.random.Generator], Numbers] | None = None


def _gain(share: Array, acting: Acting, course: Course, u: Array) -> Array:
    return u * (1.0 + _PERCENT * acting.size * acting.mask() * share[:, 0])


def _offset(share: Array, acting: Acting, course: Course, u: Array) -> Array:
    return u + acting.size * per_channel(acting) * share[:, 0]


def _play(share: Array, acting: Acting, course: Course, u: Array) -> Array:
    return memory.play(u, acting.size * per_channel(acting) * np.broadcast_to(share[:, 0], (len(u), 1)))


def _softer(share: Array, acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    stiffer = np.maximum(1.0 + _PERCENT * acting.size * share, 0.1)
    return rebent(shapes, lambda bends: bends / stiffer)


def _softer_when_bent(share: Array, acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    def bent(bends: Array) -> Array:
        relative = np.linalg.norm(bends, axis=-1, keepdims=True) / acting.scale.bend_rad
        return bends / np.maximum(1.0 + _PERCENT * acting.size * share * relative**2, 0.1)

    return rebent(shapes, bent)


def _curved(share: Array, acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    toward = np.array([0.0, 1.0, 0.0] if acting.numbers["axis"] == "x" else [-1.0, 0.0, 0.0])
    each = _PERCENT * acting.size / acting.specimen.elements
    return rebent(shapes, lambda bends: bends + each * share * toward)


def _twisted(share: Array, acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    each = np.radians(acting.size) / acting.specimen.elements
    return rebent(shapes, lambda bends: bends + each * share * np.array([0.0, 0.0, 1.0]))


def _pressed(share: Array, acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    pull = np.abs(course.commands[:, acting.specimen.pulls]).sum(axis=1) / acting.scale.pull
    by_element = np.broadcast_to(share[..., 0], (len(shapes), acting.specimen.elements))
    return shortened(shapes, _PERCENT * acting.size * pull[:, np.newaxis] * by_element)


def _loaded(share: Array, acting: Acting, course: Course) -> tuple[int, Array]:
    """As large as the plain force at the tip, on the last element."""
    force = BY_KEY["payload.force"].tip_force
    assert force is not None
    return acting.specimen.elements, np.broadcast_to(share[:, 0], (len(course), 1)) * force(acting)


def _moved(share: Array, acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    toward = np.array([acting.numbers["toward"].get(axis, 0.0) for axis in "xyz"])
    return replace(shapes, p=shapes.p + acting.size * _TENTH_MM * share * toward)


_BEND = {"time": ("drift",), "level": ("nonlinear_stiffness",), "past": ("drift",)}
_ZERO_ALSO = {"time": ("drift",), "past": ("drift", "backlash"), "level": ("actuation_gain",)}
_LAWS = (
    Law(BY_KEY["actuation_gain.common"], "command", _gain, False,
        {**_BEND, "": ("stiffness",), "past": ("drift", "backlash")}),
    Law(BY_KEY["actuation_offset.common"], "command", _offset, False, _ZERO_ALSO),
    Law(BY_KEY["backlash.play"], "command", _play, False, {"": ("tendon_friction",)}),
    Law(BY_KEY["stiffness.scale"], "shape", _softer, True, {**_BEND, "": ("actuation_gain",)}),
    Law(BY_KEY["nonlinear_stiffness.cubic"], "shape", _softer_when_bent, True, {"": ("actuation_gain",)}),
    Law(BY_KEY["precurvature.growing"], "shape", _curved, True,
        {"time": ("drift",), "past": ("drift", "backlash")}),
    Law(BY_KEY["twist.cells"], "shape", _twisted, True, {"time": ("drift",)}),
    Law(BY_KEY["axial_compression.backbone"], "shape", _pressed, True, {}),
    Law(BY_KEY["payload.force"], "body_force", _loaded, False, {"time": ("drift",)}),
    Law(BY_KEY["measurement_frame.distorted"], "seen", _moved, False, {"time": ("drift",)}),
)  # fmt: skip


def _form(law: Law, part: Part) -> LabForm:
    base = law.form

    def draw(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
        used = np.flatnonzero(specimen.pulls)
        where = {"of": int(generator.choice(used)), "at": part.at(generator)}
        return {**base.draw(specimen, scale, generator), **where}

    def hook(acting: Acting, course: Course, *more: Array | Shapes) -> object:
        return law.act(_share(part, acting, course), acting, course, *more)

    also = {*base.also, *law.also.get("", ()), *(name for by in part.by for name in law.also.get(by, ()))}
    nothing = dict.fromkeys(("command", "robot", "tip_force", "shape", "seen"))
    return replace(
        base,
        name=part.name,
        law=f"as {base.name}, {part.law}",
        purpose=part.purpose,
        also=tuple(sorted(also - {base.cause})),
        applies=lambda specimen: base.applies(specimen) and (part.places is None or of_cells(specimen)),
        draw=draw,
        **{**nothing, law.hook: hook},
        parameters=lambda acting: {},
    )


FORMS: tuple[LabForm, ...] = tuple(
    _form(law, part) for law in _LAWS for part in PARTS if law.along or part.places is None
)
"""Every law in every part that it may have."""
