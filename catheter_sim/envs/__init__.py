"""Gymnasium environments: register them here, a line for each robot and for each task.

Importing this package registers them, and so does importing Gymnasium where this package is installed
(`_startup.py`): `gymnasium.make("catheter_sim/NeuroendoscopeReach-v0")` works in a fresh interpreter.
Gymnasium 1.x reads no plug-ins; the entry point in the group `gymnasium.envs` serves programs that
still read it, such as Gymnasium before 1.0.
"""

from __future__ import annotations

from typing import Any

import gymnasium

EPISODE_STEPS = 100  # control steps, 10 simulated seconds: five times the way through a drive's range

# At 50.2 N the rod would bend the frictionless section so far; the prototype was measured up to 47.9 N.
CHEST_TUBE_SECTION_BEND_RAD = 3.0
# Assumed: the tip of a single section moves on a curve, where it comes near a target more easily.
SECTION_TOLERANCE_M = 2e-3
# Assumed: what a valve's leaflets ask for is finer than a tumour; chance reaches none of 100 targets anyway.
MITRAL_TOLERANCE_M = 2e-3


# task -> entry point, entry point for many
_TASKS = {
    "Reach": ("catheter_sim.envs.reach:ReachEnv", "catheter_sim.envs.vector:reach"),
    "Track": ("catheter_sim.envs.track:TrackEnv", "catheter_sim.envs.vector:track"),
}
_DELIVER = "catheter_sim.envs.clinical.deliver:DeliverEnv", "catheter_sim.envs.vector:deliver"
# name of the robot in ids -> arguments of its tasks
_ROBOTS: dict[str, dict[str, Any]] = {
    "Neuroendoscope": {"robot": "neuroendoscope"},
    "NeuroendoscopeSection": {"robot": "neuroendoscope_section", "tolerance_m": SECTION_TOLERANCE_M},
    "ChestTube": {"robot": "chest_tube"},
    "ChestTubeSection": {
        "robot": "chest_tube_section",
        "largest_bend_rad": CHEST_TUBE_SECTION_BEND_RAD,
        "tolerance_m": SECTION_TOLERANCE_M,
    },
    "MitralTransseptal": {"robot": "mitral_transseptal", "tolerance_m": MITRAL_TOLERANCE_M},
    "Mitral4dof": {"robot": "mitral_4dof", "tolerance_m": MITRAL_TOLERANCE_M},
}
# Kato 2016 articulates a section with up to 0.65 N; this asks for 0.61 N of the distal tendons.
TUMOUR_BEND_RAD = 3.0
CLINICAL_STEPS = 200  # 20 simulated seconds
INSERT_BEND_RAD = (
    3.0  # assumed: so that few joints can make the turn; 100 N at most (chest_tube_2025, Table I)
)
INSERT_TOLERANCE_M = 10e-3  # assumed: about the tube's outer diameter
# name -> entry point, entry point for many; arguments
_CLINICAL: dict[str, tuple[tuple[str, str], dict[str, Any]]] = {
    "NeuroendoscopeTumour": (
        ("catheter_sim.envs.clinical.tumour:TumourEnv", "catheter_sim.envs.vector:tumour"),
        {"robot": "neuroendoscope", "largest_bend_rad": TUMOUR_BEND_RAD},
    ),
    "ChestTubeInsert": (
        ("catheter_sim.envs.clinical.insert:InsertEnv", "catheter_sim.envs.vector:insert"),
        {"robot": "chest_tube", "largest_bend_rad": INSERT_BEND_RAD, "tolerance_m": INSERT_TOLERANCE_M},
    ),
    "MitralTransseptalDeliver": (_DELIVER, {"robot": "mitral_transseptal"}),
    "Mitral4dofDeliver": (_DELIVER, {"robot": "mitral_4dof"}),
}


def register_environments() -> None:
    """Register the environments with Gymnasium; those that are registered already stay as they are."""
    for robot, arguments in _ROBOTS.items():
        for task, entry_points in _TASKS.items():
            _register(robot + task, entry_points, EPISODE_STEPS, arguments)
    for name, (entry_points, arguments) in _CLINICAL.items():
        _register(name, entry_points, CLINICAL_STEPS, arguments)


def _register(name: str, entry_points: tuple[str, str], steps: int, arguments: dict[str, Any]) -> None:
    full = f"catheter_sim/{name}-v0"
    if full not in gymnasium.registry:
        single, many = entry_points
        gymnasium.register(
            full, single, max_episode_steps=steps, kwargs=dict(arguments), vector_entry_point=many
        )
