"""The render checks: drawn pixels against the analytic models' projected shapes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import View
from catheter_sim.pictures.images import TOLERANCE_PX, check_render
from catheter_sim.robots.catheter.kinematics import pk
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.lines import NO_GRAVITY, Line, Validation, given
from catheter_sim.validation.mitral import catheter, displaced

# ----------------------------------------------------------------------------------------------------
# The render check: the drawn robot's pixels against the analytic model's projected shape.


@dataclass(frozen=True)
class RenderCase:
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


NEUROENDOSCOPE = RenderCase(
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
CHEST_TUBE = RenderCase(
    "chest_tube_section",
    "complete",
    "links' pixels",
    np.array([(0.0,), (2.0,), (5.0,), (10.0,), (20.0,), (35.0,), (50.0,), (30.0,), (12.0,), (4.0,)]),
)


def mean_distances_px(stiffness_scale: float = 1.0, case: RenderCase = NEUROENDOSCOPE) -> list[float]:
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


def _checked(case: RenderCase) -> Validation:
    """Return the check of `case` at 640x480; it says so where nothing can be rendered."""
    what = f"ten postures rendered at 640x480: {case.shown} to {case.model}, mean distance"
    source = "analytic shape through the camera's known matrix"
    try:
        mean = float(np.mean(mean_distances_px(case=case)))
    except InputError as error:
        return Validation((), (f"{case.robot}: render check not run: {error}",))
    return Validation((Line(case.robot, what, "px", mean, TOLERANCE_PX, source),), ())


# ----------------------------------------------------------------------------------------------------
# The render check of both mitral catheters: ten simulated postures of each against pure kinematics.

# Displacements and advance in the robots' order [mm]: every joint alone, then all together.
TRANSSEPTAL_MM = np.array(
    [
        (0.0, 0.0, 0.0, 0.0),
        (1.5, 0.0, 0.0, 0.0),
        (3.0, 0.0, 0.0, 10.0),
        (-3.8, 0.0, 0.0, 0.0),
        (2.5, 2.0, 0.0, 30.0),
        (2.5, -3.4, 0.0, 30.0),
        (0.0, 0.0, 3.0, 60.0),
        (-2.0, 1.5, -1.0, 50.0),
        (3.5, 1.0, 2.0, 60.0),
        (1.0, 1.0, -1.0, 20.0),
    ]
)
FOUR_DOF_MM = np.array(
    [
        (0.0, 0.0, 0.0, 0.0),
        (1.5, 0.0, 0.0, 0.0),
        (-3.3, 0.0, 0.0, 20.0),
        (0.0, 2.0, 0.0, 0.0),
        (0.0, -4.4, 0.0, 30.0),
        (2.0, 2.0, 0.0, 40.0),
        (-2.0, 3.0, 1.0, 60.0),
        (3.0, -1.5, -2.0, 50.0),
        (0.0, 0.0, 2.7, 60.0),
        (1.0, 1.0, -1.0, 20.0),
    ]
)


def catheter_distances_px(name: str, rows_mm: Array, too_far: float = 1.0) -> list[float]:
    """Return the mean distance of rendered and analytic axis for simulated postures [px].

    Args:
        name: robot id.
        rows_mm: displacements and advances, shape (r, 4) [mm].
        too_far: factor on the displacements of the analytic model alone; 1.02 is wrong by 2 %.
    """
    robot = catheter(name)
    expected = pk(robot, displaced(rows_mm * too_far), NO_GRAVITY).postures
    distances: list[float] = []

    def compare(simulator: Simulator, row: int) -> None:
        face_the_bend(simulator.model, expected[row].p_w[-1])
        mujoco.mj_forward(simulator.model, simulator.data)
        distances.append(check_render(robot, simulator.model, simulator.data, expected[row]).mean_px)

    simulate(robot, displaced(rows_mm), NO_GRAVITY, on_row=compare)
    return distances


def face_the_bend(model: mujoco.MjModel, tip: Array) -> None:
    """Turn the side camera about the base's axis until it faces the plane of that axis and `tip` [m].

    Seen from the front, a bent robot is foreshortened, and its pixels' middle is not its axis.
    """
    azimuth = math.atan2(tip[1], tip[0]) - math.pi / 2.0 if np.hypot(*tip[:2]) > 1e-6 else -math.pi / 2.0
    backward = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    camera = model.camera("side")
    axes = View("side", np.zeros(3), backward, 1.0).axes
    camera.pos[:2] = np.hypot(*camera.pos[:2]) * backward[:2]
    mujoco.mju_mat2Quat(camera.quat, np.stack([*axes, backward], axis=1).ravel())


def validate_render_transseptal(folder: Path) -> Validation:
    """Check ten rendered postures of the transseptal catheter; nothing is written."""
    return _catheters_checked("mitral_transseptal", TRANSSEPTAL_MM)


def validate_render_4dof(folder: Path) -> Validation:
    """Check ten rendered postures of the 4-DoF catheter; nothing is written."""
    return _catheters_checked("mitral_4dof", FOUR_DOF_MM)


def _catheters_checked(name: str, rows_mm: Array) -> Validation:
    """Return the check at 640x480; it says so where nothing can be rendered."""
    what = "ten postures rendered at 640x480: rings' and modules' pixels to pk, mean distance"
    source = "analytic axis through the camera's known matrix"
    try:
        mean = float(np.mean(catheter_distances_px(name, rows_mm)))
    except InputError as error:
        return Validation((), (f"{name}: render check not run: {error}",))
    return Validation((Line(name, what, "px", mean, TOLERANCE_PX, source),), ())
