"""A continuum robot from somebody's MJCF: a chain of hinges with tendons becomes a robot of this package.

A disk stands wherever a tendon has a hole, and a hinge anywhere between two disks (`Segment.hinge_share`), so
that holes stay where they are; where no hinge is between, a stretch is stiff. What MJCF does not say
(friction at the holes, what is a segment, what a hinge stands for) is worked out of places and stiffnesses or
assumed, and said in notes. What the robot is like beside the file, MuJoCo says (`compared`).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from catheter_sim.core.robot import Dynamics, Friction
from catheter_sim.errors import InputError, RobotNote
from catheter_sim.kinds.continuum.checks import check
from catheter_sim.kinds.continuum.from_mjcf.compared import compare
from catheter_sim.kinds.continuum.from_mjcf.hinges import Frame, Hinge, hinges_of
from catheter_sim.kinds.continuum.from_mjcf.tendons import Routed, hinge_of, tendons_of
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Segment, Tendon

_ALIKE = 0.02  # share by which numbers of one segment may differ
_WIDER = 1.25  # than its outermost holes a robot is taken to be, where no geom says
_SAME_SHARE = 1e-3  # of the mean distance of hinges: heights that differ by less are one
_LEFT_OUT = "left out"
_MASS_SHARE = 1e-3  # of the chain's length: masses that are nearer are in place
_LEAST_MASS_KG = 1e-9  # of a stretch that weighs nothing


@dataclass(frozen=True)
class ReadChain:
    """A robot that was read.

    Attributes:
        robot: the robot.
        notes: what was assumed, left out or moved, a line each; the robot's description has them, too.
    """

    robot: ContinuumRobot
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Cell:
    """What is between two disks that follow one another.

    Attributes:
        low_m, high_m: heights of the disks, from the first hinge.
        hinges: between them, from base to tip.
        ends: whether a tendon ends at the disk above.
    """

    low_m: float
    high_m: float
    hinges: tuple[Hinge, ...]
    ends: bool

    @property
    def length_m(self) -> float:
        """From disk to disk."""
        return self.high_m - self.low_m

    @property
    def places(self) -> tuple[float, ...]:
        """Of the hinges, shares of the length."""
        return tuple((item.z_m - self.low_m) / self.length_m for item in self.hinges)


def read_chain(path: Path | str, name: str | None = None) -> ReadChain:
    """Return a chain of hinges with spatial tendons as a continuum robot.

    Its base frame is the file's own, of the body that carries the chain, where that lies on the chain's axis
    and the chain points along its z; otherwise it is shifted and turned, which a note says. `load_robot`
    takes such a file, too, and `catheter_sim.catalogue.robot_toml` makes a robot's file of it.

    Args:
        path: of an MJCF file, or a model saved as one.
        name: of the robot; None: the file's.

    Raises:
        InputError: no such file, not MJCF, not a straight chain of hinges, or one that the robot would differ
            from by more than 2 %.

    Warns:
        RobotNote: how far the robot is from the file in MuJoCo, and how its base frame lies in the file's.
    """
    path = Path(path)
    where = str(path)
    if not path.is_file():
        raise InputError(f"{where}: no such file")
    try:
        model = mujoco.MjModel.from_xml_path(where)
    except ValueError as error:
        raise InputError(f"{where}: MuJoCo cannot read it: {error}") from None
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    frame, hinges = hinges_of(model, data, where)
    routed = tendons_of(model, data, frame, hinges, where)
    notes = [note for item in routed for note in item.notes]
    cells, every = _cells(model, data, frame, hinges, routed, notes, where)
    spread = _spread(cells, every, notes)
    segments, numbers = _segments(model, cells, every, routed, notes)
    segments, masses, off_m = _with_masses(model, data, frame, hinges, segments, cells, numbers)
    if off_m > _MASS_SHARE * (cells[-1].high_m - cells[0].low_m):
        notes.append(f"masses: {1e3 * off_m:.2g} mm along the chain from where the file has them, on average")
    servos = [item.stiffness_N_per_m is not None for item in routed]
    if any(servos) != all(servos):
        raise InputError(f"{where}: servos draw some tendons and tensions pull others: all must be alike")
    orders = {tuple(axis for axis in item.stiffness if axis in "xy") for item in hinges}
    if len(hinges) > 1 and len(orders) == 1 and len(orders.pop()) == 2:
        notes.append("two hinges at one place: about x and about y come first in turn, which lessens twist")
    moved = list(notes)
    dynamics = _dynamics(hinges, notes)
    left_out = _left_out(model)
    read = f"read from {path.name}, {len(hinges)} hinges, {len(routed)} tendons"
    robot = ContinuumRobot(
        name=name or path.stem,
        description="",
        segments=segments,
        tendons=tuple(_tendon(item, segments, cells, numbers) for item in routed),
        friction=Friction(mu=0.0),
        dynamics=dynamics,
        actuation="displacement" if servos and all(servos) else "tension",
        links_per_subsegment=every,
        hinges=spread,
        masses=masses,
    )
    check(robot, where)
    measured = compare(
        model, frame, hinges, [item.number for item in routed], robot, cells[0].low_m, cells[-1].high_m,
        [*moved, *(note for note in left_out if note.startswith(_LEFT_OUT))], where,
    )  # fmt: skip
    said = [*measured, _frame_note(model, data, frame, cells[0].low_m)]
    warnings.warn(f"{where}: {'; '.join(said)}", RobotNote, stacklevel=2)
    notes = [*said, *notes, *left_out]
    return ReadChain(replace(robot, description="; ".join([read, *notes])), tuple(notes))


def _cells(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    frame: Frame,
    hinges: Sequence[Hinge],
    routed: Sequence[Routed],
    notes: list[str],
    where: str,
) -> tuple[list[_Cell], int]:
    """Return what is between the disks, from the base to the tip, and how many hinges each cell has."""
    count, places = len(hinges), [item.z_m for item in hinges]
    apart = float(np.mean(np.diff(places))) if count > 1 else max(abs(places[0]), 1e-3)
    same = _SAME_SHARE * apart
    holes = sorted(hole for item in routed for hole in item.holes)
    if not routed:  # a rod: a disk half way between two hinges
        holes = [(k, 0.5 * (places[k - 1] + places[k])) for k in range(1, count)]
    disks: list[tuple[int, float]] = []
    for link, z_m in holes:
        if not disks or disks[-1][0] != link or z_m - disks[-1][1] > same:
            disks.append((link, z_m))
    first_m = disks[0][1] if disks and disks[0][0] == 0 else places[0] - 0.5 * apart
    own = frame.place(data.xpos[frame.base])
    on_axis = float(np.hypot(own[0], own[1])) <= same and first_m - places[-1] <= own[2] <= first_m + same
    base_m = min(float(own[2]), first_m) if on_axis else first_m
    if not disks or disks[0][0] > 0 or disks[0][1] - base_m > same:
        disks.insert(0, (0, base_m))
    tip_m = _tip(model, data, frame, hinges, disks[-1], apart, same, notes)
    if disks[-1][0] < count or tip_m - disks[-1][1] > same:
        disks.append((count, tip_m))
    between = [len(range(low[0], high[0])) for low, high in pairwise(disks)]
    every = max(between)
    if set(between) - {0, every} or not _alike_within(hinges, disks):
        every = 1
        disks = _with_disks_between(disks, places, notes)
    for (_, low), (link, high) in pairwise(disks):
        if high - low <= same:
            raise InputError(
                f"{where}: the holes of link {link} lie {1e3 * (low - high):.3g} mm below those before them: "
                "holes must rise from link to link"
            )
    last = {_nearest(disks, item.holes[-1]) for item in routed}
    for item in routed:
        passed, there = len(item.holes), _nearest(disks, item.holes[-1]) + (item.holes[0][0] == 0)
        if passed < there and any(abs(item.holes[0][1] - low) <= same for _, low in disks[:1]):
            notes.append(f"tendon {item.name}: it passes {passed} of {there} disks, and is led through all")
    return [
        _Cell(low[1], high[1], tuple(hinges[low[0] : high[0]]), k + 1 in last)
        for k, (low, high) in enumerate(pairwise(disks))
    ], every


def _nearest(disks: Sequence[tuple[int, float]], hole: tuple[int, float]) -> int:
    """Return the number of the disk in which a hole is."""
    return min(range(len(disks)), key=lambda k: (abs(disks[k][0] - hole[0]), abs(disks[k][1] - hole[1])))


def _alike_within(hinges: Sequence[Hinge], disks: Sequence[tuple[int, float]]) -> bool:
    """Return whether hinges between two disks are alike."""
    return all(
        _alike(before, after)
        for low, high in pairwise(disks)
        for before, after in pairwise(hinges[low[0] : high[0]])
    )


def _with_disks_between(
    disks: Sequence[tuple[int, float]], places: Sequence[float], notes: list[str]
) -> list[tuple[int, float]]:
    """Return disks, one more half way between two hinges that have none between them."""
    found = [disks[0]]
    for low, high in pairwise(disks):
        found += [(k, 0.5 * (places[k - 1] + places[k])) for k in range(low[0] + 1, high[0])]
        found.append(high)
    added = len(found) - len(disks)
    notes.append(f"tendons are led through {added} more disks between hinges that have no hole between them")
    return found


def _tip(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    frame: Frame,
    hinges: Sequence[Hinge],
    disk: tuple[int, float],
    apart: float,
    same: float,
    notes: list[str],
) -> float:
    """Return the tip's height: of the file's highest site on the axis, the last disk, or a link's end."""
    threaded = set(model.wrap_objid[model.wrap_type == int(mujoco.mjtWrap.mjWRAP_SITE)].tolist())
    heights = []
    for site in range(model.nsite):
        x, y, z = frame.place(data.site_xpos[site])
        carried = hinge_of(model, hinges, int(model.site_bodyid[site])) == len(hinges)
        if carried and site not in threaded and np.hypot(x, y) <= same:
            heights.append(float(z))
    least = disk[1] if disk[0] == len(hinges) else hinges[-1].z_m
    if heights and max(heights) > least - same:
        return max(*heights, least)
    if least > hinges[-1].z_m + same:
        return least
    half = 1.0 if disk[0] == len(hinges) else 0.5  # of a rod's last stretch
    tip_m = hinges[-1].z_m + half * apart
    notes.append(f"tip: {1e3 * half * apart:.3g} mm beyond the last hinge, as no site says where")
    return tip_m


