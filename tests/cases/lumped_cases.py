"""Robots, loads and published poses that the tests of CC_sub and PRB share."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.core.statics import StaticRun
from catheter_sim.robots.continuum.published import spacer_disk
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.lines import given

DATA = Path(__file__).resolve().parents[1] / "data"
NO_GRAVITY = np.zeros(3)
LENGTH = 0.1
FULL_PULL_N = 5.55329741  # Rao 2021, Eq. 55
ALL_PULLS = FULL_PULL_N * np.array([[config >> k & 1 for k in range(4)] for config in range(16)])


def benchmark(disks: int, scale: float = 1.0) -> ContinuumRobot:
    """Return the spacer-disk robot with `disks` per segment."""
    return replace(spacer_disk(), disks_per_segment=disks, stiffness_scale=scale)


def rod(disks: int, tendons: tuple[tuple[float, float], ...] = (), mu: float = 0.0) -> ContinuumRobot:
    """Return one segment, 0.1 m, EI 4e-3 N m^2; `tendons` as (angle in deg, radius in m), all to the tip."""
    return ContinuumRobot(
        name="rod",
        description="",
        segments=(Segment("one", LENGTH, disks, 8e-3, 4e-3, 0.02, torsion_stiffness_N_m2=3e-3),),
        tendons=tuple(
            Tendon(f"t{k}", radius, math.radians(angle), "one") for k, (angle, radius) in enumerate(tendons)
        ),
        friction=Friction(mu),
    )


def tips(run: StaticRun) -> tuple[Array, Array]:
    """Return the tips' positions, shape (r, 3) [m], and orientations, shape (r, 3, 3)."""
    return np.array([item.p_w[-1] for item in run.postures]), np.array(
        [item.R_w[-1] for item in run.postures]
    )


def turned_deg(one: Array, other: Array) -> Array:
    """Return the angles between orientations, shape (r,) [deg]."""
    return np.degrees(Rotation.from_matrix(np.swapaxes(one, -1, -2) @ other).magnitude())


def published(file: str, **which: str) -> tuple[Array, Array, Array]:
    """Return tensions, (r, 4), tips, (r, 3), and orientations, (r, 3, 3), of the rows that match."""
    with (DATA / file).open(encoding="utf-8") as stream:
        lines = csv.DictReader(line for line in stream if not line.startswith("#"))
        rows = [row for row in lines if all(row[key] == value for key, value in which.items())]
    pulls = np.array([[float(row[f"T{k}_N"]) for k in (1, 2, 3, 4)] for row in rows])
    p_w = np.array([[float(row[f"p{axis}_m"]) for axis in "xyz"] for row in rows])
    R_w = np.array([[[float(row[f"R{i}{j}"]) for j in "123"] for i in "123"] for row in rows])
    return pulls, p_w, R_w


def pulled(pulls: Array, force: Sequence[float] = (0.0, 0.0, 0.0)) -> Inputs:
    """Return inputs of the given tensions with one force on the tip in every row."""
    return given(
        np.asarray(pulls, dtype=float), force_tip=np.tile(np.array(force, dtype=float), (len(pulls), 1))
    )


def rod_tips(robot: ContinuumRobot, inputs: Inputs) -> tuple[Array, Array]:
    """Return the tips of the rod with tendons straight between disks (VC_ref), as `tips`."""
    return tips(STATIC_MODELS["VC_ref"].solve(robot, inputs, NO_GRAVITY))


def mean_errors(run: StaticRun, reference: tuple[Array, Array]) -> tuple[float, float]:
    """Return the mean tip errors against `reference`: % of the length and degrees (Rao 2021, Eq. 57)."""
    p, R = tips(run)
    off = np.linalg.norm(p - reference[0], axis=1).mean() / LENGTH * 100.0
    return float(off), float(turned_deg(reference[1], R).mean())
