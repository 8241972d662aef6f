"""Elements that are turned are told from a tracker's frame that is, on robots that bend in a plane.

The data are the simulation's, stacked anew with every element bending about an oblique axis: the law of the
independent bench, not the one that the diagnosis fits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from planted import data_set, pair_history, postures_of, rod_history
from scipy.spatial.transform import Rotation

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import posture_columns
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.result import DiagnosisResult
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.lab.engine import rebent, shapes_of
from catheter_sim.tables import Table

pytestmark = pytest.mark.slow
NOISE_MM = 0.1
RATE = "cells_rate_deg_per_m"


def twisted(
    name: str,
    tip_deg: float,
    frame_deg: float = 0.0,
    along: Callable[[np.ndarray], np.ndarray] = np.ones_like,
) -> Dataset:
    """Return four trials of a robot whose elements are turned, and whose tracker is turned about its base.

    Args:
        name: of the robot.
        tip_deg: by how much its last element is turned in all.
        frame_deg: the tracker.
        along: how that is spread, over the share of the elements from base to tip.
    """
    robot, history = load_robot(name), rod_history if name == "chest_tube_section" else pair_history
    points = ("tip", "body_7")
    columns = [f"{point}_{axis}_mm" for point in points for axis in "xyz"]
    plain = data_set(robot, name, {}, [history(seed) for seed in (1, 2, 3, 4)], columns)
    generator = np.random.default_rng(3)
    frame = Rotation.from_euler("z", frame_deg, degrees=True)
    trials = []
    for trial in plain.trials:
        shapes = shapes_of(postures_of(robot, trial.inputs, "simulation"))
        count = shapes.p.shape[1]
        each = math.radians(tip_deg) / count * along((np.arange(count) + 0.5) / count)
        shapes = rebent(shapes, lambda bends, each=each: bends + each[:, np.newaxis] * [0.0, 0.0, 1.0])
        shapes = replace(shapes, p=shapes.p @ frame.as_matrix().T)
        values = posture_columns(robot, shapes.postures(), columns)
        noisy = {key: row + NOISE_MM * generator.normal(size=len(row)) for key, row in values.items()}
        trials.append(replace(trial, outputs=Table(trial.inputs.time_s, noisy, trial.file)))
    return replace(plain, trials=tuple(trials))


def named(found: DiagnosisResult) -> list[str]:
    return [cause.name for cause in found.causes]


@pytest.mark.parametrize(
    ("name", "tip_deg"), [("neuroendoscope_section", 20.0), ("chest_tube_section", 10.0)]
)
def test_turned_elements_are_twist_alone(name: str, tip_deg: float) -> None:
    """The rate is found to 2 %, and lies in its interval."""
    found = diagnose_dataset(twisted(name, tip_deg), simulation=False)
    (cause,) = found.causes
    rate = tip_deg / sum(segment.length_m for segment in load_robot(name).segments)
    value = cause.parameters[RATE]
    assert (cause.name, cause.form) == ("twist", "cells")
    assert value.value == pytest.approx(rate, rel=0.02)
    assert value.ci95[0] <= rate <= value.ci95[1]


def test_beside_a_turned_frame_both_are_found() -> None:
    """Minus 25 deg along the robot and 6 deg of its tracker, each within a degree."""
    found = diagnose_dataset(twisted("chest_tube_section", -25.0, frame_deg=6.0), simulation=False)
    assert named(found) == ["twist", "measurement_frame"]
    length_m = sum(segment.length_m for segment in load_robot("chest_tube_section").segments)
    assert found.causes[0].parameters[RATE].value * length_m == pytest.approx(-25.0, abs=1.0)
    assert found.causes[1].parameters["rotation_z_deg"].value == pytest.approx(6.0, abs=1.0)


def test_a_turned_frame_alone_is_no_twist() -> None:
    found = diagnose_dataset(twisted("chest_tube_section", 0.0, frame_deg=5.0), simulation=False)
    assert named(found) == ["measurement_frame"]


def test_turned_more_and_more_is_still_twist() -> None:
    """By a law that no form knows."""
    found = diagnose_dataset(twisted("chest_tube_section", 20.0, along=lambda at: 2.0 * at), simulation=False)
    assert named(found)[0] == "twist"
