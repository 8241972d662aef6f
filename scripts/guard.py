"""Freeze the package's numbers, change the code, and check that the numbers are the same.

    python scripts/guard.py freeze                  writes tests/data/guard
    python scripts/guard.py check                   compares; exit status 1 where an output differs
    python scripts/guard.py check simulate twin     only these parts

Parts: simulate, statics, twin, model, envs and render take two minutes in all; diagnose takes minutes, speed
too. `check` runs the first six by default, `freeze` all. A position may differ by 1e-12 of the robot's
length, any other number by 1e-12, absolute or relative, a number in diagnosis.json by 1e-6 of it. A speed is
a ratio of two times of one run; one that grew by more than 5 % in each of three runs fails.

The frozen numbers are those of one machine: another processor, or another release of MuJoCo, Numba or
NumPy, may round otherwise, which `check` names when it starts.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # sums of threads have no fixed order

import argparse
import contextlib
import hashlib
import io
import json
import platform
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from importlib.metadata import version
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Columns = Mapping[str, Sequence[float]]  # input columns, `time_s` among them, in their units

# ------------------------------------------------------------------------------------------ ADAPTER: begin
# The only lines that know the package. Whoever moves or renames a part of it mends these, and no other.
import gymnasium
import mujoco

import catheter_sim  # noqa: F401 - registers the environments
from catheter_sim.catalogue import load_robot
from catheter_sim.channels import output_channels, output_table, read_inputs
from catheter_sim.cli.list_verb import robot_listing
from catheter_sim.cli.main import main as command_line
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.pictures.offscreen import render as _render
from catheter_sim.simulation.replay import simulate as _simulate
from catheter_sim.tables import Table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import twin_for

_load = lru_cache(maxsize=None)(load_robot)


def _inputs(robot: Any, columns: Columns) -> Any:
    values = {name: np.array(column, dtype=float) for name, column in columns.items()}
    return read_inputs(robot, Table(values.pop("time_s"), values))


def _outputs(robot: Any, inputs: Any, postures: Any) -> tuple[tuple[str, ...], Array]:
    table = output_table(robot, inputs.time_s, postures)
    return tuple(table.columns), np.stack(list(table.columns.values()), axis=1)


def listing(reference: str) -> dict[str, Any]:
    """Return what `list ROBOT --json` shows."""
    return robot_listing(reference)


def simulate(
    reference: str, settings: Sequence[str], columns: Columns, gravity: Array, dynamic: bool
) -> tuple[tuple[str, ...], Array, str]:
    """Return the names of all output columns, their values (rows, columns), and why the run failed, or ""."""
    robot = _load(reference, tuple(settings))
    inputs = _inputs(robot, columns)
    run = _simulate(robot, inputs, gravity, dynamic=dynamic)
    return (*_outputs(robot, inputs, run.postures), run.failure or "")


def statics(reference: str, model: str, columns: Columns, gravity: Array) -> tuple[tuple[str, ...], Array]:
    """Return the names of all output columns, and their values (rows, columns) by a static model."""
    robot = _load(reference, ())
    inputs = _inputs(robot, columns)
    return _outputs(robot, inputs, STATIC_MODELS[model].solve(robot, inputs, gravity).postures)


def twin(
    reference: str, many_settings: Sequence[Sequence[str]], columns: Columns, gravity: Array
) -> tuple[tuple[str, ...], Callable[[], Array]]:
    """Return the names of all output columns, and what gives the twin's outputs (robots, rows, columns)."""
    robots = [_load(reference, tuple(settings)) for settings in many_settings]
    inputs = _inputs(robots[0], columns)
    robots = [replace(robot, actuation=inputs.actuation) for robot in robots]
    names = tuple(output_channels(robots[0]))
    return names, partial(twin_for(robots[0], inputs.actuation, names, gravity), robots, inputs, 1)


def compiled_model(reference: str, actuation: str) -> bytes:
    """Return the robot's model as MuJoCo compiles it, every number and name of it."""
    model = mujoco.MjModel.from_xml_string(build_mjcf(_load(reference, ()), actuation))
    found = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, found)
    return found.tobytes()


def picture(reference: str, columns: Columns, gravity: Array, path: str) -> None:
    """Write a small picture of the robot after the last row."""
    robot = _load(reference, ())
    _render(robot, _inputs(robot, columns), tuple(gravity), path, 160, 120)


def environment(name: str) -> Any:
    """Return the Gymnasium environment `name`."""
    return gymnasium.make(name)


def vector(name: str, count: int) -> Any:
    """Return so many copies of the environment `name`, stepped together."""
    return gymnasium.make_vec(name, count, vectorization_mode="vector_entry_point")


def environments() -> list[str]:
    """Return the ids of the registered environments."""
    return sorted(name for name in gymnasium.registry if name.startswith("catheter_sim/"))


