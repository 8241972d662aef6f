"""Claims about the figures of Kato 2016 that are drawn again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.robots.continuum.exact_arm import fkm_exact_arm
from catheter_sim.robots.continuum.kato import pcca
from catheter_sim.robots.continuum.published import neuroendoscope_section
from catheter_sim.validation import neuroendoscope_softening as softening
from catheter_sim.validation.lines import NO_GRAVITY, given, tips_mm
from catheter_sim.validation.neuroendoscope import (
    PEAK_N,
    TARGET_MM,
    Distances,
    LoadCase,
    constant_curvature_range_N,
    validate_figures,
)


def by_statics(mu: float, start_N: float) -> Distances:
    """Return the single tendon's distances by the exact arms, which are as the simulation after reversal."""
    robot = replace(neuroendoscope_section(), friction=Friction(mu))
    case = LoadCase("a set", "single", robot, start_N)
    inputs = given(case.rows_N)
    postures = fkm_exact_arm(robot, inputs, NO_GRAVITY).postures
    even = tips_mm(pcca(robot, inputs, NO_GRAVITY).postures)
    far = np.linalg.norm(tips_mm(postures) - even, axis=1)
    return Distances(case, postures, far[1:5], far[-4:][::-1])


def test_sets_are_those_that_the_figures_hold() -> None:
    """`@arching` is the default; `@openings` differs from it in friction alone."""
    assert load_robot("neuroendoscope_section") == load_robot("neuroendoscope_section@arching")
    openings = load_robot("neuroendoscope_section@openings")
    assert openings.friction == Friction(0.128)
    nominal = load_robot("neuroendoscope_section")
    told = {"friction": nominal.friction, "description": nominal.description, "sources": nominal.sources}
    assert replace(openings, **told) == nominal


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.29, 0.35])
def test_dip_and_second_peak_hang_neither_on_mu_nor_on_the_start(mu: float) -> None:
    """Within the friction of the arching distances, from 0.54 to 0.65 N, Fig. 13 looks as printed."""
    for start in (0.54, 0.6, 0.65):
        found = by_statics(mu, start)
        assert found.peak_N == pytest.approx(PEAK_N)
        assert found.extending_mm[-1] < found.arching_mm[-1]
        assert (np.diff(found.arching_mm) > 0.0).all()


@pytest.mark.slow
@pytest.mark.parametrize("start", [0.54, 1.5])
def test_the_openings_friction_contradicts_fig_13(start: float) -> None:
    """With mu 0.128 the distance grows at the turn and only falls on the way back."""
    found = by_statics(0.128, start)
    assert np.isnan(found.peak_N)
    assert found.extending_mm[-1] > found.arching_mm[-1]
    assert (np.diff(found.extending_mm) > 0.0).all()


@pytest.mark.slow
def test_range_ends_where_constant_curvature_is_5_mm_off() -> None:
    """At the tension found the two tips are as far apart as asked; with less friction it lies higher."""
    robot = neuroendoscope_section()
    tension = constant_curvature_range_N(robot, "antagonistic")
    rows = given(np.array([(0.12, 0.12), (tension, 0.12)]))
    tips = [tips_mm(solve(robot, rows, NO_GRAVITY).postures)[-1] for solve in (fkm_exact_arm, pcca)]
    assert np.linalg.norm(tips[0] - tips[1]) == pytest.approx(TARGET_MM, abs=0.02)
    assert constant_curvature_range_N(load_robot("neuroendoscope_section@openings"), "antagonistic") > tension


@pytest.mark.long
def test_figures_are_drawn_and_judged(tmp_path: Path) -> None:
    """Both judged lines pass, every picture is there, and no opening is called predicted."""
    validation = validate_figures(tmp_path)
    assert validation.passed, validation.table_text()
    names = {"postures", "constant_curvature", "tensions"}
    assert {path.name for path in tmp_path.iterdir()} == {
        f"neuroendoscope_section_{name}.png" for name in names
    }
    openings = [item for item in validation.lines if "loop opening" in item.quantity]
    assert [item.kind for item in openings] == ["fitted to it", "fitted to it", "assumed"]
    assert sum(item.tolerance is not None for item in validation.lines) == 2


def test_a_planted_softening_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Distances of a robot with a cubic term of -40 mm^2 are met with it, and not by a linear backbone."""
    planted = {"friction": 0.2, "stiffness_scale": 1.05, "mapping_friction": 0.3, "cubic_mm2": -40.0}
    figures = softening.distances_mm(planted)
    made = tuple(replace(item, mm=float(mm)) for item, mm in zip(softening.PRINTED, figures, strict=True))
    monkeypatch.setattr(softening, "PRINTED", made)
    start = [(0.22, 1.0, 0.28, -25.0)]
    soft = softening.fit_distances(softening.SOFTENING, starts=start)
    linear = softening.fit_distances(softening.LINEAR, starts=start)
    assert soft.values["cubic_mm2"] == pytest.approx(-40.0, abs=3.0)
    assert soft.rms_mm < 0.05 < 0.2 < linear.rms_mm
    assert softening.distances_mm(planted | {"cubic_mm2": 0.0}) != pytest.approx(figures, abs=0.1)
