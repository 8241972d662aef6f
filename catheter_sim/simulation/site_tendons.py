"""Lengths and Jacobians of tendons that run straight from site to site, for one robot or many copies."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import Views
from catheter_sim.mechanics.compiled import compiled

# ----------------------------------------------------------------------------------------------------
# Lengths and Jacobians of tendons that run straight from site to site, at a cost that grows as their
# length.
#
# `mujoco.mj_tendon` goes through all degrees of freedom below either end of every straight stretch, so that
# a chain of n cells costs n^2 a tendon, and more than half of a step from some thirty cells on. A stretch's
# length, though, depends only on the joints between the bodies at its two ends: one or two hinges.
# `SiteTendons` lets the engine find no tendon paths in `mj_step1` and fills in what it would have found, so
# that the state is what `mj_step1` alone would leave; the tests hold every number to the engine's.

Int32 = NDArray[np.int32]


def _joints_to_world(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the joints that move `body`, those nearest to it first."""
    joints: list[int] = []
    while body > 0:
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        joints += range(first + count - 1, first - 1, -1)
        body = int(model.body_parentid[body])
    return joints


def applies(model: mujoco.MjModel) -> bool:
    """Return whether `SiteTendons` knows all that `mj_step1` derives from the tendons of `model`.

    So it is where they run from site to site only and have neither springs, dampers, limits, friction nor
    inertia of their own. All joints are hinges or slides, and no sensor or equality may need the paths.
    """
    scalar = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    own = (
        model.tendon_stiffness,
        model.tendon_damping,
        model.tendon_limited,
        model.tendon_frictionloss,
        model.tendon_armature,
    )
    return bool(
        model.ntendon > 0
        and (model.wrap_type == int(mujoco.mjtWrap.mjWRAP_SITE)).all()
        and np.isin(model.jnt_type, scalar).all()
        and not any(array.any() for array in own)
        and model.neq == model.nsensor == model.nflex == 0
    )


class SiteTendons:
    """The tendons of one model and state."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Prepare; `applies(model)` must hold."""
        self._model = model
        self._count = model.tendon_num.copy()
        stretches: list[tuple[int, int, int]] = []  # tendon, site, site
        ends = [0]  # of each stretch's parts
        parts: list[tuple[int, int, int]] = []  # joint, 1 if it moves the second site else -1, place in ten_J
        for tendon in range(model.ntendon):
            first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
            row, used = int(model.ten_J_rowadr[tendon]), int(model.ten_J_rownnz[tendon])
            place = {int(dof): row + k for k, dof in enumerate(model.ten_J_colind[row : row + used])}
            sites = [int(site) for site in model.wrap_objid[first : first + count]]
            for near, far in pairwise(sites):
                below, above = (_joints_to_world(model, int(model.site_bodyid[site])) for site in (near, far))
                stretches.append((tendon, near, far))
                for sign, joints, others in ((1, above, below), (-1, below, above)):
                    moved = [joint for joint in joints if joint not in others]
                    parts += [(joint, sign, place[int(model.jnt_dofadr[joint])]) for joint in moved]
                ends.append(len(parts))
        self._known = (  # as of `_find_slopes`
            np.array(stretches, dtype=np.int64).reshape(-1, 3),
            np.array(ends, dtype=np.int64),
            np.array(parts, dtype=np.int64).reshape(-1, 3),
            model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE),
        )
        pulling = np.flatnonzero(model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON))
        self._actuators = np.stack([pulling, model.actuator_trnid[pulling, 0]], axis=1).astype(np.int64)
        self._sites = model.wrap_objid.astype(np.int64)
        self._rows = model.ten_J_rowadr, model.ten_J_rownnz, model.ten_J_colind
        self._gear = model.actuator_gear
        self._places = Views("site_xpos", "xanchor", "xaxis", "ten_length", "ten_J")
        self._velocities = Views("qvel", "ten_velocity")
        self._gears = Views("actuator_velocity")
        self._paths = Views("site_xpos", "ten_wrapadr", "ten_wrapnum", "wrap_obj", "wrap_xpos")

    @contextmanager
    def instead_of_the_engine(self, data: mujoco.MjData) -> Iterator[None]:
        """Let the engine find no paths in `mj_step1`; `find` must follow each. They are drawn at the end."""
        self._model.tendon_num[:] = 0
        try:
            yield
        finally:
            self._model.tendon_num[:] = self._count
            _draw_paths(self._count, self._sites, *self._paths(data))

    def find(self, data: mujoco.MjData) -> None:
        """Fill in what `mj_step1` leaves out: lengths, Jacobian and velocities, the actuators' too."""
        places = self._places(data)
        _find_slopes(*self._known, *places)
        pulled = self._actuators, self._gear, *self._gears(data)
        _find_velocities(places[-1], *self._rows, *self._velocities(data), *pulled)
        mujoco.mj_transmission(self._model, data)


