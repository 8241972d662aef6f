"""Claims about what sets a robot's motion: how fast it relaxes, and how its masses lie."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import trimesh

from catheter_sim.catalogue import load_robot
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.simulation.simulator import Simulator

STEP_S = 2e-4
SHORT = ("segments.section.length_mm=10", "segments.section.disks=5")  # five cells
SHORT_LINKS = ("segments.section.joints=3", "segments.section.length_mm=45")


def decays_per_s(relaxation_s: float, inertia_s: float) -> tuple[float, float]:
    """Return the two decay rates of inertia_s^2 q'' + relaxation_s q' + q = 0, the slow one first [1/s]."""
    slow, fast = sorted(-np.roots([inertia_s**2, relaxation_s, 1.0]).real)
    return float(slow), float(fast)


def check_relaxes(simulator: Simulator, names: list[str], size: float) -> None:
    """Let the joints go at `size` (rad or m) from rest and hold their way to that of the stated times.

    Without masses each moves by itself: q = (f e^(-s t) - s e^(-f t)) / (f - s), q' = 0 at first. Soon after
    the start inertia counts; late, the slow part alone is left, and how long a joint took to fall so far is
    compared: an error of the damping shows in full, to either side.
    """
    model, data, times = simulator.model, simulator.data, simulator.robot.dynamics
    model.opt.timestep = STEP_S
    slow, fast = decays_per_s(times.relaxation_time_s, times.inertia_time_s)
    joints = np.array([model.joint(name).id for name in names])
    places = model.jnt_qposadr[joints]
    soon, late = 0.2 * times.relaxation_time_s, 1.2 * times.relaxation_time_s
    data.qpos[places] += size

    def left(duration_s: float) -> np.ndarray:
        simulator.step(round(duration_s / STEP_S))
        return (data.qpos[places] - model.qpos_spring[places]) / size

    at_first = (fast * np.exp(-slow * soon) - slow * np.exp(-fast * soon)) / (fast - slow)
    assert left(soon) == pytest.approx(np.full(len(names), at_first), abs=0.004)
    rest = left(late - soon) + slow / (fast - slow) * np.exp(-fast * late)
    taken = -np.log(rest * (fast - slow) / fast) / slow
    assert taken == pytest.approx(np.full(len(names), late), rel=0.01)


def bending(simulator: Simulator) -> list[str]:
    """Return the names of the hinges of a chain of cells or links."""
    names = [simulator.model.joint(k).name for k in range(simulator.model.njnt)]
    return [name for name in names if name[0] in "xyt" and name[1:].isdigit()]


ROBOTS = {
    "cells": ("neuroendoscope_section", (*SHORT, "friction.mu=0")),
    "scaled cells": ("neuroendoscope_section", (*SHORT, "friction.mu=0", "stiffness_scale=1.6")),
    "cells in space": ("spacer_disk", ("disks_per_segment=1", "links_per_subsegment=1")),
    "links": ("chest_tube_section", (*SHORT_LINKS, "friction.mu=0")),
    "scaled links": ("chest_tube_section", (*SHORT_LINKS, "friction.mu=0", "stiffness_scale=0.6")),
    "links of three segments": ("chest_tube", ("friction.mu=0",)),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "times_s"), [*((name, (0.05, 0.01)) for name in ROBOTS), ("scaled cells", (0.08, 0.02))]
)
def test_released_robot_relaxes_in_the_stated_time(name: str, times_s: tuple[float, float]) -> None:
    """Let go at rest, every hinge comes back as a mass, a damper and a spring of the stated times, to 1 %."""
    reference, settings = ROBOTS[name]
    stated = (f"dynamics.relaxation_time_s={times_s[0]}", f"dynamics.inertia_time_s={times_s[1]}")
    simulator = Simulator(load_robot(reference, (*settings, *stated)), inertia=False)
    hinges = bending(simulator)
    assert len(hinges) >= 3
    check_relaxes(simulator, hinges, 1e-5)