def diagnose(dataset: Path) -> dict[str, Any]:
    """Return the diagnosis.json of the data set in a folder, without its time and command."""
    with tempfile.TemporaryDirectory() as folder:
        status, text = run_verb("diagnose", str(dataset), "-o", folder)
        if status:
            return {"failed": text}
        found = json.loads((Path(folder) / "diagnosis.json").read_text(encoding="utf-8"))
        return {name: value for name, value in found.items() if name not in ("made", "command")}


def bench(turns: int) -> list[dict[str, Any]]:
    """Return what `bench --json` shows."""
    return json.loads(run_verb("bench", "--json", "--turns", str(turns))[1])


def run_verb(*words: str) -> tuple[int, str]:
    """Run the command line in this process; return its exit status, and what it printed or the error's line.

    Raises:
        SystemExit: it was stopped by a signal, or by a defect.
    """
    out, told = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(told):
        status = int(command_line(list(words)) or 0)
    last = (told.getvalue().strip().splitlines() or [""])[-1]
    if status not in (0, 2):
        raise SystemExit(f"{' '.join(words)}: exit status {status}: {last}")
    return status, last if status else out.getvalue()


# -------------------------------------------------------------------------------------------- ADAPTER: end

FOLDER = Path(__file__).resolve().parent.parent / "tests" / "data" / "guard"
TOLERANCE = 1e-12
TOLERANCE_OF_DIAGNOSIS = 1e-6
SLOWER = 0.05  # a ratio of times that grew more fails
SPEED_RUNS = 3  # the least of so many runs is compared where the first is slower: machines are shared
WEIGHT = np.array([1.5, 0.0, -9.81])
NO_WEIGHT = np.zeros(3)


@dataclass(frozen=True)
class Drive:
    """How a robot is driven here.

    Attributes:
        kind: robots of one kind share their code.
        length_mm: of the robot, which positions are held against.
        reach: largest value of each input column, in its unit.
        force_N: on the tip, in the base frame.
        actuation: "tension" or "displacement".
        displacement: largest value of each column of displacements, where tensions drive the robot otherwise.
        small: settings that make the robot cheap where each effect is tried.
    """

    kind: str
    length_mm: float
    reach: Mapping[str, float]
    force_N: tuple[float, float, float]
    actuation: str
    displacement: Mapping[str, float] | None = None
    small: tuple[str, ...] = ()


def _pull(kind: str, length_mm: float, force_N: tuple[float, float, float], **reach: float) -> Drive:
    return Drive(
        kind, length_mm, {f"tension_{key}_N": value for key, value in reach.items()}, force_N, "tension"
    )


_SECTION = replace(
    _pull("planar", 60.0, (0.004, 0.0, -0.006), right=0.3, left=0.25),
    displacement={"displacement_right_mm": 1.0, "displacement_left_mm": -1.0},
)
_NEUROENDOSCOPE = _pull(
    "planar",
    120.0,
    (0.002, 0.0, -0.003),
    distal_right=0.2,
    distal_left=0.18,
    proximal_right=0.3,
    proximal_left=0.25,
)
_NUMBERED = {"1": 6.0, "2": 5.0, "3": 4.0, "4": 5.0}
_SPACER_DISK = replace(
    _pull("continuum", 100.0, (0.3, 0.2, -0.3), **_NUMBERED),
    displacement={f"displacement_{k}_mm": value for k, value in enumerate((2.0, -2.0, 3.0, -3.0), 1)},
    small=("disks_per_segment=4", "links_per_subsegment=1"),
)
_CHEST_TUBE = _pull(
    "rolling",
    375.0,
    (0.02, 0.015, -0.02),
    base_right=4.0,
    base_left=3.0,
    middle_right=4.0,
    middle_left=4.0,
    tip_right=2.0,
    tip_left=1.5,
    tip_front=2.0,
    tip_back=2.5,
)
_CHEST_SECTION = _pull("rolling", 225.0, (0.05, 0.0, -0.05), active=5.0)
_TRANSSEPTAL = Drive(
    "catheter",
    117.34,
    {
        "displacement_bending_mm": 1.5,
        "displacement_torsion_proximal_mm": 1.8,
        "displacement_torsion_distal_mm": 1.6,
        "advance_mm": 25.0,
    },
    (0.02, 0.01, -0.02),
    "displacement",
)
_4DOF = Drive(
    "catheter",
    108.18,
    {
        "displacement_bending_proximal_mm": 1.6,
        "displacement_bending_distal_mm": 1.5,
        "displacement_torsion_mm": 1.3,
        "advance_mm": 25.0,
    },
    (0.02, 0.01, -0.02),
    "displacement",
)
ROBOTS: Mapping[str, Drive] = {
    "neuroendoscope": _NEUROENDOSCOPE,
    "neuroendoscope_section": _SECTION,
    "spacer_disk": _SPACER_DISK,
    "chest_tube": _CHEST_TUBE,
    "chest_tube_section": _CHEST_SECTION,
    "chest_tube_section@prototype": _CHEST_SECTION,
    "mitral_transseptal": _TRANSSEPTAL,
    "mitral_transseptal@tube": _TRANSSEPTAL,
    "mitral_4dof": _4DOF,
    "mitral_4dof@elongation": _4DOF,
}
ONE_OF_EACH_KIND = ("neuroendoscope_section", "spacer_disk", "chest_tube_section", "mitral_4dof")
VECTORS = ("NeuroendoscopeSectionReach", "ChestTubeSectionTrack", "Mitral4dofReach", "NeuroendoscopeTumour")

