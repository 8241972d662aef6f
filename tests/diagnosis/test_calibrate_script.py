"""Probabilities that hang on the verdict alone are the shares that were right, one of each kind added."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "calibrate_probabilities.py"


@pytest.fixture
def script(monkeypatch):
    """The script as a module."""
    spec = importlib.util.spec_from_file_location("calibrate_script", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "calibrate_script", module)
    spec.loader.exec_module(module)
    return module


def test_counted_answers_promise_their_shares(script):
    """Of 35 sound sets none hid a cause, of 9 others 2 did not: 36 of 37 and 3 of 11 by hand."""
    basis = np.array([(1.0, 0.0)] * 35 + [(1.0, 1.0)] * 9)
    true = np.array([1.0] * 35 + [1.0] * 2 + [0.0] * 7)
    weights = script.weigh("none", basis, true)
    promised = script.chance(np.array([(1.0, 0.0), (1.0, 1.0)]) @ weights)
    assert promised == pytest.approx([36 / 37, 3 / 11], abs=1e-12)
    penalised = script.chance(np.array([(1.0, 0.0)]) @ script.fitted(basis, true))
    assert penalised[0] < 36 / 37 - 0.01


def test_one_sort_of_answers_is_enough(script):
    """Causes that no good hypothesis has: none of 231 was at work."""
    weights = script.weigh("others", np.ones((231, 1)), np.zeros(231))
    assert script.chance(weights)[0] == pytest.approx(1 / 233, abs=1e-12)
