"""Loops of the transseptal catheter's joints, simulated, and the models that are calibrated on them.

Nayar 2022, Figs 6 and 8. The paper prints no trajectory: each joint goes out and back alone, `PEAKS` times
its range, in half waves of a cosine, `LEG_S` each way.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.robots.catheter import measured as modified
from catheter_sim.robots.catheter.description import moved_segment
from catheter_sim.robots.catheter.kinematics import angle_rad
from catheter_sim.robots.catheter.measured import (
    BENDING_LOOP_M,
    BendingCalibration,
    PrandtlIshlinskii,
    TorsionCalibration,
    calibrate_bending,
    calibrate_torsion,
    identify,
)
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation.drives import NO_GRAVITY
from catheter_sim.validation.mitral import joint_angles_deg

JOINTS = ("bending", "torsion_proximal", "torsion_distal")  # in the order of the pairs
PEAKS = (1.0, 0.6, 0.8, 1.0)  # of a joint's largest displacement; a model sees the first two
LEG_S = 5.0
ROWS_PER_S = 10.0
_PRINTED = {"torsion_proximal": modified.TORSION_PROXIMAL, "torsion_distal": modified.TORSION_DISTAL}


@dataclass(frozen=True)
class JointLoops:
    """What one joint did.

    Attributes:
        joint: its name.
        displacement_m, angle_rad: row by row from rest, shape (r,).
        train: rows of the first two loops, shape (r,).
    """

    joint: str
    displacement_m: Array
    angle_rad: Array
    train: np.ndarray


@dataclass(frozen=True)
class Calibrated:
    """Models of the joints calibrated on their loops: MK's two kinds, and PI for each."""

    bending: BendingCalibration
    torsion: dict[str, TorsionCalibration]
    plays: dict[str, PrandtlIshlinskii]


def waves(corners: Array, leg_s: float = LEG_S) -> Array:
    """Return half waves of a cosine through `corners`, `ROWS_PER_S` rows a second, shape (r,)."""
    steps = round(leg_s * ROWS_PER_S)
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, steps + 1) / steps)
    parts = [low + (high - low) * share for low, high in itertools.pairwise(corners)]
    return np.concatenate([corners[:1], *parts])


def moving(rows_m: Array) -> Inputs:
    """Return inputs of displacements and advance in time, shape (r, 4) [m]."""
    nothing = np.zeros((len(rows_m), 3))
    return Inputs(np.arange(len(rows_m)) / ROWS_PER_S, "displacement", rows_m, nothing, nothing)


def largest_displacement_m(robot: CatheterRobot, joint: str) -> float:
    """Return how far the paper's loop of a joint goes [m]: 6 mm, or to the printed upper plateau."""
    if joint == "bending":
        return BENDING_LOOP_M
    segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
    return modified.plateau_displacement_m(segment, _PRINTED[joint])


def loops_of(
    robot: CatheterRobot, joint: str, both_sides: bool = False, top_m: float | None = None
) -> JointLoops:
    """Return a simulated joint's loops from rest.

    Args:
        robot: of the transseptal design.
        joint: one of `JOINTS`.
        both_sides: to one side and the other, instead of to one.
        top_m: largest displacement; default: the paper's.
    """
    pair = JOINTS.index(joint)
    top = largest_displacement_m(robot, joint) if top_m is None else top_m
    corners = np.zeros(2 * len(PEAKS) + 1)
    corners[1::2] = np.array(PEAKS) * top
    if both_sides:
        corners[2::2] = -corners[1::2]
    rows = np.zeros((len(waves(corners)), 4))
    rows[:, pair] = waves(corners)
    postures = simulate(robot, moving(rows), NO_GRAVITY, dynamic=True).postures
    angle = np.radians(joint_angles_deg(robot, postures)[joint])
    train = np.arange(len(rows)) <= 4 * round(LEG_S * ROWS_PER_S)
    return JointLoops(joint, rows[:, pair], angle, train)


def calibrated(robot: CatheterRobot, loops: dict[str, JointLoops]) -> Calibrated:
    """Return MK and PI models of the joints, from the first two loops of each."""
    torsion, plays = {}, {}
    bending = None
    for joint, item in loops.items():
        segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
        way, angle = item.displacement_m[item.train], item.angle_rad[item.train]
        if joint == "bending":
            bending = calibrate_bending(segment, way, angle)
        else:
            torsion[joint] = calibrate_torsion(segment, way, angle)
        plays[joint] = identify(way, angle)
    assert bending is not None
    return Calibrated(bending, torsion, plays)


def r_squared(measured: Array, modelled: Array) -> float:
    """Return the share of the measured variance that a model explains."""
    left = float(((measured - modelled) ** 2).sum())
    return 1.0 - left / float(((measured - measured.mean()) ** 2).sum())


def branches(item: JointLoops) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of loading (away from zero) and of unloading, after the first leg, each (r,)."""
    size = np.abs(item.displacement_m)
    step = np.diff(size, prepend=size[0])
    later = np.arange(len(size)) > round(LEG_S * ROWS_PER_S)
    return later & (step > 0.0), later & (step < 0.0)


def pure(robot: CatheterRobot, item: JointLoops) -> Array:
    """Return what pure kinematics says along loops, shape (r,) [rad] (Eqs 5 and 7)."""
    segment = robot.segments[moved_segment(robot, JOINTS.index(item.joint))]
    return angle_rad(segment, item.displacement_m)


def with_play(robot: CatheterRobot, joint: str, play_m: float) -> CatheterRobot:
    """Return a robot whose drive of one joint has a play."""
    pairs = (replace(pair, play_m=play_m) if pair.name == joint else pair for pair in robot.tendons)
    return replace(robot, tendons=tuple(pairs))
