"""Tendons that wind about the backbone, against VC (Rao et al. 2021, Section 10: named for future work).

The simulated robot has its holes turned from disk to disk (`rest_twist_rad_per_m`), its tendons straight
between them. VC holds a tendon to its path everywhere; without loads it needs no boundary conditions: what
the tendons beyond a section pull, the backbone there balances, so that

    u = K^-1 (-sum r x T t),    t = (e3 + u x r + r') / |...|

in the section's own frame, r(s) the hole; K of bending and torsion, a backbone that neither stretches nor
shears, as the chain's. Written here for this comparison alone; with many disks both must agree.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation.lines import Line
from catheter_sim.validation.tdcr_tips import SETS, benchmark_robot, largest_tension_N

NAME = "spacer_disk"
TURN_RAD = math.pi  # of the holes from base to tip
STEPS = 400
DISKS = (5, 10)
PULLED = 4  # of `SETS`: tendon 3 alone, from base to tip
PERCENT, ORDER = 0.02, 0.1  # tolerances: of the length at ten disks; of the order of convergence, 2
_ITERATIONS = 60


def helical(disks: int) -> ContinuumRobot:
    """Return the benchmark's robot with its holes turned by half a turn from base to tip."""
    robot = benchmark_robot(disks, links=2)
    twist = TURN_RAD / sum(part.length_m for part in robot.segments)
    return replace(
        robot, segments=tuple(replace(part, rest_twist_rad_per_m=twist) for part in robot.segments)
    )


def vc_tip_m(robot: ContinuumRobot, tension_N: Array) -> Array:
    """Return where VC puts the tip of a robot with winding tendons, shape (3,) [m].

    Args:
        robot: its segments all twisted alike.
        tension_N: of each tendon, shape (t,).
    """
    ends = np.cumsum([part.length_m for part in robot.segments])
    names = [part.name for part in robot.segments]
    until = [ends[names.index(tendon.ends_at)] for tendon in robot.tendons]
    step = ends[-1] / STEPS
    p, R = np.zeros(3), np.eye(3)
    for k in range(STEPS):
        s = (k + 0.5) * step
        part = robot.segments[int(np.searchsorted(ends, s))]
        pulls = [
            (tension, tendon.radius_m, tendon.angle_rad + part.rest_twist_rad_per_m * s)
            for tension, tendon, end in zip(tension_N, robot.tendons, until, strict=True)
            if s < end and tension > 0.0
        ]
        stiffness = robot.stiffness_scale * np.array(
            [part.bending_stiffness_N_m2] * 2 + [part.torsion_stiffness_N_m2]
        )
        u = _curvature(pulls, part.rest_twist_rad_per_m, stiffness)
        half = Rotation.from_rotvec(0.5 * step * u).as_matrix()
        # an arc's chord lies along its middle
        bend = 0.5 * step * float(np.linalg.norm(u[:2]))
        p = p + R @ half[:, 2] * step * float(np.sinc(bend / math.pi))
        R = R @ half @ half
    return p


def _curvature(pulls: list[tuple[float, float, float]], twist: float, stiffness: Array) -> Array:
    """Return the backbone's curvature and twist in its own frame, shape (3,) [1/m].

    Args:
        pulls: tension [N], radius [m] and angle [rad] of every tendon that runs through the section.
        twist: of the holes [rad/m].
        stiffness: bending toward x and y, torsion, shape (3,) [N m^2].
    """
    u = np.zeros(3)
    for _ in range(_ITERATIONS):
        moment = np.zeros(3)
        for tension, radius, angle in pulls:
            r = radius * np.array([math.cos(angle), math.sin(angle), 0.0])
            along = np.array([0.0, 0.0, 1.0]) + np.cross(u, r)
            along += radius * twist * np.array([-math.sin(angle), math.cos(angle), 0.0])
            moment -= np.cross(r, tension * along / np.linalg.norm(along))
        u = moment / stiffness
    return u


def simulated_tip_m(robot: ContinuumRobot, tension_N: Array) -> Array:
    """Return where the simulated chain comes to rest, shape (3,) [m]."""
    simulator = Simulator(robot, inertia=False)
    simulator.set_inputs(tension_N)
    simulator.settle(60.0)
    simulator.step(10 * round(robot.dynamics.relaxation_time_s / robot.dynamics.timestep_s))
    return simulator.posture().p_w[-1]


def distance_percent(disks: int, twisted: float = 1.0) -> float:
    """Return the simulated tip's distance from VC's [% of the length].

    Args:
        disks: a segment.
        twisted: factor of the twist that VC is told.
    """
    tension = 0.5 * SETS[PULLED] * largest_tension_N(benchmark_robot())
    robot = helical(disks)
    told = replace(
        robot,
        segments=tuple(
            replace(part, rest_twist_rad_per_m=twisted * part.rest_twist_rad_per_m) for part in robot.segments
        ),
    )
    length = sum(part.length_m for part in robot.segments)
    away = float(np.linalg.norm(simulated_tip_m(robot, tension) - vc_tip_m(told, tension)))
    return 100.0 * away / length


def helix_lines() -> list[Line]:
    """Return the chain's distance from VC by number of disks, judged at the most, and its order."""
    source = "Rao 2021, Section 10, without figures; VC with winding tendons, written for this alone"
    start = "helical routing, half a turn, one tendon at T_M/2"
    away = [distance_percent(disks) for disks in DISKS]
    lines = [
        Line(
            NAME,
            f"{start}, {disks} disks: tip of the simulation to VC",
            "%",
            found,
            PERCENT if disks == DISKS[-1] else None,
            source,
        )
        for disks, found in zip(DISKS, away, strict=True)
    ]
    order = math.log2(away[0] / away[1]) / math.log2(DISKS[1] / DISKS[0])
    what = f"{start}: order of convergence in disks"
    lines.append(Line(NAME, what, "-", abs(order - 2.0), ORDER, source, order, 2.0))
    return lines
