"""Columns of a file that a data set passes over: misspelled inputs are refused, the others are told."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Mapping

from catheter_sim.channels import (
    FORCE_CHANNELS,
    MOMENT_CHANNELS,
    acts_on_body,
    actuations,
    input_channels,
    output_channels,
)
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.notes import Note
from catheter_sim.errors import InputError, cut, shown
from catheter_sim.tables import Table

IGNORED, UNKNOWN = "columns_ignored", "columns_unknown"  # codes of notes; the second wants to be seen
_ALIKE, _LOADS_ALIKE = 0.8, 0.9  # of two names, 1 for the same: one is a slip of the pen for the other
_MOST_NEAREST = 10  # columns of a note of which the nearest is told


def known_inputs(robot: RobotSpec) -> list[str]:
    """Return every input column of `robot`, whichever way it is driven, and the loads on its tip."""
    own = [name for kind in ("tension", "displacement") for name in input_channels(robot, kind)]
    return [*own, *FORCE_CHANNELS, *MOMENT_CHANNELS]


def refuse_misspelled(robot: RobotSpec, table: Table) -> None:
    """Raise `InputError` where a column that `table` has passed over was meant as an input of `robot`.

    It was where its name is nearly that of an input that the table lacks, or begins as the inputs do (as
    `tension_up_N`). What looks like another input of the same table, or like an output, is somebody's log.
    """
    by_kind = [input_channels(robot, kind) for kind in actuations(robot)]
    used = [names for names in by_kind if any(name in table.columns for name in names)] or by_kind
    own = [name for names in used for name in names]
    begins = {name.split("_")[0] for name in own}
    for name in table.ignored:
        if acts_on_body(name):
            raise InputError(
                f"{table.where}: {name}: a data set knows forces on the tip alone, force_tip_x_N ..."
            )
        first = name.lower().split("_")[0] in begins
        inputs = [(_likeness(name, item), item) for item in own]
        loads = [(_likeness(name, item), item) for item in (*FORCE_CHANNELS, *MOMENT_CHANNELS)]
        close = [(size, item) for size, item in inputs if first or size >= _ALIKE]
        close += [(size, item) for size, item in loads if size >= _LOADS_ALIKE]
        if not close:
            continue
        size, meant = max(close, key=lambda pair: pair[0])
        if meant in table.columns or any(_likeness(name, item) > size for item in output_channels(robot)):
            continue
        told = f"{table.where}: unknown input channel {shown(name)}; nearest: {meant}"
        raise InputError(f"{told}. Rename it; if it is no input, leave it out")


def _likeness(first: str, second: str) -> float:
    """Return how alike two names are, 1 for the same, whatever the case and the order of their words."""
    ones, others = (re.findall(r"[a-z]+|[0-9]+", name.lower()) for name in (first, second))
    ways = (("_".join(ones), "_".join(others)), ("_".join(sorted(ones)), "_".join(sorted(others))))
    return max(difflib.SequenceMatcher(None, one, other, False).ratio() for one, other in ways)


def _nearest(robot: RobotSpec, names: Iterable[str]) -> str:
    """Return the nearest column of `robot` to each of `names` that has one, as a sentence; "" for none."""
    choices = {name.lower(): name for name in (*known_inputs(robot), *output_channels(robot))}
    found: list[str] = []
    for name in list(names)[:_MOST_NEAREST]:
        near = difflib.get_close_matches(name.lower(), choices, 1, _ALIKE)
        found += [f"{choices[near[0]]} for {cut(name, 60)}"] if near else []
    return f" Nearest columns of the robot: {', '.join(found)}." if found else ""


def notes_on_ignored(
    robot: RobotSpec,
    ignored: Mapping[str, tuple[str, ...]],
    why: str = "not listed in dataset.toml",
    wanted: Collection[str] = (),
) -> tuple[Note, ...]:
    """Return a note for each set of columns that are passed over, with its files.

    Args:
        robot: whose data they are.
        ignored: columns by file.
        why: they are ignored.
        wanted: outputs of the robot that nobody left out on purpose.
    """
    known, all_outputs = known_inputs(robot), output_channels(robot)
    outputs = set(all_outputs) - set(wanted)
    notes = []
    for columns in dict.fromkeys(ignored.values()):
        files = ", ".join(file for file, names in ignored.items() if names == columns)
        names = ", ".join(name or "(a column without a name)" for name in dict.fromkeys(columns))
        said = f"{cut(files, 150)}: {why} and ignored: {cut(names, 250)}."
        inputs = ", ".join(name for name in columns if name in known)
        if inputs:
            said += f" Of these the robot's own inputs are taken as zero: {cut(inputs, 250)}."
        said += _nearest(robot, (name for name in columns if name not in known and name not in all_outputs))
        notes.append(Note(IGNORED if outputs.issuperset(columns) else UNKNOWN, said))
    return tuple(notes)
