"""The reference law of friction: the decision at every hole is left to MuJoCo's solver.

One tendon per hole, from the hole to the tendon's end, whose velocity is exactly the sliding speed there,
with a friction loss T sinh(mu phi) and a pull T (cosh(mu phi) - 1). Its cost grows with the square of the
number of holes. It takes the tensions from the previous step.
"""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import Law, RobotInModel, Step
from catheter_sim.kinds.continuum.forces.paths import HoleTurns, hinge_spans, span_count, span_ends
from catheter_sim.kinds.continuum.friction_tails import SMALLEST_LIMIT
from catheter_sim.kinds.continuum.layout import last_disk
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.mechanics.capstan.together import add_pull
from catheter_sim.mechanics.tendon_rows import TendonRows


def friction_rows(model: mujoco.MjModel, names: list[str]) -> np.ndarray:
    """Return the rows of the constraint forces that belong to the friction of the named tendons.

    The rows stay where they are, because no friction limit is ever set to zero.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    kind = int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON)
    row_of = {int(data.efc_id[row]): row for row in range(data.nefc) if int(data.efc_type[row]) == kind}
    return np.array([row_of[model.tendon(name).id] for name in names], dtype=int)


class NestedFriction(Law):
    """The reference law, hole by hole; see the module's text."""

    def __init__(self, robot: ContinuumRobot, place: RobotInModel) -> None:
        self._model = model = place.model
        self._mu = robot.friction.mu
        self._turns = HoleTurns(robot, place)
        self._inside = np.arange(1, span_count(robot) + 1) <= span_ends(robot)[:, np.newaxis]
        names = [
            f"tail_{tendon.name}_{k}" for tendon in robot.tendons for k in range(last_disk(robot, tendon))
        ]
        self._ids = np.array([model.tendon(name).id for name in names])
        self._rows = friction_rows(model, names)
        self._tails = TendonRows(model, names, set(hinge_spans(robot, place)))

    def _march(self, data: mujoco.MjData, tension: Array) -> tuple[Array, Array, Array]:
        """Return limits, pulls, and tensions behind each hole, each of shape (t, n)."""
        angle = self._mu * self._turns(data)
        force = np.zeros(self._inside.shape)
        force[self._inside] = data.efc_force[self._rows] if data.nefc else 0.0
        limit, pull, behind = (np.zeros(self._inside.shape) for _ in range(3))
        current = tension.copy()
        for k in range(self._inside.shape[1]):
            limit[:, k] = current * np.sinh(angle[:, k])
            pull[:, k] = current * (np.cosh(angle[:, k]) - 1.0)
            current = current + pull[:, k] - np.clip(force[:, k], -limit[:, k], limit[:, k])
            behind[:, k] = current
        return limit, pull, behind

    def between(self, step: Step) -> None:
        """Set the friction limits of the tails and their pulls."""
        data = step.data
        limit, pull, _ = self._march(data, np.maximum(step.pulls.tension(data), 0.0))
        tails = self._tails
        add_pull(
            data.ten_J, tails.starts, tails.entries, tails.columns, pull[self._inside], data.qfrc_applied
        )
        self._model.tendon_frictionloss[self._ids] = np.maximum(limit[self._inside], SMALLEST_LIMIT)

    def span_tension(self, data: mujoco.MjData, actuator_tension: Array) -> Array:
        """Return the tension of every tendon in every span, shape (t, n) [N]."""
        return np.where(self._inside, self._march(data, actuator_tension)[2], np.nan)
