"""A small robot that swings, for tests of motion."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Dynamics, Friction
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

LENGTH_M, STIFFNESS_N_M2 = 0.2, 0.008
HANGING = np.array([0.0, 0.0, 9.81])


def swinging(
    mu: float = 0.1,
    damping_time_s: float = 0.01,
    mass_kg: float = 0.05,
    disks: int = 5,
    motion_timestep_s: float = 1e-3,
) -> ContinuumRobot:
    """Return a planar arm with two tendons."""
    return ContinuumRobot(
        name="swinging_arm",
        description="for tests",
        segments=(Segment("arm", LENGTH_M, disks, 0.012, STIFFNESS_N_M2, mass_kg, "x"),),
        tendons=(Tendon("right", 0.01, 0.0, "arm"), Tendon("left", 0.01, np.pi, "arm")),
        friction=Friction(mu),
        dynamics=Dynamics(damping_time_s=damping_time_s, motion_timestep_s=motion_timestep_s),
    )


def pulled(seed: int = 0, seconds: float = 0.5, row_s: float = 0.01) -> Inputs:
    """Return a trial in which both tendons' tensions are tones, from zero."""
    generator = np.random.default_rng(seed)
    time_s = np.round(row_s * np.arange(round(seconds / row_s) + 1), 6)
    tension = np.stack([_tones(time_s, generator) for _ in range(2)], axis=1)
    nothing = np.zeros((len(time_s), 3))
    return Inputs(time_s, "tension", tension, nothing, nothing)


def _tones(time_s: Array, generator: np.random.Generator) -> Array:
    wave = sum(
        np.sin(2.0 * np.pi * tone_Hz * time_s + generator.uniform(0.0, 6.0))
        for tone_Hz in generator.uniform(0.3, 3.0, 4)
    )
    return np.asarray((wave - np.min(wave)) * np.minimum(time_s / 0.2, 1.0))
