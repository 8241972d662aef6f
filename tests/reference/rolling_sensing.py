"""The robot's shape from the measured tension of its motors, and how sure it is.

The use that chest_tube_2025 makes of its model: tension in, shape out. The shape is that of the
complete balance along the measured history. Its uncertainty is propagated to first order, cause by
cause: the noise of each row's tensions, and the parameters that are known only so well. Causes are
taken as independent of one another.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.document import from_document, leaves, override, to_document
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.posture import Posture
from catheter_sim.core.statics import StaticRun
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.rolling.complete import PRE_SLIDING_M, Stretch, complete_sliding, frames, stretches
from catheter_sim.robots.rolling.description import RollingChain, check, rolling_chain
from catheter_sim.robots.rolling.kernels import (
    ChainBalance,
    PackedChain,
    RodPulls,
    advance,
    pack,
    workspace,
)
from catheter_sim.robots.rolling.spec import RollingRobot

_FORGOTTEN_RAD = 1e-6  # below it a row's noise is followed no further
NOISE = "tension"  # name of the share that the tensions' own noise has


@dataclass(frozen=True)
class SensedShape:
    """Shapes from measured tensions.

    Attributes:
        run: the most likely postures.
        covariance: of every link's position p_w, shape (r, n, 3, 3) [m^2].
        shares: each cause's part of `covariance`, by its name: "tension", or a parameter's key.
    """

    run: StaticRun
    covariance: Array
    shares: Mapping[str, Array]

    @property
    def standard_deviation(self) -> Array:
        """Of every link's position along the base's axes, shape (r, n, 3) [m]."""
        return np.sqrt(np.einsum("rnii->rni", self.covariance))


def sense_shape(
    robot: RollingRobot,
    inputs: Inputs,
    gravity_mps2: Array,
    tension_deviation_N: float,
    parameter_deviations: Mapping[str, float] | None = None,
) -> SensedShape:
    """Return the shape at every row of measured tensions.

    Dry friction makes the shape depend on the way. So each row's noise is followed: from the state that
    the row before has left, a deviation up and a deviation down, and on through the rows that remember
    it. The base presses into its mount without noise.

    Args:
        robot: a robot of rolling joints.
        inputs: the measured tensions.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        tension_deviation_N: standard deviation of each measured tension.
        parameter_deviations: standard deviation of parameters by their dotted key, in file units
            ("friction.mu": 0.03).

    Raises:
        InputError: a robot of another kind, an unknown parameter, a deviation below zero, or no posture
            balances a row.
    """
    if not isinstance(robot, RollingRobot):
        raise InputError(f"{robot.name}: not a robot of rolling joints; of every kind: the verb `sense`")
    deviations = dict(parameter_deviations or {})
    for name, value in {"tension_deviation_N": tension_deviation_N, **deviations}.items():
        if not 0.0 <= value < np.inf:
            raise InputError(f"{name}: a standard deviation of {value:g} is not possible")
    run = complete_sliding(robot, inputs, gravity_mps2)
    shares = {NOISE: _of_noise(robot, inputs, gravity_mps2, tension_deviation_N)}
    for key, deviation in deviations.items():
        up, down = (
            _places(complete_sliding(_changed(robot, key, sign * deviation), inputs, gravity_mps2).postures)
            for sign in (1.0, -1.0)
        )
        shares[key] = _outer(0.5 * (up - down))
    covariance = np.sum(list(shares.values()), axis=0)
    return SensedShape(run, covariance, shares)


def _of_noise(robot: RollingRobot, inputs: Inputs, gravity_mps2: Array, deviation: float) -> Array:
    """Return the part that every row's noise has in the rows from there on."""
    chain = rolling_chain(robot)
    gravity = np.asarray(gravity_mps2, dtype=float)
    total = np.zeros((len(inputs), chain.joints, 3, 3))
    march = March(chain)
    pairs: list[tuple[March, March, Array]] = []  # pushed up, pushed down, by what
    for index, way in enumerate(stretches(chain, inputs, gravity)):
        if index == 0:
            march.advance(way)
            continue
        going = []  # copied before the row: they leave it with their own tension
        for r in range(chain.pulled):
            push = np.zeros(chain.pulled)
            push[r] = deviation
            going.append((march.copy(), march.copy(), push))
        reached = [march.advance(way)]
        for up, down, _ in pairs:
            reached += [up.advance(way), down.advance(way)]
        for up, down, push in going:
            lower = np.maximum(way.drive_to - push, 0.0)
            reached += [
                up.advance(replace(way, drive_to=way.drive_to + push)),
                down.advance(replace(way, drive_to=lower)),
            ]
        if not all(reached):
            place = row_name(inputs, index - 1)
            raise InputError(f"{place}: within the tensions' deviation no posture balances rods and loads")
        pairs = [
            pair for pair in pairs if np.abs(pair[0].theta - pair[1].theta).max() > _FORGOTTEN_RAD
        ] + going
        if pairs:
            angles = np.array([[pair[0].theta, pair[1].theta] for pair in pairs])
            lengths = np.array([[pair[0].link_length, pair[1].link_length] for pair in pairs])
            places = frames(chain, angles, lengths).face
            half = 0.5 * (places[:, 0] - places[:, 1])
            total[index - 1] = np.einsum("qni,qnj->nij", half, half)
    return total


