"""Effects of the clock: a lag and a delay (`rate`), a zero that wanders and creep (`drift`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import arriving_inputs, check_effects, with_effects
from catheter_sim.errors import InputError
from catheter_sim.mechanics.hysteresis import lagged

ROBOT = load_robot("neuroendoscope_section")
CATHETER = load_robot("mitral_transseptal")
UNEVEN_S = np.array([0.0, 0.3, 0.4, 1.7, 2.0, 4.5, 4.6, 9.0])
TENSIONS_N = np.array([[0.0, 0.2, 0.4, 0.1, 0.5, 0.5, 0.3, 0.0], [0.1, 0.1, 0.0, 0.3, 0.2, 0.6, 0.0, 0.1]]).T


def inputs_of(time_s: Array, tendon: Array, actuation: str = "tension") -> Inputs:
    zeros = np.zeros((len(time_s), 3))
    return Inputs(time_s, actuation, tendon, zeros, zeros)


def arrived(effects: dict[str, dict[str, float]], inputs: Inputs) -> Array:
    robot = with_effects(ROBOT if inputs.actuation == "tension" else CATHETER, effects)
    check_effects(robot)
    return arriving_inputs(robot, inputs).tendon


def test_step_and_ramp_have_their_closed_forms() -> None:
    """A step is left behind as exp(-t / lag); a ramp is followed, late by the lag, after its start."""
    time_s = np.array([0.0, 0.5, 0.6, 3.0, 20.0])
    step = lagged(time_s, np.ones(5), 0.8)
    np.testing.assert_allclose(step, 1.0 - np.exp(-time_s / 0.8), atol=1e-15)
    ramp = lagged(time_s, 2.0 * time_s, 0.8)
    np.testing.assert_allclose(ramp, 2.0 * (time_s - 0.8 + 0.8 * np.exp(-time_s / 0.8)), atol=1e-14)
    assert 2.0 * time_s[-1] - ramp[-1] == pytest.approx(1.6)


def test_lag_solves_its_differential_equation() -> None:
    """At uneven rows, with a delay, the output is that of integrating lag y' = u(t - delay) - y in steps."""
    u, lag_s, delay_s = TENSIONS_N[:, 0], 0.7, 0.25

    def slope(t: float, y: Array) -> Array:
        return (np.interp(t - delay_s, UNEVEN_S, u, left=0.0) - y) / lag_s

    solved = solve_ivp(slope, (0.0, 9.0), [0.0], t_eval=UNEVEN_S, rtol=1e-9, atol=1e-11, max_step=0.01)
    np.testing.assert_allclose(lagged(UNEVEN_S, u, lag_s, delay_s), solved.y[0], atol=1e-6)


@given(st.floats(1e-12, 1e3), st.floats(0.0, 20.0))
@settings(max_examples=60, deadline=None)
def test_late_inputs_stay_within_what_was_commanded(lag_s: float, delay_s: float) -> None:
    """However small or large lag and delay, nothing arrives outside of rest and the commands so far."""
    late = lagged(UNEVEN_S, TENSIONS_N, lag_s, delay_s)
    assert np.isfinite(late).all()
    assert (late >= -1e-12).all()
    assert (late <= np.maximum.accumulate(TENSIONS_N) + 1e-12).all()


def test_a_small_lag_is_a_delay_and_a_large_one_an_integral() -> None:
    """On a smooth way lag and delay agree to second order; over a short time the lag holds the mean back."""
    time_s = np.linspace(0.0, 10.0, 4001)
    u = 1.0 - np.cos(time_s)
    assert np.abs(lagged(time_s, u, 0.02) - lagged(time_s, u, 0.0, 0.02)).max() < 0.6 * 0.02**2
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (u[1:] + u[:-1]) * np.diff(time_s))])
    np.testing.assert_allclose(lagged(time_s, u, 1e6) * 1e6, integral, rtol=1e-4, atol=1e-4)


def test_a_delay_shifts_the_clock() -> None:
    """Rows show what was commanded a delay before, between rows on the straight line, and rest before."""
    late = arrived({"rate": {"delay_s": 1.0}}, inputs_of(UNEVEN_S, TENSIONS_N))
    for channel in range(2):
        expected = np.interp(UNEVEN_S - 1.0, UNEVEN_S, TENSIONS_N[:, channel], left=0.0)
        np.testing.assert_allclose(late[:, channel], expected, atol=1e-15)


def test_rate_lags_on_the_way_out_and_back() -> None:
    """Less arrives while the input rises and more while it falls; all of it where the input is held."""
    time_s = np.array([0.0, 5.0, 30.0, 35.0, 60.0])
    u = np.array([0.0, 0.5, 0.5, 0.1, 0.1])
    late = arrived({"rate": {"lag_s": 2.0}}, inputs_of(time_s, np.stack([u, u], axis=1)))
    assert (late[1] < u[1]).all()
    assert (late[3] > u[3]).all()
    np.testing.assert_allclose(late[[2, 4]], [[0.5] * 2, [0.1] * 2], atol=1e-5)
    np.testing.assert_array_equal(late[:, 0], late[:, 1])


