"""What robot and anatomy do to each other: the wall as springs, the leaflets as MuJoCo's contacts.

MuJoCo's own contacts have no stiffness that could be stated in N/m: it depends on the inertias and the
posture, the more so under its discrete integrator. So the wall's contacts are only found by MuJoCo
(`scene` gives its geoms a gap), and their forces are springs here: stiffness times depth, one for each
element of the robot, at its deepest contact. Leaflets, which give way on their hinges, are MuJoCo's.

A spring acts one step late. On the transseptal robot's straight end, as soft sideways as it gets, it comes
to rest up to 200 N/m at the robot's time step of 5 ms; at 400 N/m it rattles.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.arrays import Array

WALL_N_PER_M = 200.0  # of the wall under one element of the robot; assumed: 0.2 N for each millimetre


@dataclass(frozen=True)
class Touch:
    """What the anatomy feels of the robot at one moment.

    Attributes:
        wall_N: sum of the normal forces on the wall.
        place: of the largest of them, valve frame, shape (3,) [m]; NaN where there is none.
        leaflets: pairs of geom names, of the robot and of a leaflet, that press on each other.
        leaflets_N: sum of the normal forces on the leaflets.
    """

    wall_N: float
    place: Array
    leaflets: frozenset[tuple[str, str]]
    leaflets_N: float


class Contacts:
    """Applies the wall's forces before every step and tells what the last step's were."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, wall_N_per_m: float = WALL_N_PER_M
    ) -> None:
        self._model, self._data, self._stiffness = model, data, wall_N_per_m
        names = [model.geom(geom).name for geom in range(model.ngeom)]
        self._names = names
        self._wall = np.array([name.startswith("wall_") for name in names])
        self._robot = np.array([name.startswith("touch_") for name in names])

    def push_back(self) -> Touch:
        """Let the wall press on the robot at its present contacts; return all forces.

        The forces act in the following steps, until this is called again.
        """
        model, data = self._model, self._data
        data.xfrc_applied[:] = 0.0
        deepest: dict[int, int] = {}
        leaflets, pairs, wrench = 0.0, set(), np.zeros(6)
        for number in range(data.ncon):
            contact = data.contact[number]
            first, second = (int(geom) for geom in contact.geom)
            robot, other = (first, second) if self._robot[first] else (second, first)
            if self._wall[other]:
                if contact.dist < 0.0 and (
                    robot not in deepest or contact.dist < data.contact[deepest[robot]].dist
                ):
                    deepest[robot] = number
                continue
            mujoco.mj_contactForce(model, data, number, wrench)
            if wrench[0] > 0.0:
                leaflets += float(wrench[0])
                pairs.add((self._names[robot], self._names[other]))
        wall, largest, place = 0.0, 0.0, np.full(3, np.nan)
        for robot, number in deepest.items():
            contact = data.contact[number]
            size = -self._stiffness * float(contact.dist)
            # the frame's first axis points from the first geom to the second
            outward = contact.frame[:3] * (1.0 if contact.geom[0] == robot else -1.0)
            force = -size * outward
            body = int(model.geom_bodyid[robot])
            data.xfrc_applied[body, :3] += force
            data.xfrc_applied[body, 3:] += np.cross(contact.pos - data.xipos[body], force)
            wall += size
            if size > largest:
                largest, place = size, contact.pos.copy()
        return Touch(wall, place, frozenset(pairs), leaflets)
