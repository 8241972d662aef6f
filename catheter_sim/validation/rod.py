"""The chain of hinges as a rod in space: shapes under loads, turned problems, a released tip.

SoRoSim's shapes (`assets/reference/sorosim`) are of a TPU rod, computed by another program; the chain takes
the rod's weight at the middles of its links. What carries no source here is beam theory.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from catheter_sim.core.loads import LinkForce
from catheter_sim.core.posture import Array
from catheter_sim.core.robot import Dynamics, Friction
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.resources import assets_folder
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation.lines import Line, Validation

NAME = "spacer_disk"
LENGTH_M, RADIUS_M, YOUNG_PA, POISSON, DENSITY = 0.4, 5e-3, 70e6, 0.4, 1200.0
LINKS = 50
EVERY = 50  # of the 500 shapes
FROM_FILE = [1, 2, 0]  # base frame's x, y, z are the file's y, z, x
FIRST_ROOT = 1.8751040687  # of cos(b) cosh(b) = -1: a cantilever's first mode
RELEASE_LINKS, RELEASE_STEP_S, RELEASE_N = 200, 1e-3, 2e-3


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


def tpu_rod(links: int = LINKS, mass_kg: float = 1e-3, dynamics: Dynamics | None = None) -> ContinuumRobot:
    """Return the TPU rod as a robot with a tendon that nobody pulls; `settled` applies its weight."""
    second_moment = math.pi / 4.0 * RADIUS_M**4
    bending = YOUNG_PA * second_moment
    rod = Segment(
        name="rod",
        length_m=LENGTH_M,
        disks=links,
        outer_radius_m=RADIUS_M,
        bending_stiffness_N_m2=bending,
        mass_kg=mass_kg,
        torsion_stiffness_N_m2=bending / (1.0 + POISSON),
    )
    tendons = (Tendon("1", 0.8 * RADIUS_M, 0.0, "rod"),)
    return ContinuumRobot(
        name="tpu_rod",
        description="rod of TPU",
        segments=(rod,),
        tendons=tendons,
        friction=Friction(0.0),
        dynamics=dynamics or Dynamics(),
    )


def mass_kg() -> float:
    """Return the rod's mass [kg]."""
    return DENSITY * math.pi * RADIUS_M**2 * LENGTH_M


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


def settled(simulator: Simulator, case: RodCase, turn: Array | None = None) -> tuple[Array, Array]:
    """Return the stations' places, shape (s, 3) [m], and the tip's orientation, shape (3, 3), at rest.

    Args:
        simulator: of `tpu_rod`.
        case: what acts.
        turn: by which all loads are turned, shape (3, 3); default: none.
    """
    R = np.eye(3) if turn is None else turn
    links = len(simulator.posture().p_w)
    weight = R @ (mass_kg() / links * case.gravity)
    middle = links // 2
    mid_force, mid_moment = (R @ vector for vector in case.wrenches[0])
    reach = 0.5 * LENGTH_M / links  # from a link's hinge, its middle, to its distal face
    others = [LinkForce(k, (0.0, 0.0, 0.0), _plain(weight)) for k in range(1, links + 1)]
    others.append(LinkForce(middle, (0.0, 0.0, reach), _plain(mid_force), _plain(mid_moment)))
    tip_force, tip_moment = (R @ vector for vector in case.wrenches[1])
    simulator.reset()
    simulator.set_inputs(np.zeros(1), tip_force, tip_moment, others)
    simulator.settle(60.0)
    posture = simulator.posture()
    return _stations(posture.p_w, posture.R_w, case.places), posture.R_w[-1]


def shape_errors_percent(simulator: Simulator, cases: list[RodCase]) -> Array:
    """Return each case's mean and largest distance of a station, shape (c, 2) [% of the length]."""
    found = []
    for case in cases:
        away = np.linalg.norm(settled(simulator, case)[0] - case.points, axis=1) / LENGTH_M * 100.0
        found.append((away.mean(), away.max()))
    return np.array(found)


def first_frequency_hz() -> float:
    """Return the frequency at which the simulated rod swings when its tip is let go [Hz]."""
    bent = Simulator(tpu_rod(RELEASE_LINKS), inertia=False)
    bent.set_inputs(np.zeros(1), (RELEASE_N, 0.0, 0.0))
    bent.settle(60.0)
    light = Dynamics(RELEASE_STEP_S, 1e-5, 1e-6)
    simulator = Simulator(tpu_rod(RELEASE_LINKS, mass_kg(), light))
    simulator.data.qpos[:] = bent.data.qpos
    steps = round(2.2 / beam_frequency_hz() / RELEASE_STEP_S)
    tip = np.empty(steps)
    for step in range(steps):
        simulator.step()
        tip[step] = simulator.data.site("tip").xpos[0]
    down = np.flatnonzero((tip[:-1] > 0.0) & (tip[1:] <= 0.0))
    crossing = down + tip[down] / (tip[down] - tip[down + 1])
    return float(1.0 / ((crossing[1] - crossing[0]) * RELEASE_STEP_S))


def beam_frequency_hz() -> float:
    """Return a cantilever's first natural frequency by Euler and Bernoulli [Hz]."""
    bending = YOUNG_PA * math.pi / 4.0 * RADIUS_M**4
    return FIRST_ROOT**2 / (2.0 * math.pi) * math.sqrt(bending / (mass_kg() / LENGTH_M)) / LENGTH_M**2


def validate_rod(folder: Path) -> Validation:
    """Check the chain of hinges as a rod in space; nothing is written."""
    simulator = Simulator(tpu_rod(), inertia=False)
    cases = rod_cases()
    errors = shape_errors_percent(simulator, cases)
    source = "SoRoSim (OpenCR-MuJoCo project, MIT)"
    what = f"TPU rod, {len(cases)} shapes in space, {LINKS} links: distance, "
    turned = max(_turned_mm(simulator, cases[0], angle) for angle in (30.0, 45.0, 90.0))
    theory, swung = beam_frequency_hz(), first_frequency_hz()
    lines = (
        Line(NAME, what + "mean over shape and cases", "%", float(errors[:, 0].mean()), 0.3, source),
        Line(NAME, what + "worst point of all", "%", float(errors[:, 1].max()), 1.5, source),
        Line(NAME, "TPU rod, all loads turned by 30, 45, 90 deg: tip", "mm", turned, 0.1, "isotropy"),
        Line(
            NAME,
            f"TPU rod, {RELEASE_LINKS} links, tip let go: first frequency",
            "Hz",
            abs(swung - theory),
            0.01 * theory,
            "Euler-Bernoulli cantilever",
            ours=swung,
            analytic=theory,
        ),
    )
    return Validation(lines, ())


def _turned_mm(simulator: Simulator, case: RodCase, angle_deg: float) -> float:
    """Return how far the tip is from the turned tip when all loads are turned about z [mm]."""
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    straight, _ = settled(simulator, case)
    turned, _ = settled(simulator, case, R)
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
