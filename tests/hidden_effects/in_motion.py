"""The bench of hidden effects in motion: data by a finer model that shares no code with what is judged."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import tomli_w

from catheter_sim.arrays import Array
from catheter_sim.catalogue import robot_toml
from catheter_sim.channels import input_channels, posture_columns
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import Dynamics, Friction, with_segments
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.simulation.friction import CapstanFriction
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.tables import Table, write_table
from hidden_effects.natural import judging_code
from hidden_effects.running import keep_settings, read_json, write_json

# ----------------------------------------------------------------------------------------------------
# A robot in motion with something hidden in it, by a finer model than the diagnosis has.
#
# More links, a smaller step and another integrator than the robot's own simulation in motion; damping, a
# load at the tip and what happens to commands and to measurements are written here once more, by other code
# than that of the effects. Nothing of `effects` or `diagnosis` is imported.

STEP_S = 2.5e-4
FINER = 2  # times as many links as the robot itself has
_OVERDAMPED_S = 0.5  # damping by which a robot comes to rest before a trial begins
_REST_S, _REST_STEP_S = 4.0, 1e-3


@dataclass(frozen=True)
class Specimen:
    """What moves: a robot, and what its specification does not know.

    Attributes:
        robot: with its true stiffness, friction and curvature.
        damping_time_s: of its material, eta / E.
        tip_mass_kg: hung on its tip.
        tip_force_N: on its tip, base frame, shape (3,).
        gain: of each channel, shape (t,).
        play_N: width of a dead-band before the tendons.
        lag_s, delay_s: of what arrives at the tendons.
        tracker_rad: turn of the tracker about +z.
        tracker_mm: its shift, shape (3,).
    """

    robot: ContinuumRobot
    damping_time_s: float
    tip_mass_kg: float = 0.0
    tip_force_N: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gain: tuple[float, ...] = ()
    play_N: float = 0.0
    lag_s: float = 0.0
    delay_s: float = 0.0
    tracker_rad: float = 0.0
    tracker_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)


class WildMotion(Exception):
    """The motion diverged: another draw is needed."""


def measured(specimen: Specimen, inputs: Inputs, gravity_mps2: Array, columns: tuple[str, ...]) -> Array:
    """Return what a tracker shows at the rows, without noise, shape (r, o) [mm].

    Args:
        specimen: what moves.
        inputs: as commanded; tensions, which change linearly from row to row.
        gravity_mps2: shape (3,).
        columns: positions, as `tip_x_mm`.

    Raises:
        WildMotion: it diverged.
    """
    postures = moved(specimen, inputs.time_s - inputs.time_s[0], arriving(specimen, inputs), gravity_mps2)
    values = posture_columns(specimen.robot, postures, columns)
    return _tracked(specimen, values, columns)


def arriving(specimen: Specimen, inputs: Inputs) -> Array:
    """Return the tensions that arrive at the tendons at each row, shape (r, t) [N]."""
    tension, time_s = inputs.tendon.copy(), inputs.time_s - inputs.time_s[0]
    if specimen.gain:
        tension = tension * np.array(specimen.gain)
    if specimen.play_N:
        tension = _with_play(tension, specimen.play_N)
    if specimen.lag_s:
        tension = _with_lag(time_s, tension, specimen.lag_s)
    if specimen.delay_s:
        asked = time_s - specimen.delay_s  # what was before the first row stood still
        tension = np.stack([np.interp(asked, time_s, column) for column in tension.T], axis=1)
    return np.maximum(tension, 0.0)


def moved(specimen: Specimen, time_s: Array, tension: Array, gravity_mps2: Array) -> tuple[Posture, ...]:
    """Return the postures at the rows, from rest under the first one."""
    robot = specimen.robot
    finer = replace(
        robot,
        links_per_subsegment=FINER * robot.links_per_subsegment,
        dynamics=replace(robot.dynamics, damping_time_s=0.0, motion_timestep_s=STEP_S),
    )
    simulator = Simulator(finer, "tension", gravity_mps2, inertia=False)
    simulator.let_go()
    model, data = simulator.model, simulator.data
    if specimen.tip_mass_kg:
        _hang(model, int(simulator.faces[-1]), specimen.tip_mass_kg)
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
    hinges = model.jnt_dofadr[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]
    stiffness = model.jnt_stiffness[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]
    model.dof_armature[:] = 0.0
    force = np.array(specimen.tip_force_N)

    model.opt.timestep = _REST_STEP_S
    model.dof_damping[hinges] = _OVERDAMPED_S * stiffness
    _tell_friction(simulator)
    rise = round(0.5 * _REST_S / _REST_STEP_S)
    for step in range(2 * rise):
        simulator.set_inputs(tension[0] * min(1.0, (step + 1) / rise), force)
        simulator.step()
    data.qvel[:] = 0.0

    model.opt.timestep = STEP_S
    model.dof_damping[hinges] = specimen.damping_time_s * stiffness
    _tell_friction(simulator)
    postures = [simulator.posture()]
    for row in range(1, len(time_s)):
        span_s = time_s[row] - time_s[row - 1]
        steps = round(span_s / STEP_S)
        for step in range(steps):
            share = (step + 0.5) / steps
            simulator.set_inputs(tension[row - 1] + (tension[row] - tension[row - 1]) * share, force)
            simulator.step()
        if not (np.isfinite(data.qvel).all() and np.abs(data.qpos).max() < np.pi):
            raise WildMotion(f"at {time_s[row]:g} s")
        postures.append(simulator.posture())
    return tuple(postures)


def _tell_friction(simulator: Simulator) -> None:
    """Let the law of friction know that step and damping have changed."""
    law = simulator.laws.friction
    if isinstance(law, CapstanFriction):
        law.know_joints()


def _hang(model: mujoco.MjModel, site: int, mass_kg: float) -> None:
    """Add a point mass to the body of a site: its mass, the place of its centre, its inertia about that."""
    body = int(model.site_bodyid[site])
    own_kg, centre = float(model.body_mass[body]), model.body_ipos[body].copy()
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[body])
    turn = axes.reshape(3, 3)
    inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
    total_kg = own_kg + mass_kg
    middle = (own_kg * centre + mass_kg * model.site_pos[site]) / total_kg
    for part_kg, place in ((own_kg, centre), (mass_kg, model.site_pos[site])):
        away = place - middle
        inertia = inertia + part_kg * (away @ away * np.eye(3) - np.outer(away, away))
    sizes, directions = np.linalg.eigh(inertia)
    if np.linalg.det(directions) < 0.0:
        directions[:, 0] *= -1.0
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, directions.ravel())
    model.body_mass[body], model.body_ipos[body] = total_kg, middle
    model.body_inertia[body], model.body_iquat[body] = sizes, quat
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _with_play(tension: Array, width: float) -> Array:
    """Return what follows within half a dead-band, which stands in its middle at the first row."""
    now, found = tension[0].copy(), np.empty_like(tension)
    for row, pulled in enumerate(tension):
        now = np.minimum(np.maximum(now, pulled - 0.5 * width), pulled + 0.5 * width)
        found[row] = now
    return found


def _with_lag(time_s: Array, tension: Array, lag_s: float) -> Array:
    """Return a first-order lag's answer, by steps of a hundredth of the lag, at rest at the first row."""
    now, found = tension[0].copy(), np.empty_like(tension)
    found[0] = now
    for row in range(1, len(time_s)):
        span_s = float(time_s[row] - time_s[row - 1])
        count = max(1, int(np.ceil(100.0 * span_s / lag_s)))
        for step in range(count):
            target = tension[row - 1] + (tension[row] - tension[row - 1]) * (step + 0.5) / count
            now = now + (target - now) * (1.0 - np.exp(-span_s / count / lag_s))
        found[row] = now
    return found


