"""The chain of hinges as a rod in space, at rest and in motion."""

from __future__ import annotations

import csv
import math
import time
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from scipy.optimize import brentq

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, LinkForce
from catheter_sim.core.robot import Dynamics, Friction
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.resources import assets_folder
from catheter_sim.robots.continuum.description import links
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation import pictures
from catheter_sim.validation.lines import Line, Validation

# ----------------------------------------------------------------------------------------------------
# The chain of hinges as a rod in space: shapes under loads, turned problems.
#
# SoRoSim's shapes (`assets/reference/sorosim`) are of a TPU rod, computed by another program. Its motion is
# in `rod_motion`.

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


def at_rest(robot: ContinuumRobot, case: RodCase, turn: Array | None = None) -> tuple[Array, Array]:
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
        away = np.linalg.norm(at_rest(robot, case)[0] - case.points, axis=1) / LENGTH_M * 100.0
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
    straight, _ = at_rest(robot, case)
    turned, _ = at_rest(robot, case, R)
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


# ----------------------------------------------------------------------------------------------------
# The chain of hinges as a rod in motion: a tip that is let go, natural frequencies, decay, energy.
#
# The releases are SoRoSim's (`assets/reference/sorosim/release`), of the TPU rod of `rod`. All else is beam
# theory, and of the model that `build` writes, stepped by MuJoCo alone.

RELEASES = range(1, 11)
LET_GO_S = 1e-9  # after the first row: at once
DAMPING_TIME_S = 0.003  # of the decay, eta / E; the releases have 3 to 5 ms
FREQUENCY_PERCENT = (0.1, 0.2, 0.4, 0.8)  # allowed of f1 to f4
TENSION_N = 1.0  # of both tendons together, 0.47 of what buckles the rod
SWING_N = 0.05  # across the tip: from 0.1 rad
ENERGY_S = 10.0


@dataclass(frozen=True)
class Release:
    """One release of the file, base frame, SI units.

    Attributes:
        damping_time_s: eta / E.
        gravity: shape (3,).
        wrenches: force and moment at mid-length and at the tip until it is let go, shape (2, 2, 3).
        time_s: shape (r,), the first at rest.
        points: of mid-length and tip, shape (r, 2, 3).
    """

    damping_time_s: float
    gravity: Array
    wrenches: Array
    time_s: Array
    points: Array


def release_case(number: int) -> Release:
    """Return release `number`, 1 to 10."""
    path = assets_folder() / "reference" / "sorosim" / "release" / f"release_{number}.csv"
    with path.open(newline="", encoding="utf-8") as file:
        rows = [
            [float(value) for value in row] for k, row in enumerate(csv.reader(file)) if k not in (0, 2, 4)
        ]
    table = np.array(rows[2:])
    wrenches = np.array(rows[1]).reshape(2, 2, 3)[:, ::-1, FROM_FILE]  # the file has moments first
    points = table[:, 1:].reshape(-1, 2, 3)[:, :, FROM_FILE]
    return Release(rows[0][0], np.array(rows[0][1:])[FROM_FILE], wrenches, table[:, 0], points)


