"""Spools, signs, unit of length and axes of a map, settled by laying the file over the robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from catheter_sim.core.posture import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.mapping.file_map import file_map
from catheter_sim.diagnosis.data.mapping.mapped import channels_of, seconds_of
from catheter_sim.diagnosis.data.mapping.raw_file import RawFile
from catheter_sim.diagnosis.data.mapping.scales import UNITS
from catheter_sim.importing.against_robot import (
    CLEAR,
    LENGTHS,
    MOST_ROWS,
    RADII_MM,
    Against,
    Laid,
    axes_of,
    laid_over,
    length_unit,
    signs_tried,
)
from catheter_sim.importing.guesses import Guess
from catheter_sim.importing.heads import numbers_of
from catheter_sim.kinds import kind_of

LEAST_MOTION = 0.01  # of the robot's length: nobody records a robot that moves by less


@dataclass(frozen=True)
class Rows:
    """Some rows of a file beside the robot.

    Attributes:
        against: the robot and the measured points at these rows.
        log: the file of the inputs.
        times: of the rows, and of the rows of `log`, on one clock [s].
    """

    against: Against
    log: RawFile
    times: tuple[Array, Array]

    def computed(self, entries: Mapping[str, Mapping[str, Any]]) -> Array | None:
        """Return the robot's positions at these rows under entries of the map, shape (r, p, 3) [mm]."""
        mapping = file_map(dict(entries), tuple(entries), (), self.log.where)
        assert mapping is not None
        rows_s, log_s = self.times
        given = {
            name: np.interp(rows_s, log_s, values)
            for name, values in channels_of(self.log, mapping, tuple(entries)).items()
        }
        return self.against.computed(rows_s, given)

    def laid(self, entries: Mapping[str, Mapping[str, Any]]) -> Laid:
        """Return how well the robot explains these rows under entries of the map."""
        return laid_over(self.computed(entries), self.against.measured)


def rows_of(
    robot: RobotSpec,
    measured: tuple[RawFile, Mapping[str, Any]],
    commanded: tuple[RawFile, Mapping[str, Any]],
    points: Mapping[str, tuple[str, str, str]],
    gravity_mps2: Array,
) -> Rows:
    """Return some rows of a file, spread over it, beside the robot.

    Args:
        robot: as specified.
        measured, commanded: the files of positions and of inputs, each with the entry of its clock.
        points: the columns of the measured points.
        gravity_mps2: in the base frame, shape (3,).
    """
    (raw, clock), (log, log_clock) = measured, commanded
    mapping = file_map({"time_s": clock, "inputs_time_s": log_clock}, (), (), raw.where)
    assert mapping is not None
    seconds, log_seconds = (
        seconds_of(raw, mapping.time, raw.where),
        seconds_of(log, mapping.inputs_time, log.where),
    )
    inside = np.flatnonzero((seconds >= log_seconds[0]) & (seconds <= log_seconds[-1]))
    taken = inside[np.unique(np.linspace(0, len(inside) - 1, min(MOST_ROWS, len(inside))).astype(int))]
    places = [[numbers_of(raw, column) for column in columns] for columns in points.values()]
    positions = np.array([[values[taken] for values in point if values is not None] for point in places])
    columns = tuple(f"{point}_{axis}_mm" for point in points for axis in "xyz")
    against = Against(robot, positions.transpose(2, 0, 1), columns, gravity_mps2)
    return Rows(against, log, (seconds[taken], log_seconds))


def lengths_of(
    rows: Rows | None, entries: dict[str, dict[str, Any]]
) -> tuple[dict[str, dict[str, Any]], list[Guess]]:
    """Return entries with a unit of length for those displacements whose file states none; it stays unsure.

    In mm, unless the robot would so move by next to nothing, and by more in a larger unit.
    """
    open_ones = [name for name, entry in entries.items() if entry.get("unit") == ""]
    unit, why = "mm", "the file says none, --input-unit states it"
    if open_ones and rows is not None:
        length_mm = 1e3 * kind_of(rows.against.robot).model.length_m(rows.against.robot)
        moves = {}
        for name in ("mm", "cm", "m"):
            computed = rows.computed(_with(entries, {item: {"unit": name} for item in open_ones}))
            reach_mm = 0.0 if computed is None else float(np.ptp(computed, axis=0).max())
            moves[name] = reach_mm / length_mm if np.isfinite(reach_mm) else 0.0  # NaN: out of its range
        if not moves["mm"] > LEAST_MOTION:
            unit = next((name for name in ("cm", "m") if moves[name] > LEAST_MOTION), "mm")
        said = ", ".join(f"{100 * share:.2g} % as {name}" for name, share in moves.items() if share)
        why += f"; of its length the robot would move by {said}" if said else ""
    entries = _with(entries, {name: {"unit": unit} for name in open_ones})
    return entries, [Guess(f"map.{name}.unit", unit, why, False) for name in open_ones]


