"""The chain of hinges as a rod in motion: a tip that is let go, natural frequencies, decay, energy.

The releases are SoRoSim's (`assets/reference/sorosim/release`), of the TPU rod of `rod`. All else is beam
theory, and of the model that `build` writes, stepped by MuJoCo alone.
"""

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
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Dynamics
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.resources import assets_folder
from catheter_sim.robots.continuum.description import links
from catheter_sim.robots.continuum.spec import ContinuumRobot, Tendon
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation import plots
from catheter_sim.validation.lines import Line, Validation
from catheter_sim.validation.rod import (
    BENDING_N_M2,
    FROM_FILE,
    LENGTH_M,
    LINKS,
    MASS_KG,
    NAME,
    tpu_rod,
)

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
    plots.releases(errors[0], release_case(1).time_s, folder / "rod_release.png")
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
            "dissipation; shown, not judged: no rod that is wrong by a fifth changes it",
            ours=growth,
        ),
    ]


def _close(quantity: str, unit: str, ours: float, theory: float, percent: float, source: str) -> Line:
    return Line(
        NAME, quantity, unit, abs(ours - theory), 0.01 * percent * theory, source, ours=ours, analytic=theory
    )
