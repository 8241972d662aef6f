"""Bending joints of a simulated catheter that resist by Nayar 2023, Algorithm 2.

The law is of a whole joint: its tendon's tension over the bend, higher on the way out than back. Each of
its gaps gets the moment of that tension at the tendon's arm at its own share of the bend. Between the
two curves a gap sticks: it is held by a spring a thousand times stiffer than the joint, which slips at
either curve. Before each step the gap's joint stiffness and rest angle are made the tangent of that, so
that the integrator and the tendons' friction know it; the joint's wires are replaced. Which tangent, the
curve's or the holding spring's, depends on where the coming step goes.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import Law, RobotInModel, Step
from catheter_sim.kinds.catheter.layout import bent_by
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.kinds.catheter.theory.joint_force import LAWS, JointForce
from catheter_sim.mechanics.compiled import compiled

STICK_RATIO = 1e3  # stiffness of a gap that sticks over its law's
# Of the same, where the law asks for no moment: wires bring the joint back. At the 3.4 deg below which the
# proximal joint's law asks for none, it is 0.01 N at the tendon.
LEAST_RATIO = 0.02
DIFFERENCE_DEG = 1e-4
APART = 0.95  # of the outward moment the inward one is less where the two curves count as two


class JointResistance:
    """The gaps of one bending joint and their history."""

    def __init__(self, segment: CatheterSegment, place: RobotInModel) -> None:
        """Start unbent."""
        self._law: JointForce = LAWS[segment.resistance]
        self._segment = segment
        self._gaps = segment.rings + 1
        joints = [place.joint(f"{segment.name}_{gap}") for gap in range(1, self._gaps + 1)]
        self._ids = np.array([joint.id for joint in joints])
        self._qpos = np.array([int(joint.qposadr[0]) for joint in joints])
        self._dofs = np.array([int(joint.dofadr[0]) for joint in joints])
        self._model = model = place.model
        # per radian of one gap: its moment is the joint's, its angle a share of the joint's bend
        self._scale = np.degrees(1.0) * self._law.loading[1] * segment.arm_m * self._gaps
        law = self._law
        self._numbers = tuple(np.array(item) for item in (law.loading, law.bounds_deg, law.c_1, law.c_2))
        self._own = model.jnt_stiffness[self._ids].copy(), model.qpos_spring[self._qpos].copy()
        self.reset()

    def reset(self) -> None:
        """Return to unbent gaps without history."""
        self._model.jnt_stiffness[self._ids], self._model.qpos_spring[self._qpos] = self._own
        self._angle = np.zeros(self._gaps)
        self._moment = np.zeros(self._gaps)
        self._turn = np.zeros((2, self._gaps))  # toward + and toward - [deg]

    def arrays(self) -> tuple[list[np.ndarray], list[Array]]:
        """Return the law as plain arrays with a row for each gap, for where it runs elsewhere.

        Returns:
            Places in MuJoCo: joints, positions, degrees of freedom. Numbers: gaps of the joint, moment
            per radian [N m/rad], arm and half gap, (n, 2) [m], and of Algorithm 2 `loading`, (n, 4),
            `bounds_deg`, (n, 2), `c_1` and `c_2`, (n, 3).
        """
        arms = np.array([self._segment.arm_m, self._segment.half_gap_m])
        numbers = np.array(float(self._gaps)), np.array(self._scale), arms, *self._numbers
        rows = [np.repeat(item[np.newaxis], self._gaps, axis=0) for item in numbers]
        return [self._ids, self._qpos, self._dofs], rows

    def update(self, data: mujoco.MjData) -> None:
        """Let the gaps' springs have the moments of the law at the present angles, before a step."""
        angle = data.qpos[self._qpos]
        stuck = self._moment + STICK_RATIO * self._scale * (angle - self._angle)
        low, high = self._bounds(angle)
        moment = np.clip(stuck, low, high)
        nudge = np.radians(DIFFERENCE_DEG) / self._gaps
        low_on, high_on = self._bounds(angle + nudge)
        # The forces of the step before say where the coming one goes.
        pulled = data.qfrc_actuator[self._dofs] + data.qfrc_applied[self._dofs]
        slope = np.where(
            (stuck > high) & (pulled >= moment), (high_on - high) / nudge, STICK_RATIO * self._scale
        )
        slope = np.where((stuck < low) & (pulled <= moment), (low_on - low) / nudge, slope)
        slope = np.maximum(slope, LEAST_RATIO * self._scale)
        bend = np.degrees(np.abs(angle)) * self._gaps
        side = np.where(angle >= 0.0, 0, 1)
        outward = np.where(angle >= 0.0, stuck >= high, stuck <= low)
        # Just below a turn both curves are one: a gap that trembles there has not turned again.
        apart = np.abs(np.where(angle >= 0.0, low, high)) < APART * np.abs(np.where(angle >= 0.0, high, low))
        own = np.arange(self._gaps)
        before = self._turn[side, own]
        self._turn[side, own] = np.where((outward & apart) | (bend > before), bend, before)
        self._angle, self._moment = angle.copy(), moment
        self._model.jnt_stiffness[self._ids] = slope
        self._model.qpos_spring[self._qpos] = angle - moment / slope

    def _bounds(self, angle: Array) -> tuple[Array, Array]:
        """Return the moments at which the gaps slip back and on, with the angle's sign, each (n,) [N m]."""
        segment = self._segment
        loading, bounds_deg, c_1, c_2 = self._numbers
        low, high = np.empty(self._gaps), np.empty(self._gaps)
        least = LEAST_RATIO * self._scale
        _slipping(
            angle,
            self._turn,
            segment.arm_m,
            segment.half_gap_m,
            least,
            loading,
            bounds_deg,
            c_1,
            c_2,
            low,
            high,
        )
        return low, high


