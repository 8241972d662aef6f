"""Claims about the validation itself: it can fail, and it fails for the right reason."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.core.robot import Friction
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.exact_arm import fkm_exact_arm, fkm_sliding
from catheter_sim.robots.continuum.published import neuroendoscope_section
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation.lines import (
    NO_GRAVITY,
    Line,
    Validation,
    given,
    history,
    largest_distance,
    loop_area,
    tips_mm,
)
from catheter_sim.validation.neuroendoscope import ANTAGONISTIC, PARTIAL, PUSHES_N, violations
from catheter_sim.validation.pictures import body_stages
from catheter_sim.validation.report import validate

pytestmark = pytest.mark.slow


def line(error, tolerance=1.0):
    return Line("robot", "tip", "mm", error, tolerance, "a test")


def test_undefined_never_passes():
    """A NaN or infinite error is out of tolerance, in the verdict, the table and the JSON."""
    for bad in (float("nan"), float("inf")):
        assert not line(bad).passed
        assert not Validation((line(0.5), line(bad)), ()).passed
    assert not Validation((), ()).passed
    assert line(1.0).passed
    assert not line(1.0 + 1e-9).passed
    assert "1 OUT" in Validation((line(2.0),), ()).table_text()


def test_results_are_written_with_every_line(tmp_path):
    """JSON holds each line with its verdict; a NaN becomes null."""
    Validation((line(0.5), line(float("nan"))), ("a finding",)).write(tmp_path)
    document = json.loads((tmp_path / "validation.json").read_text())
    assert [item["verdict"] for item in document["lines"]] == ["ok", "OUT"]
    assert document["lines"][1]["error"] is None
    assert not document["passed"]


def test_robot_without_checks_names_the_choices(tmp_path):
    """One line with the choices."""
    with pytest.raises(InputError, match="neuroendoscope_section"):
        validate(["wheelbarrow"], tmp_path)


def test_loop_area_of_a_square():
    """The shoelace formula on a unit square."""
    assert loop_area(np.array([0.0, 1, 1, 0]), np.array([0.0, 0, 1, 1])) == pytest.approx(1.0)


def test_history_runs_through_its_corners():
    """Every corner is a row, and no step is larger than asked for."""
    rows = history(PARTIAL, 0.05).tendon
    for corner in PARTIAL:
        assert np.abs(rows - corner).sum(axis=1).min() < 1e-12
    assert np.abs(np.diff(rows, axis=0)).max() <= 0.05 + 1e-12


@pytest.mark.parametrize("corners", [ANTAGONISTIC, PARTIAL], ids=["antagonistic", "partial"])
def test_simulation_follows_statics_with_sliding_friction(corners):
    """At every row of the loops the tip lies within 0.3 mm of the statics, the area within 3 %."""
    robot, inputs = neuroendoscope_section(), history(corners, 0.05)
    ours = tips_mm(simulate(robot, inputs, NO_GRAVITY).postures)
    theirs = tips_mm(fkm_sliding(robot, inputs, NO_GRAVITY).postures)
    assert largest_distance(ours, theirs) < 0.3
    areas = [loop_area(inputs.tendon[:, 0], tips[:, 0]) for tips in (ours, theirs)]
    assert areas[0] == pytest.approx(areas[1], rel=0.03)


def test_simulation_follows_statics_when_the_tip_is_pushed():
    """Tensions held, tip force out and back: within 0.3 mm of the statics in every row."""
    force = np.zeros((len(PUSHES_N), 3))
    force[:, 0] = PUSHES_N
    inputs = given(np.tile((0.3, 0.1), (len(PUSHES_N), 1)), force_tip=force)
    robot = neuroendoscope_section()
    ours = tips_mm(simulate(robot, inputs, NO_GRAVITY).postures)
    theirs = tips_mm(fkm_sliding(robot, inputs, NO_GRAVITY).postures)
    assert largest_distance(ours, theirs) < 0.3


def test_simulation_obeys_coulomb_where_the_history_rule_does_not():
    """On the way back no tendon of the simulation slides without full friction; the rule's do."""
    robot, inputs = neuroendoscope_section(), history(ANTAGONISTIC, 0.02)
    assert violations(simulate(robot, inputs, NO_GRAVITY).postures, 0.3) == 0
    assert violations(fkm_exact_arm(robot, inputs, NO_GRAVITY).postures, 0.3) > 20


def test_coulomb_count_notices_a_wrong_friction():
    """Postures of a robot with mu = 0.2, judged as mu = 0.3, slide without full friction."""
    robot = replace(neuroendoscope_section(), friction=Friction(0.2))
    postures = simulate(robot, history(((0, 0), (0.3, 0)), 0.05), NO_GRAVITY).postures
    assert violations(postures, 0.2) == 0
    assert violations(postures, 0.3) > 20


def test_only_the_body_with_tendons_shows_a_loop():
    """Pulled to 44 mm and back: no discrepancy without tendon friction, mN with it (Kato 2016, Fig. 5)."""
    backbone, guides, tendons = body_stages()
    for stage in (backbone, guides):
        assert np.abs(stage.discrepancy_mN).max() < 0.1
        assert stage.place_mm.max() >= 44.0
    assert 5.9 < tendons.discrepancy_mN.max() < 21.4
    assert tendons.discrepancy_mN.min() > 1.0
