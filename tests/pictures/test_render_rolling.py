"""Robots of rolling joints in pictures: where they rolled to."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image

from catheter_sim.catalogue import load_robot
from catheter_sim.cli.main import main
from catheter_sim.pictures import offscreen
from catheter_sim.pictures.offscreen import put, state_of
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.simulation.simulator import Simulator

pytestmark = pytest.mark.slow


def section() -> RollingRobot:
    robot = load_robot("chest_tube_section")
    assert isinstance(robot, RollingRobot)
    return robot


def test_remembered_state_is_drawn_as_it_was() -> None:
    """Bent, then straight again: the bent state's sites and links come back to a micrometre."""
    simulator = Simulator(section(), inertia=False)
    simulator.set_inputs(np.array([30.0]))
    simulator.settle()
    bent = simulator.posture()
    state = state_of(simulator)
    links = simulator.data.geom_xpos.copy()
    simulator.reset()
    data = mujoco.MjData(simulator.model)
    put(state, simulator.model, data)
    faces = [simulator.model.site(f"face_{k}").id for k in range(1, 16)]
    assert np.abs(data.site_xpos[faces] - bent.p_w).max() < 1e-6
    assert np.abs(data.geom_xpos - links).max() < 1e-6


def test_tops_of_soft_links_are_drawn_where_their_faces_are() -> None:
    """With the prototype's links at 48 N, over a millimetre shorter, each drawn top ends in its face."""
    robot = load_robot("chest_tube_section@prototype")
    simulator = Simulator(robot, inertia=False)
    simulator.set_inputs(np.array([47.859]))
    simulator.settle()
    posture = simulator.posture()
    model, data = simulator.model, mujoco.MjData(simulator.model)
    put(state_of(simulator), model, data)
    shorter = 15e-3 - model.site_pos[model.site("face_1").id, 2]
    assert shorter > 1e-3
    for k in range(1, 16):
        geom = model.geom(f"link_top_{k}").id
        mesh = model.geom_dataid[geom]
        begin = model.mesh_vertadr[mesh]
        vertices = model.mesh_vert[begin : begin + model.mesh_vertnum[mesh]].astype(float)
        place = vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        along = (place - posture.p_w[k - 1]) @ posture.R_w[k - 1][:, 2]
        assert along.max() == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("name", ["chest_tube_section", "chest_tube_section@prototype"])
def test_section_is_drawn_bent_toward_plus_x(name: str) -> None:
    """Pulled by 10 N, the links reach to the right of the base, and above it."""
    simulator = Simulator(load_robot(name), inertia=False)
    simulator.set_inputs(np.array([10.0]))
    simulator.settle()
    states = [state_of(simulator)]
    (picture,) = offscreen.draw(
        simulator.robot,
        simulator.model,
        states,
        [()],
        640,
        480,
        offscreen.Look("side", legend=False),
        close_up=False,
    )
    image = picture.astype(int)
    row, column = np.nonzero(np.abs(image - image[2, 2]).max(axis=2) > 40)
    assert len(row) > 5000
    assert column[row == row.max()].mean() < column.min() + 0.2 * np.ptp(column)
    assert row[column == column.max()].mean() < row.max() - 0.3 * np.ptp(row)


def test_command_line_draws_a_file_of_inputs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From a CSV of tensions to a PNG of the size that was asked for."""
    table, path = tmp_path / "in.csv", tmp_path / "a.png"
    table.write_text("time_s,tension_active_N\n0,3\n")
    size = ["--width", "320", "--height", "240"]
    assert main(["render", "chest_tube_section", "--inputs", str(table), "-o", str(path), *size]) == 0
    assert capsys.readouterr().out == f"wrote {path}: 320 x 240 pixels\n"
    image = np.asarray(Image.open(path))
    assert image.shape == (240, 320, 3)
    assert image.std() > 5.0


def test_pictures_of_a_history_do_not_depend_on_one_another() -> None:
    """Drawn between two bent states, a straight one looks as it does alone."""
    simulator = Simulator(section(), inertia=False)
    straight = state_of(simulator)
    simulator.set_inputs(np.array([20.0]))
    simulator.settle()
    bent = state_of(simulator)
    history = [bent, straight, bent]
    drawn = list(
        offscreen.draw(
            simulator.robot,
            simulator.model,
            history,
            [()] * 3,
            320,
            240,
            offscreen.Look("side", legend=False),
            close_up=False,
        )
    )
    assert np.array_equal(drawn[0], drawn[2])
    assert (np.abs(drawn[0].astype(int) - drawn[1]).max(axis=2) > 30).sum() > 500
    again = list(
        offscreen.draw(
            simulator.robot,
            simulator.model,
            history[::-1],
            [()] * 3,
            320,
            240,
            offscreen.Look("side", legend=False),
            close_up=False,
        )
    )
    assert np.array_equal(again[1], drawn[1])
