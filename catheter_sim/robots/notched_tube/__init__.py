"""Tubes with notches cut into their wall, bent by one tendon."""

from __future__ import annotations

from typing import TYPE_CHECKING

from catheter_sim.core.kind import Kind
from catheter_sim.robots.notched_tube.spec import NotchedTubeRobot

KIND = Kind("notched_tube", NotchedTubeRobot, __name__)

if TYPE_CHECKING:  # mypy holds the faces to their protocols
    from catheter_sim.core.kind import Checks, Drives, Model, Picture, Steering
    from catheter_sim.core.law import Batched, Laws
    from catheter_sim.core.published import Robots
    from catheter_sim.robots.notched_tube import (
        batched,
        description,
        laws,
        model,
        picture,
        published,
        steering,
    )

    _checks: Checks[NotchedTubeRobot] = description
    _drives: Drives[NotchedTubeRobot] = description
    _model: Model[NotchedTubeRobot] = model
    _picture: Picture[NotchedTubeRobot] = picture
    _steering: Steering[NotchedTubeRobot] = steering
    _robots: Robots = published
    _laws: Laws[NotchedTubeRobot] = laws
    _batched: Batched[NotchedTubeRobot] = batched