@compiled
def _find_slopes(
    stretches: Index,
    ends: Index,
    parts: Index,
    slides: NDArray[np.bool_],
    site_xpos: Array,
    xanchor: Array,
    xaxis: Array,
    ten_length: Array,
    ten_J: Array,
) -> None:
    """Write the tendons' lengths and their slopes.

    Args:
        stretches: tendon and the sites at either end of each straight stretch, shape (s, 3).
        ends: first row of each stretch in `parts`, shape (s + 1,).
        parts: joint, 1 or -1 where it moves the second or the first site, and place in `ten_J` of each
            joint that changes a stretch's length, shape (p, 3).
        slides: whether a joint is a slide, else it is a hinge, shape (njnt,).
        site_xpos, xanchor, xaxis: the engine's.
        ten_length, ten_J: out: lengths [m], and their slopes [m/rad], of a slide [1].
    """
    ten_length[:] = 0.0
    ten_J[:] = 0.0
    for k in range(stretches.shape[0]):
        tendon, near, far = stretches[k, 0], stretches[k, 1], stretches[k, 2]
        ux = site_xpos[far, 0] - site_xpos[near, 0]
        uy = site_xpos[far, 1] - site_xpos[near, 1]
        uz = site_xpos[far, 2] - site_xpos[near, 2]
        length = math.sqrt(ux * ux + uy * uy + uz * uz)
        ten_length[tendon] += length
        if length == 0.0:
            continue
        ux, uy, uz = ux / length, uy / length, uz / length
        for p in range(ends[k], ends[k + 1]):
            joint, sign = parts[p, 0], parts[p, 1]
            ax, ay, az = xaxis[joint, 0], xaxis[joint, 1], xaxis[joint, 2]
            if slides[joint]:
                slope = ux * ax + uy * ay + uz * az
            else:
                site = far if sign > 0 else near
                rx = site_xpos[site, 0] - xanchor[joint, 0]
                ry = site_xpos[site, 1] - xanchor[joint, 1]
                rz = site_xpos[site, 2] - xanchor[joint, 2]
                slope = ux * (ay * rz - az * ry) + uy * (az * rx - ax * rz) + uz * (ax * ry - ay * rx)
            ten_J[parts[p, 2]] += sign * slope


@compiled
def find_slopes_of(
    copies: Index,
    stretches: Index,
    ends: Index,
    parts: Index,
    slides: NDArray[np.bool_],
    site_xpos: Array,
    xanchor: Array,
    xaxis: Array,
    ten_J: Array,
) -> None:
    """Write the slopes of many robots' tendons: an axis of m before theirs; `copies` picks some."""
    ten_length = np.empty(stretches[:, 0].max() + 1)
    for i in copies:
        _find_slopes(stretches, ends, parts, slides, site_xpos[i], xanchor[i], xaxis[i], ten_length, ten_J[i])


