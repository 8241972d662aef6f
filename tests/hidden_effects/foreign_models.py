"""The bench of models that the package did not make, with one hidden cause each."""

from __future__ import annotations

import math
import shutil
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import tomli_w
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.foreign.diagnose import ForeignDiagnosis, diagnose_foreign
from catheter_sim.foreign.model import ForeignModel
from catheter_sim.tables import Table, write_table
from hidden_effects.natural import commit, whole_code
from hidden_effects.running import read_json, write_json

# ----------------------------------------------------------------------------------------------------
# Recordings of foreign models with one hidden cause, made by other means than the diagnosis uses.
#
# The diagnosis simulates friction as MuJoCo's constraint, play as an operator on the command, masses as
# points in `MjModel`, with a step as coarse as the noise allows. Here the step is a quarter of a
# millisecond, and causes are built: dry friction is a smooth force with a hump at low speed (Stribeck),
# play is a joint of its own in series with the driven one, a payload a ball that is welded on beside the
# end, a delay a queue that commands wait in. Readings have noise.

_STEP_S = 0.00025
_ROW_S = 0.02
_TRIAL_S = 6.0
_SETTLE_S = 1.0
_JOINT_NOISE_DEG, _POINT_NOISE_MM = 0.05, 0.3
_LINK_SHARE = 0.3  # of a driven joint's damping that acts behind its play
_WAVES = 3  # of a command


@dataclass(frozen=True)
class Subject:
    """A model that recordings are made of.

    Attributes:
        name: of its folder and file.
        joints: those whose angles are measured.
        site: whose place is measured.
        body: that carries a payload.
        centre: of the commands, shape (nu,).
        reach: how far commands go from there, shape (nu,).
        rates: between which the waves of commands lie [Hz].
        causes: what may be hidden.
        play_joint: joint at which play is built; "": nowhere.
        with_wave: which wave each command follows, and to which side; (): each its own.
    """

    name: str
    joints: tuple[str, ...]
    site: str
    body: str
    centre: tuple[float, ...]
    reach: tuple[float, ...]
    rates: tuple[float, float]
    causes: tuple[str, ...]
    play_joint: str = ""
    with_wave: tuple[tuple[int, int], ...] = ()

    @property
    def columns(self) -> list[str]:
        """The output columns."""
        return [f"joint_{name}_deg" for name in self.joints] + [f"site_{self.site}_{a}_mm" for a in "xyz"]


@dataclass(frozen=True)
class Hidden:
    """What is hidden.

    Attributes:
        cause: its name.
        about: which actuator or joint, in words.
        size: how large, in SI units.
    """

    cause: str
    about: str
    size: float


SUBJECTS = {
    "arm26": Subject(
        "arm26",
        ("shoulder", "elbow"),
        "hand",
        "forearm",
        (0.2, 0.3, 0.2, 0.3, 0.1, 0.15),
        (0.2, 0.3, 0.2, 0.3, 0.1, 0.15),
        (0.6, 1.4),
        (
            "actuation_gain",
            "actuation_offset",
            "delay",
            "damping",
            "friction_loss",
            "payload",
            "measurement_frame",
        ),
        with_wave=((0, 1), (0, -1), (1, 1), (1, -1), (2, 1), (2, -1)),
    ),
    "ur5e": Subject(
        "ur5e",
        tuple(
            f"{n}_joint" for n in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
        ),
        "flange",
        "wrist_3_link",
        (-1.57, -1.57, 1.57, -1.57, -1.57, 0.0),
        (0.5, 0.35, 0.5, 0.6, 0.6, 0.8),
        (0.15, 0.8),
        (
            "actuation_gain",
            "actuation_offset",
            "backlash",
            "delay",
            "damping",
            "friction_loss",
            "stiffness",
            "payload",
            "measurement_frame",
        ),
        "shoulder_pan_joint",
    ),
}


