"""The modelling benchmark's discussion: times, helical tendons, readings (Rao et al. 2021)."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.robots.continuum import lumped
from catheter_sim.robots.continuum.lumped_kernels import LINKS
from catheter_sim.robots.continuum.rods import RodProblem, load, problem
from catheter_sim.robots.continuum.solvers import solver_call
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation import pictures
from catheter_sim.validation.lines import (
    ASSUMED,
    FITTED,
    NO_GRAVITY,
    OUT_OF_REACH,
    PREDICTED,
    VERIFIED,
    Line,
    Validation,
    given,
)
from catheter_sim.validation.spacer_disk import (
    LENGTH_MM,
    NEAR_BUCKLING,
    SETS,
    TIP_FORCES_N,
    Tips,
    benchmark_robot,
    errors,
    largest_tension_N,
    rigid_along,
    tips,
)

# ----------------------------------------------------------------------------------------------------
# Tendons that wind about the backbone, against VC (Rao et al. 2021, Section 10: named for future work).
#
# The simulated robot has its holes turned from disk to disk (`rest_twist_rad_per_m`), its tendons straight
# between them. VC holds a tendon to its path everywhere; without loads it needs no boundary conditions:
# what the tendons beyond a section pull, the backbone there balances, so that
#
# u = K^-1 (-sum r x T t), t = (e3 + u x r + r') / |...|
#
# in the section's own frame, r(s) the hole; K of bending and torsion, a backbone that neither stretches nor
# shears, as the chain's. Written here for this comparison alone; with many disks both must agree.

NAME = "spacer_disk"
TURN_RAD = math.pi  # of the holes from base to tip
STEPS = 400
HELIX_DISKS = (5, 10)
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

    `twisted`: factor of the twist that VC is told.
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
    away = [distance_percent(disks) for disks in HELIX_DISKS]
    lines = [
        Line(
            NAME,
            f"{start}, {disks} disks: tip of the simulation to VC",
            "%",
            found,
            PERCENT if disks == HELIX_DISKS[-1] else None,
            source,
        )
        for disks, found in zip(HELIX_DISKS, away, strict=True)
    ]
    order = math.log2(away[0] / away[1]) / math.log2(HELIX_DISKS[1] / HELIX_DISKS[0])
    what = f"{start}: order of convergence in disks"
    lines.append(Line(NAME, what, "-", abs(order - 2.0), ORDER, source, order, 2.0))
    return lines


# ----------------------------------------------------------------------------------------------------
# Times of the modelling benchmark's solvers (Rao et al. 2021, Figs 10C, 11C and 11F).
#
# As in the paper one configuration, tendons 1 and 3, from a straight start; with a tip force both halved.
# Solvers alone (`robots.continuum.solvers`), the median of many calls in which all take turns, processor's
# time. The paper's are of a C++ program on an Intel Core i5-9600 at 3.10 GHz, means of 100. Times hang on
# machine and implementation and are shown; judged are those of the paper's claims about them that lie far
# from 1.

TIMED_MODELS = ("CC", "CC_sub", "PRB", "VC", "VC_ref")
TIMED_DISKS = (1, 2, 3, 5, 8, 10, 13)
CONFIGURATION = 5  # of `SETS`: tendons 1 and 3
ROUNDS, REPEATS = 15, 4  # turns, and calls in each
CC_US, CC_SUB_LOADED_MS = 2.7, 10.0  # printed
PATH_ROWS = 7
OTHER_SIDE = 10  # of `SETS`: tendons 2 and 4
FAR = 0.2  # CC's time over that of the next model
_CLOCK = "a clock on this machine; the paper's is of C++ on an i5-9600"

Name = TypeVar("Name", bound=Hashable)
Times = Mapping[str, float]  # of one configuration, by model [s]


def validate_solver_times(folder: Path) -> Validation:
    """Show the times and check the claims; nothing is written."""
    by_disks = times_by_disks()
    loaded = {where: times(10, where, 0.5) for where in ("in plane", "across")}
    return Validation((*shown_lines(by_disks, loaded), *claim_lines(by_disks), warm_line()), ())


def times_by_disks() -> Mapping[int, Times]:
    """Return the times without a tip force at every number of disks, all in the same turns: what else the
    machine does meanwhile falls on all of them."""
    calls = {(disks, model): call for disks in TIMED_DISKS for model, call in solvers(disks, "none").items()}
    spent = taken_s(calls)
    return {disks: {model: spent[at, model] for at, model in calls if at == disks} for disks in TIMED_DISKS}


def times(disks: int, where: str, share: float = 1.0) -> Times:
    """Return the solvers' times of one configuration; arguments as for `solvers`."""
    return taken_s(solvers(disks, where, share))


