"""Dry friction of tendons at every hole, with stick and slip, for one robot or many copies."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import Law, Step, TendonPaths, Turns
from catheter_sim.mechanics.capstan import (
    busy_spans,
    solve_tensions,
    solve_tensions_of_copies,
    step_over_inertia,
)
from catheter_sim.mechanics.tendons import TendonRows

# ----------------------------------------------------------------------------------------------------
# Dry friction of tendons at every hole, with stick and slip.
#
# Over a hole at which a tendon turns by phi, its tension T changes to anything in [T exp(-mu phi), T
# exp(+mu phi)] while it sticks there, and to one of the two ends while it slips (capstan). Whether it slips
# at hole k is decided by the length of everything beyond hole k, not by the bending next to it.
#
# MuJoCo has friction loss (a force up to a limit against a velocity), but no capstan.
#
# `CapstanFriction` (shipped, "capstan") computes the tension of every span itself, before each step, and
# hands MuJoCo the difference to the actuators' tension as an applied force. With the velocities that the
# coming step would give, it asks for the tensions that stop every span that friction can stop. Per tendon
# that is a convex problem on a chain, which `span_tensions` solves exactly in a microsecond; tendons that
# share joints are passed over in turn, until none changes by more than a tolerance. Three things save
# passes and time on the way there: tensions go on as in the last step (`start_from_last_change`), passes
# that come nearer by the same share each are cut short (`extrapolate_passes`), and a tendon is first taken
# to slip where it did (`slip_as_before`). At rest the law leaves all tensions as they are, so a held
# posture does not creep. Inertia enters through each degree of freedom's own implicit inertia (armature,
# damping, stiffness) alone: a lower bound of what the integrator uses, so that the law never overcorrects.
#
# A kind's reference law ("nested") leaves the decision to MuJoCo's solver.

SWEEPS = 20  # most passes over tendons that share joints, in one step
MOVING_SWEEPS = 12  # of a robot in motion; what they leave the next step goes on with
STEPS_PER_INERTIA = 4  # of these a robot in motion takes before its inertia is worked out anew
SWEEP_TOLERANCE = 3e-5  # they end when no tension changed by more than this share of the largest


@dataclass(frozen=True)
class LawArrays:
    """The law as plain arrays, for where it runs elsewhere.

    Attributes:
        mu: friction coefficient.
        turns: whence the turns follow.
        spans: n.
        ends, starts, entries, dofs, span, yielding: as in `solve_tensions`.
    """

    mu: float
    turns: Turns
    spans: int
    ends: np.ndarray
    starts: np.ndarray
    entries: np.ndarray
    dofs: np.ndarray
    span: np.ndarray
    yielding: Array


class CapstanFriction(Law):
    """The shipped law; see the module's text."""

    def __init__(self, mu: float, paths: TendonPaths, model: mujoco.MjModel, drive_stiffness: Array) -> None:
        """Prepare the law.

        Args:
            mu: friction coefficient.
            paths: where the tendons rub.
            model: what they are in.
            drive_stiffness: of the actuators against the tendons' lengthening, 0 where the tension is
                given, shape (t,) [N/m].
        """
        self._mu, self._turns, self._ends = mu, paths.turns, paths.ends
        spans, tendons = paths.spans, len(paths.names)
        self._inside = np.arange(1, spans + 1) <= self._ends[:, np.newaxis]  # (t, n)
        self._rows = TendonRows(model, paths.names, set(paths.span_of_dof))
        self._span = np.array([paths.span_of_dof[int(dof)] for dof in self._rows.columns], np.uint64)
        self._lines = self._rows.lines(self._span, self._ends)
        self._timestep = float(model.opt.timestep)
        self._drive = drive_stiffness * self._timestep
        self._model = model
        self.know_joints()
        self._springs = np.zeros(model.nv)  # what springs, implicit, add to the forces per unit of velocity
        self._own, self._steps = np.zeros(model.nv), 0
        self._inverse = np.zeros((0, 0))
        self._tension = np.zeros((tendons, spans))
        self._busy = np.zeros(tendons, dtype=np.int64)
        self._slip = np.zeros((tendons, spans), dtype=np.int8)
        self._past = np.zeros((tendons, spans + 2))
        self._holes = np.zeros((5, tendons, spans))
        self._pulls = np.zeros((2, len(self._span)))
        self._scratch = np.zeros((10, 2 * max(spans, model.nv, tendons)))
        self._shared = np.zeros((2 * tendons + 4 + model.nv, tendons))

    def reset(self) -> None:
        """Forget the history."""
        self._tension[:], self._slip[:], self._past[:] = 0.0, 0, 0.0

    def layout(self) -> LawArrays:
        """Return the law as plain arrays."""
        rows = self._rows
        return LawArrays(
            mu=self._mu,
            turns=self._turns,
            spans=self._tension.shape[1],
            ends=self._ends,
            starts=rows.starts,
            entries=rows.entries,
            dofs=rows.columns,
            span=self._span,
            yielding=self._yielding,
        )

    def know_joints(self) -> None:
        """Take over step, inertia, damping and stiffness of the model; to be called where they changed."""
        model = self._model
        self._timestep = float(model.opt.timestep)
        stiffness = np.zeros(model.nv)
        if model.opt.integrator == int(mujoco.mjtIntegrator.mjINT_DISCRETE):  # where springs are implicit
            stiffness[model.jnt_dofadr] = model.jnt_stiffness
        self._springs = self._timestep * stiffness
        self._own = self._timestep * (model.dof_damping + self._springs)
        self._yielding = self._timestep / (model.dof_armature + self._own)

    def set_drive(self, stiffness: Array) -> None:
        """Set the actuators' stiffness against the tendons' lengthening, shape (t,) [N/m]."""
        self._drive = stiffness * self._timestep

    def between(self, step: Step) -> None:
        """Learn what other laws have changed, and add what friction changes."""
        if step.joints_changed:
            self.know_joints()
            step.joints_changed = False
        if step.pulls_changed:
            self.set_drive(step.pulls.drive_stiffness())
            step.pulls_changed = False
        if step.moving and step.pulls.given:
            self._know_inertia(step.data)
        elif len(self._inverse):
            self._inverse = np.zeros((0, 0))
        self.apply(step.data, step.pulls.tension(step.data))

    def _know_inertia(self, data: mujoco.MjData) -> None:
        """Work out how all joints together yield, every few steps: the posture changes little in between."""
        if not len(self._inverse) or self._steps % STEPS_PER_INERTIA == 0:
            model = self._model
            self._inverse = step_over_inertia(
                data.M, model.M_rowadr, model.M_rownnz, model.M_colind, self._own, self._timestep
            )
        self._steps += 1

    def apply(self, data: mujoco.MjData, actuator_tension: Array) -> None:
        """Find the tensions of the coming step and apply what they pull beyond the actuators.

        Args:
            data: the state.
            actuator_tension: tensions now, below zero where a driven tendon is slack, shape (t,) [N].
        """
        rows, busy, whole = self._rows, self._busy, len(self._inverse) > 0
        passive = data.qfrc_passive - self._springs * data.qvel if whole else data.qfrc_passive
        busy_spans(actuator_tension, self._drive, self._ends, self._tension, busy)
        solve_tensions(
            self._mu,
            actuator_tension,
            self._drive,
            self._turns(data, busy),
            busy,
            data.ten_J,
            rows.starts,
            rows.entries,
            rows.columns,
            self._span,
            self._lines,
            data.qvel,
            passive,
            data.qfrc_bias,
            data.qfrc_constraint,
            data.qfrc_applied,
            self._yielding,
            MOVING_SWEEPS if whole else SWEEPS,
            SWEEP_TOLERANCE,
            self._tension,
            self._slip,
            self._past,
            self._holes,
            self._pulls,
            self._scratch,
            self._shared,
            self._inverse,
        )

    def span_tension(self, data: mujoco.MjData, actuator_tension: Array) -> Array:
        """Return the tension of every tendon in every span after a step, shape (t, n) [N].

        Where several tendons act on one hinge that sticks, statics fixes only one sum of them.
        """
        return np.where(self._inside, self._tension, np.nan)


