"""Data sets with a known cause in them, made by the simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import input_channels, posture_columns
from catheter_sim.core.document import with_number
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import Friction, RobotSpec
from catheter_sim.diagnosis.trials import Dataset, Trial
from catheter_sim.effects.apply import arriving_inputs, observed, with_built_in_effects, with_effects
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table
from catheter_sim.theory.static_models import STATIC_MODELS

NO_GRAVITY = np.zeros(3)
Effects = Mapping[str, Mapping[str, float]]


def small_robot() -> ContinuumRobot:
    """Return a robot as of a `.toml`: one segment of 60 mm, three elastic tendons driven by displacement."""
    return ContinuumRobot(
        name="small",
        description="",
        segments=(Segment("arm", 0.06, 8, 5e-3, 2.5e-3, 3e-3),),
        tendons=tuple(
            Tendon(
                f"t{k}",
                4.5e-3,
                math.radians(120.0 * k + 20.0),
                "arm",
                stiffness_N_per_m=8e3,
                pretension_N=1.0,
            )
            for k in range(3)
        ),
        friction=Friction(0.0),
        actuation="displacement",
    )


def pair_history(seed: int, cycles: int = 4) -> Inputs:
    """Return tensions of an antagonistic pair: out, partly back, out again, home, side after side."""
    generator = np.random.default_rng(seed)
    rows = [(0.0, 0.0), (0.12, 0.12)]
    for cycle in range(cycles):
        top, valley = generator.uniform(0.3, 0.55), generator.uniform(0.14, 0.22)
        path = np.concatenate(
            [
                np.linspace(a, b, n)[1:]
                for a, b, n in ((0.12, top, 5), (top, valley, 4), (valley, 0.9 * top, 4))
            ]
        )
        for value in (*path, *np.linspace(0.9 * top, 0.12, 5)[1:]):
            rows.append((value, 0.12) if cycle % 2 == 0 else (0.12, value))
    return as_inputs(np.array(rows), "tension")


def displacement_history(seed: int, cycles: int = 5) -> Inputs:
    """Return displacements of three tendons: out and home in random directions, through a partial loop."""
    generator = np.random.default_rng(seed)
    share = np.concatenate([np.linspace(0, 1, 6), [0.7, 0.4, 0.7, 0.95], np.linspace(0.8, 0, 5)])
    rows = []
    for _ in range(cycles):
        heading, size = generator.uniform(0, 2 * math.pi), generator.uniform(3e-3, 5e-3)
        angles = np.radians([20.0, 140.0, 260.0]) - heading
        rows += [size * part * np.cos(angles) for part in share]
    return as_inputs(np.array(rows), "displacement")


def rod_history(seed: int, cycles: int = 2) -> Inputs:
    """Return tensions of one rod: out, partly back, out again, home."""
    generator = np.random.default_rng(seed)
    rows = [0.0]
    for _ in range(cycles):
        top, valley = generator.uniform(25.0, 50.0), generator.uniform(4.0, 12.0)
        for a, b, count in ((0.0, top, 6), (top, valley, 5), (valley, 0.9 * top, 4), (0.9 * top, 0.0, 5)):
            rows += list(np.linspace(a, b, count)[1:])
    return as_inputs(np.array(rows)[:, np.newaxis], "tension")


def as_inputs(tendon: np.ndarray, actuation: str) -> Inputs:
    """Return inputs two seconds apart, without loads on the tip."""
    zeros = np.zeros((len(tendon), 3))
    return Inputs(2.0 * np.arange(len(tendon)), actuation, tendon, zeros, zeros)


def data_set(
    robot: RobotSpec,
    reference: str,
    effects: Effects,
    histories: Sequence[Inputs],
    columns: Sequence[str],
    noise_mm: float = 0.1,
    seed: int = 1,
    links: int = 0,
    solver: str = "simulation",
) -> Dataset:
    """Return what the simulation of `robot` with `effects` shows, the last history held out.

    Args:
        robot: as specified; what the data set says it is.
        reference: the robot's name in the data set.
        effects: what is hidden in the data.
        histories: one trial each.
        columns: outputs, all in mm.
        noise_mm: standard deviation of the white noise added.
        seed: of the noise.
        links: hinges per subsegment of the simulation that makes the data; 0: the robot's own.
        solver: "simulation", or the static model that makes the data.
    """
    hidden = with_effects(robot, effects)
    if links:
        assert isinstance(hidden, ContinuumRobot)
        hidden = replace(hidden, links_per_subsegment=links)
    generator = np.random.default_rng(seed)
    trials: list[Trial] = []
    runs: list[tuple[Posture, ...]] = []
    for index, inputs in enumerate(histories):
        before = [run for run, trial in zip(runs, trials, strict=True) if same_rows(trial.inputs, inputs)]
        # A repeat goes as the first time, but for the noise.
        postures = (
            before[0]
            if before
            else postures_of(with_built_in_effects(hidden), arriving_inputs(hidden, inputs), solver)
        )
        runs.append(postures)
        values = posture_columns(hidden, observed(hidden, inputs.time_s, postures))
        noisy = {name: values[name] + noise_mm * generator.normal(size=len(inputs)) for name in columns}
        role = "heldout" if index == len(histories) - 1 else "train"
        file = f"trial_{index}.csv"
        trials.append(Trial(file, role, inputs, Table(inputs.time_s, noisy, file)))
    return Dataset(
        folder=Path("planted"),
        name="planted",
        robot=robot,
        robot_reference=reference,
        source="simulation",
        licence="none",
        gravity_mps2=NO_GRAVITY,
        input_channels=tuple(input_channels(robot, histories[0].actuation)),
        output_channels=tuple(columns),
        trials=tuple(trials),
    )


def same_rows(one: Inputs, other: Inputs) -> bool:
    """Return whether two histories without loads on the tip are one."""
    return np.array_equal(one.time_s, other.time_s) and np.array_equal(one.tendon, other.tendon)


def postures_of(robot: RobotSpec, inputs: Inputs, solver: str) -> tuple[Posture, ...]:
    """Return the postures of a robot without effects."""
    if solver == "simulation":
        return simulate(robot, inputs, NO_GRAVITY).postures
    return STATIC_MODELS[solver].solve(robot, inputs, NO_GRAVITY).postures


def section_data(effects: Effects, seed: int = 1) -> Dataset:
    """Return a data set of the measured neuroendoscope section, one training trial repeated."""
    return data_set(
        load_robot("neuroendoscope_section"),
        "neuroendoscope_section",
        effects,
        [pair_history(seed), pair_history(seed), pair_history(seed + 1)],
        ("tip_x_mm", "tip_z_mm", "body_15_x_mm", "body_15_z_mm"),
        seed=seed,
    )


def chest_data(effects: Effects, seed: int = 1, solver: str = "virtual_work") -> Dataset:
    """Return a data set of a chest-tube section with its own small calibration errors."""
    specified = load_robot("chest_tube_section")
    built = replace(specified, stiffness_scale=1.02, friction=Friction(0.29))
    found = data_set(
        built,
        "chest_tube_section",
        effects,
        [rod_history(seed + trial) for trial in range(4)],
        ("tip_x_mm", "tip_z_mm", "body_7_x_mm", "body_7_z_mm"),
        seed=seed,
        solver=solver,
    )
    return replace(found, robot=specified)


def small_data(effects: Effects, seed: int = 1) -> Dataset:
    """Return a data set of the small robot, from a chain with twice its hinges."""
    return data_set(
        small_robot(),
        "small.toml",
        effects,
        [displacement_history(seed), displacement_history(seed + 1), displacement_history(seed + 2)],
        ("tip_x_mm", "tip_y_mm", "tip_z_mm"),
        seed=seed,
        links=2,
    )


def catheter_data(effects: Effects, seed: int = 1) -> Dataset:
    """Return a data set of the transseptal catheter with small errors of calibration, made by statics."""
    specified = load_robot("mitral_transseptal")
    built = with_number(specified, "segments.bending.arm_mm", 1.8 * 1.006)
    built = with_number(built, "segments.torsion_distal.tendon_radius_mm", 2.85 * 0.994)
    found = data_set(
        built,
        "mitral_transseptal",
        effects,
        [joint_history(seed), joint_history(seed), joint_history(seed + 1)],
        ("tip_x_mm", "tip_y_mm", "tip_z_mm", "body_11_x_mm", "body_11_y_mm", "body_11_z_mm"),
        seed=seed,
        solver="pk",
    )
    return replace(found, robot=specified)


def joint_history(seed: int, cycles: int = 4) -> Inputs:
    """Return displacements that move every joint of the transseptal catheter to and fro."""
    generator = np.random.default_rng(seed)
    share = np.concatenate([np.linspace(0, 1, 7), np.linspace(1, -1, 12)[1:], np.linspace(-1, 0, 7)[1:]])
    rows = []
    for _ in range(cycles):
        size = generator.uniform([1.5, 0.8, 0.8, 0.0], [3.2, 2.0, 2.0, 0.0])
        advance = generator.uniform(5.0, 40.0)
        moves = np.stack([np.roll(share, shift) for shift in (0, 5, 11)], axis=1) * size[:3]
        rows.append(np.column_stack([moves, advance * np.abs(share)]))
    return as_inputs(1e-3 * np.concatenate(rows), "displacement")
