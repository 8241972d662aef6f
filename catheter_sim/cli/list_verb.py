"""List the robots, static models, environments and effects.

example:
  catheter-sim list
  catheter-sim list --json

A robot's static models are those that `statics ROBOT --model NAME` takes. Effects are set as
--set effects.NAME.PARAMETER=VALUE, in the unit that the parameter's name ends in; their parameters
are shown for the neuroendoscope_section, and per robot in the JSON, as some of them carry the names
of the robot's channels.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator
from typing import Any

_EXAMPLE_ROBOT = "neuroendoscope_section"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument("--json", action="store_true", help="for programs")


def run(options: argparse.Namespace) -> int:
    """Print the listing."""
    content = listing()
    if options.json:
        print(json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        print("\n".join(_lines(content)))
    return 0


def listing() -> dict[str, list[dict[str, Any]]]:
    """Return what the package offers, from its own registries, ready for JSON."""
    import gymnasium

    from catheter_sim.effects.apply import parameters_of
    from catheter_sim.effects.registry import EFFECTS
    from catheter_sim.robots.catalogue import ROBOTS, load_robot
    from catheter_sim.robots.channels import input_channels
    from catheter_sim.statics.models import STATIC_MODELS

    ids = [reference for reference in ROBOTS if "@" not in reference]
    robots = {reference: load_robot(reference) for reference in ids}
    return {
        "robots": [
            {
                "id": reference,
                "description": robot.description,
                "inputs": input_channels(robot),
                "parameter_sets": [name for name in ROBOTS if name.startswith(f"{reference}@")],
                "static_models": [name for name, model in STATIC_MODELS.items() if model.applies_to(robot)],
            }
            for reference, robot in robots.items()
        ],
        "static_models": [{"name": name, "summary": model.summary} for name, model in STATIC_MODELS.items()],
        "environments": [
            {"id": name} for name in sorted(gymnasium.registry) if name.startswith("catheter_sim/")
        ],
        "effects": [
            {
                "name": name,
                "summary": effect.summary,
                "parameters": {
                    reference: [
                        {
                            "name": item.name,
                            "no_effect": _plain(item.null),
                            "lower": _plain(item.lower),
                            "upper": _plain(item.upper),
                        }
                        for item in parameters_of(robot, effect)
                    ]
                    for reference, robot in robots.items()
                },
            }
            for name, effect in EFFECTS.items()
        ],
    }


def _plain(value: float) -> float | str:
    """Return `value` as JSON can hold it: an infinite one as TOML and --set write it."""
    return value if math.isfinite(value) else str(value)


def _lines(content: dict[str, list[dict[str, Any]]]) -> Iterator[str]:
    yield "robots (and a path to any robot .toml)"
    for robot in content["robots"]:
        yield f"  {robot['id']:<24} {robot['description']}"
        for name in robot["parameter_sets"]:
            yield f"  {'':<24} parameter set: {name}"
        yield f"  {'':<24} inputs: {', '.join(robot['inputs'])}"
        yield f"  {'':<24} static models: {', '.join(robot['static_models']) or '(none)'}"
    yield "static models"
    for model in content["static_models"]:
        yield f"  {model['name']:<24} {model['summary']}"
    yield "environments"
    for environment in content["environments"]:
        yield f"  {environment['id']}"
    yield f"effects (parameters as for {_EXAMPLE_ROBOT}, with value of no effect and bounds)"
    for effect in content["effects"]:
        yield f"  {effect['name']:<24} {effect['summary']}"
        for item in effect["parameters"].get(_EXAMPLE_ROBOT, []):
            value, low, high = (float(item[key]) for key in ("no_effect", "lower", "upper"))
            yield f"  {'':<24} {item['name']} = {value:.4g} ({low:.4g} to {high:.4g})"
