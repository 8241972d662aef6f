"""The analytic twin: a robot with effects in, the outputs of a data set's trials out, fast.

A diagnosis asks for the outputs of many robots that differ in a few numbers. Robots that bend in a
plane and are driven by tension go through the exact-arm statics, all at once (`statics.planar_batch`) or,
with tendons that it does not know, one by one (`fkm_exact_arm`). All other continuum robots go
through arcs of constant curvature, all at once (`statics.arc_equilibrium`), with tendons that run
straight between disks, as in the simulation. Robots of rolling joints go through the complete balance,
catheters through their kinematics, all at once (`statics.catheter.batch`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from catheter_sim.diagnosis.outputs import output_columns, wanted_disks
from catheter_sim.effects.apply import arriving_inputs, embodied, observed
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.channels import Inputs, body_count, joint_names, posture_columns, slice_inputs
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.layout import links
from catheter_sim.robots.posture import Array
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.statics.arc_equilibrium import solve_rows
from catheter_sim.statics.arcs import points_on_arcs
from catheter_sim.statics.catheter.batch import batch_frames, batch_joints
from catheter_sim.statics.catheter.pure import hinge_angles, joint_vector
from catheter_sim.statics.constant_curvature import arc_robots, joint_values, loads, places
from catheter_sim.statics.models import STATIC_MODELS
from catheter_sim.statics.planar import hinge_faces, rotations
from catheter_sim.statics.planar_batch import knows, solve_planar
from catheter_sim.statics.planar_chain import bends_in_plane
from catheter_sim.statics.rolling.chain import rolling_chain
from catheter_sim.statics.rolling.complete import solve_history
from catheter_sim.statics.rolling.history import faces

PLANAR_MODEL = "fkm_exact_arm"
# Five times the static model's own: without weight, inputs that move one way between rows make the same
# history in one step. A load that moves the robot while a rod is held makes it depend on the steps: random
# histories of the bench under their own weight move by at most 0.04 mm (`chest_tube`) and 0.006 mm (section).
_ROLLING_STEP_RAD = 0.2

# (robots with effects, of the kind that it was made for; commanded inputs; every how many rows)
# -> outputs in file units, (B, r, o)
Twin = Callable[[Sequence[Any], Inputs, int], Array]


@dataclass(frozen=True)
class ArcTwin:
    """Constant-curvature twin of any continuum robot, many at once.

    Attributes:
        columns: the output columns wanted.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
    """

    columns: tuple[str, ...]
    gravity_mps2: Array

    def __call__(self, robots: Sequence[ContinuumRobot], inputs: Inputs, every: int = 1) -> Array:
        """Return the outputs of `robots` (numbers differ, nothing else), shape (B, r, o).

        With `every` > 1 only each so-many-th row is returned; the others still make the history.
        """
        arrived = [arriving_inputs(robot, inputs) for robot in robots]
        changed = [embodied(robot) for robot in robots]
        arcs = arc_robots(changed, straight_between_disks=True)
        commands = np.array([item.tendon for item in arrived])
        acting = loads(changed, arrived, self.gravity_mps2)
        states = solve_rows(arcs, commands, inputs.actuation == "tension", acting, every)
        segment, fraction = places(changed[0])
        disks = wanted_disks(self.columns, len(segment))
        p_w, R_w = points_on_arcs(states.bend, arcs.length[:, None], segment[disks], fraction[disks])
        p_w[..., 2] -= states.shift[..., None]
        return np.array(
            [
                output_columns(
                    robot,
                    self.columns,
                    (disks, p_w[index], R_w[index]),
                    partial(joint_values, robot, states.bend[index]),
                    states.tension[index],
                )
                for index, robot in enumerate(robots)
            ]
        )


@dataclass(frozen=True)
class PlanarTwin:
    """Exact-arm twin of planar robots driven by tension, many at once."""

    columns: tuple[str, ...]
    gravity_mps2: Array

    def __call__(self, robots: Sequence[ContinuumRobot], inputs: Inputs, every: int = 1) -> Array:
        """Return the outputs of `robots` at each `every`-th row, shape (B, r, o); NaN: no balance."""
        arrived = [arriving_inputs(robot, inputs) for robot in robots]
        changed = [embodied(robot) for robot in robots]
        shown = slice(None, None, every)
        angles, shift = solve_planar(changed, arrived, self.gravity_mps2)
        angles = angles[:, shown]
        length = np.array([[[link.length_m for link in links(robot)]] for robot in changed])
        disks = wanted_disks(self.columns, angles.shape[2])
        p_w = hinge_faces(angles, length, disks)
        p_w[..., 2] += shift[:, shown, None]
        R_w = rotations(np.cumsum(angles, axis=2)[:, :, disks])
        return np.array(
            [
                output_columns(
                    robot,
                    self.columns,
                    (disks, p_w[index], R_w[index]),
                    partial(_hinge_columns, robot, angles[index]),
                    arrived[index].tendon[shown],
                )
                for index, robot in enumerate(robots)
            ]
        )


@dataclass(frozen=True)
class StaticTwin:
    """Twin by any static model, one robot after another.

    Attributes:
        model: its name.
        columns: the output columns wanted.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
    """

    model: str
    columns: tuple[str, ...]
    gravity_mps2: Array

    def __call__(self, robots: Sequence[Robot], inputs: Inputs, every: int = 1) -> Array:
        """Return the outputs of `robots` at each `every`-th row, shape (B, r, o); NaN: no balance."""
        result = []
        for robot in robots:
            try:
                solve = STATIC_MODELS[self.model].solve
                run = solve(embodied(robot), arriving_inputs(robot, inputs), self.gravity_mps2)
            except InputError:  # no equilibrium with these numbers: a fit must turn back from them
                result.append(np.full((len(inputs.time_s[::every]), len(self.columns)), np.nan))
                continue
            values = posture_columns(robot, observed(robot, run.postures[::every]))
            result.append(np.stack([values[name] for name in self.columns], axis=1))
        return np.array(result)


@dataclass(frozen=True)
class CatheterTwin:
    """Twin of catheters: pure kinematics, or the joints' balance where these do more, many at once."""

    columns: tuple[str, ...]
    gravity_mps2: Array

    def __call__(self, robots: Sequence[CatheterRobot], inputs: Inputs, every: int = 1) -> Array:
        """Return the outputs of `robots` at each `every`-th row, shape (B, r, o); NaN: out of range."""
        arrived = [arriving_inputs(robot, inputs) for robot in robots]
        changed = [embodied(robot) for robot in robots]
        values, tension = batch_joints(changed, arrived, self.gravity_mps2)
        values, tension = values[:, ::every], tension[:, ::every]
        disks = wanted_disks(self.columns, body_count(robots[0]))
        p_w, R_w = batch_frames(changed, values, disks)
        return np.array(
            [
                output_columns(
                    robot,
                    self.columns,
                    (disks, p_w[index], R_w[index]),
                    partial(hinge_angles, changed[index], joint_vector(changed[index], values[index])),
                    tension[index],
                    {f"angle_{pair.moves}_deg": values[index, :, k] for k, pair in enumerate(robot.tendons)},
                )
                for index, robot in enumerate(robots)
            ]
        )


