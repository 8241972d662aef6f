"""The analytic twin: a robot with effects in, the outputs of a data set's trials out, fast.

A diagnosis asks for the outputs of many robots that differ in a few numbers. Robots that bend in a
plane and are driven by tension go through the exact-arm statics: those with one pair of tendons all at
once (`statics.planar_batch`), others one by one (`fkm_exact_arm`). All other robots go through arcs of
constant curvature, all at once (`statics.arc_equilibrium`), with tendons that run straight between
disks, as in the simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.effects.apply import arriving_inputs, embodied, observed, observed_frames
from catheter_sim.errors import InputError
from catheter_sim.robots.channels import Inputs, body_count, joint_names, posture_columns, slice_inputs
from catheter_sim.robots.layout import links
from catheter_sim.robots.posture import Array
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.statics.arc_equilibrium import solve_rows
from catheter_sim.statics.arcs import points_on_arcs
from catheter_sim.statics.constant_curvature import arc_robots, joint_values, loads, places
from catheter_sim.statics.models import STATIC_MODELS
from catheter_sim.statics.planar import hinge_chain
from catheter_sim.statics.planar_batch import knows, solve_pairs
from catheter_sim.statics.planar_chain import bends_in_plane

PLANAR_MODEL = "fkm_exact_arm"
_QUATERNION = ("tip_qw", "tip_qx", "tip_qy", "tip_qz")

# (robots with effects, commanded inputs, every how many rows) -> outputs in file units, (B, r, o)
Twin = Callable[[Sequence[ContinuumRobot], Inputs, int], Array]


@dataclass(frozen=True)
class ArcTwin:
    """Constant-curvature twin of any robot, many at once.

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
        shown = slice(None, None, every)
        changed = [embodied(robot) for robot in robots]
        by_tension = inputs.actuation == "tension"
        result = np.empty((len(robots), len(inputs.time_s[shown]), len(self.columns)))
        # A batch with friction is marched row by row: robots without stay apart.
        for rough in (False, True):
            group = [index for index, robot in enumerate(changed) if (robot.friction.mu > 0.0) is rough]
            if not group:
                continue
            members = [changed[index] for index in group]
            arcs = arc_robots(members, straight_between_disks=True)
            # Without friction a row does not depend on those before it.
            rows = slice(None) if rough else shown
            kept = shown if rough else slice(None)
            driven = [slice_inputs(arrived[index], rows) for index in group]
            load = loads(members, driven, self.gravity_mps2)
            states = solve_rows(arcs, np.array([item.tendon for item in driven]), by_tension, load)
            segment, fraction = places(members[0])
            disks = wanted_disks(self.columns, len(segment))
            for position, index in enumerate(group):
                bend = states.bend[position, kept]
                p_w, R_w = points_on_arcs(bend, arcs.length[position], segment[disks], fraction[disks])
                p_w[..., 2] -= states.shift[position, kept, None]
                result[index] = output_columns(
                    robots[index],
                    self.columns,
                    (disks, p_w, R_w),
                    partial(joint_values, robots[index], bend),
                    states.tension[position, kept],
                )
        return result


@dataclass(frozen=True)
class PairTwin:
    """Exact-arm twin of planar robots with one antagonistic pair of tendons, many at once."""

    columns: tuple[str, ...]
    gravity_mps2: Array

    def __call__(self, robots: Sequence[ContinuumRobot], inputs: Inputs, every: int = 1) -> Array:
        """Return the outputs of `robots` at each `every`-th row, shape (B, r, o); NaN: no balance."""
        arrived = [arriving_inputs(robot, inputs) for robot in robots]
        changed = [embodied(robot) for robot in robots]
        shown = slice(None, None, every)
        angles, shift = solve_pairs(changed, arrived, self.gravity_mps2)
        angles = angles[:, shown]
        length = np.array([link.length_m for link in links(changed[0])])
        p_w, R_w = hinge_chain(angles, length)
        p_w[..., 2] += shift[:, shown, None]
        disks = wanted_disks(self.columns, angles.shape[2])
        return np.array(
            [
                output_columns(
                    robot,
                    self.columns,
                    (disks, p_w[index][:, disks], R_w[index][:, disks]),
                    partial(_hinge_columns, robot, angles[index]),
                    arrived[index].tendon[shown],
                )
                for index, robot in enumerate(robots)
            ]
        )


