"""The papers' own stories, told by the diagnosis on data with the papers' parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import as_inputs, data_set, joint_history, section_data

from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.robots.catalogue import load_robot
from catheter_sim.robots.channels import output_channels

pytestmark = pytest.mark.slow


def test_wire_that_softens_is_a_nonlinear_stiffness():
    """Kato 2016's suspicion: measured bends beyond the modelled ones at high tension, from softening NiTi."""
    found = diagnose_dataset(section_data({"nonlinear_stiffness": {"cubic_mm2": -110.0}}), simulation=False)
    assert found.verdict == "cause_found"
    assert [cause.name for cause in found.causes] == ["nonlinear_stiffness"]
    low, high = found.causes[0].parameters["cubic_mm2"].ci95
    assert low <= -110.0 * 0.95
    assert high >= -110.0 * 1.05


def test_printed_dead_bands_are_backlash():
    """Data by the modified kinematics (Nayar 2022, Eqs 23-28), diagnosed by pure kinematics."""
    histories = [joint_history(seed) for seed in (1, 2, 3, 4)]
    pulled = [replace(item, tendon=np.abs(item.tendon)) for item in histories]
    columns = [f"{point}_{axis}_mm" for point in ("tip", "body_11") for axis in "xyz"]
    robot = load_robot("mitral_transseptal")
    found = diagnose_dataset(data_set(robot, robot.name, {}, pulled, columns, solver="mk"), simulation=False)
    assert found.verdict == "cause_found"
    assert found.causes[0].name == "backlash"
    assert found.headline.gain_percent > 90.0


def test_printed_tendon_law_is_tendon_elongation():
    """Data of the robot with the measured cyclic law (Nayar 2023, Algorithm 1), by inextensible ones."""
    share = np.concatenate([np.linspace(0, 1, 7), np.linspace(1, -1, 12)[1:], np.linspace(-1, 0, 7)[1:]])

    def history(seed):
        generator = np.random.default_rng(seed)
        sizes = [generator.uniform([1.0, 1.0, 0.5, 0.0], [2.5, 2.5, 1.5, 0.0]) for _ in range(4)]
        moves = np.stack([np.roll(share, shift) for shift in (0, 5, 11, 0)], axis=1)
        return as_inputs(1e-3 * np.concatenate([moves * size for size in sizes]), "displacement")

    nominal = load_robot("mitral_4dof")
    columns = [name for name in output_channels(nominal) if name.startswith("angle")]
    data = data_set(
        load_robot("mitral_4dof@elongation"),
        nominal.name,
        {},
        [history(seed) for seed in (1, 2, 3, 4)],
        columns,
        noise_mm=0.2,
    )
    found = diagnose_dataset(replace(data, robot=nominal), simulation=False)
    assert found.verdict == "cause_found"
    assert found.causes[0].name == "tendon_elongation"
    assert found.headline.gain_percent > 90.0
