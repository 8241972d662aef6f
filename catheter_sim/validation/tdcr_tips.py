"""Tips of the modelling benchmark's robot by every model, the simulation among them (Rao et al. 2021).

doi 10.3389/frobt.2020.630245, Section 6.2. Sixteen sets of tensions, each 0 or T_M (Eq. 55); every set is
solved by itself from the straight robot.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.robots.continuum.lumped import prb_printed
from catheter_sim.robots.continuum.published import DISK_RADIUS_M, SEGMENT_LENGTH_M, spacer_disk
from catheter_sim.robots.continuum.rods import load, problem
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.theory.run import STATIC_MODELS
from catheter_sim.validation.drives import NO_GRAVITY, given

SETS = np.array(list(itertools.product((0.0, 1.0), repeat=4)))[:, ::-1]  # of tendons 1 to 4, in shares of T_M
TIP_FORCES_N: Mapping[str, tuple[float, float, float]] = {
    "none": (0.0, 0.0, 0.0),
    "in plane": (0.0, 0.5, 0.0),
    "across": (0.5, 0.0, 0.0),
}
SIMULATION = "simulation"
PRB_PRINTED = "PRB_printed"
PRINTED_TOLERANCE = 1e-8  # usual, and enough for the answer to hang on it: at 0.2 of the stiffness across
# A set solved: position [m] and orientation of the tip, or None where the model found no equilibrium.
Pose = tuple[Array, Array] | None


@dataclass(frozen=True)
class Scores:
    """A model's errors over the sixteen sets of tensions in one condition.

    Attributes:
        position_percent, orientation_deg: mean errors (Eq. 57) over the sets that both models solved.
        solved: number of sets that the model solved.
        ms: mean time of a set, one after another, from a straight start [ms].
    """

    position_percent: float
    orientation_deg: float
    solved: int
    ms: float


@dataclass(frozen=True)
class Tips:
    """Tips of a model: positions (16, 3) [m] and orientations (16, 3, 3), NaN where there is none."""

    p_w: Array
    R_w: Array
    ms: float


def largest_tension_N(robot: ContinuumRobot) -> float:
    """Return T_M: it turns the tip by 90 deg if tendons 1 and 3 pull at the segments' ends (Eq. 55)."""
    bending = robot.stiffness_scale * robot.segments[0].bending_stiffness_N_m2
    return math.pi / 2.0 * bending / (3.0 * DISK_RADIUS_M * SEGMENT_LENGTH_M)


def benchmark_robot(disks: int = 10, stiffness: float = 1.0, links: int = 4) -> ContinuumRobot:
    """Return the benchmark's robot with so many disks a segment, its stiffness scaled.

    Args:
        disks: a segment.
        stiffness: factor of E.
        links: a subsegment, of the simulated chain.
    """
    return replace(
        spacer_disk(), disks_per_segment=disks, stiffness_scale=stiffness, links_per_subsegment=links
    )


def rigid_along(robot: ContinuumRobot) -> ContinuumRobot:
    """Return the robot with a backbone that neither stretches nor shears, as the simulated chain's."""
    parts = (replace(part, axial_stiffness_N=math.inf, shear_stiffness_N=math.inf) for part in robot.segments)
    return replace(robot, segments=tuple(parts))


def tips(robot: ContinuumRobot, model: str, force_tip_N: Sequence[float]) -> Tips:
    """Return where a model puts the tip under the sixteen sets of tensions.

    Args:
        robot: `benchmark_robot`, changed or not.
        model: a static model's name, `SIMULATION` or `PRB_PRINTED`.
        force_tip_N: shape (3,) [N].
    """
    if model == SIMULATION:
        pose = _by_simulation(robot, force_tip_N)
    elif model == PRB_PRINTED:
        pose = _by_printed_residual(robot, force_tip_N)
    else:
        pose = _by_statics(robot, model, force_tip_N)
    p_w, R_w = np.full((len(SETS), 3), np.nan), np.full((len(SETS), 3, 3), np.nan)
    began = time.perf_counter()
    for row, tension in enumerate(SETS * largest_tension_N(robot)):
        found = pose(tension)
        if found is not None:
            p_w[row], R_w[row] = found
    return Tips(p_w, R_w, (time.perf_counter() - began) / len(SETS) * 1e3)


def scores(found: Tips, reference: Tips) -> Scores:
    """Return Eq. 57's errors of a model against the reference."""
    both = np.isfinite(found.p_w[:, 0]) & np.isfinite(reference.p_w[:, 0])
    away, turned = errors(found, reference)
    solved = int(np.isfinite(found.p_w[:, 0]).sum())
    return Scores(float(away[both].mean()), float(turned[both].mean()), solved, found.ms)


def errors(found: Tips, reference: Tips) -> tuple[Array, Array]:
    """Return every set's errors of position [% of the length] and orientation [deg], shape (16,) each."""
    away = np.linalg.norm(found.p_w - reference.p_w, axis=1) / (2.0 * SEGMENT_LENGTH_M) * 100.0
    turns = found.R_w @ np.swapaxes(reference.R_w, -1, -2)
    cosine = np.clip(0.5 * (np.trace(turns, axis1=1, axis2=2) - 1.0), -1.0, 1.0)
    return away, np.degrees(np.arccos(cosine))


def _by_statics(robot: ContinuumRobot, model: str, force_tip_N: Sequence[float]) -> Callable[[Array], Pose]:
    solve = STATIC_MODELS[model].solve

    def pose(tension_N: Array) -> Pose:
        inputs = given(tension_N[None], "tension", np.array([force_tip_N]))
        try:
            posture = solve(robot, inputs, NO_GRAVITY).postures[0]
        except InputError:
            return None
        return posture.p_w[-1], posture.R_w[-1]

    return pose


def _by_simulation(robot: ContinuumRobot, force_tip_N: Sequence[float]) -> Callable[[Array], Pose]:
    """Return the simulated chain's tip at rest; the loads are there at once, without friction."""
    simulator = Simulator(robot, inertia=False)
    relaxation_steps = round(robot.dynamics.relaxation_time_s / robot.dynamics.timestep_s)

    def pose(tension_N: Array) -> Pose:
        simulator.reset()
        simulator.set_inputs(tension_N, force_tip_N)
        try:
            if not simulator.settle(60.0):
                return None
        except SimulationDiverged:
            return None
        # What `settle` calls rest is within 3 um of the tip's place; here the last of it is wanted.
        simulator.step(10 * relaxation_steps)
        posture = simulator.posture()
        return posture.p_w[-1], posture.R_w[-1]

    return pose


def _by_printed_residual(robot: ContinuumRobot, force_tip_N: Sequence[float]) -> Callable[[Array], Pose]:
    rod = problem(robot)

    def pose(tension_N: Array) -> Pose:
        loads = load(rod, given(tension_N[None], "tension", np.array([force_tip_N])), NO_GRAVITY)
        found, _ = prb_printed(rod, loads, tolerance=PRINTED_TOLERANCE)
        return found.p_w[0, -1], found.R_w[0, -1]

    return pose