def hide(subject: Subject, generator: np.random.Generator, cause: str = "") -> Hidden:
    """Return a hidden cause, drawn."""
    name = cause or str(generator.choice(list(subject.causes)))
    actuator = int(generator.integers(len(subject.centre)))
    sign = float(generator.choice([-1.0, 1.0]))
    sizes: Mapping[str, tuple[float, float]] = {
        "actuation_gain": (0.1, 0.3),
        "actuation_offset": (0.1, 0.3),  # of the reach
        "backlash": (math.radians(1.0), math.radians(4.0)),
        "delay": (0.03, 0.12),
        "damping": (0.5, 1.5),  # of what is there
        "friction_loss": (0.15, 0.4),  # of a typical moment
        "stiffness": (0.3, 0.6),  # of the servos', lost
        "payload": (0.15, 0.5),  # of the robot's mass
        "measurement_frame": (math.radians(2.0), math.radians(6.0)),
    }
    size = float(generator.uniform(*sizes[name]))
    signed = name in ("actuation_gain", "actuation_offset", "measurement_frame")
    return Hidden(name, str(actuator), sign * size if signed else size)


def recordings(
    folder: Path, subject: Subject, hidden: Hidden | None, generator: np.random.Generator, count: int = 3
) -> list[tuple[Array, Array, Array]]:
    """Return trials: times (r,), controls as commanded (r, nu) and noisy readings (r, o).

    Args:
        folder: with the model's file.
        subject: the model.
        hidden: what is wrong with it; None: nothing.
        generator: of commands and noise.
        count: of trials.
    """
    robot = _Robot(folder / f"{subject.name}.xml", subject, hidden)
    found = []
    for _ in range(count):
        time_s = np.arange(0.0, _TRIAL_S + 1e-9, _ROW_S)
        controls = _commands(subject, time_s, generator)
        readings = robot.played(time_s, controls)
        noise = [_JOINT_NOISE_DEG] * len(subject.joints) + [_POINT_NOISE_MM] * 3
        found.append((time_s, controls, readings + generator.normal(size=readings.shape) * noise))
    return found


def _commands(subject: Subject, time_s: Array, generator: np.random.Generator) -> Array:
    """Return smooth commands that begin at the centre and reverse many times, shape (r, nu)."""
    follows = subject.with_wave or tuple((k, 1) for k in range(len(subject.centre)))
    waves = []
    for _ in range(1 + max(wave for wave, _ in follows)):
        rate = generator.uniform(*subject.rates, _WAVES)
        size = generator.dirichlet(np.ones(_WAVES))
        phase = generator.uniform(0.0, 2.0 * math.pi, _WAVES)
        wave = (size * np.sin(2.0 * math.pi * rate * time_s[:, np.newaxis] + phase)).sum(axis=1)
        waves.append(wave - wave[0] * np.exp(-time_s / 0.5))
    columns = [
        centre + reach * side * waves[wave]
        for centre, reach, (wave, side) in zip(subject.centre, subject.reach, follows, strict=True)
    ]
    return np.round(np.stack(columns, axis=1), 5)


