"""A real tentacle, soft and tapered: its static error with its makers' numbers, and what effects take away.

It is no robot file: its tendons come closer to its axis along the way, and its markers stand beside it. So
its model stands here: the arcs of the analytic twin, one for each stretch between markers, with arms and
stiffness that fall along it, hanging under gravity. Shapes are static and each counts by itself.
"""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catheter_sim.core.effect import Parameter
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.diagnosis.comparison import pays
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.noise import errors_of
from catheter_sim.diagnosis.nuisance import Nuisance
from catheter_sim.diagnosis.problem import Problem, terms_for
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.effects.apply import arriving_inputs, with_built_in_effects
from catheter_sim.mechanics.arcs import points_on_arcs
from catheter_sim.robots.continuum.arcs import solve_rows
from catheter_sim.robots.continuum.constant_curvature import arc_robots, loads
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.tables import Table

pytestmark = pytest.mark.slow

FILE = Path(__file__).resolve().parents[1] / "data" / "soromox_tentacle" / "shapes.csv"
MODULUS_PA, DENSITY_KG_PER_M3 = 0.505e6, 1500.0
RADII_M = ((0.0, 15.41e-3), (0.305, 6.42e-3), (0.360, 4.80e-3))
TENDON_M, TAPER, TENDONS_END_M = 11.4e-3, 29.5e-3, 0.305
ENDS_M = (0.06455, 0.1291, 0.1743, 0.2195, 0.25, 0.28, TENDONS_END_M, 0.33, 0.36)
MARKED = np.array([1, 3, 5, 8])  # stretches that end at a marker
MARKERS = ("s0.1291", "s0.2195", "s0.2800", "tip")
COLUMNS = tuple(f"{marker}_{axis}_mm" for marker in MARKERS for axis in "xyz")
DISKS = 4  # places where a stretch's weight acts
HANGING = np.array([0.0, 0.0, 9.81])
# z of the robot, y half way between its tendons, in the cameras' frame
MOUNTED = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
# Of effects that leave no history, since the order of the shapes is not known, and have few numbers, since
# the shapes are few: what a search by `select` takes first, in this order.
CHOSEN = ("actuation_gain", "nonlinear_stiffness", "axial_compression")


@dataclass(frozen=True)
class Tentacle(ContinuumRobot):
    """A robot with how its base is turned [rad] and where markers stand, on it and beside its axis [m]."""

    standing: tuple[float, ...] = (0.0,) * 18


def stretch(index: int) -> Segment:
    """Return a stretch with the mean compliance and the mass of what it stands for."""
    start, end = (0.0, *ENDS_M)[index : index + 2]
    radius = np.interp(np.linspace(start, end, 201), *np.transpose(RADII_M))
    bending = 1.0 / np.mean(4.0 / (math.pi * MODULUS_PA * radius**4))
    mass = DENSITY_KG_PER_M3 * math.pi * np.mean(radius**2) * (end - start)
    return Segment(f"stretch_{index}", end - start, DISKS, float(radius[0]), float(bending), float(mass))


TENTACLE = Tentacle(
    name="tentacle",
    description="",
    segments=tuple(stretch(index) for index in range(len(ENDS_M))),
    tendons=tuple(
        Tendon(f"tendon_{k}", TENDON_M, math.radians(angle), f"stretch_{ENDS_M.index(TENDONS_END_M)}")
        for k, angle in ((1, 30.0), (2, 150.0))
    ),
    friction=Friction(0.0),
)


def shapes(robots: Sequence[Tentacle], inputs: Inputs, every: int) -> np.ndarray:
    """Return where the markers stand from the base's, shape (B, r, 12) [mm]."""
    middle = 0.5 * (np.array(ENDS_M) + np.array((0.0, *ENDS_M[:-1])))
    narrower = 1.0 - TAPER / TENDON_M * middle
    found = []
    for robot in robots:
        arrived, body = arriving_inputs(robot, inputs), with_built_in_effects(robot)
        arcs = arc_robots([body])
        arcs = replace(arcs, arm=arcs.arm * narrower[:, np.newaxis])
        states = solve_rows(arcs, arrived.tendon[np.newaxis], True, loads([body], [arrived], HANGING))
        p_w, R_w = points_on_arcs(states.bend[0], arcs.length[0], MARKED, np.ones(len(MARKED)))
        p_w = p_w - states.shift[0][:, np.newaxis, np.newaxis] * np.array([0.0, 0.0, 1.0])
        turn, base, beside = np.split(np.array(robot.standing), (3, 6))
        seen = p_w - base + np.einsum("rmij,mj->rmi", R_w, beside.reshape(4, 3))
        found.append(
            1e3 * (seen @ (MOUNTED @ Rotation.from_rotvec(turn).as_matrix()).T).reshape(len(seen), 12)
        )
    return np.array(found)[:, ::every]


def standing(index: int, robot: Tentacle, value: float) -> Tentacle:
    """Return `robot` with one number of how it and its markers stand."""
    return replace(robot, standing=(*robot.standing[:index], value, *robot.standing[index + 1 :]))


def nuisance(index: int) -> Nuisance:
    """Return one of these numbers: 5 deg or 15 mm from zero in the spread."""
    spread = math.radians(5.0) if index < 3 else 15e-3
    parameter = Parameter(f"standing_{index}", 0.0, -5 * spread, 5 * spread, scale=0.1 * spread, start=0.0)
    return Nuisance(parameter, partial(standing, index), spread)


def problem(heldout: bool) -> Problem:
    """Return the fit of the model to every third shape, or to the others, errors in mm."""
    with FILE.open(newline="", encoding="utf-8") as file:
        rows = [row for index, row in enumerate(csv.DictReader(file)) if (index % 3 == 2) == heldout]
    tension = np.array([[float(row["tension1_N"]), float(row["tension2_N"])] for row in rows])
    columns = {
        name: np.array([float(row[name]) - float(row[f"base_{name[-4:]}"]) for row in rows])
        for name in COLUMNS
    }
    time_s, nothing = np.arange(len(rows), dtype=float), np.zeros((len(rows), 3))
    inputs = Inputs(time_s, "tension", tension, nothing, nothing)
    trial = Trial("shapes", "train", inputs, Table(time_s, columns, "shapes"))
    nuisances = tuple(nuisance(index) for index in range(18))
    return Problem(TENTACLE, nuisances, (trial,), COLUMNS, np.ones(len(COLUMNS)), shapes)


def distance_mm(result: Fit) -> float:
    """Return the root mean square distance of the markers from where they were measured, held out."""
    return float(np.sqrt(3.0 * np.mean(errors_of(problem(heldout=True), result) ** 2)))


def test_nearly_half_of_the_error_of_a_real_tentacle_has_names():
    """Its makers' numbers leave 19 mm of 360, held out; three causes that each pay in training leave 10 mm.

    Every shape was measured to 0.1 mm: most of what is left has no name here.
    """
    training = problem(heldout=False)
    terms = [terms_for(TENTACLE, name)[0] for name in CHOSEN]
    fits = [fit(training, ())]
    for count in range(1, len(terms) + 1):
        fits.append(fit(training, terms[:count], fits[-1].values))
    assert all(pays(before, after) for before, after in itertools.pairwise(fits))
    assert distance_mm(fits[0]) == pytest.approx(18.7, abs=0.1)  # as docs/truth/real_robots.md says
    assert distance_mm(fits[-1]) == pytest.approx(10.1, abs=0.1)
