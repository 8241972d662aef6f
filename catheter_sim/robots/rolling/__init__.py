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
    from catheter_sim.gpu import rolling
    from catheter_sim.gpu.device import Gpu
    from catheter_sim.robots.rolling import (
        batched,
        description,
        laws,
        model,
        picture,
        published,
        steering,
    )

    _checks: Checks[RollingRobot] = description
    _drives: Drives[RollingRobot] = description
    _model: Model[RollingRobot] = model
    _picture: Picture[RollingRobot] = picture
    _steering: Steering[RollingRobot] = steering
    _robots: Robots = published
    _laws: Laws[RollingRobot] = laws
    _batched: Batched[RollingRobot] = batched
    _gpu: Gpu[RollingRobot] = rolling
