"""Where a draw of a bench lies: the data set in one folder, the answer in another, each whole or not there.

Nothing here knows what makes a draw's data or what is hidden in them.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.robots import BenchRobot
from catheter_sim.catalogue import robot_toml
from catheter_sim.channels import input_channels
from catheter_sim.errors import InputError
from catheter_sim.tables import Table, replaced_when_whole, write_table

ANSWER = "answer.json"
SETTINGS = "bench.json"


@dataclass(frozen=True)
class Folders:
    """The places of one draw below the bench's folder.

    Attributes:
        root: the bench's folder.
        index: of the draw.
    """

    root: Path
    index: int

    @property
    def name(self) -> str:
        """The draw's name, which says nothing about it."""
        return f"draw_{self.index:03d}"

    @property
    def data(self) -> Path:
        """The data set: all that the diagnosis is given."""
        return self.root / "data" / self.name

    @property
    def answer(self) -> Path:
        """The answer and the third set of trials."""
        return self.root / "answers" / self.name

    @property
    def found(self) -> Path:
        """What the diagnosis wrote."""
        return self.root / "found" / self.name

    @property
    def score(self) -> Path:
        """The score, written last."""
        return self.root / "scores" / f"{self.name}.json"

    def clear(self) -> None:
        """Remove whatever an interrupted run left of this draw."""
        for folder in (self.data, self.answer, self.found):
            shutil.rmtree(folder, ignore_errors=True)
        self.score.unlink(missing_ok=True)


def keep_settings(root: Path, settings: dict[str, Any]) -> None:
    """Write what a bench's folder holds.

    Raises:
        InputError: it holds other draws.
    """
    known = read_json(root / SETTINGS)
    if known is not None and known != settings:
        raise InputError(f"{root}: holds draws of {known}, not of {settings}; give another folder")
    write_json(settings, root / SETTINGS)


def write_json(document: Any, path: Path) -> None:
    """Write a JSON file whole or not at all, its folder made if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replaced_when_whole(path) as file:
        file.write(json.dumps(document, indent=1, default=_plain) + "\n")


def show_table(table: Any, text: str, root: Path) -> None:
    """Write a bench's table into its folder, as `table.txt` and `table.json`, and print it."""
    with replaced_when_whole(root / "table.txt") as file:
        file.write(text + "\n")
    write_json(table, root / "table.json")
    print(text)


def read_json(path: Path) -> Any:
    """Return a JSON file's document; None where there is none, or half of one."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def write_tables(
    folder: Path,
    name: str,
    bench: BenchRobot,
    columns: Sequence[str],
    gravity_mps2: Array,
    trials: Sequence[tuple[Table, str]],
) -> None:
    """Write a data set of made trials.

    Args:
        folder: to write.
        name: of the data set.
        bench: the robot as specified.
        columns: of the outputs.
        gravity_mps2: as the data set states it, shape (3,).
        trials: inputs and outputs in file units, and role, "" for none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    entries = []
    for number, (table, role) in enumerate(trials, start=1):
        file = f"trial_{number:02d}.csv"
        write_table(table, folder / file)
        entries.append({"file": file, "role": role} if role else {"file": file})
    document = {
        "dataset": {
            "name": name,
            "robot": bench.reference,
            "source": "made for the hidden-effect bench",
            "licence": "CC0-1.0",
        },
        "conditions": {"gravity_mps2": gravity_mps2.tolist()},
        "channels": {"inputs": input_channels(bench.robot), "outputs": list(columns)},
        "trials": entries,
    }
    (folder / "dataset.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    if bench.reference.endswith(".toml"):
        (folder / bench.reference).write_text(robot_toml(bench.robot), encoding="utf-8")


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} has no place in a JSON file")
