"""A continuum robot from somebody's MJCF: a chain of hinges with tendons becomes a robot of this package.

What MJCF does not say (friction at the holes, what is a segment, what a hinge stands for) is worked out of
places and stiffnesses or assumed, and said in notes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np

from catheter_sim.core.posture import Array
from catheter_sim.core.robot import Dynamics, Friction
from catheter_sim.errors import InputError
from catheter_sim.kinds.continuum.checks import check
from catheter_sim.kinds.continuum.from_mjcf.hinges import Hinge, hinges_of, stretches
from catheter_sim.kinds.continuum.from_mjcf.tendons import Routed, base_m, tendons_of
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Segment, Tendon

_ALIKE = 0.02  # share by which numbers of one segment may differ
_WIDER = 1.25  # than its outermost holes a robot is taken to be, where no geom says


@dataclass(frozen=True)
class ReadChain:
    """A robot that was read.

    Attributes:
        robot: the robot.
        notes: what was assumed, left out or moved, a line each; the robot's description has them, too.
    """

    robot: ContinuumRobot
    notes: tuple[str, ...]


def read_chain(path: Path | str, name: str | None = None) -> ReadChain:
    """Return a chain of hinges with spatial tendons as a continuum robot.

    Its base stands at z = 0 and it points along +z, wherever it stands in the file; it bends toward x about
    the file's y axis, or else about its first hinge's. `load_robot` takes such a file, too, and
    `catheter_sim.catalogue.robot_toml` makes a robot's file of it.

    Args:
        path: of an MJCF file, or a model saved as one.
        name: of the robot; None: the file's.

    Raises:
        InputError: no such file, not MJCF, or not a straight chain of hinges.
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
    frame, hinges = hinges_of(model, data, where)
    lengths = stretches(np.array([item.z_m for item in hinges]), base_m(model, data, frame, hinges), where)
    routed = tendons_of(model, data, frame, hinges, lengths, where)
    notes = [note for item in routed for note in item.notes]
    every = _every(routed, len(hinges), notes)
    segments = _segments(model, hinges, lengths, routed, every, notes, where)
    ends = np.cumsum([item.disks * every for item in segments]).tolist()
    servos = [item.stiffness_N_per_m is not None for item in routed]
    if any(servos) != all(servos):
        raise InputError(f"{where}: servos draw some tendons and tensions pull others: all must be alike")
    dynamics = _dynamics(hinges, notes)
    notes += _left_out(model)
    read = f"read from {path.name}, {len(hinges)} hinges, {len(routed)} tendons"
    robot = ContinuumRobot(
        name=name or path.stem,
        description="; ".join([read, *notes]),
        segments=segments,
        tendons=tuple(_tendon(item, segments, ends) for item in routed),
        friction=Friction(mu=0.0),
        dynamics=dynamics,
        actuation="displacement" if servos and all(servos) else "tension",
        links_per_subsegment=every,
        masses=_masses(model, hinges),
    )
    check(robot, where)
    return ReadChain(robot, tuple(notes))


def _every(routed: Sequence[Routed], count: int, notes: list[str]) -> int:
    """Return after how many links a disk with holes stands."""
    holed = sorted({link for item in routed for link in item.links})
    if not holed:
        return 1
    every = math.gcd(*holed, count)
    for item in routed:
        wanted = tuple(range(every, item.links[-1] + 1, every))
        if item.links != wanted:
            passed = f"{len(item.links)} of {len(wanted)} disks"
            notes.append(f"tendon {item.name}: it passes {passed}, and is led through all")
    return every


