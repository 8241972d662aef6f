"""When the state of a simulated robot is not to be trusted any more."""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import RobotInModel

FARTHEST_RAD = 20.0  # a hinge beyond has wound up
FARTHEST_M = 10.0  # a slide beyond has flown off
LARGEST_INPUT = 1e10  # beyond it MuJoCo puts zeros in the place of all inputs, with no more than a warning
# What MuJoCo has to say of a step whose result is not to be trusted; it goes on all the same. Causes stand
# before what they lead to.
_COMPLAINTS = {
    mujoco.mjtWarning.mjWARN_BADCTRL: f"an input is not finite, or beyond {LARGEST_INPUT:g}; all ignored",
    mujoco.mjtWarning.mjWARN_INERTIA: "an inertia is singular",
    mujoco.mjtWarning.mjWARN_CONTACTFULL: "there are more contacts than it has room for",
    mujoco.mjtWarning.mjWARN_CNSTRFULL: "there are more constraints than it has room for",
    mujoco.mjtWarning.mjWARN_BADQPOS: "a position is not finite, or huge",
    mujoco.mjtWarning.mjWARN_BADQVEL: "a speed is not finite, or huge",
    mujoco.mjtWarning.mjWARN_BADQACC: "an acceleration is not finite, or huge",
}


def farthest(place: RobotInModel) -> Array:
    """Return how far each position may be from zero in a robot that has not come apart, shape (nq,) [rad, m].

    Positions of other joints than the robot's own hinges and slides may be anywhere.
    """
    model, own = place.model, place.joints()
    limit = np.full(model.nq, np.inf)
    for kind, most in (
        (mujoco.mjtJoint.mjJNT_HINGE, FARTHEST_RAD),
        (mujoco.mjtJoint.mjJNT_SLIDE, FARTHEST_M),
    ):
        limit[model.jnt_qposadr[own[model.jnt_type[own] == int(kind)]]] = most
    return limit


class Watch:
    """Looks whether a robot's state is to be trusted."""

    def __init__(self, place: RobotInModel, data: mujoco.MjData) -> None:
        self._data, self._farthest = data, farthest(place)
        self._warned = data.warning.number  # a view: MuJoCo counts on

    def complaint(self) -> str | None:
        """Return None where the state is to be trusted, else why not, "" where MuJoCo has not said.

        So it is not where a position is not finite, a hinge has wound up or a slide has flown off, and where
        MuJoCo has warned in any step since its data was reset: it warns and goes on, having put zeros in the
        place of an input that it finds too large, say.
        """
        reason = next((text for kind, text in _COMPLAINTS.items() if self._warned[int(kind)]), "")
        if reason:  # a scene with too many geoms to draw is warned of, too, and is no matter here
            return f" (MuJoCo: {reason})"
        if (np.abs(self._data.qpos) <= self._farthest).all():  # false of what is not a number
            return None
        return ""
