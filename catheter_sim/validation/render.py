"""The render check: the backbone's pixels against the analytic model's projected shape."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from catheter_sim.errors import InputError
from catheter_sim.render.check import check_render
from catheter_sim.robots.neuroendoscope import neuroendoscope_section
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.statics.sliding import fkm_sliding
from catheter_sim.validation.drives import NO_GRAVITY, given
from catheter_sim.validation.lines import Line, Validation

TEN_ROWS_N = np.array(
    [
        (0.12, 0.12),
        (0.24, 0.12),
        (0.36, 0.12),
        (0.5, 0.12),
        (0.65, 0.12),
        (0.48, 0.12),
        (0.3, 0.12),
        (0.12, 0.12),
        (0.12, 0.3),
        (0.12, 0.5),
    ]
)


def mean_distances_px(stiffness_scale: float = 1.0) -> list[float]:
    """Return the mean distance of rendered and analytic backbone for ten simulated postures [px].

    Args:
        stiffness_scale: of the analytic model alone; 1.02 is a model that is wrong by 2 %.
    """
    robot = neuroendoscope_section()
    inputs = given(TEN_ROWS_N)
    analytic = replace(robot, stiffness_scale=stiffness_scale)
    expected = fkm_sliding(analytic, inputs, NO_GRAVITY).postures
    distances: list[float] = []

    def compare(simulator: Simulator, row: int) -> None:
        mujoco.mj_forward(simulator.model, simulator.data)
        distances.append(check_render(simulator.model, simulator.data, expected[row]).mean_px)

    simulate(robot, inputs, NO_GRAVITY, on_row=compare)
    return distances


def validate_render(folder: Path) -> Validation:
    """Check ten rendered postures at 640x480; says so where nothing can be rendered."""
    what = "ten postures rendered at 640x480: backbone's pixels to fkm_sliding, mean distance"
    source = "analytic shape through the camera's known matrix"
    try:
        mean = float(np.mean(mean_distances_px()))
    except InputError as error:
        return Validation((), (f"render check not run: {error}",))
    return Validation((Line("neuroendoscope_section", what, "px", mean, 1.0, source),), ())
