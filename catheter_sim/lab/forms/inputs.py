"""Forms of a wrong scale, a wrong zero, and of one channel that moves another one's part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Quantity
from catheter_sim.lab.engine import (
    Acting,
    LabForm,
    Numbers,
    Scale,
    channel_name,
    each_channel,
    in_unit,
    one_channel,
    per_channel,
    several_channels,
)
from catheter_sim.lab.specimen import Course, Specimen

_PERCENT = 0.01


def _wound(acting: Acting, course: Course, u: Array) -> Array:
    return u * (1.0 + _PERCENT * acting.size * acting.mask() * np.abs(u) / acting.specimen.reach)


def _curve(acting: Acting) -> Mapping[str, float]:
    specimen = acting.specimen
    reach = specimen.reach / specimen.per_tendon / specimen.file_size
    if len(reach) == 1:
        return {f"curve_per_{specimen.file_unit}": _PERCENT * acting.size / float(reach[0])}
    return {
        f"curve_{drive.channel}_per_{specimen.file_unit}": _PERCENT * acting.size / float(most)
        for drive, most in zip(specimen.drives, reach, strict=True)
    }


def _cranked(acting: Acting, course: Course, u: Array) -> Array:
    """A lever of a servo motor in place of a drum: it pulls by the sine of its angle."""
    turn = _PERCENT * acting.size * u / acting.specimen.reach
    return np.asarray(u * np.sinc(turn / np.pi))


def _saturated(acting: Acting, course: Course, u: Array) -> Array:
    knee = acting.numbers["knee"] * acting.specimen.reach
    beyond = np.sign(u) * np.maximum(np.abs(u) - knee, 0.0)
    return u - min(_PERCENT * acting.size, 0.95) * acting.mask() * beyond


def _gain(acting: Acting) -> Mapping[str, float]:
    name = "scale" if "channel" not in acting.numbers else f"scale_{channel_name(acting)}"
    return {name: 1.0 + _PERCENT * acting.size}


def _offset(acting: Acting) -> Mapping[str, float]:
    unit = acting.specimen.file_unit
    name = f"offset_{unit}" if "channel" not in acting.numbers else f"offset_{channel_name(acting)}_{unit}"
    return {name: acting.size * in_unit(acting)}


def _zeroed_anew(acting: Acting, course: Course, u: Array) -> Array:
    number = course.number if course.repeats is None else course.number + 100
    share = np.random.default_rng((int(acting.numbers["seed"]), number)).uniform(-1.0, 1.0)
    return u + acting.size * share * per_channel(acting)


def _preloaded(acting: Acting, course: Course, u: Array) -> Array:
    fading = np.exp(-np.abs(u) / (0.25 * acting.specimen.reach))
    return u + acting.size * per_channel(acting) * fading


def parts_of(specimen: Specimen) -> list[str]:
    """Return what the channels move, as effects name it: a section, or of a jointed robot the channel."""
    names = [drive.channel if specimen.jointed else drive.moves for drive in specimen.drives]
    return list(dict.fromkeys(names))


def _several_parts(specimen: Specimen) -> bool:
    return len(parts_of(specimen)) > 1


def _pair_of_parts(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    """Draw the part that moves another one."""
    pairs = _pairs_of_parts(specimen, scale)
    return pairs[int(generator.integers(len(pairs)))]


def crossed(specimen: Specimen, first: str, second: str) -> Array:
    """Return what of each channel of one part goes to each of another's, shape (c, c), [onto, of].

    Tendons that lie on one side of the robot rub along one another: a channel's share goes to those of the
    other section less than 90 deg away, by the cosine, one in all.
    """
    count = len(specimen.drives)
    found = np.zeros((count, count))
    for of, drive in enumerate(specimen.drives):
        for onto, other in enumerate(specimen.drives):
            if specimen.jointed:
                found[onto, of] = float(drive.channel == first and other.channel == second)
            elif drive.moves == first and other.moves == second:
                cosine = float(np.dot(drive.side, other.side))
                found[onto, of] = cosine if cosine > 1e-9 else 0.0
    total = found.sum(axis=0)
    return np.asarray(found / np.where(total > 0.0, total, 1.0))


def _moved(acting: Acting, u: Array, of: Array) -> Array:
    numbers = acting.numbers
    return (
        u
        + _unit_share(acting) * acting.size * of @ crossed(acting.specimen, numbers["from"], numbers["to"]).T
    )


def _pairs_of_parts(specimen: Specimen, scale: Scale) -> Sequence[Numbers]:
    parts = parts_of(specimen)
    return [
        {"from": first, "to": second}
        for first in parts
        for second in parts
        if first != second and crossed(specimen, first, second).any() and not _advances(specimen, second)
    ]


def _advances(specimen: Specimen, part: str) -> bool:
    """Whether a part is one that is pushed out: nothing is moved into it, as it stands at its stop."""
    return any(drive.channel == part and drive.quantity is Quantity.ADVANCE for drive in specimen.drives)


def _unit_share(acting: Acting) -> float:
    """A percent; of an advance, which goes much further than a tendon, a tenth of that."""
    sent = [drive for drive in acting.specimen.drives if drive.channel == acting.numbers["from"]]
    return 0.001 if sent and sent[0].quantity is Quantity.ADVANCE else _PERCENT


def _even(acting: Acting, course: Course, u: Array) -> Array:
    """A bent part is longer on its outside, whichever way it bends."""
    return _moved(acting, u, u**2 / _reach_of_mover(acting))


def _reach_of_mover(acting: Acting) -> float:
    specimen, first = acting.specimen, acting.numbers["from"]
    own = [(drive.channel if specimen.jointed else drive.moves) == first for drive in specimen.drives]
    return float(specimen.reach[own].max())


def _growth(acting: Acting) -> Mapping[str, float]:
    numbers, specimen = acting.numbers, acting.specimen
    grown = _unit_share(acting) * acting.size / (_reach_of_mover(acting) / specimen.file_size)
    return {f"{numbers['from']}_to_{numbers['to']}_per_{specimen.file_unit}": grown}


def _beyond(acting: Acting, course: Course, u: Array) -> Array:
    return _moved(acting, u, np.maximum(u - acting.numbers["knee"] * acting.specimen.reach, 0.0))


def _pair_and_knee(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {**_pair_of_parts(specimen, scale, generator), "knee": generator.uniform(0.2, 0.5)}


def _coefficient(acting: Acting) -> Mapping[str, float]:
    numbers = acting.numbers
    return {f"{numbers['from']}_to_{numbers['to']}": _unit_share(acting) * acting.size}


_COMMON = LabForm(
    cause="actuation_gain",
    name="common",
    law="u' = s u, all channels alike",
    start=5.0,
    signed=True,
    most=40.0,
    command=lambda acting, course, u: u * (1.0 + _PERCENT * acting.size * acting.mask()),
    parameters=_gain,
)
_ZERO = LabForm(
    cause="actuation_offset",
    name="common",
    law="u' = u + o, all tendons alike",
    start=3.0,
    most=25.0,
    command=lambda acting, course, u: u + acting.size * per_channel(acting),
    parameters=_offset,
)
FORMS = (
    _COMMON,
    replace(
        _COMMON,
        name="channel",
        law="u' = s u of one channel",
        draw=one_channel,
        every=each_channel,
        applies=several_channels,
    ),
    LabForm(
        cause="actuation_gain",
        name="saturating",
        law="u' = u up to a knee, less of what exceeds it: an amplifier near its limit",
        purpose="tune",
        draw=lambda specimen, scale, generator: {"knee": generator.uniform(0.3, 0.6)},
        start=10.0,
        most=90.0,
        command=_saturated,
        also=("nonlinear_stiffness",),
    ),
    LabForm(
        cause="actuation_gain",
        name="wound",
        law="u' = u (1 + a |u| / reach): a tendon wound on itself lies on a larger drum",
        start=5.0,
        most=50.0,
        command=_wound,
        also=("nonlinear_stiffness",),
        parameters=_curve,
    ),
    LabForm(
        cause="actuation_gain",
        name="cranked",
        law="u' = r sin(u / r): a lever that a servo motor turns, in place of a drum",
        purpose="judge",
        start=40.0,
        most=150.0,
        command=_cranked,
        also=("nonlinear_stiffness",),
    ),
    _ZERO,
    replace(
        _ZERO,
        name="channel",
        law="u' = u + o of one channel",
        draw=one_channel,
        every=each_channel,
        applies=several_channels,
    ),
    LabForm(
        cause="actuation_offset",
        name="each_trial",
        law="u' = u + o_trial, uniform in -+o: zeroed by hand before each trial",
        purpose="tune",
        draw=lambda specimen, scale, generator: {"seed": int(generator.integers(2**31))},
        start=4.0,
        most=30.0,
        command=_zeroed_anew,
    ),
    LabForm(
        cause="actuation_offset",
        name="preload",
        law="u' = u + o exp(-|u| / u0): a preload spring that is overcome",
        purpose="judge",
        start=4.0,
        most=30.0,
        command=_preloaded,
    ),
    LabForm(
        cause="coupling",
        name="share",
        law="u_b' = u_b + c u_a, side to side",
        applies=_several_parts,
        draw=_pair_of_parts,
        every=_pairs_of_parts,
        start=5.0,
        signed=True,
        most=50.0,
        command=lambda acting, course, u: _moved(acting, u, u),
        parameters=_coefficient,
    ),
    LabForm(
        cause="coupling",
        name="growing",
        law="u_b' = u_b + c u_a |u_a| / reach: it grows with bending",
        applies=_several_parts,
        draw=_pair_of_parts,
        every=_pairs_of_parts,
        start=8.0,
        signed=True,
        most=90.0,
        command=lambda acting, course, u: _moved(acting, u, u * np.abs(u) / _reach_of_mover(acting)),
        parameters=_growth,
    ),
    LabForm(
        cause="coupling",
        name="even",
        law="u_b' = u_b + c u_a^2 / reach: whichever way the other part is bent",
        purpose="tune",
        applies=_several_parts,
        draw=_pair_of_parts,
        start=8.0,
        signed=True,
        most=90.0,
        command=_even,
    ),
    LabForm(
        cause="coupling",
        name="beyond",
        law="u_b' = u_b + c max(u_a - u0, 0): the tendons touch only beyond a bend, one way",
        purpose="judge",
        applies=_several_parts,
        draw=_pair_and_knee,
        start=10.0,
        signed=True,
        most=90.0,
        command=_beyond,
    ),
)
