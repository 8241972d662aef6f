"""What the package offers: robots, static models, effects and environments, as listings.

The command line's `list` shows the same rows.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from catheter_sim.public.listing import Listing

if TYPE_CHECKING:
    from catheter_sim.core.robot import RobotSpec

PREFIX = "catheter_sim/"  # of the environments' ids


def list_robots() -> Listing:
    """Return the robots by id, with their inputs and static models.

    Columns: `id`, `kind`, `description`, `inputs`, `parameter_sets` (ids of the same robot with other
    published numbers), `static_models`.

    Examples:
        >>> import catheter_sim as cs
        >>> "neuroendoscope_section" in cs.list_robots().column("id")
        True
    """
    from catheter_sim.catalogue import ROBOTS, load_robot
    from catheter_sim.channels import input_channels
    from catheter_sim.robots import kind_of

    rows = []
    for reference in ROBOTS:
        if "@" in reference:
            continue
        robot = load_robot(reference)
        row = {
            "id": reference,
            "kind": kind_of(robot).name,
            "description": robot.description,
            "inputs": tuple(input_channels(robot)),
            "parameter_sets": parameter_sets(reference),
            "static_models": tuple(list_models(robot).column("name")),
        }
        rows.append(row)
    return Listing("Robots", tuple(rows[0]), tuple(rows))


def parameter_sets(reference: str) -> tuple[str, ...]:
    """Return the ids of the parameter sets of the robot with the id `reference`."""
    from catheter_sim.catalogue import ROBOTS

    return tuple(name for name in ROBOTS if name.startswith(f"{reference}@"))


def list_models(robot: RobotSpec | str | os.PathLike[str] | None = None) -> Listing:
    """Return the static models that know `robot`, effects included.

    Columns: `name`, `summary`.

    Args:
        robot: a robot, its id or its file; None: the static models of all robots.

    Raises:
        InputError: unknown robot.

    Examples:
        >>> import catheter_sim as cs
        >>> cs.list_models("chest_tube_section").column("name")
        ['printed', 'complete', 'complete_sliding', 'virtual_work', 'pcc']
    """
    from catheter_sim.public.arguments import robot_of
    from catheter_sim.theory.run import STATIC_MODELS

    value = None if robot is None else robot_of(robot)
    rows = tuple(
        {"name": name, "summary": model.summary}
        for name, model in STATIC_MODELS.items()
        if value is None or model.applies_to(value)
    )
    whose = "all robots" if value is None else value.name
    return Listing(f"Static models of {whose}", ("name", "summary"), rows)


def list_effects(robot: RobotSpec | str | os.PathLike[str]) -> Listing:
    """Return the effects that `robot` (a robot, its id or its file) may have, a row for each parameter.

    Columns: `effect`, `form` (in which it acts), `parameter`, `no_effect` (the value that does nothing),
    `lower`, `upper`, `summary`. An effect is set as `effects.<effect>.<parameter>`.

    Raises:
        InputError: unknown robot.

    Examples:
        >>> import catheter_sim as cs
        >>> rows = cs.list_effects("neuroendoscope_section")
        >>> [row["parameter"] for row in rows if row["effect"] == "rate"][:2]
        ['lag_s', 'delay_s']
    """
    from catheter_sim.effects import EFFECTS
    from catheter_sim.public.arguments import robot_of

    value = robot_of(robot)
    rows = tuple(
        {
            "effect": name,
            "form": form.name,
            "parameter": item.name,
            "no_effect": item.null,
            "lower": item.lower,
            "upper": item.upper,
            "summary": effect.summary,
        }
        for name, effect in EFFECTS.items()
        for form in effect.forms
        for item in form.parameters(value)
    )
    columns = ("effect", "form", "parameter", "no_effect", "lower", "upper", "summary")
    return Listing(f"Effects of {value.name}", columns, rows)


def list_environments() -> Listing:
    """Return the Gymnasium environments by id, for `gymnasium.make`.

    Columns: `id`, `robot`, `steps` (of an episode).

    Examples:
        >>> import catheter_sim as cs
        >>> cs.list_environments()[0]["id"].startswith("catheter_sim/")
        True
    """
    import gymnasium

    rows = tuple(
        {"id": name, "robot": spec.kwargs.get("robot"), "steps": spec.max_episode_steps}
        for name, spec in sorted(gymnasium.registry.items())
        if name.startswith(PREFIX)
    )
    return Listing("Environments", ("id", "robot", "steps"), rows)
