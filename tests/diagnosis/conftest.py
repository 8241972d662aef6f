"""A part of a diagnosis that fails is a failure of the test, not a note in a report."""

from __future__ import annotations

import pytest

from catheter_sim.errors import TRACEBACK_VARIABLE


@pytest.fixture(autouse=True)
def defects_are_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(TRACEBACK_VARIABLE, "1")
