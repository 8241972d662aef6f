"""What follows from a catheter's data: where everything lies, whether it is possible, what drives it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.effect import (
    DAMPING,
    Handle,
    Mover,
    Role,
    Sizes,
    curvature_handle,
    sizes_of_softest,
    tip_forces,
)
from catheter_sim.core.inputs import Drive, Outputs, Quantity
from catheter_sim.core.robot import (
    MAX_LINKS,
    by_identity,
    check_counts,
    check_name,
    check_shared,
    need,
    positive,
)
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.catheter.spec import (
    RESISTANCES,
    TENDON_LAWS,
    CatheterRobot,
    CatheterSegment,
    TendonPair,
)

# ----------------------------------------------------------------------------------------------------
# Where everything of a catheter lies when it is straight: elements, joints, their order. Derived.
#
# Elements, counted from 1 at the base, are what `body_<k>` names: every rigid, torsion or prismatic
# segment, and every ring of a bending one. A bending segment begins and ends with a gap.

TRANSSEPTAL = ("torsion", "bending", "prismatic", "torsion")
FOUR_DOF = ("bending", "rigid", "bending", "rigid", "prismatic", "torsion")


@dataclass(frozen=True)
class CatheterElement:
    """A rigid piece of the catheter.

    Attributes:
        segment: index of its segment.
        ring: 0, or the number of the ring in its segment, from 1.
        face_m: from the segment's base end to the element's distal face at rest [m].
    """

    segment: int
    ring: int
    face_m: float


def ring_length_m(segment: CatheterSegment) -> float:
    """Return the length of one ring of a bending segment [m]."""
    return _ring_length_m(segment.length_m, segment.rings, segment.half_gap_m)


def _ring_length_m(length_m: float, rings: int, half_gap_m: float) -> float:
    return length_m / rings - 2.0 * half_gap_m * (rings + 1) / rings


def elements(robot: CatheterRobot) -> tuple[CatheterElement, ...]:
    """Return the robot's elements, base to tip."""
    rings = (item.rings if item.joint == "bending" else 0 for item in robot.segments)
    return _elements(
        tuple((item.length_m, n, item.half_gap_m) for item, n in zip(robot.segments, rings, strict=True))
    )


@lru_cache(maxsize=64)  # a diagnosis asks for the same few, robot by robot
def _elements(segments: tuple[tuple[float, int, float], ...]) -> tuple[CatheterElement, ...]:
    """Return the elements of segments of given length, rings (0: it is one rigid piece) and half gap."""
    result = []
    for index, (length_m, rings, half_gap_m) in enumerate(segments):
        if rings:
            pitch = _ring_length_m(length_m, rings, half_gap_m) + 2.0 * half_gap_m
            result += [CatheterElement(index, ring, ring * pitch) for ring in range(1, rings + 1)]
        else:
            result.append(CatheterElement(index, 0, length_m))
    return tuple(result)


def base_heights_m(robot: CatheterRobot) -> list[float]:
    """Return the height of each segment's base end in the straight robot, then the tip's [m]."""
    heights = [0.0]
    for segment in robot.segments:
        heights.append(heights[-1] + segment.length_m)
    return heights


def moving(robot: CatheterRobot) -> list[int]:
    """Return the indices of the segments that have a joint, base to tip: the order of joint values."""
    return [index for index, segment in enumerate(robot.segments) if segment.joint != "rigid"]


def moved_segment(robot: CatheterRobot, pair: int) -> int:
    """Return the index of the segment that the pair of this index moves."""
    return [segment.name for segment in robot.segments].index(robot.tendons[pair].moves)


def moved_segments(robot: CatheterRobot) -> list[CatheterSegment]:
    """Return the segment that each pair moves, in the order of the pairs."""
    segments = {segment.name: segment for segment in robot.segments}
    return [segments[pair.moves] for pair in robot.tendons]


def bent_by(robot: CatheterRobot) -> dict[str, CatheterSegment]:
    """Return the bending segments, by the name of the pair that moves each, in the order of the pairs."""
    moved = zip(robot.tendons, moved_segments(robot), strict=True)
    return {pair.name: segment for pair, segment in moved if segment.joint == "bending"}


