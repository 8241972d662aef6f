"""Reads a simulated robot's posture and tensions out of MuJoCo's state."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.drive import Outputs
from catheter_sim.core.law import RobotInModel
from catheter_sim.core.posture import Posture
from catheter_sim.mjcf import names
from catheter_sim.simulation.actuation import Actuation
from catheter_sim.simulation.law_list import LawList


class Readout:
    """What of a robot is read.

    Attributes:
        faces: sites of the elements' distal faces, base to tip, shape (n,).
        dofs: degrees of freedom that are at rest where the robot is.
    """

    def __init__(
        self,
        place: RobotInModel,
        data: mujoco.MjData,
        outputs: Outputs,
        slides: Sequence[str],
    ) -> None:
        """Prepare.

        Args:
            place: where the robot is.
            data: the state.
            outputs: what it reports.
            slides: of the joints that stand still besides where it rests.
        """
        self._model, self._data, self._base = place.model, data, place.base
        self._angles = np.array([place.joint(name).qposadr[0] for name in outputs.joints])
        self.dofs = np.array([place.joint(name).dofadr[0] for name in [*outputs.joints, *slides]])
        self.faces = np.array([place.site(names.face(k)).id for k in range(1, outputs.elements + 1)])

    def span_tension(self, actuation: Actuation, laws: LawList) -> Array:
        """Return the tension of every tendon between its holes, NaN beyond its end, shape (t, n) [N].

        NaN of an input that is no single tendon, such as a catheter's pair.
        """
        tension, ends = actuation.tension(), actuation.controls.spans
        if laws.friction is not None and ends.any():
            return laws.friction.span_tension(self._data, tension)
        inside = np.arange(1, len(self.faces) + 1) <= ends[:, np.newaxis]
        return np.where(inside, tension[:, np.newaxis], np.nan)

    def posture(self, actuation: Actuation, laws: LawList) -> Posture:
        """Return where the robot is now."""
        data = self._data
        spans = self.span_tension(actuation, laws)  # friction knows them as the last step left them
        for place in laws.place:
            place(data)
        mujoco.mj_fwdPosition(self._model, data)
        if laws.friction is None:  # a driven tendon pulls as its length is now
            spans = self.span_tension(actuation, laws)
        p_w, R_w = data.site_xpos[self.faces].copy(), data.site_xmat[self.faces].reshape(-1, 3, 3).copy()
        if self._base is not None:  # the base frame moves in the world
            R_wb = data.xmat[self._base].reshape(3, 3)
            p_w, R_w = (p_w - data.xpos[self._base]) @ R_wb, R_wb.T @ R_w
        return Posture(
            p_w=p_w,
            R_w=R_w,
            joint_angles=data.qpos[self._angles].copy(),
            actuator_tension=actuation.tension(),
            tendon_tension=spans,
        )
