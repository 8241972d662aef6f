"""Claims about drives with a controller of their own, tendons in their holes, toes and routing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import arriving_inputs, with_effects
from catheter_sim.mechanics.hysteresis import closing_play, closing_play_step, limited, limited_step

SECTION = load_robot("neuroendoscope_section")
Effects = dict[str, dict[str, float]]


def arrived(robot, effects: Effects, columns, time_s=None):
    """Return what arrives at the tendons of a robot with effects, in file units."""
    rows = np.array(columns, dtype=float).T
    unit = 1.0 if robot.actuation == "tension" else 1e-3
    time_s = np.arange(float(len(rows))) if time_s is None else np.asarray(time_s, dtype=float)
    nothing = np.zeros((len(rows), 3))
    inputs = Inputs(time_s, robot.actuation, rows * unit, nothing, nothing)
    return arriving_inputs(with_effects(robot, effects), inputs).tendon / unit


def test_a_drive_goes_no_faster_than_it_can() -> None:
    """2 s a newton: of a step of 1 N half has come after 1 s, all after 2 s; the other drive is not asked."""
    pull = [0.0, 1.0, 1.0, 1.0]
    found = arrived(
        SECTION, {"rate": {"servo_right_s_per_N": 2.0}}, [pull, pull], time_s=[0.0, 1e-9, 1.0, 2.5]
    )
    assert found[:, 0] == pytest.approx([0.0, 0.0, 0.5, 1.0], abs=1e-8)
    assert found[:, 1] == pytest.approx(pull)


@pytest.mark.parametrize("seed", range(4))
def test_a_limited_drive_solves_its_equation(seed: int) -> None:
    """|dy/dt| is at most the limit and y goes toward u: the exact steps against thousands of short ones."""
    rng = np.random.default_rng(seed)
    now, before, after = rng.normal(size=(3, 5))
    limit, duration = np.abs(rng.normal(size=5)) + 0.1, 1.7
    fine, count = now.copy(), 40_000
    for k in range(1, count + 1):
        u = before + (after - before) * k / count
        most = limit * duration / count
        fine += np.clip(u - fine, -most, most)
    assert limited_step(now, before, after, limit, duration) == pytest.approx(fine, abs=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_a_dead_band_closes_by_its_equation(seed: int) -> None:
    """Inside the dead-band y follows T dy/dt = u - y, beyond it the play takes it along."""
    rng = np.random.default_rng(seed)
    before, after = rng.normal(size=2)
    width, time_s, duration = 0.8, 0.9, 1.3
    start = before + 0.4 * rng.uniform(-1.0, 1.0)
    fine, count = start, 40_000
    for k in range(1, count + 1):
        u = before + (after - before) * k / count
        fine += (u - fine) * -math.expm1(-duration / count / time_s)
        fine = min(max(fine, u - width / 2.0), u + width / 2.0)
    found = closing_play_step(
        np.array([start]), np.array([before]), np.array([after]), np.array([width]), time_s, duration
    )
    assert found[0] == pytest.approx(fine, abs=1e-3)


def test_a_series_is_its_steps() -> None:
    """Of a drive with a top speed and of one that closes its dead-band; to the last bit."""
    rng = np.random.default_rng(5)
    time_s, rows, rest = np.cumsum(rng.uniform(0.1, 2.0, 40)), rng.normal(size=(40, 3)), rng.normal(size=3)
    most, width = np.array([0.4, np.inf, 1.5]), np.array([0.3, 0.0, 2.0])
    pairs = (
        (limited(time_s, rows, most, rest), lambda *way: limited_step(*way[:3], most, way[3])),
        (
            closing_play(time_s, rows, width, 3.0, rest),
            lambda *way: closing_play_step(*way[:3], width, 3.0, way[3]),
        ),
    )
    for series, step in pairs:
        now, before = rest, rest
        for row, dt_s in enumerate(np.diff(time_s, prepend=time_s[:1])):
            now = step(now, before, rows[row], dt_s)
            before = rows[row]
            assert np.array_equal(series[row], now)


def test_what_a_controller_leaves_it_closes_slowly() -> None:
    """After a step half of the dead-band is missing; held, that goes with exp(-t / T), as a solver has it."""
    effects = {"backlash": {"servo_width_N": 0.4, "servo_time_s": 30.0}}
    pull = [0.0, 1.0, 1.0, 1.0]
    time_s = [0.0, 1e-9, 30.0, 300.0]
    found = arrived(SECTION, effects, [pull, [0.0] * 4], time_s)[:, 0]
    assert found[:2] == pytest.approx([0.0, 0.8], abs=1e-7)
    closing = solve_ivp(lambda t, y: (1.0 - y) / 30.0, (0.0, 300.0), [0.8], t_eval=[30.0, 300.0], rtol=1e-9)
    assert found[2:] == pytest.approx(closing.y[0], abs=1e-6)
    slow = {"backlash": {"servo_width_N": 0.4, "servo_time_s": 600.0}}
    play = arrived(SECTION, {"backlash": {"width_N": 0.4}}, [pull, [0.0] * 4], [0.0, 0.1, 0.2, 0.3])
    assert arrived(SECTION, slow, [pull, [0.0] * 4], [0.0, 0.1, 0.2, 0.3]) == pytest.approx(play, abs=3e-4)


def test_a_tendon_crosses_its_hole_about_straight() -> None:
    """Far out half of the width is missing, near straight most of the input, on the same way both times."""
    robot = load_robot("mitral_transseptal")
    names = [item.name for item in robot.tendons]
    columns = np.zeros((len(names), 7))
    columns[names.index("bending")] = [0.0, 0.05, 4.0, 0.05, 0.0, -4.0, -0.05]
    found = arrived(robot, {"backlash": {"hole_width_mm": 0.6, "hole_range_mm": 0.4}}, columns)
    found = found[:, names.index("bending")]
    near = 0.05 - 0.3 * math.tanh(0.05 / 0.4)
    assert found == pytest.approx([0.0, near, 3.7, near, 0.0, -3.7, -near], abs=1e-6)
    narrow = {"backlash": {"hole_width_mm": 0.6, "hole_range_mm": 0.1}}
    way = np.zeros((len(names), 41))
    way[names.index("bending")] = np.linspace(-1.0, 1.0, 41)
    assert (np.diff(arrived(robot, narrow, way)[:, names.index("bending")]) >= 0.0).all()


def test_a_braid_gives_way_at_first() -> None:
    """A tendon is longer by 0.5 mm (1 - exp(-u / 2 mm)); a pair's other tendon by its own pull."""
    robot = load_robot("mitral_transseptal")
    names = [item.name for item in robot.tendons]
    bending, torsion = names.index("bending"), names.index("torsion_proximal")
    columns = np.zeros((len(names), 4))
    columns[bending] = columns[torsion] = [0.0, 2.0, -2.0, 40.0]
    found = arrived(robot, {"tendon_elongation": {"toe_mm": 0.5, "toe_range_mm": 2.0}}, columns)
    lost = 0.5 * (1.0 - math.exp(-1.0))
    assert found[:, bending] == pytest.approx([0.0, 2.0 - lost, lost - 2.0, 39.5], abs=1e-6)
    assert np.array_equal(found[:, torsion], columns[torsion])  # no tendon of it bends


