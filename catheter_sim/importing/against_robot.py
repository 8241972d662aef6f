"""What names do not say, told by laying the file's points over those of the robot as specified.

Unit of length, radius of spools, signs of motors and the tracker's axes are those with which the robot's
analytic twin, driven by the file's inputs, comes nearest to the measured positions, after the tracker's own
best motion. A robot that errs shows them wrongly, so that what decides narrowly is called unsure.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.channels import read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.tables import Table
from catheter_sim.theory.predict import twin_for

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
class Against:
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
