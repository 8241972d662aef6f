"""Planted in the simulated transseptal catheter, and found by the twin: rest curvatures, a mount, a load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from planted import as_inputs, data_set

from catheter_sim.catalogue import load_robot
from catheter_sim.core.document import with_number
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.result import DiagnosisResult

pytestmark = pytest.mark.slow

COLUMNS = tuple(f"{place}_{axis}_mm" for place in ("tip", "body_11") for axis in "xyz")


def history(seed: int) -> Inputs:
    """Return three cycles of all joints to and fro: bending up to 3 mm, the advance up to 50 mm."""
    generator = np.random.default_rng(seed)
    share = np.concatenate([np.linspace(0, 1, 7), np.linspace(1, -1, 12)[1:], np.linspace(-1, 0, 7)[1:]])
    rows = []
    for _ in range(3):
        size = generator.uniform([1.5, 0.8, 0.8], [3.0, 2.0, 2.0])
        moves = np.stack([np.roll(share, shift) for shift in (0, 5, 11)], axis=1) * size
        rows.append(np.column_stack([moves, generator.uniform(15.0, 50.0) * np.abs(share)]))
    return as_inputs(1e-3 * np.concatenate(rows), "displacement")


def diagnosed(effects: Mapping[str, Mapping[str, float]]) -> DiagnosisResult:
    """Return what is found in simulated data of a robot with small errors of calibration (seed 1)."""
    specified = load_robot("mitral_transseptal")
    built = with_number(specified, "segments.bending.arm_mm", 1.8 * 1.006)
    built = with_number(built, "segments.torsion_distal.tendon_radius_mm", 2.85 * 0.994)
    histories = [history(1), history(1), history(2)]
    data = data_set(built, "mitral_transseptal", effects, histories, COLUMNS, noise_mm=0.1, seed=1)
    return diagnose_dataset(replace(data, robot=specified), simulation=False)


def test_nothing_planted_in_the_simulated_catheter() -> None:
    """No cause is named for 0.1 mm of noise and small errors of calibration, which are found."""
    found = diagnosed({})
    assert found.verdict == "no_discrepancy"
    assert found.causes == ()
    assert found.calibrated["arm_bending"].value == pytest.approx(1.006, abs=0.001)


@pytest.mark.parametrize("curvature", [pytest.param((3.0, -2.0), marks=pytest.mark.long), (0.0, 1.0)])
def test_curved_tube_is_found(curvature: tuple[float, float]) -> None:
    """Named alone, told from every other cause, its curvature within 0.1 / m, and the noise is left."""
    found = diagnosed(
        {"precurvature": dict(zip(("curvature_x_per_m", "curvature_y_per_m"), curvature, strict=True))}
    )
    assert found.verdict == "cause_found"
    assert [cause.name for cause in found.causes] == ["precurvature"]
    assert found.indistinguishable == ()
    for axis, value in zip("xy", curvature, strict=True):
        assert found.causes[0].parameters[f"curvature_{axis}_per_m"].value == pytest.approx(value, abs=0.1)
    assert found.headline.rmse_after < 1.3 * found.headline.noise_floor


@pytest.mark.parametrize(
    "effects",
    [
        pytest.param({"precurvature": {"bending_deg": 6.0}}, marks=pytest.mark.long),
        {"actuation_offset": {"offset_bending_mm": 0.2}},
    ],
)
def test_bent_joint_and_offset_of_its_channel_are_one_group(
    effects: Mapping[str, Mapping[str, float]],
) -> None:
    """Both move the zero of the bend: the one or the other is named, and said to be the same as the other."""
    found = diagnosed(effects)
    assert found.verdict == "cause_found"
    assert len(found.causes) == 1
    assert found.causes[0].name in ("precurvature", "actuation_offset")
    assert {"precurvature", "actuation_offset"} in [set(group) for group in found.indistinguishable]
    assert found.headline.rmse_after < 1.3 * found.headline.noise_floor


def test_a_mount_that_gives_way_is_found() -> None:
    """Named alone, told from elastic tendons by the base that sinks, its stiffness inside its interval."""
    found = diagnosed({"axial_compression": {"stiffness_N_per_mm": 8.0}})
    assert [cause.name for cause in found.causes] == ["axial_compression"]
    assert found.indistinguishable == ()
    low, high = found.causes[0].parameters["stiffness_N_per_mm"].ci95
    assert low < 8.0 < high
    assert found.headline.rmse_after < 1.3 * found.headline.noise_floor
