"""Tendon-driven continuum robots: segments of bending backbone with disks or cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

from catheter_sim.core.kind import Kind
from catheter_sim.robots.continuum.spec import ContinuumRobot

KIND = Kind("continuum", ContinuumRobot, __name__)

if TYPE_CHECKING:  # mypy holds the faces to their protocols
    from catheter_sim.core.kind import Checks, Drives, Model, Picture, Steering
    from catheter_sim.core.law import Batched, Laws
    from catheter_sim.core.published import Robots
    from catheter_sim.gpu import continuum
    from catheter_sim.gpu.device import Gpu
    from catheter_sim.robots.continuum import (
        batched,
        description,
        laws,
        model,
        picture,
        published,
        steering,
    )

    _checks: Checks[ContinuumRobot] = description
    _drives: Drives[ContinuumRobot] = description
    _model: Model[ContinuumRobot] = model
    _picture: Picture[ContinuumRobot] = picture
    _steering: Steering[ContinuumRobot] = steering
    _robots: Robots = published
    _laws: Laws[ContinuumRobot] = laws
    _batched: Batched[ContinuumRobot] = batched
    _gpu: Gpu[ContinuumRobot] = continuum
