"""Catheters of torsion, bending and prismatic joints in a row, moved by antagonistic pairs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from catheter_sim.core.kind import Kind
from catheter_sim.robots.catheter.spec import CatheterRobot

KIND = Kind("catheter", CatheterRobot, __name__)

if TYPE_CHECKING:  # mypy holds the faces to their protocols
    from catheter_sim.core.kind import Checks, Drives, Model, Picture, Steering
    from catheter_sim.core.law import Batched, Laws
    from catheter_sim.core.published import Robots
    from catheter_sim.gpu import catheter as gpu
    from catheter_sim.gpu.device import Gpu
    from catheter_sim.robots.catheter import (
        batched,
        laws,
        model,
        picture,
        steering,
    )
    from catheter_sim.robots.catheter import (
        description as checks,
    )
    from catheter_sim.robots.catheter import (
        description as drives,
    )
    from catheter_sim.robots.catheter import (
        published as robots,
    )

    _checks: Checks[CatheterRobot] = checks
    _drives: Drives[CatheterRobot] = drives
    _model: Model[CatheterRobot] = model
    _picture: Picture[CatheterRobot] = picture
    _steering: Steering[CatheterRobot] = steering
    _robots: Robots = robots
    _laws: Laws[CatheterRobot] = laws
    _batched: Batched[CatheterRobot] = batched
    _gpu: Gpu[CatheterRobot] = gpu
