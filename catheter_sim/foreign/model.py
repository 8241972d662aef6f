"""Somebody's MJCF as it stands, generic causes of its errors, and the data set that was measured on it."""

from __future__ import annotations

import copy
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.catalogue import read_toml
from catheter_sim.diagnosis.dataset import channel_list, check_keys, gravity_of, texts_of, trial_entries
from catheter_sim.diagnosis.mapping import FileMap, file_map, read_mapped
from catheter_sim.diagnosis.readings import step_of
from catheter_sim.diagnosis.thresholds import HELDOUT_SHARE
from catheter_sim.diagnosis.trials import last_trials
from catheter_sim.effects import EFFECTS
from catheter_sim.errors import InputError, cut, shown, unknown
from catheter_sim.tables import own_clock, read_table

# ----------------------------------------------------------------------------------------------------
# Somebody's MJCF as it stands: which columns drive it, which it reports, and the model that is simulated.
#
# Inputs are its actuators' controls, `control_<actuator>`, in the file's own units (radians of a servo,
# newtons of a motor). Outputs are joints (`joint_<name>_deg` or `_mm`), places of sites and bodies
# (`site_<name>_x_mm`, `body_<name>_x_mm`) and scalar sensors of the file (`sensor_<name>`, in SI units).

CONTROL = "control_"
OWN_UNIT = "own"  # what columns of the file's sensors are in
_PLACE = re.compile(r"(site|body)_(.+)_([xyz])_mm")
_PREFIX = "measured "  # of the sensors that are added


@dataclass(frozen=True)
class Column:
    """One output column.

    Attributes:
        name: in files.
        sensor: name of the sensor that gives it, in the model that is simulated.
        index: which of the sensor's numbers.
        factor: from the sensor's SI number to the column's unit.
        unit: "mm", "deg" or `OWN_UNIT`.
        point: name of the site or body whose place it belongs to; "": it is no place.
    """

    name: str
    sensor: str
    index: int
    factor: float
    unit: str
    point: str = ""


