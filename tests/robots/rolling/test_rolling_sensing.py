"""Claims about the shape that is sensed from measured tensions, and how sure it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rolling_cases import HANGING, NO_GRAVITY, pulls

from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling.complete import complete, complete_sliding
from reference.rolling_sensing import sense_shape

pytestmark = pytest.mark.slow

TENSION_N = [2.0, 5.0, 10.0, 20.0, 35.0, 50.0, 45.0, 20.0]


def test_spread_is_that_of_drawn_noise() -> None:
    """Noise of 0.2 N: the stated deviation of the tip is that of 300 noisy histories within 20 % or 0.03 mm.

    On the way out, and after the turn, where the rod sticks and remembers the noise of the row before.
    """
    robot = load_robot("chest_tube_section")
    inputs = pulls(TENSION_N)
    sensed = sense_shape(robot, inputs, NO_GRAVITY, 0.2)
    draw = np.random.default_rng(11)
    drawn = []
    for _ in range(300):
        noisy = np.maximum(inputs.tendon + draw.normal(0.0, 0.2, inputs.tendon.shape), 0.0)
        run = complete(robot, replace(inputs, tendon=noisy), NO_GRAVITY)
        drawn.append([posture.p_w[[5, 14]] for posture in run.postures])
    spread = np.std(drawn, axis=0) * 1e3
    stated = sensed.standard_deviation[:, [5, 14]] * 1e3
    np.testing.assert_allclose(stated, spread, rtol=0.2, atol=0.03)
    assert spread[:, 1].max() > 1.0


def test_spread_of_a_parameter_is_that_of_drawn_parameters() -> None:
    """Friction known to 0.03, stiffness to 2 %: the tip's covariance is that of 300 robots within 20 %."""
    inputs = pulls([20.0])
    known = {"friction.mu": 0.03, "stiffness_scale": 0.02}
    sensed = sense_shape(load_robot("chest_tube_section"), inputs, HANGING, 0.0, known)
    draw = np.random.default_rng(12)
    drawn = []
    for _ in range(300):
        settings = (
            f"friction.mu={0.316 + draw.normal(0, 0.03)}",
            f"stiffness_scale={1 + draw.normal(0, 0.02)}",
        )
        run = complete(load_robot("chest_tube_section", settings), inputs, HANGING)
        drawn.append(run.postures[0].p_w[-1])
    spread = np.cov(np.array(drawn).T)
    stated = sensed.covariance[0, -1]
    np.testing.assert_allclose(stated, spread, atol=0.2 * np.abs(spread).max())


def test_shares_add_up_and_none_is_none() -> None:
    """The covariance is the sum of its causes, zero without deviations; the shape is `complete_sliding`'s."""
    robot = load_robot("chest_tube_section")
    inputs = pulls(TENSION_N)
    sensed = sense_shape(robot, inputs, HANGING, 0.1, {"clearance_mm": 0.02, "friction.mu": 0.01})
    assert list(sensed.shares) == ["tension", "clearance_mm", "friction.mu"]
    np.testing.assert_allclose(sum(sensed.shares.values()), sensed.covariance)
    assert all(share[:, -1, 0, 0].max() > 0.0 for share in sensed.shares.values())
    certain = sense_shape(robot, inputs, HANGING, 0.0)
    assert not certain.covariance.any()
    alike = complete_sliding(robot, inputs, HANGING).postures
    for one, other in zip(certain.run.postures, alike, strict=True):
        np.testing.assert_array_equal(one.p_w, other.p_w)


def test_wrong_deviations_are_named() -> None:
    """An unknown parameter names the choices; a deviation below zero is refused."""
    robot = load_robot("chest_tube_section")
    with pytest.raises(
        InputError, match=r"unknown parameter 'friction\.nu'; choices: friction\.mu, segments\."
    ):
        sense_shape(robot, pulls([1.0]), NO_GRAVITY, 0.1, {"friction.nu": 0.1})
    with pytest.raises(InputError, match="tension_deviation_N: a standard deviation of -1"):
        sense_shape(robot, pulls([1.0]), NO_GRAVITY, -1.0)


def test_a_robot_of_another_kind_is_one_line() -> None:
    """It names the robot and what knows every kind."""
    with pytest.raises(
        InputError, match="spacer_disk: not a robot of rolling joints; of every kind: the verb"
    ):
        sense_shape(load_robot("spacer_disk"), pulls([1.0]), NO_GRAVITY, 0.1)
