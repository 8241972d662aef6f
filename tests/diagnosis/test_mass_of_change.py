"""Claims about forces that are told as masses."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.diagnosis.changes.differences import mass_of
from catheter_sim.diagnosis.result import Cause, FittedParameter

DOWN = np.array([0.0, 0.0, 9.81])


def payload(*force: float, half: float = 0.1) -> Cause:
    numbers = {
        f"force_{axis}_N": FittedParameter(value, (value - half, value + half), 0.0)
        for axis, value in zip("xyz", force, strict=True)
    }
    return Cause("payload", numbers, 100.0)


def test_a_weight_is_a_mass() -> None:
    """A newton along a weight of 9.81 N/kg is 101.9 g, its interval likewise; taken away, it is negative."""
    found = mass_of(payload(0.02, -0.05, 0.981), DOWN)
    assert found is not None
    assert found.mass_g.value == pytest.approx(100.0)
    assert found.mass_g.ci95 == pytest.approx((100.0 - 10.194, 100.0 + 10.194), abs=1e-3)
    assert found.sideways_N == pytest.approx(np.hypot(0.02, 0.05))
    gone = mass_of(payload(0.0, 0.0, -0.981), DOWN)
    assert gone is not None
    assert gone.mass_g.value == pytest.approx(-100.0)


def test_what_is_no_weight_is_no_mass() -> None:
    """A push from the side, a force where nothing weighs, another cause."""
    assert mass_of(payload(0.5, 0.0, 0.981), DOWN) is None
    assert mass_of(payload(0.0, 0.0, 0.981), np.zeros(3)) is None
    assert mass_of(Cause("stiffness", {"scale": FittedParameter(0.1, (0.0, 0.2), 0.0)}, 50.0), DOWN) is None
