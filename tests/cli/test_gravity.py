"""Claims about `--gravity`: what it does is a robot's weight, in its direction."""

from __future__ import annotations

import numpy as np
import pytest
from cli_command import Run

from catheter_sim.tables import read_table


@pytest.mark.parametrize("across", [0.01, -0.01])
@pytest.mark.parametrize("model", ["fkm_exact_arm", "fkm_sliding"])
def test_statics_sags_by_the_weight_of_its_cells(run: Run, inputs: str, model: str, across: float) -> None:
    """A weak gravity along x moves the tip as the moments of 30 cells of 15 mg at their hinges say."""
    hinges = (2 * np.arange(1, 31) - 1) * 1e-3
    masses = 2 * np.arange(1, 31) * 1e-3
    moments = np.array([15e-6 * across * np.sum((masses - z)[masses > z]) for z in hinges])
    sag_mm = 1e3 * np.sum(moments * (0.06 - hinges)) / 8.6e-3
    arguments = ("neuroendoscope_section", "--model", model, "--inputs", inputs, f"--gravity={across},0,0")
    assert run("statics", *arguments, "-o", "out.csv", "--columns", "tip_x_mm,tip_y_mm").status == 0
    table = read_table("out.csv")
    assert table.columns["tip_x_mm"][0] == pytest.approx(sag_mm, rel=2e-3)
    assert table.columns["tip_y_mm"][0] == pytest.approx(0.0, abs=1e-9)