@pytest.mark.parametrize(
    "effects",
    [
        {"rate": {"lag_s": 1.5}},
        {"rate": {"delay_s": 0.6}},
        {"drift": {"zero_N_per_min": 0.1, "zero_left_N_per_min": -0.2}},
        {"drift": {"creep": 0.2, "creep_time_s": 30.0}},
    ],
)
def test_every_trial_begins_anew(effects: dict[str, dict[str, float]]) -> None:
    """The clock counts from the trial's first row, and the tip's force does not come through the drive."""
    first = inputs_of(UNEVEN_S, TENSIONS_N)
    later = replace(first, time_s=UNEVEN_S + 1000.0, force_tip=np.full((8, 3), 0.01))
    np.testing.assert_allclose(arrived(effects, later), arrived(effects, first), atol=1e-12)
    moved = arriving_inputs(with_effects(ROBOT, effects), later)
    np.testing.assert_array_equal(moved.force_tip, later.force_tip)


@pytest.mark.parametrize("effects", [{"rate": {"lag_s": 1.0}}, {"drift": {"zero_N_per_min": 0.1}}])
def test_a_clock_that_stands_still_is_refused(effects: dict[str, dict[str, float]]) -> None:
    """The line names the effect and the row; with no effect in force the clock does not matter."""
    still = inputs_of(np.array([0.0, 1.0, 1.0]), TENSIONS_N[:3])
    with pytest.raises(InputError, match=rf"effects.{next(iter(effects))}: time_s = 1 at row 3"):
        arrived(effects, still)
    nulls = {name: dict.fromkeys(values, 0.0) for name, values in effects.items()}
    np.testing.assert_array_equal(arrived(nulls, still), still.tendon)


def test_a_wandering_zero_is_linear_in_time() -> None:
    """After a minute each channel is off by its rate and the common one; at the first row by nothing."""
    time_s = np.array([0.0, 30.0, 60.0])
    inputs = inputs_of(time_s, np.full((3, 4), 5e-3), "displacement")
    wandering = {"zero_mm_per_min": 0.4, "zero_torsion_distal_mm_per_min": -1.0}
    off = arrived({"drift": wandering}, inputs) - inputs.tendon
    np.testing.assert_allclose(off[1], 0.5 * off[2], atol=1e-15)
    np.testing.assert_allclose(off[2] * 1e3, [0.4, 0.4, -0.6, 0.4], atol=1e-12)
    np.testing.assert_array_equal(off[0], 0.0)


def test_creep_comes_on_under_a_held_input_and_goes_after_it() -> None:
    """A held input grows to 1 + creep with the time constant; after release what crept on fades away."""
    time_s = np.array([0.0, 1e-6, 20.0, 60.0, 60.0 + 1e-6, 80.0])
    u = np.array([0.0, 1.0, 1.0, 1.0, 0.0, 0.0])
    crept = arrived(
        {"drift": {"creep": 0.2, "creep_time_s": 20.0}}, inputs_of(time_s, np.stack([u, u], axis=1))
    )[:, 0]
    expected = u + 0.2 * np.array(
        [0.0, 0.0, 1 - np.exp(-1), 1 - np.exp(-3), 1 - np.exp(-3), (1 - np.exp(-3)) * np.exp(-1)]
    )
    np.testing.assert_allclose(crept, expected, atol=1e-6)


def test_a_tension_that_drifts_stays_at_zero() -> None:
    """A zero that wanders down takes a tension to zero, not below."""
    down = arrived({"drift": {"zero_N_per_min": -3.0}}, inputs_of(UNEVEN_S, TENSIONS_N))
    assert down.min() == 0.0
    assert (down <= TENSIONS_N).all()


def test_a_diagnosis_frees_one_way_at_a_time() -> None:
    """Lag or delay; creep with its time constant, or a zero of each channel (a single one comes first)."""
    assert EFFECTS["rate"].variants(ROBOT) == (("lag_s",), ("delay_s",))
    assert EFFECTS["drift"].variants(ROBOT) == (
        ("creep", "creep_time_s"),
        ("zero_right_N_per_min", "zero_left_N_per_min"),
    )
    single = EFFECTS["drift"].variants(load_robot("chest_tube_section"))
    assert single == (("zero_N_per_min",), ("creep", "creep_time_s"))


def test_wrong_times_are_refused() -> None:
    """A delay below zero would be a command known beforehand; a lag beyond ten seconds is a creep."""
    for values in ({"delay_s": -0.1}, {"lag_s": 11.0}):
        with pytest.raises(InputError, match="must lie in 0 to 10"):
            check_effects(with_effects(ROBOT, {"rate": values}))
