"""The rod in motion: what the checks' own theory gives, and a release at few links."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.core.robot import Dynamics
from catheter_sim.validation.rod import (
    BENDING_N_M2,
    DAMPING_TIME_S,
    LENGTH_M,
    cantilever_curvature,
    cantilever_frequency_hz,
    cantilever_root,
    energies,
    release_case,
    release_errors_percent,
    swing,
    tied_frequency_hz,
    tpu_rod,
)


def test_roots_are_those_of_the_textbooks() -> None:
    """1.8751, 4.6941, 7.8548, 10.9955 (Blevins 1979, Table 8-1); the shapes are bent at the base alone."""
    roots = [cantilever_root(mode) for mode in range(1, 5)]
    assert roots == pytest.approx([1.87510407, 4.69409113, 7.85475744, 10.99554073], abs=1e-8)
    for mode in range(1, 5):
        assert cantilever_curvature(mode, np.array([0.0, LENGTH_M])) == pytest.approx([1.0, 0.0], abs=1e-9)


def test_a_tied_tip_buckles_at_eulers_load() -> None:
    """Without tension it swings as a cantilever; nearer to pi^2 EI / L^2 ever more slowly."""
    load = math.pi**2 * BENDING_N_M2 / LENGTH_M**2
    assert tied_frequency_hz(1e-6) == pytest.approx(cantilever_frequency_hz(1), rel=1e-5)
    slow = [tied_frequency_hz(share * load) for share in (0.3, 0.6, 0.9, 0.99)]
    assert slow == sorted(slow, reverse=True)
    assert slow[-1] < 0.15 * cantilever_frequency_hz(1)


@pytest.mark.slow
def test_twenty_links_swing_and_decay_as_theory_says() -> None:
    """To 0.5 % of the first frequency and 1 % of its decay."""
    theory = cantilever_frequency_hz(1)
    assert swing(tpu_rod(20), 1, theory)[0] == pytest.approx(theory, rel=5e-3)
    rate = 0.5 * DAMPING_TIME_S * (2.0 * math.pi * theory) ** 2
    damped = tpu_rod(20, Dynamics(damping_time_s=DAMPING_TIME_S))
    assert swing(damped, 1, theory)[1] == pytest.approx(rate, rel=1e-2)
    assert swing(tpu_rod(20), 1, theory)[1] == pytest.approx(0.0, abs=1e-3 * rate)


@pytest.mark.slow
def test_energy_stays_without_damping_and_falls_with_it() -> None:
    """Of ten links for two seconds: within 0.1 %, and lower at every look."""
    assert np.abs(energies(tpu_rod(10), 2.0) - 1.0).max() < 1e-3
    damped = energies(tpu_rod(10, Dynamics(damping_time_s=DAMPING_TIME_S)), 2.0)
    assert (np.diff(damped) < 0.0).all()
    assert damped[-1] < 0.5


@pytest.mark.slow
def test_release_of_fifty_links_is_that_of_the_other_program() -> None:
    """The one that the chain follows worst: 0.25 % of the length in the mean, from a start within 0.1 %."""
    errors, _ = release_errors_percent(release_case(1))
    assert errors.mean() < 0.25
    assert errors[0].max() < 0.1
