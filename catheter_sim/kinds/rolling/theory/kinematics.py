"""Where the links of a rolling-joint robot are, from its joints' angles; whole batches at once.

A link's frame has its z axis on the robot's axis and its origin at the height of its joint's line at
rest, so that the link's flat top is at z = link_length. Leading dimensions of `theta` are the batch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory import joint as geometry
from catheter_sim.kinds.rolling.theory.chain import RollingChain


@dataclass(frozen=True)
class Frames:
    """The links' frames, and the joints' contacts, in the base frame.

    Attributes:
        R_w: of the links, shape (..., n, 3, 3).
        origin: of the links' frames, shape (..., n, 3) [m].
        face: centres of the links' flat tops, shape (..., n, 3) [m].
        below_R_w: of the flat on which joint k rolls: link k - 1's, or the base's, (..., n, 3, 3).
        below_face: centre of that flat, shape (..., n, 3) [m].
        contact: on the joint's own plane, shape (..., n, 3) [m].
        along: unit vector of the bending direction on the flat below, shape (..., n, 3).
        axis: unit vector about which the joint turns toward it, shape (..., n, 3).
    """

    R_w: Array
    origin: Array
    face: Array
    below_R_w: Array
    below_face: Array
    contact: Array
    along: Array
    axis: Array


def frames(chain: RollingChain, theta: Array, link_length: Array | None = None) -> Frames:
    """Return the frames of the links at the bend angles `theta`, shape (..., n) [rad].

    Args:
        chain: the robot.
        theta: bend angles, shape (..., n) [rad].
        link_length: of the links as compressed, shape (..., n) [m]; default: their own.
    """
    batch = theta.shape[:-1]
    length = np.broadcast_to(chain.link_length if link_length is None else link_length, theta.shape)
    radius = geometry.active_radius(theta, chain.radius_positive, chain.radius_negative)
    across, rise = geometry.line_position(theta, radius)
    turn_w = _turns(chain, theta)
    R = np.broadcast_to(np.eye(3), (*batch, 3, 3))
    face = np.zeros((*batch, 3))
    steps: list[tuple[Array, ...]] = []
    for k in range(chain.joints):
        below, below_face = R, face
        along, normal = below[..., :, chain.axis[k]], below[..., :, 2]
        contact = face + (chain.line[k] + radius[..., k] * theta[..., k])[..., None] * along
        line = face + (chain.line[k] + across[..., k])[..., None] * along + rise[..., k][..., None] * normal
        R = below @ turn_w[..., k, :, :]
        origin = line - chain.line[k] * R[..., :, chain.axis[k]]
        face = origin + length[..., k][..., None] * R[..., :, 2]
        axis = below[..., :, 1] if chain.axis[k] == 0 else -below[..., :, 0]
        steps.append((R, origin, face, below, below_face, contact, along, axis))
    columns = list(zip(*steps, strict=True))
    return Frames(
        R_w=np.stack(columns[0], axis=-3),
        origin=np.stack(columns[1], axis=-2),
        face=np.stack(columns[2], axis=-2),
        below_R_w=np.stack(columns[3], axis=-3),
        below_face=np.stack(columns[4], axis=-2),
        contact=np.stack(columns[5], axis=-2),
        along=np.stack(columns[6], axis=-2),
        axis=np.stack(columns[7], axis=-2),
    )


def _turns(chain: RollingChain, theta: Array) -> Array:
    """Return each joint's rotation from the frame below to the link's, shape (..., n, 3, 3)."""
    cosine, sine = np.cos(theta), np.sin(theta)
    result = np.zeros((*theta.shape, 3, 3))
    toward_x = chain.axis == 0
    # Toward +x the joint turns about +y, toward +y about -x; both turn z toward the bending direction.
    for i, here in ((0, toward_x), (1, ~toward_x)):
        other = 1 - i
        result[..., here, i, i] = cosine[..., here]
        result[..., here, i, 2] = sine[..., here]
        result[..., here, 2, i] = -sine[..., here]
        result[..., here, 2, 2] = cosine[..., here]
        result[..., here, other, other] = 1.0
    return result