@pytest.mark.parametrize("reference", ["mitral_transseptal", "mitral_4dof"])
def test_released_rings_relax_in_the_stated_time(reference: str) -> None:
    """The same of every gap of a bending joint whose tendons hang slack."""
    pairs = [pair.name for pair in load_robot(reference).tendons if pair.name.startswith("bending")]
    robot = load_robot(reference, [f"tendons.{pair}.slack_mm=1" for pair in pairs])
    simulator = Simulator(robot, inertia=False)
    names = [simulator.model.joint(k).name for k in range(simulator.model.njnt)]
    gaps = [name for name in names if name.startswith("bending") and name.rpartition("_")[2].isdigit()]
    assert len(gaps) == 11
    check_relaxes(simulator, gaps, 1e-3)


@pytest.mark.parametrize("reference", ["neuroendoscope_section", "chest_tube_section", "mitral_transseptal"])
def test_released_mount_relaxes_in_the_stated_time(reference: str) -> None:
    """The same of a mount that gives way, pressed in by a micrometre."""
    settings = ("mount.axial_stiffness_N_per_mm=5", "friction.mu=0")
    check_relaxes(Simulator(load_robot(reference, settings), inertia=False), ["mount"], -1e-6)


def cylinder(mass: float, radius: float, length: float) -> np.ndarray:
    """Return a solid cylinder's moments of inertia across and along its axis, by its mesh [kg m^2]."""
    mesh = trimesh.creation.cylinder(radius=radius, height=length, sections=256)
    mesh.density = mass / mesh.volume
    return np.diag(mesh.moment_inertia)


def test_cells_are_solid_cylinders() -> None:
    """Mass and moments of inertia of every compiled link are those of a cylinder of its length."""
    robot = load_robot("neuroendoscope_section")
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot))
    expected = cylinder(15e-6, 1.7e-3, 2e-3)
    for k in range(1, 31):
        body = model.body(f"link_{k}").id
        assert model.body_mass[body] == pytest.approx(15e-6, rel=1e-6)
        assert model.body_inertia[body] == pytest.approx(expected, rel=1e-3)


def test_rolling_links_are_solid_cylinders_with_their_centre_where_stated() -> None:
    """15 links of 15 mm, 6.2 mm wide; the centre of mass 7.3 mm below the top."""
    robot = load_robot("chest_tube_section")
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = robot.segments[0].mass_kg / 15
    expected = cylinder(mass, robot.segments[0].outer_radius_m, 15e-3)
    for k in range(1, 16):
        body = model.body(f"link_{k}").id
        assert model.body_mass[body] == pytest.approx(mass, rel=1e-6)
        assert model.body_inertia[body] == pytest.approx(expected, rel=1e-3)
        assert data.xipos[body] == pytest.approx([0.0, 0.0, 15e-3 * k - 7.3e-3], abs=1e-9)


@pytest.mark.slow
def test_catheters_modules_are_solid_cylinders() -> None:
    """A module's mass is that of a cylinder of its length about its middle; a segment's rings share its."""
    settings = ("segments.torsion_proximal.mass_g=2", "segments.bending.mass_g=3")
    robot = load_robot("mitral_transseptal", settings)
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    module, bent = robot.segments[0], robot.segments[1]
    bodies = [k for k in range(model.nbody) if model.body_mass[k] > 1e-6]
    heavy = [k for k in bodies if model.body_mass[k] > 1e-3]
    rings = [k for k in bodies if model.body_mass[k] == pytest.approx(3e-3 / bent.rings)]
    (torsion,) = [k for k in heavy if model.body_mass[k] == pytest.approx(2e-3)]
    assert len(rings) == bent.rings
    assert model.body_inertia[torsion] == pytest.approx(
        cylinder(2e-3, module.outer_radius_m, module.length_m), rel=1e-3
    )
    assert data.xipos[torsion] == pytest.approx([0.0, 0.0, 0.5 * module.length_m], abs=1e-9)
    ring_length = (bent.length_m - 2 * (bent.rings + 1) * bent.half_gap_m) / bent.rings
    expected = cylinder(3e-3 / bent.rings, bent.outer_radius_m, ring_length)
    for ring in rings:
        assert model.body_inertia[ring] == pytest.approx(expected, rel=1e-3)