# Rows of an input programme: to and fro, then the other side; shares of the reach of channels 1, 3, ..., of
# channels 2, 4, ..., of an advance; whether the force acts.
_TIME_S: tuple[float, ...] = (0.0, 1.0, 2.5, 3.5, 5.0, 6.0)
_ODD: tuple[float, ...] = (0.6, 1.0, 0.4, 0.0, 0.0, 0.2)
_EVEN: tuple[float, ...] = (0.0, 0.1, 0.0, 0.8, 0.3, 0.0)
_ADVANCE: tuple[float, ...] = (0.2, 0.6, 0.9, 0.7, 0.7, 0.3)
_LOADED: tuple[float, ...] = (0.0, 0.0, 1.0, 1.0, 0.5, 0.0)
_OTHER_WAY: tuple[float, ...] = (1.0, 1.0, 1.0, -0.6, -0.3, 1.0)  # factor of a displacement


def programme(
    drive: Drive, loaded: bool, rows: slice = slice(None), displaced: bool = False, one_way: bool = False
) -> dict[str, list[float]]:
    """Return the input columns that drive a robot.

    Args:
        drive: of the robot.
        loaded: with a force on the tip in some rows.
        rows: of the programme.
        displaced: by displacement, of a robot that tensions drive otherwise.
        one_way: no displacement below zero.
    """
    reach = drive.displacement if displaced and drive.displacement else drive.reach
    columns: dict[str, list[float]] = {"time_s": [item - _TIME_S[rows][0] for item in _TIME_S[rows]]}
    for index, (name, largest) in enumerate(reach.items()):
        if name == "advance_mm":
            shares = list(_ADVANCE)
        elif name.startswith("displacement"):
            first = _ODD if index % 2 == 0 else tuple(a + b for a, b in zip(_EVEN, _ODD[::-1], strict=True))
            sign = (1.0,) * len(first) if one_way else _OTHER_WAY
            shares = [0.8 * a * b + 0.1 * b for a, b in zip(first, sign, strict=True)]
            if displaced:  # antagonists give what the others take
                shares = [a * b for a, b in zip(_ODD, _OTHER_WAY, strict=True)]
        else:
            shares = list(_ODD if index % 2 == 0 else _EVEN)
        columns[name] = [largest * share for share in shares[rows]]
    if loaded:
        for axis, force_N in zip("xyz", drive.force_N, strict=True):
            if force_N:
                columns[f"force_tip_{axis}_N"] = [force_N * share for share in _LOADED[rows]]
    return columns


# Of the way from no effect to the upper bound, where a third of it would be far too much.
_THIRD = 1.0 / 3.0
_SHARES = {
    "actuation_offset": 0.003,
    "drift.zero": 0.02,
    "rate": 0.05,
    "backlash": 0.02,
    "axial_compression": 0.1,
    "tendon_elongation.stiffness": 0.03,
    "tendon_elongation.cyclic": 0.002,
    "precurvature.bending": 0.1,
    "stiffness": 0.05,
    "tendon_friction": 0.1,
}
_BESIDE = {"drift.creep_time_s": "effects.drift.creep=0.3"}  # without which a parameter does nothing


def effect_settings(reference: str) -> Iterator[tuple[str, list[tuple[str, ...]]]]:
    """Yield each parameter of each effect of a robot, by its dotted key, with two settings of it."""
    for effect in listing(reference)["effects"]:
        for item in effect["parameters"]:
            key = f"{effect['name']}.{item['name']}"
            share = next((value for start, value in _SHARES.items() if key.startswith(start)), _THIRD)
            null, lower, upper = (float(item[name]) for name in ("no_effect", "lower", "upper"))
            if np.isinf(null):  # a stiffness: by the compliance
                values = [lower / share, 2.0 * lower / share]
            else:
                values = [null + share * (upper - null), null + 0.5 * share * (upper - null)]
            beside = [_BESIDE[key]] if key in _BESIDE else []
            yield f"effects.{key}", [(f"effects.{key}={value!r}", *beside) for value in values]


