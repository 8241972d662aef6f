"""What the benchmark measures beside the robots: a wide chain, and how cost grows with a chain's length."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from catheter_sim.core.robot import DAMPING_TIME_S, Dynamics, Friction
from catheter_sim.robots.continuum.published import neuroendoscope_section
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

CHAIN = "chain_60dof_9tendons"
GROWTH_ROBOT = "neuroendoscope_section"
CELLS = (10, 20, 40, 80, 120)
GROWTH_TARGET = 1.3


@dataclass(frozen=True)
class Growth:
    """Cost of a step over the number of cells.

    Attributes:
        cells: n.
        us_per_step_friction: of `Simulator.step` with friction, median [us].
        us_per_step_plain: of `mj_step` on the frictionless model, median [us].
        exponent_friction, exponent_plain: p of the fit cost = c n^p, by least squares of the logarithms.
    """

    cells: tuple[int, ...]
    us_per_step_friction: tuple[float, ...]
    us_per_step_plain: tuple[float, ...]
    exponent_friction: float
    exponent_plain: float


def exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """Return p of the fit cost = c size^p, by least squares of the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(costs), 1)[0])


def with_cells(count: int, mu: float) -> ContinuumRobot:
    """Return the measured neuroendoscope section with `count` of its cells in a row, and friction `mu`."""
    robot = neuroendoscope_section()
    (segment,) = robot.segments
    share = count / segment.disks
    longer = dataclasses.replace(
        segment, disks=count, length_m=share * segment.length_m, mass_kg=share * segment.mass_kg
    )
    return dataclasses.replace(robot, segments=(longer,), friction=Friction(mu))


def chain(mu: float) -> ContinuumRobot:
    """Return a robot of 60 degrees of freedom and nine tendons: three segments of ten disks, in space.

    Three tendons end at each segment, 120 deg apart and 40 deg on from segment to segment. It is nobody's
    robot; its numbers are assumed.
    """
    segments = tuple(
        Segment(
            name=f"segment_{k}",
            length_m=0.04,
            disks=10,
            outer_radius_m=0.004,
            bending_stiffness_N_m2=1e-3,
            mass_kg=0.002,
        )
        for k in range(3)
    )
    tendons = tuple(
        Tendon(f"{segment.name}_{k}", 0.003, math.radians(40.0 * place + 120.0 * k), segment.name)
        for place, segment in enumerate(segments)
        for k in range(3)
    )
    return ContinuumRobot(
        name=CHAIN,
        description="three segments of ten disks, three tendons each, bending in space",
        segments=segments,
        tendons=tendons,
        friction=Friction(mu),
        dynamics=Dynamics(damping_time_s=DAMPING_TIME_S),
        sources={"segments": "assumed", "tendons": "assumed"},
    )


def growth_text(growth: Growth) -> str:
    """Return the growth of cost as lines for people."""
    lines = [f"cost of a step over the cells of {GROWTH_ROBOT} [us]"]
    rows: list[tuple[str, Sequence[Any], str]] = [
        ("cells", growth.cells, ""),
        ("friction on", growth.us_per_step_friction, f"  n^{growth.exponent_friction:.2f}"),
        ("mj_step", growth.us_per_step_plain, f"  n^{growth.exponent_plain:.2f}"),
    ]
    return "\n".join(
        lines + [f"{name:<24}" + "".join(f"{x:>8.0f}" for x in row) + p for name, row, p in rows]
    )
