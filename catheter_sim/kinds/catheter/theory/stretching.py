"""TE: kinematics of the 4-DoF robot with tendons that stretch (Nayar 2023, Section III), as a static model.

A bending tendon's displacement is Eq. 12 of the angle plus its elongation, strain times length, by
`elongation.SIMPLIFIED`; its tension is what `joint_force` asks for. Between the loading and the
unloading curve the joint holds its angle: the tendon's tension alone changes. Each pair has two
tendons, the other one slack; each has its own history, from new. Torsion and advance are kinematic
(Section IV-B). The joint's force is the measured one, not the robot's bending stiffness.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.static_run import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.drives import drives
from catheter_sim.kinds.catheter.layout import bent_by, moved_segment
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.kinds.catheter.theory.elongation import (
    LARGEST_STRAIN,
    SIMPLIFIED,
    TendonLaw,
    TendonState,
    permanent_set,
    strain_at,
    stretched,
)
from catheter_sim.kinds.catheter.theory.joint_force import (
    DISTAL,
    PROXIMAL,
    JointForce,
    loading_N,
    unloading_N,
)
from catheter_sim.kinds.catheter.theory.mount import require_rigid_mount
from catheter_sim.kinds.catheter.theory.pure import pure_joint, require_unloaded, run_of
from catheter_sim.kinds.catheter.theory.tendons import arm_m, pulled_m

MODEL = "te"


@dataclass(frozen=True)
class Side:
    """One tendon of a bending pair and what it has bent.

    Attributes:
        angle_deg: bend toward this side, >= 0 [deg].
        turn_deg: to which it was last loaded [deg].
        tendon: its history.
    """

    angle_deg: float = 0.0
    turn_deg: float = 0.0
    tendon: TendonState = field(default_factory=TendonState)


@dataclass(frozen=True)
class StretchingJoint:
    """A bending joint with its tendons' length and law and its own force law.

    Attributes:
        segment: the joint.
        length_m: of each tendon.
        force: its tendon's tension over the bend.
        law: of the tendons.
        mu, path_rad: friction of the tendons, and the angle by which they turn before the joint. In the
            joint they turn by half of the bend, in the mean over its gaps.
        elastic_N_m_per_rad: the joint's stiffness where `force` is None: then it is elastic.
    """

    segment: CatheterSegment
    length_m: float
    force: JointForce | None
    law: TendonLaw = SIMPLIFIED
    mu: float = 0.0
    path_rad: float = 0.0
    elastic_N_m_per_rad: float = 0.0

    def on_N(self, angle_deg: float) -> float:
        """Return the tension at the drive that bends the joint further [N]."""
        return self._at_joint_N(angle_deg, None) * self._rubbed(angle_deg)

    def back_N(self, angle_deg: float, turn_deg: float) -> float:
        """Return the tension at the drive at which the joint, let go at `turn_deg`, comes back [N]."""
        return self._at_joint_N(angle_deg, turn_deg) / self._rubbed(angle_deg)

    def _at_joint_N(self, angle_deg: float, turn_deg: float | None) -> float:
        if self.force is None:
            angle = math.radians(angle_deg)
            return self.elastic_N_m_per_rad * angle / float(arm_m(self.segment, angle))
        if turn_deg is None:
            return float(loading_N(self.force, angle_deg))
        return float(unloading_N(self.force, angle_deg, turn_deg))

    def _rubbed(self, angle_deg: float) -> float:
        return math.exp(self.mu * (self.path_rad + 0.5 * math.radians(angle_deg)))


def te(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures with stretching tendons, row after row from new tendons at rest.

    The run's residual is the unbalanced moment of the bending joint that moves, largest of both [N m].

    Args:
        robot: of the 4-DoF design.
        inputs: displacements and advance; no tip force or moment.
        gravity_mps2: none where the robot has a mass, shape (3,) [m/s^2].

    Raises:
        InputError: a load that the model does not have, a tendon without a length or with a stiffness
            of its own, or a displacement out of the range of the joint or of the measured tendon.
    """
    require_unloaded(robot, inputs, gravity_mps2, MODEL)
    require_rigid_mount(robot, MODEL)
    joints = stretching_joints(robot)
    values, residual = [], np.zeros(len(inputs))
    tension = np.zeros((len(inputs), len(robot.tendons)))
    for pair, item in enumerate(robot.tendons):
        if item.name not in joints:
            angle, left = pure_joint(robot, inputs, pair, MODEL)
            values.append(angle)
            continue
        displacement = inputs.tendon[:, pair]
        drawn = np.stack([displacement, -displacement], axis=1)
        angle, tension[:, pair], left = bent_along(
            joints[item.name], drawn, named_rows(inputs, pair, robot, MODEL)
        )
        values.append(angle)
        residual = np.maximum(residual, left)
    return run_of(robot, inputs, gravity_mps2, MODEL, values, residual, tension)


