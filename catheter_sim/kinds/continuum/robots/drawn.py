"""Continuum robots of drawn dimensions, of no publication: for the bench of hidden effects."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.core.published import Trials
from catheter_sim.core.robot import Friction
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Segment, Tendon

_DISKS = 12  # a segment; with fewer, an arc from disk to disk and a finer chain differ by too much
# The twin bends in arcs; the chain that makes the data has other links than the robot's own simulation, too.
_FINER = {"links_per_subsegment": 2}


def one_segment(generator: np.random.Generator) -> tuple[ContinuumRobot, Trials]:
    """Return one segment with three elastic tendons, driven by displacement, without friction."""
    length = generator.uniform(0.05, 0.09)
    radius = generator.uniform(3.5e-3, 5e-3)
    segment = Segment("arm", length, _DISKS, radius + 5e-4, generator.uniform(1.5e-3, 4e-3), 3e-3)
    tendons = tuple(
        Tendon(
            f"t{k}",
            radius,
            math.radians(120.0 * k + 20.0),
            "arm",
            stiffness_N_per_m=generator.uniform(6e3, 12e3),
            pretension_N=1.0,
        )
        for k in range(3)
    )
    robot = ContinuumRobot(
        name="arm",
        description="",
        segments=(segment,),
        tendons=tendons,
        friction=Friction(0.0),
        actuation="displacement",
    )
    return robot, Trials("heading", (radius,) * 3, simulated=_FINER)


def two_segments(generator: np.random.Generator) -> tuple[ContinuumRobot, Trials]:
    """Return two segments with three tendons each, driven by tension, without friction."""
    radius = generator.uniform(3e-3, 5e-3)
    segments = tuple(
        Segment(
            name, generator.uniform(0.03, 0.05), _DISKS, radius + 5e-4, generator.uniform(1e-3, 3e-3), 2e-3
        )
        for name in ("lower", "upper")
    )
    tendons = tuple(
        Tendon(f"{part.name}_{k}", radius, math.radians(120.0 * k + 60.0 * index), part.name)
        for index, part in enumerate(segments)
        for k in range(3)
    )
    robot = ContinuumRobot(
        name="two_segments", description="", segments=segments, tendons=tendons, friction=Friction(0.0)
    )
    # 0.8 of the tension that bends it all by a radian if it were of its softer segment: T r L = EI
    softest, length = min(part.bending_stiffness_N_m2 for part in segments), sum(p.length_m for p in segments)
    reach = (0.8 * (softest / (radius * length)),) * len(tendons)
    return robot, Trials("pull", reach, simulated=_FINER, rods=True)
