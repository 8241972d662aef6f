"""Tissue as springs at the contacts that MuJoCo finds, and the forces that it feels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.modelling.attach import TOUCH

# ----------------------------------------------------------------------------------------------------
# Inner loop of tissue's springs, compiled: which contacts press, and their rows; see `simulation.tissue`.

SAME = 0.99  # cosine: two contacts with normals nearer to each other than 8 deg press once
NOTHING = 1e-12  # in place of D: a contact that presses with nothing


class ContactArrays(NamedTuple):
    """MuJoCo's n contacts: rows (-1: none), geoms (n, 2), distance (below zero: overlap) [m], frames."""

    efc_address: NDArray[np.int32]
    geom: NDArray[np.int32]
    dist: Array
    frame: Array  # (n, 9): first the normal, from the first geom to the second


class Geoms(NamedTuple):
    """What is known of g geoms, and of the regions that are tissue.

    Attributes:
        is_robot, region: of each geom; region -1 is no tissue, shape (g,).
        facing: of each geom the unit normal of its free face, or zeros where all of it is free, (g, 3).
        stiffness: of each region, shape (r,) [N/m].
    """

    is_robot: NDArray[np.bool_]
    region: Index
    facing: Array
    stiffness: Array


class ConstraintRows(NamedTuple):
    """MuJoCo's rows of constraints: speed from each other [m/s], D, R, a_ref; the last three are written."""

    velocity: Array
    strength: Array
    resistance: Array
    reference: Array


@compiled
def press(
    contacts: ContactArrays,
    geoms: Geoms,
    rows: ConstraintRows,
    timestep: float,
    pressing: Index,
    pressed: Index,
) -> int:
    """Rewrite the contacts' rows; return how many press.

    Written besides: the rows that press, and their regions, shape (n,) each.
    """
    pair, is_robot, region, facing = contacts.geom, geoms.is_robot, geoms.region, geoms.facing
    count = 0
    order = np.argsort(contacts.dist)
    kept = np.zeros(len(order), dtype=np.int64)
    normal = np.zeros((len(order), 3))
    for contact in order:
        row = contacts.efc_address[contact]
        first, second = pair[contact, 0], pair[contact, 1]
        robot, tissue, sign = first, second, -1.0
        if not is_robot[first]:
            robot, tissue, sign = second, first, 1.0
        if row < 0 or region[tissue] < 0:
            continue
        for axis in range(3):
            normal[contact, axis] = sign * contacts.frame[contact, axis]
        presses, deepest = True, True
        for number in range(count):
            other = kept[number]
            touched = pair[other, 1] if is_robot[pair[other, 0]] else pair[other, 0]
            toucher = pair[other, 0] if is_robot[pair[other, 0]] else pair[other, 1]
            if toucher != robot or region[touched] != region[tissue]:
                continue
            deepest = False
            cosine = 0.0
            for axis in range(3):
                cosine += normal[contact, axis] * normal[other, axis]
            if cosine > SAME:
                presses = False
                break
        if presses and not deepest:  # besides the deepest, only faces press: seams between blocks do not
            free, cosine = 0.0, 0.0
            for axis in range(3):
                free += facing[tissue, axis] ** 2
                cosine += normal[contact, axis] * facing[tissue, axis]
            presses = free == 0.0 or cosine > SAME
        if not presses:
            rows.strength[row], rows.resistance[row], rows.reference[row] = NOTHING, 1.0 / NOTHING, 0.0
            continue
        value = geoms.stiffness[region[tissue]] * timestep * timestep
        rows.strength[row], rows.resistance[row] = value, 1.0 / value
        depth = -contacts.dist[contact]
        rows.reference[row] = (depth - timestep * rows.velocity[row]) / (timestep * timestep)
        kept[count] = contact
        pressing[count], pressed[count] = row, region[tissue]
        count += 1
    return count


# ----------------------------------------------------------------------------------------------------
# Tissue as springs at the contacts that MuJoCo finds, and the forces that it feels.
#
# MuJoCo's own contacts have no stiffness that could be stated in N/m: it depends on inertias and posture.
# An explicit spring (`catheter_sim.procedure.operate`) is stable only where it is not much stiffer than the
# robot; a thin robot's tip gives way at a few hundredths of a newton per metre. Here the spring is part of
# the step's own equations: the rows of MuJoCo's contact constraints, f = D (a_ref - a), are rewritten
# before they are solved so that the force is K times the depth at the end of the step,
#
# f = K (depth - h v - h^2 a), D = K h^2, a_ref = (depth - h v) / h^2,
#
# with h the time step, v and a the speed and acceleration of the surfaces from each other; MuJoCo's solver
# keeps f from pulling. So every stiffness is stable, and at rest the force is K times the depth. A contact
# must be known before it presses, or the robot would jump through the wall and out again, having next to no
# inertia: a geom's `margin` says how far before.

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
        """Prepare for a model with geoms `tissue_<region>_<k>` and each region's stiffness under one."""
        self.regions = tuple(stiffness_N_per_m)
        names = [model.geom(geom).name for geom in range(model.ngeom)]
        self._model = model
        facing = np.zeros((model.ngeom, 3))
        facing[:, : model.nuser_geom] = model.geom_user[:, :3]
        self._geoms = Geoms(
            np.array([name.startswith(TOUCH) for name in names]),
            np.array([self._region_of(name) for name in names]),
            facing,
            np.array(list(stiffness_N_per_m.values())),
        )
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
        contacts = ContactArrays(contact.efc_address, contact.geom, contact.dist, contact.frame)
        rows = ConstraintRows(data.efc_vel, data.efc_D, data.efc_R, data.efc_aref)
        count = press(contacts, self._geoms, rows, float(self._model.opt.timestep), pressing, pressed)
        return pressing[:count], pressed[:count]

    def _region_of(self, name: str) -> int:
        if not name.startswith(TISSUE):
            return -1
        return self.regions.index(name[len(TISSUE) :].rsplit("_", 1)[0])