def beside_springs(robot: CatheterRobot) -> str:
    """Return what the bending joints and their tendons do more than springs would; "" if nothing."""
    return _first_words(robot, pair_beside_springs)


def beside_friction(robot: CatheterRobot) -> str:
    """Return what the bending joints and their tendons do more than springs that rub; "" if nothing."""
    return _first_words(robot, _pair_beside_friction)


def carries_load(robot: CatheterRobot) -> bool:
    """Return whether there are bending joints, and the statics carry a load on them: springs that may rub."""
    return bool(bent_by(robot)) and not beside_friction(robot)


def pair_beside_springs(robot: CatheterRobot, pair: TendonPair, segment: CatheterSegment) -> str:
    """Return what a pair and the bending joint that it moves do more than springs would; "" if nothing."""
    return "friction" if robot.friction.mu > 0.0 else _pair_beside_friction(robot, pair, segment)


def _pair_beside_friction(robot: CatheterRobot, pair: TendonPair, segment: CatheterSegment) -> str:
    if pair.law != "linear":
        return "tendons of a measured law"
    return "" if segment.resistance == "elastic" else "a measured resistance"


def _first_words(
    robot: CatheterRobot, words_of: Callable[[CatheterRobot, TendonPair, CatheterSegment], str]
) -> str:
    bending = bent_by(robot)
    found = (words_of(robot, pair, bending[pair.name]) for pair in robot.tendons if pair.name in bending)
    return next((words for words in found if words), "")


def is_extensible(pair: TendonPair) -> bool:
    """Return whether the pair's tendons stretch."""
    return math.isfinite(pair.stiffness_N_per_m) or pair.law != "linear"


def turning(robot: CatheterRobot) -> list[CatheterSegment]:
    """Return the segments whose joint has an angle (torsion, bending), base to tip."""
    return [segment for segment in robot.segments if segment.joint in ("torsion", "bending")]


def hinge_counts(robot: CatheterRobot) -> list[int]:
    """Return how many hinges each of `turning` has: one, or one in every gap."""
    return [segment.rings + 1 if segment.joint == "bending" else 1 for segment in turning(robot)]


def hinge_names(robot: CatheterRobot) -> list[str]:
    """Return the hinges' names, base to tip: a torsion joint's own; `<name>_<k>`, a gap of a bending one."""
    names = []
    for segment in turning(robot):
        if segment.joint == "bending":
            names += [f"{segment.name}_{gap}" for gap in range(1, segment.rings + 2)]
        else:
            names.append(segment.name)
    return names


def hinge_heights_m(segment: CatheterSegment) -> Array:
    """Return the heights of a bending segment's hinges above its base end, shape (rings + 1,) [m].

    Evenly spaced, the ends so that the mean square of the turn about the joint's middle is the arc's,
    1/12 of the squared bend. The chords of chain and arc then differ by the bend's fourth power.
    """
    gaps = segment.rings + 1
    inner = float(((np.arange(1, gaps) / gaps - 0.5) ** 2).mean())
    end = segment.length_m * (1.0 / 12.0 - inner) / (0.5 - 2.0 * inner)
    return np.linspace(end, segment.length_m - end, gaps)


def tube_stiffness_N_m2(robot: CatheterRobot, segment: CatheterSegment) -> float:
    """Return the bending stiffness EI of the exposed tube of a prismatic segment; inf: rigid [N m^2]."""
    return robot.stiffness_scale * segment.tube_stiffness_N_m2


def is_curved(segment: CatheterSegment) -> bool:
    """Return whether a prismatic segment's unloaded tube is not straight."""
    return segment.tube_curvature_x_per_m != 0.0 or segment.tube_curvature_y_per_m != 0.0


def bending_tubes(robot: CatheterRobot) -> list[CatheterSegment]:
    """Return the prismatic segments whose exposed tube bends, by load or by itself, base to tip."""
    return [
        segment
        for segment in robot.segments
        if segment.joint == "prismatic" and (math.isfinite(segment.tube_stiffness_N_m2) or is_curved(segment))
    ]


