"""What a continuum robot is, as a value: frozen data in SI units."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, shown, unknown

# ----------------------------------------------------------------------------------------------------
# What a continuum robot is, as a value: frozen data, SI units, no behaviour.
#
# Geometry. Along +z lie the segments, each cut into `disks` equal subsegments ("cells" where the robot is
# made of cells); a disk stands at the distal end of every subsegment, and one more, fixed, at z = 0. Each
# subsegment bends at `links_per_subsegment` hinges, each of which stands for an equal length of backbone:
# with `hinges` = "even" at the middles of as many equal links, with "rod" moved apart toward the disks, to
# where the chain between two disks shortens with its bend as a rod does (two hinges or more:
# `layout.hinge_places`). A segment of one hinge a subsegment may have it anywhere (`hinge_share`): in the
# plane of the disk beyond, say, as in many chains that were written as MJCF.


@dataclass(frozen=True)
class Segment:
    """A stretch of equal subsegments with one set of tendons fixed at its end."""

    name: str
    length_m: float
    disks: int  # subsegments, each with a disk at its distal end
    outer_radius_m: float  # of the disks or cells
    bending_stiffness_N_m2: float  # EI of the backbone
    mass_kg: float  # whole segment; where it is: `ContinuumRobot.masses`
    bending_axes: str = "xy"  # "x", "y": bends in the xz, yz plane only; "xy": in any direction; "none": not
    torsion_stiffness_N_m2: float = math.inf  # GJ; inf: cannot twist
    axial_stiffness_N: float = math.inf  # EA; inf: cannot stretch; rods' statics only, not the simulation
    shear_stiffness_N: float = math.inf  # GA; inf: cannot shear; the same
    # Elastic law M = EI (k + c3 k^3 + c5 k^5) of the curvature k: c3 [m^2], c5 [m^4].
    stiffness_cubic_m2: float = 0.0
    stiffness_quintic_m4: float = 0.0
    # Beside it a part that yields (Prandtl's element): `plastic_share` times as stiff, it slips where it is
    # bent by more than `yield_curvature_per_m` from where it stands.
    plastic_share: float = 0.0
    yield_curvature_per_m: float = 1.0
    rest_curvature_x_per_m: float = 0.0  # of the unloaded backbone, bending toward +x
    rest_curvature_y_per_m: float = 0.0  # toward +y
    rest_twist_rad_per_m: float = 0.0  # of the tendons' holes about the backbone
    hinge_share: float = 0.5  # where a subsegment's one hinge stands, of its length from the disk before


@dataclass(frozen=True)
class Tendon:
    """A tendon through every disk from the base to the last disk of the segment `ends_at`."""

    name: str
    radius_m: float  # distance of its holes from the backbone
    angle_rad: float  # of its holes about +z, from +x
    ends_at: str  # name of a segment
    channel: str = ""  # tendons with the same channel share its input; "": its own name
    stiffness_N_per_m: float = math.inf  # of the whole tendon and its drive; inf: inextensible
    pretension_N: float = 0.0  # of a displacement-driven tendon at zero displacement, the robot as unloaded
    channel_gain: float = 1.0  # displacement over its channel's; -1: let out as far as the channel is pulled
    slack_m: float = 0.0  # by which a displacement-driven tendon is too long at rest
    # Routing from the base to its end, both evenly along the robot: its distance from the backbone comes to
    # `end_radius_m` (0: stays `radius_m`), and its holes turn about the backbone by `turn_rad`.
    end_radius_m: float = 0.0
    turn_rad: float = 0.0


@dataclass(frozen=True, kw_only=True)
class ContinuumRobot(RobotSpec):
    """A tendon-driven continuum robot; `stiffness_scale` multiplies every stiffness of its backbone."""

    segments: tuple[Segment, ...]
    tendons: tuple[Tendon, ...] = ()  # none: a rod that forces alone bend
    appearance: str = "spacer_disks"  # which meshes: "spacer_disks" or "wire_guides"
    links_per_subsegment: int = 1
    hinges: str = "even"  # where they are in a subsegment: "even" or "rod"
    masses: str = "along"  # spread evenly along each segment, or "faces": each link's at its distal face
    disks_per_segment: int = 0  # 0: as each segment says; otherwise of every segment


# ----------------------------------------------------------------------------------------------------
# A round backbone's stiffness from its material, as a file may state it: Young's modulus and diameter.

MODULUS, DIAMETER, POISSON = "youngs_modulus_GPa", "backbone_diameter_mm", "poisson_ratio"
_BENDING, _TORSION = "bending_stiffness_N_mm2", "torsion_stiffness_N_mm2"
_STIFFEST_GPA = 1200.0  # about diamond's (assumed): beyond any backbone
_MPA_PER_GPA = 1e3


def with_stiffness(document: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return a robot's document with each segment's material replaced by the stiffness that it makes.

    Of a round rod EI = E pi d^4 / 64; with Poisson's ratio nu also GJ = EI / (1 + nu).

    Args:
        document: as a file has it; segments without these keys stay as they are.
        where: the file, for errors.

    Raises:
        InputError: one of modulus and diameter without the other, both beside the stiffness, or no size.
    """
    segments = document.get("segments")
    if not isinstance(segments, list):
        return dict(document)
    return {
        **document,
        "segments": [_segment(part, f"{where}: segments[{k}]") for k, part in enumerate(segments)],
    }


def _segment(part: Any, where: str) -> Any:
    if not isinstance(part, Mapping) or not {MODULUS, DIAMETER, POISSON} & set(part):
        return part
    for key, other in ((MODULUS, DIAMETER), (DIAMETER, MODULUS), (POISSON, MODULUS)):
        if key in part and other not in part:
            near = difflib.get_close_matches(other, [str(name) for name in part], 1, 0.8)
            if near:
                raise unknown("key", near[0], [other], where)
            raise InputError(f"{where}: {key} needs {other} beside it")
    if _BENDING in part:
        raise InputError(f"{where}: {MODULUS} and {DIAMETER} stand for {_BENDING}; leave one of them out")
    modulus, diameter = (_above_zero(part[key], f"{where}.{key}") for key in (MODULUS, DIAMETER))
    if modulus > _STIFFEST_GPA:
        raise InputError(
            f"{where}.{MODULUS} = {modulus:g}: diamond has {_STIFFEST_GPA:g}; is it in MPa? "
            "Nitinol has 30 to 75, steel 200"
        )
    bending = modulus * _MPA_PER_GPA * math.pi * diameter**4 / 64.0
    made = {_BENDING: bending}
    if POISSON in part:
        if _TORSION in part:
            raise InputError(f"{where}: {POISSON} stands for {_TORSION}; leave one of them out")
        ratio = part[POISSON]
        if isinstance(ratio, bool) or not isinstance(ratio, int | float) or not -1.0 < ratio <= 0.5:
            raise InputError(f"{where}.{POISSON}: a number above -1 up to 0.5 is needed, not {shown(ratio)}")
        made[_TORSION] = bending / (1.0 + ratio)
    return {key: value for key, value in part.items() if key not in (MODULUS, DIAMETER, POISSON)} | made


def _above_zero(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
        raise InputError(f"{where}: a number above 0 is needed, not {shown(value)}")
    return float(value)