@dataclass(frozen=True)
class Case:
    """What one run gave.

    Attributes:
        name: of the run.
        columns: names of the values' columns.
        values: shape (rows, columns).
        text: a hash, or what an error says.
        length_mm: of the robot; positions are held against it.
    """

    name: str
    columns: tuple[str, ...] = ()
    values: Array = field(default_factory=lambda: np.zeros((0, 0)))
    text: str = ""
    length_mm: float = 1.0


def fewer(names: Sequence[str]) -> list[int]:
    """Return where the columns stand that are kept of a short run: not every element's, nor every joint's."""
    kept = [i for i, name in enumerate(names) if not name.startswith(("body_", "joint_"))]
    bodies = [i for i, name in enumerate(names) if name.startswith("body_")]
    joints = [i for i, name in enumerate(names) if name.startswith("joint_")]
    middle = len(bodies) // 6 * 3
    return sorted({*kept, *bodies[middle : middle + 3], *joints[:2], *joints[len(joints) // 2 :][:2]})


def case(name: str, length_mm: float, run: Callable[[], tuple[Any, ...]], short: bool = False) -> Case:
    """Return what `run` gives (column names, values and maybe a text), or what its `InputError` says."""
    try:
        columns, values, *rest = run()
    except InputError as error:
        return Case(name, text=f"InputError: {error}", length_mm=length_mm)
    values = np.asarray(values).reshape(-1, len(columns))
    if short:
        kept = fewer(columns)
        columns, values = [columns[i] for i in kept], values[:, kept]
    return Case(name, tuple(columns), values, rest[0] if rest else "", length_mm)


def simulate_cases() -> Iterator[Case]:
    """Yield runs of the simulation."""
    for reference, drive in ROBOTS.items():
        run = partial(simulate, reference, (), gravity=WEIGHT)
        held = partial(run, programme(drive, loaded=True), dynamic=False)
        yield case(f"simulate/{reference}/held", drive.length_mm, held)
        if reference in ONE_OF_EACH_KIND:
            quick = programme(drive, loaded=True, rows=slice(0, 4))
            quick["time_s"] = [0.2 * item for item in quick["time_s"]]
            dynamic = partial(run, quick, dynamic=True)
            yield case(f"simulate/{reference}/dynamic", drive.length_mm, dynamic)
    for reference in ONE_OF_EACH_KIND:
        drive = ROBOTS[reference]
        if drive.displacement:
            run = partial(simulate, reference, drive.small, gravity=WEIGHT, dynamic=False)
            displaced = partial(run, programme(drive, True, slice(0, 4), displaced=True))
            yield case(f"simulate/{reference}/displaced", drive.length_mm, displaced)
        for key, (settings, _) in effect_settings(reference):
            inputs = programme(drive, True, slice(1, 5))
            run = partial(
                simulate, reference, (*drive.small, *settings), inputs, gravity=WEIGHT, dynamic=False
            )
            yield case(f"simulate/{reference}/{key}", drive.length_mm, run, short=True)


def statics_cases() -> Iterator[Case]:
    """Yield runs of the static models: bare, with weight and force, displaced, displaced one way only."""
    for reference, drive in ROBOTS.items():
        programmes = {
            "bare": (programme(drive, loaded=False), NO_WEIGHT),
            "loaded": (programme(drive, loaded=True), WEIGHT),
        }
        if drive.displacement:
            programmes["displaced"] = programme(drive, False, slice(0, 4), displaced=True), NO_WEIGHT
        if drive.actuation == "displacement":
            programmes["one_way"] = programme(drive, False, one_way=True), NO_WEIGHT
            programmes["weight"] = programme(drive, loaded=False), WEIGHT  # force is refused by most
        for model in listing(reference)["static_models"]:
            for name, (columns, gravity) in programmes.items():
                run = partial(statics, reference, model["name"], columns, gravity)
                yield case(f"statics/{reference}/{model['name']}/{name}", drive.length_mm, run, short=True)


def twin_cases() -> Iterator[Case]:
    """Yield runs of the analytic twins, two robots at a time."""

    def run(reference: str, many: Sequence[Sequence[str]], columns: Columns, gravity: Array) -> Any:
        names, evaluate = twin(reference, many, columns, gravity)
        return names, evaluate()

    for reference, drive in ROBOTS.items():
        mm = drive.length_mm
        force = drive.kind != "catheter"  # whose twin refuses one
        loaded = programme(drive, force)
        yield case(f"twin/{reference}/as_specified", mm, partial(run, reference, [()], loaded, WEIGHT))
        if drive.displacement:
            displaced = programme(drive, False, displaced=True)
            bare = partial(run, reference, [()], displaced, NO_WEIGHT)
            yield case(f"twin/{reference}/displaced", mm, bare, short=True)
        for key, many in effect_settings(reference):
            columns = programme(drive, force, slice(1, 5))
            varied = partial(run, reference, many, columns, WEIGHT)
            yield case(f"twin/{reference}/{key}", mm, varied, short=True)


def model_cases() -> Iterator[Case]:
    """Yield hashes of the robots' compiled models."""
    for reference in ROBOTS:
        for actuation in listing(reference)["inputs"]:
            digest = hashlib.sha256(compiled_model(reference, actuation)).hexdigest()
            yield Case(f"model/{reference}/{actuation}", text=digest)


def _numbers(value: Any) -> list[float]:
    """Return every number of an observation, in the order of its keys."""
    if isinstance(value, Mapping):
        return [number for key in sorted(value) for number in _numbers(value[key])]
    return [float(item) for item in np.ravel(np.asarray(value, dtype=float))]


def envs_cases() -> Iterator[Case]:
    """Yield five random steps of each environment, and four of some copies together."""
    for name in environments():
        yield _episode(f"envs/{name.rpartition('/')[2]}", partial(environment, name), 5)
    for name in VECTORS:
        yield _episode(f"envs/four/{name}", partial(vector, f"catheter_sim/{name}-v0", 4), 4)


def _episode(name: str, make: Callable[[], Any], steps: int) -> Case:
    env = make()
    random = np.random.default_rng(3)
    space = env.action_space
    rows = [[*_numbers(env.reset(seed=3)[0])]]
    low, high = np.maximum(space.low, -1.0), np.minimum(space.high, 1.0)
    rows[0] += [0.0] * 3 * max(1, getattr(env, "num_envs", 1))
    for _ in range(steps):
        action = (low + (high - low) * random.random(space.shape)).astype(space.dtype)
        observation, reward, terminated, truncated, _ = env.step(action)
        rows.append(_numbers(observation) + _numbers(reward) + _numbers(terminated) + _numbers(truncated))
    env.close()
    copies = len(_numbers(reward))
    columns = [f"observation[{i}]" for i in range(len(rows[0]) - 3 * copies)]
    columns += [f"{what}[{i}]" for what in ("reward", "terminated", "truncated") for i in range(copies)]
    return Case(name, tuple(columns), np.array(rows))


def render_cases() -> Iterator[Case]:
    """Yield hashes of small pictures."""
    import imageio.v3 as imageio

    for reference in ONE_OF_EACH_KIND:
        if reference == "spacer_disk":  # takes five seconds, and draws like the others
            reference, columns = "neuroendoscope", programme(ROBOTS["neuroendoscope"], False, slice(0, 1))
        else:
            columns = programme(ROBOTS[reference], False, slice(0, 1))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "picture.png")
            picture(reference, columns, NO_WEIGHT, path)
            pixels = np.asarray(imageio.imread(path))
        size = np.array([[*pixels.shape, pixels.mean()]])
        digest = hashlib.sha256(np.ascontiguousarray(pixels)).hexdigest()
        yield Case(f"render/{reference}", ("height", "width", "channels", "mean"), size, digest)


# ------------------------------------------------------------------------------------------------ diagnoses


@dataclass(frozen=True)
class Planted:
    """A made data set: a robot with effects, simulated or by its twin, with noise."""

    robot: str
    settings: tuple[str, ...]
    outputs: tuple[str, ...]
    noise_mm: float
    rows: int = 24
    trials: int = 3
    simulated: bool = False


_XZ = ("tip_x_mm", "tip_z_mm")
_XYZ = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
PLANTED: Mapping[str, Planted] = {
    "section_none": Planted("neuroendoscope_section", (), _XZ, 0.05),
    "section_friction": Planted("neuroendoscope_section", ("effects.tendon_friction.mu=0.6",), _XZ, 0.05),
    "section_backlash": Planted(
        "neuroendoscope_section", ("effects.backlash.width_N=0.06",), _XZ, 0.05, simulated=True
    ),
    "section_gain_and_frame": Planted(
        "neuroendoscope_section",
        ("effects.actuation_gain.scale=1.2", "effects.measurement_frame.rotation_y_deg=4"),
        _XZ,
        0.05,
    ),
    "chest_precurvature": Planted(
        "chest_tube_section", ("effects.precurvature.curvature_x_per_m=0.6",), _XZ, 0.2
    ),
    "chest_compression": Planted(
        "chest_tube_section", ("effects.axial_compression.stiffness_N_per_mm=2",), _XZ, 0.2, simulated=True
    ),
    "mitral_coupling": Planted(
        "mitral_4dof", ("effects.coupling.bending_proximal_to_bending_distal=0.2",), _XYZ, 0.1
    ),
    "mitral_lag": Planted("mitral_4dof", ("effects.rate.lag_s=0.8",), _XYZ, 0.1),
    "transseptal_offset": Planted(
        "mitral_transseptal", ("effects.actuation_offset.offset_bending_mm=0.3",), _XYZ, 0.1
    ),
    "disk_twist": Planted("spacer_disk", ("effects.twist.rate_deg_per_m=250",), _XYZ, 0.2, rows=12, trials=2),
}


def plant(name: str, folder: Path) -> None:
    """Write the data set `name` to a folder."""
    item = PLANTED[name]
    drive = ROBOTS[item.robot]
    random = np.random.default_rng(list(name.encode()))
    folder.mkdir(parents=True, exist_ok=True)
    for trial in range(1, item.trials + 1):
        columns = _wandering(drive, item.rows, random)
        if item.simulated:
            names, values, failure = simulate(item.robot, item.settings, columns, NO_WEIGHT, False)
            if failure:
                raise InputError(f"{name}: {failure}")
        else:
            names, evaluate = twin(item.robot, [item.settings], columns, NO_WEIGHT)
            values = evaluate()[0]
        shown = values[:, [names.index(column) for column in item.outputs]]
        shown = shown + item.noise_mm * random.standard_normal(shown.shape)
        table = np.column_stack([*columns.values(), shown])
        lines = [",".join([*columns, *item.outputs]), *(",".join(f"{x:.6g}" for x in row) for row in table)]
        (folder / f"trial_{trial:02}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    head = [
        "[dataset]",
        f'name = "{name}"',
        f'robot = "{item.robot}"',
        'source = "made by scripts/guard.py"',
        'licence = "MIT"',
        "[conditions]",
        "gravity_mps2 = [0.0, 0.0, 0.0]",
        "[channels]",
        f"inputs = {json.dumps(list(drive.reach))}",
        f"outputs = {json.dumps(list(item.outputs))}",
    ]
    head += [f'[[trials]]\nfile = "trial_{trial:02}.csv"' for trial in range(1, item.trials + 1)]
    (folder / "dataset.toml").write_text("\n".join(head) + "\n", encoding="utf-8")


def _wandering(drive: Drive, rows: int, random: np.random.Generator) -> dict[str, list[float]]:
    """Return inputs of two cycles with random reach and phase, rounded as the file holds them."""
    time_s = np.arange(rows) * 0.5
    phase = 4.0 * np.pi * np.arange(rows) / rows
    columns = {"time_s": time_s.tolist()}
    shift = random.uniform(0.0, 0.5 * np.pi)
    for index, (name, largest) in enumerate(drive.reach.items()):
        wave = np.sin(phase * random.choice([0.75, 1.0, 1.25]) + shift * (index // 2))
        wave *= random.uniform(0.6, 1.0)
        if name.startswith("tension"):
            wave = np.maximum(wave if index % 2 == 0 else -wave, 0.0)
            wave = np.abs(np.sin(0.5 * phase)) if len(drive.reach) == 1 else wave
        if name == "advance_mm":
            wave = 0.5 - 0.5 * np.cos(0.5 * phase)
        columns[name] = [float(f"{largest * value:.6g}") for value in wave]
    return columns


def flat(value: Any, name: str = "") -> dict[str, Any]:
    """Return the leaves of a JSON value by their dotted names; of a list its length too."""
    if isinstance(value, Mapping):
        items = {f"{name}.{key}": item for key, item in value.items()}
    elif isinstance(value, list):
        items = {f"{name}[{index}]": item for index, item in enumerate(value)}
    else:
        return {name.removeprefix("."): value}
    leaves = {f"{name}.length".removeprefix("."): len(value)} if isinstance(value, list) else {}
    for key, item in items.items():
        leaves |= flat(item, key)
    return leaves


def freeze_diagnose() -> None:
    """Diagnose the planted data sets and write what came out; data sets that lie there stay as they are."""
    found = {}
    for name in PLANTED:
        folder = FOLDER / "datasets" / name
        if not (folder / "dataset.toml").exists():
            plant(name, folder)
        start = time.perf_counter()
        found[name] = flat(diagnose(folder))
        verdict = [value for key, value in found[name].items() if key.endswith((".name", "verdict"))][:4]
        print(f"  {name}: {time.perf_counter() - start:.1f} s, {verdict}", flush=True)
    write_json("diagnose", found)


def check_diagnose() -> int:
    """Diagnose the frozen data sets again; return how many outputs differ."""
    different = 0
    for name, frozen in read_json("diagnose").items():
        start = time.perf_counter()
        now = flat(diagnose(FOLDER / "datasets" / name))
        largest = 0.0
        lines = []
        for key, before in frozen.items():
            after = now.get(key, "missing")
            if _is_number(before) and _is_number(after):
                off = abs(after - before) / max(abs(before), 1e-9) if after != before else 0.0
                largest = max(largest, off)
                same = off <= TOLERANCE_OF_DIAGNOSIS
            else:
                same = type(before) is type(after) and before == after
            if not same:
                lines.append(f"    {key}: {before!r} before, {after!r} now")
        seconds = time.perf_counter() - start
        new = f", {len(now.keys() - frozen.keys())} new keys" if now.keys() - frozen.keys() else ""
        print(f"  diagnose/{name}: largest {largest:.1e} of a number{new}, {seconds:.1f} s", flush=True)
        print("".join(f"{line}\n" for line in lines), end="")
        different += len(lines)
    return different


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


# ---------------------------------------------------------------------------------------------------- speed

TURNS = 9
_RATIOS = ("friction_cost", "python_cost", "of_plain", "batch_cost_1", "batch_cost_2")


def speeds() -> dict[str, float]:
    """Return the simulation's ratios, and each twin's seconds over those of 100 plain steps of MuJoCo."""
    found: dict[str, float] = {}
    for item in bench(TURNS):
        ratios = {key: item[key] for key in _RATIOS if item.get(key) is not None}
        found |= {f"bench/{item['robot']}/{key}": float(value) for key, value in ratios.items()}
    model = mujoco.MjModel.from_xml_string(build_mjcf(_load("neuroendoscope_section", ()), "tension"))
    data = mujoco.MjData(model)
    for reference in (name for name in ROBOTS if "@" not in name):
        drive = ROBOTS[reference]
        _, evaluate = twin(reference, [()] * 4, programme(drive, loaded=False), NO_WEIGHT)
        found[f"twin/{reference}"] = _ratio(evaluate, partial(_plain_steps, model, data))
    return found


def _plain_steps(model: Any, data: Any) -> None:
    for _ in range(100):
        mujoco.mj_step(model, data)


def _ratio(run: Callable[[], Any], plain: Callable[[], None]) -> float:
    """Return the time of `run` over that of `plain`, median of turns; each turn lasts 20 ms at least."""

    def seconds(work: Callable[[], Any], times: int) -> float:
        start = time.process_time()
        for _ in range(times):
            work()
        return (time.process_time() - start) / times

    run()
    times = [max(1, int(0.02 / max(seconds(work, 3), 1e-6))) for work in (run, plain)]
    return median(seconds(run, times[0]) / seconds(plain, times[1]) for _ in range(TURNS))


def check_speed() -> int:
    """Print the frozen ratios and today's; return how many grew by more than `SLOWER`."""
    frozen, now = read_json("speed"), speeds()
    names = sorted(frozen.keys() & now.keys())

    def slower() -> list[str]:
        return [name for name in names if now[name] > (1.0 + SLOWER) * frozen[name]]

    for _ in range(SPEED_RUNS - 1):
        if slower():
            now = {name: min(now[name], again) for name, again in speeds().items() if name in now}
    for name in names:
        change = now[name] / frozen[name] - 1.0
        mark = "  SLOWER" if name in slower() else ""
        print(f"  {name:<48} {frozen[name]:>9.3f} {now[name]:>9.3f} {100.0 * change:>+7.1f} %{mark}")
    print(f"  speed: {len(slower())} of {len(names)} ratios grew by more than {SLOWER:.0%}")
    return len(slower())


# ------------------------------------------------------------------------------------- frozen, and compared

CASES: Mapping[str, Callable[[], Iterator[Case]]] = {
    "simulate": simulate_cases,
    "statics": statics_cases,
    "twin": twin_cases,
    "model": model_cases,
    "envs": envs_cases,
    "render": render_cases,
}
PARTS = (*CASES, "diagnose", "speed")


def write_json(part: str, content: Any) -> None:
    """Write a part's JSON."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    text = json.dumps(content, indent=1, ensure_ascii=False)
    (FOLDER / f"{part}.json").write_text(text + "\n", encoding="utf-8")


def read_json(part: str) -> Any:
    """Return a part's JSON."""
    return json.loads((FOLDER / f"{part}.json").read_text(encoding="utf-8"))


def machine() -> dict[str, str]:
    """Return what numbers depend on besides this package."""
    packages = ("mujoco", "numpy", "scipy", "numba")
    return {"processor": _processor(), "python": platform.python_version()} | {
        name: version(name) for name in packages
    }


def _processor() -> str:
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.machine()


def freeze(part: str) -> None:
    """Write what the cases of a part give: their values to an NPZ, the rest to a JSON beside it."""
    names: list[tuple[str, ...]] = []
    cases: dict[str, Any] = {}
    values: list[Array] = []
    for item in CASES[part]():
        if item.columns not in names:
            names.append(item.columns)
        cases[item.name] = {
            "columns": names.index(item.columns),
            "rows": len(item.values),
            "length_mm": item.length_mm,
            "text": item.text,
        }
        values.append(item.values.ravel())
        if np.isnan(item.values).any():
            print(f"  {item.name}: {np.isnan(item.values).mean():.0%} of the numbers are none")
    FOLDER.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(FOLDER / f"{part}.npz", values=np.concatenate(values))
    write_json(part, {"machine": machine(), "columns": [" ".join(item) for item in names], "cases": cases})
    print(f"  {part}: {len(cases)} cases, {sum(map(len, values))} numbers")


def frozen_cases(part: str) -> dict[str, Case]:
    """Return the frozen cases of a part, by name."""
    content = read_json(part)
    with np.load(FOLDER / f"{part}.npz") as file:
        values = file["values"]
    columns = [tuple(item.split()) for item in content["columns"]]
    for name, then in content["machine"].items():
        if then != (now := machine()[name]):
            print(f"  note: {name} was {then}, is {now}: numbers may round otherwise")
    cases, start = {}, 0
    for name, item in content["cases"].items():
        own = columns[item["columns"]]
        end = start + item["rows"] * len(own)
        shaped = values[start:end].reshape(item["rows"], len(own))
        cases[name] = Case(name, own, shaped, item["text"], item["length_mm"])
        start = end
    return cases


@dataclass
class Largest:
    """The largest differences of a part: of positions [mm and of the length], and of other numbers."""

    position_mm: float = 0.0
    position: float = 0.0
    other: float = 0.0


def check(part: str, in_full: bool) -> int:
    """Compare the cases of a part with the frozen ones; return how many outputs differ."""
    waiting = frozen_cases(part)
    count, largest, different, new = len(waiting), Largest(), 0, []
    for now in CASES[part]():
        if now.name not in waiting:
            new.append(now.name)
            continue
        lines = compared(waiting.pop(now.name), now, largest)
        different += len(lines)
        if not in_full and len(lines) > 6:
            lines[5:] = [f"... and {len(lines) - 5} more columns"]
        print("".join(f"  {now.name}: {line}\n" for line in lines), end="", flush=True)
    for name in waiting:
        print(f"  {name}: no such case any more")
    if new:
        print(f"  new, not compared: {', '.join(new)}")
    print(
        f"  {part}: {count} cases; largest difference of a position {largest.position_mm:.3g} mm "
        f"({largest.position:.3g} of the length), of other numbers {largest.other:.3g}; "
        f"{different + len(waiting)} outputs differ"
    )
    return different + len(waiting)


def compared(frozen: Case, now: Case, largest: Largest) -> list[str]:
    """Return a line for each output that differs by more than the tolerance."""
    lines = [f"{frozen.text!r} before, {now.text!r} now"] if frozen.text != now.text else []
    missing = [name for name in frozen.columns if name not in now.columns]
    if missing:
        return [*lines, f"columns missing: {', '.join(missing)}"]
    if len(frozen.values) != len(now.values):
        return [*lines, f"{len(frozen.values)} rows before, {len(now.values)} now"]
    for index, name in enumerate(frozen.columns):
        before, after = frozen.values[:, index], now.values[:, now.columns.index(name)]
        same = (before == after) | (np.isnan(before) & np.isnan(after))
        if same.all():
            continue
        off = np.where(same, 0.0, np.abs(np.where(same, 0.0, after) - np.where(same, 0.0, before)))
        off[np.isnan(off)] = np.inf
        row = int(np.argmax(off))
        if name.startswith(("tip_", "body_")) and name.endswith("_mm"):
            allowed = np.full(len(off), TOLERANCE * frozen.length_mm)
            largest.position_mm = max(largest.position_mm, off[row])
            largest.position = max(largest.position, off[row] / frozen.length_mm)
        else:
            allowed = TOLERANCE * np.maximum(1.0, np.abs(before))
            largest.other = max(largest.other, off[row])
        if not (off <= allowed).all():
            change = f"{float(before[row])!r} before, {float(after[row])!r} now ({off[row]:.3g})"
            lines.append(f"{name}, row {row + 1}: {change}")
    return lines


def main() -> int:
    """Freeze or check; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("verb", choices=("freeze", "check"))
    parser.add_argument("parts", metavar="PART", nargs="*", help=", ".join(PARTS))
    parser.add_argument("--full", action="store_true", help="name every column that differs")
    options = parser.parse_args()
    wrong = [part for part in options.parts if part not in PARTS]
    if wrong:
        parser.error(f"no part {wrong[0]!r}; choices: {', '.join(PARTS)}")
    parts = options.parts or (CASES if options.verb == "check" else PARTS)
    different = 0
    for part in parts:
        print(f"{options.verb} {part}", flush=True)
        start = time.perf_counter()
        if options.verb == "freeze":
            if part == "diagnose":
                freeze_diagnose()
            elif part == "speed":
                write_json("speed", speeds())
            else:
                freeze(part)
        elif part == "diagnose":
            different += check_diagnose()
        elif part == "speed":
            different += check_speed()
        else:
            different += check(part, options.full)
        print(f"  {time.perf_counter() - start:.1f} s", flush=True)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
