"""The generic causes of error of a model that nobody described: what each does, with which numbers.

A number acts on what is commanded (gain, offset, play, delay), in the model (damping, dry friction,
stiffness, mass) or on where points are seen (the tracker's frame). A cause frees its numbers in variants: one
actuator's or joint's alone, then all. Numbers are in SI units, controls in the file's own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.effects import EFFECTS
from catheter_sim.foreign.model import ForeignModel

LONGEST_DELAY_S = 0.5
_GRAMS = 1e3


@dataclass(frozen=True)
class Number:
    """One number of a cause.

    Attributes:
        cause: its name.
        name: of the number, with its unit.
        null: at which it does nothing.
        start: where a fit starts, a change that matters.
        lower, upper: bounds.
        of: the model's numbers of the actuators, the joint or the body that it is of; (): of the whole model.
        axis: 0, 1 or 2 of a place; -1: it is none.
    """

    cause: str
    name: str
    null: float
    start: float
    lower: float
    upper: float
    of: tuple[int, ...] = ()
    axis: int = -1

    @property
    def scale(self) -> float:
        """The change that matters."""
        return abs(self.start - self.null)


@dataclass(frozen=True)
class Variant:
    """Numbers of one cause that are freed together.

    Attributes:
        cause: its name.
        form: which of them, in words.
        numbers: what is freed.
    """

    cause: str
    form: str
    numbers: tuple[Number, ...]


Values = Mapping[Number, float]

GAIN, OFFSET, BACKLASH = "actuation_gain", "actuation_offset", "backlash"
STIFFNESS, PAYLOAD, FRAME = "stiffness", "payload", "measurement_frame"
DELAY, DAMPING, FRICTION = "delay", "damping", "friction_loss"
SUMMARIES = {
    GAIN: "an actuator's control has another scale",
    OFFSET: "an actuator's control has another zero",
    BACKLASH: "an actuator's control has a dead-band on reversal",
    DELAY: "controls arrive late",
    DAMPING: "joints resist their speed otherwise",
    FRICTION: "joints rub",
    STIFFNESS: "springs, or servos, are stiffer or softer",
    PAYLOAD: "a body carries a mass that the model does not know",
    FRAME: "the tracker's frame is turned or shifted",
}
assert {GAIN, OFFSET, BACKLASH, STIFFNESS, PAYLOAD, FRAME} <= set(EFFECTS)  # called as the package does


def variants_of(model: ForeignModel) -> tuple[Variant, ...]:
    """Return all that may be wrong with a model, cause by cause, fewest numbers first."""
    found: list[Variant] = []
    for maker in (_commands, _delay, _joints, _springs, _payload, _frame):
        found += maker(model)
    return tuple(sorted(found, key=lambda item: list(SUMMARIES).index(item.cause)))


def _ranges(model: ForeignModel) -> Array:
    """Return how far each control may go, at least 1e-6, shape (nu,); 1 where the file does not say."""
    compiled = model.compiled
    width = np.where(compiled.actuator_ctrllimited, np.ptp(compiled.actuator_ctrlrange, axis=1), 1.0)
    return np.maximum(np.asarray(width, float), 1e-6)


def servos(compiled: mujoco.MjModel) -> tuple[int, ...]:
    """Return the actuators that hold a position: force = k (u - q) and more."""
    affine = compiled.actuator_biastype == int(mujoco.mjtBias.mjBIAS_AFFINE)
    return tuple(np.flatnonzero(affine & (compiled.actuator_biasprm[:, 1] < 0.0)).tolist())


def _commands(model: ForeignModel) -> Iterator[Variant]:
    """Yield gains and offsets, and the play of what holds a position."""
    width = _ranges(model)
    scales = [
        Number(GAIN, f"scale_{name}", 1.0, 1.1, 0.2, 5.0, (k,)) for k, name in enumerate(model.actuators)
    ]
    yield from _each_and_all(GAIN, model.actuators, scales)
    zeros = [
        Number(OFFSET, f"offset_{name}", 0.0, 0.02 * size, -0.5 * size, 0.5 * size, (k,))
        for k, (name, size) in enumerate(zip(model.actuators, width, strict=True))
    ]
    yield from _each_and_all(OFFSET, model.actuators, zeros)
    holds = servos(model.compiled)
    plays = [
        Number(
            BACKLASH,
            f"width_{model.actuators[k]}",
            0.0,
            0.02 * min(width[k], 1.0),
            0.0,
            0.3 * width[k],
            (k,),
        )
        for k in holds
    ]
    yield from _each_and_all(BACKLASH, [model.actuators[k] for k in holds], plays)


def _delay(model: ForeignModel) -> Iterator[Variant]:
    yield Variant(DELAY, "of all controls", (Number(DELAY, "delay_s", 0.0, 0.04, 0.0, LONGEST_DELAY_S),))


def _joints(model: ForeignModel) -> Iterator[Variant]:
    """Yield damping and dry friction of hinges and slides, by what the model's joints are moved with."""
    joints = driven_joints(model)
    strength = strengths(model)
    names = [model.compiled.joint(k).name or str(k + 1) for k in joints]
    dofs = [int(model.compiled.jnt_dofadr[k]) for k in joints]
    damping, rubbing = [], []
    for joint, name, dof in zip(joints, names, dofs, strict=True):
        size, now = strength[dof], float(np.ravel(model.compiled.dof_damping[dof])[0])
        start = max(0.05 * size, 0.3 * now)
        damping.append(Number(DAMPING, f"damping_{name}", 0.0, start, -now, 10.0 * size, (joint,)))
        rubs = float(model.compiled.dof_frictionloss[dof])
        rubbing.append(Number(FRICTION, f"friction_{name}", 0.0, 0.05 * size, -rubs, size, (joint,)))
    yield from _each_and_all(DAMPING, names, damping)
    yield from _each_and_all(FRICTION, names, rubbing)


