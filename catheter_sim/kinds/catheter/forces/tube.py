"""Lets a simulated catheter's exposed tubes bend as beams of their present length."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.core.law import Law, RobotInModel, Step
from catheter_sim.kinds.catheter.layout import bending_tubes, tube_stiffness_N_m2
from catheter_sim.kinds.catheter.mjcf.tube import tube_joint_names, tube_spring
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.kinds.catheter.theory.tube import SKEW_STIFFNESS, chord_share, end_turn, end_twist_rad

# A shorter tube bends like one of this length. At no advance the module then yields by M / EI times it,
# where it should not: 0.006 deg under 1 N mm at an EI of 100 N mm^2.
SHORTEST_M = 1e-5


@dataclass(frozen=True)
class TubeArrays:
    """A tube as plain arrays, for where it runs elsewhere.

    Attributes:
        places: in MuJoCo: the hinges' positions toward x and y, at the exit and at the inlet, the slide's,
            the twist's; the slide's degree of freedom, its actuator, the springs against the whole bend
            and against skew, two each, shape (12,).
        curvature: at rest, toward x and y, shape (2,) [1/m].
        beyond_m: length of what the tube carries.
        springs: stiffness against the whole bend times length, and its part that no length changes,
            shape (2,) [N m^2, N m].
        drive_stiffness: of the drive [N/m].
    """

    places: np.ndarray
    curvature: np.ndarray
    beyond_m: float
    springs: np.ndarray
    drive_stiffness: float


class Tube:
    """One exposed tube: what the model's springs and drive are made before each step.

    The springs are given the law's moments at the present angles (through their rest lengths) and, for
    the integrator, which takes it implicitly, its stiffness near straight. The axial load of the law is
    that of the step before. The drive holds the length of the tube, not of the chord: its spring is the
    tangent. What the drive would feel of the bending energy that changes with the length is left out.
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel, segment: CatheterSegment) -> None:
        self._robot, self._segment = robot, segment
        self._model = model = place.model
        own = robot.segments.index(segment)
        self._beyond_m = sum(part.length_m for part in robot.segments[own:])
        self._curvature = (segment.tube_curvature_x_per_m, segment.tube_curvature_y_per_m)
        hinges = [int(place.joint(name).qposadr[0]) for name in tube_joint_names(segment)]
        self._exit_x, self._exit_y, self._twist, self._inlet_y, self._inlet_x = hinges
        self._slide = int(place.joint(segment.name).qposadr[0])
        self._slide_dof = int(place.joint(segment.name).dofadr[0])
        self._bend = [int(place.tendon(f"bend_{segment.name}_{axis}").id) for axis in "xy"]
        self._skew = [int(place.tendon(f"skew_{segment.name}_{axis}").id) for axis in "xy"]
        pair = next(item for item in robot.tendons if item.moves == segment.name)
        self._drive = int(place.actuator(f"tendon_{pair.name}").id)
        self._drive_stiffness = float(model.actuator_gainprm[self._drive, 0])

    def layout(self) -> TubeArrays:
        """Return what `bend` needs to know of the tube."""
        hinges = [self._exit_x, self._exit_y, self._inlet_x, self._inlet_y, self._slide, self._twist]
        places = [*hinges, self._slide_dof, self._drive, *self._bend, *self._skew]
        # EI over the length, or a stiffness that is the same at every length
        elastic = math.isfinite(tube_stiffness_N_m2(self._robot, self._segment))
        spring = tube_spring(self._robot, self._segment, 1.0)
        return TubeArrays(
            places=np.array(places),
            curvature=np.array(self._curvature),
            beyond_m=self._beyond_m,
            springs=np.array([spring, 0.0] if elastic else [0.0, spring]),
            drive_stiffness=self._drive_stiffness,
        )

    def reset(self) -> None:
        """Make the unloaded tube of no length straight."""
        self._model.qpos_spring[self._twist] = 0.0

    def bend(self, data: mujoco.MjData) -> None:
        """Let springs and drive be those of the present length and angles; to be called before a step."""
        model, q = self._model, data.qpos
        exit_x, exit_y, inlet_x, inlet_y = (
            float(q[k]) for k in (self._exit_x, self._exit_y, self._inlet_x, self._inlet_y)
        )
        chord = float(q[self._slide])
        (ax, ay), (axx, axy, ayx, ayy) = end_turn(exit_x, exit_y)
        (bx, by), (bxx, bxy, byx, byy) = end_turn(inlet_x, inlet_y)
        bend, skew = (ax + bx, ay + by), (ax - bx, ay - by)
        share, on_bend, on_skew = chord_share(math.hypot(*bend), math.hypot(*skew))
        length = max(chord / share, 0.0)
        stiffness = tube_spring(self._robot, self._segment, max(length, SHORTEST_M))
        # what pushes the module outward, as of the last step
        dof = self._slide_dof
        load = data.qfrc_smooth[dof] - data.qfrc_passive[dof] - data.qfrc_actuator[dof]
        load = float(load + data.qfrc_constraint[dof])
        axial = load * length
        moment = [
            (
                axial * on_bend * bend[k] - stiffness * (bend[k] - self._curvature[k] * length),
                axial * on_skew * skew[k] - SKEW_STIFFNESS * stiffness * skew[k],
            )
            for k in (0, 1)
        ]
        (mx, nx), (my, ny) = moment
        # A pull at the end holds the tube straight, which the integrator cannot know by itself.
        held = max(load, 0.0) * (length + self._beyond_m)
        tangent = stiffness + held, SKEW_STIFFNESS * stiffness + held
        # on the hinges at either end
        exit_moment = axx * (mx + nx) + ayx * (my + ny), axy * (mx + nx) + ayy * (my + ny)
        inlet_moment = bxx * (mx - nx) + byx * (my - ny), bxy * (mx - nx) + byy * (my - ny)
        angles = ((exit_x, inlet_x), (exit_y, inlet_y))
        for k, (near, far) in enumerate(angles):
            whole = 0.5 * (exit_moment[k] + inlet_moment[k])
            half = 0.5 * (exit_moment[k] - inlet_moment[k])
            self._set(self._bend[k], near + far - self._curvature[k] * chord, whole, tangent[0])
            self._set(self._skew[k], near - far, half, tangent[1])
        model.qpos_spring[self._twist] = end_twist_rad(inlet_x, inlet_y) - end_twist_rad(exit_x, exit_y)
        model.actuator_gainprm[self._drive, 0] = self._drive_stiffness / share
        model.actuator_biasprm[self._drive, 1] = -self._drive_stiffness / share**2

    def _set(self, spring: int, length: float, moment: float, stiffness: float) -> None:
        """Give a spring its stiffness, and the rest at which it pulls with the moment at its length."""
        self._model.tendon_stiffness[spring] = stiffness
        self._model.tendon_lengthspring[spring] = length + moment / stiffness


class Tubes(Law):
    """The exposed tubes that bend, base to tip.

    Attributes:
        tubes: each of them.
    """

    def __init__(self, robot: CatheterRobot, place: RobotInModel) -> None:
        self.tubes = [Tube(robot, place, segment) for segment in bending_tubes(robot)]

    def reset(self) -> None:
        """Make the unloaded tubes of no length straight."""
        for tube in self.tubes:
            tube.reset()

    def before(self, step: Step) -> None:
        """Let the tubes bend as beams of their present length."""
        for tube in self.tubes:
            tube.bend(step.data)
