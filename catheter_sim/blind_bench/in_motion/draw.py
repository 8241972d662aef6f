"""Draws what a data set in motion hides: a robot, a cause, its size, inputs and noise.

The seed and the number of the draw decide everything. Nothing of `effects` or `diagnosis` is imported: a
cause's name is all that is shared.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.in_motion.finer import Specimen, WildMotion, measured
from catheter_sim.columns import posture_columns
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Dynamics, Friction, with_segments
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.simulation.replay import simulate

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
