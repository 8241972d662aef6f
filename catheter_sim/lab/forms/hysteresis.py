"""Forms of play and of dry friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import Friction
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
)
from catheter_sim.lab.specimen import Course, Specimen

_FIFTHS = 5
_MOST_MU = 0.5  # by which a coefficient may be another
_LEAST_MU = 0.1  # of the specified one: no tendon runs without friction


def _soft(acting: Acting, course: Course, u: Array) -> Array:
    return memory.soft_play(u, acting.size * per_channel(acting), acting.numbers["through"])


def _narrowing(acting: Acting, course: Course, u: Array) -> Array:
    """What hangs loose at rest is pressed together by the pull."""
    share = 1.0 - 0.7 * np.clip(np.abs(u) / acting.specimen.reach, 0.0, 1.0)
    half = 0.5 * acting.size * per_channel(acting) * share
    return memory.within(u - half, u + half)


def _uneven(acting: Acting, course: Course, u: Array) -> Array:
    return memory.play(u, acting.size * per_channel(acting) * np.array(acting.numbers["shares"]))


def _at_the_joints(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """Every joint follows its elastic bend through a dead-band of its own."""
    width = np.radians(acting.size * 0.02)
    return rebent(
        shapes,
        lambda bends: memory.play(bends.reshape(len(bends), -1), width).reshape(bends.shape),
    )


def _shares(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    shares = generator.uniform(0.2, 1.0, len(specimen.reach))
    return {"shares": (shares / shares.max()).tolist()}


def _width(acting: Acting) -> Mapping[str, float]:
    return {f"width_{acting.specimen.file_unit}": acting.size * in_unit(acting)}


def _soft_width(acting: Acting) -> Mapping[str, float]:
    own = {f"soft_{name}": width for name, width in _width(acting).items()}
    return {**own, "soft_through": acting.numbers["through"]}


def _own_widths(acting: Acting) -> Mapping[str, float]:
    drives, unit = acting.specimen.drives, acting.specimen.file_unit
    return {
        f"width_{drive.channel}_{unit}": acting.size * in_unit(acting) * share
        for drive, share in zip(drives, acting.numbers["shares"], strict=True)
    }


def _bending_channels(specimen: Specimen) -> list[int]:
    if not specimen.jointed:
        return []
    joints = {item.name: getattr(item, "joint", "") for item in specimen.bench.robot.segments}
    return [k for k, drive in enumerate(specimen.drives) if joints.get(drive.moves) == "bending"]


def a_bending_channel(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    """Draw one of the channels that move a bending joint."""
    return {"channel": int(generator.choice(_bending_channels(specimen)))}


def bends_joints(specimen: Specimen) -> bool:
    """Return whether a channel moves a bending joint of its own."""
    return bool(_bending_channels(specimen))


def _tensioned(specimen: Specimen) -> bool:
    return specimen.tensioned


def _rubs(specimen: Specimen) -> bool:
    """Whether the simulated tendons' friction moves anything: they are pulled, or give way."""
    return specimen.tensioned or any(
        np.isfinite(getattr(tendon, "stiffness_N_per_m", np.inf)) for tendon in specimen.bench.robot.tendons
    )


def _mu(acting: Acting) -> Mapping[str, float]:
    specified = acting.specimen.robot.friction.mu
    return {"mu": max(specified + 0.01 * acting.size, _LEAST_MU * specified)}


def _rusted(acting: Acting, course: Course, u: Array) -> Array:
    loss = 0.01 * acting.size * (1.0 + np.maximum(u, 0.0) / acting.specimen.reach)
    return memory.within(u * np.exp(-loss), u * np.exp(loss))


def _pressed(acting: Acting, course: Course, u: Array) -> Array:
    knee = acting.numbers["knee"]
    parts = [
        memory.pressed(u[:, [k]], 0.01 * acting.size, knee * reach)
        for k, reach in enumerate(acting.specimen.reach)
    ]
    return np.concatenate(parts, axis=1)


def _has_holes(specimen: Specimen) -> bool:
    return specimen.tensioned and all(hasattr(item, "radius_m") for item in specimen.bench.robot.tendons)


def _held_back(acting: Acting, course: Course, u: Array) -> tuple[tuple[int, ...], Array]:
    """Return the moments on elements that make each joint feel the tension that is left there.

    The holes of each fifth of a tendon's way are taken together at its lower end. So joints in fifth k are to
    feel T_k in the place of T: a moment r (T_k - T_(k+1)) at the upper end of each fifth, the last one
    r (T_n - T), adds up to r (T_k - T) for what lies below it.
    """
    specimen = acting.specimen
    loss = acting.size * 0.01 * u.max() / _FIFTHS
    behind = memory.hole_tensions(u, loss, _FIFTHS)  # (fifths, r, c)
    moments: dict[int, Array] = {}
    for channel, drive in enumerate(specimen.drives):
        radius = specimen.bench.robot.tendons[drive.tendons[0]].radius_m
        axis = np.array([-drive.side[1], drive.side[0], 0.0])
        step = behind[:, :, channel] - u[:, channel]
        step[:-1] -= step[1:].copy()
        for fifth, place in enumerate(_upper_ends(specimen, drive.moves)):
            before = moments.get(place, np.zeros((len(u), 3)))
            moments[place] = before + radius * step[fifth][:, np.newaxis] * axis
    places = tuple(sorted(moments))
    return places, np.stack([moments[place] for place in places], axis=1)


