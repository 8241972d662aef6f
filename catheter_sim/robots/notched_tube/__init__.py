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
        laws,
        model,
        picture,
        steering,
    )
    from catheter_sim.robots.notched_tube import (
        description as checks,
    )
    from catheter_sim.robots.notched_tube import (
        description as drives,
    )
    from catheter_sim.robots.notched_tube import (
        published as robots,
    )

    _checks: Checks[NotchedTubeRobot] = checks
    _drives: Drives[NotchedTubeRobot] = drives
    _model: Model[NotchedTubeRobot] = model
    _picture: Picture[NotchedTubeRobot] = picture
    _steering: Steering[NotchedTubeRobot] = steering
    _robots: Robots = robots
    _laws: Laws[NotchedTubeRobot] = laws
    _batched: Batched[NotchedTubeRobot] = batched
