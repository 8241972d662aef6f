"""A real hanging trunk, three weights at its end: what changed between two recordings is the weight."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.diagnosis.changes.differences import mass_of
from catheter_sim.diagnosis.trials import Dataset

pytestmark = pytest.mark.long

TRUNK = Path(__file__).parents[2] / "assets" / "examples" / "trunk"
MASSES = ("000g", "100g", "300g")


def told_force(first: str, second: str) -> tuple[np.ndarray, float]:
    """Return the force that came with the second recording [N], and the weight's mass [g]."""
    found = cs.compare(TRUNK / f"settled_{first}", TRUNK / f"settled_{second}", jobs=2)
    assert found.verdict == "changed"
    assert [change.name for change in found.changes] == ["payload"]
    mass = mass_of(found.changes[0], found.result.diagnosis.dataset.gravity_mps2)
    assert mass is not None
    given = found.changes[0].parameters
    return np.array([given[f"force_{axis}_N"].value for axis in "xyz"]), mass.mass_g.value


def test_a_weight_is_told_as_one_and_three_times_as_much_as_that() -> None:
    """Within 3 deg of straight down; the second mass within a fifth of three times the first."""
    (small, light), (large, heavy) = told_force("000g", "100g"), told_force("000g", "300g")
    for force in (small, large):
        assert np.degrees(np.arccos(force[2] / np.linalg.norm(force))) < 3.0
    assert heavy / light == pytest.approx(3.0, rel=0.2)


def test_a_weight_that_is_taken_off_pulls_up() -> None:
    """Told without being tried the other way round."""
    force, mass = told_force("300g", "000g")
    assert force[2] < 0.0
    assert mass < 0.0


@pytest.mark.parametrize(("mass", "least_N", "most_N"), [("100g", 0.49, 1.47), ("300g", 1.96, 3.92)])
def test_a_weight_is_told_of_a_moving_trunk(mass: str, least_N: float, most_N: float) -> None:
    """Alone, or as what cannot be told from the first change: a lower gain does much the same in motion."""
    found = cs.compare(TRUNK / "moving_000g", TRUNK / f"moving_{mass}", jobs=2, budget_s=400.0)
    diagnosis = found.result.diagnosis
    assert found.verdict == "changed"
    first = found.changes[0].name
    assert len(found.changes) == 1
    if first == "payload":
        force = [found.changes[0].parameters[f"force_{axis}_N"].value for axis in "xyz"]
        assert least_N < force[2] < most_N
        assert np.hypot(force[0], force[1]) < 0.3 * force[2]
    else:
        assert mass == "300g"
        assert {first, "payload"} <= set(diagnosis.indistinguishable[0])


@pytest.mark.parametrize("mass", MASSES)
def test_halves_of_one_recording_are_unchanged(mass: str) -> None:
    """Two of its five trials against two others."""
    whole = cs.load_dataset(TRUNK / f"settled_{mass}")
    halves = [part_of(whole, slice(0, 2)), part_of(whole, slice(3, 5))]
    assert cs.compare(*halves, jobs=2).verdict == "unchanged"
    assert cs.compare(*reversed(halves), jobs=2).verdict == "unchanged"


def part_of(whole: Dataset, trials: slice) -> Dataset:
    """Return some trials of a data set."""
    return replace(whole, name=f"{whole.name}, trials {trials.start}", trials=whole.trials[trials])
