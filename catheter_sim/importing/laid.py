"""What names do not say, told by laying a file's points over those of the robot."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.channels import read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.faults_of_columns import full_pulls
from catheter_sim.diagnosis.mapping import (
    UNITS,
    RawFile,
    channel_unit,
    channels_of,
    factor_to,
    file_map,
    seconds_of,
)
from catheter_sim.diagnosis.thresholds import PULL_BEYOND
from catheter_sim.errors import InputError
from catheter_sim.importing.columns import PIXELS, Guess, numbers_of
from catheter_sim.robots import kind_of
from catheter_sim.tables import Table
from catheter_sim.theory.twins import twin_for
from catheter_sim.units import si_factor

# ----------------------------------------------------------------------------------------------------
# What names do not say, told by laying the file's points over those of the robot as specified.
#
# Unit of length, radius of spools, signs of motors and the tracker's axes are those with which the robot's
# analytic twin, driven by the file's inputs, comes nearest to the measured positions, after the tracker's
# own best motion. A robot that errs shows them wrongly, so that what decides narrowly is called unsure.

MOST_ROWS = 60  # of the file that are laid over the robot
RADII_MM = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.5, 8.0, 9.0, 10.0, 12.0, 12.5, 15.0, 20.0, 25.0, 30.0)
LENGTHS = {"m": 1e3, "in": 25.4, "cm": 10.0, "mm": 1.0}
TURNS = (
    4096.0,
    2000.0,
    1024.0,
    16384.0,
    360.0,
    1000.0,
    2048.0,
    4000.0,
    8192.0,
    65536.0,
)  # of encoders, common ones first
EVIDENCE = 0.5  # of the motion, that may be left unexplained by what is evidence of a scale or of axes
CLEAR = 0.7  # error of the best over that of the next, below which the choice is called sure
_MOST_SIGNED = 4  # channels whose signs are tried in all combinations
_LINE = 1e-2  # spread across a line over that along it, below which points lie on it


@dataclass(frozen=True)
class Laid:
    """How well the robot explains a file's points, under one reading of the file.

    Attributes:
        error: root mean square distance after the best motion and scale, over the measured points' spread.
        scale: of the measured points, by which they are the robot's in mm.
    """

    error: float
    scale: float


@dataclass(frozen=True)
class LaidOver:
    """A file beside the robot.

    Attributes:
        robot: as specified.
        measured: positions in the file's axes and unit, shape (r, p, 3), in a plane (r, p, 2); NaN: missing.
        columns: the same points' output columns of the robot, three a point.
        gravity_mps2: in the base frame, shape (3,).
        where: the file.
    """

    robot: RobotSpec
    measured: Array
    columns: tuple[str, ...]
    gravity_mps2: Array
    where: str = ""

    def computed(self, time_s: Array, inputs: Mapping[str, Array]) -> Array | None:
        """Return the twin's positions [mm], shape (r, p, 3); None where the robot cannot be driven so."""
        try:
            given: Inputs = read_inputs(self.robot, Table(time_s, dict(inputs)))
            robot = replace(self.robot, actuation=given.actuation)
            twin = twin_for(robot, given.actuation, self.columns, self.gravity_mps2)
            return np.asarray(twin([robot], given, 1)[0].reshape(len(given), -1, 3))
        except InputError:
            return None


