"""The static models of catheters: the list, and the joints' balance with all that was measured."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.statics import StaticModel, StaticRun, unless
from catheter_sim.errors import InputError
from catheter_sim.mechanics.hysteresis import play
from catheter_sim.robots.catheter.description import (
    bent_by,
    is_extensible,
    is_four_dof,
    is_transseptal,
    joint_stiffness,
    moved_segment,
    pair_beside_springs,
)
from catheter_sim.robots.catheter.kinematics import (
    arm_m,
    arriving_m,
    beyond,
    channel_at,
    largest_angle_rad,
    pk,
    pulled_m,
    pure_joint,
    run_of,
    sunk_along,
)
from catheter_sim.robots.catheter.loaded import Unloaded, loaded_rows, require_no_law, under_load, yielded
from catheter_sim.robots.catheter.measured import (
    LAWS,
    PRINTED,
    StretchingJoint,
    bent_along,
    hybrid,
    mk,
    pi,
    te,
)
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment

# ----------------------------------------------------------------------------------------------------
# The joints' balance, with all that a catheter's tendons and joints were measured to do, as a static model.
#
# Beyond `pure`, of robots on a rigid mount: capstan friction of a bending joint's tendons, tendons that
# stretch by Nayar 2023, Algorithm 1, and joints that resist by its Algorithm 2; of springs, which may rub,
# loads on the tip and weight (`loaded`). A bending joint keeps its angle as long as the tension at its
# drive lies between the one that bends it further and the one at which it comes back.
#
# Friction is that of a whole joint: its tendon turns by the path before it, by the bends of the joints that
# it passes, and in the joint by half of its bend, in the mean over its gaps. The simulation has it gap by
# gap; the difference is of second order in the friction coefficient times the turn.

MODEL = "balance"
_HALVINGS = 60  # of the range of a joint: to its last bit


def balance(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures in balance, row after row from rest; without history where nothing has one.

    The run's residual is in the unit of `pure` or, of a joint with laws of its own, a moment [N m].

    Raises:
        InputError: a displacement out of range, a load under which no balance is found, or what the model
            cannot combine: some laws, and a load beside a law that was measured.
    """
    rows = loaded_rows(robot, inputs, gravity_mps2)
    require_no_law(robot, inputs, rows, MODEL)
    sunk_m = sunk_along(robot, inputs, MODEL)
    values, tension, residual = balanced_joints(robot, inputs, sunk_m)
    run = run_of(robot, inputs, gravity_mps2, MODEL, list(values.T), residual, tension, sunk_m)
    if not len(rows):
        return run
    there = values[rows], tension[rows], sunk_m[rows]
    return under_load(run, rows, yielded(Unloaded(robot, inputs, rows, *there), gravity_mps2))


def balanced_joints(
    robot: CatheterRobot, inputs: Inputs, sunk_m: Array | float = 0.0
) -> tuple[Array, Array, Array]:
    """Return what the joint of each pair does along `inputs`, without any load.

    The mount has given way by `sunk_m` (r,) [m], not beside joints with laws of their own. Returns angles
    [rad] and advances [m] (r, t), tensions (r, t) [N], and the run's residual (r,).

    Raises:
        InputError: as `balance`.
    """
    rows = len(inputs)
    values, tension = np.zeros((rows, len(robot.tendons))), np.zeros((rows, len(robot.tendons)))
    residual = np.zeros(rows)
    bending = [pair for pair, item in enumerate(robot.tendons) if item.name in bent_by(robot)]
    # A joint's tendons turn with the joints before it, so these come first.
    for pair in sorted(range(len(robot.tendons)), key=lambda pair: moved_segment(robot, pair)):
        segment = robot.segments[moved_segment(robot, pair)]
        if pair not in bending or not _has_history(robot, pair):
            values[:, pair], left = pure_joint(robot, inputs, pair, MODEL, sunk_m)
            if pair in bending:
                moment = joint_stiffness(robot, segment) * np.abs(values[:, pair] - segment.rest_rad)
                tension[:, pair] = moment / arm_m(segment, values[:, pair])
        else:
            passed = [k for k in bending if moved_segment(robot, k) < moved_segment(robot, pair)]
            path = robot.path_rad + np.abs(values[:, passed]).sum(axis=1)
            values[:, pair], tension[:, pair], left = _balanced(robot, inputs, pair, path)
        residual = np.maximum(residual, left)
    return values, tension, residual


def has_laws(robot: CatheterRobot) -> bool:
    """Return whether `pure` does not know all of what this robot's joints and tendons do."""
    bending = (pair for pair, item in enumerate(robot.tendons) if item.name in bent_by(robot))
    return any(_has_history(robot, pair) for pair in bending)


def _has_history(robot: CatheterRobot, pair: int) -> bool:
    """Return whether a bending pair's joint rubs, stretches or resists by more than springs."""
    item, segment = robot.tendons[pair], robot.segments[moved_segment(robot, pair)]
    # Inextensible tendons that rub move their joint as those that do not.
    return is_extensible(item) and bool(pair_beside_springs(robot, item, segment))


