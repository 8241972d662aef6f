"""The rod that all programs bend: its numbers, the loads, and where its tip must be.

A TPU rod as SoRoSim's (`validation.rod`), clamped at its base, with a force across at its tip that keeps its
direction; it bends in one plane. The reference is Reissner's planar rod, bending, shear and extension
included, integrated by SciPy with a tolerance of 1e-11: no code of the programs that are compared.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from catheter_sim.arrays import Array

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
