"""Pure kinematics (PK) as a static model: displacements to angles, angles to the tool.

Nayar 2022, Eqs 5, 7, 15; Nayar 2023, Eqs 7, 12-13. Inextensible, taut tendons, a rigid mount and drives
without play, unless the robot's say otherwise; play is the only history. Friction, a tendon's own law and a
joint's measured resistance are `balance`'s.

A bending pair's tension balances the joint's elastic moment at the tendons' arm in the straight joint,
K |theta - rest| / a_b. The arm at the angle, `tendons.arm_m`, is up to 2.3 % larger within 120 deg (2022
robot). Torsion joints turn freely, so their pairs carry none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.posture import Posture
from catheter_sim.core.static_run import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.drives import drives
from catheter_sim.kinds.catheter.layout import hinge_counts, joint_stiffness, moved_segment, moving
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.kinds.catheter.theory.drive import arriving_m
from catheter_sim.kinds.catheter.theory.kinematics import element_frames
from catheter_sim.kinds.catheter.theory.mount import eased_m, require_springs, sunk_by
from catheter_sim.kinds.catheter.theory.tendons import elastic_angle_rad, largest_angle_rad, pulled_m

MODEL = "pk"


def pk(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures by pure kinematics; without play every row stands alone.

    The run's residual is a displacement here: what the angles' displacement differs by from the
    input's, the largest of the pairs [m].

    Args:
        robot: a catheter.
        inputs: displacements and advance; no tip force or moment.
        gravity_mps2: none where the robot has a mass, shape (3,) [m/s^2].

    Raises:
        InputError: a load that the model does not have, or a displacement beyond the joint's range.
    """
    require_unloaded(robot, inputs, gravity_mps2, MODEL)
    columns, residual, sunk_m = [], np.zeros(len(inputs)), sunk_along(robot, inputs, MODEL)
    for pair in range(len(robot.tendons)):
        values, left = pure_joint(robot, inputs, pair, MODEL, sunk_m)
        columns.append(values)
        residual = np.maximum(residual, left)
    return run_of(robot, inputs, gravity_mps2, MODEL, columns, residual, sunk_m=sunk_m)


def sunk_along(robot: CatheterRobot, inputs: Inputs, model: str) -> Array:
    """Return how far the mount gives way at each row, shape (r,) [m]; NaN where a joint is beyond its range.

    Raises:
        InputError: it gives way, and something about the tendons is not known to give way with it.
    """
    require_springs(robot, model)
    drawn = [arriving_m(item, inputs.tendon[:, pair]) for pair, item in enumerate(robot.tendons)]
    return sunk_by(robot, np.stack(drawn, axis=-1))


def pure_joint(
    robot: CatheterRobot, inputs: Inputs, pair: int, model: str, sunk_m: Array | float = 0.0
) -> tuple[Array, Array]:
    """Return the value of the joint that a pair moves, and the displacement left over, per row.

    Args:
        robot, inputs, pair, model: whose, and along what.
        sunk_m: how far the mount has given way, shape (r,) [m].

    Returns:
        Angle [rad] or advance [m], shape (r,), and |displacement left over|, shape (r,) [m].

    Raises:
        InputError: a displacement to which no angle belongs.
    """
    segment = robot.segments[moved_segment(robot, pair)]
    displacement = arriving_m(robot.tendons[pair], inputs.tendon[:, pair])
    if segment.joint == "prismatic":
        return displacement, np.zeros(len(inputs))
    compliance_m = 0.0
    if segment.joint == "bending":
        displacement = eased_m(displacement, sunk_m)
        compliance_m = _tension_N_per_rad(robot, segment) / robot.tendons[pair].stiffness_N_per_m
    angle = elastic_angle_rad(segment, displacement, compliance_m)
    if np.isnan(angle).any():
        raise beyond(robot, inputs, int(np.argmax(np.isnan(angle))), pair, segment, model)
    stretch = compliance_m * (angle - segment.rest_rad)
    return angle, np.abs(pulled_m(segment, angle) + stretch - displacement)


