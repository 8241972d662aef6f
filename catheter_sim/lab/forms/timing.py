"""Forms of a response that depends on speed, and of one that goes on moving while the input stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.lab import memory
from catheter_sim.lab.engine import (
    Acting,
    LabForm,
    Numbers,
    Scale,
    Shapes,
    channel_name,
    each_channel,
    in_unit,
    of_cells,
    one_channel,
    per_channel,
    rebent,
    several_channels,
)
from catheter_sim.lab.specimen import Course, Specimen

_TENTH_S = 0.1
_LONGEST = 40.0  # tenths of a second
_CREEP_S = (15.0, 90.0)
_PERCENT = 0.01


def _seen_lagged(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    tau = _TENTH_S * acting.size
    return replace(
        shapes,
        p=memory.lag(course.time_s, shapes.p, tau),
        angles=memory.lag(course.time_s, shapes.angles, tau),
    )


def _seen_delayed(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    by = _TENTH_S * acting.size
    return replace(
        shapes,
        p=memory.delay(course.time_s, shapes.p, by),
        angles=memory.delay(course.time_s, shapes.angles, by),
    )


def _slow(acting: Acting, course: Course, u: Array) -> Array:
    """The speed limit falls with the size: four times the usual speed at one."""
    most = 4.0 * acting.scale.speed / max(acting.size, 1e-9)
    parts = [
        memory.slew(course.time_s, u[:, [k]], most * reach) for k, reach in enumerate(acting.specimen.reach)
    ]
    return np.concatenate(parts, axis=1)


def _oiled(acting: Acting, course: Course, u: Array) -> Array:
    parts = [
        memory.viscous_loss(course.time_s, u[:, [k]], _TENTH_S * acting.size, acting.scale.speed * reach)
        for k, reach in enumerate(acting.specimen.reach)
    ]
    return np.concatenate(parts, axis=1)


def _stribeck(acting: Acting, course: Course, u: Array) -> Array:
    width = acting.size * per_channel(acting)
    parts = [
        memory.stribeck(course.time_s, u[:, [k]], width[k], acting.scale.speed * reach)
        for k, reach in enumerate(acting.specimen.reach)
    ]
    return np.concatenate(parts, axis=1)


def _wandered(acting: Acting, course: Course, u: Array) -> Array:
    return u + acting.size * per_channel(acting) * (course.time_s / 60.0)[:, np.newaxis]


def _zero_rate(acting: Acting) -> Mapping[str, float]:
    unit = acting.specimen.file_unit
    named = "channel" in acting.numbers
    name = f"zero_{channel_name(acting)}_{unit}_per_min" if named else f"zero_{unit}_per_min"
    return {name: acting.size * in_unit(acting)}


def _creeping(acting: Acting, course: Course, u: Array) -> Array:
    return u + _PERCENT * acting.size * memory.creep(course.time_s, u, [acting.numbers["time_s"]])


def _creep_time(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {"time_s": float(generator.uniform(*_CREEP_S))}


def _responding(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """What bends bends on: every element's turn creeps, by a logarithm of time."""

    def crept(bends: Array) -> Array:
        more = memory.log_creep(course.time_s, bends, acting.numbers["shortest_s"])
        return bends + _PERCENT * acting.size * more

    return rebent(shapes, crept)


