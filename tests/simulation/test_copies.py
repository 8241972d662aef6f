"""Copies of a robot on a batch go the way of one simulator alone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.envs.robots import Plant
from catheter_sim.simulation.copies import Copies, copied_together
from catheter_sim.simulation.simulator import Simulator

ELASTIC = ("segments.section.stiffness_quintic_mm4=1e5",)
YIELDING = ("segments.first.plastic_share=0.4", "segments.first.yield_curvature_per_m=0.5")
COUNT = 4


def plant(robot: str, settings: tuple[str, ...] = (), actuation: str | None = None) -> Plant:
    return Plant(load_robot(robot, settings), actuation, (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("robot", "settings", "actuation"),
    [
        ("neuroendoscope_section", (), None),
        ("neuroendoscope_section", ("friction.mu=0",), None),
        ("neuroendoscope_section", ELASTIC, None),
        ("spacer_disk", YIELDING, "tension"),
        ("mitral_4dof", (), None),
        ("notched_wrist", (), None),
        ("notched_wrist", ("friction.mu=0",), None),
        ("notched_wrist", (), "displacement"),
        ("notched_wrist", ("bending_axes=xy",), None),
        pytest.param("neuroendoscope_section", (), "displacement", marks=pytest.mark.slow),
        pytest.param("neuroendoscope", (), None, marks=pytest.mark.slow),
        pytest.param("chest_tube_section", (), None, marks=pytest.mark.slow),
        pytest.param("mitral_transseptal", ("tendons.bending.play_mm=0.2",), None, marks=pytest.mark.slow),
    ],
)
def test_copies_move_as_one_alone(robot: str, settings: tuple[str, ...], actuation: str | None) -> None:
    """Positions, tips and tensions, each copy under its own inputs, some of them at rest meanwhile."""
    alone = plant(robot, settings, actuation)
    assert copied_together(alone.simulator)
    copies = Copies(alone.simulator, COUNT)
    moved = np.array([0, 2, 3])
    rng = np.random.default_rng(3)
    levels = np.clip(np.cumsum(rng.uniform(-0.05, 0.1, (3, 4, len(alone.level))), axis=0), 0.0, 1.0)
    inputs = np.zeros((COUNT, len(alone.specified.tendons)))
    seen = []
    copies.settle(np.arange(COUNT))
    for level in levels:
        wanted = alone.inputs_at(level)
        assert wanted is not None
        copies.ramp(moved, inputs[moved], wanted[moved], 0.1)
        inputs[moved] = wanted[moved]
        seen.append((copies.qpos[moved], *copies.tips(moved)))
    copies.settle(np.arange(COUNT))
    for place, copy in enumerate(moved):
        alone.reset()
        for level, at in zip(levels, seen, strict=True):
            alone.move(level[copy], 0.1)
            posture = alone.posture()
            expected = (
                alone.simulator.data.qpos,
                posture.p_w[-1],
                posture.R_w[-1],
                posture.actuator_tension,
            )
            for values, value in zip(at, expected, strict=True):
                assert values[place] == pytest.approx(value, rel=0, abs=1e-12)
        alone.settle()
        assert copies.qpos[copy] == pytest.approx(alone.simulator.data.qpos, rel=0, abs=1e-12)
    alone.reset()
    assert copies.qpos[1] == pytest.approx(alone.simulator.data.qpos, rel=0, abs=1e-12)


def test_a_copy_that_is_not_finite_is_named_and_reset_heals_it() -> None:
    """The others go on as they would have; afterwards it stands as at first."""
    alone = plant("neuroendoscope_section")
    copies, calm = Copies(alone.simulator, 3), Copies(alone.simulator, 3)
    everyone = np.arange(3)
    pulled = np.tile([0.2, 0.0], (3, 1))
    copies.qvel[1, 5] = math.nan
    for some in (copies, calm):
        some.ramp(everyone, np.zeros((3, 2)), pulled, 0.1)
        some.settle(everyone, 0.2)
    assert copies.finite(everyone).tolist() == [True, False, True]
    assert np.array_equal(copies.qpos[[0, 2]], calm.qpos[[0, 2]])
    for some in (copies, calm):
        some.reset(np.array([1]))
    assert copies.finite(everyone).all()
    assert np.array_equal(copies.qpos, calm.qpos)


def test_a_notched_tube_forgets_what_stretched_it() -> None:
    """After a reset a pull leads where it led at first; the strips' stretches are part of the way."""
    alone = plant("notched_wrist")
    copies, both = Copies(alone.simulator, 2), np.arange(2)
    rest, pulled = np.zeros((2, 1)), np.full((2, 1), 1.0)
    copies.ramp(both, rest, pulled, 0.003)
    first = copies.qpos.copy()
    copies.ramp(both, pulled, pulled, 0.2)
    assert np.abs(copies.qpos - first).max() > 1e-3
    copies.reset(both)
    copies.ramp(both, rest, pulled, 0.003)
    np.testing.assert_allclose(copies.qpos, first, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("robot", "settings", "together"),
    [
        ("neuroendoscope_section", (), True),
        ("chest_tube_section@prototype", (), False),  # its links give way
        ("mitral_4dof", ("friction.mu=0.1",), False),
    ],
)
def test_what_copies_do_not_know_is_said(robot: str, settings: tuple[str, ...], together: bool) -> None:
    """Histories that are kept in Python are not copied."""
    assert copied_together(Simulator(load_robot(robot, settings))) is together


def test_the_reference_law_is_not_copied() -> None:
    """Nor is friction hole by hole, whose limits are the model's."""
    assert not copied_together(Simulator(load_robot("neuroendoscope_section", ()), friction="nested"))
