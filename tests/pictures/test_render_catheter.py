"""Catheters in pictures: the render check on them, and the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from catheter_sim.cli.main import main
from catheter_sim.pictures.images import TOLERANCE_PX, centreline
from catheter_sim.robots.catheter.kinematics import pk
from catheter_sim.validation.mitral import FOUR_DOF, TRANSSEPTAL, catheter, displaced
from catheter_sim.validation.render import (
    FOUR_DOF_MM,
    TRANSSEPTAL_MM,
)
from catheter_sim.validation.render import (
    catheter_distances_px as mean_distances_px,
)

pytestmark = pytest.mark.slow

CASES = [(TRANSSEPTAL, TRANSSEPTAL_MM), (FOUR_DOF, FOUR_DOF_MM)]


@pytest.mark.parametrize(("name", "rows"), CASES)
def test_bent_catheter_is_drawn_where_pure_kinematics_has_it(name: str, rows: np.ndarray) -> None:
    """All joints at once: within a pixel, and above one with displacements that are wrong by 3 %."""
    assert mean_distances_px(name, rows[7:8])[0] <= TOLERANCE_PX
    assert mean_distances_px(name, rows[7:8], too_far=1.03)[0] > TOLERANCE_PX


@pytest.mark.long
@pytest.mark.parametrize(("name", "rows"), CASES)
def test_ten_postures_are_drawn_where_pure_kinematics_has_them(name: str, rows: np.ndarray) -> None:
    """Each within a pixel, half a pixel in the mean; displacements wrong by 2 % are noticed."""
    distances = mean_distances_px(name, rows)
    assert max(distances) <= TOLERANCE_PX
    assert np.mean(distances) <= 0.5 * TOLERANCE_PX
    assert np.mean(mean_distances_px(name, rows, too_far=1.02)) > TOLERANCE_PX


@pytest.mark.parametrize(("name", "rows"), CASES)
def test_axis_goes_through_every_face(name: str, rows: np.ndarray) -> None:
    """Within a hundredth of a millimetre of each face's centre but the holder's, which is drawn shorter."""
    robot = catheter(name)
    for posture in pk(robot, displaced(rows), np.zeros(3)).postures:
        axis = centreline(robot, posture)
        step = np.diff(axis, axis=0)
        for face in posture.p_w[:-1]:
            along = np.clip(((face - axis[:-1]) * step).sum(axis=1) / (step**2).sum(axis=1), 0.0, 1.0)
            assert np.linalg.norm(axis[:-1] + along[:, np.newaxis] * step - face, axis=1).min() < 1e-5


def test_command_line_draws_a_file_of_displacements(tmp_path: Path) -> None:
    """From a CSV to a PNG that shows something."""
    table, path = tmp_path / "in.csv", tmp_path / "a.png"
    table.write_text("time_s,displacement_bending_proximal_mm,advance_mm\n0,2,30\n")
    size = ["--width", "320", "--height", "240"]
    assert main(["render", "mitral_4dof", "--inputs", str(table), "-o", str(path), *size]) == 0
    image = np.asarray(Image.open(path))
    assert image.shape == (240, 320, 3)
    assert image.std() > 5.0
