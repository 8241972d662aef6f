"""Units at the edge: names pair with factors, and factors with physics."""

from __future__ import annotations

import math

import pytest

from catheter_sim.units import SI_TO_FILE, file_name, si_factor


@pytest.mark.parametrize(
    ("si_name", "si_value", "expected_name", "expected_value"),
    [
        ("length_m", 0.06, "length_mm", 60.0),
        ("angle_rad", math.pi, "angle_deg", 180.0),
        ("mass_kg", 0.45e-3, "mass_g", 0.45),
        ("bending_stiffness_N_m2", 1.72e-5, "bending_stiffness_N_mm2", 17.2),
        ("axial_stiffness_N_per_m", 5000.0, "axial_stiffness_N_per_mm", 5.0),
        ("stiffness_N_m_per_rad", 8.6e-3, "stiffness_N_mm_per_rad", 8.6),
        ("stiffness_cubic_m2", 1e-6, "stiffness_cubic_mm2", 1.0),
        ("stiffness_quintic_m4", 1e-12, "stiffness_quintic_mm4", 1.0),
        ("rest_curvature_x_per_m", 3.0, "rest_curvature_x_per_m", 3.0),
        ("rest_twist_rad_per_m", math.pi / 2, "rest_twist_deg_per_m", 90.0),
        ("pretension_N", 4.0, "pretension_N", 4.0),
        ("timestep_s", 0.005, "timestep_s", 0.005),
        ("mu", 0.3, "mu", 0.3),
    ],
)
def test_file_names_and_values(
    si_name: str, si_value: float, expected_name: str, expected_value: float
) -> None:
    """An SI field and its file key state the same quantity."""
    name, factor = file_name(si_name)
    assert name == expected_name
    assert si_value * factor == pytest.approx(expected_value, rel=1e-12)


def test_file_names_are_distinct() -> None:
    """Two fields of the same stem and different units never share a key in a file."""
    names = [file_name(f"x{suffix}")[0] for suffix in SI_TO_FILE]
    assert len(set(names)) == len(names)


def test_words_without_unit_keep_their_name() -> None:
    """A plural is not taken for a value in seconds."""
    for name in ("disks", "segments", "links_per_subsegment", "name", "bending_axes"):
        assert file_name(name) == (name, 1.0)


@pytest.mark.parametrize(
    ("column", "factor"),
    [
        ("tip_x_mm", 1e-3),
        ("joint_x1_deg", math.pi / 180),
        ("tension_right_N", 1.0),
        ("moment_tip_x_Nm", 1.0),
        ("time_s", 1.0),
        ("tip_qw", 1.0),
    ],
)
def test_column_factors(column: str, factor: float) -> None:
    """A column's factor turns its unit into SI."""
    assert si_factor(column) == pytest.approx(factor, rel=1e-15)