def laid_over(computed: Array | None, measured: Array) -> Laid:
    """Return how well computed points (r, p, 3) explain measured ones, after a motion and a scale."""
    if computed is None:
        return Laid(np.inf, 1.0)
    if measured.shape[2] == 2:
        return plane_of(computed, measured)[0]
    a, b = _pairs(computed, measured)
    if len(a) < 3 or not np.ptp(a, axis=0).any():
        return Laid(np.inf, 1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # points on a line leave a turn open, which does no harm here
        turn, _ = Rotation.align_vectors(b, a)
    turned = turn.apply(a)
    scale = float((turned * b).sum() / (turned**2).sum())
    spread = float(np.sqrt((b**2).sum(axis=1).mean()))
    left = float(np.sqrt(((scale * turned - b) ** 2).sum(axis=1).mean()))
    return Laid(left / spread, 1.0 / scale if scale > 0.0 else np.inf)


def plane_of(computed: Array, measured: Array, down: bool = False) -> tuple[Laid, tuple[str, str]]:
    """Return how well computed points (r, p, 3) explain those of a plane (r, p, 2), and its two axes.

    Each axis of the plane is one of the base's, "x" or "-x"; from behind a plane is a mirror image. Of those
    that explain the points as well, the one whose coordinates move most, with positive signs.

    Args:
        computed, measured: of the same points.
        down: the plane's second axis points downward: its sign is negative where the points leave it open.
    """
    a, b = _pairs(computed, measured)
    nothing = Laid(np.inf, 1.0), ("x", "z")
    if len(a) < 3 or not np.ptp(a, axis=0).any() or not np.ptp(b, axis=0).any():
        return nothing
    found = []
    for axes in itertools.permutations(range(3), 2):
        for signs in itertools.product((1.0, -1.0), repeat=2):
            turned = a[:, axes] * signs
            size = float((turned**2).sum())
            scale = float((turned * b).sum()) / size if size > 0.0 else 0.0
            if scale > 0.0:
                left = float(((scale * turned - b) ** 2).sum())
                odd = int(signs[0] < 0.0) + int((signs[1] < 0.0) != down)
                names = [("-" if sign < 0.0 else "") + "xyz"[k] for k, sign in zip(axes, signs, strict=True)]
                found.append((left, -round(size / float((a**2).sum()), 3), odd, scale, names))
    if not found:
        return nothing
    whole = float((b**2).sum())
    near = 1.05 * min(item[0] for item in found) + 1e-6 * whole
    left, _, _, scale, names = min((item for item in found if item[0] <= near), key=lambda item: item[1:3])
    return Laid(float(np.sqrt(left / whole)), 1.0 / scale), (names[0], names[1])


def axes_of(computed: Array, measured: Array) -> tuple[list[str], bool]:
    """Return the base's x, y and z in the file's axes, and whether the points show them clearly.

    Of the 24 turns that exchange axes the one that lays the points over one another best.
    """
    a, b = _pairs(computed, measured)
    scale = float(np.sqrt((a**2).sum() / (b**2).sum()))
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            R_bt = np.zeros((3, 3))
            R_bt[range(3), order] = signs
            if np.linalg.det(R_bt) > 0.0:
                found.append((float(((a - scale * b @ R_bt.T) ** 2).sum()), -float(np.trace(R_bt)), R_bt))
    found.sort(key=lambda item: item[:2])
    least = found[0][0]
    best = min((item for item in found if item[0] <= 1.05 * least), key=lambda item: item[1])
    next_one = min((item[0] for item in found if item is not best), default=np.inf)
    names = []
    for row in best[2]:
        index = int(np.argmax(np.abs(row)))
        names.append(("-" if row[index] < 0.0 else "") + "xyz"[index])
    extents = np.linalg.svd(a, compute_uv=False)
    return names, bool(best[0] < CLEAR**2 * next_one and extents[1] > _LINE * extents[0])


def length_unit(scale: float) -> tuple[str, bool]:
    """Return the unit of length whose factor to mm is next to `scale`, and whether no other is near."""
    apart = {unit: abs(np.log(scale / factor)) for unit, factor in LENGTHS.items()}
    unit, following = sorted(apart, key=lambda item: apart[item])[:2]
    return unit, bool(apart[unit] < min(np.log(2.0), 0.5 * apart[following]))


def length_by_size(points: Array, length_mm: float) -> str:
    """Return the largest unit in which points (r, p, c) move by no more than a robot of this length can."""
    known = points.reshape(-1, points.shape[-1])
    known = known[np.isfinite(known).all(axis=1)]
    moves = float(np.ptp(known, axis=0).max()) if len(known) else 0.0
    return next((unit for unit in ("m", "cm") if moves * LENGTHS[unit] <= 2.0 * length_mm), "mm")


def signs_tried(channels: Sequence[str]) -> list[dict[str, int]]:
    """Return sets of signs to try, all positive first: all of few channels, of many each alone and all."""
    if len(channels) <= _MOST_SIGNED:
        sets = itertools.product((1, -1), repeat=len(channels))
        return [dict(zip(channels, signs, strict=True)) for signs in sets]
    plus = dict.fromkeys(channels, 1)
    return [plus, dict.fromkeys(channels, -1), *({**plus, name: -1} for name in channels)]


def spread(points: Array) -> float:
    """Return how far points (r, c) lie from their middle, root mean square; 0 where none is whole."""
    whole = points[np.isfinite(points).all(axis=1)]
    return float(np.sqrt(((whole - whole.mean(axis=0)) ** 2).sum(axis=1).mean())) if len(whole) else 0.0


def _pairs(computed: Array, measured: Array) -> tuple[Array, Array]:
    """Return whole points as pairs, each about its middle, shape (n, 3) and as the measured ones."""
    a, b = computed.reshape(-1, 3), measured.reshape(-1, measured.shape[2])
    whole = np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1)
    a, b = a[whole], b[whole]
    return (a - a.mean(axis=0), b - b.mean(axis=0)) if len(a) else (a, b)


# ----------------------------------------------------------------------------------------------------
# Spools, signs, unit of length and axes of a map, settled by laying the file over the robot.