@dataclass(frozen=True)
class ForeignModel:
    """A model from a file.

    Attributes:
        path: of the file.
        gravity_mps2: in the world frame, shape (3,); None: the file's own.
        columns: the outputs that are wanted.
        timestep_s: of the simulation; None: the file's own.
    """

    path: Path
    gravity_mps2: tuple[float, float, float] | None = None
    columns: tuple[Column, ...] = ()
    timestep_s: float | None = None
    spec: mujoco.MjSpec = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Read the file.

        Raises:
            InputError: it is no MJCF that MuJoCo compiles, or nothing drives it.
        """
        object.__setattr__(self, "spec", _read(self.path))
        if not self.compiled.nu:
            raise InputError(f"{self.path}: the model has no actuator, so that no input can drive it")

    @cached_property
    def compiled(self) -> mujoco.MjModel:
        """The model as the file has it."""
        try:
            return self.spec.copy().compile()
        except ValueError as error:
            raise _refused(self.path, error) from None

    @cached_property
    def simulated(self) -> mujoco.MjModel:
        """The model with a sensor for each wanted output, under the gravity that was asked for."""
        spec = self.spec.copy()
        for sensor in dict.fromkeys(column.sensor for column in self.columns):
            if sensor.startswith(_PREFIX):
                what, name = sensor.removeprefix(_PREFIX).split(" ", 1)
                kind, of = {
                    "joint": (mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtObj.mjOBJ_JOINT),
                    "site": (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtObj.mjOBJ_SITE),
                    "body": (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtObj.mjOBJ_XBODY),
                }[what]
                spec.add_sensor(name=sensor, type=kind, objtype=of, objname=name)
        if self.timestep_s is not None:
            spec.option.timestep = self.timestep_s
        if self.gravity_mps2 is not None:
            spec.option.gravity = self.gravity_mps2
        model = spec.compile()
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # what diverges is to be seen
        return model

    @cached_property
    def actuators(self) -> tuple[str, ...]:
        """The actuators' names; one without a name is called by its number, from 1."""
        return tuple(self.compiled.actuator(k).name or str(k + 1) for k in range(self.compiled.nu))

    @property
    def resting_controls(self) -> Array:
        """The controls of the first keyframe, where the model begins, or zeros, shape (nu,)."""
        compiled = self.compiled
        return np.array(compiled.key_ctrl[0] if compiled.nkey else np.zeros(compiled.nu))

    @property
    def input_columns(self) -> tuple[str, ...]:
        """The names of the input columns, in the order of the controls."""
        return tuple(CONTROL + name for name in self.actuators)

    def unit_of(self, channel: str) -> str:
        """Return the unit of an input or output, for maps: "rad", "m", "deg" or "mm"; "1": the file's own.

        A servo's control is in rad or m, by the joint that it holds; other controls have no unit here.
        """
        if channel not in self.input_columns:
            return "1" if channel.startswith("sensor_") else channel.rsplit("_", 1)[-1]
        model, index = self.compiled, self.input_columns.index(channel)
        servo = bool(model.actuator_biasprm[index, 1]) and not model.actuator_dyntype[index]
        if not servo or int(model.actuator_trntype[index]) not in _OF_JOINTS:
            return "1"
        return _SI_UNITS.get(int(model.jnt_type[model.actuator_trnid[index, 0]]), "1")

    @cached_property
    def output_columns(self) -> tuple[str, ...]:
        """The names of all outputs that the model can give."""
        model, names = self.compiled, []
        for k in range(model.njnt):
            unit = _JOINT_UNITS.get(int(model.jnt_type[k]))
            if unit and model.joint(k).name:
                names.append(f"joint_{model.joint(k).name}_{unit}")
        points = [("site", model.site(k).name) for k in range(model.nsite)]
        points += [("body", model.body(k).name) for k in range(1, model.nbody)]
        names += [f"{what}_{name}_{axis}_mm" for what, name in points if name for axis in "xyz"]
        for k in range(model.nsensor):
            if int(model.sensor_dim[k]) == 1 and model.sensor(k).name:
                names.append(f"sensor_{model.sensor(k).name}")
        return tuple(names)

    def measured(self, names: Sequence[str], where: str) -> ForeignModel:
        """Return the model with these outputs wanted.

        Raises:
            InputError: the model has no such output; `where` says who asked.
        """
        return replace(self, columns=tuple(self._column(name, where) for name in names))

    def _column(self, name: str, where: str) -> Column:
        if name not in self.output_columns:
            raise unknown("output column", name, self.output_columns, where)
        place = _PLACE.fullmatch(name)
        if place:
            sensor = f"{_PREFIX}{place[1]} {place[2]}"
            return Column(name, sensor, "xyz".index(place[3]), 1e3, "mm", f"{place[1]} {place[2]}")
        if name.startswith("joint_"):
            joint, unit = name.removeprefix("joint_").rsplit("_", 1)
            return Column(name, f"{_PREFIX}joint {joint}", 0, _FACTORS[unit], unit)
        return Column(name, name.removeprefix("sensor_"), 0, 1.0, OWN_UNIT)

    @cached_property
    def sensor_places(self) -> np.ndarray:
        """Where each wanted column stands in the sensors' data of `simulated`, shape (o,)."""
        places = [int(self.simulated.sensor(item.sensor).adr[0]) + item.index for item in self.columns]
        return np.array(places, dtype=int)

    @property
    def factors(self) -> Array:
        """From the sensors' numbers to the columns' units, shape (o,)."""
        return np.array([item.factor for item in self.columns])


_FACTORS = {"deg": 180.0 / math.pi, "mm": 1e3}
_JOINT_UNITS = {
    int(mujoco.mjtJoint.mjJNT_HINGE): "deg",
    int(mujoco.mjtJoint.mjJNT_SLIDE): "mm",
}
_SI_UNITS = {int(mujoco.mjtJoint.mjJNT_HINGE): "rad", int(mujoco.mjtJoint.mjJNT_SLIDE): "m"}
_OF_JOINTS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


def _read(path: Path) -> mujoco.MjSpec:
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise _refused(path, error) from None


def _refused(path: Path, error: ValueError) -> InputError:
    return InputError(f"{path}: MuJoCo does not take it: {cut(' '.join(str(error).split()), 200)}")