@compiled
def _find_velocities(
    ten_J: Array,
    row_start: Int32,
    row_count: Int32,
    column: Int32,
    qvel: Array,
    ten_velocity: Array,
    actuators: Index,
    gear: Array,
    actuator_velocity: Array,
) -> None:
    """Write the velocities of tendons, by their sparse slopes, and of actuators, (a, 2) with theirs [m/s]."""
    for j in range(ten_velocity.shape[0]):
        velocity = 0.0
        for place in range(row_start[j], row_start[j] + row_count[j]):
            velocity += ten_J[place] * qvel[column[place]]
        ten_velocity[j] = velocity
    for k in range(actuators.shape[0]):
        actuator, tendon = actuators[k, 0], actuators[k, 1]
        actuator_velocity[actuator] = gear[actuator, 0] * ten_velocity[tendon]


@compiled
def _draw_paths(
    path_count: Int32,
    path_sites: Index,
    site_xpos: Array,
    ten_wrapadr: Int32,
    ten_wrapnum: Int32,
    wrap_obj: Int32,
    wrap_xpos: Array,
) -> None:
    """Write the paths as they are drawn, of so many sites each, all of them in order."""
    point = 0
    for j in range(path_count.shape[0]):
        ten_wrapadr[j], ten_wrapnum[j] = point, path_count[j]
        for _ in range(path_count[j]):
            row, half, site = point // 2, point % 2, path_sites[point]
            wrap_obj[row, half] = -1  # a site
            for axis in range(3):
                wrap_xpos[row, 3 * half + axis] = site_xpos[site, axis]
            point += 1


# ----------------------------------------------------------------------------------------------------
# The tendons' paths in many copies of one robot whose pulls are given: `site_tendons`, for a batch.
#
# More than half of MuJoCo's step of a chain goes into them. A batch lets nobody write a Jacobian into its
# copies, so that these find no paths at all; the actuators' pulls come by the applied forces, through
# slopes that are found here. Tension that does not depend on lengths is all that this can be for.


class PathCopies(SiteTendons):
    """The paths in the copies of a batch of `pathless(model)`.

    Attributes:
        ten_J: of each copy, as MuJoCo's sparse rows, shape (m, e).
    """

    def __init__(self, model: mujoco.MjModel, batch: Batch) -> None:
        """Prepare; `site_tendons.applies(model)` must hold, and each actuator pull its own tendon."""
        super().__init__(model)
        row, count = model.ten_J_rowadr, model.ten_J_rownnz
        self.ten_J = np.zeros((batch.nsim, int((row + count).max())))
        tendons = model.actuator_trnid[:, 0]
        self._pulled = np.stack([row[tendons], count[tendons]], axis=1).astype(np.int64)
        self._column = model.ten_J_colind.astype(np.int64)
        self._points, self._anchors, self._axes = (
            batch.bind(name) for name in ("site_xpos", "xanchor", "xaxis")
        )

    def find_in(self, copies: Index) -> None:
        """Fill in some copies' `ten_J` at their present positions."""
        find_slopes_of(copies, *self._known, self._points, self._anchors, self._axes, self.ten_J)

    def pull_in(self, copies: Index, tension: Array, applied: Array) -> None:
        """Add what tendons at tensions (m, t) [N] pull to the applied forces (m, nv) of some copies."""
        _pull_in(copies, self._pulled, self._column, self.ten_J, tension, applied)


def pathless(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy of `model` whose tendons have no paths and pull nothing."""
    without = copy.copy(model)
    without.tendon_num[:] = 0
    return without


@compiled
def _pull_in(
    copies: Index, pulled: Index, column: Index, ten_J: Array, tension: Array, applied: Array
) -> None:
    """Take the pulls of actuators, `pulled` (t, 2): first entry and number of each one's row in `ten_J`."""
    for i in copies:
        for j in range(pulled.shape[0]):
            pull = max(tension[i, j], 0.0)
            for place in range(pulled[j, 0], pulled[j, 0] + pulled[j, 1]):
                applied[i, column[place]] -= ten_J[i, place] * pull
