"""The analytic twin: a robot with effects in, the outputs of a data set's trials out, fast.

A diagnosis asks for the outputs of many robots that differ in a few numbers. Robots that bend in a
plane and are driven by tension go through `fkm_exact_arm`, one by one; all others through arcs of
constant curvature, all at once (`statics.arc_equilibrium`), with tendons that run straight between
disks, as in the simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.effects.apply import arriving_inputs, embodied, observed, observed_frames
from catheter_sim.errors import InputError
from catheter_sim.robots.channels import Inputs, joint_names, posture_columns, slice_inputs
from catheter_sim.robots.posture import Array
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.statics.arc_equilibrium import solve_rows
from catheter_sim.statics.arcs import points_on_arcs
from catheter_sim.statics.constant_curvature import arc_robots, joint_values, loads, places
from catheter_sim.statics.models import STATIC_MODELS
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
            for position, index in enumerate(group):
                result[index] = self._columns(
                    robots[index],
                    arcs.length[position],
                    states.bend[position, kept],
                    states.shift[position, kept],
                    states.tension[position, kept],
                )
        return result

    def _columns(
        self, robot: ContinuumRobot, length: Array, bend: Array, shift: Array, tension: Array
    ) -> Array:
        segment, fraction = places(robot)
        wanted: list[int] = []
        for name in self.columns:
            index = _disk_of(name, len(segment))
            if index is not None and index not in wanted:
                wanted.append(index)
        values: dict[str, Array] = {}
        if wanted:
            p_w, R_w = points_on_arcs(bend, length, segment[wanted], fraction[wanted])
            p_w[..., 2] -= shift[:, None]
            p_w, R_w = observed_frames(robot, p_w, R_w)
            for place, index in enumerate(wanted):
                for axis, letter in enumerate("xyz"):
                    values[f"body_{index + 1}_{letter}_mm"] = p_w[:, place, axis] * 1e3
                    if index == len(segment) - 1:
                        values[f"tip_{letter}_mm"] = p_w[:, place, axis] * 1e3
                if index == len(segment) - 1 and any(name in _QUATERNION for name in self.columns):
                    parts = Rotation.from_matrix(R_w[:, place]).as_quat(canonical=True, scalar_first=True)
                    values |= {name: parts[:, i] for i, name in enumerate(_QUATERNION)}
        if any(name.startswith("joint_") for name in self.columns):
            angles = np.degrees(joint_values(robot, bend))
            values |= {f"joint_{name}_deg": angles[:, i] for i, name in enumerate(joint_names(robot))}
        values |= {f"tension_{item.name}_N": tension[:, i] for i, item in enumerate(robot.tendons)}
        return np.stack([values[name] for name in self.columns], axis=1)


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
) -> ArcTwin | PlanarTwin:
    """Return the twin that fits `robot` driven by `actuation`."""
    if bends_in_plane(robot) and actuation == "tension":
        return PlanarTwin(tuple(columns), gravity_mps2)
    return ArcTwin(tuple(columns), gravity_mps2)


def _disk_of(column: str, count: int) -> int | None:
    """Return the index of the disk whose frame an output column shows, or None."""
    if column.startswith("tip_"):
        return count - 1
    if column.startswith("body_"):
        return int(column.split("_")[1]) - 1
    return None