def _responding_once(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """The same with a single time constant."""

    def crept(bends: Array) -> Array:
        more = memory.creep(course.time_s, bends, [acting.numbers["time_s"]])
        return bends + _PERCENT * acting.size * more

    return rebent(shapes, crept)


def _warm(acting: Acting, course: Course, u: Array) -> Array:
    numbers = acting.numbers
    phase = numbers["phase_rad"] + 1.7 * course.number
    wave = np.sin(2.0 * np.pi * course.time_s / numbers["period_s"] + phase)
    return u + acting.size * per_channel(acting) * wave[:, np.newaxis]


def _weather(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {
        "period_s": float(scale.duration_s * generator.uniform(0.7, 1.6)),
        "phase_rad": float(generator.uniform(0.0, 2.0 * np.pi)),
    }


def _clamped(acting: Acting, course: Course, u: Array) -> Array:
    return u - 0.2 * acting.size * per_channel(acting) * memory.turning_points(u)


_LATE = LabForm(cause="rate", name="", law="", start=3.0, most=_LONGEST)
_ZERO = LabForm(
    cause="drift",
    name="zero",
    law="u' = u + z t, t from the trial's start, all tendons alike",
    start=2.0,
    most=20.0,
    command=_wandered,
    parameters=_zero_rate,
)
FORMS = (
    replace(
        _LATE,
        name="input_lag",
        law="tau y' = u - y on the commands",
        command=lambda acting, course, u: memory.lag(course.time_s, u, _TENTH_S * acting.size),
        parameters=lambda acting: {"lag_s": _TENTH_S * acting.size},
    ),
    replace(
        _LATE,
        name="input_delay",
        law="y(t) = u(t - d) on the commands",
        command=lambda acting, course, u: memory.delay(course.time_s, u, _TENTH_S * acting.size),
        parameters=lambda acting: {"delay_s": _TENTH_S * acting.size},
    ),
    replace(
        _LATE,
        name="output_lag",
        law="tau y' = x - y on what is seen",
        seen=_seen_lagged,
        parameters=lambda acting: {"output_lag_s": _TENTH_S * acting.size},
    ),
    replace(
        _LATE,
        name="output_delay",
        law="y(t) = x(t - d) on what is seen",
        seen=_seen_delayed,
        parameters=lambda acting: {"output_delay_s": _TENTH_S * acting.size},
    ),
    replace(
        _LATE,
        name="two_lags",
        law="two lags of tau / 2 in a row: a heavy drive",
        purpose="tune",
        command=lambda acting, course, u: memory.two_lags(course.time_s, u, _TENTH_S * acting.size),
    ),
    replace(
        _LATE,
        name="stribeck",
        law="a play whose width falls with speed, w (0.2 + 0.8 exp(-(v/v0)^2)) (Armstrong-Helouvry 1994)",
        purpose="tune",
        most=40.0,
        command=_stribeck,
        also=("backlash", "tendon_friction"),
    ),
    replace(
        _LATE,
        name="viscous",
        law="u' = u - c v0 sign(v) (|v|/v0)^0.6: oil that thins (Ostwald and de Waele)",
        purpose="judge",
        command=_oiled,
    ),
    replace(
        _LATE,
        name="slew",
        law="|y'| is at most a limit: a motor at its top speed",
        purpose="judge",
        learnt=True,
        command=_slow,
    ),
    _ZERO,
    replace(
        _ZERO,
        name="zero_channel",
        law="u' = u + z t of one channel",
        applies=several_channels,
        draw=one_channel,
        every=each_channel,
    ),
    LabForm(
        cause="drift",
        name="creep",
        law="u' = u + a x with T x' = u - x: one Kelvin-Voigt element",
        draw=_creep_time,
        every=lambda specimen, scale: [{"time_s": tau} for tau in _CREEP_S],
        start=8.0,
        most=50.0,
        command=_creeping,
        parameters=lambda acting: {"creep": _PERCENT * acting.size, "creep_time_s": acting.numbers["time_s"]},
    ),
    LabForm(
        cause="drift",
        name="temperature",
        law="u' = u + o sin(2 pi t / P + phase), phase by trial: a zero that follows the room's temperature",
        purpose="tune",
        draw=_weather,
        start=3.0,
        most=25.0,
        command=_warm,
    ),
    LabForm(
        cause="drift",
        name="response",
        law="every element goes on bending, by one Kelvin-Voigt element",
        purpose="tune",
        applies=of_cells,
        draw=_creep_time,
        start=8.0,
        most=50.0,
        shape=_responding_once,
    ),
    LabForm(
        cause="drift",
        name="log_creep",
        law="every element goes on bending, by about log(1 + t / t0): four Kelvin-Voigt elements",
        purpose="judge",
        applies=of_cells,
        draw=lambda specimen, scale, generator: {"shortest_s": float(generator.uniform(1.0, 4.0))},
        start=8.0,
        most=50.0,
        shape=_responding,
    ),
    LabForm(
        cause="drift",
        name="clamp",
        law="u' = u - s n, n reversals so far: a clamp that slips at every reversal",
        purpose="judge",
        start=2.0,
        most=25.0,
        command=_clamped,
    ),
)
