"""The printed closed forms of the tool frame of both mitral catheters, in the papers' base frames.

{base frame} = R_BASE_PAPER {paper's frame}: the papers bend first toward -y, the base frame toward +x.
In the papers' frames the tool's R is Rz(proximal torsion) Rx(bending) Rz(distal torsion) (2022) and
Rx(proximal) Ry(distal) Rz(torsion) (2023); the distal joint's +x is the base frame's +y.

Joint values as in `kinematics`; lengths in m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.mechanics.arcs import arc_functions

# A quarter turn about +z.
R_BASE_PAPER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class TransseptalLengths:
    """Link lengths of Nayar 2022, Fig. 4(b) [m]: `pt`, `bl`, and dt + h."""

    proximal_m: float
    bending_m: float
    end_m: float


@dataclass(frozen=True)
class FourDofLengths:
    """Link lengths of Nayar 2023, Section III-C [m]: b_1, bm, b_2 and e_l = ih + dt + bt."""

    proximal_m: float
    middle_m: float
    distal_m: float
    end_m: float


def transseptal_lengths(robot: CatheterRobot) -> TransseptalLengths:
    """Return the lengths of a robot of the design `catheter_layout.TRANSSEPTAL`."""
    torsion, bending, advance, holder = (segment.length_m for segment in robot.segments)
    return TransseptalLengths(torsion, bending, advance + holder)


def four_dof_lengths(robot: CatheterRobot) -> FourDofLengths:
    """Return the lengths of a robot of the design `catheter_layout.FOUR_DOF`."""
    proximal, middle, distal, tip, advance, torsion = (segment.length_m for segment in robot.segments)
    return FourDofLengths(proximal, middle, distal, tip + advance + torsion)


def transseptal_tool(lengths: TransseptalLengths, q: Array) -> tuple[Array, Array]:
    """Return the tool of the transseptal robot (Nayar 2022, Eqs 14-15), paper's frame.

    Args:
        lengths: of the links.
        q: proximal torsion, bending, advance, distal torsion, shape (..., 4).

    Returns:
        Position, shape (..., 3), and R, shape (..., 3, 3).
    """
    p, b, advance, d = np.moveaxis(q, -1, 0)
    cp, sp, cb, sb, cd, sd = np.cos(p), np.sin(p), np.cos(b), np.sin(b), np.cos(d), np.sin(d)
    R = _matrix(
        (cd * cp - cb * sd * sp, -cp * sd - cd * cb * sp, sb * sp),
        (cd * sp + cb * cp * sd, cd * cp * cb - sd * sp, -sb * cp),
        (sb * sd, sb * cd, cb),
    )
    sine, versine = arc_functions(b * b)  # sin(b) / b and (1 - cos b) / b^2
    end = lengths.end_m + advance
    radial = lengths.bending_m * versine * b + sb * end
    height = lengths.proximal_m + cb * end + lengths.bending_m * sine
    return np.stack([radial * sp, -radial * cp, height], axis=-1), R


def four_dof_tool(lengths: FourDofLengths, q: Array) -> tuple[Array, Array]:
    """Return the tool of the 4-DoF robot (Nayar 2023, Eqs 6-7, corrected), paper's frame.

    Corrections: the third row of R has c_t s_pb + s_db c_pb s_t in the middle; p_y is
    -[s_pb (bm + c_db (e_l + delta)) + b_2 s_db s_pb / theta_db + b_1 (1 - c_pb) / theta_pb].

    Args:
        lengths: of the links.
        q: proximal bending, distal bending, advance, torsion, shape (..., 4).

    Returns:
        Position, shape (..., 3), and R, shape (..., 3, 3).
    """
    pb, db, advance, t = np.moveaxis(q, -1, 0)
    cp, sp, cd, sd, ct, st = np.cos(pb), np.sin(pb), np.cos(db), np.sin(db), np.cos(t), np.sin(t)
    R = _matrix(
        (ct * cd, -st * cd, sd),
        (st * cp + sd * sp * ct, ct * cp - sd * sp * st, -sp * cd),
        (st * sp - sd * cp * ct, ct * sp + sd * cp * st, cp * cd),
    )
    sine_d, versine_d = arc_functions(db * db)
    sine_p, versine_p = arc_functions(pb * pb)
    end = lengths.end_m + advance
    straight = lengths.middle_m + cd * end + lengths.distal_m * sine_d
    x = sd * end + lengths.distal_m * versine_d * db
    y = -(sp * straight + lengths.proximal_m * versine_p * pb)
    z = cp * straight + lengths.proximal_m * sine_p
    return np.stack([x, y, z], axis=-1), R


def four_dof_tool_as_printed(lengths: FourDofLengths, q: Array) -> tuple[Array, Array]:
    """Return Eqs 6-7 of Nayar 2023 as printed; arguments and result as of `four_dof_tool`.

    The third row of R is not of unit length, and p_y neither points where R does nor stays finite at
    theta_pb = 0. For comparison only.
    """
    pb, db, advance, t = np.moveaxis(q, -1, 0)
    cp, sp, cd, sd, ct, st = np.cos(pb), np.sin(pb), np.cos(db), np.sin(db), np.cos(t), np.sin(t)
    position, R = four_dof_tool(lengths, q)
    R, position = R.copy(), position.copy()
    R[..., 2, 1] = ct * sp - sd * cp * st
    end = lengths.end_m + advance
    position[..., 1] = (
        sp * (lengths.middle_m + cd * end)
        + lengths.distal_m * sd * sp / db
        - lengths.proximal_m * (1.0 + cp) / pb
    )
    return position, R


def in_base_frame(position: Array, R: Array) -> tuple[Array, Array]:
    """Return a paper's position (..., 3) and R (..., 3, 3) in the base frame."""
    return position @ R_BASE_PAPER.T, R_BASE_PAPER @ R @ R_BASE_PAPER.T


def in_paper_frame(position: Array, R: Array) -> tuple[Array, Array]:
    """Return a position (..., 3) and R (..., 3, 3) of the base frame in a paper's."""
    return position @ R_BASE_PAPER, R_BASE_PAPER.T @ R @ R_BASE_PAPER


def _matrix(*rows: tuple[Array, ...]) -> Array:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