# ----------------------------------------------------------------------------------------------------
# The generic causes of error of a model that nobody described: what each does, with which numbers.
#
# A number acts on what is commanded (gain, offset, play, delay), in the model (damping, dry friction,
# stiffness, mass) or on where points are seen (the tracker's frame). A cause frees its numbers in variants:
# one actuator's or joint's alone, then all. Numbers are in SI units, controls in the file's own.

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

    `form` says in words which of them.
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


# ----------------------------------------------------------------------------------------------------
# What a model with numbers of its causes would have been measured to do: MuJoCo itself, many at a time.
#
# A trial starts where the model's first keyframe (or its reference) stands, at rest, and is first held for
# a while under its first row's controls. Controls go on straight lines from row to row. What is commanded
# passes gain and offset, then play, then the delay.

_LARGE = 1e6  # error of a run that diverged, in the columns' units
_ORDER = {GAIN: 1, OFFSET: 2, BACKLASH: 3}  # in which a command passes them


@dataclass(frozen=True)
class ForeignTrial:
    """One recording.

    Attributes:
        file: its name.
        role: "train" or "heldout".
        time_s: from zero, shape (r,) [s].
        controls: of all actuators, in the file's units, shape (r, nu).
        outputs: in the columns' units, NaN where nothing was measured, shape (r, o).
    """

    file: str
    role: str
    time_s: Array
    controls: Array
    outputs: Array


@dataclass(frozen=True)
class Runner:
    """Runs a model along trials.

    The first row is held for `settle_s` before a trial begins [s].
    """

    model: ForeignModel
    settle_s: float = 0.0
    jobs: int = 1

    def outputs(self, many: Sequence[Values], trials: Sequence[ForeignTrial]) -> list[list[Array]]:
        """Return what each of many sets of numbers gives along each trial: [set][trial] of shape (r, o)."""
        models = [changed(self.model, values) for values in many]
        found: list[list[Array]] = [[] for _ in many]
        with rollout.Rollout(nthread=self.jobs if self.jobs > 1 else 0) as pool:
            for trial in trials:
                for index, outputs in enumerate(self._along(pool, models, many, trial)):
                    found[index].append(outputs)
        return found

    def _along(
        self,
        pool: rollout.Rollout,
        models: Sequence[mujoco.MjModel],
        many: Sequence[Values],
        trial: ForeignTrial,
    ) -> list[Array]:
        step_s = float(self.model.simulated.opt.timestep)
        at_s: Array = step_s * np.arange(float(np.ceil(trial.time_s[-1] / step_s)) + 1.0)
        held = round(self.settle_s / step_s)
        arriving = np.stack([arriving_controls(self.model, trial, values, at_s) for values in many])
        rest = np.repeat(arriving[:, :1], held, axis=1)
        controls = np.concatenate([rest, arriving], axis=1)
        states = np.stack([_at_rest(model) for model in models])
        datas = [mujoco.MjData(models[0]) for _ in range(max(self.jobs, 1))]
        _, sensed = pool.rollout(list(models), datas, states, controls, skip_checks=False)
        sensed = sensed[:, held:, self.model.sensor_places] * self.model.factors
        rows = []
        for own, values in zip(sensed, many, strict=True):
            own = np.where(np.isfinite(own), own, _LARGE)
            columns = [np.interp(trial.time_s, at_s, own[:, k]) for k in range(own.shape[1])]
            rows.append(as_tracked(self.model, np.stack(columns, axis=1), values))
        return rows


def _at_rest(model: mujoco.MjModel) -> Array:
    data = mujoco.MjData(model)
    reset(model, data)
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    return state


def arriving_controls(model: ForeignModel, trial: ForeignTrial, values: Values, at_s: Array) -> Array:
    """Return the controls that arrive at times from the trial's start, shape (n, nu)."""
    rows, delay = trial.controls.copy(), 0.0
    for number, value in sorted(values.items(), key=lambda item: _ORDER.get(item[0].cause, 0)):
        if number.cause == GAIN:
            rows[:, number.of[0]] *= value
        elif number.cause == OFFSET:
            rows[:, number.of[0]] += value
        elif number.cause == BACKLASH:
            rows[:, number.of[0]] = _after_play(rows[:, number.of[0]], value)
        elif number.cause == DELAY:
            delay = value
    when = np.maximum(at_s - delay, 0.0)
    return np.stack([np.interp(when, trial.time_s, column) for column in rows.T], axis=1)