def _changed(robot: RollingRobot, key: str, change: float) -> RollingRobot:
    document = to_document(robot)
    values = dict(leaves(document))
    if key not in values:
        raise unknown("parameter", key, values, robot.name)
    override(document, key, values[key] + change)
    changed: RollingRobot = from_document(RollingRobot, document, robot.name)
    check(changed, robot.name)
    return replace(changed, effects=robot.effects)


def _places(found: tuple[Posture, ...] | list[Posture]) -> Array:
    return np.array([posture.p_w for posture in found])


def _outer(shift: Array) -> Array:
    return np.einsum("rni,rnj->rnij", shift, shift)


# ----------------------------------------------------------------------------------------------------
# A robot on its way along a history of inputs, by the complete balance with sliding rods.


class March:
    """The state that a robot carries from row to row, starting at rest without load.

    Attributes:
        chain: the robot.
        theta: bend angles, shape (n,) [rad].
        drive: tension at the actuator, shape (t,) [N].
        memory: how each rod hangs in each link, see `robots.rolling.kernels`, shape (3, t, n).
        link_length: as compressed, shape (n,) [m].
        at_joint: tension in each joint's gap, shape (t, n) [N].
        unbalanced: moment left at each joint, shape (n,) [N m].
    """

    def __init__(self, chain: RollingChain, packed: PackedChain | None = None) -> None:
        """Put the robot at rest, without load; `packed` is `pack(chain)` where that is at hand."""
        n, t = chain.joints, chain.pulled
        self.chain = chain
        self.packed = packed or pack(chain)
        self.theta, self.link_length = chain.rest_angle.copy(), chain.link_length.copy()
        self.drive = np.zeros(t)
        self.memory, self.at_joint, self.unbalanced = np.zeros((3, t, n)), np.zeros((t, n)), np.zeros(n)
        self._gives, self._unknown = np.array(PRE_SLIDING_M), np.empty((0, 1 + t, n))
        self._work = workspace(n, t)

    def copy(self) -> March:
        """Return another one in the same state."""
        other = March(self.chain, self.packed)
        for name in ("theta", "link_length", "drive", "memory", "at_joint", "unbalanced"):
            setattr(other, name, getattr(self, name).copy())
        return other

    def advance(self, way: Stretch) -> bool:
        """Go from here, whatever its `drive_from`, to the end of `way`; return whether it was reached."""
        start, end = way.loads_from, way.loads_to
        made = np.empty((way.steps, *self._unknown.shape[1:]))
        reached = advance(
            self.packed,
            RodPulls(self.drive, end.link, end.point, start.force, start.tip_moment),
            RodPulls(way.drive_to, end.link, end.point, end.force, end.tip_moment),
            ChainBalance(self.theta, self.link_length, self.at_joint, self.unbalanced),
            *(self.memory, self._gives, way.steps, self._unknown, made, self._work),
        )
        self.drive = way.drive_to
        return bool(reached == 1.0)