OPEN = ("counts_per_turn", "spool_radius_mm")  # keys of an entry that are settled here where they are 0
_ALIKE = 0.05  # in error, within which a commoner encoder is taken
_USUAL_MM = 10.0  # radius of a spool of which nothing is known
LEAST_MOTION = 0.01  # of the robot's length: nobody records a robot that moves by less


@dataclass(frozen=True)
class LaidRows:
    """Some rows of a file beside the robot.

    Attributes:
        against: the robot and the measured points at these rows.
        log: the file of the inputs.
        times: of the rows, and of the rows of `log`, on one clock [s].
    """

    against: LaidOver
    log: RawFile
    times: tuple[Array, Array]

    def computed(self, entries: Mapping[str, Mapping[str, Any]]) -> Array | None:
        """Return the robot's positions at these rows under entries of the map, shape (r, p, 3) [mm].

        None where a unit, a spool or an encoder is still open, or the robot cannot be driven so.
        """
        open_ones = [entry.get(key) for entry in entries.values() for key in (*OPEN, "unit")]
        if 0.0 in open_ones or "" in open_ones:
            return None
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
    points: Mapping[str, tuple[str, ...]],
    gravity_mps2: Array,
) -> LaidRows:
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
    against = LaidOver(robot, positions.transpose(2, 0, 1), columns, gravity_mps2, raw.where)
    return LaidRows(against, log, (seconds[taken], log_seconds))


def lengths_of(
    rows: LaidRows | None, entries: dict[str, dict[str, Any]]
) -> tuple[dict[str, dict[str, Any]], list[Guess]]:
    """Return entries with a unit of length for those displacements whose file states none; it stays unsure.

    In mm, unless the robot would so move by next to nothing, and by more in a larger unit.
    """
    open_ones = [name for name, entry in entries.items() if entry.get("unit") == ""]
    unit, why = "mm", "the file says none, --input-unit states it"
    if open_ones and rows is not None:
        length_mm, moves = _length_mm(rows), {}
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
    rows: LaidRows | None, entries: dict[str, dict[str, Any]], unit: str
) -> tuple[dict[str, dict[str, Any]], list[Guess]]:
    """Return entries with a radius for every spool and a turn for every encoder that have none; unsure.

    Those with which the robot moves most like the file; of turns that do as well, the commonest. What would
    pull tendons far beyond what bends the robot is taken only if all do so.

    `unit`: of the measured points, `PIXELS` where they have none; "": not known.
    """
    encoders, spools = ([name for name, entry in entries.items() if entry.get(key) == 0.0] for key in OPEN)
    if not encoders and not spools:
        return entries, []
    factors = [UNITS["mm"][unit]] if unit in UNITS["mm"] else list(LENGTHS.values())

    def changed(turn: float, radius: float) -> dict[str, dict[str, Any]]:
        turned = _with(entries, {name: {"counts_per_turn": turn} for name in encoders})
        return _with(turned, {name: {"spool_radius_mm": radius} for name in spools})

    def misfit(turn: float, radius: float) -> tuple[bool, float, float]:
        tried = changed(turn, radius)
        laid = rows.laid(tried) if rows is not None else Laid(np.inf, 1.0)
        off = 0.0 if unit == PIXELS else min(abs(np.log(laid.scale / factor)) for factor in factors)
        return rows is not None and beyond_times(rows, tried) > PULL_BEYOND[0], laid.error + off, radius

    radii = RADII_MM if spools else (0.0,)
    best = {turn: min(misfit(turn, radius) for radius in radii) for turn in (TURNS if encoders else (0.0,))}
    far, least, _ = min(best.values())
    turn = next(turn for turn, item in best.items() if item[0] == far and item[1] <= least + _ALIKE)
    radius = best[turn][2] if np.isfinite(least) else _USUAL_MM
    why = "the {} with which the robot moves most like the file; {} states it"
    turns, radii_why = why.format("turn", "--counts-per-turn"), why.format("round radius", "--spool-radius")
    said = [Guess(f"map.{name}.counts_per_turn", f"{turn:g}", turns, False) for name in encoders]
    said += [Guess(f"map.{name}.spool_radius_mm", f"{radius:g}", radii_why, False) for name in spools]
    return changed(turn, radius), said


def beyond_times(rows: LaidRows, entries: Mapping[str, Mapping[str, Any]]) -> float:
    """Return how many times what bends the robot fully its inputs are at most; 0: not known."""
    full, found = full_pulls(rows.against.robot), []
    for name, entry in entries.items():
        values = numbers_of(rows.log, entry["column"])
        if name in full and values is not None and entry.get("unit"):
            factor = si_factor(name) * factor_to(channel_unit(name), entry["unit"], name, *_sizes(entry))
            found.append(float(np.nanmax(np.abs(factor * (values - entry.get("zero", 0.0))))) / full[name])
    return max(found, default=0.0)