def named_rows(inputs: Inputs, pair: int, robot: CatheterRobot, model: str) -> Callable[[int], str]:
    """Return what names a row and the displacement of a pair in it in a message."""

    def where(row: int) -> str:
        channel = f"{drives(robot, inputs.actuation)[pair].column} = {inputs.tendon[row, pair] * 1e3:g}"
        return f"{row_name(inputs, row)}: static model {model!r}: {channel}"

    return where


def stretching_joints(robot: CatheterRobot) -> dict[str, StretchingJoint]:
    """Return the bending joints of a robot of the 4-DoF design by their pairs' names.

    Raises:
        InputError: a pair has no length, or a stiffness of its own.
    """
    found = {}
    for pair, item in enumerate(robot.tendons):
        if item.name not in bent_by(robot):
            continue
        where = f"{robot.name}: tendons.{item.name}."
        if item.length_m == 0.0:
            raise InputError(f"{where}length_mm = 0: static model {MODEL!r} needs the tendon's length")
        if math.isfinite(item.stiffness_N_per_m):
            shown = f"{item.stiffness_N_per_m * 1e-3:g}"
            raise InputError(
                f"{where}stiffness_N_per_mm = {shown}: static model {MODEL!r} has its own law; must be inf"
            )
        index = moved_segment(robot, pair)
        force = PROXIMAL if index == 0 else DISTAL
        found[item.name] = StretchingJoint(robot.segments[index], item.length_m, force)
    return found


def displaced(joint: StretchingJoint, side: Side, displacement_m: float) -> Side:
    """Return a side after its tendon's displacement has moved straight to `displacement_m`.

    Raises:
        ValueError: the joint would bend beyond its limit, or the tendon stretch beyond what was measured.
    """
    limit = math.degrees(joint.segment.limit_rad)

    def tendon(angle_deg: float) -> TendonState:
        own = displacement_m - float(pulled_m(joint.segment, math.radians(angle_deg)))
        return stretched(joint.law, side.tendon, own / joint.length_m)

    def too_tight(angle_deg: float) -> float:
        return tendon(angle_deg).tension_N - joint.on_N(angle_deg)

    def too_loose(angle_deg: float) -> float:
        state = tendon(angle_deg)
        excess = state.tension_N - joint.back_N(angle_deg, side.turn_deg)
        # where the joint asks for no tension it still follows the tendon, but does not slacken it
        slack = permanent_set(joint.law, state) - state.strain if state.tension_N == 0.0 else 0.0
        return excess - max(slack, 0.0)

    angle, turn = side.angle_deg, side.turn_deg
    if too_tight(angle) > 0.0:
        if too_tight(limit) > 0.0:
            raise ValueError(f"bends beyond its joint's limit of {limit:.4g} deg")
        # the first such angle: where the joint asks for no tension, any further one balances too
        angle = turn = _edge(too_tight, angle, limit, zero_is_low=False)[1]
    elif too_loose(angle) < 0.0:
        angle = _edge(too_loose, 0.0, angle, zero_is_low=True)[0]
    moved = tendon(angle)
    if moved.strain > LARGEST_STRAIN:
        raise ValueError(f"stretches its tendon by more than the measured {100 * LARGEST_STRAIN:.2g} %")
    return Side(angle, turn, moved)


