"""The kinetostatic model against another one, written apart: a chain of short links at least energy."""

from __future__ import annotations

import numpy as np
import pytest
from notched_cases import LINEAR, WRIST, changed, inputs

from catheter_sim.robots.notched_tube.spec import Superelastic
from catheter_sim.robots.notched_tube.statics import solve_rows
from reference.fine_chain import FineLoads, at_rest, loaded_tensions

SLOPED = Superelastic(60e9, 500e6, 750e6, 0.08)
NONE = np.zeros(3)
pytestmark = pytest.mark.slow


@pytest.mark.parametrize("metal", [LINEAR, WRIST.material, SLOPED], ids=["linear", "flat", "sloped"])
@pytest.mark.parametrize(
    ("tension", "force", "gravity", "axes"),
    [
        (1.6, (0.1, 0.0, 0.2), (0.0, 0.0, 0.0), 1),
        (1.5, (0.05, 0.1, 0.0), (0.0, 0.0, 0.0), 3),
        (3.0, (0.3, 0.5, -0.2), (500.0, 300.0, 0.0), 3),
    ],
)
def test_arcs_are_the_chain_of_many_links(
    metal: Superelastic, tension: float, force: tuple[float, ...], gravity: tuple[float, ...], axes: int
) -> None:
    """Without friction two notches of both models bend and twist alike, in and out of plane: tips to 2 um."""
    robot = changed(mu=0.0, metal=metal, notches=2)
    states = solve_rows([robot], [inputs([tension], force=force)], np.array(gravity))
    acting = FineLoads(np.full(2, tension), np.array(force), np.array(gravity))
    chain = at_rest(robot, acting, links=24, alike=True, axes=axes)
    p_w, _ = states.faces()
    assert np.abs(p_w[0, 0] - chain.face).max() < 2e-6
    turned = chain.turns.sum(axis=1)
    assert states.w[0, 0] == pytest.approx(turned, rel=6e-3, abs=6e-4)
    assert np.abs(turned).max() > 0.05


def test_friction_alike() -> None:
    """With each notch's own tension from the capstan's law the chain bends as the model with friction."""
    robot = changed(metal=SLOPED, notches=3)
    states = solve_rows([robot], [inputs([1.0, 2.4])], NONE)
    bend = states.w[0, 1, :, 1]
    acting = FineLoads(loaded_tensions(robot, 2.4, bend), NONE, NONE)
    chain = at_rest(robot, acting, links=24, alike=True, axes=1)
    assert bend == pytest.approx(chain.turns[:, :, 1].sum(axis=1), rel=6e-3)
    assert bend[0] > 1.2 * bend[2]


def test_what_even_bending_leaves_out_is_small() -> None:
    """Links that turn each on its own, under tension and a force across, move the tip by 0.3 % of its way."""
    robot = changed(mu=0.0, metal=LINEAR, notches=2)
    force = np.array([0.2, 0.0, 0.0])
    acting = FineLoads(np.full(2, 1.0), force, NONE)
    even, free = (at_rest(robot, acting, links=8, alike=alike, axes=1) for alike in (True, False))
    way = np.abs(even.face[-1] - [0.0, 0.0, 3.026e-3]).max()
    assert 0.0 < np.abs(free.face[-1] - even.face[-1]).max() < 0.02 * way
    assert free.energy_J < even.energy_J
