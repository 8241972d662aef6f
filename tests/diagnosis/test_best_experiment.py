"""Claims about the best next experiment: it can be played, and it is the one that rivals answer unlike."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from planted import as_inputs, small_robot

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import input_channels, read_inputs
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.next_experiment import Alive, alive_hypotheses, best_experiment
from catheter_sim.diagnosis.problem import Problem, Term
from catheter_sim.diagnosis.programmes import bench_of, programmes_within
from catheter_sim.diagnosis.thresholds import NATS_PER_MINUTE
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.lab.rig import Limits
from catheter_sim.tables import Table

FIRST, SECOND = Term("nonlinear_stiffness", ("cubic_mm2",)), Term("twist", ("rate_deg_per_m",))
RANGES = {
    "mitral_4dof": {
        "displacement_bending_proximal_mm": (-1.5, 1.5),
        "displacement_torsion_mm": (-1.0, 2.0),
        "advance_mm": (0.0, 40.0),
    },
    "neuroendoscope_section": {"tension_right_N": (0.0, 0.3), "force_tip_x_N": (-0.02, 0.02)},
}


@pytest.mark.parametrize("name", RANGES)
@pytest.mark.parametrize("longest_s", [60.0, 3600.0])
def test_programmes_stay_within_the_bench(name: str, longest_s: float) -> None:
    """Each is played by a bench of these limits, begins and ends at rest, and uses what there is."""
    robot = load_robot(name)
    columns, limits = input_channels(robot), Limits(RANGES[name], longest_s)
    found = programmes_within(bench_of(columns, RANGES[name], 1.0, longest_s))
    assert len({item.words for item in found}) == len(found) >= 2
    for item in found:
        limits.check(item.table)
        read_inputs(robot, item.table)
        assert set(item.table.columns) <= set(RANGES[name])
        for values in item.table.columns.values():
            assert values[0] == values[-1] == 0.0
    used = {
        column: max(np.abs(item.table.columns.get(column, [0.0])).max() for item in found)
        for column in columns
    }
    assert all(
        used[column] > 0.9 * max(np.abs(RANGES[name][column])) for column in columns if column in RANGES[name]
    )


def test_both_sides_are_gone_to_where_there_are_two() -> None:
    """A pair of tendons is pulled either way, an advance out alone."""
    ranges = RANGES["mitral_4dof"]
    found = programmes_within(bench_of(input_channels(load_robot("mitral_4dof")), ranges, 1.0, 3600.0))
    least = {name: min(item.table.columns[name].min() for item in found) for name in ranges}
    assert least["displacement_torsion_mm"] == pytest.approx(-0.95)
    assert least["advance_mm"] == 0.0


def rivals(bends_load: float) -> tuple[Problem, tuple[Alive, ...]]:
    """Return a problem that two effects explain alike, and both as hypotheses.

    Args:
        bends_load: by how much the first makes the robot follow a force across the tip, too.
    """
    robot = small_robot()

    def twin(robots, inputs, every):
        moved, force = 1e3 * inputs.tendon[:, 0], inputs.force_tip[:, 0]
        sizes = [
            [item.effects.get(term.effect, {}).get(term.free[0], 0.0) for term in (FIRST, SECOND)]
            for item in robots
        ]
        found = [1e-2 * (first + second) * moved + bends_load * first * force for first, second in sizes]
        return np.array(found)[:, ::every, None]

    pull = np.tile(4e-3 * np.sin(np.pi * np.arange(12) / 12), 8)
    inputs = as_inputs(np.stack([pull, 0 * pull, 0 * pull], axis=1), "displacement")
    noise = 0.1 * np.random.default_rng(1).normal(size=len(pull))
    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, {"tip_x_mm": 300.0 * pull + noise}, "made"))
    problem = Problem(robot, (), (trial,), ("tip_x_mm",), np.full(1, 0.1), twin)
    fits = [fit(problem, (term,)) for term in (FIRST, SECOND)]
    return problem, tuple(Alive((item.causes[0],), item.causes[0], item, 0.5) for item in fits)


@cache
def best(bends_load: float, forces: bool = True):
    problem, hypotheses = rivals(bends_load)
    driven = input_channels(problem.robot, "displacement")
    ranges = dict.fromkeys(driven, (0.0, 4.0)) | ({"force_tip_x_N": (-0.5, 0.5)} if forces else {})
    problem = replace(problem, robot=replace(problem.robot, actuation="displacement"))
    bench = bench_of(driven, ranges, 1.0, 3600.0)
    return best_experiment(problem, hypotheses, bench, {"mm": 0.1}, np.zeros(3))


@pytest.mark.slow
def test_the_known_force_is_chosen_where_it_alone_tells() -> None:
    """Of all programmes the one with the force comes first, and the rival would be far off on it."""
    found = best(1.0)
    assert "known force" in found.best.programme.words
    assert found.best.information.nats > 0.3  # its force acts in few stretches
    assert found.off["twist"] > 2.0
    others = [item for item in found.ranking if "known force" not in item.programme.words]
    assert max(item.information.nats for item in others) < 0.05


@pytest.mark.slow
def test_nothing_is_promised_where_nothing_tells() -> None:
    """Without the force, and where it bends both alike, every programme promises next to nothing."""
    for found in (best(1.0, forces=False), best(0.0)):
        assert found.best.information.nats < 0.05
        assert found.best.information.decided == 0.0


@pytest.mark.slow
def test_a_long_programme_must_tell_more() -> None:
    """The score is the information less a price of each minute."""
    for item in best(1.0).ranking:
        assert item.score == pytest.approx(item.information.nats - NATS_PER_MINUTE * item.minutes)


def test_alive_are_the_settled_one_and_its_equals() -> None:
    """By their beliefs, which are made to add up to one; a cause that nobody believes is not asked about."""
    _, (first, second) = rivals(1.0)
    believed = {"nonlinear_stiffness": 0.45, "twist": 0.45, "drift": 0.01, "none": 0.01}
    found = alive_hypotheses(believed, first.fit, [second.fit], [])
    assert [item.about for item in found] == ["nonlinear_stiffness", "twist"]
    assert sum(item.belief for item in found) == pytest.approx(1.0)
