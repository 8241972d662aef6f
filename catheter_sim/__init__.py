"""Simulation of tendon- and rod-driven medical continuum robots in MuJoCo, checked against theory.

`import catheter_sim as cs` is the public face: every name below is here, and imported when it is first used.
Importing the package registers its Gymnasium environments (`catheter_sim/<Robot><Task>-v0`).
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from catheter_sim.envs import register_environments
from catheter_sim.errors import InputError, RobotNote, SimulationDiverged

if TYPE_CHECKING:
    from catheter_sim.modelling.attach import attach
    from catheter_sim.public.data import (
        dataset,
        inputs,
        list_effects,
        list_environments,
        list_models,
        list_robots,
        load_dataset,
        load_robot,
        read_inputs,
        save_robot,
    )
    from catheter_sim.public.diagnoses import (
        Comparison,
        Diagnosis,
        ModelDiagnosis,
        compare,
        diagnose,
        diagnose_model,
    )
    from catheter_sim.public.laboratories import Export, FoundOut, Laboratory, export, laboratory
    from catheter_sim.public.live import LiveView, view
    from catheter_sim.public.planning import (
        InverseKinematics,
        ModelChoice,
        Sensing,
        Workspace,
        inverse_kinematics,
        sense,
        which_model,
        workspace,
    )
    from catheter_sim.public.runs import Control, Run, build, control, render, simulate, statics, to_pymjcf
    from catheter_sim.simulation.simulator import Simulator
    from catheter_sim.simulation.together import settle_together, step_together

__version__ = "0.1.0"

_HOME = {
    "catheter_sim.modelling.attach": ("attach",),
    "catheter_sim.public.data": (
        "dataset",
        "inputs",
        "list_effects",
        "list_environments",
        "list_models",
        "list_robots",
        "load_dataset",
        "load_robot",
        "read_inputs",
        "save_robot",
    ),
    "catheter_sim.public.diagnoses": (
        "Comparison",
        "Diagnosis",
        "ModelDiagnosis",
        "compare",
        "diagnose",
        "diagnose_model",
    ),
    "catheter_sim.public.laboratories": (
        "Export",
        "FoundOut",
        "Laboratory",
        "export",
        "laboratory",
    ),
    "catheter_sim.public.live": ("LiveView", "view"),
    "catheter_sim.public.planning": (
        "InverseKinematics",
        "ModelChoice",
        "Sensing",
        "Workspace",
        "inverse_kinematics",
        "sense",
        "which_model",
        "workspace",
    ),
    "catheter_sim.public.runs": (
        "Control",
        "Run",
        "build",
        "control",
        "render",
        "simulate",
        "statics",
        "to_pymjcf",
    ),
    "catheter_sim.simulation.simulator": ("Simulator",),
    "catheter_sim.simulation.together": (
        "settle_together",
        "step_together",
    ),
}
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = [
    "Comparison",
    "Control",
    "Diagnosis",
    "Export",
    "FoundOut",
    "InputError",
    "InverseKinematics",
    "Laboratory",
    "LiveView",
    "ModelChoice",
    "ModelDiagnosis",
    "RobotNote",
    "Run",
    "Sensing",
    "SimulationDiverged",
    "Simulator",
    "Workspace",
    "attach",
    "build",
    "compare",
    "control",
    "dataset",
    "diagnose",
    "diagnose_model",
    "export",
    "inputs",
    "inverse_kinematics",
    "laboratory",
    "list_effects",
    "list_environments",
    "list_models",
    "list_robots",
    "load_dataset",
    "load_robot",
    "read_inputs",
    "render",
    "save_robot",
    "sense",
    "settle_together",
    "simulate",
    "statics",
    "step_together",
    "to_pymjcf",
    "view",
    "which_model",
    "workspace",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__all__", "__doc__", "__version__"])


register_environments()
