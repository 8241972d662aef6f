"""The notches of a tube in a simulation: arcs on hinges that move with them, and the metal's law.

A notch bends as an arc. Its link hangs on one hinge for each way to turn, and before every step the hinges
are moved to the lines about which the arc's end turns now, and the link to where the arc ends: position and
velocity are then exact in the tube's plane, whatever the bend; out of it the velocity is short by the share
bend^2 / 24. The strip's stretch follows the tendon's tension a few steps behind.
"""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import Law, RobotInModel, Step, TendonPaths
from catheter_sim.core.law_copies import CopiesLaw, CopyArrays
from catheter_sim.kinds.notched_tube.forces import notch_kernel
from catheter_sim.kinds.notched_tube.layout import HINGES, notches, rest_angles
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot
from catheter_sim.kinds.notched_tube.springs import spring_stiffness
from catheter_sim.kinds.notched_tube.theory.section import fibres, section
from catheter_sim.kinds.notched_tube.theory.stress import knees
from catheter_sim.mechanics import turns_kernel

RADIAL, AROUND = 8, 24  # points over the wall's thickness and its angle: as in the statics


def notch_table(robot: NotchedTubeRobot) -> Array:
    """Return the numbers of `notch_kernel.place` and `resist`, shape (n, 10)."""
    rows, below = [], 0.0
    for notch in notches(robot):
        segment = notch.segment
        bent, aside, _ = rest_angles(notch)
        stiff_x, stiff_y, _ = spring_stiffness(robot, segment)
        elastic = (segment.stiffness_cubic_m2, segment.stiffness_quintic_m4, stiff_x, stiff_y)
        centroid = section(segment).centroid_m
        rows.append((segment.notch_height_m, below, centroid, bent, aside, *elastic, notch.pitch_m))
        below = notch.uncut_m
    return np.array(rows)


class Notches(Law):
    """Keeps hinges and links where the notches' arcs have them, and applies the metal's law."""

    def __init__(self, robot: NotchedTubeRobot, place: RobotInModel) -> None:
        self._model = model = place.model
        row = notches(robot)
        letters = HINGES if robot.bending_axes == "xy" else HINGES[:1]
        named = [[place.joint(f"{letter}{notch.index}").id for letter in letters] for notch in row]
        self._hinge: Index = np.array(named, dtype=np.int64)
        self._body: Index = np.array([place.body(f"link_{notch.index}").id for notch in row], dtype=np.int64)
        self._qpos = model.jnt_qposadr[self._hinge].astype(np.int64)
        self._dofs = model.jnt_dofadr[self._hinge].astype(np.int64)
        self._notch = notch_table(robot)
        self._fibre = np.array([fibres(notch.segment, RADIAL, AROUND) for notch in row])
        metal = robot.material
        modulus = metal.modulus_Pa * robot.stiffness_scale
        self._metal = np.array([modulus, *knees(metal), 1.0 - metal.plateau_slope])
        self._stretch, self._balance = np.zeros(len(row)), np.zeros((len(row), 3))
        self._scratch = np.zeros(notch_kernel.SCRATCH)

    def arrays(self) -> tuple[Index, Index, Index, Index, Array, Array, Array]:
        """Return what the law is made of, arguments of `notch_kernel`.

        Positions, degrees of freedom, hinges, links; notches, fibres, metal.
        """
        places = self._qpos, self._dofs, self._hinge, self._body
        return *places, self._notch, self._fibre, self._metal

    def reset(self) -> None:
        """Give the strips their own lengths back."""
        self._stretch[:] = 0.0

    def before(self, step: Step) -> None:
        """Stretch the strips as the tendon presses them together."""
        spans = step.span_tension()[0]
        if len(spans) == 2 * len(self._stretch):
            tension = spans[::2].copy()
        else:  # nothing rubs: one tension all along
            tension = np.full(len(self._stretch), spans[0])
        notch_kernel.stretch_on(
            step.data.qpos,
            self._qpos,
            self._notch,
            self._fibre,
            self._metal,
            tension,
            float(step.pulls.drive_stiffness()[0]),
            self._stretch,
            self._balance,
            self._scratch,
        )

    def place(self, data: mujoco.MjData) -> None:
        """Put hinges and links where the arcs have them."""
        model = self._model
        notch_kernel.place(
            data.qpos,
            self._qpos,
            self._notch,
            self._stretch,
            self._hinge,
            self._body,
            model.jnt_pos,
            model.jnt_axis,
            model.body_pos,
            model.body_quat,
            self._scratch,
        )

    def between(self, step: Step) -> None:
        """Add what the metal's law has beyond the model's springs."""
        notch_kernel.resist(
            step.data.qpos,
            self._qpos,
            self._notch,
            self._fibre,
            self._metal,
            self._stretch,
            self._dofs,
            step.data.qfrc_applied,
            self._scratch,
        )


