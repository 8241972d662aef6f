"""The rod that all programs bend, its loads and reference, and how this package bends it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Dynamics, Friction
from catheter_sim.robots.continuum.rods import vc
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.simulation.simulator import Simulator

# ----------------------------------------------------------------------------------------------------
# The rod that all programs bend: its numbers, the loads, and where its tip must be.
#
# A TPU rod as SoRoSim's (`validation.rod`), clamped at its base, with a force across at its tip that keeps
# its direction; it bends in one plane. The reference is Reissner's planar rod, bending, shear and extension
# included, integrated by SciPy with a tolerance of 1e-11: no code of the programs that are compared.

LENGTH_M, RADIUS_M, YOUNG_PA, POISSON, DENSITY = 0.4, 5e-3, 70e6, 0.4, 1200.0
AREA_M2, SECOND_MOMENT_M4 = math.pi * RADIUS_M**2, math.pi / 4.0 * RADIUS_M**4
SHEAR_PA = YOUNG_PA / 2.0 / (1.0 + POISSON)
ELEMENTS = 20  # of each program's rod
FORCES_N = (0.1, 0.2, 0.3)  # the tip goes aside by 15 to 39 % of the length
STIFFER = 1.25  # Young's modulus of the rod that the fit is to find, over the nominal one


@dataclass(frozen=True)
class Program:
    """What a program can do with the rod.

    Attributes:
        name: with its version.
        tip: the tip's place (x, z) at rest [m], from Young's modulus over the nominal one, and the force [N].
        step: takes some steps in time and returns how many; None: not measured.
        step_s: simulated time of one [s]; None: without an integrator of its own in the step.
        batch: solves configurations for as many forces, shape (c,) [N]; None: it has no batch.
        batch_size: how many it is given.
        how: it gets there, in a few words.
    """

    name: str
    tip: Callable[[float, float], tuple[float, float]]
    step: Callable[[], int] | None
    step_s: float | None
    batch: Callable[[Array], object] | None
    batch_size: int
    how: str


@dataclass(frozen=True)
class Measured:
    """A row of the table.

    Attributes:
        program, how: as of `Program`; of a program that is not there, how to get it.
        error_percent: largest distance of the tip from the reference [% of the length]; None: not there.
        statics_s: time of one configuration, median of the loads [s].
        batch_s: the same in a batch [s].
        steps_per_s: in time.
        real_time: simulated seconds in a second.
        fit_s: time of the fit of Young's modulus to three tips [s].
        fit_error_percent: of the modulus that it found.
    """

    program: str
    how: str
    error_percent: float | None = None
    statics_s: float | None = None
    batch_s: float | None = None
    steps_per_s: float | None = None
    real_time: float | None = None
    fit_s: float | None = None
    fit_error_percent: float | None = None


@lru_cache(maxsize=64)
def tip_reference(scale: float, force_N: float) -> tuple[float, float]:
    """Return the place (x, z) of the tip [m] of a rod of `scale` times the nominal Young's modulus."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    bending = scale * YOUNG_PA * SECOND_MOMENT_M4
    axial, shear = scale * YOUNG_PA * AREA_M2, scale * SHEAR_PA * AREA_M2

    def slope(_: float, state: Array) -> list[float]:
        angle, moment = state[0], state[1]
        sine, cosine = math.sin(angle), math.cos(angle)
        along, across = 1.0 + force_N * sine / axial, force_N * cosine / shear
        dz = along * cosine - across * sine
        return [moment / bending, -force_N * dz, along * sine + across * cosine, dz]

    def end(base_moment: float) -> Array:
        found = solve_ivp(
            slope, (0.0, LENGTH_M), [0.0, base_moment, 0.0, 0.0], "DOP853", rtol=1e-11, atol=1e-13
        )
        return np.asarray(found.y[:, -1])

    moment = brentq(lambda value: end(value)[1], 0.0, 1.1 * force_N * LENGTH_M, xtol=1e-15)
    state = end(moment)
    return float(state[2]), float(state[3])


def measured(program: Program, turns: int) -> Measured:
    """Measure a program; each time is the shortest of `turns`, of the processor, after a first call."""
    error, statics = 0.0, []
    for force in FORCES_N:
        place = program.tip(1.0, force)
        error = max(error, math.dist(place, tip_reference(1.0, force)) / LENGTH_M * 100.0)
        statics.append(shortest(lambda force=force: program.tip(1.0, force), turns))  # type: ignore[misc]
    batch_s = steps_per_s = real_time = None
    if program.batch is not None:
        forces = np.linspace(0.05, 0.3, program.batch_size)
        program.batch(forces)
        batch_s = shortest(lambda: program.batch(forces), turns) / len(forces)  # type: ignore[misc]
    if program.step is not None:
        count = program.step()
        steps_per_s = count / shortest(program.step, turns)
        real_time = steps_per_s * program.step_s if program.step_s else None
    began = time.process_time()
    found = fitted_scale(program.tip)
    return Measured(
        program.name, program.how, error, sorted(statics)[1], batch_s, steps_per_s, real_time,
        time.process_time() - began, abs(found / STIFFER - 1.0) * 100.0,
    )  # fmt: skip