def bent_to(joint: StretchingJoint, side: Side, angle_deg: float) -> tuple[Side, float]:
    """Return a side after it has bent straight to `angle_deg`, and the displacement that takes [m].

    The feedforward of Section IV-A: Eq. 12 plus the elongation.
    """
    if angle_deg >= side.angle_deg:
        turn, tension_N = angle_deg, joint.on_N(angle_deg)
    else:
        turn, tension_N = side.turn_deg, joint.back_N(angle_deg, side.turn_deg)
    strain = strain_at(joint.law, side.tendon, tension_N)
    tendon = stretched(joint.law, side.tendon, strain)
    way = float(pulled_m(joint.segment, math.radians(angle_deg))) + joint.length_m * strain
    return Side(angle_deg, turn, tendon), way


def bent_along(
    joint: StretchingJoint, drawn_m: Array, where: Callable[[int], str], path_rad: Array | None = None
) -> tuple[Array, Array, Array]:
    """Return what a joint does along the ways of its two tendons, from new tendons at rest.

    Args:
        joint: the joint.
        drawn_m: of the tendon toward + and of the one toward -, shape (r, 2) [m].
        where: what to call a row in a message.
        path_rad: of each row, in place of the joint's, shape (r,).

    Returns:
        Angle [rad], the tighter tendon's tension [N] and the moment left over [N m], each of shape (r,).

    Raises:
        InputError: a way to which no angle belongs, or beyond what was measured of the tendon.
    """
    sides = [Side(), Side()]
    angle, tension, left = (np.zeros(len(drawn_m)) for _ in range(3))
    for row, drawn in enumerate(drawn_m):
        if path_rad is not None:
            joint = replace(joint, path_rad=float(path_rad[row]))
        try:
            sides = [displaced(joint, side, float(own)) for side, own in zip(sides, drawn, strict=True)]
        except ValueError as error:
            raise InputError(f"{where(row)}: {error}") from None
        angle[row] = math.radians(sides[0].angle_deg - sides[1].angle_deg)
        tension[row] = max(side.tendon.tension_N for side in sides)
        left[row] = max(_unbalanced_Nm(joint, side) for side in sides)
    return angle, tension, left


def displacement_for_angles_m(joint: StretchingJoint, angle_rad: Array) -> Array:
    """Return the displacements that bend a joint along `angle_rad`, from new tendons, shape (r,) [m]."""
    sides = [Side(), Side()]
    result = np.empty(len(angle_rad))
    pulled = 0  # the side that bends, or bent last
    for row, angle in enumerate(np.degrees(angle_rad)):
        if angle != 0.0:
            pulled = 0 if angle > 0.0 else 1
        ways = []
        for index, sign in enumerate((1.0, -1.0)):
            sides[index], way = bent_to(joint, sides[index], max(sign * float(angle), 0.0))
            ways.append(sign * way)
        result[row] = ways[pulled]
    return result


def _unbalanced_Nm(joint: StretchingJoint, side: Side) -> float:
    """Return by how much the tension lies outside what the joint can hold, as a moment [N m]."""
    high, low = joint.on_N(side.angle_deg), joint.back_N(side.angle_deg, side.turn_deg)
    outside = max(side.tendon.tension_N - high, low - side.tendon.tension_N, 0.0)
    return outside * float(arm_m(joint.segment, math.radians(side.angle_deg)))


def _edge(
    falling: Callable[[float], float], low: float, high: float, zero_is_low: bool
) -> tuple[float, float]:
    """Return the two neighbouring angles [deg] between which a falling function passes zero.

    Where it stays at zero for a while: the end of that stretch if `zero_is_low`, else its beginning.
    """
    for _ in range(60):
        middle = 0.5 * (low + high)
        value = falling(middle)
        if value > 0.0 or (value == 0.0 and zero_is_low):
            low = middle
        else:
            high = middle
    return low, high