def joint_stiffness(robot: CatheterRobot, segment: CatheterSegment) -> float:
    """Return a bending joint's stiffness over all of its gaps [N m/rad].

    The sum of its wires' and of EI / length of every tube of finite EI that runs through it to a prismatic
    segment beyond. What a tube of infinite EI adds is in the wires' number.
    """
    beyond = robot.segments[robot.segments.index(segment) + 1 :]
    tubes = sum(part.tube_stiffness_N_m2 for part in beyond if math.isfinite(part.tube_stiffness_N_m2))
    return robot.stiffness_scale * (segment.bending_stiffness_N_m_per_rad + tubes / segment.length_m)


def closing_angle_rad(segment: CatheterSegment) -> float:
    """Return the bend at which the rings' rims touch in every gap [rad].

    Nayar 2022, Section II-A: tan(bend / (2 (n + 1))) = t / rim radius.
    """
    return 2.0 * (segment.rings + 1) * math.atan2(segment.half_gap_m, segment.rim_radius_m)


def design(robot: CatheterRobot) -> tuple[str, ...]:
    """Return the robot's joints in a row: `TRANSSEPTAL`, `FOUR_DOF` or another."""
    return tuple(segment.joint for segment in robot.segments)


def is_transseptal(robot: CatheterRobot) -> bool:
    """Return whether `robot` has the joints of Nayar 2022 in their order."""
    return design(robot) == TRANSSEPTAL


def is_four_dof(robot: CatheterRobot) -> bool:
    """Return whether `robot` has the joints of Nayar 2023 in their order."""
    return design(robot) == FOUR_DOF


# ----------------------------------------------------------------------------------------------------
# What drives a catheter, its pairs' displacements and its tubes' advances, and what it reports.

ACTUATIONS = ("displacement",)


def actuations(robot: CatheterRobot) -> tuple[str, ...]:
    """Return the kinds of actuator inputs that `robot` takes."""
    return ACTUATIONS


def drives(robot: CatheterRobot, actuation: str) -> tuple[Drive, ...]:
    """Return the input columns: a pair's displacement, to either side, or a tube's advance."""
    return _drives(robot.tendons, robot.segments)


def outputs(robot: CatheterRobot) -> Outputs:
    """Return what the output columns are: pieces, hinges, each joint's whole angle, pairs with a tension."""
    return _outputs(robot.tendons, robot.segments)


@by_identity(2)
def _drives(pairs: tuple[TendonPair, ...], segments: tuple[CatheterSegment, ...]) -> tuple[Drive, ...]:
    strokes = {part.name: part.stroke_m for part in segments if part.joint == "prismatic"}
    return _drives_of(tuple((pair.name, pair.moves, strokes.get(pair.moves)) for pair in pairs))


@by_identity(2)
def _outputs(pairs: tuple[TendonPair, ...], segments: tuple[CatheterSegment, ...]) -> Outputs:
    tubes = {part.name for part in segments if part.joint == "prismatic"}
    return _outputs_of(
        tuple((part.name, part.joint, part.rings) for part in segments),
        tuple((index, pair.name) for index, pair in enumerate(pairs) if pair.moves not in tubes),
    )


@lru_cache(maxsize=64)  # a fit's robots differ in numbers that change nothing here
def _outputs_of(segments: tuple[tuple[str, str, int], ...], pulled: tuple[tuple[int, str], ...]) -> Outputs:
    """Return the outputs of segments of given name, joint and rings, some moved by pairs that are pulled.

    Joints: a torsion joint's own name; `<name>_<k>`, a gap of a bending one.
    """
    elements = 0
    joints: list[str] = []
    angles: dict[str, slice] = {}
    for name, joint, rings in segments:
        first = len(joints)
        elements += rings if joint == "bending" else 1
        if joint == "bending":
            joints += [f"{name}_{gap}" for gap in range(1, rings + 2)]
        elif joint == "torsion":
            joints.append(name)
        if len(joints) > first:
            angles[f"angle_{name}_deg"] = slice(first, len(joints))
    return Outputs(elements, tuple(joints), dict(pulled), angles)


