"""Gymnasium environments: a line for each task here, and one for each robot where its numbers are.

`import catheter_sim` registers them; in a fresh interpreter
`gymnasium.make("catheter_sim:catheter_sim/NeuroendoscopeReach-v0")` imports it first.
"""

from __future__ import annotations

from typing import Any

import gymnasium

from catheter_sim.core.published import Environment
from catheter_sim.robots import KINDS

EPISODE_STEPS = 100  # control steps, 10 simulated seconds: five times the way through a drive's range

CLINICAL_STEPS = 200  # 20 simulated seconds
_LATER: dict[str, tuple[dict[str, Any], ...]] = {"Track": ({"time_left": True},)}  # arguments of v1, v2 ...

# task -> its class in `catheter_sim.envs`, and after how many steps an episode is truncated; many of a task
# are made by the function in `vector` that has its name
_TASKS = {
    "Reach": ("reach_and_track:ReachEnv", EPISODE_STEPS),
    "Track": ("reach_and_track:TrackEnv", EPISODE_STEPS),
    "Tumour": ("clinical.insert_and_tumour:TumourEnv", CLINICAL_STEPS),
    "Insert": ("clinical.insert_and_tumour:InsertEnv", CLINICAL_STEPS),
    "Deliver": ("clinical.deliver:DeliverEnv", CLINICAL_STEPS),
}


def register_environments() -> None:
    """Register the environments with Gymnasium; those that are registered already stay as they are."""
    found = [
        (environment, {"robot": robot.id, **environment.arguments})
        for kind in KINDS.values()
        for robot in kind.robots.PUBLISHED
        for environment in robot.environments
    ]
    for environment, arguments in sorted(found, key=lambda item: _TASKS[item[0].task][1]):  # short ones first
        _register(environment, arguments)


def _register(environment: Environment, arguments: dict[str, Any]) -> None:
    single, steps = _TASKS[environment.task]
    many = f"catheter_sim.envs.vector:{environment.task.lower()}"
    for version, more in enumerate([{}, *_LATER.get(environment.task, ())]):
        full = f"catheter_sim/{environment.name}-v{version}"
        if full in gymnasium.registry:
            continue
        gymnasium.register(
            full,
            f"catheter_sim.envs.{single}",
            max_episode_steps=steps,
            kwargs={**arguments, **more},
            vector_entry_point=many,
        )
        if version:  # v0 is not out of date, as Gymnasium would say of any that is not the highest
            gymnasium.registry[full].version = None