def _tracked(specimen: Specimen, values: dict[str, Array], columns: tuple[str, ...]) -> Array:
    """Return positions as a tracker shows them that is turned about +z and shifted."""
    cos, sin = np.cos(specimen.tracker_rad), np.sin(specimen.tracker_rad)
    shown = []
    for name in columns:
        place, axis = name.removesuffix("_mm").rsplit("_", 1)
        x, y = (values.get(f"{place}_{letter}_mm", np.zeros(1)) for letter in "xy")
        turned = {"x": cos * x - sin * y, "y": sin * x + cos * y}
        shown.append(turned.get(axis, values[name]) + specimen.tracker_mm["xyz".index(axis)])
    return np.stack(shown, axis=1)


# ----------------------------------------------------------------------------------------------------
# Draws what a data set in motion hides: a robot, a cause, its size, inputs and noise.
#
# The seed and the number of the draw decide everything. Nothing of `effects` or `diagnosis` is imported: a
# cause's name is all that is shared.

HANGING = np.array([0.0, 0.0, 9.81])
NOISE_MM = (0.1, 0.3)
SMALLEST, LARGEST = 5.0, 30.0  # times the noise, of what is hidden
ROW_S = 0.01
SLOWEST_HZ, FASTEST_HZ = 0.1, 2.0  # of what the inputs are made
_TONES, _RISE_S = 5, 0.4
_REACH_RAD = 0.5  # by which the largest tension alone bends a robot at rest without weight
GAP_SHARE = 0.3  # of the noise: what the finer model and the robot's own simulation may differ by
_TRIES = 12