@dataclass(frozen=True)
class RollingTwin:
    """Twin of robots of rolling joints: the complete balance, with friction's history."""

    columns: tuple[str, ...]
    gravity_mps2: Array

    def __call__(self, robots: Sequence[RollingRobot], inputs: Inputs, every: int = 1) -> Array:
        """Return the outputs of `robots` at each `every`-th row, shape (B, r, o); NaN: no balance."""
        shown = slice(None, None, every)
        result = np.full((len(robots), len(inputs.time_s[shown]), len(self.columns)), np.nan)
        for index, robot in enumerate(robots):
            arrived = arriving_inputs(robot, inputs)
            chain = rolling_chain(embodied(robot))
            try:
                solved = solve_history(chain, arrived, self.gravity_mps2, step_bend_rad=_ROLLING_STEP_RAD)
            except InputError:  # the robot folds with these numbers: a fit must turn back from them
                continue
            theta = solved.theta[shown]
            p_w, R_w = faces(
                chain, slice_inputs(arrived, shown), self.gravity_mps2, theta, solved.link_length[shown]
            )
            disks = wanted_disks(self.columns, chain.joints)
            result[index] = output_columns(
                robot,
                self.columns,
                (disks, p_w[:, disks], R_w[:, disks]),
                partial(_identity, theta),
                arrived.tendon[shown],
            )
        return result


def twin_for(robot: Robot, actuation: str, columns: Sequence[str], gravity_mps2: Array) -> Twin:
    """Return the twin that fits `robot` driven by `actuation`."""
    names = tuple(columns)
    if isinstance(robot, RollingRobot):
        return RollingTwin(names, gravity_mps2)
    if isinstance(robot, CatheterRobot):
        return CatheterTwin(names, gravity_mps2)
    if not bends_in_plane(robot) or actuation != "tension":
        return ArcTwin(names, gravity_mps2)
    if knows(robot):
        return PlanarTwin(names, gravity_mps2)
    return StaticTwin(PLANAR_MODEL, names, gravity_mps2)


def _identity(theta: Array) -> Array:
    return theta


def _hinge_columns(robot: ContinuumRobot, angles: Array) -> Array:
    """Return bend angles (r, n) in the order of `joint_names`; a hinge that twists stays at zero."""
    names = joint_names(robot)
    result = np.zeros((len(angles), len(names)))
    result[:, [name.startswith("x") for name in names]] = angles
    return result
