"""Claims about the figures that a page tells where a data set has several units."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from catheter_sim.diagnosis.result import DiagnosisResult, UnitResult


def told(causes: tuple[str, ...], **gains: tuple[float, float]) -> str:
    units = {unit: UnitResult(unit, 0.1, 1.0, 0.5, 50.0, interval) for unit, interval in gains.items()}
    first = next(iter(units))
    diagnosis = SimpleNamespace(is_corrected=bool(causes), by_unit=units, headline=units[first])
    return DiagnosisResult.shown.fget(diagnosis).unit


@pytest.mark.parametrize(
    ("causes", "gains", "unit"),
    [
        (("actuation_gain",), {"mm": (-0.1, 0.1), "deg": (80.0, 95.0)}, "deg"),  # a scale of torsion alone
        (("actuation_gain",), {"mm": (5.0, 10.0), "deg": (80.0, 95.0)}, "mm"),
        (("actuation_gain",), {"mm": (-0.1, 0.1), "deg": (-3.0, 2.0)}, "mm"),
        ((), {"mm": (0.0, 0.0), "deg": (0.0, 0.0)}, "mm"),
    ],
)
def test_a_page_tells_of_a_unit_that_the_causes_help(causes, gains, unit):
    """The one reported where they help it; else the one that gains most, if any does."""
    assert told(causes, **gains) == unit
