"""List the robots, static models, environments and effects, or what one robot takes and gives.

example:
  catheter-sim list
  catheter-sim list --json
  catheter-sim list chest_tube
  catheter-sim list my_robot.toml --json

A robot's static models are those that `statics ROBOT --model NAME` takes. Effects are set as
--set effects.NAME.PARAMETER=VALUE, in the unit that the parameter's name ends in. Without ROBOT their
parameters are shown for the neuroendoscope_section. The JSON has them for each robot, as some of them carry
the names of the robot's channels. A form of an effect is on where its numbers are not those of no effect.
With ROBOT: its inputs, outputs, static models and effects; in a simulation
every robot also takes forces and moments on its tip, static models where they say so.
"""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from catheter_sim.core.effect import Form

_EXAMPLE_ROBOT = "neuroendoscope_section"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument(
        "robot", metavar="ROBOT", nargs="?", help="robot id or path of a robot .toml; default all there is"
    )
    parser.add_argument("--json", action="store_true", help="for programs")


def run(options: argparse.Namespace) -> int:
    """Print the listing."""
    content = listing() if options.robot is None else robot_listing(options.robot)
    if options.json:
        print(json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        print("\n".join(_lines(content) if options.robot is None else _robot_lines(content)))
    return 0


def listing() -> dict[str, list[dict[str, Any]]]:
    """Return what the package offers, from its own registries, ready for JSON."""
    from catheter_sim.effects import EFFECTS
    from catheter_sim.public.data import list_effects, list_environments, list_models, list_robots

    robots = list_robots()
    parameters = {reference: list_effects(reference) for reference in robots.column("id")}
    kept = ("id", "description", "inputs", "parameter_sets", "static_models")
    return {
        "robots": [_cells(row, kept) for row in robots],
        "static_models": [_cells(row) for row in list_models()],
        "environments": [_cells(row, ("id",)) for row in list_environments()],
        "effects": [
            {
                "name": name,
                "summary": effect.summary,
                "forms": [_form(form) for form in effect.forms],
                "parameters": {
                    reference: [_parameter(row) for row in rows if row["effect"] == name]
                    for reference, rows in parameters.items()
                },
            }
            for name, effect in EFFECTS.items()
        ],
    }


def robot_listing(reference: str) -> dict[str, Any]:
    """Return what one robot takes and gives, ready for JSON.

    `reference`: a robot id or the path of a robot `.toml`.

    Raises:
        InputError: unknown robot, unreadable file, impossible robot.
    """
    from catheter_sim.catalogue import FILES
    from catheter_sim.channels import (
        FORCE_CHANNELS,
        MOMENT_CHANNELS,
        ON_BODIES,
        actuations,
        input_channels,
        output_channels,
    )
    from catheter_sim.cli.driven import load
    from catheter_sim.errors import InputError
    from catheter_sim.modelling.build import remembered_mjcf
    from catheter_sim.public.data import list_effects, list_models, parameter_sets, plain

    specified, robot = load(reference, ())
    if reference.endswith(FILES):
        with suppress(InputError):  # `build` says why one cannot be built; notes on it are said here, too
            remembered_mjcf(robot)
    by_effect: dict[str, list[Mapping[str, Any]]] = {}
    for row in list_effects(specified):
        by_effect.setdefault(row["effect"], []).append(row)
    return {
        "id": reference,
        "name": specified.name,
        "description": specified.description,
        "parameter_sets": list(parameter_sets(reference)),
        "actuation": specified.actuation,
        "inputs": {kind: input_channels(specified, kind) for kind in actuations(specified)},
        "optional_inputs": [*FORCE_CHANNELS, *MOMENT_CHANNELS],
        "inputs_on_bodies": list(ON_BODIES),
        "outputs": output_channels(specified),
        "static_models": [_cells(row) for row in list_models(specified)],
        "effects": [
            {
                "name": name,
                "summary": rows[0]["summary"],
                "forms": _forms_with_parameters(rows),
                "parameters": [_parameter(row) for row in rows],
                "set": {key: plain(value) for key, value in specified.effects.get(name, {}).items()},
            }
            for name, rows in by_effect.items()
        ],
    }


def _cells(row: Mapping[str, Any], names: Iterable[str] | None = None) -> dict[str, Any]:
    """Return the cells of a listing's row, all or those of the columns `names`, as JSON can hold them."""
    from catheter_sim.public.data import plain

    return {name: plain(row[name]) for name in (row if names is None else names)}


def _parameter(row: Mapping[str, Any]) -> dict[str, Any]:
    return {"name": row["parameter"], **_cells(row, ("no_effect", "lower", "upper"))}


def _forms_with_parameters(rows: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the forms of one effect's parameters, each with the names of its own."""
    from catheter_sim.effects import EFFECTS

    names: dict[str, list[str]] = {}
    effect = ""
    for row in rows:
        effect = row["effect"]
        names.setdefault(row["form"], []).append(row["parameter"])
    forms = {form.name: form for form in EFFECTS[effect].forms}
    return [{**_form(forms[name]), "parameters": parameters} for name, parameters in names.items()]


def _form(form: Form) -> dict[str, Any]:
    return {"name": form.name, "acts": form.stage.value, "equation": form.equation}


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
        yield from _form_lines(effect["forms"])
        yield from _parameter_lines(effect["parameters"].get(_EXAMPLE_ROBOT, []))


def _robot_lines(content: dict[str, Any]) -> Iterator[str]:
    yield f"{content['id']}: {content['description']}"
    for name in content["parameter_sets"]:
        yield f"  parameter set: {name}"
    for kind, names in content["inputs"].items():
        default = ", if the file has no other" if len(content["inputs"]) > 1 else ""
        yield f"inputs, {kind}{default if kind == content['actuation'] else ''}: {', '.join(names)}"
    yield f"optional inputs: {', '.join(content['optional_inputs'])}"
    yield f"optional inputs of a simulation, on element k: {', '.join(content['inputs_on_bodies'])}"
    yield f"outputs: {', '.join(_shortened(content['outputs']))}"
    yield "static models"
    for model in content["static_models"] or [{"name": "(none)", "summary": ""}]:
        yield f"  {model['name']:<24} {model['summary']}".rstrip()
    yield "effects (parameters with value of no effect and bounds; set: in the robot's file)"
    for effect in content["effects"]:
        yield f"  {effect['name']:<24} {effect['summary']}"
        yield from _form_lines(effect["forms"])
        yield from _parameter_lines(effect["parameters"], effect["set"])


def _form_lines(forms: list[dict[str, Any]]) -> Iterator[str]:
    for form in forms:
        yield f"  {'':<24} form {form['name']}, {form['acts']}: {form['equation']}"


def _parameter_lines(parameters: list[dict[str, Any]], given: dict[str, Any] | None = None) -> Iterator[str]:
    for item in parameters:
        value, low, high = (
            float("nan") if item[key] is None else float(item[key]) for key in ("no_effect", "lower", "upper")
        )
        text = f"  {'':<24} {item['name']} = {value:.4g} ({low:.4g} to {high:.4g})"
        yield f"{text}, set: {given[item['name']]}" if given and item["name"] in given else text


def _shortened(names: list[str]) -> Iterator[str]:
    """Yield output columns, of the bodies and joints the first and the last only."""
    groups: dict[str, list[str]] = {}
    for name in names:
        body = re.fullmatch(r"body_\d+_x_mm|(body)_\d+_[yz]_mm", name)
        kind = "body" if body else "joint" if name.startswith("joint_") else name
        if not (body and body[1]):
            groups.setdefault(kind, []).append(name)
    for kind, members in groups.items():
        yield members[0]
        if kind == "body":
            yield members[0].replace("_x_", "_y_")
            yield members[0].replace("_x_", "_z_")
        if len(members) > 2:
            yield "..."
        if len(members) > 1:
            yield members[-1].replace("_x_", "_z_") if kind == "body" else members[-1]
