"""What a model with numbers of its causes would have been measured to do: MuJoCo itself, many at a time.

A trial starts where the model's first keyframe (or its reference) stands, at rest, and is first held for a
while under its first row's controls. Controls go on straight lines from row to row. What is commanded passes
gain and offset, then play, then the delay.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import rollout
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.foreign import causes
from catheter_sim.foreign.causes import Values
from catheter_sim.foreign.model import ForeignModel

_LARGE = 1e6  # error of a run that diverged, in the columns' units
_ORDER = {causes.GAIN: 1, causes.OFFSET: 2, causes.BACKLASH: 3}  # in which a command passes them


@dataclass(frozen=True)
class Trial:
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

    Attributes:
        model: with the wanted outputs.
        settle_s: for which the first row is held before a trial begins [s].
        jobs: runs at a time.
    """

    model: ForeignModel
    settle_s: float = 0.0
    jobs: int = 1

    def outputs(self, many: Sequence[Values], trials: Sequence[Trial]) -> list[list[Array]]:
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
        trial: Trial,
    ) -> list[Array]:
        step_s = float(self.model.simulated.opt.timestep)
        at_s: Array = step_s * np.arange(float(np.ceil(trial.time_s[-1] / step_s)) + 1.0)
        held = round(self.settle_s / step_s)
        arriving = np.stack([arriving_controls(self.model, trial, values, at_s) for values in many])
        rest = np.repeat(arriving[:, :1], held, axis=1)
        controls = np.concatenate([rest, arriving], axis=1)
        states = np.stack([_at_rest(model) for model in models])
        _, seen = pool.rollout(list(models), self._datas(models[0]), states, controls, skip_checks=False)
        seen = seen[:, held:, self.model.sensor_places] * self.model.factors
        rows = []
        for own, values in zip(seen, many, strict=True):
            own = np.where(np.isfinite(own), own, _LARGE)
            columns = [np.interp(trial.time_s, at_s, own[:, k]) for k in range(own.shape[1])]
            rows.append(as_tracked(self.model, np.stack(columns, axis=1), values))
        return rows

    def _datas(self, model: mujoco.MjModel) -> list[mujoco.MjData]:
        return [mujoco.MjData(model) for _ in range(max(self.jobs, 1))]


def _at_rest(model: mujoco.MjModel) -> Array:
    data = mujoco.MjData(model)
    causes.reset(model, data)
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    return state


def arriving_controls(model: ForeignModel, trial: Trial, values: Values, at_s: Array) -> Array:
    """Return the controls that arrive at times from the trial's start, shape (n, nu)."""
    rows, delay = trial.controls.copy(), 0.0
    for number, value in sorted(values.items(), key=lambda item: _ORDER.get(item[0].cause, 0)):
        if number.cause == causes.GAIN:
            rows[:, number.of[0]] *= value
        elif number.cause == causes.OFFSET:
            rows[:, number.of[0]] += value
        elif number.cause == causes.BACKLASH:
            rows[:, number.of[0]] = _after_play(rows[:, number.of[0]], value)
        elif number.cause == causes.DELAY:
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
    own = {number.name: value for number, value in values.items() if number.cause == causes.FRAME}
    if not own:
        return outputs
    seen = outputs.copy()
    for point in dict.fromkeys(column.point for column in model.columns if column.point):
        places = {item.index: k for k, item in enumerate(model.columns) if item.point == point}
        points = np.zeros((len(outputs), 3))
        for axis, k in places.items():
            points[:, axis] = outputs[:, k]
        moved = turned_and_shifted(points, own)
        for axis, k in places.items():
            seen[:, k] = moved[:, axis]
    return seen


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
        if number.cause == causes.DAMPING:
            own.dof_damping[own.jnt_dofadr[number.of[0]]] += value
        elif number.cause == causes.FRICTION:
            own.dof_frictionloss[own.jnt_dofadr[number.of[0]]] += value
        elif number.cause == causes.STIFFNESS and number.of:
            own.actuator_gainprm[list(number.of), 0] *= value
            own.actuator_biasprm[list(number.of), 0:2] *= value
        elif number.cause == causes.STIFFNESS:
            own.jnt_stiffness[:] *= value
            own.tendon_stiffness[:] *= value
    for body, mass_kg, place_m in masses_of(inside):
        add_mass(own, body, mass_kg, place_m)
        mujoco.mj_setConst(own, mujoco.MjData(own))
    return own


_INSIDE = (causes.DAMPING, causes.FRICTION, causes.STIFFNESS, causes.PAYLOAD)


def masses_of(values: Values) -> list[tuple[int, float, Array]]:
    """Return the masses in numbers: body, mass [kg] and place from the body's centre, shape (3,) [m]."""
    found = []
    for number, grams in values.items():
        if number.cause == causes.PAYLOAD and number.axis < 0:
            place = np.zeros(3)
            for other, value in values.items():
                if other.cause == causes.PAYLOAD and other.of == number.of and other.axis >= 0:
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
