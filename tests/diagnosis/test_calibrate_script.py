"""Probabilities that hang on the verdict alone are the shares that were right, one of each kind added."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.diagnosis.probabilities import CauseEvidence, Evidence
from tests.scripts_as_modules import script_module


@pytest.fixture
def script():
    """The script as a module."""
    return script_module("calibrate_probabilities")


def test_counted_answers_promise_their_shares(script):
    """Of 35 sound sets none hid a cause, of 9 others 2 did not: 36 of 37 and 3 of 11 by hand."""
    basis = np.array([(1.0, 0.0)] * 35 + [(1.0, 1.0)] * 9)
    true = np.array([1.0] * 35 + [1.0] * 2 + [0.0] * 7)
    weights = script.weigh("others", basis, true)
    promised = script.chance(np.array([(1.0, 0.0), (1.0, 1.0)]) @ weights)
    assert promised == pytest.approx([36 / 37, 3 / 11], abs=1e-12)
    free = script.chance(np.array([(1.0, 0.0)]) @ script.fitted(basis, true, (0.0, 0.0)))
    assert free[0] > 0.999  # what never failed would be told as certain


def test_a_group_is_one_answer(script):
    """It is right where any member is at work; which one is asked apart, where just one is."""
    evidence = Evidence({"backlash": CauseEvidence(True, 2.0, members={"rate": 0.4})}, 3.0, 9, 1.0, 0.0, 0.0)
    rows = {(row.kind, row.name): row for row in script._rows(evidence, {"rate"}, False, 0)}
    assert rows["named", "backlash"].true
    assert rows["member", "backlash"].features == (0.0, 0.4)
    assert not rows["member", "backlash"].true
    assert ("others", "rate") not in rows
    kinds = [row.kind for row in script._rows(evidence, {"backlash", "rate"}, False, 0)]
    assert "member" not in kinds


def test_one_sort_of_answers_is_enough(script):
    """Causes that no good hypothesis has: none of 231 was at work."""
    weights = script.weigh("others", np.ones((231, 1)), np.zeros(231))
    assert script.chance(weights)[0] == pytest.approx(1 / 233, abs=1e-12)


def test_no_weight_goes_against_its_sign(script):
    """More of what speaks for a cause never makes it less probable, though a few answers say so by chance."""
    basis = np.array([(1.0, value) for value in (0.0, 1.0, 2.0, 3.0)] * 5)
    true = np.array([1.0, 1.0, 0.0, 0.0] * 5)
    assert script.fitted(basis, true, (0.0, 0.0))[1] < -2.0
    assert script.fitted(basis, true, (0.0, 1.0))[1] == 0.0
    assert script.fitted(basis, 1.0 - true, (0.0, 1.0))[1] > 1.0
    assert script.fitted(basis[:1], true[:1], (0.0, 1.0))[1] == pytest.approx(1.0)  # one answer says nothing
