"""Forces and moments on a robot's elements, which keep their directions in the base frame."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array
from catheter_sim.core.law import RobotInModel
from catheter_sim.core.loads import LinkForce, check_links
from catheter_sim.mjcf import names


class Loads:
    """What acts now on the tip and on other points of a robot.

    The point of a force on an element is given in the frame of the body that carries the element's distal
    face: for a link with a rolling joint as in `LinkForce`; for a continuum robot's element its origin is the
    element's last hinge.

    Attributes:
        force_tip: on the tip, world frame, shape (3,) [N].
        per_element: sum of the other forces on each element, base to tip, world frame, shape (n, 3) [N].
    """

    def __init__(self, place: RobotInModel, elements: int) -> None:
        """Prepare for a robot of so many elements, without loads."""
        self._base = place.base
        self._body = [int(place.site(names.face(k)).bodyid.item()) for k in range(1, elements + 1)]
        self._face = [int(place.site(names.face(k)).id) for k in range(1, elements + 1)]
        self._tip, self._tip_body = int(place.site(names.TIP).id), int(place.site(names.TIP).bodyid.item())
        self._force, self._moment = np.zeros(3), np.zeros(3)  # base frame
        self._others: tuple[LinkForce, ...] = ()
        # element from 0, point in its body's frame or None for its face, force and moment in the world frame
        self._acting: list[tuple[int, Array | None, Array, Array]] = []
        self.force_tip, self._moment_tip = self._force, self._moment
        if self._base is not None:
            self.force_tip, self._moment_tip = np.zeros(3), np.zeros(3)
        self.per_element = np.zeros((elements, 3))
        self._any = False
        self._given: set[int] = set()  # bodies that `put` has given something

    def set(self, force_tip: ArrayLike, moment_tip: ArrayLike, others: Sequence[LinkForce] = ()) -> None:
        """Let these act from now on, and no others; base frame.

        Raises:
            InputError: a force on an element that the robot does not have.
        """
        self._force[:], self._moment[:] = force_tip, moment_tip
        if others or self._others:
            check_links(others, len(self._body))
            self._others = tuple(others)
            self._point_others(None)
        self._any = bool(self._force.any() or self._moment.any() or others)

    def turn(self, data: mujoco.MjData) -> None:
        """Turn the loads with the base where it moves."""
        if self._base is None or not self._any:
            return
        R_wb = data.xmat[self._base].reshape(3, 3)
        self.force_tip[:], self._moment_tip[:] = R_wb @ self._force, R_wb @ self._moment
        self._point_others(R_wb)

    def apply(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Add the forces and moments to `data.qfrc_applied`."""
        if not self._any:
            return
        place, applied = data.site_xpos[self._tip], data.qfrc_applied
        mujoco.mj_applyFT(model, data, self.force_tip, self._moment_tip, place, self._tip_body, applied)
        for element, point, force, moment in self._acting:
            body, place = self._body[element], self._place(data, element, point)
            mujoco.mj_applyFT(model, data, force, moment, place, body, applied)

    def put(self, data: mujoco.MjData) -> None:
        """Give the forces and moments to the bodies, in `data.xfrc_applied`: for a step of several stages.

        Within a step they keep their arms about the bodies' centres of mass.
        """
        if not (self._any or self._given):
            return
        given = data.xfrc_applied
        for body in self._given:
            given[body] = 0.0
        acting = [(self._tip_body, data.site_xpos[self._tip], self.force_tip, self._moment_tip)]
        for element, point, force, moment in self._acting:
            acting.append((self._body[element], self._place(data, element, point), force, moment))
        for body, place, force, moment in acting:
            given[body, :3] += force
            given[body, 3:] += moment + np.cross(place - data.xipos[body], force)
        self._given = {body for body, *_ in acting}

    def _place(self, data: mujoco.MjData, element: int, point: Array | None) -> Array:
        """Return where an element's point is in the world, (3,); None: the middle of its distal face."""
        if point is None:
            return data.site_xpos[self._face[element]]
        body = self._body[element]
        return np.asarray(data.xpos[body] + data.xmat[body].reshape(3, 3) @ point)

    def _point_others(self, R_wb: Array | None) -> None:
        """Find the other forces in the world frame; None: it is the base frame."""
        self._acting = []
        for item in self._others:
            force, moment = np.array(item.force_N, float), np.array(item.moment_Nm, float)
            if R_wb is not None:
                force, moment = R_wb @ force, R_wb @ moment
            point = None if item.point_m is None else np.array(item.point_m, float)
            self._acting.append((item.link - 1, point, force, moment))
        self.per_element[:] = 0.0
        for item, (_, _, force, _) in zip(self._others, self._acting, strict=True):
            self.per_element[item.link - 1] += force
