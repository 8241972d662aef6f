"""Claims about the benchmark's scenarios: what is counted, and that the chain converges as it should."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest

from catheter_sim.validation.spacer_disk import (
    FAMILIES,
    SETS,
    SIMULATION,
    TIP_FORCES_N,
    ModelScores,
    Tips,
    benchmark_robot,
    by_links,
    guidelines,
    scenario_1,
    scenario_2,
    scores,
    tips,
    write_scores,
)

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("tdcr")]  # compiled once, half a minute


def poses(p_w, angle_rad):
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    return Tips(np.tile(p_w, (16, 1)), np.tile(turn, (16, 1, 1)), 1.0)


def test_errors_are_those_of_eq_57():
    """1 mm of 100 mm is 1 %, a turn by 2 deg is 2 deg, and what one model did not solve does not count."""
    reference = poses([0.0, 0.0, 0.1], 0.3)
    moved = poses([0.001, 0.0, 0.1], 0.3 + math.radians(2.0))
    moved.p_w[3] = np.nan
    found = scores(moved, reference)
    assert found.position_percent == pytest.approx(1.0)
    assert found.orientation_deg == pytest.approx(2.0)
    assert found.solved == 15


def test_sets_are_the_bits_of_their_numbers():
    """Set 5 pulls tendons 1 and 3, set 14 all but the first."""
    assert SETS[5].tolist() == [1.0, 0.0, 1.0, 0.0]
    assert SETS[14].tolist() == [0.0, 1.0, 1.0, 1.0]


def test_simulated_chain_converges_in_second_order():
    """To the rod that neither stretches nor shears, without and across a tip force, from 1 to 2 links."""
    _, table = by_links((1, 2))
    for where in TIP_FORCES_N:
        coarse, fine = (table[where, links].position_percent for links in (1, 2))
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_simulated_chain_solves_co_contractions_at_one_disk():
    """Near buckling of the subsegments too the chain comes to rest."""
    assert np.isfinite(tips(benchmark_robot(1), SIMULATION, TIP_FORCES_N["none"]).p_w).all()


def test_every_score_is_written(tmp_path):
    """One row each, with the condition and the figures."""
    found = ModelScores(1.25, 0.5, 16, 2.0)
    write_scores({("VC", 3): found}, {("PRB", "across", 0.2): found}, tmp_path / "scores.csv")
    rows = list(csv.DictReader((tmp_path / "scores.csv").open()))
    assert [(row["model"], row["tip_force"], row["disks"], row["stiffness"]) for row in rows] == [
        ("VC", "none", "3", "1.0"),
        ("PRB", "across", "10", "0.2"),
    ]
    assert rows[0]["e_p_percent"] == "1.25"


def test_guidelines_say_from_how_many_disks():
    """A model counts from the number of disks from which on it stays within the tolerance."""
    by_disks = {
        ("VC", n): ModelScores(error, 0.0, 16, 1.0) for n, error in ((1, 0.9), (2, 3.0), (3, 0.5), (4, 0.2))
    }
    told = guidelines(by_disks, {("VC", "across", 1.0): ModelScores(0.2, 0.0, 16, 1.0)})
    assert "VC from 3 disks" in told[0]
    assert "VC never" in told[1]
    assert "VC 0.2 %" in told[2]


def test_all_families_stand_in_the_table_and_solve_all_sets(tmp_path):
    """Eight more models in both scenarios, each with an error above the reference's own and a time."""
    by_disks = scenario_1((3,), FAMILIES)
    by_stiffness = scenario_2((1.0,), FAMILIES, printed_at=())
    write_scores(by_disks, by_stiffness, tmp_path / "scores.csv")
    rows = list(csv.DictReader((tmp_path / "scores.csv").open(encoding="utf-8")))
    for name in FAMILIES:
        own = [row for row in rows if row["model"] == name]
        assert [(row["scenario"], row["tip_force"]) for row in own] == [
            ("1", "none"),
            ("2", "in plane"),
            ("2", "across"),
        ]
        assert all(row["solved_of_16"] == "16" and float(row["time_ms"]) > 0.0 for row in own)
        assert all(float(row["e_p_percent"]) > 1e-3 for row in own)