def _after_play(rows: Array, width: float) -> Array:
    """Return rows (r,) behind a dead-band of a width, in whose middle they begin."""
    found, now = np.empty_like(rows), float(rows[0])
    for index, value in enumerate(rows):
        now = min(max(now, value - 0.5 * width), value + 0.5 * width)
        found[index] = now
    return found


def as_tracked(model: ForeignModel, outputs: Array, values: Values) -> Array:
    """Return outputs (r, o) as a tracker with another frame sees their points; the rest stays."""
    own = {number.name: value for number, value in values.items() if number.cause == FRAME}
    if not own:
        return outputs
    tracked = outputs.copy()
    for point in dict.fromkeys(column.point for column in model.columns if column.point):
        places = {item.index: k for k, item in enumerate(model.columns) if item.point == point}
        points = np.zeros((len(outputs), 3))
        for axis, k in places.items():
            points[:, axis] = outputs[:, k]
        moved = turned_and_shifted(points, own)
        for axis, k in places.items():
            tracked[:, k] = moved[:, axis]
    return tracked


def turned_and_shifted(points: Array, values: Mapping[str, float]) -> Array:
    """Return points (..., 3) [mm] as a tracker sees them whose frame is turned and shifted."""
    angles = [values.get(f"rotation_{axis}_deg", 0.0) for axis in "xyz"]
    shift = np.array([values.get(f"translation_{axis}_mm", 0.0) for axis in "xyz"])
    turn = Rotation.from_rotvec(angles, degrees=True).as_matrix()
    return np.asarray(points @ turn.T + shift)


def changed(model: ForeignModel, values: Values) -> mujoco.MjModel:
    """Return the simulated model with what numbers change in it."""
    inside = {n: v for n, v in values.items() if n.cause in _INSIDE and v != n.null}
    if not inside:
        return model.simulated
    own = copy.copy(model.simulated)
    for number, value in inside.items():
        if number.cause == DAMPING:
            own.dof_damping[own.jnt_dofadr[number.of[0]]] += value
        elif number.cause == FRICTION:
            own.dof_frictionloss[own.jnt_dofadr[number.of[0]]] += value
        elif number.cause == STIFFNESS and number.of:
            own.actuator_gainprm[list(number.of), 0] *= value
            own.actuator_biasprm[list(number.of), 0:2] *= value
        elif number.cause == STIFFNESS:
            own.jnt_stiffness[:] *= value
            own.tendon_stiffness[:] *= value
    for body, mass_kg, place_m in masses_of(inside):
        add_mass(own, body, mass_kg, place_m)
        mujoco.mj_setConst(own, mujoco.MjData(own))
    return own


_INSIDE = (DAMPING, FRICTION, STIFFNESS, PAYLOAD)


def masses_of(values: Values) -> list[tuple[int, float, Array]]:
    """Return the masses in numbers: body, mass [kg] and place from the body's centre, shape (3,) [m]."""
    found = []
    for number, grams in values.items():
        if number.cause == PAYLOAD and number.axis < 0:
            place = np.zeros(3)
            for other, value in values.items():
                if other.cause == PAYLOAD and other.of == number.of and other.axis >= 0:
                    place[other.axis] = 1e-3 * value
            found.append((number.of[0], 1e-3 * grams, place))
    return found


def add_mass(own: mujoco.MjModel, body: int, mass_kg: float, place_m: Array) -> None:
    """Add a point mass to a body, a place from its centre of mass along the body's axes, shape (3,) [m]."""
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, own.body_iquat[body])
    turn: Array = flat.reshape(3, 3)
    inertia = turn @ np.diag(own.body_inertia[body]) @ turn.T
    before = float(own.body_mass[body])
    reduced = before * mass_kg / max(before + mass_kg, 1e-12)
    inertia = inertia + reduced * (place_m @ place_m * np.eye(3) - np.outer(place_m, place_m))
    moments, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, axes.reshape(-1))
    own.body_mass[body] = before + mass_kg
    own.body_ipos[body] += mass_kg / max(before + mass_kg, 1e-12) * place_m
    own.body_iquat[body] = quaternion
    own.body_inertia[body] = np.maximum(moments, 0.0)
    own.body_sameframe[body] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)