# ----------------------------------------------------------------------------------------------------
# The shipped friction law of many copies of one robot: `friction.CapstanFriction`, each with its history.


class CapstanCopies(CapstanFriction):
    """The law in the copies of a batch, one compiled loop over them; the numbers are those of one copy."""

    def __init__(
        self,
        mu: float,
        paths: TendonPaths,
        model: mujoco.MjModel,
        batch: Batch,
        drive_stiffness: Array,
        ten_J: Array | None = None,
    ) -> None:
        """Prepare the law.

        Args:
            mu: friction coefficient.
            paths: where the tendons rub.
            model: what they are in.
            batch: its copies.
            drive_stiffness: as of `CapstanFriction`.
            ten_J: where the copies' tendon Jacobians are, shape (m, e); default: in the batch.
        """
        super().__init__(mu, paths, model, drive_stiffness)
        self._turns_of = self._turns.of_copies
        tendons, spans = self._tension.shape
        self._of = np.zeros((2, batch.nsim, tendons, spans))  # tensions and turns
        self._pasts = np.zeros((batch.nsim, tendons, spans + 2))
        self._slips = np.zeros((batch.nsim, tendons, spans), dtype=np.int8)
        names = "qpos", "qvel", "site_xpos", "qfrc_passive", "qfrc_bias", "qfrc_constraint"
        self._bound = {name: batch.bind(name) for name in names}
        self._bound["ten_J"] = batch.bind("ten_J") if ten_J is None else ten_J

    @property
    def tension(self) -> Array:
        """Tension of every tendon in every span after a step, shape (m, t, n) [N]; of use inside its end."""
        return self._of[0]

    def forget(self, copies: Index) -> None:
        """Forget the history of some copies."""
        self._of[0, copies], self._slips[copies], self._pasts[copies] = 0.0, 0, 0.0

    def apply_copies(self, copies: Index, entering: Array, applied: Array) -> None:
        """`apply` in some of the m copies.

        Args:
            copies: which.
            entering: tensions at the actuators now, shape (m, t) [N].
            applied: in and out: applied forces, shape (m, nv).
        """
        rows, bound = self._rows, self._bound
        tension, turn = self._of
        self._turns_of(copies, bound["qpos"], bound["site_xpos"], turn)
        solve_tensions_of_copies(
            copies,
            self._mu,
            entering,
            self._drive,
            turn,
            self._ends,
            bound["ten_J"],
            rows.starts,
            rows.entries,
            rows.columns,
            self._span,
            self._lines,
            bound["qvel"],
            bound["qfrc_passive"],
            bound["qfrc_bias"],
            bound["qfrc_constraint"],
            applied,
            self._yielding,
            SWEEPS,
            SWEEP_TOLERANCE,
            tension,
            self._slips,
            self._pasts,
            self._holes,
            self._pulls,
            self._scratch,
            self._shared,
            self._busy,
            np.zeros((0, 0)),
        )
