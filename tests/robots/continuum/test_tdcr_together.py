"""Rows that are solved eight at once have the equilibria of rows that are solved by themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.robots.continuum import lumped, rods
from catheter_sim.robots.continuum.lumped_kernels import ARC, LINKS, LINKS_MIDDLE, LINKS_ONE
from catheter_sim.robots.continuum.published import spacer_disk
from catheter_sim.robots.continuum.rods import RodLoad, RodProblem, problem

FULL_PULL_N = 5.55
ROWS = 19  # two eights and three


def _loads(body: RodProblem, size_N: float, rows: int = ROWS, pull_N: float = FULL_PULL_N) -> RodLoad:
    """Return random tensions and forces on the tip; the first row has none, the second one no tension."""
    rng = np.random.default_rng(5)
    n = len(body.length_m)
    tension = rng.uniform(0.0, pull_N, (rows, len(body.hole_m)))
    force, moment = np.zeros((rows, n, 3)), np.zeros((rows, n, 3))
    force[:, -1] = rng.normal(size=(rows, 3)) * size_N
    moment[:, -1] = rng.normal(size=(rows, 3)) * size_N * 0.02
    tension[:2], force[0], moment[0] = 0.0, 0.0, 0.0
    return RodLoad(tension, force, moment)


def _row(loads: RodLoad, k: int) -> RodLoad:
    return RodLoad(loads.tension_N[k : k + 1], loads.force_N[k : k + 1], loads.moment_N_m[k : k + 1])


@pytest.mark.parametrize("model", [ARC, LINKS, LINKS_MIDDLE, LINKS_ONE])
@pytest.mark.parametrize("mu", [0.0, 0.2])
@pytest.mark.parametrize("softness", [1.0, 4.0])  # at 4 the loads are raised in steps
def test_lumped_robots(model: int, mu: float, softness: float) -> None:
    body = replace(problem(spacer_disk()), mu=mu)
    body = replace(body, bending_N_m2=body.bending_N_m2 / softness, torsion_N_m2=body.torsion_N_m2 / softness)
    loads = _loads(body, 0.03 / softness)
    together = lumped.equilibria(body, loads, model)
    assert (together.steps == 1).all() == (softness == 1.0)
    for k in range(ROWS):
        alone = lumped.equilibria(body, _row(loads, k), model)
        assert together.reached[k] == alone.reached[0] == 1.0
        assert together.residual[k] == pytest.approx(alone.residual[0], abs=1e-12)
        assert np.allclose(together.p_w[k], alone.p_w[0], rtol=0.0, atol=1e-13)
        assert np.allclose(together.R_w[k], alone.R_w[0], rtol=0.0, atol=1e-11)
        assert np.allclose(together.span_tension[k], alone.span_tension[0], rtol=1e-11)
        assert np.allclose(together.wrench[k], alone.wrench[0], rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("path", list(rods.PATHS))
@pytest.mark.parametrize("size_N", [0.0, 0.03, 0.6])  # at 0.6 some rows take several steps
def test_rods(path: str, size_N: float) -> None:
    body = problem(spacer_disk())
    loads = _loads(body, size_N)
    together = rods.equilibria(body, loads, path)
    for k in range(ROWS):
        alone = rods.equilibria(body, _row(loads, k), path)
        assert together.reached[k] == alone.reached[0] == 1.0
        assert np.abs(together.unbalanced[k]).max() < 1e-10
        assert np.allclose(together.p_w[k], alone.p_w[0], rtol=0.0, atol=1e-11)
        assert np.allclose(together.R_w[k], alone.R_w[0], rtol=0.0, atol=1e-9)
        assert np.allclose(together.span_tension[k], alone.span_tension[0], rtol=1e-12)
        assert np.allclose(together.wrench[k], alone.wrench[0], rtol=0.0, atol=1e-9)


def test_rows_near_one_another_follow_the_row_before() -> None:
    """A slow series takes the way that it took, whatever the number of rows: it is history."""
    body = problem(spacer_disk())
    tension = np.linspace(0.0, 1.0, 40)[:, None] * [FULL_PULL_N, 0.0, 0.3 * FULL_PULL_N, 0.0]
    zero = np.zeros((40, len(body.length_m), 3))
    loads = RodLoad(tension, zero, zero)
    assert not rods.far_from_before(body, loads)[1:].any()
    assert rods.far_from_before(body, RodLoad(tension[::-20], zero[::-20], zero[::-20])).all()
