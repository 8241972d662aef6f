"""Forms of what gives way along the axis: tendons that stretch, a backbone or a mount that is pressed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import Mount, RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.lab import memory
from catheter_sim.lab.engine import Acting, LabForm, Shapes, shortened
from catheter_sim.lab.forms.hysteresis import bends_joints
from catheter_sim.lab.specimen import Course, Specimen

_PERCENT = 0.01
_SOFTEST_N_PER_M = 600.0


def _displaced(specimen: Specimen) -> bool:
    """Whether lengths of tendons that bend are given: a tension arrives whatever the tendon's length."""
    return not specimen.tensioned and (not specimen.jointed or bends_joints(specimen))


def _bends(acting: Acting) -> np.ndarray:
    """Return which channels bend, by tendons that are stretched, shape (c,)."""
    specimen = acting.specimen
    joints = {item.name: getattr(item, "joint", "bending") for item in specimen.bench.robot.segments}
    return np.array([joints.get(drive.moves, "bending") == "bending" for drive in specimen.drives])


def _compliance(acting: Acting) -> float:
    return acting.size / 100e3  # m/N: 100 N/mm at a size of one


def _softened(acting: Acting, robot: RobotSpec) -> RobotSpec:
    bends = {
        drive.channel for drive, mine in zip(acting.specimen.drives, _bends(acting), strict=True) if mine
    }
    tendons = []
    for tendon in robot.tendons:
        name = getattr(tendon, "channel", "") or tendon.name
        stiffness = _stiffness(1.0 / tendon.stiffness_N_per_m + _compliance(acting))
        tendons.append(replace(tendon, stiffness_N_per_m=stiffness) if name in bends else tendon)
    return replace(robot, tendons=tuple(tendons))


def _stiffness(compliance_m_per_N: float) -> float:
    return 1.0 / compliance_m_per_N if compliance_m_per_N > 0.0 else math.inf


def _lost(acting: Acting, u: Array, share: Array) -> Array:
    """Return `u` less what its pulled tendons are longer by, in shares of `u`'s percents, where they bend."""
    lost = _PERCENT * acting.size * share
    if acting.specimen.jointed:  # a pair: either tendon may be the one that pulls
        return np.where(_bends(acting), memory.slack(u, lost), u)
    return u - lost


def _set(acting: Acting, course: Course, u: Array) -> Array:
    up, down = memory.largest_so_far(u), memory.largest_so_far(-u)
    return _lost(acting, u, np.where(u >= 0.0, up, down) if acting.specimen.jointed else up)


def _bedded(acting: Acting, course: Course, u: Array) -> Array:
    reach = acting.specimen.reach
    up, down = memory.largest_so_far(u), memory.largest_so_far(-u)
    most = np.where(u >= 0.0, up, down) if acting.specimen.jointed else up
    return _lost(acting, u, reach * (1.0 - np.exp(-most / (0.3 * reach))))


def _crept(acting: Acting, course: Course, u: Array) -> Array:
    pulled = u if acting.specimen.jointed else np.maximum(u, 0.0)
    share = np.abs(memory.log_creep(course.time_s, pulled, acting.numbers["shortest_s"]))
    return _lost(acting, u, share)


def _braided(acting: Acting, course: Course, u: Array) -> Array:
    toe = 0.15 * acting.specimen.reach
    pulled = np.abs(u) if acting.specimen.jointed else np.maximum(u, 0.0)
    return _lost(acting, u, acting.specimen.reach * (1.0 - np.exp(-pulled / toe)))


def _mounted(acting: Acting, robot: RobotSpec) -> RobotSpec:
    compliance = _mount_compliance(acting)
    if compliance > 1.0 / _SOFTEST_N_PER_M:
        raise InputError(f"a mount of {1e-3 / compliance:g} N/mm: softer than any mount")
    return replace(robot, mount=Mount(_stiffness(compliance)))


def _mount_compliance(acting: Acting) -> float:
    """In a size of one, 0.1 mm under the largest sum of tensions [m/N]."""
    return acting.size * 1e-4 / acting.scale.pull


def _gives_way(specimen: Specimen) -> bool:
    return specimen.tensioned


def _pressed(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """Each element shortens by the tensions of the tendons that pass it."""
    specimen = acting.specimen
    names = [item.name for item in specimen.bench.robot.segments]
    ends = np.array([names.index(drive.moves) for drive in specimen.drives])
    passes = ends[:, np.newaxis] >= np.array(specimen.segment_of_element)  # (c, n)
    return shortened(shapes, _PERCENT * acting.size * (course.commands @ passes) / acting.scale.pull)


def _rubber(acting: Acting, course: Course, shapes: Shapes) -> Shapes:
    """A rubber seat that has given way once its thickness is used up."""
    share = course.commands.sum(axis=1) / acting.scale.pull
    sunk = acting.size * 1e-4 * (1.0 - np.exp(-share / 0.25))
    return replace(shapes, p=shapes.p - sunk[:, np.newaxis, np.newaxis] * np.array([0.0, 0.0, 1.0]))


FORMS = (
    LabForm(
        cause="tendon_elongation",
        name="spring",
        law="a tendon is longer by T / k",
        applies=_displaced,
        start=5.0,
        most=100e3 / _SOFTEST_N_PER_M,
        robot=_softened,
        parameters=lambda acting: {"stiffness_N_per_mm": 1e-3 / _compliance(acting)},
    ),
    LabForm(
        cause="tendon_elongation",
        name="set",
        law="a tendon stays longer by a share of the most that it has been pulled",
        applies=_displaced,
        start=5.0,
        most=60.0,
        command=_set,
        also=("backlash",),
        parameters=lambda acting: {"set_share": _PERCENT * acting.size},
    ),
    LabForm(
        cause="tendon_elongation",
        name="bedded",
        law="a tendon is longer for good by x (1 - exp(-most u so far / u0)): its ends bed in",
        purpose="tune",
        applies=_displaced,
        start=3.0,
        most=40.0,
        command=_bedded,
        also=("backlash", "actuation_offset"),
    ),
    LabForm(
        cause="tendon_elongation",
        name="creep",
        law="a pulled tendon lengthens by about log(1 + t / t0) (four Kelvin-Voigt elements)",
        purpose="judge",
        learnt=True,
        applies=_displaced,
        draw=lambda specimen, scale, generator: {"shortest_s": float(generator.uniform(1.0, 4.0))},
        start=6.0,
        most=60.0,
        command=_crept,
        also=("drift",),
    ),
    LabForm(
        cause="tendon_elongation",
        name="braid",
        law="a braid gives way at first: longer by x (1 - exp(-u / u0))",
        purpose="judge",
        learnt=True,
        applies=_displaced,
        start=2.0,
        most=40.0,
        command=_braided,
        also=("backlash", "actuation_offset"),
    ),
    LabForm(
        cause="axial_compression",
        name="mount",
        law="the base sinks by the sum of the tensions / k",
        applies=_gives_way,
        start=20.0,
        most=400.0,
        robot=_mounted,
        parameters=lambda acting: {"stiffness_N_per_mm": 1e-3 / _mount_compliance(acting)},
    ),
    LabForm(
        cause="axial_compression",
        name="backbone",
        law="every element shortens by the tensions that pass it, T / EA",
        purpose="tune",
        applies=_gives_way,
        start=3.0,
        most=30.0,
        shape=_pressed,
    ),
    LabForm(
        cause="axial_compression",
        name="rubber",
        law="the base sinks by x (1 - exp(-T / T0)): a rubber seat",
        purpose="judge",
        applies=_gives_way,
        start=15.0,
        most=300.0,
        shape=_rubber,
    ),
)
