"""The chain of hinges as a rod in space: shapes under loads, turned problems.

SoRoSim's shapes (`assets/reference/sorosim`) are of a TPU rod, computed by another program. Its motion is in
`rod_motion`.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.loads import LinkForce
from catheter_sim.core.robot import Dynamics, Friction
from catheter_sim.resources import assets_folder
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation.lines import Line, Validation

NAME = "spacer_disk"
LENGTH_M, RADIUS_M, YOUNG_PA, POISSON, DENSITY = 0.4, 5e-3, 70e6, 0.4, 1200.0
LINKS = 50
EVERY = 50  # of the 500 shapes
FROM_FILE = [1, 2, 0]  # base frame's x, y, z are the file's y, z, x
BENDING_N_M2 = YOUNG_PA * math.pi / 4.0 * RADIUS_M**4
MASS_KG = DENSITY * math.pi * RADIUS_M**2 * LENGTH_M


@dataclass(frozen=True)
class RodCase:
    """One shape of the file, base frame, SI units.

    Attributes:
        gravity: shape (3,).
        wrenches: force and moment at mid-length and at the tip, shape (2, 2, 3).
        places: of the stations along the rod, shape (s,).
        points: of the stations, shape (s, 3).
    """

    gravity: Array
    wrenches: Array
    places: Array
    points: Array


def tpu_rod(links: int = LINKS, dynamics: Dynamics | None = None) -> ContinuumRobot:
    """Return the TPU rod as a robot without tendons."""
    rod = Segment(
        name="rod",
        length_m=LENGTH_M,
        disks=links,
        outer_radius_m=RADIUS_M,
        bending_stiffness_N_m2=BENDING_N_M2,
        mass_kg=MASS_KG,
        torsion_stiffness_N_m2=BENDING_N_M2 / (1.0 + POISSON),
    )
    return ContinuumRobot(
        name="tpu_rod",
        description="rod of TPU",
        segments=(rod,),
        friction=Friction(0.0),
        dynamics=dynamics or Dynamics(),
    )


def rod_cases(every: int = EVERY) -> list[RodCase]:
    """Return every so-many-th shape of the file."""
    path = assets_folder() / "reference" / "sorosim" / "tpu_statics.csv"
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    within = np.array([float(value) for value in rows[1][4:]])
    places = 0.5 * LENGTH_M * (within + np.repeat([0.0, 1.0], len(within) // 2))
    values = np.array([[float(value) for value in row[1:]] for row in rows[2:]])
    shapes = values.reshape(-1, 2, 3, values.shape[1])[:, :, FROM_FILE]  # (case, Eul or P, axis, column)
    cases = []
    for turns, positions in shapes[::every]:
        wrenches = np.array([[positions[:, k], turns[:, k]] for k in (1, 2)])
        cases.append(RodCase(positions[:, 0], wrenches, places, positions[:, 3:].T))
    return cases


def settled(robot: ContinuumRobot, case: RodCase, turn: Array | None = None) -> tuple[Array, Array]:
    """Return the stations' places, shape (s, 3) [m], and the tip's orientation, shape (3, 3), at rest.

    Args:
        robot: `tpu_rod`.
        case: what acts.
        turn: by which all loads are turned, shape (3, 3); default: none.
    """
    R = np.eye(3) if turn is None else turn
    simulator = Simulator(robot, gravity_mps2=R @ case.gravity, inertia=False)
    (mid_force, mid_moment), (tip_force, tip_moment) = ((R @ f, R @ m) for f, m in case.wrenches)
    others = [LinkForce(robot.segments[0].disks // 2, None, _plain(mid_force), _plain(mid_moment))]
    simulator.set_inputs(np.zeros(0), tip_force, tip_moment, others)
    simulator.settle(60.0)
    posture = simulator.posture()
    return _stations(posture.p_w, posture.R_w, case.places), posture.R_w[-1]


def shape_errors_percent(robot: ContinuumRobot, cases: list[RodCase]) -> Array:
    """Return each case's mean and largest distance of a station, shape (c, 2) [% of the length]."""
    found = []
    for case in cases:
        away = np.linalg.norm(settled(robot, case)[0] - case.points, axis=1) / LENGTH_M * 100.0
        found.append((away.mean(), away.max()))
    return np.array(found)


def validate_rod(folder: Path) -> Validation:
    """Check the chain of hinges as a rod in space; nothing is written."""
    robot = tpu_rod()
    cases = rod_cases()
    errors = shape_errors_percent(robot, cases)
    source = "SoRoSim (OpenCR-MuJoCo project, MIT)"
    what = f"TPU rod, {len(cases)} shapes in space, {LINKS} links: distance, "
    turned = max(_turned_mm(robot, cases[0], angle) for angle in (30.0, 45.0, 90.0))
    lines = (
        Line(NAME, what + "mean over shape and cases", "%", float(errors[:, 0].mean()), 0.02, source),
        Line(NAME, what + "worst point of all", "%", float(errors[:, 1].max()), 0.1, source),
        Line(NAME, "TPU rod, all loads turned by 30, 45, 90 deg: tip", "mm", turned, 0.1, "isotropy"),
    )
    return Validation(lines, ())


def _turned_mm(robot: ContinuumRobot, case: RodCase, angle_deg: float) -> float:
    """Return how far the tip is from the turned tip when all loads are turned about z [mm]."""
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    straight, _ = settled(robot, case)
    turned, _ = settled(robot, case, R)
    return float(np.linalg.norm(turned[-1] - R @ straight[-1])) * 1e3


def _stations(p_w: Array, R_w: Array, places: Array) -> Array:
    """Return points of the chain at distances along it: each link is straight on both sides of its hinge."""
    links = len(p_w)
    half = 0.5 * LENGTH_M / links
    points = []
    for place in places:
        link = int(np.clip(round(place / LENGTH_M * links), 0, links))
        if link == 0:
            points.append(np.array([0.0, 0.0, place]))
            continue
        # the face of link k is at k h; a point within half a link of it lies on the same straight piece
        points.append(p_w[link - 1] + R_w[link - 1][:, 2] * (place - 2.0 * half * link))
    return np.array(points)


def _plain(vector: Array) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
