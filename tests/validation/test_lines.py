"""Claims about a validation's lines and measures that need no long run."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.core.robot import Friction
from catheter_sim.robots.continuum.exact_arm import fkm_exact_arm
from catheter_sim.robots.continuum.published import neuroendoscope_section
from catheter_sim.validation.lines import (
    JUDGED,
    KINDS,
    PREDICTED,
    VERIFIED,
    Line,
    Validation,
    constant_of,
    history,
    loop_area,
)
from catheter_sim.validation.neuroendoscope import violations


def line(error: float, tolerance: float | None = 1.0) -> Line:
    return Line("robot", "tip", "mm", error, tolerance, "a test")


@pytest.mark.parametrize(
    ("error", "tolerance", "passes"),
    [(1.0, 1.0, True), (1.01, 1.0, False), (math.nan, 1.0, False), (math.inf, 1.0, False), (5.0, None, True)],
)
def test_a_line_passes_within_its_tolerance_and_never_undefined(
    error: float, tolerance: float | None, passes: bool
) -> None:
    assert line(error, tolerance).passed is passes


def test_every_line_must_pass_and_there_must_be_one() -> None:
    assert Validation((line(0.5), line(0.2)), ()).passed
    assert not Validation((line(0.5), line(2.0)), ()).passed
    assert not Validation((line(2.0), line(0.5)), ()).passed
    assert not Validation((), ()).passed


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in JUDGED])
def test_only_what_is_verified_or_predicted_is_judged(kind: str) -> None:
    """A figure that was coded, fitted, read back or assumed informs; a tolerance for it is refused."""
    told = Line("robot", "tip", "mm", 0.1, None, "a test", kind=kind)
    assert told.verdict == "for information"
    assert kind in Validation((told, line(0.5)), ()).table_text()
    with pytest.raises(ValueError, match=f"tip: {kind}, so not to be judged"):
        Line("robot", "tip", "mm", 0.1, 1.0, "a test", kind=kind)


def test_an_unknown_kind_names_the_choices() -> None:
    with pytest.raises(ValueError, match="kind 'guessed'; choices: implemented, verified, predicted"):
        Line("robot", "tip", "mm", 0.1, None, "a test", kind="guessed")


def test_a_prediction_has_something_printed_beside_it() -> None:
    """A figure or words; two models of ours against each other are verified, which is what a line is."""
    assert line(0.5).kind == VERIFIED
    for printed in ({"published": 1.0}, {"said": "smaller"}):
        told = Line("robot", "tip", "mm", 0.1, 1.0, "a test", kind=PREDICTED, **printed)
        assert ("smaller" in Validation((told,), ()).table_text()) is ("said" in printed)
    with pytest.raises(ValueError, match="predicted, and nothing printed or measured stands beside it"):
        Line("robot", "tip", "mm", 0.1, 1.0, "a test", analytic=1.0, kind=PREDICTED)


def test_judged_lines_name_their_constant() -> None:
    """Whose and which, by robot and quantity; a line that is not judged names none."""
    assert line(0.5).about == "simulation: stiffness"
    assert line(0.5, None).about == "-"
    assert constant_of("neuroendoscope_section", "partial loop: loop area of tip") == "simulation: friction"
    assert constant_of("chest_tube", "complete: times that a rod slides") == "complete: friction"
    assert constant_of("spacer_disk", "scenario 1, 2 disks, VC: mean") == "static models: stiffness"


@pytest.mark.parametrize("reverse", [False, True])
def test_area_inside_a_triangle(reverse: bool) -> None:
    """Legs of 3 and 4: an area of 6, whichever way round."""
    x, y = np.array([0.0, 3.0, 0.0]), np.array([1.0, 1.0, 5.0])
    way = slice(None, None, -1 if reverse else 1)
    assert loop_area(x[way], y[way]) == pytest.approx(6.0)


def test_history_ends_in_its_last_corner_and_keeps_its_step() -> None:
    """0, 0.3, 0.1 in steps of at most 0.1: six rows, all corners among them."""
    rows = history([(0.0, 0.2), (0.3, 0.2), (0.1, 0.2)], 0.1).tendon
    assert rows[:, 0] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.2, 0.1])
    assert rows[:, 1] == pytest.approx(np.full(6, 0.2))


def test_slipping_without_full_friction_is_counted() -> None:
    """Loading with mu = 0.2: every eyelet slips by just that capstan factor, less than mu = 0.3 asks."""
    robot = replace(neuroendoscope_section(), friction=Friction(0.2))
    postures = fkm_exact_arm(robot, history(((0.1, 0), (0.2, 0)), 0.1), np.zeros(3)).postures
    assert violations(postures, 0.2) == 0
    assert violations(postures, 0.3) > 20
