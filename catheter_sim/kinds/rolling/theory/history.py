"""From rows of inputs to steps of what acts, and from solved angles to postures.

A trial starts at rest: zero inputs, no friction history, weight already acting. Between rows the
inputs move linearly, in steps so small that their number does not matter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.loads import LinkForce
from catheter_sim.core.posture import Posture
from catheter_sim.kinds.rolling.theory.chain import RollingChain
from catheter_sim.kinds.rolling.theory.kernels.links import tops
from catheter_sim.kinds.rolling.theory.kernels.packed import pack
from catheter_sim.kinds.rolling.theory.loads import Loads, loads
from catheter_sim.mechanics.step_counts import counts_where_alone

# A step's change of inputs would bend the softest joint by at most this much, were it alone.
# Halving it moves the tip of `chest_tube_section` by at most 2 um over its nominal tables.
STEP_BEND_RAD = 0.04
_MAX_STEPS = 2000  # between two rows
_SLACK_SHARE = 1e-3  # of the largest tension: what an input that comes late leaves behind


@dataclass(frozen=True)
class Stretch:
    """The way from one row of inputs to the next.

    Attributes:
        drive_from, drive_to: tension at the actuator, shape (t,) [N].
        loads_from, loads_to: on the links.
        steps: how many.
    """

    drive_from: Array
    drive_to: Array
    loads_from: Loads
    loads_to: Loads
    steps: int

    def at(self, part: float) -> tuple[Array, Loads]:
        """Return what acts at a share of the way."""

        def blend(start: Array, end: Array) -> Array:
            return start + part * (end - start)

        force = blend(self.loads_from.force, self.loads_to.force)
        moment = blend(self.loads_from.tip_moment, self.loads_to.tip_moment)
        drive = blend(self.drive_from, self.drive_to)
        return drive, replace(self.loads_to, force=force, tip_moment=moment)


@dataclass(frozen=True)
class Standing:
    """Where a robot stands after rows of inputs, and what its friction remembers: rows may go on from there.

    Attributes:
        theta: bend angles, shape (n,) [rad].
        link_length: as compressed, shape (n,) [m].
        memory: of each rod in each link, shape (1, t, n), or (3, t, n) where it goes by how rods slide.
        drive: tension at the actuator, shape (t,) [N].
        force: of the points that are loaded, in the base frame, shape (p, 3) [N].
        tip_moment: in the base frame, shape (3,) [N m].
    """

    theta: Array
    link_length: Array
    memory: Array
    drive: Array
    force: Array
    tip_moment: Array


@dataclass(frozen=True)
class Ways:
    """The ways to rest under the weight alone, then to each of r rows of inputs.

    Of rows that go on from where a robot stands, the first way has no steps.

    Attributes:
        drive: tension at the actuator at their ends, shape (r + 1, t) [N].
        force: in the base frame, of the points in `at_rest`, shape (r + 1, p, 3) [N].
        tip_moment: in the base frame, shape (r + 1, 3) [N m].
        steps: how many, shape (r + 1,).
        at_rest: the loads of the first way.
    """

    drive: Array
    force: Array
    tip_moment: Array
    steps: np.ndarray
    at_rest: Loads


def ways(
    chain: RollingChain,
    inputs: Inputs,
    gravity_mps2: Array,
    others: Sequence[LinkForce] = (),
    step_bend_rad: float | None = None,
    alone_bend_rad: float | None = None,
    after: Standing | None = None,
) -> Ways:
    """Return the way to rest under the weight and `others` alone, and the way to each row of inputs.

    Args:
        chain: the robot.
        inputs: the rows.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        others: further forces, steady from the start.
        step_bend_rad: what a step may bend the softest joint; default `STEP_BEND_RAD`.
        alone_bend_rad: what the rods of one end may that move all but alone, the rest by less than a tenth of
            `step_bend_rad`; default: no more than the others.
        after: where the robot stands instead of at rest.
    """
    at_rest = loads(chain, gravity_mps2, others=others)
    force = np.repeat(at_rest.force[np.newaxis], len(inputs) + 1, axis=0)
    force[1:, at_rest.tip] = inputs.force_tip
    drive = np.concatenate([np.zeros((1, chain.pulled)), inputs.tendon])
    moment = np.concatenate([np.zeros((1, 3)), inputs.moment_tip])
    if after is not None:
        drive[0], force[0], moment[0] = after.drive, after.force, after.tip_moment
    moves = np.abs(np.diff(drive, axis=0))
    arm = float(np.abs(chain.offset).max())
    change = (
        arm * moves.sum(axis=1)
        + float(chain.link_length.sum()) * np.linalg.norm(np.diff(force, axis=0), axis=(1, 2))
        + np.linalg.norm(np.diff(moment, axis=0), axis=1)
    )
    stiffness, step_rad = float(chain.rest_stiffness.min()), step_bend_rad or STEP_BEND_RAD
    counts = np.ceil(change / (stiffness * step_rad))
    if alone_bend_rad is not None:
        last = chain.last[: chain.pulled]
        alone = np.max([moves[:, last == end].sum(axis=1) for end in last], axis=0)
        counts = counts_where_alone(change / stiffness, arm * alone / stiffness, step_rad, alone_bend_rad)
    # Undefined where numbers are beyond a float's digits: the search then finds no balance, and says so.
    steps = np.nan_to_num(np.clip(counts, 1, _MAX_STEPS), nan=1.0).astype(np.int64)
    return Ways(drive, force, moment, np.concatenate([[int(after is None)], steps]), at_rest)


def several_rods_at_once(tension: Array) -> bool:
    """Return whether more than one rod is tense anywhere on the way through rows of tensions, (r, t) [N]."""
    tense = tension > _SLACK_SHARE * tension.max(initial=0.0)
    tense[1:] |= tense[:-1]
    return bool((tense.sum(axis=1) > 1).any())


def stretches(
    chain: RollingChain, inputs: Inputs, gravity_mps2: Array, others: Sequence[LinkForce] = ()
) -> Iterator[Stretch]:
    """Yield `ways`, of the same arguments, one by one."""
    all_ways = ways(chain, inputs, gravity_mps2, others)
    drive, before = all_ways.drive, all_ways.at_rest
    for row, steps in enumerate(all_ways.steps):
        acting = replace(before, force=all_ways.force[row], tip_moment=all_ways.tip_moment[row])
        yield Stretch(drive[max(row - 1, 0)], drive[row], before, acting, int(steps))
        before = acting


def faces(
    chain: RollingChain,
    inputs: Inputs,
    gravity_mps2: Array,
    theta: Array,
    link_length: Array | None = None,
) -> tuple[Array, Array]:
    """Return every link's flat top in every row, the base pressed into the mount by all that acts.

    Arguments as in `postures`.

    Returns:
        Positions, shape (r, n, 3) [m], and orientations, shape (r, n, 3, 3), in the base frame.
    """
    if link_length is None:
        link_length = np.tile(chain.link_length, (len(theta), 1))
    face, R_w = np.empty((*theta.shape, 3)), np.empty((*theta.shape, 3, 3))
    angles, lengths = np.ascontiguousarray(theta), np.ascontiguousarray(link_length)
    tops(pack(chain).joint, angles, lengths, face, R_w)
    weight = float(chain.mass.sum() * gravity_mps2[2])
    pressed = weight + inputs.force_tip[:, 2] - inputs.tendon.sum(axis=1)
    shift = np.zeros((len(inputs), 1, 3))
    shift[:, 0, 2] = pressed / chain.robot.mount.axial_stiffness_N_per_m
    return face + shift, R_w


def postures(
    chain: RollingChain,
    inputs: Inputs,
    gravity_mps2: Array,
    theta: Array,
    at_joint: Array,
    link_length: Array | None = None,
) -> list[Posture]:
    """Return the postures of every row, the base pressed into the mount by all that acts.

    Args:
        chain: the robot.
        inputs: the rows.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        theta: bend angles, shape (r, n) [rad].
        at_joint: tension of the pulled rods in each joint's gap, shape (r, t, n) [N].
        link_length: as compressed, shape (r, n) [m].
    """
    face, R_w = faces(chain, inputs, gravity_mps2, theta, link_length)
    inside = np.where(chain.passes[: chain.pulled], at_joint, np.nan)
    return [
        Posture(
            p_w=face[row],
            R_w=R_w[row],
            joint_angles=theta[row],
            actuator_tension=inputs.tendon[row],
            tendon_tension=inside[row],
        )
        for row in range(len(inputs))
    ]
