"""Tissue as springs at the contacts that MuJoCo finds, and the forces that it feels.

MuJoCo's own contacts have no stiffness that could be stated in N/m: it depends on inertias and posture.
An explicit spring (`catheter_sim.procedure.contact`) is stable only where it is not much stiffer than the
robot; a thin robot's tip gives way at a few hundredths of a newton per metre. Here the spring is part of the
step's own equations: the rows of MuJoCo's contact constraints, f = D (a_ref - a), are rewritten before they
are solved so that the force is K times the depth at the end of the step,

    f = K (depth - h v - h^2 a),   D = K h^2,   a_ref = (depth - h v) / h^2,

with h the time step, v and a the speed and acceleration of the surfaces from each other; MuJoCo's solver
keeps f from pulling. So every stiffness is stable, and at rest the force is K times the depth. A contact must
be known before it presses, or the robot would jump through the wall and out again, having next to no
inertia: a geom's `margin` says how far before.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.modelling.surroundings import TOUCH
from catheter_sim.simulation import tissue_kernel

TISSUE = "tissue_"  # geoms `tissue_<region>_<k>` belong to a region


class Tissue:
    """The surroundings of a simulated robot: regions, each with its stiffness and the force on it.

    Each geom of the robot presses on a region at its deepest contact, and besides on faces that look another
    way; so the seams between a wall's convex blocks are not felt.

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
        self._facing = np.zeros((model.ngeom, 3))
        self._facing[:, : model.nuser_geom] = model.geom_user[:, :3]
        # Rows are rewritten where all of them lie; and what MuJoCo calls Euler's step shall only add up.
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_EULERDAMP
        self.forget()

    def forget(self) -> None:
        """Forget the largest forces."""
        self.force_N: Array = np.zeros(len(self.regions))
        self.peak_N: Array = np.zeros(len(self.regions))

    def finish_step(self, data: mujoco.MjData) -> None:
        """Do what `mj_step2` does, with springs at the contacts, and take down their forces."""
        model = self._model
        if data.ncon == 0:
            mujoco.mj_step2(model, data)
            self.force_N = np.zeros(len(self.regions))
            return
        # A step without its end: from here on the integrator's inertia and the rows are known.
        mujoco.mj_forwardSkip(model, data, int(mujoco.mjtStage.mjSTAGE_VEL), 1)
        rows, regions = self._press(data)
        mujoco.mj_fwdConstraint(model, data)
        self.force_N = np.bincount(regions, data.efc_force[rows], len(self.regions)).astype(float)
        np.maximum(self.peak_N, self.force_N, out=self.peak_N)
        data.qacc_warmstart[:] = data.qacc
        mujoco.mj_Euler(model, data)

    def _press(self, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
        """Make springs of the contacts; return the rows that press, and the regions that they press on."""
        contact = data.contact
        pressing, pressed = np.zeros((2, data.ncon), dtype=np.int64)
        count = tissue_kernel.press(
            contact.efc_address,
            contact.geom,
            contact.dist,
            contact.frame,
            self._robot,
            self._region,
            self._facing,
            self._stiffness,
            float(self._model.opt.timestep),
            data.efc_vel,
            data.efc_D,
            data.efc_R,
            data.efc_aref,
            pressing,
            pressed,
        )
        return pressing[:count], pressed[:count]

    def _region_of(self, name: str) -> int:
        if not name.startswith(TISSUE):
            return -1
        return self.regions.index(name[len(TISSUE) :].rsplit("_", 1)[0])