@lru_cache(maxsize=64)  # a fit's robots differ in numbers that change nothing here
def _drives_of(pairs: tuple[tuple[str, str, float | None], ...]) -> tuple[Drive, ...]:
    """Return the columns of pairs of given name, moved joint and stroke (None: it is no tube) [m]."""
    found = []
    for index, (name, moves, stroke_m) in enumerate(pairs):
        if stroke_m is None:
            found.append(Drive(f"displacement_{name}_mm", name, Quantity.DISPLACEMENT, (index,), moves))
        else:
            column = f"{name}_mm"
            found.append(Drive(column, name, Quantity.ADVANCE, (index,), moves, least=0.0, most=stroke_m))
    return tuple(found)


# ----------------------------------------------------------------------------------------------------
# Is this catheter possible? One line says which number is not.

# What each kind of joint has besides a length, an outer radius and a mass.
_NUMBERS = {
    "torsion": ("limit_rad", "tendon_radius_m", "wrap_rad", "wrap_height_m"),
    "bending": (
        "limit_rad",
        "rings",
        "half_gap_m",
        "arm_m",
        "rim_radius_m",
        "bending_stiffness_N_m_per_rad",
        "rest_rad",
    ),
    "prismatic": ("stroke_m", "tube_stiffness_N_m2", "tube_curvature_x_per_m", "tube_curvature_y_per_m"),
    "rigid": (),
}
_MAY_BE_ZERO = ("wrap_height_m", "bending_stiffness_N_m_per_rad")
_EITHER_SIDE = ("rest_rad", "tube_curvature_x_per_m", "tube_curvature_y_per_m")
_MAY_BE_INFINITE = ("tube_stiffness_N_m2",)
_ALL = tuple(dict.fromkeys(name for names in _NUMBERS.values() for name in names))


def check(robot: CatheterRobot, where: str) -> None:
    """Raise `InputError` where a number of `robot` is impossible.

    `where`: what to call it in the message (file or robot id).
    """
    top = f"{where}: "
    if robot.kind != "catheter":
        raise InputError(f"{top}kind = {robot.kind!r}: must be catheter; it cannot be set")
    if robot.actuation not in ACTUATIONS:
        raise unknown("actuation", robot.actuation, ACTUATIONS, where)
    check_counts(robot.segments, robot.tendons, where)
    _check_names(robot, where)
    need(robot, "path_rad", top, lambda turn: 0 <= turn < math.inf, "must not be negative")
    for segment in robot.segments:
        _check_segment(segment, f"{top}segments.{segment.name}.")
    rings = sum(segment.rings for segment in robot.segments)
    if rings > MAX_LINKS:
        raise InputError(f"{top}rings = {rings} in all: more than {MAX_LINKS}")
    for pair in robot.tendons:
        _check_pair(pair, robot, f"{top}tendons.{pair.name}.")
    for segment in robot.segments:
        movers = [pair.name for pair in robot.tendons if pair.moves == segment.name]
        wanted = 0 if segment.joint == "rigid" else 1
        if len(movers) != wanted:
            by = ", ".join(movers) or "none"
            raise InputError(f"{top}segments.{segment.name}: moved by {wanted} of the tendons, not by {by}")
    check_shared(robot, where)


def _check_names(robot: CatheterRobot, where: str) -> None:
    for kind, names in (
        ("segment", [segment.name for segment in robot.segments]),
        ("tendon", [pair.name for pair in robot.tendons]),
    ):
        for name in names:
            check_name(name, f"{where}: {kind}")
            if names.count(name) > 1:
                raise InputError(f"{where}: {kind} {name!r} stands twice")


