"""From files as they were measured to a proposed table `[map]`, with what was guessed of it and why."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from catheter_sim.channels import body_count, input_channels
from catheter_sim.core.posture import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.mapping.layouts import read_raw
from catheter_sim.diagnosis.data.mapping.raw_file import RawFile
from catheter_sim.diagnosis.data.mapping.scales import UNITS, channel_unit
from catheter_sim.errors import InputError, cut
from catheter_sim.importing.against_robot import spread
from catheter_sim.importing.clocks import clock_of, meeting
from catheter_sim.importing.guesses import Guess
from catheter_sim.importing.heads import Heads, heads_of, numbers_of
from catheter_sim.importing.laid import frame_of, lengths_of, signs_of, spools_of
from catheter_sim.importing.matching import is_motor, match_inputs, match_outputs, match_points

MOST_HELD_ROWS = 2000  # of a file that are taken: each is held until the robot rests
_MOST_RAD = 15.0  # a motor's angle whose range is larger is taken for degrees
_AT_REST = 0.02  # of its range, by which a motor may be off zero in the first row


@dataclass(frozen=True)
class Asked:
    """What the user states besides the files.

    Attributes:
        spool_radius_mm: of the motors' spools; None: it is guessed.
        rate_Hz: of a file that counts frames; None: it is guessed.
        gravity_mps2: in the base frame, shape (3,); None: not stated.
        motion: "held" or "dynamic".
        log: a second file, which has the inputs; None: they are in the first.
        input_unit: of displacements and tensions whose heads state none; "": it is guessed.
        point_unit: of positions whose heads state none; "": it is guessed.
    """

    spool_radius_mm: float | None = None
    rate_Hz: float | None = None
    gravity_mps2: tuple[float, float, float] | None = None
    motion: str = "held"
    log: str | os.PathLike[str] | None = None
    input_unit: str = ""
    point_unit: str = ""


@dataclass(frozen=True)
class Proposal:
    """A data set as proposed.

    Attributes:
        robot: as specified.
        inputs, outputs: the channels.
        table: the table `[map]`, key by key.
        guesses: what was settled, and how sure it is.
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
    if asked.log is not None:
        table["inputs_time_s"], more = clock_of(log, log_heads, asked.rate_Hz)
        guesses += [replace(guess, key=guess.key.replace("time_s", "inputs_time_s")) for guess in more]
        guesses += meeting(table, raw, log)
    columns, more = match_inputs(robot, log_heads)
    if not columns:
        names = ", ".join(input_channels(robot))
        found = cut(", ".join(log_heads.others) or "(none)", 150)
        raise InputError(
            f"{log.where}: no column that can be an input; {robot.name} has {names}; columns: {found}"
        )
    guesses += more
    entries, more = _entries(columns, log, log_heads, asked)
    guesses += more
    points, more = _points(robot, raw, heads)
    guesses += more
    others = (
        match_outputs(robot, heads, columns.values())
        if asked.log is None
        else match_outputs(robot, heads, ())
    )
    if not points and not others:
        found = cut(", ".join(raw.names), 200)
        raise InputError(
            f"{raw.where}: no point with x, y and z, and no other output of the robot; columns: {found}"
        )
    beside = _Beside(robot, raw, log, clock, table.get("inputs_time_s"), entries, points, asked)
    settled, more = _settled(beside, heads)
    guesses += more
    every = -(-len(raw.cells) // MOST_HELD_ROWS)
    if every > 1 and asked.motion == "held":
        settled = {"every": every, **settled}
        guesses.append(
            Guess("map.every", str(every), f"{len(raw.cells)} rows; each is held until at rest", False)
        )
    used = {heads.clock, *columns.values(), *others, *(name for item in points.values() for name in item)}
    return Proposal(
        robot=robot,
        inputs=tuple(columns),
        outputs=(*(f"{point}_{axis}_mm" for point in points for axis in "xyz"), *others),
        table=table | settled,
        guesses=tuple(guesses),
        asked=asked,
        ignored=tuple(name for name in raw.names if name not in used),
    )


def _log(path: str | os.PathLike[str]) -> tuple[RawFile, Heads]:
    raw = read_raw(path)
    return raw, heads_of(raw)


def _entries(
    columns: Mapping[str, str], raw: RawFile, heads: Heads, asked: Asked
) -> tuple[dict[str, dict[str, Any]], list[Guess]]:
    """Return the entries of inputs by channel, as far as heads and sizes tell, and how sure they are."""
    values = {column: numbers_of(raw, column) for column in columns.values()}
    given = {column: item for column, item in values.items() if item is not None}
    motors = [column for column in given if is_motor(column, heads.units[column])]
    widest = max((float(np.nanmax(given[name]) - np.nanmin(given[name])) for name in motors), default=0.0)
    entries: dict[str, dict[str, Any]] = {}
    guesses: list[Guess] = []
    for channel, column in columns.items():
        own, unit = channel_unit(channel), heads.units[column]
        entry: dict[str, Any] = {}
        if own == "mm" and column in motors:
            entry, more = _motor(channel, unit, given[column], widest, asked)
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


def _motor(
    channel: str, unit: str, values: Array, widest: float, asked: Asked
) -> tuple[dict[str, Any], list[Guess]]:
    """Return how a motor's angle is read, and how sure that is; a radius of 0 is settled later.

    Args:
        channel: what it drives.
        unit: that the head states, "" where it states none.
        values: its angle, shape (r,).
        widest: range of the motor that turns most; all motors have one unit.
        asked: what the user states.
    """
    guesses = []
    if unit not in UNITS["deg"]:
        unit = "deg" if widest > _MOST_RAD else "rad"
        guesses.append(Guess(f"map.{channel}.unit", unit, "the size of the motors' numbers", False))
    radius = asked.spool_radius_mm or 0.0
    if radius:
        guesses.append(Guess(f"map.{channel}.spool_radius_mm", f"{radius:g}", "as stated", True))
    entry: dict[str, Any] = {"unit": unit, "spool_radius_mm": radius}
    known = values[np.isfinite(values)]
    if abs(known[0]) > _AT_REST * float(np.ptp(known)):
        entry["zero"] = float(known[0])
        guesses.append(Guess(f"map.{channel}.zero", f"{known[0]:g}", "its first row, taken for rest", False))
    return entry, guesses


def _points(
    robot: RobotSpec, raw: RawFile, heads: Heads
) -> tuple[dict[str, tuple[str, str, str]], list[Guess]]:
    spreads = {stem: spread(_values(raw, columns)) for stem, columns in heads.points.items()}
    return match_points(heads, body_count(robot), spreads, [marker.name for marker in robot.markers])


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
    points: Mapping[str, tuple[str, str, str]]
    asked: Asked


def _settled(beside: _Beside, heads: Heads) -> tuple[dict[str, Any], list[Guess]]:
    """Return axes, points and inputs of the map, settled by laying the file over the robot."""
    from catheter_sim.importing.laid import Rows, rows_of

    entries, guesses = beside.entries, []
    rows: Rows | None = None
    if beside.points:
        rows = rows_of(
            beside.robot,
            (beside.raw, beside.clock),
            (beside.log, beside.log_clock or beside.clock),
            beside.points,
            np.array(beside.asked.gravity_mps2 or (0.0, 0.0, 0.0)),
        )
    unit = next((heads.units[column] for item in beside.points.values() for column in item), "")
    unit = unit if unit in UNITS["mm"] else beside.asked.point_unit
    entries, assumed = lengths_of(rows, entries)
    guesses += assumed
    entries, more = spools_of(rows, entries, unit)
    guesses += more
    entries, more = signs_of(rows, entries)
    guesses += more
    settled: dict[str, Any] = {}
    if rows is not None:
        axes, unit, more = frame_of(rows, entries, unit, not assumed)
        guesses += more
        settled["axes"] = axes
        settled |= {name: {"columns": list(columns), "unit": unit} for name, columns in beside.points.items()}
    return settled | entries, guesses
