"""A proposal written as a data set's folder: `dataset.toml` with its reasons, the files beside it."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from catheter_sim.catalogue import FILES, load_robot
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.errors import InputError
from catheter_sim.files import check_output_folder
from catheter_sim.importing.propose import Asked, Proposal, propose
from catheter_sim.tables import replaced_when_whole


def import_files(
    paths: Sequence[str | os.PathLike[str]], reference: str, folder: str | os.PathLike[str], asked: Asked
) -> tuple[Proposal, Dataset]:
    """Write a data set's folder for files as they were measured; return what was proposed, and the data read.

    Args:
        paths: the trials' files, laid out alike; they are copied into the folder.
        reference: a robot's id, or the path of its `.toml`, which is copied too.
        folder: to write, made where it does not exist.
        asked: what the user states besides.

    Raises:
        InputError: a file or the robot cannot be read, the folder holds a `dataset.toml` already, or two
            files have one name.
    """
    target = check_output_folder(folder)
    if (target / "dataset.toml").exists():
        raise InputError(f"{target / 'dataset.toml'}: is there already; choose another folder")
    robot = load_robot(reference)
    proposal = propose(robot, paths[0], asked)
    logs = [] if asked.log is None else [asked.log]
    sources = [Path(path) for path in (*paths, *logs)]
    if reference.endswith(FILES):
        sources.append(Path(reference))
    names = [source.name for source in sources]
    for name in names:
        if names.count(name) > 1 or name == "dataset.toml":
            raise InputError(f"{name}: two files of the folder would have this name; rename one")
    target.mkdir(parents=True, exist_ok=True)
    for source in sources:
        if source.resolve() != (target / source.name).resolve():
            shutil.copyfile(source, target / source.name)
    trials = [Path(path).name for path in paths]
    with replaced_when_whole(target / "dataset.toml") as file:
        file.write("\n".join(lines_of(proposal, reference, trials)) + "\n")
    try:
        return proposal, load_dataset(target)
    except InputError as error:
        raise InputError(
            f"{error}; the proposal, to be changed, stands in {target / 'dataset.toml'}"
        ) from None


def lines_of(proposal: Proposal, reference: str, trials: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a proposal's `dataset.toml`."""
    asked = proposal.asked
    gravity = list(asked.gravity_mps2 or (0.0, 0.0, 0.0))
    robot = Path(reference).name if reference.endswith(FILES) else reference
    unsure = [guess for guess in proposal.lines if not guess.sure]
    yield "# Proposed by `catheter-sim import`. Look at what is UNSURE before you trust a diagnosis."
    yield f"# {len(proposal.lines) - len(unsure)} things are sure, {len(unsure)} are not."
    yield ""
    yield "[dataset]"
    yield f"name = {_text(Path(trials[0]).stem)}"
    yield f"robot = {_text(robot)}"
    yield f"source = {_text('imported from ' + ', '.join(trials))}   # where it was measured, and by whom"
    yield 'licence = "not stated"'
    yield ""
    yield "[conditions]"
    why = "" if asked.gravity_mps2 else "   # UNSURE: not in the file; in the base frame, [0, 0, -9.81] say"
    yield f"gravity_mps2 = {gravity}{why}"
    why = "   # UNSURE: not in the file; each row was held until the robot rested; else dynamic"
    yield f"motion = {_text(asked.motion or 'held')}{'' if asked.motion else why}"
    yield ""
    yield "[channels]"
    yield f"inputs = {_list(proposal.inputs)}"
    yield f"outputs = {_list(proposal.outputs)}"
    yield ""
    yield "[map]"
    for key, value in proposal.table.items():
        for guess in proposal.guesses:
            if guess.key.startswith(f"map.{key}.") or guess.key == f"map.{key}":
                yield f"# {guess}"
        yield f"{key} = {_value(value)}"
    if proposal.ignored:
        yield f"# not used: {', '.join(' '.join(name.split()) for name in proposal.ignored)[:300]}"
    for name in trials:
        yield ""
        yield "[[trials]]"
        yield f"file = {_text(name)}"
        if asked.log is not None:
            yield f"inputs = {_text(Path(asked.log).name)}"


def _value(value: Any) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, list | tuple):
        return _list(value)
    return repr(value)


def _list(values: Sequence[str]) -> str:
    return "[" + ", ".join(_text(value) for value in values) + "]"


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)
