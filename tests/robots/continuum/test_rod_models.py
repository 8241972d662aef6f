"""Claims about the rod models that take a moment: weight, and which row has no equilibrium."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.theory.static_models import STATIC_MODELS

RIGIDITY = 211e9 * np.pi * 0.4e-3**4 / 4.0  # [N m^2]


def rows(*tension: tuple[float, ...]) -> Inputs:
    count = len(tension)
    zeros = np.zeros((count, 3))
    return Inputs(np.arange(float(count)), "tension", np.array(tension, float), zeros, zeros)


@pytest.mark.parametrize("gravity", [(0.05, 0.0, 0.0), (0.0, -0.05, 0.0)])
@pytest.mark.parametrize("model", ["CC_sub", "PRB", "VC", "CC"])
@pytest.mark.parametrize("masses", ["along", "faces"])
def test_tip_sags_as_a_cantilever_with_its_disks(model: str, gravity: tuple[float, ...], masses: str) -> None:
    """The tip goes where gravity points: sum of m g z^2 (3 L - z) / 6 EI over the disks; arcs less well.

    A weight along the robot sags by w L^4 / 8 EI, which is 5 % less.
    """
    settings = [f"segments.{name}.mass_g=4" for name in ("first", "second")]
    robot = load_robot("spacer_disk", ("disks_per_segment=10", f"masses={masses}", *settings))
    run = STATIC_MODELS[model].solve(robot, rows((0, 0, 0, 0)), np.array(gravity))
    z = np.arange(1, 21) * 5e-3
    per_weight = float(np.sum(0.4e-3 * z**2 * (0.3 - z)) / (6.0 * RIGIDITY))
    if masses == "along":
        per_weight = 0.08 * 0.1**4 / (8.0 * RIGIDITY)
    expected = per_weight * np.array(gravity)
    tip = run.postures[0].p_w[-1]
    close = {"CC": 0.2, "CC_sub": 0.1}.get(model, 0.01)
    assert tip[:2] == pytest.approx(expected[:2], rel=close, abs=1e-9)


@pytest.mark.parametrize("row", [1, 3])
def test_row_without_an_equilibrium_is_named(row: int) -> None:
    """At a tenth of the stiffness PRB carries 0.1 N and not 20 N."""
    tension = [(0.1, 0.0, 0.0, 0.0), (0.2, 0.0, 0.0, 0.0)]
    tension.insert(row - 1, (20.0, 0.0, 20.0, 0.0))
    robot = load_robot("spacer_disk", ("disks_per_segment=2", "stiffness_scale=0.1"))
    message = rf"PRB finds no equilibrium at row {row} \(time_s = {row - 1}\)"
    with pytest.raises(InputError, match=message):
        STATIC_MODELS["PRB"].solve(robot, rows(*tension), np.zeros(3))
