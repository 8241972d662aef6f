"""Robots of rigid links with rolling joints, pulled by elastic rods."""

from __future__ import annotations

from typing import TYPE_CHECKING

from catheter_sim.core.kind import Kind
from catheter_sim.robots.rolling.spec import RollingRobot

KIND = Kind("rolling", RollingRobot, __name__)

if TYPE_CHECKING:  # mypy holds the faces to their protocols
    from catheter_sim.core.kind import Checks, Drives, Model, Picture, Steering
    from catheter_sim.core.law import Batched, Laws
    from catheter_sim.core.published import Robots
    from catheter_sim.gpu import rolling as gpu
    from catheter_sim.gpu.device import Gpu
    from catheter_sim.robots.rolling import (
        batched,
        laws,
        model,
        picture,
        steering,
    )
    from catheter_sim.robots.rolling import (
        description as checks,
    )
    from catheter_sim.robots.rolling import (
        description as drives,
    )
    from catheter_sim.robots.rolling import (
        published as robots,
    )

    _checks: Checks[RollingRobot] = checks
    _drives: Drives[RollingRobot] = drives
    _model: Model[RollingRobot] = model
    _picture: Picture[RollingRobot] = picture
    _steering: Steering[RollingRobot] = steering
    _robots: Robots = robots
    _laws: Laws[RollingRobot] = laws
    _batched: Batched[RollingRobot] = batched
    _gpu: Gpu[RollingRobot] = gpu