def _check_segment(segment: CatheterSegment, prefix: str) -> None:
    if segment.joint not in _NUMBERS:
        raise unknown("joint", segment.joint, _NUMBERS, prefix.removesuffix("."))
    own = _NUMBERS[segment.joint]
    for name in ("length_m", "outer_radius_m", *own):
        if name not in _MAY_BE_ZERO + _EITHER_SIDE:
            positive(segment, name, prefix, finite=name not in _MAY_BE_INFINITE)
    for name in (name for name in own if name in _EITHER_SIDE):
        need(segment, name, prefix, math.isfinite, "must be finite")
    for name in ("mass_kg", *(name for name in own if name in _MAY_BE_ZERO)):
        need(segment, name, prefix, lambda value: 0 <= value < math.inf, "must not be negative")
    for name in _ALL:
        if name not in own:
            what = f"must be 0 for a {segment.joint} joint"
            need(segment, name, prefix, lambda value: value == 0, what)
    if segment.bends_toward not in ("x", "y"):
        raise unknown("direction", segment.bends_toward, ("x", "y"), f"{prefix}bends_toward")
    choices = RESISTANCES if segment.joint == "bending" else RESISTANCES[:1]
    if segment.resistance not in choices:
        raise unknown("resistance", segment.resistance, choices, prefix.removesuffix("."))
    if segment.joint == "bending":
        _check_bending(segment, prefix)
    if segment.joint == "torsion":
        _check_limit(segment, segment.wrap_rad, "the tendon's wrap", prefix)
        # On the module's surface as printed, where a specimen's may lie a percent further out.
        within = partial(_at_most, 1.02 * segment.outer_radius_m)
        need(segment, "tendon_radius_m", prefix, within, "lies outside the module")


def _check_bending(segment: CatheterSegment, prefix: str) -> None:
    need(segment, "rings", prefix, lambda count: count <= MAX_LINKS, f"more than {MAX_LINKS}")
    gaps_m = 2.0 * segment.half_gap_m * (segment.rings + 1)
    what = f"nothing is left for the rings between gaps of {gaps_m * 1e3:g} mm in all"
    need(segment, "length_m", prefix, lambda length: length > gaps_m, what)
    for name in ("arm_m", "rim_radius_m"):
        need(segment, name, prefix, partial(_at_most, segment.outer_radius_m), "lies outside the rings")
    need(segment, "arm_m", prefix, partial(_at_most, segment.rim_radius_m), "lies outside rim_radius_mm")
    _check_limit(segment, closing_angle_rad(segment), "the bend that closes the gaps", prefix)
    bent = partial(_within, segment.limit_rad)
    need(segment, "rest_rad", prefix, bent, "lies beyond the joint's limit")
    if segment.resistance != RESISTANCES[0]:
        straight = "must be 0: the measured resistance is that of a joint straight at rest"
        need(segment, "rest_rad", prefix, lambda rest: rest == 0, straight)


def _check_limit(segment: CatheterSegment, most_rad: float, what: str, prefix: str) -> None:
    above = f"above {what}, {math.degrees(most_rad):.4g} deg"
    need(segment, "limit_rad", prefix, partial(_at_most, most_rad), above)


def _at_most(most: float, value: float) -> bool:
    return value <= most


def _within(most: float, value: float) -> bool:
    return abs(value) <= most


def _check_pair(pair: TendonPair, robot: CatheterRobot, prefix: str) -> None:
    names = [segment.name for segment in robot.segments]
    if pair.moves not in names:
        raise unknown("segment", pair.moves, names, f"{prefix}moves")
    need(pair, "length_m", prefix, lambda length: 0 <= length < math.inf, "must not be negative")
    positive(pair, "stiffness_N_per_m", prefix, finite=False)
    for name in ("slack_m", "play_m"):
        need(pair, name, prefix, lambda length: 0 <= length < math.inf, "must not be negative")
    bends = robot.segments[names.index(pair.moves)].joint == "bending"
    if not bends:
        need(pair, "slack_m", prefix, lambda length: length == 0, "must be 0: its joint does not bend")
    choices = TENDON_LAWS if bends else TENDON_LAWS[:1]
    if pair.law not in choices:
        raise unknown("law", pair.law, choices, prefix.removesuffix("."))
    if pair.law == "uhmwpe":
        what = "must be above 0: the law needs the tendon's length"
        need(pair, "length_m", prefix, lambda length: length > 0, what)


# ----------------------------------------------------------------------------------------------------
# Where causes of error may act on a catheter, and what is large for it.

_MOST_REST_DEG = 30.0
_REST_SCALE_DEG = 1.0  # as 0.02 over a length is for a curvature

Joints = tuple[tuple[str, str], ...]  # a pair's name, and its segment's