def beyond(
    robot: CatheterRobot, inputs: Inputs, row: int, pair: int, segment: CatheterSegment, model: str
) -> InputError:
    """Return the error for a displacement to which no angle of the joint belongs."""
    name = f"{drives(robot, inputs.actuation)[pair].column} = {inputs.tendon[row, pair] * 1e3:g}"
    reach = f"beyond the range of its joint, which ends at {math.degrees(largest_angle_rad(segment)):.4g} deg"
    return InputError(f"{row_name(inputs, row)}: static model {model!r}: {name}: {reach}")


def require_unloaded(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array, model: str) -> None:
    """Raise `InputError` where something acts that a kinematic model does not know."""
    weighs = any(segment.mass_kg > 0.0 for segment in robot.segments)
    if weighs and np.any(np.asarray(gravity_mps2)):
        raise InputError(f"static model {model!r}: has no weight, so gravity or the masses must be 0")
    loaded = inputs.force_tip.any(axis=1) | inputs.moment_tip.any(axis=1)
    if loaded.any():
        row = row_name(inputs, int(np.argmax(loaded)))
        raise InputError(f"{row}: static model {model!r}: has no tip force or moment; it is kinematic")


def run_of(
    robot: CatheterRobot,
    inputs: Inputs,
    gravity_mps2: Array,
    model: str,
    values: Sequence[Array],
    residual: Array,
    tension_N: Array | None = None,
    sunk_m: Array | float = 0.0,
) -> StaticRun:
    """Return the run of a kinematic model.

    Args:
        robot, inputs, gravity_mps2, model: as they were given.
        values: of the joint that each pair moves, each of shape (r,) [rad or m].
        residual: shape (r,).
        tension_N: of each pair, shape (r, t) [N]; default: the elastic moment's.
        sunk_m: how far the base has sunk along -z, shape (r,) [m].
    """
    q = joint_vector(robot, np.stack(values, axis=-1))
    p_w, R_w = element_frames(robot, q)
    p_w[..., 2] -= np.broadcast_to(sunk_m, len(p_w))[:, np.newaxis]
    if tension_N is None:
        tension_N = np.stack([elastic_tension_N(robot, k, value) for k, value in enumerate(values)], axis=-1)
    angles = hinge_angles(robot, q)
    inside = np.full((len(robot.tendons), p_w.shape[1]), np.nan)
    postures = tuple(
        Posture(p_w[row], R_w[row], angles[row], tension_N[row], inside) for row in range(len(inputs))
    )
    return StaticRun(model, inputs, np.asarray(gravity_mps2, dtype=float), postures, residual)


def elastic_tension_N(robot: CatheterRobot, pair: int, value: Array) -> Array:
    """Return the pulled tendon's tension at a joint value, same shape [N]; 0 of torsion and advance."""
    segment = robot.segments[moved_segment(robot, pair)]
    if segment.joint != "bending":
        return np.zeros(value.shape)
    return _tension_N_per_rad(robot, segment) * np.abs(value - segment.rest_rad)


def _tension_N_per_rad(robot: CatheterRobot, segment: CatheterSegment) -> float:
    return joint_stiffness(robot, segment) / segment.arm_m


def joint_vector(robot: CatheterRobot, values: Array) -> Array:
    """Return the pairs' values (..., t) in the order of the joints, base to tip, shape (..., m)."""
    pair_of = {moved_segment(robot, pair): pair for pair in range(len(robot.tendons))}
    return values[..., [pair_of[index] for index in moving(robot)]]


def hinge_angles(robot: CatheterRobot, q: Array) -> Array:
    """Return every hinge's angle at joint values q (..., m), shape (..., hinges) [rad].

    The gaps of a bending joint share its bend.
    """
    turns = [k for k, index in enumerate(moving(robot)) if robot.segments[index].joint != "prismatic"]
    counts = hinge_counts(robot)
    return np.repeat(q[..., turns] / np.array(counts), counts, axis=-1)