# ----------------------------------------------------------------------------------------------------
# A data set whose robot is somebody's MJCF: `dataset.toml` with `control_` columns, read and checked.

_KEYS: Mapping[str, tuple[str, ...]] = {
    "dataset": ("name", "robot", "source", "licence"),
    "conditions": ("gravity_mps2", "motion"),
    "channels": ("inputs", "outputs"),
}
_OPTIONAL: Mapping[str, tuple[str, ...]] = {"conditions": ("settle_s",)}
_LONGEST_SETTLE_S = 60.0
LEAST_ROWS = 20  # of a trial: fewer do not show their noise


@dataclass(frozen=True)
class ForeignData:
    """Recordings of a robot that somebody's MJCF describes.

    Attributes:
        name, robot: as `dataset.toml` has them.
        model: with the outputs that were measured.
        trials: in their order; one at least of each role.
        settle_s: for which the first row is held before a trial begins [s].
    """

    name: str
    robot: str
    model: ForeignModel
    trials: tuple[ForeignTrial, ...]
    settle_s: float

    def of(self, role: str) -> tuple[ForeignTrial, ...]:
        """Return the trials of a role."""
        return tuple(trial for trial in self.trials if trial.role == role)


def is_foreign(folder: str | os.PathLike[str]) -> bool:
    """Return whether a data set's robot is an MJCF that is driven by its actuators' controls.

    Whatever is wrong with the folder is left to who reads it.
    """
    try:
        document = read_toml(Path(folder) / "dataset.toml")
        robot, inputs = document["dataset"]["robot"], document["channels"]["inputs"]
    except (InputError, KeyError, TypeError):
        return False
    named = isinstance(robot, str) and robot.endswith(".xml") and isinstance(inputs, list)
    return named and any(isinstance(name, str) and name.startswith(CONTROL) for name in inputs)


def read_foreign(folder: str | os.PathLike[str]) -> ForeignData:
    """Return the data set in a folder, checked.

    Raises:
        InputError: anything is missing, unknown, of the wrong kind or impossible; one line names the file
            and the key, line or column.
    """
    root, path = Path(folder), Path(folder) / "dataset.toml"
    document = read_toml(path)
    check_keys(document, str(path), _KEYS, _OPTIONAL, ("map",))
    name, robot, _, _ = texts_of(document["dataset"], str(path))
    conditions = document["conditions"]
    if conditions["motion"] != "dynamic":
        raise InputError(
            f'{path}: conditions.motion = {shown(conditions["motion"])}: "dynamic" is needed: a robot from '
            "somebody's MJCF is simulated in motion"
        )
    x, y, z = gravity_of(conditions["gravity_mps2"], f"{path}: conditions.gravity_mps2").tolist()
    settle_s = conditions.get("settle_s", 0.0)
    if isinstance(settle_s, bool) or not isinstance(settle_s, int | float):
        raise InputError(f"{path}: conditions.settle_s: a number is needed, not {shown(settle_s)}")
    if not 0.0 <= settle_s <= _LONGEST_SETTLE_S:
        raise InputError(
            f"{path}: conditions.settle_s = {settle_s:g}: must lie in 0 to {_LONGEST_SETTLE_S:g} s"
        )
    plain = ForeignModel(root / robot, (x, y, z))
    inputs = channel_list(document["channels"]["inputs"], f"{path}: channels.inputs")
    outputs = channel_list(document["channels"]["outputs"], f"{path}: channels.outputs")
    for name in inputs:
        if name not in plain.input_columns:
            raise unknown("input channel", name, plain.input_columns, f"{path}: channels.inputs")
    model = plain.measured(outputs, f"{path}: channels.outputs")
    mapping = file_map(document.get("map"), inputs, outputs, str(path), model.unit_of)
    entries = trial_entries(document["trials"], root, str(path), mapping is not None)
    trials = [_trial(root, entry, model, inputs, mapping) for entry in entries]
    trials = _with_roles(trials, str(path))
    return ForeignData(name, robot, model, tuple(trials), float(settle_s))