def solvers(disks: int, where: str, share: float = 1.0) -> dict[str, Callable[[], object]]:
    """Return the solvers of one configuration, by model, those left out that do not carry its load.

    Args:
        disks: a segment.
        where: of `TIP_FORCES_N`.
        share: of both T_M and the tip force.
    """
    robot = benchmark_robot(disks)
    tension = share * SETS[CONFIGURATION] * largest_tension_N(robot)
    inputs = given(tension[None], "tension", share * np.array([TIP_FORCES_N[where]]))
    found = {model: solver_call(model, robot, inputs, NO_GRAVITY) for model in TIMED_MODELS}
    return {model: call for model, call in found.items() if call is not None}


def taken_s(calls: Mapping[Name, Callable[[], object]]) -> dict[Name, float]:
    """Return each call's median time over rounds in which all take turns [s]; the first of each is no part
    of it."""
    for call in calls.values():
        call()
    spent: dict[Name, list[float]] = {name: [] for name in calls}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            began = time.process_time()
            for _ in range(REPEATS):
                call()
            spent[name].append((time.process_time() - began) / REPEATS)
    return {name: statistics.median(values) for name, values in spent.items()}


def shown_lines(by_disks: Mapping[int, Times], loaded: Mapping[str, Times]) -> list[Line]:
    """Return every time beside what is printed of it."""
    lines = [_order(where, found) for where, found in loaded.items()]
    for disks, found in by_disks.items():
        for model, spent in found.items():
            printed = CC_US * 1e-3 if model == "CC" else None
            lines.append(_time(f"no tip force, {disks} disks, {model}", spent, printed, "Fig. 10C"))
    for where, found in loaded.items():
        figure = "Fig. 11C" if where == "in plane" else "Fig. 11F"
        for model, spent in found.items():
            printed = CC_SUB_LOADED_MS if model == "CC_sub" else None
            lines.append(_time(f"tip force {where}, 10 disks, {model}", spent, printed, figure))
    return lines


def claim_lines(by_disks: Mapping[int, Times]) -> list[Line]:
    """Return the paper's claims about the times without load as ratios."""
    fastest = max(
        found["CC"] / min(found[m] for m in TIMED_MODELS if m != "CC") for found in by_disks.values()
    )
    slower = min(found["PRB"] / found["VC"] for disks, found in by_disks.items() if disks > 4)
    grown = by_disks[13]["PRB"] / by_disks[2]["PRB"]
    coarse = by_disks[1]["VC_ref"] / by_disks[3]["VC_ref"]
    source = "Rao 2021, Section 8.1; " + _CLOCK
    claims = (
        (
            "solver times, 1 to 13 disks: CC over the next fastest, largest",
            fastest,
            fastest,
            FAR,
            "by far the fastest",
        ),
        (
            "solver times, more than 4 disks: PRB over VC, least",
            slower,
            max(1.0 - slower, 0.0),
            0.0,
            "slower for n > 4",
        ),
        ("solver times: PRB at 13 disks over 2", grown, max(1.0 - grown, 0.0), 0.0, "grows with the disks"),
        ("solver times: VC_ref at 1 disk over 3", coarse, max(1.0 - coarse, 0.0), 0.0, "longer for n < 3"),
    )
    return [
        Line(NAME, what, "-", error, most, source, ours, kind=PREDICTED, said=said)
        for what, ours, error, most, said in claims
    ]