def _balanced(robot: CatheterRobot, inputs: Inputs, pair: int, path: Array) -> tuple[Array, Array, Array]:
    """Return angle [rad], tension at the drive [N] and what is left over of a bending joint, each (r,)."""
    item, segment = robot.tendons[pair], robot.segments[moved_segment(robot, pair)]
    if item.law == "linear" and segment.resistance == "elastic":
        return _sprung(robot, inputs, pair, path)
    where = f"{robot.name}: tendons.{item.name}"
    if item.law == "linear" or math.isfinite(item.stiffness_N_per_m):
        raise InputError(
            f"{where}: static model {MODEL!r} combines a measured resistance with law 'uhmwpe' only, "
            "and that with no stiffness besides"
        )
    if segment.rest_rad != 0.0:
        raise InputError(
            f"{where}: static model {MODEL!r} knows law 'uhmwpe' for joints straight at rest only"
        )
    joint = StretchingJoint(
        segment,
        item.length_m,
        LAWS.get(segment.resistance),
        PRINTED,
        mu=robot.friction.mu,
        elastic_N_m_per_rad=joint_stiffness(robot, segment),
    )
    displacement = inputs.tendon[:, pair]
    played = play(displacement[:, np.newaxis], item.play_m)[:, 0]
    drawn = np.stack([played, -played], axis=1) - item.slack_m
    return bent_along(joint, drawn, partial(channel_at, robot, inputs, pair, MODEL), path)


def _sprung(robot: CatheterRobot, inputs: Inputs, pair: int, path: Array) -> tuple[Array, Array, Array]:
    """Return the same for springs and friction, what is left over in N m: as in a play, between two branches.

    With the drawn way d, the tendon's stiffness k and the joint's K, friction exp(-+ mu turn) gives

        k (d - l(theta)) = K |theta - rest| / arm * exp(+- mu (path + |theta| / 2)),

    + where the joint is bent further, - where it comes back.
    """
    item, segment = robot.tendons[pair], robot.segments[moved_segment(robot, pair)]
    drawn = arriving_m(item, inputs.tendon[:, pair])
    branches = [_branch(robot, pair, segment, drawn, path, sign) for sign in (1.0, -1.0)]
    if np.isnan(branches).any():
        row = int(np.argmax(np.isnan(branches).any(axis=0)))
        raise beyond(robot, inputs, row, pair, segment, MODEL)
    low, high = np.minimum(*branches), np.maximum(*branches)
    angle, now = np.empty(len(drawn)), segment.rest_rad
    for row, (least, most) in enumerate(zip(low, high, strict=True)):
        angle[row] = now = min(max(now, least), most)
    stretch = np.abs(drawn) - np.abs(pulled_m(segment, angle))
    tension = np.maximum(item.stiffness_N_per_m * stretch, 0.0)
    # The moment beyond what friction can hold, from the tension and the angle alone [N m].
    needed = joint_stiffness(robot, segment) * np.abs(angle - segment.rest_rad)
    rubbed = np.exp(robot.friction.mu * (path + 0.5 * np.abs(angle)))
    given = tension * arm_m(segment, angle)
    left = np.maximum(np.maximum(needed - given * rubbed, given / rubbed - needed), 0.0)
    return angle, tension, left


def _branch(
    robot: CatheterRobot, pair: int, segment: CatheterSegment, drawn: Array, path: Array, sign: float
) -> Array:
    """Return the angle at which a joint slips, out (sign 1) or back (-1), shape (r,) [rad]; NaN: none."""
    side = np.copysign(1.0, drawn)
    stiffness, joint = robot.tendons[pair].stiffness_N_per_m, joint_stiffness(robot, segment)

    def excess(turn: Array) -> Array:
        """Return by how much the tendon is too tight at a turn from rest toward the drawn side."""
        angle = segment.rest_rad + side * turn
        rubbed = np.exp(sign * robot.friction.mu * (path + 0.5 * np.abs(angle)))
        needed = joint * turn / arm_m(segment, angle) * rubbed
        tight: Array = stiffness * (np.abs(drawn) - np.abs(pulled_m(segment, angle))) - needed
        return tight

    low = np.zeros(len(drawn))
    high = largest_angle_rad(segment) - side * segment.rest_rad
    none = excess(high) > 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        tight = excess(middle) > 0.0
        low, high = np.where(tight, middle, low), np.where(tight, high, middle)
    return np.where(none, np.nan, segment.rest_rad + side * low)


# ----------------------------------------------------------------------------------------------------
# The static models of catheters of torsion, bending and prismatic joints, driven by displacement.

_OF_2022 = unless(is_transseptal, "other joints than those of Nayar 2022")
_OF_2023 = unless(is_four_dof, "other joints than those of Nayar 2023")

MODELS: tuple[StaticModel[CatheterRobot], ...] = (
    StaticModel(
        "pk",
        "pure kinematics (Nayar 2022, Eqs 3-15; 2023, Eqs 7, 12-13), no friction, no weight, no tip load",
        pk,
    ),
    StaticModel(
        "balance",
        "pk with the joints' balance: friction, measured laws (Nayar 2023), history; springs under load",
        balance,
    ),
    StaticModel(
        "mk",
        "modified kinematics: measured dead-bands of all joints (Nayar 2022, Eqs 23-28), displacement >= 0",
        mk,
        _OF_2022,
    ),
    StaticModel(
        "pi",
        "Prandtl-Ishlinskii models (Nayar 2022, Eqs 29-34), weights from the MK loops: none are printed",
        pi,
        _OF_2022,
    ),
    StaticModel(
        "hybrid",
        "mk for the bending joint, pi for the torsion joints (Nayar 2022, Section IV-C)",
        hybrid,
        _OF_2022,
    ),
    StaticModel(
        "te",
        "tendons that stretch, measured joint forces, both with history (Nayar 2023, Algorithms 1-2)",
        te,
        _OF_2023,
    ),
)