def fitted_scale(tip: Callable[[float, float], tuple[float, float]]) -> float:
    """Return the scale of Young's modulus that brings a program's three tips nearest the reference."""
    from scipy.optimize import least_squares

    want = np.array([tip_reference(STIFFER, force) for force in FORCES_N])

    def residual(logarithm: Array) -> Array:
        scale = math.exp(logarithm[0])
        return ((np.array([tip(scale, force) for force in FORCES_N]) - want) / LENGTH_M).ravel()

    return math.exp(least_squares(residual, [0.0], diff_step=1e-3, xtol=1e-6, ftol=1e-8, gtol=1e-8).x[0])


def shortest(call: Callable[[], object], turns: int) -> float:
    """Return the shortest time of `turns` calls, of the processor [s]."""
    times = []
    for _ in range(turns):
        began = time.process_time()
        call()
        times.append(time.process_time() - began)
    return min(times)


# ----------------------------------------------------------------------------------------------------
# This package's rod: the static model VC, the simulated chain, and the same chain by MuJoCo alone.

_STEPS = 2000
_AT_REST_M_PER_S = 1e-6  # of the tip, on average over a hundred steps
_NO_GRAVITY = np.zeros(3)


def rod(scale: float = 1.0) -> ContinuumRobot:
    """Return the rod as a robot with a tendon that nobody pulls."""
    bending = scale * YOUNG_PA * SECOND_MOMENT_M4
    segment = Segment(
        name="rod",
        length_m=LENGTH_M,
        disks=ELEMENTS,
        outer_radius_m=RADIUS_M,
        bending_stiffness_N_m2=bending,
        mass_kg=DENSITY * AREA_M2 * LENGTH_M,
        torsion_stiffness_N_m2=bending / (1.0 + POISSON),
        axial_stiffness_N=scale * YOUNG_PA * AREA_M2,
        shear_stiffness_N=scale * SHEAR_PA * AREA_M2,
    )
    return ContinuumRobot(
        name="rod",
        description="rod of TPU",
        segments=(segment,),
        tendons=(Tendon("1", 0.8 * RADIUS_M, 0.0, "rod"),),
        friction=Friction(0.0),
        dynamics=Dynamics(),
    )


def _pushed(forces: Array) -> Inputs:
    """Return inputs with a force across the tip in each row."""
    rows = len(forces)
    force = np.zeros((rows, 3))
    force[:, 0] = forces
    return Inputs(np.arange(float(rows)), "tension", np.zeros((rows, 1)), force, np.zeros((rows, 3)))


def static_model() -> Program:
    """Return the static model VC."""
    nominal = rod()

    def tip(scale: float, force_N: float) -> tuple[float, float]:
        found = vc(rod(scale), _pushed(np.array([force_N])), _NO_GRAVITY).postures[0].p_w[-1]
        return float(found[0]), float(found[2])

    return Program(
        "catheter-sim, statics VC", tip, None, None,
        lambda forces: vc(nominal, _pushed(forces), _NO_GRAVITY), 1000, "Cosserat rod, Newton's method",
    )  # fmt: skip


def simulation() -> Program:
    """Return the simulated chain."""
    kept: dict[float, Simulator] = {}

    def tip(scale: float, force_N: float) -> tuple[float, float]:
        if scale not in kept:
            kept.clear()
            kept[scale] = Simulator(rod(scale), inertia=False)
        simulator = kept[scale]
        simulator.reset()
        simulator.set_inputs(np.zeros(1), (force_N, 0.0, 0.0))
        simulator.settle(60.0)
        place = simulator.posture().p_w[-1]
        return float(place[0]), float(place[2])

    moving = Simulator(rod())
    moving.set_inputs(np.zeros(1), (0.1, 0.0, 0.0))

    def step() -> int:
        moving.step(_STEPS)
        return _STEPS

    return Program(
        "catheter-sim, simulation", tip, step, float(moving.model.opt.timestep), None, 0,
        "hinges, settled without inertia",
    )  # fmt: skip


def plain_mujoco() -> Program:
    """Return the same chain stepped by MuJoCo alone until it is at rest."""
    kept: dict[float, mujoco.MjModel] = {}
    place = mujoco.mjtObj.mjOBJ_SITE

    def pushed(model: mujoco.MjModel, data: mujoco.MjData, force_N: float, steps: int) -> None:
        site = mujoco.mj_name2id(model, place, "tip")
        force, none = np.array([force_N, 0.0, 0.0]), np.zeros(3)
        for _ in range(steps):
            data.qfrc_applied[:] = 0.0
            mujoco.mj_applyFT(
                model, data, force, none, data.site_xpos[site], model.site_bodyid[site], data.qfrc_applied
            )
            mujoco.mj_step(model, data)

    def tip(scale: float, force_N: float) -> tuple[float, float]:
        if scale not in kept:
            kept.clear()
            kept[scale] = Simulator(rod(scale), inertia=False).model
        model = kept[scale]
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        found = data.site("tip").xpos
        for _ in range(1000):
            before = found.copy()
            pushed(model, data, force_N, 100)
            if np.abs(found - before).max() < _AT_REST_M_PER_S * 100 * model.opt.timestep:
                break
        return float(found[0]), float(found[2])

    moving = Simulator(rod()).model
    data = mujoco.MjData(moving)
    mujoco.mj_forward(moving, data)

    def step() -> int:
        pushed(moving, data, 0.1, _STEPS)
        return _STEPS

    return Program(
        f"mujoco {version('mujoco')}, plain", tip, step, float(moving.opt.timestep), None, 0,
        "the same chain, mj_step until at rest",
    )  # fmt: skip