def warm_line() -> Line:
    """Return what VC_ref takes along a path, each point from the one before, over straight starts (Section
    9.2).

    The points of the other run change sides each time, so that each is far from the one before; by symmetry
    they are as hard. Both are solved in one call of fewer rows than go together.
    """
    robot = benchmark_robot()
    shares = np.linspace(0.9, 1.0, PATH_ROWS)[:, None] * largest_tension_N(robot)
    sides = np.where(np.arange(PATH_ROWS)[:, None] % 2, SETS[OTHER_SIDE], SETS[CONFIGURATION])
    calls = {}
    for name, pulled in (("along", SETS[CONFIGURATION]), ("far", sides)):
        call = solver_call("VC_ref", robot, given(shares * pulled, "tension"), NO_GRAVITY)
        assert call is not None
        calls[name] = call
    spent = taken_s(calls)
    ratio = spent["along"] / spent["far"]
    what = f"solver times, VC_ref, a path of {PATH_ROWS} points: from the point before over from straight"
    source = "Rao 2021, Section 9.2: shorter, without a figure"
    return Line(NAME, what, "-", max(ratio - 1.0, 0.0), None, source, ratio)


def _order(where: str, found: Times) -> Line:
    ratio = min(found["PRB"], found["VC_ref"]) / max(found["CC_sub"], found["VC"])
    what = (
        f"solver times, tip force {where}, 10 disks: the faster of PRB and VC_ref over the slower of CC_sub "
        "and VC"
    )
    source = (
        "Rao 2021, Section 8.2: an order of magnitude; hangs on the implementation: ours follow the reference"
    )
    return Line(NAME, what, "-", abs(ratio - 10.0), None, source, ratio, None, 10.0, OUT_OF_REACH)


def _time(what: str, spent_s: float, printed_ms: float | None, figure: str) -> Line:
    ours = spent_s * 1e3
    gap = float("nan") if printed_ms is None else abs(ours - printed_ms)
    return Line(
        NAME,
        f"time of one configuration, solver alone, {what}",
        "ms",
        gap,
        None,
        f"Rao 2021, {figure}; {_CLOCK}",
        ours,
        None,
        printed_ms,
        OUT_OF_REACH,
    )


# ----------------------------------------------------------------------------------------------------
# The modelling benchmark's Discussion, worked out (Rao et al. 2021, Sections 9.1 to 9.3).
#
# Tendons in lumens: VC is then the reference. One force a disk or two: the same section moments, where the
# tip's load is carried on. Each model calibrated to the reference: by its own bending stiffness.

LUMEN_DISKS = (1, 2, 3, 5, 10)
CALIBRATED_AT = (3, 10)  # disks
FIGURE_9 = {"1": (0, 0, 0, 0), "2": (1, 0, 1, 0), "3": (0, 0, 1, 0), "4": (1, 0, 0, 1), "5": (1, 0, 0, 0)}
FIGURE_9_DISKS = (3, 10)
FIGURE_9_MODELS = ("CC", "CC_sub", "PRB", "VC", "VC_ref")
_RELATIVE = 1e-9  # of the largest moment: rounding


def validate_readings(folder: Path) -> Validation:
    """Check and show what the Discussion leaves open; draws `tdcr_shapes.png` (Fig. 9)."""
    lines = [*one_disk_lines(), *lumen_lines(), *force_lines(), *calibrated_lines(), *helix_lines()]
    pictures.model_shapes(shapes(), folder / "tdcr_shapes.png")
    return Validation(tuple(lines), ())