def handles(robot: CatheterRobot) -> tuple[Handle, ...]:
    """Return the places at which causes may act.

    Its joints' angles follow its tendons' lengths, so that an elastic law does nothing else than its scale.
    Its statics carry a mount that gives way beside springs alone. They carry a load on the tip beside
    springs that may rub, but beside no law that was measured. A search with it would take a quarter of an
    hour. And inextensible tendons move their joints whether they rub or not.
    """
    bending = bent_by(robot)
    tubes = tuple((item.name, item.stroke_m) for item in robot.segments if item.joint == "prismatic")
    return _handles(
        tuple((pair.name, bending[pair.name].name if pair.name in bending else "") for pair in robot.tendons),
        tubes,
        any(is_extensible(pair) for pair in robot.tendons if pair.name in bending),
        bool(bending) and not beside_springs(robot),
        carries_load(robot),
        all(_stays_in_plane(item) for item in robot.segments),
    )


@lru_cache(maxsize=64)  # a diagnosis asks for the same few, robot by robot
def _handles(
    pairs: Joints,
    tubes: tuple[tuple[str, float], ...],
    extensible: bool,
    gives_way: bool,
    loaded: bool,
    planar: bool,
) -> tuple[Handle, ...]:
    found = [Handle(Role.ELASTIC_SCALE, "stiffness_scale"), DAMPING]
    if gives_way:
        found.append(Handle(Role.MOUNT, "mount.axial_stiffness_N_per_mm"))
    if loaded:
        found += [replace(item, tried=False) for item in tip_forces([("", 0.0, "x" if planar else "xy")])]
    if extensible:
        found += [Handle(Role.FRICTION, "friction.mu"), Handle(Role.PATH, "path_deg", "path_deg")]
    stroke = max((length for _, length in tubes), default=0.0)
    if stroke:
        found += [
            curvature_handle(f"segments.{name}.tube_{parameter}", parameter, "tube", stroke)
            for parameter in ("curvature_x_per_m", "curvature_y_per_m")
            for name, _ in tubes
        ]
    for pair, segment in pairs:
        key = f"tendons.{pair}"
        found.append(Handle(Role.DRIVE_PLAY, f"{key}.play_mm", f"width_{pair}_mm"))
        if not segment:  # a torsion joint needs no tension
            found.append(Handle(Role.DRIVE_STIFFNESS, f"{key}.stiffness_N_per_mm"))
            continue
        found += [
            Handle(Role.TENDON_STIFFNESS, f"{key}.stiffness_N_per_mm"),
            Handle(Role.SLACK, f"{key}.slack_mm", f"slack_{pair}_mm"),
            Handle(Role.TENDON_LENGTH, f"{key}.length_mm", along={f"{key}.law": "uhmwpe"}),
            Handle(
                Role.REST_BEND,
                f"segments.{segment}.rest_deg",
                f"{segment}_deg",
                "joints",
                _REST_SCALE_DEG,
                -_MOST_REST_DEG,
                _MOST_REST_DEG,
            ),
        ]
    return tuple(found)


def _stays_in_plane(segment: CatheterSegment) -> bool:
    """Return whether a segment leaves the robot in its xz plane, whatever acts within that."""
    if segment.joint == "bending":
        return segment.bends_toward == "x"
    if segment.joint == "prismatic":
        return math.isinf(segment.tube_stiffness_N_m2) and segment.tube_curvature_y_per_m == 0.0
    return segment.joint == "rigid"


def movers(robot: CatheterRobot) -> tuple[Mover, ...]:
    """Return what each channel moves: a joint, either way, called as its pair."""
    return tuple(
        Mover(pair.name, pair.name, advances=segment.joint == "prismatic")
        for pair, segment in zip(robot.tendons, moved_segments(robot), strict=True)
    )


def sizes(robot: CatheterRobot) -> Sizes:
    """Return what bends its softest bending joint by a radian; it is made to bend until its gaps close.

    Infinite forces where nothing bends.
    """
    bending = list(bent_by(robot).values())
    return sizes_of_softest(
        float(sum(segment.length_m for segment in robot.segments)),
        min((joint_stiffness(robot, item) * item.length_m for item in bending), default=math.inf),
        max((item.arm_m for item in bending), default=1.0),
        max((closing_angle_rad(item) / item.length_m for item in bending), default=math.inf),
    )
