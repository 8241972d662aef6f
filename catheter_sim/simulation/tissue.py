"""Tissue as springs at the contacts that MuJoCo finds, and the forces that it feels.

MuJoCo's own contacts have no stiffness that could be stated in N/m: it depends on inertias and posture.
An explicit spring (`catheter_sim.procedure.contact`) is stable only where it is not much stiffer than the
robot; a thin robot's tip gives way at a few hundredths of a newton per metre. Here the spring is part of the
step's own equations: the rows of MuJoCo's contact constraints, f = D (a_ref - a), are rewritten before they
are solved so that the force is K times the depth at the end of the step,

    f = K (depth - h v - h^2 a),   D = K h^2,   a_ref = (depth - h v) / h^2,

with h the time step, v and a the speed and acceleration of the surfaces from each other; MuJoCo's solver
keeps f from pulling. So every stiffness is stable, and at rest the force is K times the depth.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from catheter_sim.mjcf.surroundings import TOUCH

TISSUE = "tissue_"  # geoms `tissue_<region>_<k>` belong to a region
_NOTHING = 1e-12  # in place of D: a contact that presses with nothing


class Tissue:
    """The surroundings of a simulated robot: regions, each with its stiffness and the force on it.

    Each geom of the robot presses on a region at its deepest contact only, so that the seams between a
    wall's convex blocks are not felt.

    Attributes:
        regions: their names.
        force_N: sum of the normal forces on each region in the last step, shape (r,) [N].
        peak_N: the largest sums since `forget`, shape (r,) [N].
    """

    def __init__(self, model: mujoco.MjModel, stiffness_N_per_m: Mapping[str, float]) -> None:
        """Prepare the law.

        Args:
            model: of a robot in surroundings, with geoms `tissue_<region>_<k>`.
            stiffness_N_per_m: of each region under one geom of the robot.
        """
        self.regions = tuple(stiffness_N_per_m)
        self._stiffness = np.array(list(stiffness_N_per_m.values()))
        names = [model.geom(geom).name for geom in range(model.ngeom)]
        self._model = model
        self._region = np.array([self._region_of(name) for name in names])
        self._robot = np.array([name.startswith(TOUCH) for name in names])
        self._timestep = float(model.opt.timestep)
        # Rows are rewritten where all of them lie; and what MuJoCo calls Euler's step shall only add up.
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_EULERDAMP
        self._rows = np.zeros(0, dtype=int)
        self._of = np.zeros(0, dtype=int)
        self.forget()

    def forget(self) -> None:
        """Forget the largest forces."""
        self.force_N = np.zeros(len(self.regions))
        self.peak_N = np.zeros(len(self.regions))

    def finish_step(self, data: mujoco.MjData) -> None:
        """Do what `mj_step2` does, with springs at the contacts, and take down their forces."""
        model = self._model
        if data.ncon == 0:
            mujoco.mj_step2(model, data)
            self.force_N = np.zeros(len(self.regions))
            return
        # A step without its end: from here on the integrator's inertia and the rows are known.
        mujoco.mj_forwardSkip(model, data, int(mujoco.mjtStage.mjSTAGE_VEL), 1)
        self._press(data)
        mujoco.mj_fwdConstraint(model, data)
        self.force_N = np.bincount(self._of, data.efc_force[self._rows], len(self.regions))
        np.maximum(self.peak_N, self.force_N, out=self.peak_N)
        data.qacc_warmstart[:] = data.qacc
        mujoco.mj_Euler(model, data)

    def _press(self, data: mujoco.MjData) -> None:
        """Make springs of the contacts."""
        contact = data.contact
        rows, pair, depth = contact.efc_address, contact.geom, -contact.dist
        robot = np.where(self._robot[pair[:, 0]], pair[:, 0], pair[:, 1])
        region = self._region[np.where(robot == pair[:, 0], pair[:, 1], pair[:, 0])]
        ours = np.flatnonzero((rows >= 0) & (region >= 0))
        order = ours[np.lexsort((-depth[ours], region[ours], robot[ours]))]
        first = np.ones(len(order), dtype=bool)
        same_robot, same_region = np.diff(robot[order]) == 0, np.diff(region[order]) == 0
        first[1:] = ~(same_robot & same_region)
        deepest, others = order[first], rows[order[~first]]
        here, h = rows[deepest], self._timestep
        strength = self._stiffness[region[deepest]] * (h * h)
        data.efc_D[here], data.efc_R[here] = strength, 1.0 / strength
        data.efc_aref[here] = (depth[deepest] - h * data.efc_vel[here]) / (h * h)
        data.efc_D[others], data.efc_R[others], data.efc_aref[others] = _NOTHING, 1.0 / _NOTHING, 0.0
        self._rows, self._of = here, region[deepest]

    def _region_of(self, name: str) -> int:
        if not name.startswith(TISSUE):
            return -1
        return self.regions.index(name[len(TISSUE) :].rsplit("_", 1)[0])
