"""Tendon-driven continuum robots: segments of bending backbone with disks or cells."""

from typing import TYPE_CHECKING

from catheter_sim.core.kind import Kind
from catheter_sim.kinds.continuum.spec import ContinuumRobot

KIND = Kind("continuum", ContinuumRobot, __name__)

if TYPE_CHECKING:  # mypy holds the faces to their protocols
    from catheter_sim.core.kind import Checks, Drives, Model, Picture, Steering
    from catheter_sim.core.law import Laws
    from catheter_sim.core.law_copies import Batched
    from catheter_sim.core.published import Robots
    from catheter_sim.kinds.continuum import (
        batched,
        checks,
        drives,
        gpu,
        laws,
        model,
        picture,
        robots,
        steering,
    )
    from catheter_sim.mechanics.device import Gpu

    _checks: Checks[ContinuumRobot] = checks
    _drives: Drives[ContinuumRobot] = drives
    _model: Model[ContinuumRobot] = model
    _picture: Picture[ContinuumRobot] = picture
    _steering: Steering[ContinuumRobot] = steering
    _robots: Robots = robots
    _laws: Laws[ContinuumRobot] = laws
    _batched: Batched[ContinuumRobot] = batched
    _gpu: Gpu[ContinuumRobot] = gpu
