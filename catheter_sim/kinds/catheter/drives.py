"""What drives a catheter, its pairs' displacements and its tubes' advances, and what it reports."""

from __future__ import annotations

from functools import lru_cache

from catheter_sim.core.drive import Drive, Outputs, Quantity
from catheter_sim.core.remembered import by_identity
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment, TendonPair

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