Hide = Callable[[Specimen, float, np.random.Generator], Specimen]


@dataclass(frozen=True)
class Draw:
    """A data set in motion.

    Attributes:
        robot: as specified.
        cause: name of what is hidden; "": nothing.
        form: in which it acts, in words.
        specimen: what moved.
        size: root mean square change by what is hidden, over the noise.
        noise_mm: of every coordinate.
        columns: what is measured.
        trials: inputs.
        outputs: of each trial, with noise, shape (r, o) [mm].
    """

    robot: ContinuumRobot
    cause: str
    form: str
    specimen: Specimen
    size: float
    noise_mm: float
    columns: tuple[str, ...]
    trials: tuple[Inputs, ...]
    outputs: tuple[Array, ...]


def _scaled(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    robot = replace(specimen.robot, stiffness_scale=specimen.robot.stiffness_scale * math.exp(amount))
    return replace(specimen, robot=robot)


def _rubbing(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    mu = specimen.robot.friction.mu + abs(amount)
    return replace(specimen, robot=replace(specimen.robot, friction=Friction(mu)))


def _weighted(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    own_kg = sum(segment.mass_kg for segment in specimen.robot.segments)
    return replace(specimen, tip_mass_kg=abs(amount) * own_kg)


def _pushed(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    segment = specimen.robot.segments[0]
    turn = generator.uniform(0.0, 2.0 * math.pi)
    force = amount * segment.bending_stiffness_N_m2 / segment.length_m**2
    return replace(specimen, tip_force_N=(force * math.cos(turn), force * math.sin(turn), 0.0))


def _damped(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    return replace(specimen, damping_time_s=specimen.damping_time_s * math.exp(amount))


def _lagging(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    return replace(specimen, lag_s=abs(amount))


def _late(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    return replace(specimen, delay_s=abs(amount))


def _gained(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    gain = [1.0] * len(specimen.robot.tendons)
    gain[int(generator.integers(len(gain)))] += amount
    return replace(specimen, gain=tuple(gain))


def _bent(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    turn = generator.uniform(0.0, 2.0 * math.pi)
    length_m = sum(segment.length_m for segment in specimen.robot.segments)
    curved = {
        "rest_curvature_x_per_m": amount * math.cos(turn) / length_m,
        "rest_curvature_y_per_m": amount * math.sin(turn) / length_m,
    }
    return replace(specimen, robot=with_segments(specimen.robot, [curved] * len(specimen.robot.segments)))


def _seen_askew(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    shift = 30.0 * amount * generator.uniform(-1.0, 1.0, 3)
    return replace(
        specimen, tracker_rad=amount, tracker_mm=(float(shift[0]), float(shift[1]), float(shift[2]))
    )


def _playing(specimen: Specimen, amount: float, generator: np.random.Generator) -> Specimen:
    return replace(specimen, play_N=abs(amount))


# What may be hidden: the cause's name and the form in words, how, and a first amount of it. An offset of a
# tension is not among them: it bends a rod evenly along its length, as a curvature without load does, and no
# positions tell the two apart.
CAUSES: Mapping[tuple[str, str], tuple[Hide, float]] = {
    ("stiffness", "scale"): (_scaled, 0.1),
    ("tendon_friction", "capstan"): (_rubbing, 0.1),
    ("payload", "mass"): (_weighted, 0.1),
    ("payload", "force"): (_pushed, 0.2),
    ("rate", "viscous"): (_damped, 0.5),
    ("rate", "lag"): (_lagging, 0.02),
    ("rate", "delay"): (_late, 0.02),
    ("actuation_gain", "one channel"): (_gained, 0.1),
    ("precurvature", "whole robot"): (_bent, 0.05),
    ("measurement_frame", "turn and shift"): (_seen_askew, 0.05),
    ("backlash", "of the command"): (_playing, 0.05),
}


def drawn(seed: int, index: int, story: str, trials: int, seconds: float) -> Draw:
    """Return a draw with its data.

    Args:
        seed, index: decide everything.
        story: "single": one cause; "none": nothing.
        trials: how many.
        seconds: of each.

    Raises:
        WildMotion: nothing that was drawn could be made.
    """
    generator = np.random.default_rng((seed, index))
    robot = drawn_robot(generator)
    inputs = tuple(drawn_inputs(robot, generator, seconds) for _ in range(trials))
    middle = robot.segments[0].disks // 2
    columns = tuple(
        f"{place}_{axis}_mm"
        for place in ("tip", f"body_{middle}")
        for axis in ("xyz" if robot.segments[0].bending_axes == "xy" else "xz")
    )
    plain = Specimen(robot, robot.dynamics.damping_time_s)
    noise_mm = max(float(generator.uniform(*NOISE_MM)), _gap_mm(plain, inputs[0], columns) / GAP_SHARE)
    cause, form, specimen, size = "", "", plain, 0.0
    if story == "single":
        cause, form, specimen, size = _hidden(plain, inputs[0], columns, noise_mm, generator)
    clean = [measured(specimen, item, HANGING, columns) for item in inputs]
    outputs = tuple(values + noise_mm * generator.normal(size=values.shape) for values in clean)
    return Draw(robot, cause, form, specimen, size, noise_mm, columns, inputs, outputs)


def _gap_mm(plain: Specimen, inputs: Inputs, columns: tuple[str, ...]) -> float:
    """Return by how much the robot's own simulation differs from the finer model, the worst column's rms."""
    run = simulate(plain.robot, inputs, HANGING, dynamic=True)
    if run.failure:
        raise WildMotion(run.failure)
    own = posture_columns(plain.robot, run.postures, columns)
    apart = np.stack([own[name] for name in columns], axis=1) - measured(plain, inputs, HANGING, columns)
    return float(np.sqrt(np.mean(apart**2, axis=0)).max())


def drawn_robot(generator: np.random.Generator) -> ContinuumRobot:
    """Return a hanging robot with one segment that swings at some Hz; every number is drawn or assumed."""
    spatial = bool(generator.random() < 0.5)
    tendons = 3 if spatial else 2
    length_m = float(generator.uniform(0.18, 0.26))
    return ContinuumRobot(
        name="hanging_robot",
        description="a robot drawn for the bench of hidden effects in motion",
        segments=(
            Segment(
                name="arm",
                length_m=length_m,
                disks=8,
                outer_radius_m=0.012,
                bending_stiffness_N_m2=float(generator.uniform(0.006, 0.012)),
                mass_kg=float(generator.uniform(0.04, 0.08)),
                bending_axes="xy" if spatial else "x",
            ),
        ),
        tendons=tuple(Tendon(f"t{k + 1}", 0.01, 2.0 * math.pi * k / tendons, "arm") for k in range(tendons)),
        friction=Friction(float(generator.uniform(0.05, 0.15))),
        dynamics=Dynamics(damping_time_s=float(generator.uniform(0.008, 0.02))),
        links_per_subsegment=2,
        hinges="rod",
    )


def drawn_inputs(robot: ContinuumRobot, generator: np.random.Generator, seconds: float) -> Inputs:
    """Return a trial: each tendon's tension a sum of tones, from zero."""
    segment = robot.segments[0]
    reach_N = _REACH_RAD * segment.bending_stiffness_N_m2 / (robot.tendons[0].radius_m * segment.length_m)
    time_s = np.round(ROW_S * np.arange(round(seconds / ROW_S) + 1), 6)
    columns = []
    for _ in robot.tendons:
        tones_Hz = generator.uniform(SLOWEST_HZ, FASTEST_HZ, _TONES)
        phases, sizes = generator.uniform(0.0, 2.0 * math.pi, _TONES), generator.uniform(0.3, 1.0, _TONES)
        wave = np.sin(2.0 * math.pi * np.outer(time_s, tones_Hz) + phases) @ sizes
        wave = (wave - wave.min()) / np.ptp(wave)
        columns.append(reach_N * wave * np.minimum(time_s / _RISE_S, 1.0))
    nothing = np.zeros((len(time_s), 3))
    return Inputs(time_s, "tension", np.round(np.stack(columns, axis=1), 6), nothing, nothing)


def _hidden(
    plain: Specimen,
    inputs: Inputs,
    columns: tuple[str, ...],
    noise_mm: float,
    generator: np.random.Generator,
) -> tuple[str, str, Specimen, float]:
    """Return a cause of a size between `SMALLEST` and `LARGEST` times the noise, on the first trial."""
    names = list(CAUSES)
    without = measured(plain, inputs, HANGING, columns)
    for _ in range(_TRIES):
        cause, form = names[int(generator.integers(len(names)))]
        hide, amount = CAUSES[cause, form]
        target = float(generator.uniform(1.2 * SMALLEST, LARGEST / 1.2))
        amount *= float(generator.choice((-1.0, 1.0)))
        key = int(generator.integers(2**31))  # the same directions at every amount
        for _ in range(4):
            specimen = hide(plain, amount, np.random.default_rng(key))
            try:
                apart = measured(specimen, inputs, HANGING, columns) - without
            except WildMotion:
                break
            size = float(np.sqrt(np.mean(apart**2))) / noise_mm
            if SMALLEST <= size <= LARGEST and abs(size - target) < 0.25 * target:
                return cause, form, specimen, size
            amount *= float(np.clip(target / max(size, 1e-9), 0.1, 10.0))
            if abs(amount) > 1.0:
                break
    raise WildMotion(f"no cause of the wanted size in {_TRIES} tries")


# ----------------------------------------------------------------------------------------------------
# Runs the bench of hidden effects in motion: draw, diagnose in another process, score; draw by draw.

HELDOUT = 0.25  # share of the trials, the last ones
SINGLE, FALSE_CAUSE = 0.90, 1.0 / 40.0  # what is asked
Score = dict[str, Any]


def story_of(index: int) -> str:
    """Return what a draw tells: causes and nothing in turn."""
    return ("single", "none")[index % 2]


def run_draw(
    seed: int, index: int, root: Path, trials: int, seconds: float, jobs: int, limit_s: float
) -> Score:
    """Return the score of one draw, made unless its file is there, whole, and of this code."""
    code = judging_code()
    path = root / "scores" / f"draw_{index:03d}.json"
    known = read_json(path)
    if known is not None and known.get("code") == code:
        return dict(known)
    story = story_of(index)
    score: Score = {"index": index, "story": story, "code": code}
    try:
        draw = drawn(seed, index, story, trials, seconds)
    except WildMotion as error:
        score |= {"verdict": "not made", "why": str(error), "right": True}
        write_json(score, path)
        return score
    data, found = root / "data" / f"draw_{index:03d}", root / "found" / f"draw_{index:03d}"
    write_data(draw, data)
    begun = time.monotonic()
    command = [sys.executable, "-m", "catheter_sim", "diagnose", str(data), "-o", str(found)]
    failure = ""
    try:
        done = subprocess.run(
            [*command, "--jobs", str(jobs)], capture_output=True, text=True, timeout=limit_s, check=False
        )
        if done.returncode:
            failure = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
    except subprocess.TimeoutExpired:
        failure = f"out of time, {limit_s:g} s"
    score |= {"seconds": time.monotonic() - begun} | _scored(
        draw, read_json(found / "diagnosis.json"), failure
    )
    write_json(score, path)
    return score


def run_bench(
    seed: int,
    draws: Sequence[int],
    root: Path,
    trials: int,
    seconds: float,
    jobs: int,
    limit_s: float,
    on_score: Callable[[Score], None] = lambda score: None,
) -> list[Score]:
    """Return the scores of some draws of a seed, in order; a stopped run goes on where it was.

    Raises:
        InputError: the folder holds the draws of another seed or of other trials.
    """
    keep_settings(root, {"seed": seed, "trials": trials, "seconds": seconds})
    scores = []
    for index in draws:
        scores.append(run_draw(seed, index, root, trials, seconds, jobs, limit_s))
        on_score(scores[-1])
    return scores


def write_data(draw: Draw, folder: Path) -> None:
    """Write a draw as a data set; what it hides is not in it."""
    folder.mkdir(parents=True, exist_ok=True)
    names = input_channels(draw.robot, "tension")
    entries, first_heldout = [], len(draw.trials) - max(1, round(HELDOUT * len(draw.trials)))
    for number, (inputs, outputs) in enumerate(zip(draw.trials, draw.outputs, strict=True)):
        file = f"trial_{number + 1:02d}.csv"
        columns = {name: inputs.tendon[:, k] for k, name in enumerate(names)}
        columns |= {name: np.round(outputs[:, k], 4) for k, name in enumerate(draw.columns)}
        write_table(Table(inputs.time_s, columns), folder / file)
        entries.append({"file": file, "role": "train" if number < first_heldout else "heldout"})
    document = {
        "dataset": {
            "name": folder.name,
            "robot": "robot.toml",
            "source": "made for the bench of hidden effects in motion",
            "licence": "CC0-1.0",
        },
        "conditions": {"gravity_mps2": HANGING.tolist(), "motion": "dynamic"},
        "channels": {"inputs": names, "outputs": list(draw.columns)},
        "trials": entries,
    }
    (folder / "dataset.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    (folder / "robot.toml").write_text(robot_toml(draw.robot), encoding="utf-8")


def summary(scores: Sequence[Score]) -> list[str]:
    """Return lines that compare what was reached with what is asked."""
    lines = []
    for story, words in (("single", "single cause named first"), ("none", "nothing hidden: a cause named")):
        mine = [item for item in scores if item["story"] == story and item["verdict"] != "not made"]
        if not mine:
            continue
        if story == "single":
            count = sum(item["right"] for item in mine)
            lines.append(f"{words}: {count} of {len(mine)}; asked: {100 * SINGLE:g} %")
        else:
            count = sum(not item["right"] for item in mine)
            lines.append(f"{words}: {count} of {len(mine)}; asked: at most 1 of 40")
    times = sorted(item["seconds"] for item in scores if "seconds" in item)
    if times:
        lines.append(f"seconds of a diagnosis: median {times[len(times) // 2]:.0f}, most {times[-1]:.0f}")
    return lines


def _scored(draw: Draw, found: Any, failure: str) -> Score:
    answer = {
        "cause": draw.cause,
        "form": draw.form,
        "size_over_noise": draw.size,
        "noise_mm": draw.noise_mm,
        "hidden": {
            name: value
            for name, value in asdict(draw.specimen).items()
            if name != "robot" and value not in (0.0, (), (0.0, 0.0, 0.0))
        },
    }
    if found is None or failure:
        return {"verdict": "failed", "why": failure or "no diagnosis.json", "right": False, "answer": answer}
    named = [cause["name"] for cause in found["causes"]]
    right = named[:1] == [draw.cause] if draw.cause else found["verdict"] != "cause_found"
    return {
        "verdict": found["verdict"],
        "named": named,
        "parameters": {cause["name"]: cause["parameters"] for cause in found["causes"]},
        "indistinguishable": found["indistinguishable"],
        "heldout": found["heldout"],
        "noise_floor": found["noise_floor"],
        "right": right,
        "answer": answer,
    }
