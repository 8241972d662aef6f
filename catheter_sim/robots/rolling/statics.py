"""The static models of robots of rolling joints."""

from __future__ import annotations

from catheter_sim.core.statics import StaticModel
from catheter_sim.robots.rolling.complete import complete, complete_sliding, virtual_work
from catheter_sim.robots.rolling.pcc import pcc
from catheter_sim.robots.rolling.printed import printed
from catheter_sim.robots.rolling.spec import RollingRobot

MODELS: tuple[StaticModel[RollingRobot], ...] = (
    StaticModel(
        "printed",
        "the balance of chest_tube_2025, Eqs 1-24, as printed with the least repairs; knows no unloading",
        printed,
    ),
    StaticModel(
        "complete", "Newton-Euler balance of every link, friction with history, weight and tip load", complete
    ),
    StaticModel(
        "complete_sliding",
        "as complete, with friction always by how rods slide, also of one rod alone",
        complete_sliding,
    ),
    StaticModel(
        "virtual_work",
        "as complete, by virtual work, with friction always by the rods' tensions",
        virtual_work,
    ),
    StaticModel(
        "pcc", "piecewise constant curvature, no friction, no weight (as compared in chest_tube_2025)", pcc
    ),
)
