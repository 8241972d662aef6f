"""The static models of notched tubes."""

from __future__ import annotations

from catheter_sim.core.statics import StaticModel, unless
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot
from catheter_sim.kinds.notched_tube.theory.models import kinetostatic, york


def _is_uniform(robot: NotchedTubeRobot) -> bool:
    return len(robot.segments) == 1


MODELS: tuple[StaticModel[NotchedTubeRobot], ...] = (
    StaticModel(
        "york",
        "equal arcs and Castigliano's theorem, as printed in York 2015; knows no unloading, load or weight",
        york,
        unless(_is_uniform, "several segments"),
    ),
    StaticModel(
        "kinetostatic",
        "virtual work of every notch: superelastic metal, friction with history, weight and tip load",
        kinetostatic,
    ),
)