@dataclass(frozen=True)
class PlanarTwin:
    """Twin of planar robots driven by tension: the exact-arm statics, friction history included."""

    columns: tuple[str, ...]
    gravity_mps2: Array

    def __call__(self, robots: Sequence[ContinuumRobot], inputs: Inputs, every: int = 1) -> Array:
        """Return the outputs of `robots` at each `every`-th row, shape (B, r, o)."""
        solve = STATIC_MODELS[PLANAR_MODEL].solve
        result = []
        for robot in robots:
            try:
                run = solve(embodied(robot), arriving_inputs(robot, inputs), self.gravity_mps2)
            except InputError:  # no equilibrium with these numbers: a fit must turn back from them
                result.append(np.full((len(inputs.time_s[::every]), len(self.columns)), np.nan))
                continue
            values = posture_columns(robot, observed(robot, run.postures[::every]))
            result.append(np.stack([values[name] for name in self.columns], axis=1))
        return np.array(result)


def twin_for(
    robot: ContinuumRobot, actuation: str, columns: Sequence[str], gravity_mps2: Array
) -> ArcTwin | PairTwin | PlanarTwin:
    """Return the twin that fits `robot` driven by `actuation`."""
    if bends_in_plane(robot) and actuation == "tension":
        kind = PairTwin if knows(robot) else PlanarTwin
        return kind(tuple(columns), gravity_mps2)
    return ArcTwin(tuple(columns), gravity_mps2)


def wanted_disks(columns: Sequence[str], count: int) -> list[int]:
    """Return the indices of the disks whose frames the output columns show."""
    found = {
        count - 1 if name.startswith("tip_") else int(name.split("_")[1]) - 1
        for name in columns
        if name.startswith(("tip_", "body_"))
    }
    return sorted(found)


def output_columns(
    robot: ContinuumRobot,
    columns: Sequence[str],
    frames: tuple[Sequence[int], Array, Array],
    joint_angles: Callable[[], Array],
    tension: Array,
) -> Array:
    """Return output columns from a robot's state along r rows, shape (r, o), in file units.

    Args:
        robot: with effects; those that act on what is measured are applied.
        columns: names of output columns.
        frames: indices of disks, their positions (r, k, 3) [m] and orientations (r, k, 3, 3).
        joint_angles: gives the hinges' angles in the order of `joint_names`, shape (r, j) [rad].
        tension: at the actuator, shape (r, t) [N].
    """
    disks, p_w, R_w = frames
    values: dict[str, Array] = {}
    if len(disks):
        last = body_count(robot) - 1
        p_w, R_w = observed_frames(robot, p_w, R_w)
        for place, index in enumerate(disks):
            for axis, letter in enumerate("xyz"):
                values[f"body_{index + 1}_{letter}_mm"] = p_w[:, place, axis] * 1e3
                if index == last:
                    values[f"tip_{letter}_mm"] = p_w[:, place, axis] * 1e3
            if index == last and any(name in _QUATERNION for name in columns):
                values |= _quaternions(R_w[:, place])
    if any(name.startswith("joint_") for name in columns):
        angles = np.degrees(joint_angles())
        values |= {f"joint_{name}_deg": angles[:, i] for i, name in enumerate(joint_names(robot))}
    values |= {f"tension_{item.name}_N": tension[:, i] for i, item in enumerate(robot.tendons)}
    return np.stack([values[name] for name in columns], axis=1)


def _quaternions(R_w: Array) -> dict[str, Array]:
    parts = np.full((len(R_w), 4), np.nan)
    balanced = np.isfinite(R_w).all(axis=(1, 2))
    if balanced.any():
        parts[balanced] = Rotation.from_matrix(R_w[balanced]).as_quat(canonical=True, scalar_first=True)
    return {name: parts[:, index] for index, name in enumerate(_QUATERNION)}


def _hinge_columns(robot: ContinuumRobot, angles: Array) -> Array:
    """Return bend angles (r, n) in the order of `joint_names`; a hinge that twists stays at zero."""
    names = joint_names(robot)
    result = np.zeros((len(angles), len(names)))
    result[:, [name.startswith("x") for name in names]] = angles
    return result