class _Robot:
    """The robot that nature has: the file with what is hidden built in."""

    def __init__(self, path: Path, subject: Subject, hidden: Hidden | None) -> None:
        self._subject, self._hidden = subject, hidden
        spec = mujoco.MjSpec.from_file(str(path))
        spec.option.timestep = _STEP_S
        self._begin = _start_of(spec.copy().compile())
        self._link_damping = 0.0
        if subject.play_joint:
            asis = spec.copy().compile().joint(subject.play_joint)
            self._link_damping = _LINK_SHARE * float(np.ravel(asis.damping)[0])
        if hidden is not None and hidden.cause in _BUILT:
            _BUILT[hidden.cause](spec, subject, hidden)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._typical = self._typical_moments()

    def _is(self, cause: str) -> bool:
        return self._hidden is not None and self._hidden.cause == cause

    @property
    def _size(self) -> float:
        assert self._hidden is not None
        return self._hidden.size

    def _typical_moments(self) -> Array:
        """Return what moves each degree of freedom in ordinary motion, shape (nv,) [N m]."""
        self._start()
        data, sizes = self.data, []
        wave = np.linspace(0.0, 4.0 * math.pi, 1500)
        centre, reach = np.array(self._subject.centre), np.array(self._subject.reach)
        for phase in wave:
            data.ctrl[:] = centre + reach * np.sin(phase + np.arange(self.model.nu))
            mujoco.mj_step(self.model, data, 8)
            sizes.append(np.abs(data.qfrc_actuator + data.qfrc_passive))
        return np.maximum(np.median(sizes, axis=0), 0.05)

    def _start(self) -> None:
        mujoco.mj_resetData(self.model, self.data)
        for name, value in self._begin.items():
            self.data.joint(name).qpos[0] = value

    def played(self, time_s: Array, controls: Array) -> Array:
        """Return what is read at times, without noise, shape (r, o)."""
        self._start()
        model, data = self.model, self.data
        step_s = _STEP_S
        waiting = deque[Array]()
        late = round(self._size / step_s) if self._is("delay") else 0
        fine_s = step_s * np.arange(round(time_s[-1] / step_s) + 1)
        asked = np.stack([np.interp(fine_s, time_s, controls[:, k]) for k in range(model.nu)], axis=1)
        row, found = 0, np.empty((len(time_s), len(self._subject.columns)))
        first = -round(_SETTLE_S / step_s)
        for step in range(first, round(time_s[-1] / step_s) + 1):
            if step >= 0 and row < len(time_s) and step * step_s >= time_s[row] - 1e-9:
                found[row] = self._read()
                row += 1
            waiting.append(self._commanded(asked[max(step, 0)]))
            data.ctrl[:] = waiting.popleft() if len(waiting) > late else waiting[0]
            self._rub()
            mujoco.mj_step(model, data)
        return found

    def _commanded(self, asked: Array) -> Array:
        found = asked.copy()
        if self._hidden is not None:
            which = int(self._hidden.about)
            if self._is("actuation_gain"):
                found[which] *= 1.0 + self._size
            if self._is("actuation_offset"):
                found[which] += self._size * self._subject.reach[which]
        return found

    def _rub(self) -> None:
        """Rub at every measured joint: a moment that grows within a hundredth of a rad/s, with a hump.

        Behind a play the link is damped against the base.
        """
        if self._is("backlash"):
            dofs = [self.model.joint(name).dofadr[0] for name in (self._subject.play_joint, "play")]
            self.data.qfrc_applied[dofs] = -self._link_damping * float(self.data.qvel[dofs].sum())
        if not self._is("friction_loss"):
            return
        for name in self._subject.joints:
            dof = self.model.joint(name).dofadr[0]
            speed = float(self.data.qvel[dof])
            hump = 1.0 + 0.2 * math.exp(-((speed / 0.05) ** 2))
            self.data.qfrc_applied[dof] = -self._size * self._typical[dof] * hump * math.tanh(speed / 0.01)

    def _read(self) -> Array:
        mujoco.mj_kinematics(self.model, self.data)
        angles = []
        for name in self._subject.joints:
            angle = float(self.data.joint(name).qpos[0])
            if self._is("backlash") and name == self._subject.play_joint:
                angle += float(self.data.joint("play").qpos[0])
            angles.append(math.degrees(angle))
        place = 1e3 * self.data.site(self._subject.site).xpos
        if self._is("measurement_frame"):
            axis = np.array([0.4, -0.5, 0.77])
            place = Rotation.from_rotvec(self._size * axis / np.linalg.norm(axis)).apply(place)
            place = place + 300.0 * abs(self._size) * np.array([0.5, -0.7, 0.3])
        return np.array([*angles, *place])


def _start_of(model: mujoco.MjModel) -> dict[str, float]:
    """Return where joints begin: the first keyframe of a file that has one."""
    if not model.nkey:
        return {}
    return {model.joint(k).name: float(model.key_qpos[0, model.jnt_qposadr[k]]) for k in range(model.njnt)}


def _more_damping(spec: mujoco.MjSpec, subject: Subject, hidden: Hidden) -> None:
    for name in subject.joints:
        joint = spec.joint(name)
        joint.damping = (1.0 + hidden.size) * np.asarray(joint.damping)


def _softer_servos(spec: mujoco.MjSpec, subject: Subject, hidden: Hidden) -> None:
    for actuator in spec.actuators:
        gain, bias = np.array(actuator.gainprm), np.array(actuator.biasprm)
        gain[0] *= 1.0 - hidden.size
        bias[1] *= 1.0 - hidden.size
        actuator.gainprm, actuator.biasprm = gain, bias