def one_disk_lines() -> list[Line]:
    """Return what was tried to come to the printed errors at one disk, beside them (Section 8.1)."""
    robot, lines = benchmark_robot(1), []
    force = TIP_FORCES_N["none"]
    few = np.isin(np.arange(len(SETS)), NEAR_BUCKLING)
    rigid = rigid_along(robot)
    for model, printed in (("VC", 9.12), ("PRB", 0.47)):
        found = tips(robot, model, force)
        against = {name: errors(found, tips(robot, name, force))[0] for name in ("VC_ref", "VC_ref_noproj")}
        stiff = errors(tips(rigid, model, force), tips(rigid, "VC_ref", force))[0]
        away = against["VC_ref"]
        tried = {
            "reference without Eq. 58": against["VC_ref_noproj"].mean(),
            "backbone that neither stretches nor shears": stiff.mean(),
            "sets 7, 11, 13, 14 left out of the mean": away[~few].mean(),
            "the same counted as zero, the straight set left out": np.where(few, 0.0, away)[1:].mean(),
            "median of the sets": np.median(away),
            "tensions of 0.58 T_M": _otherwise(model, 1, 0.58),
            "eyelets at twice r_d, T_M with it": _otherwise(model, 1, 0.5, 2.0),
        }
        for how, ours in tried.items():
            what = f"scenario 1, 1 disks, {model}: mean tip position error, tried with {how}"
            gap = abs(float(ours) - printed)
            lines.append(
                Line(NAME, what, "%", gap, None, "Rao 2021, Section 8.1", float(ours), None, printed, ASSUMED)
            )
    return [*lines, *_ten_disk_lines()]


def _ten_disk_lines() -> list[Line]:
    """Return what the two nearest readings at one disk give at ten, where 0.16 % is printed."""
    lines = []
    for how, ours in (
        ("tensions of 0.58 T_M", _otherwise("VC", 10, 0.58)),
        ("eyelets at twice r_d, T_M with it", _otherwise("VC", 10, 0.5, 2.0)),
    ):
        what = f"scenario 1, 10 disks, VC: mean tip position error, tried with {how}"
        why = "Rao 2021, Section 8.1; a reading that comes near at one disk and not here"
        lines.append(Line(NAME, what, "%", abs(ours - 0.16), None, why, ours, None, 0.16, ASSUMED))
    return lines


def _otherwise(model: str, disks: int, tension: float = 1.0, radius: float = 1.0) -> float:
    """Return a model's mean error of position over the sixteen sets with other tensions or eyelets [%]."""
    robot = benchmark_robot(disks)
    tendons = tuple(replace(item, radius_m=radius * item.radius_m) for item in robot.tendons)
    rows = given(tension * SETS * largest_tension_N(robot), "tension")
    runs = [
        STATIC_MODELS[name].solve(replace(robot, tendons=tendons), rows, NO_GRAVITY).postures
        for name in (model, "VC_ref")
    ]
    found, reference = (np.array([posture.p_w[-1] for posture in run]) for run in runs)
    return float(np.linalg.norm(found - reference, axis=1).mean() / LENGTH_MM * 1e5)


def lumen_lines() -> list[Line]:
    """Return the errors of models with tendons straight between disks against VC, without load."""
    lines = []
    for disks in LUMEN_DISKS:
        robot = benchmark_robot(disks)
        reference = tips(robot, "VC", TIP_FORCES_N["none"])
        for model in ("CC_sub", "PRB"):
            ours = float(errors(tips(robot, model, TIP_FORCES_N["none"]), reference)[0].mean())
            what = f"tendons in lumens (VC the reference), {disks} disks, {model}: mean tip position error"
            source = "Rao 2021, Section 9.2, without a figure"
            kind, said = VERIFIED, ""
            if disks == 3:
                source = "Rao 2021, Section 9.2. How near is not printed: Fig. 10 has 1.7 to 2.1 % at n = 3"
                kind, said = ASSUMED, "accurate from n = 3"
            lines.append(Line(NAME, what, "%", ours, None, source, ours, kind=kind, said=said))
    return lines


def section_moments(rod: RodProblem, tension_N: Array, force_N: Array, p_w: Array, R_w: Array) -> Array:
    """Return the moment about every subsegment's base, one force a tendon there, shape (n, 3) [N m].

    Each tendon pulls once, at the hole of the disk beyond and toward the one before; the tip's load is
    carried on.

    Args:
        rod: the robot.
        tension_N: shape (t,).
        force_N: on the tip, shape (3,).
        p_w, R_w: of disks 0 to n.
    """
    moments = np.cross(p_w[-1] - p_w[:-1], force_N)
    holes = p_w[:, None] + np.einsum("jab,tjb->jta", R_w[:, :, :2], rod.hole_m)
    for j in range(len(rod.length_m)):
        for t in np.flatnonzero(rod.last_disk > j):
            span = holes[j, t] - holes[j + 1, t]
            pull = tension_N[t] * span / np.linalg.norm(span)
            moments[j] += np.cross(holes[j + 1, t] - p_w[j], pull)
    return moments