def _segments(
    model: mujoco.MjModel,
    cells: Sequence[_Cell],
    every: int,
    routed: Sequence[Routed],
    notes: list[str],
) -> tuple[tuple[Segment, ...], list[int]]:
    """Return stretches of equal cells, cut where a tendon ends, and the segment's number of each cell."""
    radius_m = _outer_radius(model, routed)
    groups: list[list[_Cell]] = []
    for k, cell in enumerate(cells):
        if k == 0 or cells[k - 1].ends or not _same_cells(groups[-1][0], cell):
            groups.append([])
        groups[-1].append(cell)
    stiff = next(item for item in cells if item.hinges).hinges[0]
    found: list[Segment] = []
    for group in groups:
        length = sum(cell.length_m for cell in group)
        part = [hinge for cell in group for hinge in cell.hinges]
        axes = "".join(axis for axis in "xy" if part and axis in part[0].stiffness)
        bending = len([item for item in found if item.name.startswith("segment_")]) + 1
        each = length / len(group) / every
        if not part:
            place = "base" if group[0] is cells[0] else "tip" if group[-1] is cells[-1] else "stiff"
            place = place if place != "stiff" else f"stiff_{len(found) + 1}"
            found.append(
                Segment(place, _round(length), len(group), _round(radius_m),
                        _round(max(stiff.stiffness.values()) * each), _LEAST_MASS_KG, bending_axes="none")
            )  # fmt: skip
            continue
        main = axes[:1] or "t"
        stiffness = _mean(part, main)
        if axes == "xy" and abs(_mean(part, "y") - stiffness) > _ALIKE * stiffness:
            notes.append(
                f"segment_{bending}: {stiffness:.3g} N m/rad toward x, taken for both, "
                f"{_mean(part, 'y'):.3g} toward y"
            )
        found.append(
            Segment(
                name=f"segment_{bending}",
                length_m=_round(length),
                disks=len(group),
                outer_radius_m=_round(radius_m),
                bending_stiffness_N_m2=_round(stiffness * each),
                mass_kg=_LEAST_MASS_KG,
                bending_axes=axes or "none",
                torsion_stiffness_N_m2=_round(_mean(part, "t") * each)
                if "t" in part[0].stiffness
                else math.inf,
                stiffness_cubic_m2=_round(_cubic(part, main) / stiffness * each**2) if axes else 0.0,
                rest_curvature_x_per_m=_round(_rest(part, "x") / each),
                rest_curvature_y_per_m=_round(_rest(part, "y") / each),
                hinge_share=_share(group) if every == 1 else 0.5,
            )
        )
    return tuple(found), [k for k, group in enumerate(groups) for _ in group]


