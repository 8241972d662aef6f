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
    from catheter_sim.public.comparisons import Comparison, compare
    from catheter_sim.public.controlled import Control, control
    from catheter_sim.public.data import dataset, inputs, load_dataset, load_robot, read_inputs, save_robot
    from catheter_sim.public.diagnoses import Diagnosis, diagnose
    from catheter_sim.public.exports import Export, export
    from catheter_sim.public.foreign_models import ModelDiagnosis, diagnose_model
    from catheter_sim.public.inverse import InverseKinematics, inverse_kinematics
    from catheter_sim.public.laboratories import FoundOut, Laboratory, laboratory
    from catheter_sim.public.model_choice import ModelChoice, which_model
    from catheter_sim.public.offers import list_effects, list_environments, list_models, list_robots
    from catheter_sim.public.reach import Workspace, workspace
    from catheter_sim.public.runs import Run, build, render, simulate, statics, to_pymjcf
    from catheter_sim.public.sensing import Sensing, sense
    from catheter_sim.simulation.simulator import Simulator
    from catheter_sim.simulation.together import settle_together, step_together

__version__ = "0.1.0"

_HOME = {
    "catheter_sim.modelling.attach": ("attach",),
    "catheter_sim.public.controlled": ("Control", "control"),
    "catheter_sim.public.data": (
        *("dataset", "inputs", "load_dataset", "load_robot", "read_inputs"),
        "save_robot",
    ),
    "catheter_sim.public.comparisons": ("Comparison", "compare"),
    "catheter_sim.public.diagnoses": ("Diagnosis", "diagnose"),
    "catheter_sim.public.exports": ("Export", "export"),
    "catheter_sim.public.foreign_models": ("ModelDiagnosis", "diagnose_model"),
    "catheter_sim.public.inverse": ("InverseKinematics", "inverse_kinematics"),
    "catheter_sim.public.laboratories": ("FoundOut", "Laboratory", "laboratory"),
    "catheter_sim.public.model_choice": ("ModelChoice", "which_model"),
    "catheter_sim.public.offers": ("list_effects", "list_environments", "list_models", "list_robots"),
    "catheter_sim.public.reach": ("Workspace", "workspace"),
    "catheter_sim.public.runs": ("Run", "build", "render", "simulate", "statics", "to_pymjcf"),
    "catheter_sim.public.sensing": ("Sensing", "sense"),
    "catheter_sim.simulation.simulator": ("Simulator",),
    "catheter_sim.simulation.together": ("settle_together", "step_together"),
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
