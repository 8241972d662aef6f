"""What acts on the links of a rolling-joint robot besides its rods: weight, tip load, other forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.loads import LinkForce, check_links
from catheter_sim.errors import InputError
from catheter_sim.kinds.rolling.theory.chain import RollingChain
from catheter_sim.kinds.rolling.theory.kinematics import Frames


@dataclass(frozen=True)
class Loads:
    """Forces at points of links, and a moment on the last link, all steady in the base frame.

    Attributes:
        link: index of the link, from 0, shape (p,).
        point: in the link's frame, shape (p, 3) [m].
        force: in the base frame, shape (p, 3) [N].
        tip_moment: in the base frame, shape (3,) [N m].
        tip: which of the forces acts on the tip.
    """

    link: np.ndarray
    point: Array
    force: Array
    tip_moment: Array
    tip: int


def loads(
    chain: RollingChain,
    gravity_mps2: Array,
    force_tip: Array | None = None,
    moment_tip: Array | None = None,
    others: Sequence[LinkForce] = (),
) -> Loads:
    """Return the weight of every link, the tip's load and `others`.

    Args:
        chain: the robot.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        force_tip: on the centre of the last link's top, base frame, shape (3,) [N].
        moment_tip: on the last link, base frame, shape (3,) [N m].
        others: further forces.

    Raises:
        InputError: a link that the robot does not have, or a moment on one.
    """
    n = chain.joints
    check_links(others, n)
    for item in others:
        if any(item.moment_Nm):
            raise InputError(
                f"moment on link {item.link}: statics of rolling joints take one at the tip only"
            )
    centres = np.zeros((n, 3))
    centres[:, 2] = chain.mass_height
    link = np.concatenate([np.arange(n), [n - 1], np.array([item.link - 1 for item in others], dtype=int)])
    tip = np.array([[0.0, 0.0, chain.link_length[-1]]])
    tops = [(0.0, 0.0, float(chain.link_length[item.link - 1])) for item in others]
    places = [item.point_m or top for item, top in zip(others, tops, strict=True)]
    point = np.concatenate([centres, tip, np.array(places).reshape(-1, 3)])
    force = np.concatenate(
        [
            chain.mass[:, None] * np.asarray(gravity_mps2, dtype=float)[None, :],
            np.zeros((1, 3)) if force_tip is None else np.asarray(force_tip, dtype=float)[None, :],
            np.array([item.force_N for item in others], dtype=float).reshape(-1, 3),
        ]
    )
    order = np.argsort(link, kind="stable")
    moment = np.zeros(3) if moment_tip is None else np.asarray(moment_tip, dtype=float)
    return Loads(link[order], point[order], force[order], moment, int(np.flatnonzero(order == n)[0]))


def load_points(links: Frames, acting: Loads) -> Array:
    """Return where the forces act in the base frame, shape (..., p, 3) [m]."""
    origin = links.origin[..., acting.link, :]
    R = links.R_w[..., acting.link, :, :]
    return origin + np.einsum("...pij,pj->...pi", R, acting.point)
