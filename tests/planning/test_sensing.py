"""Regions of what is sensed: sizes that follow from the inputs by hand."""

from __future__ import annotations

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.kinds.catheter.robots.mitral import mitral_transseptal
from catheter_sim.kinds.catheter.theory.tendons import pulled_m

BENT = {"time_s": [0.0], "displacement_bending_mm": [2.0]}
GAUSS = 1.96  # deviations that hold 95 %


def deg_per_mm() -> float:
    """Return the bend per displacement near 2 mm, by Nayar 2022's Eq. 3 the other way round."""
    bend = np.radians([60.0, 66.0])
    way = 1e3 * np.asarray(pulled_m(mitral_transseptal().segments[1], bend))
    return float(6.0 / (way[1] - way[0]))


def half_width(**changes: object) -> float:
    """Return half of the bend's region."""
    found = cs.sense("mitral_transseptal", BENT, columns=["angle_bending_deg"], **changes).sensed  # type: ignore
    return 0.5 * float(found.high[0, 0] - found.low[0, 0])


def test_noise_gives_a_region_of_its_own_size() -> None:
    """Noise of 0.02 mm, times the slope, times 1.96."""
    width = half_width(noise_displacement_mm=0.02, uncertain={})
    assert width == pytest.approx(GAUSS * 0.02 * deg_per_mm(), rel=0.04)


def test_an_even_range_gives_95_percent_of_itself() -> None:
    """The arm within 1 %: the bend within 1 % of itself, 0.95 of which is the region, not 1.96 deviations."""
    bend = float(cs.sense("mitral_transseptal", BENT, columns=["angle_bending_deg"]).sensed.value[0, 0])
    width = half_width(uncertain={"segments.bending.arm_mm": 0.018})
    assert width == pytest.approx(0.95 * 0.01 * bend, rel=0.05)


def test_nothing_unknown_gives_no_region() -> None:
    """Exact readings of a robot that is as specified."""
    assert half_width(uncertain={}) == 0.0


def test_a_measured_output_narrows_as_two_measurements_do() -> None:
    """An angle measured as surely as the displacement tells it: the region shrinks by the root of two."""
    alone = half_width(noise_displacement_mm=0.02, uncertain={})
    sure = alone / GAUSS
    value = float(cs.sense("mitral_transseptal", BENT, columns=["angle_bending_deg"]).sensed.value[0, 0])
    found = cs.sense(
        "mitral_transseptal",
        BENT | {"angle_bending_deg": [value + sure]},
        noise_displacement_mm=0.02,
        noise_angle_deg=sure,
        uncertain={},
        columns=["angle_bending_deg"],
    ).sensed
    assert 0.5 * float(found.high[0, 0] - found.low[0, 0]) == pytest.approx(alone / np.sqrt(2.0), rel=0.04)
    assert found.value[0, 0] == pytest.approx(value + 0.5 * sure, abs=0.05 * sure)


def test_a_tension_cannot_be_below_zero() -> None:
    """A reading of -0.05 N with noise of 0.1 is a slack tendon, and its region is one-sided."""
    pulled = {"time_s": [0.0], "tension_active_N": [-0.05]}
    found = cs.sense("chest_tube_section", pulled, noise_tension_N=0.1, uncertain={}, columns=["tip_x_mm"])
    assert found.sensed.low[0, 0] == pytest.approx(found.sensed.value[0, 0], abs=1e-9)
    assert found.sensed.high[0, 0] > found.sensed.value[0, 0] + 1.0
    with pytest.raises(cs.InputError, match="cannot push"):
        cs.sense("chest_tube_section", pulled, noise_tension_N=0.005)


def test_a_rows_noise_is_remembered_by_the_rows_after_it() -> None:
    """Back from a peak a rod that rubs still shows the peak's noise; with friction off it does not."""
    pulled = {"time_s": [0.0, 1.0], "tension_active_N": [20.0, 18.0]}

    def after(mu: float) -> float:
        robot = cs.load_robot("chest_tube_section", {"friction.mu": mu})
        exact = cs.sense(robot, pulled, noise_tension_N=0.5, uncertain={}, columns=["tip_z_mm"]).sensed
        return float(exact.deviations["noise of the inputs"][1, 0])

    alone = {name: [values[1]] for name, values in pulled.items()}
    robot = cs.load_robot("chest_tube_section", {"friction.mu": 0.0})
    once = cs.sense(robot, alone, noise_tension_N=0.5, uncertain={}, columns=["tip_z_mm"]).sensed
    assert after(0.0) == pytest.approx(float(once.deviations["noise of the inputs"][0, 0]), rel=0.05)
    assert after(0.316) > 0.0