def spools_of(
    rows: Rows | None, entries: dict[str, dict[str, Any]], unit: str
) -> tuple[dict[str, dict[str, Any]], list[Guess]]:
    """Return entries with a radius for every spool that has none, and how sure they are."""
    open_ones = [name for name, entry in entries.items() if entry.get("spool_radius_mm") == 0.0]
    if not open_ones:
        return entries, []
    found = []
    for radius in RADII_MM:
        tried = _with(entries, {name: {"spool_radius_mm": radius} for name in open_ones})
        laid = rows.laid(tried) if rows is not None else Laid(np.inf, 1.0)
        factors = [UNITS["mm"][unit]] if unit else list(LENGTHS.values())
        off = min(abs(np.log(laid.scale / factor)) for factor in factors)
        found.append((laid.error + off, radius))
    least, radius = min(found)
    if not np.isfinite(least):
        radius = 10.0
    why = "the round radius with which the robot moves most like the file; --spool-radius states it"
    entries = _with(entries, {name: {"spool_radius_mm": radius} for name in open_ones})
    return entries, [Guess(f"map.{name}.spool_radius_mm", f"{radius:g}", why, False) for name in open_ones]


def signs_of(
    rows: Rows | None, entries: dict[str, dict[str, Any]]
) -> tuple[dict[str, dict[str, Any]], list[Guess]]:
    """Return entries with the signs under which the robot is clearly most like the file; plus, if none is."""
    if rows is None:
        return entries, []
    tried = []
    for signs in signs_tried(tuple(entries)):
        laid = rows.laid(_with(entries, {name: {"sign": sign} for name, sign in signs.items()}))
        tried.append((laid.error, signs))
    plain, best = tried[0], min(tried, key=lambda item: item[0])
    if not best[0] < CLEAR * plain[0]:
        return entries, []
    turned = {name: {"sign": -1} for name, sign in best[1].items() if sign < 0}
    why = "the robot as specified moves so, and not so with the other sign"
    return _with(entries, turned), [Guess(f"map.{name}.sign", "-1", why, False) for name in turned]


def frame_of(
    rows: Rows, entries: Mapping[str, Mapping[str, Any]], unit: str, inputs_sure: bool
) -> tuple[list[str], str, list[Guess]]:
    """Return the axes and the unit of the measured points, and how sure they are.

    `unit`: as the head or the user states it, else ""; `inputs_sure`: units of all inputs are known.
    """
    computed = rows.computed(entries)
    laid = laid_over(computed, rows.against.measured)
    guesses = []
    key = f"map.{rows.against.columns[0].removesuffix('_x_mm')}.unit"
    if unit:
        guesses.append(Guess(key, unit, "the head, or as stated", True))
    elif np.isfinite(laid.error):
        unit, sure = length_unit(laid.scale)
        why = f"the robot's own motion is {laid.scale:.3g} times the file's"
        if not inputs_sure:
            why += ", if the inputs' units are right"
        guesses.append(Guess(key, unit, why, sure and inputs_sure))
    else:
        unit = "mm"
        guesses.append(Guess(key, unit, "assumed", False))
    if computed is None or not np.isfinite(laid.error):
        guesses.append(Guess("map.axes", "x, y, z", "assumed: the robot cannot be driven so", False))
        return ["x", "y", "z"], unit, guesses
    axes, sure = axes_of(computed, rows.against.measured)
    why = f"the robot as specified moves so, but for {100 * laid.error:.1f} % of the motion"
    guesses.append(Guess("map.axes", f"the base's x, y, z are the file's {', '.join(axes)}", why, sure))
    return axes, unit, guesses


def _with(
    entries: Mapping[str, Mapping[str, Any]], changes: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    return {name: {**entry, **changes.get(name, {})} for name, entry in entries.items()}