def force_lines() -> list[Line]:
    """Return how far one force a disk and two are apart, with and without Eq. 58, with and without a tip
    force."""
    lines = []
    robot = benchmark_robot()
    rod = problem(robot)
    tension = 0.5 * SETS[5] * largest_tension_N(robot)
    for where in ("none", "across"):
        force = np.array(TIP_FORCES_N[where])
        loads = load(rod, given(tension[None], "tension", force[None]), NO_GRAVITY)
        for projected in (False, True):
            found = lumped.equilibria(rod, loads, LINKS, projected=projected)
            two = found.wrench[0, :, 3:]
            one = section_moments(rod, tension, force, found.p_w[0], found.R_w[0])
            apart = float(np.abs(one - two).max() / np.abs(two).max())
            text = "no tip force" if where == "none" else f"tip force {where}"
            eq_58 = "with Eq. 58" if projected else "without Eq. 58"
            what = f"one force a disk or two, {text}, {eq_58}: section moments apart, of the largest"
            source = (
                "Rao 2021, Section 9.1, first question: the spans' pulls on one disk cancel along the robot"
            )
            most = None if projected else _RELATIVE
            lines.append(Line(NAME, what, "-", apart, most, source))
    return lines


def calibrated_lines() -> list[Line]:
    """Return each model's error against VC_ref, as it is and with the bending stiffness that suits it
    best."""
    lines = []
    for disks in CALIBRATED_AT:
        robot = benchmark_robot(disks)
        rows = SETS * largest_tension_N(robot)
        reference = tips(robot, "VC_ref", TIP_FORCES_N["none"])
        for model in ("CC", "CC_sub", "PRB", "VC"):
            nominal, best, factor = calibrated(robot, model, rows, reference)
            what = f"{disks} disks, {model} calibrated to VC_ref"
            source = "Rao 2021, Section 9.2, proposed and not done; one number is fitted, all 16 sets"
            lines += [
                Line(
                    NAME,
                    f"{what}: bending stiffness over nominal",
                    "-",
                    abs(factor - 1.0),
                    None,
                    source,
                    factor,
                    kind=FITTED,
                ),
                Line(
                    NAME,
                    f"{what}: mean tip position error",
                    "%",
                    best,
                    None,
                    source,
                    best,
                    nominal,
                    kind=FITTED,
                ),
            ]
    return lines


def calibrated(
    robot: ContinuumRobot, model: str, rows_N: Array, reference: Tips
) -> tuple[float, float, float]:
    """Return the mean error as it is and at best [%], and the stiffness factor of the best."""

    def error(factor: float) -> float:
        scaled = replace(robot, stiffness_scale=factor)
        run = STATIC_MODELS[model].solve(scaled, given(rows_N, "tension"), NO_GRAVITY)
        p_w = np.array([posture.p_w[-1] for posture in run.postures])
        R_w = np.array([posture.R_w[-1] for posture in run.postures])
        return float(errors(Tips(p_w, R_w, 0.0), reference)[0].mean())

    found = minimize_scalar(error, bounds=(0.8, 1.25), method="bounded", options={"xatol": 1e-5})
    return error(1.0), float(found.fun), float(found.x)


def shapes() -> dict[int, dict[str, dict[str, Array]]]:
    """Return the backbones of Fig. 9 by disks, configuration and model, each (n + 1, 3) [mm]."""
    found: dict[int, dict[str, dict[str, Array]]] = {}
    for disks in FIGURE_9_DISKS:
        robot = benchmark_robot(disks)
        rows = np.array(list(FIGURE_9.values()), dtype=float) * largest_tension_N(robot)
        found[disks] = {name: {} for name in FIGURE_9}
        for model in FIGURE_9_MODELS:
            postures = STATIC_MODELS[model].solve(robot, given(rows, "tension"), NO_GRAVITY).postures
            for name, posture in zip(FIGURE_9, postures, strict=True):
                found[disks][name][model] = np.vstack([np.zeros(3), posture.p_w]) * 1e3
    return found
