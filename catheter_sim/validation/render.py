"""The render check: the drawn robot's pixels against the analytic model's projected shape."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.pictures.check import TOLERANCE_PX, check_render
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.theory.run import STATIC_MODELS
from catheter_sim.validation.drives import NO_GRAVITY, given
from catheter_sim.validation.lines import Line, Validation


@dataclass(frozen=True)
class Case:
    """Ten postures of a robot, and the static model that they are compared with.

    Attributes:
        robot: robot id.
        model: name in `STATIC_MODELS`.
        shown: what the check looks at.
        tension_N: at the actuator, shape (10, t).
    """

    robot: str
    model: str
    shown: str
    tension_N: Array


NEUROENDOSCOPE = Case(
    "neuroendoscope_section",
    "fkm_sliding",
    "backbone's pixels",
    np.array(
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
    ),
)
CHEST_TUBE = Case(
    "chest_tube_section",
    "complete",
    "links' pixels",
    np.array([(0.0,), (2.0,), (5.0,), (10.0,), (20.0,), (35.0,), (50.0,), (30.0,), (12.0,), (4.0,)]),
)


def mean_distances_px(stiffness_scale: float = 1.0, case: Case = NEUROENDOSCOPE) -> list[float]:
    """Return the mean distance of rendered and analytic centreline for ten simulated postures [px].

    Args:
        stiffness_scale: of the analytic model alone; 1.02 is a model that is wrong by 2 %.
        case: the postures.
    """
    robot, inputs = load_robot(case.robot), given(case.tension_N)
    analytic = replace(robot, stiffness_scale=stiffness_scale)
    expected = STATIC_MODELS[case.model].solve(analytic, inputs, NO_GRAVITY).postures
    distances: list[float] = []

    def compare(simulator: Simulator, row: int) -> None:
        mujoco.mj_forward(simulator.model, simulator.data)
        distances.append(check_render(robot, simulator.model, simulator.data, expected[row]).mean_px)

    simulate(robot, inputs, NO_GRAVITY, on_row=compare)
    return distances


def validate_render(folder: Path) -> Validation:
    """Check ten rendered postures of the neuroendoscope's section; nothing is written."""
    return _checked(NEUROENDOSCOPE)


def validate_render_chest_tube(folder: Path) -> Validation:
    """Check ten rendered postures of the chest tube's section; nothing is written."""
    return _checked(CHEST_TUBE)


def _checked(case: Case) -> Validation:
    """Return the check of `case` at 640x480; it says so where nothing can be rendered."""
    what = f"ten postures rendered at 640x480: {case.shown} to {case.model}, mean distance"
    source = "analytic shape through the camera's known matrix"
    try:
        mean = float(np.mean(mean_distances_px(case=case)))
    except InputError as error:
        return Validation((), (f"{case.robot}: render check not run: {error}",))
    return Validation((Line(case.robot, what, "px", mean, TOLERANCE_PX, source),), ())
