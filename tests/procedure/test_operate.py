"""Claims about the whole procedure: it reaches its target, holds the leaflets, and says what it touched."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.errors import SimulationDiverged
from catheter_sim.procedure.heart import median_anatomy
from catheter_sim.procedure.operate import Outcome, _Theatre, build_scene, operate, run_series
from catheter_sim.procedure.plan import plan
from catheter_sim.robots.catheter.published import mitral_transseptal, mitral_transseptal_tube
from catheter_sim.validation.mitral_control import validate_procedure
from catheter_sim.validation.mitral_tables import tortuous
from tests.scripts_as_modules import script_module

pytestmark = pytest.mark.slow

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "mitral_procedure.py"


def operated(robot, seed: int = 0, **options) -> Outcome:
    return operate(robot, plan(robot, median_anatomy()), np.random.default_rng(seed), **options)


def test_nominal_robot_reaches_its_target_open_loop_in_four_anatomies(tmp_path: Path) -> None:
    """Within 1 mm and 3 deg, all of them, both leaflets held; the wall is not pressed by 0.1 N."""
    attempts = run_series(mitral_transseptal(), 4, seed=1)
    for item in attempts:
        assert item.outcome is not None, item.failure
        assert item.succeeded, item.number
        assert item.outcome.holds, item.number
        assert item.outcome.wall_peak_N < 0.1
        assert sum(step.corrections for step in item.outcome.steps) == 0
    script_module("mitral_procedure").write_series(attempts, tmp_path)
    rows = list(csv.DictReader((tmp_path / "procedure.csv").open()))
    assert [int(row["anatomy"]) for row in rows] == list(range(4))
    assert json.loads((tmp_path / "procedure.json").read_text())[3]["outcome"]["succeeded"]


def test_arms_stay_as_far_open_as_the_leaflets_between_them_are_thick() -> None:
    """Closed on two leaflets the arms stay open by a few degrees, on nothing they would be at zero; each
    leaflet lies between its arm and the post.
    """
    outcome = operated(mitral_transseptal())
    assert outcome.holds
    assert all(2.0 < arm < 15.0 for arm in outcome.arms_deg)


def test_robot_with_dead_bands_misses_open_loop_and_arrives_with_the_tracker() -> None:
    """Slack, play and stretch unknown to the controller: far off by displacements alone, on target with
    corrections, and closer from the start where the controller knows them.
    """
    tube = mitral_transseptal_tube()
    blind = operated(tube, feedback=False)
    assert blind.position_error_mm > 5.0
    assert not blind.succeeded
    led = operated(tube)
    assert led.succeeded
    assert sum(step.corrections for step in led.steps) > 5
    calibrated = operated(tube, known=tube)
    assert calibrated.succeeded
    assert sum(step.corrections for step in calibrated.steps) < sum(step.corrections for step in led.steps)


@pytest.mark.long
def test_a_curved_path_asks_for_more_corrections_and_is_passed() -> None:
    """Nayar 2022, Section IV-D: the tendons' friction in the path enlarges the hysteresis; the tracker leads
    on."""
    tube = mitral_transseptal_tube()
    led, through = operated(tube), operated(tortuous(tube))
    assert through.succeeded
    assert through.holds
    assert sum(step.corrections for step in through.steps) > sum(step.corrections for step in led.steps)


def test_pressing_the_wall_is_reported() -> None:
    """Pushed 5 mm too far while straight: about that deep a press, with its place on the opposite wall."""
    robot = mitral_transseptal()
    way = plan(robot, median_anatomy())
    outcome = operate(robot, replace(way, straight_m=way.straight_m + 5e-3), np.random.default_rng(0))
    insert = outcome.steps[0]
    assert 0.05 < insert.wall_peak_N < 2.0
    assert insert.wall_mean_N < insert.wall_peak_N
    assert insert.wall_place_mm[0] < 0.0  # away from the septum
    assert outcome.wall_peak_N >= insert.wall_peak_N


@pytest.mark.long
def test_validation_passes(tmp_path: Path) -> None:
    """Ten anatomies within 1 mm and 3 deg."""
    validation = validate_procedure(tmp_path)
    assert validation.passed
    assert len(validation.lines) == 3


@pytest.mark.long
def test_series_does_not_depend_on_the_number_of_processes() -> None:
    """Two anatomies by one process and by two: the same errors to the last bit."""
    errors = [
        [item.outcome.position_error_mm for item in run_series(mitral_transseptal(), 2, 3, jobs=jobs)]
        for jobs in (1, 2)
    ]
    assert errors[0] == errors[1]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--anatomies", "0"], "--anatomies 0"),
        (["--robot", "mitral_4dof"], "transseptal design"),
        (["--robot", "spacer_disk"], "not a catheter; choices: mitral_transseptal"),
        (["--robot", "nothing"], "unknown robot 'nothing'"),
    ],
)
def test_script_tells_bad_input_in_a_line(tmp_path: Path, arguments: list[str], told: str) -> None:
    """Exit status 2 and one line on stderr."""
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "-o", str(tmp_path), *arguments], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert told in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_command_that_mujoco_ignores_ends_the_procedure() -> None:
    """A base that is told to be 1e13 m away stays where it is; that is no place reached, but a divergence."""
    robot = mitral_transseptal()
    theatre = _Theatre(robot, build_scene(robot, plan(robot, median_anatomy())), None)
    theatre.hold(0.01)
    theatre.place = replace(theatre.place, insertion_m=1e13)
    with pytest.raises(SimulationDiverged, match="MuJoCo: an input is not finite, or beyond 1e\\+10"):
        theatre.hold(0.01)
