"""Catheters in pictures, by the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from catheter_sim.cli.main import main

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
