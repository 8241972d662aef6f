"""Twins of many robots that are much alike: shared work changes no number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from planted import as_inputs

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.effects.apply import with_effects
from catheter_sim.robots.continuum import planar_batch
from catheter_sim.robots.continuum.planar import planar_chain, step_counts
from catheter_sim.robots.rolling import twin as rolling_twin
from catheter_sim.robots.rolling.complete import ways
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.theory.twins import twin_for

NO_GRAVITY = np.zeros(3)
DOWN = np.array([0.0, 0.0, -9.81])
COLUMNS = ("tip_x_mm", "tip_z_mm")
CHANGES: list[dict[str, dict[str, float]]] = [
    {},
    {"stiffness": {"scale": 1.03}},
    {"tendon_friction": {"mu": 0.28}},
    {"actuation_gain": {"scale": 0.97}},
    {"measurement_frame": {"translation_x_mm": 3.0}},
]


def history(name: str, tendons: int, rows: int = 16) -> Inputs:
    """Return random pulls of one tendon at a time, and of all at once from the middle on."""
    rng = np.random.default_rng(5)
    most = {"chest_tube": 12.0, "chest_tube_section": 12.0, "spacer_disk": 4.0}.get(name, 0.5)
    level = np.zeros((rows, tendons))
    for row in range(1, rows):
        if row < rows // 2:
            level[row, rng.integers(tendons)] = rng.uniform(0.0, most)
        else:
            level[row] = rng.uniform(0.0, 0.4 * most, tendons)
    return as_inputs(level, "tension")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "gravity"),
    [
        ("neuroendoscope_section", NO_GRAVITY),
        ("neuroendoscope", NO_GRAVITY),
        ("chest_tube_section", NO_GRAVITY),
        ("chest_tube", NO_GRAVITY),
        ("chest_tube", DOWN),
        ("spacer_disk", DOWN),
    ],
)
def test_a_robot_among_others_is_that_robot_alone(name: str, gravity: Array) -> None:
    """To 1e-6 mm, but that a planar robot that bends less has fewer steps alone.

    Where a chest tube's rods work against one another, steps and the start of a search choose among the
    equilibria that sticking leaves: there the tip is within 0.2 mm of 375.
    """
    base = load_robot(name)
    inputs = history(name, len(base.tendons))
    columns = ("tip_y_mm", "tip_z_mm") if name == "spacer_disk" else COLUMNS
    predict = twin_for(base, "tension", columns, gravity)
    robots = [with_effects(base, changes) for changes in CHANGES]
    together = predict(robots, inputs)
    assert np.isfinite(together).all()
    assert np.ptp(together[:, :, 0]) > 5.0
    for robot, outputs in zip(robots, together, strict=True):
        pair = predict([robots[0], robot], inputs)  # of the same steps as all of them
        alone = predict([robot], inputs)[0]
        np.testing.assert_allclose(pair[1], outputs, rtol=0, atol=1e-6)
        steps_of_their_own = name.startswith("neuro") and {"actuation_gain", "stiffness"} & {*robot.effects}
        if not steps_of_their_own:
            many_ways = name == "chest_tube" and not gravity.any()
            np.testing.assert_allclose(alone, outputs, rtol=0, atol=0.2 if many_ways else 1e-6)


@dataclass(frozen=True)
class Counted:
    """A twin that notes how many robots it is asked for."""

    twin: Any
    asked: list[int]

    def solve(self, robots: Sequence[Any], *others: Any) -> Any:
        self.asked.append(len(robots))
        return self.twin.solve(robots, *others)


def test_what_is_seen_otherwise_alone_is_solved_once() -> None:
    """Of six robots three are distinct; angles, which are worked out late, are each one's own."""
    base = load_robot("neuroendoscope_section")
    inputs = as_inputs(np.array([[0.0, 0.0], [0.3, 0.0], [0.1, 0.2]]), "tension")
    columns = (*COLUMNS, "joint_x3_deg", "tip_qy")
    predict = twin_for(base, "tension", columns, NO_GRAVITY)
    changes: list[dict[str, dict[str, float]]] = [
        {},
        {"measurement_frame": {"translation_x_mm": 3.0}},
        {"stiffness": {"scale": 1.2}},
        {"measurement_frame": {"rotation_y_deg": 5.0}},
        {"actuation_gain": {"scale": 0.9}},
        {"stiffness": {"scale": 1.2}, "measurement_frame": {"translation_z_mm": 1.0}},
    ]
    robots = [with_effects(base, item) for item in changes]
    asked: list[int] = []
    counted = replace(predict, twin=Counted(predict.twin, asked))
    together = counted(robots, inputs)
    assert asked == [3]
    for robot, outputs in zip(robots, together, strict=True):
        np.testing.assert_allclose(predict([robot], inputs)[0], outputs, rtol=0, atol=1e-6)
    assert together[1, 1, 0] - together[0, 1, 0] == pytest.approx(3.0)


