"""Regions of what is sensed: sizes that follow from the inputs by hand."""

from __future__ import annotations

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.planning import sensing
from catheter_sim.robots.catheter.kinematics import pulled_m
from catheter_sim.robots.catheter.published import mitral_transseptal

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


class Given:
    """Gives parts of what was drawn before, row after row, instead of random numbers."""

    def __init__(self, drawn: np.ndarray) -> None:
        self._drawn, self._next, self.most = drawn, 0, 0

    def standard_normal(self, shape: tuple[int, int, int]) -> np.ndarray:
        self._next, first = self._next + shape[1], self._next
        self.most = max(self.most, shape[1])
        return self._drawn[:, first : self._next]


def test_rows_are_drawn_some_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A row's noise reaches the rows of the next part, too; no part is larger than the room for it."""
    rows, draws = 23, 5
    drawn = np.random.default_rng(3).standard_normal((draws, rows, 2))
    wide = np.full((2, rows), np.inf) * [[-1.0], [1.0]]
    gain = np.random.default_rng(4).normal(size=(2 * sensing.REMEMBERED, rows, 3))
    pushes = [
        sensing._Push(k % 2, k // 2, sensing.REMEMBERED, gain[k], 0.1 * (1 + k % 2), wide)
        for k in range(2 * sensing.REMEMBERED)
    ]
    monkeypatch.setattr(sensing, "_DRAWS", draws)
    found, given = [], Given(drawn)
    for size in (rows, 4):
        monkeypatch.setattr(sensing, "_CELLS", size * draws * 3)
        given = Given(drawn)
        found.append(
            np.concatenate([part for _, part in sensing._noise_by_rows(pushes, given, rows, 2, 3)], axis=1)
        )
        assert given.most == size
    # By hand: what the input's noise at the last pushed row before, or at the row, moves.
    expected = np.zeros((draws, rows, 3))
    for row in range(rows):
        for age in range(min(row, sensing.REMEMBERED - 1) + 1):
            for drive in range(2):
                push = 2 * ((row - age) % sensing.REMEMBERED) + drive
                expected[:, row] += 0.1 * (1 + drive) * drawn[:, row - age, drive, None] * gain[push, row]
    np.testing.assert_allclose(found[0], expected, atol=1e-12)
    np.testing.assert_allclose(found[1], expected, atol=1e-12)


def test_regions_of_many_rows_are_those_of_few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawn four rows at a time the regions are as wide, to the scatter of 4000 draws."""
    pulled = {"time_s": np.arange(12.0), "tension_active_N": np.linspace(5.0, 20.0, 12)}
    widths = []
    for cells in (sensing._CELLS, 4 * sensing._DRAWS):
        monkeypatch.setattr(sensing, "_CELLS", cells)
        found = cs.sense(
            "chest_tube_section", pulled, noise_tension_N=0.5, uncertain={}, columns=["tip_x_mm"]
        )
        widths.append(found.sensed.high - found.sensed.low)
    assert widths[0].min() > 0.5
    np.testing.assert_allclose(widths[1], widths[0], rtol=0.1)


def test_a_step_of_the_readings_is_within_the_region() -> None:
    """What is read to a step is held, by a region little wider than the step: the idle tendon has it, too."""
    robot = cs.load_robot("neuroendoscope_section", {"friction.mu": 0.0})
    step, true = 0.05, np.random.default_rng(4).uniform(0.1, 0.4, 40)
    times = np.arange(len(true), dtype=float)

    def tip_mm(tension: np.ndarray) -> np.ndarray:
        pulled = {"time_s": times, "tension_right_N": tension}
        return cs.statics(robot, pulled, "fkm_sliding").to_table().columns["tip_x_mm"]

    read = {"time_s": times, "tension_right_N": step * np.round(true / step)}
    found = cs.sense(robot, read, uncertain={}, columns=["tip_x_mm"], step_tension_N=step)
    low, high = found.sensed.low[:, 0], found.sensed.high[:, 0]
    assert ((low <= tip_mm(true)) & (tip_mm(true) <= high)).all()
    widest = tip_mm(read["tension_right_N"] + step / 2.0) - tip_mm(read["tension_right_N"] - step / 2.0)
    assert (high - low < 1.4 * widest).all()
    with pytest.raises(cs.InputError, match="step_tension_N"):
        cs.sense(robot, read, step_tension_N=-1.0)