def _share(group: Sequence[_Cell]) -> float:
    share = float(np.mean([cell.places[0] for cell in group]))
    return 0.5 if abs(share - 0.5) < _SAME_SHARE else _round(share)


def _spread(cells: Sequence[_Cell], every: int, notes: list[str]) -> str:
    """Return how several hinges a cell stand there, "even" or "rod" (`layout.hinge_places`)."""
    if every == 1:
        return "even"
    for name, end in (("even", 0.5 / every), ("rod", 0.5 / (every + 1))):
        wanted = np.linspace(end, 1.0 - end, every)
        if all(np.allclose(cell.places, wanted, atol=_SAME_SHARE) for cell in cells if cell.hinges):
            return name
    notes.append(f"the {every} hinges between two holes are put at even distances")
    return "even"


def _same_cells(one: _Cell, other: _Cell) -> bool:
    """Return whether two cells may be of one segment."""
    if len(one.hinges) != len(other.hinges) or abs(one.length_m / other.length_m - 1.0) > _SAME_SHARE:
        return False
    if not np.allclose(one.places, other.places, atol=_SAME_SHARE):
        return False
    return all(_alike(a, b) for a, b in zip(one.hinges, other.hinges, strict=True))


def _alike(before: Hinge, after: Hinge) -> bool:
    """Return whether two hinges have the same axes, springs and angles at rest."""
    if before.stiffness.keys() != after.stiffness.keys():
        return False
    pairs = ((before.stiffness[axis], after.stiffness[axis]) for axis in before.stiffness)
    bent = all(abs(before.rest[axis] - after.rest[axis]) < 1e-6 for axis in before.rest)
    return bent and all(abs(one - other) <= _ALIKE * max(one, other) for one, other in pairs)


