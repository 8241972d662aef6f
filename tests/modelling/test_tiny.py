"""Robots so small that their links' inertias are below what MuJoCo takes."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.cli.main import main

MUJOCOS_LEAST = 1e-15  # kg, kg m^2: mjMINVAL
TIP = ["tip_x_mm", "tip_z_mm"]


def microcatheter(folder: Path, mass_g: float = 0.0015, size: float = 1.0) -> Path:
    """Return the file of a tip of 5 mm, or of `size` times that; its stiffness is made to size, too."""
    tendons = "".join(
        f'[[tendons]]\nname = "{name}"\nradius_mm = {0.2 * size}\nangle_deg = {angle}\nends_at = "tip"\n'
        for name, angle in (("a", 0.0), ("b", 180.0))
    )
    path = folder / f"micro_{size:g}_{mass_g:g}.toml"
    path.write_text(
        'name = "micro"\ndescription = ""\nfriction.mu = 0.0\nactuation = "tension"\n'
        '[[segments]]\nname = "tip"\n'
        f"length_mm = {5.0 * size}\ndisks = 5\nouter_radius_mm = {0.3 * size}\nmass_g = {mass_g}\n"
        f"youngs_modulus_GPa = 0.03\nbackbone_diameter_mm = {0.5 * size}\npoisson_ratio = 0.45\n{tendons}"
    )
    return path


@pytest.mark.slow
@pytest.mark.parametrize("actuation", ["tension", "displacement"])
def test_a_tiny_robot_bends_as_its_enlargement(tmp_path: Path, actuation: str) -> None:
    """Ten times as large, pulled with a hundred times the tension or ten times as far: ten times the tip."""
    unit, power = {"tension": ("N", 2), "displacement": ("mm", 1)}[actuation]
    pull = {"tension": 0.3, "displacement": 0.2}[actuation]
    tips = []
    for size in (1.0, 10.0):
        path = microcatheter(tmp_path, mass_g=0.0015 * size**3, size=size)
        robot = cs.load_robot(path, {"actuation": actuation})
        inputs = {"time_s": [0.0, 1.0], f"{actuation}_a_{unit}": [0.0, pull * size**power]}
        if actuation == "displacement":  # what one draws in the other gives
            inputs["displacement_b_mm"] = [0.0, -pull * size]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", cs.RobotNote)
            columns = cs.simulate(robot, inputs).to_table(TIP).columns
        tips.append([float(columns[name][-1]) / size for name in TIP])
    assert tips[0][0] > 1.5
    np.testing.assert_allclose(tips[0], tips[1], atol=0.005 * 5.0)


@pytest.mark.slow
def test_it_moves(tmp_path: Path) -> None:
    """Pulled slowly in motion it is where it comes to rest; that does not depend on its mass."""
    inputs = {"time_s": [0.0, 1.0, 2.0], "tension_a_N": [0.0, 0.3, 0.3]}
    tips = []
    for mass_g, dynamic in ((0.0015, True), (0.0015, False), (0.15, False)):
        path = microcatheter(tmp_path, mass_g)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", cs.RobotNote)
            columns = cs.simulate(path, inputs, dynamic=dynamic).to_table(TIP).columns
        tips.append([float(columns[name][-1]) for name in TIP])
    assert tips[0][0] > 1.5
    np.testing.assert_allclose(tips[0], tips[1], atol=0.005 * 5.0)
    np.testing.assert_allclose(tips[1], tips[2], atol=0.001 * 5.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "settings"),
    [
        ("neuroendoscope_section", {"segments.section.mass_g": 1e-6}),
        ("neuroendoscope_section", {"segments.section.mass_g": 1e-6, "actuation": "displacement"}),
        ("chest_tube_section", {"segments.section.mass_g": 1e-6}),
        ("notched_wrist", {"segments.wrist.mass_g": 1e-6}),
        ("notched_wrist", {"segments.wrist.mass_g": 1e-6, "actuation": "displacement"}),
        ("spacer_disk", {"tip_mass_g": 1e-5, "actuation": "displacement"}),
    ],
)
def test_inertias_are_raised_and_weights_stay(robot: str, settings: dict[str, object]) -> None:
    """Every kind builds, says in one line what was raised, and weighs what its file says."""
    light = cs.load_robot(robot, settings)
    with pytest.warns(
        cs.RobotNote, match=f"^{light.name}: inertias of [0-9]+ bodies raised to .*; masses stay$"
    ):
        model = cs.build(light).compile()
    moving = model.body_weldid > 0
    assert model.body_inertia[moving].min() >= MUJOCOS_LEAST
    weight = sum(item.mass_kg for item in light.segments) + light.tip_mass_kg
    assert model.body_mass.sum() == pytest.approx(weight, rel=1e-6)


def test_masses_below_the_least_are_said(tmp_path: Path) -> None:
    """A mass that MuJoCo does not take is raised, and the line says so."""
    with pytest.warns(cs.RobotNote, match=r"masses of \d+ to 1e-15 kg"):
        model = cs.build(microcatheter(tmp_path, mass_g=1e-12)).compile()
    assert model.body_mass[model.body_weldid > 0].min() == pytest.approx(MUJOCOS_LEAST)


@pytest.mark.slow
def test_a_robot_that_is_no_smaller_stays_as_it_is(tmp_path: Path) -> None:
    """No note, and its inertias are those of solid cylinders of its mass."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = cs.build(microcatheter(tmp_path, mass_g=0.15)).compile()
    link = model.body("link_5")
    assert link.inertia[link.inertia.argmin()] == pytest.approx(link.mass * 0.3e-3**2 / 2.0, rel=1e-6)


@pytest.mark.slow
def test_every_verb_says_it_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """On standard error, one line, each time that the program runs."""
    robot = str(microcatheter(tmp_path))
    inputs, out = tmp_path / "in.csv", str(tmp_path / "out.csv")
    inputs.write_text("time_s,tension_a_N\n0,0\n")
    for arguments in (
        ["list", robot],
        ["build", robot, "-o", str(tmp_path / "model.xml")],
        ["simulate", robot, "--inputs", str(inputs), "-o", out],
        ["simulate", robot, "--inputs", str(inputs), "-o", out],
    ):
        assert main(arguments) == 0
        said = [line for line in capsys.readouterr().err.splitlines() if "raised" in line]
        assert len(said) == 1, arguments
        assert said[0].startswith("catheter-sim: note: micro: inertias of ")