def test_zeros_settle_with_the_logarithm_of_time() -> None:
    """0.1 N for each factor of e: after 30 (e - 1) s of a time of 30 s that far, on both channels."""
    late = 30.0 * (math.e - 1.0)
    found = arrived(
        SECTION, {"drift": {"log_zero_N": 0.1, "log_time_s": 30.0}}, [[0.5] * 3] * 2, [0.0, late, 1000.0]
    )
    assert found[:, 0] == pytest.approx([0.5, 0.6, 0.5 + 0.1 * math.log(1.0 + 1000.0 / 30.0)])
    assert np.array_equal(found[:, 0], found[:, 1])


def test_a_pulled_tendon_lengthens_element_by_element() -> None:
    """Held at 2 mm it gives way by four exponentials; a pair's other tendon has not been pulled."""
    robot = load_robot("mitral_transseptal")
    names = [item.name for item in robot.tendons]
    bending = names.index("bending")
    time_s = [0.0, 1e-9, 40.0, 4000.0, 4000.0 + 1e-9]
    columns = np.zeros((len(names), 5))
    columns[bending] = [0.0, 2.0, 2.0, 2.0, -2.0]
    effects = {"tendon_elongation": {"creep_share": 0.1, "creep_time_s": 10.0}}
    found = arrived(robot, effects, columns, time_s)[:, bending]
    crept = [0.25 * sum(1.0 - math.exp(-t / (10.0 * 4.0**k)) for k in range(4)) for t in (40.0, 4000.0)]
    assert found == pytest.approx([0.0, 2.0, 2.0 - 0.2 * crept[0], 2.0 - 0.2 * crept[1], -2.0], abs=1e-6)
    times = np.geomspace(10.0, 640.0, 7)
    held = np.zeros((len(names), 8))
    held[bending] = 2.0
    held[bending, 0] = 0.0
    lost = 2.0 - arrived(robot, effects, held, [0.0, *(times + 1e-9)])[1:, bending]
    steps = np.diff(lost)
    assert steps.max() < 2.0 * steps.min()  # about the same for each doubling, as a logarithm


@pytest.mark.parametrize(("share", "onto"), [(0.1, "base_left"), (-0.1, "base_right")])
def test_rods_routed_aside_bend_the_other_section_aside(share: float, onto: str) -> None:
    """The tip's front rod (+y), a quarter turn from x to y aside, pulls a tenth at the base's left (-x)."""
    robot = load_robot("chest_tube")
    names = [item.name for item in robot.tendons]
    opposite = {"base_left": "base_right", "base_right": "base_left"}
    for pulled, where in (("tip_front", onto), ("tip_back", opposite[onto]), ("tip_right", "")):
        columns = np.zeros((len(names), 2))
        columns[names.index(pulled)] = [0.0, 1.0]
        found = arrived(robot, {"coupling": {"tip_aside_base": share}}, columns)[1]
        extra = dict(zip(names, (found - columns[:, 1]).round(12).tolist(), strict=True))
        assert {name: value for name, value in extra.items() if value} == ({where: 0.1} if where else {})


def test_a_robot_in_one_plane_has_nothing_aside() -> None:
    """What bends in one plane has no side on which another tendon could act."""
    robot = load_robot("neuroendoscope")
    assert not [item for item in EFFECTS["coupling"].parameters(robot) if "_aside_" in item.name]