class NotchCopies(CopiesLaw):
    """The notches of many copies, each with its strips' stretches."""

    def __init__(self, notches: Notches, arrays: CopyArrays, drive: float) -> None:
        """Prepare; `drive`: stiffness of the tendon's drive, 0 where its tension is given [N/m]."""
        self._qpos, self._dofs, self._hinge, self._body, *self._numbers = notches.arrays()
        self._drive = drive
        self._arrays, count = arrays, len(arrays.qpos)
        fields = "jnt_pos", "jnt_axis", "body_pos", "body_quat"
        self.moved = {name: arrays.own(name) for name in fields}
        self._stretch = np.zeros((count, len(self._body)))
        self._balance = np.zeros((len(self._body), 3))
        self._scratch = np.zeros(notch_kernel.SCRATCH)

    def reset(self, copies: Index) -> None:
        """Give the strips their own lengths back."""
        self._stretch[copies] = 0.0

    def before(self, copies: Index, tension: Array) -> None:
        """Stretch the strips as the tendon presses them together."""
        notch_kernel.stretch_on_of(
            copies,
            self._arrays.qpos,
            self._qpos,
            *self._numbers,
            tension,
            self._drive,
            self._stretch,
            self._balance,
            self._scratch,
        )

    def place(self, copies: Index) -> None:
        """Put hinges and links where the arcs have them."""
        notch_kernel.place_of(
            copies,
            self._arrays.qpos,
            self._qpos,
            self._numbers[0],
            self._stretch,
            self._hinge,
            self._body,
            *self.moved.values(),
            self._scratch,
        )

    def between(self, copies: Index) -> None:
        """Add what the metal's law has beyond the model's springs."""
        notch_kernel.resist_of(
            copies,
            self._arrays.qpos,
            self._qpos,
            *self._numbers,
            self._stretch,
            self._dofs,
            self._arrays.applied,
            self._scratch,
        )


class EdgeTurns:
    """The angles by which the tendon turns at the notches' edges."""

    def __init__(self, robot: NotchedTubeRobot, place: RobotInModel) -> None:
        self._ends = span_ends(robot)
        spans = int(self._ends[0])
        name = robot.tendons[0].name
        self._sites = np.array([[place.site(f"hole_{name}_{k}").id for k in range(spans + 1)]], dtype=int)
        self._turn = np.zeros((1, spans))
        self._base, self._axis = place.base, np.array([0.0, 0.0, 1.0])

    def __call__(self, data: mujoco.MjData, ends: turns_kernel.Index | None = None) -> Array:
        """Return the turn at the edge before each span; see `core.law.Turns`."""
        if self._base is not None:
            self._axis[:] = data.xmat[self._base, 2::3]
        last = self._ends if ends is None else ends
        turns_kernel.spatial_turns(data.site_xpos, self._sites, last, self._axis, self._turn)
        return self._turn

    def of_copies(self, copies: turns_kernel.Index, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Write the turns of some copies into `turn`; see `core.law.Turns`."""
        turns_kernel.spatial_turns_of(copies, site_xpos, self._sites, self._ends, self._axis, turn)


def span_ends(robot: NotchedTubeRobot) -> np.ndarray:
    """Return the number of the tendon's spans: one in each notch and one in the uncut tube after it, (1,)."""
    return np.array([2 * len(notches(robot))], dtype=int)


def paths(robot: NotchedTubeRobot, place: RobotInModel) -> TendonPaths:
    """Return where the tendon rubs: at both edges of each notch."""
    spans = {}
    for notch in notches(robot):
        for letter in HINGES if robot.bending_axes == "xy" else HINGES[:1]:
            spans[int(place.joint(f"{letter}{notch.index}").dofadr[0])] = 2 * (notch.index - 1)
    return TendonPaths(
        names=[f"{place.prefix}tendon_{robot.tendons[0].name}"],
        spans=2 * len(notches(robot)),
        ends=span_ends(robot),
        span_of_dof=spans,
        turns=EdgeTurns(robot, place),
    )
