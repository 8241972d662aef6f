"""The rod that other programs are compared on, its reference, and the rows of the table."""

from __future__ import annotations

import builtins
import math
from typing import Any

import pytest

from peers import rods as ours
from peers import table, tdcr_modeling
from peers.rods import (
    AREA_M2,
    FORCES_N,
    LENGTH_M,
    SECOND_MOMENT_M4,
    SHEAR_PA,
    STIFFER,
    YOUNG_PA,
    Measured,
    fitted_scale,
    tip_reference,
)


def test_the_reference_is_timoshenkos_beam_under_a_small_force() -> None:
    force = 1e-4
    bent = force * LENGTH_M**3 / (3.0 * YOUNG_PA * SECOND_MOMENT_M4)
    sheared = force * LENGTH_M / (SHEAR_PA * AREA_M2)
    x, z = tip_reference(1.0, force)
    assert x == pytest.approx(bent + sheared, rel=1e-6)
    assert LENGTH_M - z == pytest.approx(0.6 * bent**2 / LENGTH_M, rel=1e-2)  # 3/5 w^2 / L


def test_a_stiffer_rod_bends_as_one_under_less_force() -> None:
    assert tip_reference(2.0, 0.2) == pytest.approx(tip_reference(1.0, 0.1), abs=1e-9)


def test_the_static_model_bends_as_the_reference() -> None:
    program = ours.static_model()
    for force in FORCES_N:
        assert math.dist(program.tip(1.0, force), tip_reference(1.0, force)) < 1e-7 * LENGTH_M
    assert math.dist(program.tip(1.1, 0.2), tip_reference(1.0, 0.2)) > 1e-3 * LENGTH_M


def test_the_fit_finds_the_stiffness_of_the_reference() -> None:
    assert fitted_scale(tip_reference) == pytest.approx(STIFFER, rel=1e-5)


def test_a_program_that_is_not_there_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name.split(".")[0] in ("elastica", "jax"):
            raise ImportError(name)
        return plain(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    for name in ("PyElastica", "SoRoMoX"):
        row = table.measure(name, 1)
        assert row.error_percent is None
        first = Measured("ours", "", 0.0, 1e-3, fit_s=1.0, fit_error_percent=0.0)
        assert "pip install pyelastica soromox" in table.text([first, row])


def test_rows_of_the_authors_program_scale_with_the_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tdcr_modeling, "shortest", lambda call, turns: 2.0 * tdcr_modeling.LOOP_THERE_S)
    monkeypatch.setattr(tdcr_modeling, "THEIRS_S", {"CC": 1.0})
    (row,) = tdcr_modeling.measure(1)
    assert row.times == pytest.approx(2.0 * 1.0 / (2.0 * tdcr_modeling.LOOP_THERE_S))
    assert "CC" in tdcr_modeling.text([row])