@pytest.mark.parametrize("name", ["neuroendoscope", "chest_tube"])
def test_tendons_of_one_end_may_move_in_one_step(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps fifty times as short lead to the same places; where all move, steps stay short."""
    base = load_robot(name)
    inputs = history(name, len(base.tendons))
    alone = replace(
        inputs, **{key: getattr(inputs, key)[:8] for key in ("time_s", "tendon", "force_tip", "moment_tip")}
    )
    change = np.diff(inputs.tendon, axis=0, prepend=0.0)
    one_at_a_time = np.abs(change[1:8]).max(axis=1) == np.abs(change[1:8]).sum(axis=1)
    ends = np.array([tendon.ends_at for tendon in base.tendons])
    within = [len({*ends[row != 0.0]}) <= 1 for row in change[:8]]
    assert sum(within) > 2
    assert one_at_a_time.any()
    predict = twin_for(base, "tension", COLUMNS, NO_GRAVITY)
    found = predict([base], alone)
    if name == "neuroendoscope":
        chain = planar_chain(base, "test")
        long = step_counts(chain, inputs, planar_batch.STEP_BEND_RAD, planar_batch.ALONE_STEP_BEND_RAD)
        short = step_counts(chain, inputs, planar_batch.STEP_BEND_RAD)
        monkeypatch.setattr(planar_batch, "STEP_BEND_RAD", 0.02)
        monkeypatch.setattr(planar_batch, "ALONE_STEP_BEND_RAD", 0.02)
    else:
        rolling = rolling_chain(base)
        own = rolling_twin._STEP_RAD
        long = ways(rolling, inputs, NO_GRAVITY, (), own, rolling_twin._ALONE_STEP_RAD).steps[1:]
        short = ways(rolling, inputs, NO_GRAVITY, (), own).steps[1:]
        monkeypatch.setattr(rolling_twin, "_STEP_RAD", 0.004)
        monkeypatch.setattr(rolling_twin, "_ALONE_STEP_RAD", 0.004)
    assert long[:8].sum() < short[:8].sum()
    assert long[9:].sum() > 0.9 * short[9:].sum()
    np.testing.assert_allclose(predict([base], alone), found, rtol=0, atol=0.02)


def test_a_row_that_was_there_before_has_the_same_balance() -> None:
    """Without friction inputs alone decide: repeats are copied, to the last digit."""
    base = load_robot("spacer_disk")
    levels = np.random.default_rng(2).uniform(0.0, 4.0, (5, len(base.tendons)))
    repeated = as_inputs(levels[[0, 1, 2, 1, 3, 0, 2, 4]], "tension")
    predict = twin_for(base, "tension", COLUMNS, DOWN)
    found = predict([base], repeated)[0]
    for first, again in ((1, 3), (0, 5), (2, 6)):
        assert np.array_equal(found[first], found[again])
    single = predict([base], as_inputs(levels, "tension"))[0]
    np.testing.assert_allclose(found[[0, 1, 2, 4, 7]], single, rtol=0, atol=1e-6)
    np.testing.assert_allclose(predict([base], repeated, 2)[0], found[::2], rtol=0, atol=1e-6)
