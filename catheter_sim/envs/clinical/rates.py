"""Resolved rates of a robot in an anatomy: how its points move with its drives and its base.

Slopes come from the simulated posture: MuJoCo's Jacobian of a point at the joints as they stand, friction,
load and contacts included, times what drives do to joints without them (`quick_model`). Joints that a sheath
still holds straight do not move; where the robot is pushed on, the joint that leaves it bends.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import body_count
from catheter_sim.envs.clinical.base import ClinicalEnv
from catheter_sim.envs.steering import change_toward
from catheter_sim.envs.tip import CONTROL_STEP_S, RATE_PER_S, Action
from catheter_sim.mjcf.names import face as face_name
from catheter_sim.modelling.surroundings import INSERTION


@dataclass(frozen=True)
class Wish:
    """That a point of the robot moves so.

    Attributes:
        element: whose far face the point is the middle of, from 1; the last one's is the tip.
        way_m: wished motion, shape (3,) [m].
        along: only these directions count, shape (k, 3), each as long as its weight.
    """

    element: int
    way_m: Array
    along: Array


class Rates:
    """A robot in a task, as its simulation stands now."""

    def __init__(self, env: ClinicalEnv, out_m: float) -> None:
        """Read the robot's state.

        Args:
            env: the task; its base slides along z.
            out_m: z beyond which the robot is free to bend [m].
        """
        self._env, plant = env, env.plant
        self._model, self._data = plant.simulator.model, plant.simulator.data
        mujoco.mj_fwdPosition(self._model, self._data)
        self.elements = body_count(plant.simulator.robot)
        sites = [self._model.site(face_name(k)).id for k in range(1, self.elements + 1)]
        self._sites = sites
        self.p_w = self._data.site_xpos[sites].copy()
        self._joints = self._joint_slopes(out_m)

    def choose(self, wishes: list[Wish]) -> Action:
        """Return the action that fulfils the wishes as well as one step can."""
        env, plant = self._env, self._env.plant
        slopes, ways = [], []
        for wish in wishes:
            jacobian = np.zeros((3, self._model.nv))
            mujoco.mj_jacSite(self._model, self._data, jacobian, None, self._sites[wish.element - 1])
            slopes.append(wish.along @ jacobian @ self._joints)
            ways.append(wish.along @ wish.way_m)
        ranges = np.array([motion.highest for motion in env.motions])
        ends = np.array([(motion.lowest, motion.highest) for motion in env.motions])
        rates = np.array([motion.rate_per_s for motion in env.motions]) / ranges
        largest = CONTROL_STEP_S * np.concatenate([np.full(len(plant.level), RATE_PER_S), rates])
        place = np.concatenate([plant.level, plant.carriage / ranges])
        lowest = np.concatenate([plant.drives.lowest, ends[:, 0] / ranges])
        least = np.clip(lowest - place, -largest, 0.0)
        most = np.clip(1.0 - place, 0.0, largest)
        change = change_toward(np.concatenate(ways), np.concatenate(slopes), env.length_m, least, most)
        return (change / largest).astype(np.float32)

    def _joint_slopes(self, out_m: float) -> Array:
        """Return how the joints move with the levels and the base's shares of its ranges, (nv, d + c)."""
        env, model, data = self._env, self._model, self._data
        plant = env.plant
        bend = plant.drives.bend
        drives = len(plant.level)
        slopes = np.zeros((model.nv, drives + len(env.motions)))
        length = float(plant.segment_length.sum()) / self.elements
        leaving = True
        for index, place, count in plant.hinges:
            if data.xanchor[index, 2] < out_m:
                continue
            dof = int(model.jnt_dofadr[index])
            slopes[dof, :drives] = bend[place] / count
            if leaving:  # the joint that has just left the sheath
                natural = float(bend[place] @ plant.level) / count
                slopes[dof, drives] = natural / length
                leaving = False
        for number, motion in enumerate(env.motions):
            if motion.name == INSERTION:
                slopes[:, drives + number] *= motion.highest
            slopes[int(model.joint(motion.name).dofadr[0]), drives + number] = motion.highest
        return slopes
