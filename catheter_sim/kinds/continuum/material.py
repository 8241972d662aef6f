"""A round backbone's stiffness from its material, as a file may state it: Young's modulus and diameter."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from typing import Any

from catheter_sim.errors import InputError, shown, unknown

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
