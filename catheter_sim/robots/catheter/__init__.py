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
    from catheter_sim.gpu import catheter
    from catheter_sim.gpu.device import Gpu
    from catheter_sim.robots.catheter import (
        batched,
        description,
        laws,
        model,
        picture,
        published,
        steering,
    )

    _checks: Checks[CatheterRobot] = description
    _drives: Drives[CatheterRobot] = description
    _model: Model[CatheterRobot] = model
    _picture: Picture[CatheterRobot] = picture
    _steering: Steering[CatheterRobot] = steering
    _robots: Robots = published
    _laws: Laws[CatheterRobot] = laws
    _batched: Batched[CatheterRobot] = batched
    _gpu: Gpu[CatheterRobot] = catheter
