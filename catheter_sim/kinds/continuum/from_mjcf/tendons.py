"""The tendons of an MJCF chain: where their sites lie, where they end, and what pulls them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.errors import InputError
from catheter_sim.kinds.continuum.from_mjcf.hinges import Frame, Hinge

_ASIDE_SHARE = 0.02  # of a tendon's distance from the axis: holes off by less are in place


@dataclass(frozen=True)
class Routed:
    """A tendon through sites.

    Attributes:
        name: letters, digits and _.
        number: the tendon's in the model.
        radius_m, angle_rad: of its holes about the chain's z.
        holes: the hinge, from 1, that carries each hole, 0 for the base, and its height from the first hinge
            [m]; of the base's the last one alone.
        stiffness_N_per_m: of a position servo that draws it; None: a tension pulls it.
        notes: what is not as a robot's file has it.
    """

    name: str
    number: int
    radius_m: float
    angle_rad: float
    holes: tuple[tuple[int, float], ...]
    stiffness_N_per_m: float | None
    notes: tuple[str, ...]


def tendons_of(
    model: mujoco.MjModel, data: mujoco.MjData, frame: Frame, hinges: Sequence[Hinge], where: str
) -> list[Routed]:
    """Return the chain's spatial tendons.

    Raises:
        InputError: a tendon wraps around geoms, or has no site on the chain.
    """
    found: list[Routed] = []
    for tendon in range(model.ntendon):
        name = _plain(model.tendon(tendon).name or f"tendon_{tendon + 1}")
        first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
        kinds = set(model.wrap_type[first : first + count].tolist())
        if kinds == {int(mujoco.mjtWrap.mjWRAP_JOINT)}:
            continue  # a fixed tendon couples joints; it has no way
        if kinds != {int(mujoco.mjtWrap.mjWRAP_SITE)}:
            raise InputError(f"{where}: tendon {name} does not go from site to site alone: it cannot be read")
        sites = model.wrap_objid[first : first + count].tolist()
        found.append(_routed(model, data, frame, hinges, name, tendon, sites, where))
    return found


def hinge_of(model: mujoco.MjModel, hinges: Sequence[Hinge], body: int) -> int:
    """Return the number, from 1, of the hinge that carries a body; 0: none."""
    number = {hinge.body: k + 1 for k, hinge in enumerate(hinges)}
    while body and body not in number:
        body = int(model.body_parentid[body])
    return number.get(body, 0)


def _routed(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    frame: Frame,
    hinges: Sequence[Hinge],
    name: str,
    tendon: int,
    sites: Sequence[int],
    where: str,
) -> Routed:
    places = np.array([frame.place(data.site_xpos[site]) for site in sites])
    links = [hinge_of(model, hinges, int(model.site_bodyid[site])) for site in sites]
    if not any(links):
        raise InputError(f"{where}: tendon {name} has no site on the chain")
    if links[0] > links[-1]:  # from its end to the base
        places, links = places[::-1], links[::-1]
    if any(links[k + 1] < link for k, link in enumerate(links[:-1])):
        raise InputError(f"{where}: tendon {name} goes to and fro along the chain: it cannot be read")
    begin = max(sum(link == 0 for link in links) - 1, 0)
    places, links = places[begin:], links[begin:]
    notes = [] if links[0] == 0 else [f"tendon {name}: it has no site on the base, and begins there"]
    turn = np.unwrap(np.arctan2(places[:, 1], places[:, 0]))
    radii = np.linalg.norm(places[:, :2], axis=1)
    radius, angle = float(np.median(radii)), float(np.median(turn))
    if radius <= 0.0:
        raise InputError(f"{where}: tendon {name} goes along the axis: it bends nothing")
    off = np.linalg.norm(places[:, :2] - radius * np.array([np.cos(angle), np.sin(angle)]), axis=1)
    if off.max() > _ASIDE_SHARE * radius:
        notes.append(
            f"tendon {name}: holes up to {1e3 * off.max():.3g} mm from their median place, which is taken"
        )
    holes = tuple((link, float(place[2])) for link, place in zip(links, places, strict=True))
    return Routed(
        name, tendon, radius, math.remainder(angle, 2.0 * math.pi), holes,
        _servo_stiffness(model, tendon), tuple(notes),
    )  # fmt: skip


def _servo_stiffness(model: mujoco.MjModel, tendon: int) -> float | None:
    for k in range(model.nu):
        on_it = (
            model.actuator_trntype[k] == mujoco.mjtTrn.mjTRN_TENDON and model.actuator_trnid[k, 0] == tendon
        )
        if on_it and model.actuator_biastype[k] == mujoco.mjtBias.mjBIAS_AFFINE:
            return abs(float(model.actuator_biasprm[k, 1])) * float(model.actuator_gear[k, 0]) ** 2
    return None


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name).strip("_").removeprefix("tendon_") or "tendon"