def _payload(spec: mujoco.MjSpec, subject: Subject, hidden: Hidden) -> None:
    model = spec.copy().compile()
    mass = hidden.size * float(model.body_mass.sum() - model.body_mass[model.body_weldid == 0].sum())
    place = np.array(model.site(subject.site).pos) + np.array([0.01, 0.02, 0.015])
    ball = spec.body(subject.body).add_body(name="ball", pos=place)
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.03, 0, 0], mass=mass, contype=0, conaffinity=0)


def _play(spec: mujoco.MjSpec, subject: Subject, hidden: Hidden) -> None:
    """Split the driven body: the motor turns a light rotor, on which the body hangs with play."""
    joint = spec.joint(subject.play_joint)
    body = joint.parent
    half = 0.5 * hidden.size
    joint.damping = (1.0 - _LINK_SHARE) * np.asarray(joint.damping)
    body.add_joint(
        name="play",
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=list(joint.axis),
        limited=1,
        range=[-half, half],
        damping=[0.5, 0, 0] if np.ndim(joint.damping) else 0.5,
        armature=1e-4,
        solref_limit=[0.004, 1.0],
    )
    for key in list(spec.keys):
        spec.delete(key)


_BUILT: Mapping[str, Callable[[mujoco.MjSpec, Subject, Hidden], None]] = {
    "damping": _more_damping,
    "stiffness": _softer_servos,
    "payload": _payload,
    "backlash": _play,
}


# ----------------------------------------------------------------------------------------------------
# A draw: a data set of a foreign model with one hidden cause, and whether a diagnosis names it.

_KEY = 97
NOTHING_EVERY = 6  # each so-many-th draw hides nothing
SETTLE_S = 1.0


def drawn(models: Path, seed: int, index: int, work: Path) -> dict[str, Any]:
    """Return the result of one draw; the arguments decide everything but the seconds.

    Args:
        models: folder with a folder for each subject.
        seed, index: of the draw.
        work: folder in which the data set is written.
    """
    subject, hidden, generator = hidden_of(seed, index)
    folder = write_dataset(models, subject, hidden, generator, work / f"draw_{index:03d}")
    begun = time.monotonic()
    found = diagnose_foreign(folder)
    return {
        "seed": seed,
        "index": index,
        "model": subject.name,
        "hidden": None if hidden is None else {"cause": hidden.cause, "size": round(hidden.size, 4)},
        **said(found),
        "seconds": round(time.monotonic() - begun, 1),
    }


def hidden_of(seed: int, index: int) -> tuple[Subject, Hidden | None, np.random.Generator]:
    """Return the subject of a draw, what it hides and the generator of the rest."""
    generator = np.random.default_rng((_KEY, seed, index))
    names = list(SUBJECTS)
    subject = SUBJECTS[names[index % len(names)]]
    nothing = index % NOTHING_EVERY == NOTHING_EVERY - 1
    return subject, None if nothing else hide(subject, generator), generator


def said(found: ForeignDiagnosis) -> dict[str, Any]:
    """Return what a diagnosis says, as a document."""
    gain, low, high = found.gain_percent()
    return {
        "verdict": found.verdict,
        "named": list(found.causes),
        "best": {number.name: round(value, 5) for number, value in found.best.fit.values.items()},
        "indistinguishable": [list(group) for group in found.indistinguishable],
        "times_noise": [round(found.before.times_noise, 2), round(found.best.times_noise, 2)],
        "gain_percent": [round(value, 1) for value in (gain, low, high)],
        "weights": {name: round(value, 3) for name, value in found.weights.items() if value > 1e-3},
    }


