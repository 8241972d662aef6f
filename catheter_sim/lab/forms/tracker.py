"""Forms of a tracker's frame that is not the robot's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.lab.engine import Acting, LabForm, Numbers, Scale, Shapes
from catheter_sim.lab.specimen import Course, Specimen

_TENTH_MM = 1e-4
_TENTH_DEG = 0.1
_FIFTH_PERCENT = 0.002


def _pose(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    """Draw shift and turn, in the plane of what is seen where that is a plane."""
    axes = specimen.seen_axes
    turns = axes if len(axes) == 3 else "".join(axis for axis in "xyz" if axis not in axes)
    shift = {axis: float(generator.uniform(-1.0, 1.0)) for axis in axes}
    turn = {axis: float(generator.uniform(-1.0, 1.0)) for axis in turns}
    if generator.random() < 0.3:
        turn = dict.fromkeys(turn, 0.0)
    return {"shift": shift, "turn": turn}


def _shifts_and_turns(specimen: Specimen, scale: Scale) -> Sequence[Numbers]:
    """Return each shift and each turn by itself."""
    axes = specimen.seen_axes
    turns = axes if len(axes) == 3 else "".join(axis for axis in "xyz" if axis not in axes)
    shifts = [{"shift": {axis: 1.0}, "turn": {}} for axis in axes]
    return [*shifts, *({"shift": {}, "turn": {axis: 1.0}} for axis in turns)]


def _vector(part: Mapping[str, float]) -> Array:
    return np.array([part.get(axis, 0.0) for axis in "xyz"])


def _moved(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    turn = Rotation.from_rotvec(acting.size * _TENTH_DEG * _vector(acting.numbers["turn"]), degrees=True)
    shift = acting.size * _TENTH_MM * _vector(acting.numbers["shift"])
    return replace(shapes, p=shapes.p @ turn.as_matrix().T + shift)


def _frame(acting: Acting) -> Mapping[str, float]:
    shift = {
        f"translation_{axis}_mm": acting.size * _TENTH_MM * 1e3 * value
        for axis, value in acting.numbers["shift"].items()
    }
    turn = {
        f"rotation_{axis}_deg": acting.size * _TENTH_DEG * value
        for axis, value in acting.numbers["turn"].items()
        if value
    }
    return shift | turn


def _stretched(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    return replace(shapes, p=shapes.p * (1.0 + _FIFTH_PERCENT * acting.size))


def _slant(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    along, across = generator.permutation(list(specimen.seen_axes))[:2].tolist()
    return {"along": {along: 1.0}, "across": {across: 1.0}}


def _sheared(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    along, across = _vector(acting.numbers["along"]), _vector(acting.numbers["across"])
    slant = _FIFTH_PERCENT * acting.size * np.outer(along, across)
    return replace(shapes, p=shapes.p + shapes.p @ slant)


def _shears(acting: Acting) -> Mapping[str, float]:
    (along,), (across,) = acting.numbers["along"], acting.numbers["across"]
    return {f"shear_{across}{along}": _FIFTH_PERCENT * acting.size}


def _each_slant(specimen: Specimen, scale: Scale) -> Sequence[Numbers]:
    axes = specimen.seen_axes
    return [{"along": {a: 1.0}, "across": {b: 1.0}} for a in axes for b in axes if a != b]


def _off_the_tip(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    return {"toward": {"z": 1.0}}


def _on_a_stalk(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """The tip's sensor sits on a stalk that turns with the last element."""
    p, stalk = shapes.p.copy(), acting.size * _TENTH_MM * _vector(acting.numbers["toward"])
    p[:, -1] += np.einsum("rij,j->ri", shapes.R[:, -1], stalk)
    return replace(shapes, p=p)


def _oblique(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """A camera looks on at a slant and is taken for one that does not: what is nearer looks larger."""
    nearer = shapes.p @ _vector(acting.numbers["toward"]) / acting.specimen.length_m
    return replace(shapes, p=shapes.p / (1.0 - _FIFTH_PERCENT * acting.size * nearer)[..., np.newaxis])


def _distorted(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """An electromagnetic tracker's field is bent: its error grows with the square of the distance."""
    toward = _vector(acting.numbers["toward"])
    away = np.sum((shapes.p / acting.specimen.length_m) ** 2, axis=-1, keepdims=True)
    return replace(shapes, p=shapes.p + acting.size * _TENTH_MM * away * toward)


def _toward(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    side = generator.normal(size=len(specimen.seen_axes))
    side /= np.linalg.norm(side)
    return {"toward": dict(zip(specimen.seen_axes, side.tolist(), strict=True))}


def _put_up_anew(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    number = course.number if course.repeats is None else course.number + 100
    generator = np.random.default_rng((int(acting.numbers["seed"]), number))
    return replace(shapes, p=shapes.p + acting.size * _TENTH_MM * generator.uniform(-1.0, 1.0, 3))


FORMS = (
    LabForm(
        cause="measurement_frame",
        name="rigid",
        law="p' = R p + t",
        draw=_pose,
        every=_shifts_and_turns,
        start=10.0,
        signed=True,
        most=200.0,
        seen=_moved,
        parameters=_frame,
    ),
    LabForm(
        cause="measurement_frame",
        name="scale",
        law="p' = s p: a camera's scale",
        start=10.0,
        signed=True,
        most=60.0,
        seen=_stretched,
        parameters=lambda acting: {"scale": 1.0 + _FIFTH_PERCENT * acting.size},
    ),
    LabForm(
        cause="measurement_frame",
        name="sheared",
        law="p' = p + a (p m) n, m at right angles to n: a tracker whose axes are not at right angles",
        draw=_slant,
        every=_each_slant,
        start=10.0,
        signed=True,
        most=100.0,
        seen=_sheared,
        parameters=_shears,
    ),
    LabForm(
        cause="measurement_frame",
        name="lever",
        law="p_tip' = p_tip + R_tip d: the tip's sensor sits on a stalk ahead of it",
        draw=_off_the_tip,
        every=lambda specimen, scale: [{"toward": {"z": 1.0}}],
        start=20.0,
        signed=True,
        most=150.0,
        shape=_on_a_stalk,
        parameters=lambda acting: {"ahead_mm": acting.size * _TENTH_MM * 1e3},
    ),
    LabForm(
        cause="measurement_frame",
        name="oblique",
        law="p' = p / (1 - a p n / L): a camera that looks on at a slant",
        purpose="tune",
        draw=_toward,
        start=10.0,
        most=100.0,
        seen=_oblique,
    ),
    LabForm(
        cause="measurement_frame",
        name="distorted",
        law="p' = p + a |p|^2 n: the bent field of an electromagnetic tracker",
        purpose="judge",
        draw=_toward,
        start=10.0,
        most=200.0,
        seen=_distorted,
    ),
    LabForm(
        cause="measurement_frame",
        name="each_trial",
        law="p' = p + t_trial, uniform in -+t: set up again before each trial",
        purpose="judge",
        draw=lambda specimen, scale, generator: {"seed": int(generator.integers(2**31))},
        start=12.0,
        most=200.0,
        seen=_put_up_anew,
    ),
)