def _trial(
    root: Path,
    entry: tuple[str, str, str],
    model: ForeignModel,
    inputs: Sequence[str],
    mapping: FileMap | None,
) -> ForeignTrial:
    file, role, log = entry
    wanted = [column.name for column in model.columns]
    if mapping is not None:
        table = read_mapped(root / file, mapping, inputs, wanted, root / log if log else None)
    else:
        table = read_table(root / file, only=(*inputs, *wanted))
    for name in (*inputs, *wanted):
        if name not in table.columns:
            columns = cut(", ".join(("time_s", *table.columns, *table.ignored)), 250)
            raise InputError(f"{table.where}: no column {name}, which dataset.toml lists; columns: {columns}")
    table.require_increasing_time()
    commanded = replace(table, columns={name: table.columns[name] for name in inputs})
    commanded.require_complete()
    if len(table.time_s) < LEAST_ROWS:
        raise InputError(f"{table.where}: {len(table.time_s)} rows: a trial needs {LEAST_ROWS} at least")
    outputs = np.stack([table.columns[name] for name in wanted], axis=1)
    if np.isnan(outputs).all():
        raise InputError(f"{table.where}: every value of the outputs is missing")
    standing = np.tile(model.resting_controls, (len(table.time_s), 1)).T
    controls = [table.columns.get(name, own) for name, own in zip(model.input_columns, standing, strict=True)]
    return ForeignTrial(file, role, own_clock(table.time_s), np.stack(controls, axis=1), outputs)


def _with_roles(trials: Sequence[ForeignTrial], where: str) -> list[ForeignTrial]:
    """Return trials of which each has a role: without any held out, the last ones without a role are.

    As for other robots (`parting.split`); a single trial is cut where the share to be held out begins.
    """
    heldout = {index for index, trial in enumerate(trials) if trial.role == "heldout"}
    free = [index for index, trial in enumerate(trials) if not trial.role]
    if not heldout and not free:
        raise InputError(
            f"{where}: every trial has the role train; give one the role heldout, or leave the roles out"
        )
    if len(trials) == 1:
        return _cut(trials[0], where)
    heldout = heldout or last_trials([len(trial.time_s) for trial in trials], free)
    return [replace(t, role="heldout" if k in heldout else "train") for k, t in enumerate(trials)]


def _cut(trial: ForeignTrial, where: str) -> list[ForeignTrial]:
    """Return the beginning of a trial, which trains, and all of it with nothing measured there, held out."""
    first = round((1.0 - HELDOUT_SHARE) * len(trial.time_s))
    later = trial.outputs.copy()
    later[:first] = np.nan
    for part, said in ((trial.outputs[:first], "first"), (later, "last")):
        if np.isnan(part).all():
            raise InputError(
                f"{where}: trials: {trial.file} is the only trial and is cut at row {first + 1}; "
                f"no output is measured in its {said} part"
            )
    train = replace(
        trial,
        role="train",
        time_s=trial.time_s[:first],
        controls=trial.controls[:first],
        outputs=trial.outputs[:first],
    )
    return [train, replace(trial, role="heldout", outputs=later)]


def noise_of(trials: Sequence[ForeignTrial], least_share: float) -> Array:
    """Return the noise of each output from its third differences, shape (o,), in the columns' units.

    Of independent errors of size s these are sqrt(20) s; what moves smoothly leaves little there. A reading
    that is repeated counts once, unless rounding repeats it. The noise is no less than what rounding leaves,
    nor than a share of the column's range.
    """
    controls = np.concatenate([trial.controls for trial in trials])
    columns = trials[0].outputs.shape[1]
    found = np.empty(columns)
    for k in range(columns):
        parts = [trial.outputs[np.isfinite(trial.outputs[:, k]), k] for trial in trials]
        rounding = step_of(np.concatenate([t.outputs[:, k] for t in trials]), controls) / math.sqrt(12.0)
        if not rounding:
            parts = [part[np.diff(part, prepend=np.nan) != 0.0] for part in parts]
        differences = np.concatenate([np.diff(part, 3) for part in parts if len(part) > 3] or [np.zeros(1)])
        spread = 1.4826 * float(np.median(np.abs(differences))) / math.sqrt(20.0)
        values = np.concatenate(parts)
        span = float(np.ptp(values)) if len(values) else 1.0
        found[k] = max(spread, rounding, least_share * span, 1e-9)
    return found