def _sizes(entry: Mapping[str, Any]) -> tuple[float | None, float | None]:
    return entry.get("spool_radius_mm"), entry.get("counts_per_turn")


def signs_of(
    rows: LaidRows | None, entries: dict[str, dict[str, Any]]
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
    rows: LaidRows, entries: Mapping[str, Mapping[str, Any]], unit: str, inputs_sure: bool
) -> tuple[list[str], str, list[Guess]]:
    """Return the axes and the unit of the measured points, and how sure they are.

    `unit`: as the head or the user states it, else ""; `inputs_sure`: the file or the user says of all inputs
    which columns they are, in which units and on which spools.
    """
    measured = rows.against.measured
    computed = rows.computed(entries)
    laid = laid_over(computed, measured)
    evident = bool(laid.error <= EVIDENCE)
    rests = "" if inputs_sure else ", if the inputs are read rightly"
    guesses = []
    key = f"map.{rows.against.columns[0].removesuffix('_x_mm')}.unit"
    if unit:
        guesses.append(Guess(key, unit, "the head, or as stated", True))
    elif evident:
        unit, sure = length_unit(laid.scale)
        why = f"the robot's own motion is {laid.scale:.3g} times the file's{rests}"
        guesses.append(Guess(key, unit, why, sure and inputs_sure))
    else:
        unit = length_by_size(measured, _length_mm(rows))
        why = "the size of the file's motion beside the robot's length; the robot itself moves otherwise"
        guesses.append(Guess(key, unit, why, False))
    if computed is None or not np.isfinite(laid.error):
        guesses.append(Guess("map.axes", "x, y, z", "assumed: the robot cannot be driven so", False))
        return ["x", "y", "z"], unit, guesses
    axes, sure = axes_of(computed, measured)
    why = f"best of 24 axis orders; {100 * laid.error:.1f} % of the motion stays unexplained{rests}"
    sure = sure and evident and inputs_sure
    guesses.append(Guess("map.axes", f"the base's x, y, z are the file's {', '.join(axes)}", why, sure))
    return axes, unit, guesses


def plane_frame(
    rows: LaidRows,
    entries: Mapping[str, Mapping[str, Any]],
    points: Mapping[str, tuple[str, ...]],
    unit: str,
    picture: bool,
) -> tuple[dict[str, dict[str, Any]], list[Guess]]:
    """Return the entry of each coordinate of points in a plane, and how sure it is: not at all.

    Which coordinates they are, their signs and, where nothing states a unit, their scale follow from the
    robot's own motion. `rows` are those of the file, `entries` those of the inputs, `points` the two
    columns of each; `unit`: as the head or the user states it, else "". `picture`: they are places in a
    picture.

    Raises:
        InputError: the robot does not move so that it could show them; the message says how to do it by hand.
    """
    computed, measured = rows.computed(entries), rows.against.measured
    laid, axes = (
        (Laid(np.inf, 1.0), ("x", "z")) if computed is None else plane_of(computed, measured, picture)
    )
    if not np.isfinite(laid.error):
        columns = next(iter(points.values()))
        times = beyond_times(rows, entries)
        why = f" (inputs are {times:.0f} times what bends it fully)" if times > PULL_BEYOND[0] else ""
        by_hand = f'tip_x_mm = {{ column = "{columns[0]}", scale = 0.3 }}'
        raise InputError(
            f"{rows.against.where}: the robot's own motion{why} does not show which coordinates "
            f"{columns[0]!r} and {columns[1]!r} are. Write [map] of a dataset.toml by hand: {by_hand}"
        )
    size: dict[str, Any] = {"unit": unit}
    if not unit:
        near, _ = length_unit(laid.scale)
        known = not picture and abs(np.log(laid.scale / LENGTHS[near])) < np.log(2.0)
        size = {"unit": near} if known else {"scale": float(f"{laid.scale:.3g}")}
    said = f"in {size['unit']}" if "unit" in size else f"{size['scale']:g} mm for 1"
    why = f"best fit of the robot's motion; {100 * laid.error:.1f} % of the motion stays unexplained"
    found: dict[str, dict[str, Any]] = {}
    guesses = []
    for point, columns in points.items():
        for axis, column in zip(axes, columns, strict=True):
            minus = axis.startswith("-")
            name = f"{point}_{axis[-1]}_mm"
            found[name] = {"column": column, **size, **({"sign": -1} if minus else {})}
            guesses.append(Guess(f"map.{name}", f"{'minus ' if minus else ''}{column!r}, {said}", why, False))
    return found, guesses


def _length_mm(rows: LaidRows) -> float:
    return float(1e3 * kind_of(rows.against.robot).model.length_m(rows.against.robot))


def _with(
    entries: Mapping[str, Mapping[str, Any]], changes: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    return {name: {**entry, **changes.get(name, {})} for name, entry in entries.items()}