def _mean(part: Sequence[Hinge], axis: str) -> float:
    return float(np.mean([item.stiffness.get(axis, 0.0) for item in part]))


def _rest(part: Sequence[Hinge], axis: str) -> float:
    return float(np.mean([item.rest.get(axis, 0.0) for item in part]))


def _cubic(part: Sequence[Hinge], axis: str) -> float:
    return float(np.mean([item.cubic.get(axis, 0.0) for item in part]))


def _round(value: float) -> float:
    """Return a number without the dust of its arithmetic."""
    return float(f"{value:.9g}")


def _tendon(
    routed: Routed, segments: Sequence[Segment], cells: Sequence[_Cell], numbers: Sequence[int]
) -> Tendon:
    last = min(
        (k for k, cell in enumerate(cells) if cell.ends),
        key=lambda k: abs(cells[k].high_m - routed.holes[-1][1]),
    )
    return Tendon(
        routed.name,
        _round(routed.radius_m),
        _round(routed.angle_rad),
        segments[numbers[last]].name,
        stiffness_N_per_m=math.inf if routed.stiffness_N_per_m is None else routed.stiffness_N_per_m,
    )


def _with_masses(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    frame: Frame,
    hinges: Sequence[Hinge],
    segments: tuple[Segment, ...],
    cells: Sequence[_Cell],
    numbers: Sequence[int],
) -> tuple[tuple[Segment, ...], str, float]:
    """Return segments with masses, where these are, and how far they are off what each hinge carries [m]."""
    own = np.zeros((len(hinges), 2))  # mass [kg], and its moment about the first hinge [kg m]
    for body in range(1, model.nbody):
        link = hinge_of(model, hinges, body)
        if link:
            mass = float(model.body_mass[body])
            own[link - 1] += mass, mass * float(frame.place(data.xipos[body])[2])
    heights = [item.z_m for item in hinges]
    lengths = np.array([segment.length_m for segment in segments])
    tries = []
    for where in ("along", "faces"):
        share = np.zeros((*own.shape, len(segments)))
        link = 0
        for cell, number in zip(cells, numbers, strict=True):
            parts = len(cell.hinges) or 1
            for part in range(parts):
                low, high = (cell.low_m + cell.length_m * (part + k) / parts for k in (0, 1))
                link += bool(cell.hinges)
                carried = [link - 1] if where == "faces" else range(len(hinges))
                for k in carried:
                    if k < 0:
                        continue
                    if where == "faces":
                        length, middle = high - low, high
                    else:
                        end = heights[k + 1] if k + 1 < len(hinges) else cells[-1].high_m
                        bottom, top = max(low, heights[k]), min(high, end)
                        length, middle = max(top - bottom, 0.0), 0.5 * (top + bottom)
                    share[k, :, number] += length / lengths[number] * np.array([1.0, middle])
        mass_kg, _ = nnls(share[:, 0], own[:, 0])
        off = np.abs(share @ mass_kg - own) @ (np.ptp(heights), 1.0)
        tries.append((float(off.sum()), where, mass_kg))
    total = max(float(own[:, 0].sum()), _LEAST_MASS_KG)
    best = min(tries, key=lambda item: round(item[0] / (total * lengths.sum()), 9))
    kept = [
        replace(segment, mass_kg=max(_round(float(mass)), _LEAST_MASS_KG))
        for segment, mass in zip(segments, best[2], strict=True)
    ]
    return tuple(kept), best[1], best[0] / total