def release_inputs(case: Release, count: int) -> Inputs:
    """Return what acts on `tpu_rod` of so many links: the wrenches at first, and nothing from then on."""
    rows = np.concatenate([[0.0, LET_GO_S], case.time_s[1:]])
    force, moment = np.zeros((2, len(rows), 2, 3))
    force[0], moment[0] = case.wrenches[:, 0], case.wrenches[:, 1]
    mid = (count // 2,)
    return Inputs(
        rows, "tension", np.zeros((len(rows), 0)), force[:, 1], moment[:, 1], mid, force[:, :1], moment[:, :1]
    )


def release_errors_percent(case: Release, count: int = LINKS) -> tuple[Array, float]:
    """Return the distances of mid-length and tip over time, shape (r, 2) [% of length], and the run's time.

    The latter is processor time over simulated time; what brings the rod to rest before is not in it.
    """
    robot = tpu_rod(count, Dynamics(damping_time_s=case.damping_time_s))
    started: list[float] = []
    run = simulate(
        robot,
        release_inputs(case, count),
        case.gravity,
        dynamic=True,
        on_row=lambda _, row: started.append(time.process_time()),
    )
    taken = (started[-1] - started[0]) / case.time_s[-1]
    places = np.array([posture.p_w[[count // 2 - 1, -1]] for posture in run.postures[1:]])
    return np.linalg.norm(places - case.points, axis=2) / LENGTH_M * 100.0, taken


def cantilever_root(mode: int) -> float:
    """Return b = beta L of a cantilever's mode (1 ...): cos(b) cosh(b) = -1 (Euler and Bernoulli)."""
    middle = (mode - 0.5) * math.pi
    return float(brentq(lambda b: math.cos(b) + 1.0 / math.cosh(b), middle - 0.5, middle + 0.5))


def cantilever_frequency_hz(mode: int) -> float:
    """Return a cantilever's natural frequency by Euler and Bernoulli [Hz]."""
    speed = math.sqrt(BENDING_N_M2 / (MASS_KG / LENGTH_M))
    return cantilever_root(mode) ** 2 * speed / (2.0 * math.pi * LENGTH_M**2)


def cantilever_curvature(mode: int, places: Array) -> Array:
    """Return the curvature of a cantilever's mode, of 1 at the base, at places along it [m]."""
    b = cantilever_root(mode)
    ratio = (math.cosh(b) + math.cos(b)) / (math.sinh(b) + math.sin(b))
    x = b * places / LENGTH_M
    return np.asarray(0.5 * (np.cosh(x) + np.cos(x) - ratio * (np.sinh(x) + np.sin(x))))


def tied_frequency_hz(tension_N: float) -> float:
    """Return the first frequency of a cantilever whose tip a straight tendon pulls toward its base [Hz].

    EI w'''' + N w'' = m (2 pi f)^2 w with w(0) = w'(0) = 0, w''(L) = 0, EI w'''(L) + N w'(L) = N w(L) / L:
    the force N points from the tip to the base. At f = 0 this is Euler's load pi^2 EI / L^2.
    """
    a, line_mass = tension_N / BENDING_N_M2, MASS_KG / LENGTH_M

    def determinant(f: float) -> float:
        root = math.sqrt(a * a + 4.0 * line_mass * (2.0 * math.pi * f) ** 2 / BENDING_N_M2)
        p, q = math.sqrt(0.5 * (root + a)), math.sqrt(0.5 * (root - a))
        c, s, ch, sh = (
            g(k * LENGTH_M) for g, k in ((math.cos, p), (math.sin, p), (math.cosh, q), (math.sinh, q))
        )
        # w = A (cosh q s - cos p s) + B (sinh q s / q - sin p s / p)
        moments = q * q * ch + p * p * c, q * sh + p * s
        first = q**3 * sh - p**3 * s + a * (q * sh + p * s) - a * (ch - c) / LENGTH_M
        second = q * q * ch + p * p * c + a * (ch - c) - a * (sh / q - s / p) / LENGTH_M
        return moments[0] * second - moments[1] * first

    return float(brentq(determinant, 0.05, cantilever_frequency_hz(1)))


def pulled_rod(disks: int) -> ContinuumRobot:
    """Return the rod with two tendons on opposite sides, held by so many disks, `LINKS` links in all."""
    rod = tpu_rod(LINKS)
    tendons = tuple(Tendon(name, 4e-3, angle, "rod") for name, angle in (("1", 0.0), ("2", math.pi)))
    segments = (replace(rod.segments[0], disks=disks),)
    return replace(rod, segments=segments, tendons=tendons, links_per_subsegment=LINKS // disks)


def swing(robot: ContinuumRobot, mode: int, frequency_hz: float, ctrl: float = 0.0) -> tuple[float, float]:
    """Return frequency [Hz] and rate of decay [1/s] of a mode, small, of what `build` writes.

    Args:
        robot: the rod; it swings toward y.
        mode: in whose shape it is let go.
        frequency_hz: near which it swings: eight looks a period over six periods.
        ctrl: of every actuator.
    """
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot, motion=True))
    data = mujoco.MjData(model)
    data.ctrl[:] = ctrl
    row = links(robot)
    turning = np.array([model.joint(f"y{link.index}").qposadr[0] for link in row])
    shape = cantilever_curvature(mode, np.array([link.hinge_z_m for link in row]))
    data.qpos[turning] = 1e-5 * shape
    every = max(1, round(1.0 / (8.0 * frequency_hz * model.opt.timestep)))
    seen = []
    for _ in range(48):
        seen.append(float(shape @ data.qpos[turning]))
        mujoco.mj_step(model, data, every)
    # a(t + d) = 2 e^(-r d) cos(w d) a(t) - e^(-2 r d) a(t - d)
    a, d = np.array(seen) * 1e5, every * model.opt.timestep
    ahead, behind = np.linalg.lstsq(np.stack([a[1:-1], a[:-2]], axis=1), a[2:], rcond=None)[0]
    rate = -math.log(-behind) / (2.0 * d)
    return math.acos(0.5 * ahead / math.sqrt(-behind)) / (2.0 * math.pi * d), rate


def energies(robot: ContinuumRobot, seconds: float) -> Array:
    """Return the energy every half second of a rod whose tip is let go, of that at first; by MuJoCo alone."""
    return energies_of(mujoco.MjModel.from_xml_string(build_mjcf(robot, motion=True)), robot, seconds)


def energies_of(model: mujoco.MjModel, robot: ContinuumRobot, seconds: float) -> Array:
    """`energies` in a model of the rod."""
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    for link in links(robot):  # as bent by a force across the tip, nearly
        data.qpos[model.joint(f"x{link.index}").qposadr[0]] = (
            SWING_N * (LENGTH_M - link.hinge_z_m) * link.length_m / BENDING_N_M2
        )
    found = []
    for _ in range(round(2.0 * seconds) + 1):
        mujoco.mj_forward(model, data)
        found.append(float(data.energy.sum()))
        mujoco.mj_step(model, data, round(0.5 / model.opt.timestep))
    return np.array(found) / found[0]


def validate_rod_motion(folder: Path) -> Validation:
    """Check the chain of hinges as a rod in motion; pictures go into `folder`."""
    errors, taken = zip(*(release_errors_percent(release_case(number)) for number in RELEASES), strict=True)
    pictures.releases(errors[0], release_case(1).time_s, folder / "rod_release.png")
    means = [float(item.mean()) for item in errors]
    source = "SoRoSim (OpenCR-MuJoCo project, MIT)"
    what = f"TPU rod let go, {LINKS} links, mid-length and tip over 3 s"
    lines = [
        Line(NAME, f"{what}: mean distance, {len(means)} releases", "%", float(np.mean(means)), 0.25, source),
        Line(NAME, f"{what}: mean distance in the worst release", "%", max(means), 0.6, source),
        Line(NAME, f"{what}: processor time over simulated time", "-", max(taken), None, "measured here"),
    ]
    lines += [_frequency_line(mode) for mode in range(1, 5)]
    lines += [_decay_line(mode) for mode in (1, 2)]
    lines += _tendon_lines()
    lines += _energy_lines()
    return Validation(tuple(lines), ())


def _frequency_line(mode: int) -> Line:
    theory = cantilever_frequency_hz(mode)
    ours, _ = swing(tpu_rod(), mode, theory)
    return _close(
        f"TPU rod, {LINKS} links: natural frequency f{mode}",
        "Hz",
        ours,
        theory,
        FREQUENCY_PERCENT[mode - 1],
        "Euler-Bernoulli cantilever",
    )


def _decay_line(mode: int) -> Line:
    theory = 0.5 * DAMPING_TIME_S * (2.0 * math.pi * cantilever_frequency_hz(mode)) ** 2
    robot = tpu_rod(dynamics=Dynamics(damping_time_s=DAMPING_TIME_S))
    _, ours = swing(robot, mode, cantilever_frequency_hz(mode))
    name = f"TPU rod, {LINKS} links, damping time 3 ms: rate of decay of mode {mode}"
    return _close(name, "1/s", ours, theory, 1.0, "Kelvin-Voigt: w^2 eta / 2 E")


def _tendon_lines() -> list[Line]:
    """Return the first frequency under tension: of tendons that are free between base and tip, and guided."""
    lines = []
    for disks, how, theory, source in (
        (1, "free between base and tip", tied_frequency_hz(TENSION_N), "beam-column, force toward the base"),
        (LINKS, "held by 50 disks", cantilever_frequency_hz(1), "a guided tendon stiffens nothing"),
    ):
        ours, _ = swing(pulled_rod(disks), 1, theory, 0.5 * TENSION_N)
        lines.append(
            _close(f"TPU rod, tendons under {TENSION_N:g} N, {how}: f1", "Hz", ours, theory, 0.5, source)
        )
    return lines


def _energy_lines() -> list[Line]:
    """Return how far energy drifts without damping, and how much it ever grows with it."""
    free = energies(tpu_rod(), ENERGY_S)
    damped = energies(tpu_rod(dynamics=Dynamics(damping_time_s=DAMPING_TIME_S)), 0.3 * ENERGY_S)
    what = f"TPU rod, {LINKS} links, swinging"
    growth = 100.0 * max(0.0, float(np.diff(damped).max()))
    return [
        Line(
            NAME,
            f"{what} without damping: energy after 10 s",
            "%",
            100.0 * float(np.abs(free - 1.0).max()),
            0.1,
            "conservation",
        ),
        Line(
            NAME,
            f"{what}, damping time 3 ms: energy gained in any half second",
            "%",
            growth,
            None,
            "dissipation. Shown, not judged: no rod that is wrong by a fifth changes it",
            ours=growth,
        ),
    ]


def _close(quantity: str, unit: str, ours: float, theory: float, percent: float, source: str) -> Line:
    return Line(
        NAME, quantity, unit, abs(ours - theory), 0.01 * percent * theory, source, ours=ours, analytic=theory
    )