def _springs(model: ForeignModel) -> Iterator[Variant]:
    """Yield the scale of all springs of joints and tendons, and of servos, each and all."""
    compiled = model.compiled
    if np.any(compiled.jnt_stiffness) or np.any(compiled.tendon_stiffness):
        yield Variant(STIFFNESS, "springs", (Number(STIFFNESS, "scale_springs", 1.0, 1.15, 0.1, 10.0),))
    holds = servos(compiled)
    names = [model.actuators[k] for k in holds]
    scales = [
        Number(STIFFNESS, f"scale_servo_{name}", 1.0, 1.15, 0.1, 10.0, (k,))
        for k, name in zip(holds, names, strict=True)
    ]
    yield from _each_and_all(STIFFNESS, names, scales)
    if len(holds) > 1:
        alike = Number(STIFFNESS, "scale_servos", 1.0, 1.15, 0.1, 10.0, holds)
        yield Variant(STIFFNESS, "all servos alike", (alike,))


def _payload(model: ForeignModel) -> Iterator[Variant]:
    """Yield a mass at the end of each branch that moves: at its centre of mass, and anywhere near it."""
    compiled = model.compiled
    parents = set(compiled.body_parentid.tolist())
    for body in range(1, compiled.nbody):
        if body in parents or compiled.body_weldid[body] == 0:
            continue
        name = compiled.body(body).name or str(body)
        own = max(float(compiled.body_subtreemass[compiled.body_rootid[body]]), 1e-6) * _GRAMS
        mass = Number(PAYLOAD, f"mass_{name}_g", 0.0, 0.05 * own, 0.0, 2.0 * own, (body,))
        yield Variant(PAYLOAD, f"at {name}", (mass,))
        size = 1e3 * float(compiled.stat.extent)
        places = [
            Number(PAYLOAD, f"place_{name}_{axis}_mm", 0.0, 0.05 * size, -0.5 * size, 0.5 * size, (body,), k)
            for k, axis in enumerate("xyz")
        ]
        yield Variant(PAYLOAD, f"beside {name}", (mass, *places))


def _frame(model: ForeignModel) -> Iterator[Variant]:
    if not any(column.point for column in model.columns):
        return
    turns = [Number(FRAME, f"rotation_{axis}_deg", 0.0, 2.0, -45.0, 45.0) for axis in "xyz"]
    shifts = [Number(FRAME, f"translation_{axis}_mm", 0.0, 5.0, -500.0, 500.0) for axis in "xyz"]
    yield Variant(FRAME, "shifted", tuple(shifts))
    yield Variant(FRAME, "turned and shifted", (*turns, *shifts))


def _each_and_all(cause: str, names: Sequence[str], numbers: Sequence[Number]) -> Iterator[Variant]:
    for name, number in zip(names, numbers, strict=True):
        yield Variant(cause, f"of {name}", (number,))
    if len(numbers) > 1:
        yield Variant(cause, "of all, each its own", tuple(numbers))


def driven_joints(model: ForeignModel) -> list[int]:
    """Return the hinges and slides of the model."""
    kinds = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    return [k for k in range(model.compiled.njnt) if int(model.compiled.jnt_type[k]) in kinds]


def strengths(model: ForeignModel) -> Array:
    """Return the largest force or moment with which actuators and weight move each degree of freedom, (nv,).

    At the model's reference, controls at the ends of their ranges; at least a thousandth of the largest.
    """
    simulated = model.simulated
    data = mujoco.MjData(simulated)
    reset(simulated, data)
    found = np.zeros(simulated.nv)
    limited = simulated.actuator_ctrllimited.astype(bool)
    for end in range(2):
        for actuator in range(simulated.nu):
            data.ctrl[:] = 0.0
            data.ctrl[actuator] = (
                simulated.actuator_ctrlrange[actuator, end] if limited[actuator] else 2.0 * end - 1.0
            )
            if simulated.na:  # as if each activation followed its control; only the size matters
                data.act[:] = data.ctrl[np.minimum(np.arange(simulated.na), simulated.nu - 1)]
            mujoco.mj_forward(simulated, data)
            found = np.maximum(found, np.abs(data.qfrc_actuator))
    found = np.minimum(np.maximum(found, np.abs(data.qfrc_bias)), 1e9)
    return np.maximum(found, 1e-3 * max(float(found.max()), 1e-9))


def reset(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Put a model at its first keyframe, at its reference where it has none, without speed."""
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    else:
        mujoco.mj_resetData(model, data)
    data.qvel[:] = 0.0