def _outer_radius(model: mujoco.MjModel, routed: Sequence[Routed]) -> float:
    kinds = (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_SPHERE)
    moving = model.body_weldid[model.geom_bodyid] > 0
    round_ones = np.isin(model.geom_type, [int(kind) for kind in kinds]) & moving
    sizes = model.geom_size[round_ones, 0]
    holes = _WIDER * max((item.radius_m for item in routed), default=1e-3)
    return float(max(sizes.max(initial=0.0), holes))


def _dynamics(hinges: Sequence[Hinge], notes: list[str]) -> Dynamics:
    """Return the damping as the material's, which acts in motion; rows that are held come to rest as ever."""
    times = [item.damping[axis] / item.stiffness[axis] for item in hinges for axis in item.stiffness]
    time_s = float(np.median(times))
    if max(times) > 0.0:
        notes.append(f"damping: {time_s:.3g} s of the stiffness, as the material's, in motion")
    return Dynamics(damping_time_s=time_s)


def _left_out(model: mujoco.MjModel) -> list[str]:
    gravity = ", ".join(f"{value:g}" for value in model.opt.gravity)
    notes = [
        "inputs are tensions or displacements of the tendons, not the file's controls",
        f"gravity is not a robot's: the file has {gravity} m/s^2",
        "friction.mu = 0: MJCF knows none at holes",
    ]
    for what, there in (
        ("friction of joints", bool(model.dof_frictionloss.any())),
        ("limits of joints", bool(model.jnt_limited.any())),
        ("quadratic terms of springs", _has_terms(model, "jnt_stiffnesspoly")),
        ("plastic springs", _has_terms(model, "jnt_springyield")),
        ("springs of tendons", bool(model.tendon_stiffness.any())),
        ("tendons that couple joints", model.ntendon > 0 and bool((model.wrap_type == 1).any())),
        ("equality constraints", bool(model.neq)),
    ):
        if there:
            notes.append(f"{_LEFT_OUT}: {what}")
    return notes


def _has_terms(model: mujoco.MjModel, name: str) -> bool:
    """Return whether joints have such a term, of several the first; MuJoCo before 4 has none."""
    terms = getattr(model, name, None)
    return terms is not None and bool(np.any(terms[:, 0] if np.ndim(terms) > 1 else terms))


def _frame_note(model: mujoco.MjModel, data: mujoco.MjData, frame: Frame, base_m: float) -> str:
    """Return how the robot's base frame lies in that of the body that carries the chain."""
    own = data.xmat[frame.base].reshape(3, 3)
    shift_m = own.T @ (frame.origin + base_m * frame.axes[:, 2] - data.xpos[frame.base])
    turn = Rotation.from_matrix(own.T @ frame.axes).as_rotvec(degrees=True)
    at_world = not data.xpos[frame.base].any() and np.allclose(own, np.eye(3))
    text = (
        "base = file's" if at_world else f"base = file's (body {model.body(frame.base).name or frame.base})"
    )
    if np.linalg.norm(shift_m) > 1e-6:
        text += f", shifted by ({', '.join(f'{value:g}' for value in (1e3 * shift_m).round(3) + 0.0)}) mm"
    angle = float(np.linalg.norm(turn))
    if angle > 0.01:
        axis = (turn / angle).round(3) + 0.0
        along = np.flatnonzero(np.abs(axis) > 0.999)
        if len(along):
            return f"{text}, turned by {angle * axis[along[0]]:.3g} deg about {'xyz'[along[0]]}"
        return f"{text}, turned by {angle:.3g} deg about ({', '.join(f'{value:g}' for value in axis)})"
    return text
