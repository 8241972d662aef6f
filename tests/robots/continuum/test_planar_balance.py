"""Claims about the planar statics of a short section, checked from postures and tensions alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planar_cases import cell_angles, eyelets, section, single, tensions

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import Mount
from catheter_sim.core.statics import StaticRun
from catheter_sim.robots.continuum import exact_arm, kato
from catheter_sim.robots.continuum.exact_arm import fkm_exact_arm, fkm_sliding
from catheter_sim.robots.continuum.kato import fkm, fkm_stick, pcca
from catheter_sim.robots.continuum.spec import ContinuumRobot

CELLS, CELL_M, STIFFNESS, CELL_KG = 5, 2e-3, 8.6e-3, 15e-6
GRAVITY = np.array([9.81, 0.0, -4.0])
EXACT = {"exact_arm": fkm_exact_arm, "sliding": fkm_sliding}
SETTLE = {"exact_arm": "_settle", "sliding": "_settle_sliding"}
exact_models = pytest.mark.parametrize("name", EXACT)


def short(mu: float = 0.3, mass: float = 1.0) -> ContinuumRobot:
    """Return a section of five cells, `mass` times as heavy as printed."""
    robot = section(mu)
    whole = robot.segments[0]
    part = replace(whole, length_m=CELLS * CELL_M, disks=CELLS, mass_kg=mass * CELLS * CELL_KG)
    return replace(robot, segments=(part,))


def unbalanced(posture: Posture, inputs: Inputs, row: int, gravity: Array, mass: float) -> Array:
    """Return the moment left about y at every hinge, all that lies beyond it cut free, shape (n,) [N m].

    Straight tendons pull the eyelet in a cell's far face toward that in the near one; each face carries its
    cell's weight, the last one the tip's force and moment.
    """
    angles = cell_angles(posture)
    holes = eyelets(short(), posture)
    left = np.zeros(CELLS)
    for k in range(CELLS):
        hinge = posture.p_w[k] - 0.5 * CELL_M * posture.R_w[k, :, 2]
        moment = np.cross(posture.p_w[-1] - hinge, inputs.force_tip[row]) + inputs.moment_tip[row]
        for j in range(2):
            toward = holes[j, k] - holes[j, k + 1]
            force = posture.tendon_tension[j, k] * toward / np.linalg.norm(toward)
            moment = moment + np.cross(holes[j, k + 1] - hinge, force)
        for face in posture.p_w[k:]:
            moment = moment + np.cross(face - hinge, mass * CELL_KG * gravity)
        left[k] = moment[1] - STIFFNESS * angles[k]
    return left


def loaded() -> Inputs:
    """Return pulls with forces and moments on the tip; what acts out of the plane does nothing."""
    return tensions(
        [[0.5, 0.1], [0.9, 0.1], [0.4, 0.3]],
        [[0.0, 0.0, 0.0], [0.02, 0.3, -0.05], [-0.03, -0.2, 0.04]],
        [[0.0, 0.0, 0.0], [5e-4, 2e-4, 3e-4], [-4e-4, -3e-4, 1e-4]],
    )


@exact_models
def test_tendons_loads_and_backbone_balance_in_space(name: str) -> None:
    """About every hinge, under weight and tip loads, nothing is left; each load moves the robot."""
    inputs, mass = loaded(), 100.0
    run = EXACT[name](short(mass=mass), inputs, GRAVITY)
    for row, posture in enumerate(run.postures):
        assert np.abs(unbalanced(posture, inputs, row, GRAVITY, mass)).max() < 1e-9 * STIFFNESS
        without = unbalanced(posture, inputs, row, np.zeros(3), mass)
        assert np.abs(without).max() > 1e-3 * STIFFNESS  # the weight counts
    tips = [posture.p_w[-1, 0] for posture in run.postures]
    assert np.ptp(tips) > 1e-4


@exact_models
def test_pulled_tendon_loses_tension_by_the_turn_at_each_eyelet(name: str) -> None:
    """Loading: at the eyelet between two cells it turns by half of both bends, and loses exp(-mu turn)."""
    (posture,) = EXACT[name](short(0.4), single(1.2), np.zeros(3)).postures
    angles = posture.joint_angles
    turn = 0.5 * (angles + np.concatenate([[0.0], angles[:-1]]))
    expected = 1.2 * np.exp(-0.4 * np.cumsum(turn))
    assert angles.sum() > 0.5
    assert posture.tendon_tension[0] == pytest.approx(expected, rel=1e-6)


@exact_models
def test_mount_is_pressed_in_by_tensions_and_weight(name: str) -> None:
    """At 5 N/mm every newton along -z takes every face 0.2 mm down, and a pull along +z up."""
    firm = short(mass=100.0)
    soft = replace(firm, mount=Mount(5e3))
    inputs = tensions([[0.5, 0.2], [0.0, 0.0]], [[0, 0, 0], [0, 0, 0.3]])
    runs = [EXACT[name](robot, inputs, np.array([0.0, 0.0, -9.81])) for robot in (firm, soft)]
    weight = 100.0 * CELLS * CELL_KG * 9.81
    for row, load in enumerate((-0.7 - weight, 0.3 - weight)):
        moved = runs[1].postures[row].p_w - runs[0].postures[row].p_w
        assert moved == pytest.approx(np.tile([0.0, 0.0, load / 5e3], (CELLS, 1)), abs=1e-12)


@exact_models
def test_residual_is_the_moment_that_is_left(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver that stops short by 1 mrad is found out: the residual is the moment cut free at the hinges."""
    settle = getattr(exact_arm, SETTLE[name])
    off = 1e-3 * np.array([1.0, -1.0, 0.5, 0.0, -0.3])

    def short_of_it(*arguments: object) -> object:
        state = settle(*arguments)
        return replace(state, angles=state.angles + off)

    inputs, mass = loaded(), 100.0
    exact = EXACT[name](short(mass=mass), inputs, GRAVITY)
    assert exact.residual.max() < 1e-10 * STIFFNESS
    monkeypatch.setattr(exact_arm, SETTLE[name], short_of_it)
    run = EXACT[name](short(mass=mass), inputs, GRAVITY)
    left = [
        np.abs(unbalanced(posture, inputs, row, GRAVITY, mass)).max()
        for row, posture in enumerate(run.postures)
    ]
    assert min(left) > 5e-4 * STIFFNESS
    assert run.residual == pytest.approx(left, rel=1e-6)


@pytest.mark.parametrize("model", [fkm, fkm_stick, pcca])
def test_residual_of_the_printed_mapping_is_the_moment_that_is_left(
    model: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cells bent by 1 mrad too much lack K times 1 mrad."""

    def residual() -> Array:
        run = model(short(), single(0.3, 0.6, 0.2), np.zeros(3))  # type: ignore[operator]
        assert isinstance(run, StaticRun)
        return run.residual

    assert residual().max() < 1e-12
    bend = kato._bend_angle
    monkeypatch.setattr(kato, "_bend_angle", lambda *arguments: bend(*arguments) + 1e-3)
    assert residual() == pytest.approx(np.full(3, 1e-3 * STIFFNESS), rel=1e-9)