def _segments(
    model: mujoco.MjModel,
    hinges: Sequence[Hinge],
    lengths: Array,
    routed: Sequence[Routed],
    every: int,
    notes: list[str],
    where: str,
) -> tuple[Segment, ...]:
    """Return stretches of equal links, cut where a tendon ends or where what bends changes."""
    count = len(hinges)
    cuts = {item.links[-1] for item in routed} | {count}
    for k, (before, after) in enumerate(pairwise(hinges), start=1):
        if not _alike(before, after, lengths[k - 1], lengths[k]):
            cuts.add(k)
    masses = _link_masses(model, hinges)
    radius_m = _outer_radius(model, routed)
    found: list[Segment] = []
    for start, end in pairwise([0, *sorted(cuts)]):
        if (end - start) % every:
            raise InputError(
                f"{where}: what bends changes after link {end}, between two disks ({every} links each)"
            )
        part, length = hinges[start:end], float(lengths[start:end].sum())
        each = length / len(part)
        if "x" not in part[0].stiffness:
            raise InputError(f"{where}: links {start + 1} to {end} do not bend toward x, as others do")
        stiffness = _mean(part, "x")
        axes = "xy" if "y" in part[0].stiffness else "x"
        if axes == "xy" and abs(_mean(part, "y") - stiffness) > _ALIKE * stiffness:
            notes.append(
                f"links {start + 1} to {end}: {stiffness:.3g} N m/rad toward x, taken for both, "
                f"{_mean(part, 'y'):.3g} toward y"
            )
        cubic = float(np.mean([item.cubic.get("x", 0.0) for item in part]))
        found.append(
            Segment(
                name=f"segment_{len(found) + 1}",
                length_m=_round(length),
                disks=(end - start) // every,
                outer_radius_m=_round(radius_m),
                bending_stiffness_N_m2=_round(stiffness * each),
                mass_kg=_round(float(masses[start:end].sum())),
                bending_axes=axes,
                torsion_stiffness_N_m2=_round(_mean(part, "t") * each)
                if "t" in part[0].stiffness
                else math.inf,
                stiffness_cubic_m2=_round(cubic / stiffness * each**2),
                rest_curvature_x_per_m=_round(_rest(part, "x") / each),
                rest_curvature_y_per_m=_round(_rest(part, "y") / each),
            )
        )
    return tuple(found)


def _alike(before: Hinge, after: Hinge, length: float, next_length: float) -> bool:
    if before.stiffness.keys() != after.stiffness.keys() or abs(length / next_length - 1.0) > _ALIKE:
        return False
    pairs = ((before.stiffness[axis], after.stiffness[axis]) for axis in before.stiffness)
    bent = all(abs(before.rest[axis] - after.rest[axis]) < 1e-6 for axis in before.rest)
    return bent and all(abs(one - other) <= _ALIKE * max(one, other) for one, other in pairs)


def _mean(part: Sequence[Hinge], axis: str) -> float:
    return float(np.mean([item.stiffness.get(axis, 0.0) for item in part]))


def _rest(part: Sequence[Hinge], axis: str) -> float:
    return float(np.mean([item.rest.get(axis, 0.0) for item in part]))


def _round(value: float) -> float:
    """Return a number without the dust of its arithmetic."""
    return float(f"{value:.9g}")


def _tendon(routed: Routed, segments: Sequence[Segment], ends: Sequence[int]) -> Tendon:
    return Tendon(
        routed.name,
        _round(routed.radius_m),
        _round(routed.angle_rad),
        segments[ends.index(routed.links[-1])].name,
        stiffness_N_per_m=math.inf if routed.stiffness_N_per_m is None else routed.stiffness_N_per_m,
    )


def _link_masses(model: mujoco.MjModel, hinges: Sequence[Hinge]) -> Array:
    """Return what each hinge's stretch weighs, shape (n,) [kg]."""
    carried = np.array([float(model.body_subtreemass[item.body]) for item in hinges])
    own = carried - np.append(carried[1:], 0.0)
    if _masses(model, hinges) == "along":
        own = _halved(own)
    return own


def _halved(own: Array) -> Array:
    """Return stretches' masses of bodies that have a stretch's far half and the next one's near each."""
    stretch = np.empty_like(own)
    stretch[-1] = 2.0 * own[-1]
    for k in range(len(own) - 2, -1, -1):
        stretch[k] = max(2.0 * (own[k] - stretch[k + 1] / 2.0), 0.0)
    return stretch


def _masses(model: mujoco.MjModel, hinges: Sequence[Hinge]) -> str:
    """Return "along" where the last body is half as heavy as the one before, else "faces"."""
    carried = [float(model.body_subtreemass[item.body]) for item in hinges]
    if len(carried) < 2 or carried[-1] <= 0.0:
        return "faces"
    return "along" if carried[-1] < 0.75 * (carried[-2] - carried[-1]) else "faces"


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
            notes.append(f"left out: {what}")
    return notes


def _has_terms(model: mujoco.MjModel, name: str) -> bool:
    """Return whether joints have such a term, of several the first; MuJoCo before 4 has none."""
    terms = getattr(model, name, None)
    return terms is not None and bool(np.any(terms[:, 0] if np.ndim(terms) > 1 else terms))