def write_dataset(
    models: Path, subject: Subject, hidden: Hidden | None, generator: np.random.Generator, folder: Path
) -> Path:
    """Write a data set of three trials, the last held out; return its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    file = f"{subject.name}.xml"
    shutil.copyfile(models / subject.name / file, folder / file)
    inputs = ForeignModel(folder / file).input_columns
    trials = recordings(models / subject.name, subject, hidden, generator)
    entries = []
    for number, (time_s, controls, readings) in enumerate(trials, start=1):
        columns = {name: controls[:, k] for k, name in enumerate(inputs)}
        columns |= {name: np.round(readings[:, k], 4) for k, name in enumerate(subject.columns)}
        write_table(Table(time_s, columns), folder / f"trial_{number}.csv")
        role = "heldout" if number == len(trials) else "train"
        entries.append({"file": f"trial_{number}.csv", "role": role})
    document = {
        "dataset": {"name": subject.name, "robot": file, "source": "simulated", "licence": "CC0-1.0"},
        "conditions": {"gravity_mps2": [0.0, 0.0, -9.81], "motion": "dynamic", "settle_s": SETTLE_S},
        "channels": {"inputs": list(inputs), "outputs": subject.columns},
        "trials": entries,
    }
    (folder / "dataset.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    return folder


# ----------------------------------------------------------------------------------------------------
# Draws of the bench of foreign models, each in a file of its own: a run goes on where another stopped.


def drawn_once(root: Path, models: Path, seed: int, index: int) -> dict[str, Any]:
    """Return the result of a draw; one that lies in `root` is not made again."""
    path = root / "draws" / f"draw_{index:03d}.json"
    known = read_json(path)
    if known is not None:
        return dict(known)
    result = drawn(models, seed, index, root / "data") | {"commit": commit(), "code": whole_code()}
    write_json(result, path)
    return result


# ----------------------------------------------------------------------------------------------------
# The table of the bench of foreign models: how many hidden causes are named, how many falsely.

NAMED_SHARE = 0.8
Draw = Mapping[str, Any]


def outcome(draw: Draw) -> str:
    """Return "named", "in part" (with another cause), "false", "missed", or for nothing hidden "quiet"."""
    named, hidden = set(draw["named"]), draw["hidden"]
    if hidden is None:
        return "false" if named else "quiet"
    same = {hidden["cause"]}
    for group in draw["indistinguishable"]:
        same |= set(group) if hidden["cause"] in group else set()
    if not named:
        return "missed"
    if named <= same:
        return "named"
    return "in part" if named & same else "false"


def summary(draws: Sequence[Draw]) -> dict[str, int]:
    """Return counts of outcomes among draws with something hidden and with nothing."""
    found = {"hidden": sum(draw["hidden"] is not None for draw in draws)}
    found["nothing"] = len(draws) - found["hidden"]
    for words in ("named", "in part", "missed"):
        found[words] = sum(outcome(draw) == words for draw in draws)
    found["false"] = sum(outcome(draw) == "false" and draw["hidden"] is not None for draw in draws)
    found["false_of_nothing"] = sum(outcome(draw) == "false" and draw["hidden"] is None for draw in draws)
    return found


def met(found: Mapping[str, int]) -> bool:
    """Return whether eight of ten hidden causes are named, and nothing where nothing is hidden."""
    enough = found["named"] >= NAMED_SHARE * found["hidden"]
    return found["hidden"] > 0 and enough and not found["false_of_nothing"]


def as_text(found: Mapping[str, int], draws: Sequence[Draw]) -> str:
    """Return the table for a reader, with every draw that was not as it should be."""
    words = "met" if met(found) else "MISSED"
    lines = [
        f"{found['hidden']} hidden causes: {found['named']} named, {found['in part']} with another one, "
        f"{found['false']} falsely, {found['missed']} not at all",
        f"{found['nothing']} with nothing hidden: {found['false_of_nothing']} named something",
        f"{words}: at least {100 * NAMED_SHARE:.0f} % named, and nothing where nothing is hidden",
    ]
    for draw in draws:
        if outcome(draw) not in ("named", "quiet"):
            hidden = draw["hidden"]["cause"] if draw["hidden"] else "nothing"
            before, after = draw["times_noise"]
            lines.append(
                f"draw {draw['index']}, {draw['model']}, hidden {hidden}: {draw['verdict']} "
                f"{' + '.join(draw['named'])}, {before} -> {after} times the noise"
            )
    return "\n".join(lines)