@compiled
def _slipping(
    angle: Array,
    turn_deg: Array,
    arm_m: float,
    half_gap_m: float,
    least: float,
    loading: Array,
    bounds_deg: Array,
    c_1: Array,
    c_2: Array,
    low: Array,
    high: Array,
) -> None:
    """Write the moments at which the gaps of a joint slip back and on, as `joint_force` has them.

    Args:
        angle: of the gaps, shape (n,) [rad].
        turn_deg: to which each was last loaded, toward + and toward -, shape (2, n) [deg].
        arm_m, half_gap_m: of the joint's tendons and gaps [m].
        least: stiffness below which no moment falls [N m/rad].
        loading, bounds_deg, c_1, c_2: Algorithm 2.
        low, high: out, shape (n,) [N m].
    """
    gaps = len(angle)
    for k in range(gaps):
        size = abs(angle[k])
        bend, half = math.degrees(size) * gaps, 0.5 * size
        arm = arm_m * math.cos(half) + half_gap_m * math.sin(half)
        tension = loading[0] + bend * (loading[1] + bend * (loading[2] + bend * loading[3]))
        tension = max(tension, 0.0)
        turn = turn_deg[0 if angle[k] >= 0.0 else 1, k]
        piece = 0 if turn <= bounds_deg[0] else (1 if turn <= bounds_deg[1] else 2)
        back = 0.0
        if turn > 0.0:
            power = (min(bend, turn) / (turn + 0.01)) ** c_2[piece]
            back = min(tension / c_1[piece] * math.atanh(power), tension)
        on = max(tension * arm, least * size)
        back = max(back * arm, least * size)
        low[k], high[k] = (back, on) if angle[k] >= 0.0 else (-on, -back)


class JointResistances(Law):
    """The bending joints whose resistance was measured, in the order of their pairs.

    Attributes:
        joints: of each its gaps.
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel) -> None:
        self.joints = [JointResistance(segment, place) for segment in measured_joints(robot)]

    def reset(self) -> None:
        """Return to unbent gaps without history."""
        for joint in self.joints:
            joint.reset()

    def before(self, step: Step) -> None:
        """Let the joints resist as measured at the present angles."""
        for joint in self.joints:
            joint.update(step.data)
        step.joints_changed = True


def measured_joints(robot: CatheterRobot) -> list[CatheterSegment]:
    """Return the bending segments whose resistance was measured, in the order of their pairs."""
    return [segment for segment in bent_by(robot).values() if segment.resistance in LAWS]
