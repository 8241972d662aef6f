"""Catheters in pictures: the command line, and where a caption goes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from catheter_sim.cli.main import main
from catheter_sim.modelling.build import View
from catheter_sim.pictures.offscreen import emptiest_corner

pytestmark = pytest.mark.slow


def test_command_line_draws_a_file_of_displacements(tmp_path: Path) -> None:
    """From a CSV to a PNG that shows something."""
    table, path = tmp_path / "in.csv", tmp_path / "a.png"
    table.write_text("time_s,displacement_bending_proximal_mm,advance_mm\n0,2,30\n")
    size = ["--width", "320", "--height", "240"]
    assert main(["render", "mitral_4dof", "--inputs", str(table), "-o", str(path), *size]) == 0
    image = np.asarray(Image.open(path))
    assert image.shape == (240, 320, 3)
    assert image.std() > 5.0


def test_caption_takes_the_emptiest_corner_that_is_left() -> None:
    """The close-up's corner is no choice for it, nor is the one in which the robot is."""
    view = View("side", np.zeros(3), np.array([0.0, -1.0, 0.0]), 2.0)
    upper_right = np.array([(1.5, 0.0, 0.9)])
    first = emptiest_corner(view, upper_right, 1600, 1000, (300, 300))
    assert first == (0, 0)
    assert emptiest_corner(view, upper_right, 1600, 1000, (300, 300), taken=[first]) == (1, 0)
