"""From files as they were measured to a proposed data set's folder, with the reasons of every guess."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import FILES, load_robot
from catheter_sim.channels import body_count, input_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.faults_of_columns import full_pulls
from catheter_sim.diagnosis.mapping import ANGLES, COUNTS, UNITS, RawFile, channel_unit, read_raw
from catheter_sim.diagnosis.thresholds import PULL_BEYOND
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.errors import InputError, cut
from catheter_sim.files import check_output_folder
from catheter_sim.importing.columns import (
    PIXELS,
    Guess,
    Heads,
    clock_of,
    heads_of,
    is_motor,
    match_inputs,
    match_outputs,
    match_points,
    meeting,
    numbers_of,
    plane_points,
)
from catheter_sim.importing.laid import (
    RADII_MM,
    TURNS,
    LaidRows,
    frame_of,
    lengths_of,
    plane_frame,
    rows_of,
    signs_of,
    spools_of,
    spread,
)
from catheter_sim.tables import replaced_when_whole

# ----------------------------------------------------------------------------------------------------
# From files as they were measured to a proposed table `[map]`, with what was guessed of it and why.

MOST_HELD_ROWS = 2000  # of a file that are taken: each is held until the robot rests
_MOST_RAD = 15.0  # a motor's angle whose range is larger is taken for degrees
_LEAST_COUNTS = 100.0  # over which an encoder's whole numbers run
_AT_MIDDLE = 0.01  # of a turn, by which a motor may be off its encoder's middle in the first row
_ENCODER = re.compile(r"encoder|\benc|count|tick|pulse", re.IGNORECASE)
_AT_REST = 0.02  # of its range, by which a motor may be off zero in the first row


@dataclass(frozen=True)
class Asked:
    """What the user states besides the files.

    Attributes:
        spool_radius_mm: of the motors' spools; None: it is guessed.
        rate_Hz: of a file that counts frames; None: it is guessed.
        gravity_mps2: in the base frame, shape (3,); None: not stated.
        motion: "held" or "dynamic"; "": not stated, and taken for held.
        log: a second file, which has the inputs; None: they are in the first.
        input_unit: of displacements and tensions whose heads state none; "": it is guessed.
        motor_unit: of motors' angles, one of `ANGLES`; "": by their heads, else guessed.
        counts_per_turn: of the motors' encoders; None: it is guessed.
        point_unit: of positions whose heads state none; "": it is guessed.
    """

    spool_radius_mm: float | None = None
    rate_Hz: float | None = None
    gravity_mps2: tuple[float, float, float] | None = None
    motion: str = ""
    log: str | os.PathLike[str] | None = None
    input_unit: str = ""
    motor_unit: str = ""
    counts_per_turn: float | None = None
    point_unit: str = ""


@dataclass(frozen=True)
class Proposal:
    """A data set as proposed.

    Attributes:
        robot: as specified.
        inputs, outputs: the channels.
        table: the table `[map]`, key by key.
        guesses: what was resolved, and how sure it is.
        asked: what the user stated.
        ignored: columns that are not used.
    """

    robot: RobotSpec
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    table: Mapping[str, Any]
    guesses: tuple[Guess, ...]
    asked: Asked
    ignored: tuple[str, ...] = field(default=())

    @property
    def lines(self) -> tuple[Guess, ...]:
        """All that was taken: from the files, and of the conditions that no file states."""
        more = []
        if self.asked.gravity_mps2 is None:
            more.append(
                Guess("conditions.gravity_mps2", "0, 0, 0", "no file says it; --gravity states it", False)
            )
        if not self.asked.motion:
            why = "no file says whether the robot rested; --motion states it"
            more.append(Guess("conditions.motion", "held", why, False))
        return (*self.guesses, *more)


def propose(robot: RobotSpec, path: str | os.PathLike[str], asked: Asked) -> Proposal:
    """Return a proposal for a file that a tracker or a logger wrote.

    Args:
        robot: as specified.
        path: the first of the trials' files; the others are laid out alike.
        asked: what the user states besides.

    Raises:
        InputError: the file cannot be read, or has no time, no input or no position of the robot's.
    """
    raw = read_raw(path)
    heads = heads_of(raw)
    log, log_heads = (raw, heads) if asked.log is None else _log(asked.log)
    clock, guesses = clock_of(raw, heads, asked.rate_Hz)
    table: dict[str, Any] = {"time_s": clock}
    met: list[Guess] = []
    if asked.log is not None:
        table["inputs_time_s"], more = clock_of(log, log_heads, asked.rate_Hz)
        guesses += [replace(guess, key=guess.key.replace("time_s", "inputs_time_s")) for guess in more]
        met = meeting(table, raw, log)
        guesses += met
    planes = {} if heads.points else plane_points(heads)
    if asked.log is None:
        taken = {name for pair in planes.values() for name in pair}
        log_heads = replace(log_heads, others=tuple(name for name in heads.others if name not in taken))
    columns, matched = match_inputs(robot, log_heads)
    if not columns:
        names = ", ".join(input_channels(robot))
        found = cut(", ".join(log_heads.others) or "(none)", 150)
        raise InputError(
            f"{log.where}: no column that can be an input; {robot.name} has {names}; columns: {found}"
        )
    full_mm = {name: 1e3 * value for name, value in full_pulls(robot).items()}
    entries, more = _entries(columns, log, log_heads, asked, full_mm)
    guesses += [*matched, *more]
    # a wrong zero or sign hides no unit
    inputs_sure = all(item.sure for item in (*met, *matched, *more) if not item.key.endswith(".zero"))
    others = (
        match_outputs(robot, heads, columns.values())
        if asked.log is None
        else match_outputs(robot, heads, ())
    )
    points, more = _points(robot, raw, heads.points or ({} if others else planes))
    guesses += more
    if not points and not others:
        found = cut(", ".join(raw.names), 200)
        raise InputError(
            f"{raw.where}: no point with x, y and z, or two of a plane, and no other output of the robot; "
            f"columns: {found}"
        )
    beside = _Beside(robot, raw, log, clock, table.get("inputs_time_s"), entries, points, asked)
    resolved, more, outputs = _resolved_map(beside, heads, inputs_sure)
    guesses += more
    every = -(-len(raw.cells) // MOST_HELD_ROWS)
    if every > 1 and asked.motion != "dynamic":
        resolved = {"every": every, **resolved}
        guesses.append(
            Guess("map.every", str(every), f"{len(raw.cells)} rows; each is held until at rest", False)
        )
    used = {heads.clock, *columns.values(), *others, *(name for item in points.values() for name in item)}
    return Proposal(
        robot=robot,
        inputs=tuple(columns),
        outputs=(*outputs, *others),
        table=table | resolved,
        guesses=tuple(guesses),
        asked=asked,
        ignored=tuple(name for name in raw.names if name not in used),
    )


def _log(path: str | os.PathLike[str]) -> tuple[RawFile, Heads]:
    raw = read_raw(path)
    return raw, heads_of(raw)


def _entries(
    columns: Mapping[str, str], raw: RawFile, heads: Heads, asked: Asked, full_mm: Mapping[str, float]
) -> tuple[dict[str, dict[str, Any]], list[Guess]]:
    """Return the entries of inputs by channel, as far as heads and sizes tell, and how sure they are."""
    values = {column: numbers_of(raw, column) for column in columns.values()}
    given = {column: item for column, item in values.items() if item is not None}
    ways = [name for channel, name in columns.items() if channel_unit(channel) == "mm"]
    stated = bool(asked.motor_unit or asked.counts_per_turn)
    counted = [
        name
        for channel, name in columns.items()
        if name in ways
        and not heads.units[name]
        and not asked.input_unit
        and _is_counted(name, given[name], full_mm.get(channel, np.inf))
    ]
    motors = [
        name
        for name in ways
        if is_motor(name, heads.units[name]) or name in counted or (stated and not heads.units[name])
    ]
    if stated and not motors:
        raise InputError(
            f"{raw.where}: --unit and --counts-per-turn are for motors that wind a tendon; no input is one; "
            f"inputs: {', '.join(columns)}"
        )
    widest = max((float(np.nanmax(given[name]) - np.nanmin(given[name])) for name in motors), default=0.0)
    entries: dict[str, dict[str, Any]] = {}
    guesses: list[Guess] = []
    for channel, column in columns.items():
        own, unit = channel_unit(channel), heads.units[column]
        entry: dict[str, Any] = {}
        if column in motors:
            angle = _angle(
                channel, unit, COUNTS if counted else "deg" if widest > _MOST_RAD else "rad", asked
            )
            entry, more = _motor(channel, *angle, given[column], asked)
            guesses += more
        elif unit in UNITS[own]:
            entry["unit"] = unit
            guesses.append(Guess(f"map.{channel}.unit", unit, "the head", True))
        elif unit:
            entry["scale"] = 1.0
            guesses.append(
                Guess(f"map.{channel}.scale", "1", f"the file says {unit!r}, no unit of {own}", False)
            )
        elif asked.input_unit and asked.input_unit not in UNITS[own]:
            raise InputError(
                f"--input-unit {asked.input_unit}: {channel} is in {own}; choices: {', '.join(UNITS[own])}"
            )
        elif asked.input_unit:
            entry["unit"] = asked.input_unit
            guesses.append(Guess(f"map.{channel}.unit", asked.input_unit, "as stated", True))
        elif own == "mm":
            entry["unit"] = ""  # settled when the file is laid over the robot
        else:
            entry["unit"] = own
            guesses.append(Guess(f"map.{channel}.unit", own, "the channel's own; the file says none", False))
        entries[channel] = {"column": column, **entry}
    return entries, guesses


def _is_counted(column: str, values: Array, full_mm: float) -> bool:
    """Return whether numbers look like an encoder's counts: whole ones, far from zero or over many turns.

    Args:
        column: its name.
        values: shape (r,).
        full_mm: the way that bends the robot fully.
    """
    known = values[np.isfinite(values)]
    if not len(known) or (known != np.round(known)).any():
        return False
    span, first = float(np.ptp(known)), abs(float(known[0]))
    if span < (_LEAST_COUNTS / 2.0 if _ENCODER.search(column) else _LEAST_COUNTS):
        return False
    least_mm = min(RADII_MM) * math.radians(span)  # that an angle in degrees would wind
    return first > 360.0 or bool(_ENCODER.search(column)) or least_mm > PULL_BEYOND[0] * full_mm


def _angle(channel: str, unit: str, guess: str, asked: Asked) -> tuple[str, list[Guess]]:
    """Return the unit of a motor's angle and how sure it is, nothing where the head states it.

    `unit`: that the head states, "" where it states none; `guess`: that by the size of the numbers.
    """
    key = f"map.{channel}.unit"
    stated = asked.motor_unit or (COUNTS if asked.counts_per_turn and unit not in ANGLES else "")
    if stated:
        return stated, [Guess(key, stated, "as stated", True)]
    if unit in ANGLES:
        return unit, []
    why = "the size of the motors' numbers"
    if guess == COUNTS:
        why = "whole numbers like an encoder's; --unit and --counts-per-turn state it"
    return guess, [Guess(key, guess, why, False)]


def _motor(
    channel: str, unit: str, guesses: list[Guess], values: Array, asked: Asked
) -> tuple[dict[str, Any], list[Guess]]:
    """Return how a motor's angle is read, and how sure that is; a number of 0 is resolved later.

    Args:
        channel: what it drives.
        unit: of its angle.
        guesses: of that.
        values: its angle, shape (r,).
        asked: what the user states.
    """
    guesses = list(guesses)
    known = values[np.isfinite(values)]
    radius = asked.spool_radius_mm or 0.0
    entry: dict[str, Any] = {"unit": unit}
    if unit == COUNTS:
        turn = asked.counts_per_turn or _turn_by_middle(known)
        if asked.counts_per_turn:
            guesses.append(Guess(f"map.{channel}.counts_per_turn", f"{turn:g}", "as stated", True))
        elif turn:
            why = f"it starts at {known[0]:g}, the middle of a turn; --counts-per-turn states it"
            guesses.append(Guess(f"map.{channel}.counts_per_turn", f"{turn:g}", why, False))
        entry["counts_per_turn"] = turn
    if radius:
        guesses.append(Guess(f"map.{channel}.spool_radius_mm", f"{radius:g}", "as stated", True))
    entry["spool_radius_mm"] = radius
    if abs(known[0]) > _AT_REST * float(np.ptp(known)):
        entry["zero"] = float(known[0])
        guesses.append(Guess(f"map.{channel}.zero", f"{known[0]:g}", "its first row, taken for rest", False))
    return entry, guesses


def _turn_by_middle(counts: Array) -> float:
    """Return the counts of a turn whose middle a motor starts at, all of its counts within it; 0: of none."""
    within = [turn for turn in TURNS if counts.min() >= 0.0 and counts.max() <= turn]
    near = [(abs(counts[0] / turn - 0.5), turn) for turn in within]
    return min((item for item in near if item[0] < _AT_MIDDLE), default=(0.0, 0.0))[1]


def _points(
    robot: RobotSpec, raw: RawFile, points: Mapping[str, tuple[str, ...]]
) -> tuple[dict[str, tuple[str, ...]], list[Guess]]:
    spreads = {stem: spread(_values(raw, columns)) for stem, columns in points.items()}
    return match_points(points, body_count(robot), spreads, [marker.name for marker in robot.markers])


def _values(raw: RawFile, columns: Sequence[str]) -> Array:
    """Return columns of numbers side by side, shape (r, c)."""
    found = [numbers_of(raw, name) for name in columns]
    return np.stack([item for item in found if item is not None], axis=1)


@dataclass(frozen=True)
class _Beside:
    """A file, what is known of it, and the robot that it is laid over."""

    robot: RobotSpec
    raw: RawFile
    log: RawFile
    clock: Mapping[str, Any]
    log_clock: Mapping[str, Any] | None
    entries: dict[str, dict[str, Any]]
    points: Mapping[str, tuple[str, ...]]
    asked: Asked


def _resolved_map(
    beside: _Beside, heads: Heads, inputs_sure: bool
) -> tuple[dict[str, Any], list[Guess], tuple[str, ...]]:
    """Return axes, points and inputs of the map, settled by laying the file over the robot.

    Beside them how sure they are, and the points' outputs. `inputs_sure`: without the robot's motion.
    """
    points, entries = beside.points, beside.entries
    rows: LaidRows | None = None
    if points:
        rows = rows_of(
            beside.robot,
            (beside.raw, beside.clock),
            (beside.log, beside.log_clock or beside.clock),
            points,
            np.array(beside.asked.gravity_mps2 or (0.0, 0.0, 0.0)),
        )
    plane = any(len(columns) == 2 for columns in points.values())
    stems = [stem for stem, columns in heads.pairs.items() if columns in points.values()] if plane else []
    picture = any(heads.of_picture(stem) for stem in stems)
    unit = next((heads.units[column] for item in points.values() for column in item), "")
    unit = unit if unit in UNITS["mm"] else "" if picture else beside.asked.point_unit
    entries, assumed = lengths_of(rows, entries)
    entries, more = spools_of(rows, entries, PIXELS if picture else unit)
    assumed += more
    entries, more = signs_of(rows, entries)
    found = [*assumed, *more]
    if rows is None:
        return entries, found, ()
    if plane:
        resolved, more = plane_frame(rows, entries, points, unit, picture)
        return resolved | entries, [*found, *more], tuple(resolved)
    axes, unit, more = frame_of(rows, entries, unit, inputs_sure and all(guess.sure for guess in assumed))
    tables = {name: {"columns": list(columns), "unit": unit} for name, columns in points.items()}
    outputs = tuple(f"{point}_{axis}_mm" for point in points for axis in "xyz")
    return {"axes": axes, **tables, **entries}, [*found, *more], outputs


# ----------------------------------------------------------------------------------------------------
# A proposal written as a data set's folder: `dataset.toml` with its reasons, the files beside it.


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
