"""Checks of the benchmark robot (Rao et al. 2021, doi 10.3389/frobt.2020.630245)."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.resources import assets_folder
from catheter_sim.robots.continuum.constant_curvature import constant_curvature
from catheter_sim.robots.continuum.published import spacer_disk
from catheter_sim.validation import plots
from catheter_sim.validation.drives import NO_GRAVITY, given, tips_mm
from catheter_sim.validation.lines import Line, Validation
from catheter_sim.validation.tdcr_tips import (
    SETS,
    SIMULATION,
    TIP_FORCES_N,
    benchmark_robot,
    largest_tension_N,
    tips,
)

LENGTH_MM = 100.0
# Mean tip errors of a chain of hinges at element middles, ten disks [% of length], by links a subsegment.
EXPECTED_PERCENT = {1: 0.363, 2: 0.094, 4: 0.028}


def validate_spacer_disk(folder: Path) -> Validation:
    """Check the chain against an independent Cosserat solver; plots go into `folder`."""
    tensions, reference_mm = reference_tips(10)
    means = {links: _mean_error_percent(links, tensions, reference_mm) for links in EXPECTED_PERCENT}
    lines = [
        Line(
            "spacer_disk",
            f"fifteen load cases, ten disks, {links} links a subsegment: mean tip error, % of length",
            "%",
            means[links],
            1.1 * expected,
            "independent Cosserat solver, tendons through disks; tolerance 10 % above an independent chain's",
            ours=means[links],
            published=None,
        )
        for links, expected in EXPECTED_PERCENT.items()
    ]
    arc = tips_mm(constant_curvature(spacer_disk(), given(tensions), NO_GRAVITY).postures)
    lines.append(
        Line(
            "spacer_disk",
            "fifteen load cases, ten disks, model CC: mean tip error, % of length",
            "%",
            float(np.linalg.norm(arc - reference_mm, axis=1).mean() / LENGTH_MM * 100.0),
            None,
            "the same solver; CC takes the tendons for fully constrained",
        )
    )
    plots.convergence(means, folder / "spacer_disk_convergence.png")
    return Validation(tuple(lines), ())


def reference_tips(disks: int) -> tuple[Array, Array]:
    """Return tensions (r, 4) [N] and tips (r, 3) [mm] of the independent solver for `disks` a segment."""
    path = assets_folder() / "reference" / "spacer_disk_tip_poses.csv"
    with path.open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if int(row["n"]) == disks]
    tensions = np.array([[float(row[f"T{k}_N"]) for k in range(1, 5)] for row in rows])
    tips = np.array([[float(row[f"p{axis}_m"]) for axis in "xyz"] for row in rows]) * 1e3
    loaded = tensions.any(axis=1)
    return tensions[loaded], tips[loaded]


def _mean_error_percent(links: int, tensions: Array, reference_mm: Array) -> float:
    """Return the chain's mean tip error over the reference's load cases [% of length]."""
    robot = benchmark_robot(links=links)
    ours = tips(robot, SIMULATION, TIP_FORCES_N["none"]).p_w * 1e3
    share = np.round(tensions / largest_tension_N(robot))
    cases = [int(np.flatnonzero((row == SETS).all(axis=1))[0]) for row in share]
    return float(np.linalg.norm(ours[cases] - reference_mm, axis=1).mean() / LENGTH_MM * 100.0)