def _upper_ends(specimen: Specimen, segment: str) -> list[int]:
    """Return the elements, from 1, at which each fifth of a tendon's way ends that ends at a segment."""
    names = [item.name for item in specimen.bench.robot.segments]
    own = [k for k, index in enumerate(specimen.segment_of_element) if index <= names.index(segment)]
    return np.ceil(np.arange(1, _FIFTHS + 1) / _FIFTHS * len(own)).astype(int).tolist()


_PLAY = LabForm(
    cause="backlash",
    name="play",
    law="y = clip(y, u - w/2, u + w/2): the play operator, all channels alike",
    start=3.0,
    most=35.0,
    command=lambda acting, course, u: memory.play(u, acting.size * per_channel(acting)),
    parameters=_width,
)
_MU = LabForm(
    cause="tendon_friction",
    name="capstan",
    law="at every hole T' in [T exp(-mu phi), T exp(mu phi)] (Euler), another mu",
    applies=_rubs,
    start=8.0,
    signed=True,
    most=100.0 * _MOST_MU,
    robot=lambda acting, robot: replace(robot, friction=Friction(_mu(acting)["mu"])),
    parameters=_mu,
)
FORMS = (
    _PLAY,
    replace(
        _PLAY,
        name="play_channel",
        law="the play operator, of one channel's drive",
        applies=lambda specimen: specimen.jointed,
        draw=one_channel,
        every=each_channel,
        parameters=lambda acting: {f"width_{channel_name(acting)}_mm": acting.size * in_unit(acting)},
    ),
    LabForm(
        cause="backlash",
        name="slack",
        law="a pair draws sign(u) max(|u| - s, 0)",
        applies=bends_joints,
        draw=a_bending_channel,
        every=lambda specimen, scale: [{"channel": channel} for channel in _bending_channels(specimen)],
        start=3.0,
        most=25.0,
        command=lambda acting, course, u: memory.slack(u, acting.size * per_channel(acting)),
        parameters=lambda acting: {f"slack_{channel_name(acting)}_mm": acting.size * in_unit(acting)},
    ),
    LabForm(
        cause="backlash",
        name="smooth",
        law="the mean of plays of widths 0 to 2 w (Prandtl and Ishlinskii): round corners",
        purpose="tune",
        start=4.0,
        most=40.0,
        command=lambda acting, course, u: memory.smooth_play(u, acting.size * per_channel(acting)),
    ),
    LabForm(
        cause="backlash",
        name="uneven",
        law="the play operator, with another width in each channel",
        applies=lambda specimen: len(specimen.reach) > 1 and not specimen.jointed,
        draw=_shares,
        every=lambda specimen, scale: [{"shares": [1.0] * len(specimen.reach)}],
        start=4.0,
        most=40.0,
        command=_uneven,
        parameters=_own_widths,
    ),
    LabForm(
        cause="backlash",
        name="at_joint",
        law="every joint's angle follows its elastic bend through a play of its own",
        purpose="judge",
        applies=of_cells,
        start=3.0,
        shape=_at_the_joints,
        also=("tendon_friction",),
    ),
    LabForm(
        cause="backlash",
        name="soft",
        law="y = s u + (1 - s) play(u, w): a spring across the dead-band",
        draw=lambda specimen, scale, generator: {"through": generator.uniform(0.15, 0.4)},
        every=lambda specimen, scale: [{"through": 0.25}],
        start=4.0,
        most=40.0,
        command=_soft,
        parameters=_soft_width,
    ),
    LabForm(
        cause="backlash",
        name="narrowing",
        law="y = clip(y, u - w'/2, u + w'/2), w' = w (1 - 0.7 |u| / reach): the pull presses it together",
        purpose="judge",
        start=4.0,
        most=50.0,
        command=_narrowing,
    ),
    _MU,
    LabForm(
        cause="tendon_friction",
        name="routing",
        law="before the robot T' in [T exp(-a), T exp(a)]: a path of a fixed turn (Euler)",
        applies=_tensioned,
        start=3.0,
        most=60.0,
        command=lambda acting, course, u: memory.capstan(u, 0.01 * acting.size),
        also=("backlash",),
        parameters=lambda acting: {"path_loss": 0.01 * acting.size},
    ),
    LabForm(
        cause="tendon_friction",
        name="rusted",
        law="the same with the loss a (1 + u / reach) of a rusted path: its turn grows with the pull",
        purpose="tune",
        applies=_tensioned,
        start=3.0,
        most=60.0,
        command=_rusted,
        also=("backlash",),
    ),
    LabForm(
        cause="tendon_friction",
        name="wall",
        law="T' in T -+ c max(T - T0, 0): the tendon presses on a wall beyond a tension (Coulomb)",
        purpose="judge",
        applies=_tensioned,
        draw=lambda specimen, scale, generator: {"knee": generator.uniform(0.15, 0.4)},
        start=4.0,
        most=60.0,
        command=_pressed,
        also=("backlash",),
    ),
    LabForm(
        cause="tendon_friction",
        name="constant",
        law="every hole holds back the same force, whatever the tension: T_k in T_(k-1) -+ f",
        purpose="judge",
        applies=_has_holes,
        start=4.0,
        most=60.0,
        moments=_held_back,
        also=("backlash",),
    ),
)
