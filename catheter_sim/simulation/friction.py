"""Dry friction of tendons at every hole, with stick and slip, for one robot or many copies."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco.batch import Batch

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import Law, Step, TendonPaths, Views
from catheter_sim.mechanics.capstan import (
    NUMBERS,
    MotionOfCopies,
    Tendons,
    busy_spans,
    new_block,
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


class CapstanFriction(Law):
    """The shipped law; see the module's text.

    Attributes:
        mu: friction coefficient.
        turns: whence the turns follow.
        tendons: where the tendons pull.
    """

    def __init__(self, mu: float, paths: TendonPaths, model: mujoco.MjModel, drive_stiffness: Array) -> None:
        """Prepare the law.

        Args:
            mu: friction coefficient.
            paths: where the tendons rub.
            model: what they are in.
            drive_stiffness: of the actuators against the tendons' lengthening, 0 where the tension is
                given, shape (t,) [N/m].
        """
        self.mu, self.turns, self._model = mu, paths.turns, model
        count, self.spans = len(paths.names), paths.spans
        rows = TendonRows(model, paths.names, set(paths.span_of_dof))
        span = np.array([paths.span_of_dof[int(dof)] for dof in rows.columns], np.uint64)
        lines = rows.lines(span, paths.ends)
        self.tendons = Tendons(paths.ends, rows.starts, rows.entries, rows.columns, span, lines)
        self._counts = np.stack([paths.ends, np.zeros_like(paths.ends), lines]).astype(np.int64)
        self._places = np.concatenate([rows.starts, rows.entries, rows.columns, span])
        numbers = mu, float(SWEEPS), SWEEP_TOLERANCE
        self._block = new_block(numbers, count, self.spans, len(span), model.nv)
        self._whole, self._steps = False, 0
        self.know_joints()
        self.set_drive(drive_stiffness)
        self._history = np.zeros((3, count, self.spans + 2))
        self._forces = Views("qfrc_passive", "qfrc_bias", "qfrc_constraint", "qfrc_applied")
        self._rates = Views("ten_J", "qvel")

    @property
    def yielding(self) -> Array:
        """Timestep over effective implicit inertia of each degree of freedom, shape (nv,)."""
        first = NUMBERS + self._counts.shape[1]
        return self._block[first : first + self._model.nv]

    def reset(self) -> None:
        """Forget the history."""
        self._history[:] = 0.0

    def know_joints(self) -> None:
        """Take over step, inertia, damping and stiffness of the model; to be called where they changed."""
        model = self._model
        self._timestep = float(model.opt.timestep)
        stiffness = np.zeros(model.nv)
        if model.opt.integrator == int(mujoco.mjtIntegrator.mjINT_DISCRETE):  # where springs are implicit
            stiffness[model.jnt_dofadr] = model.jnt_stiffness
        # What implicit springs add to the forces per unit of velocity; what they and damping add to inertia.
        self._springs = self._timestep * stiffness
        self._own = self._timestep * (model.dof_damping + self._springs)
        self.yielding[:] = self._timestep / (model.dof_armature + self._own)

    def set_drive(self, stiffness: Array) -> None:
        """Set the actuators' stiffness against the tendons' lengthening, shape (t,) [N/m]."""
        self._block[NUMBERS : NUMBERS + len(stiffness)] = stiffness * self._timestep

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
        elif self._whole:
            self._take_whole(False)
        self.apply(step.data, step.pulls.tension(step.data))

    def _know_inertia(self, data: mujoco.MjData) -> None:
        """Work out how all joints together yield, every few steps: the posture changes little in between."""
        if not self._whole or self._steps % STEPS_PER_INERTIA == 0:
            model = self._model
            inverse = step_over_inertia(
                data.M, model.M_rowadr, model.M_rownnz, model.M_colind, self._own, self._timestep
            )
            self._block[-inverse.size :] = inverse.ravel()
            self._take_whole(True)
        self._steps += 1

    def _take_whole(self, whole: bool) -> None:
        """Let all joints yield together from now on, or each by itself."""
        self._whole = whole
        self._block[1], self._block[3] = MOVING_SWEEPS if whole else SWEEPS, whole

    def apply(self, data: mujoco.MjData, actuator_tension: Array) -> None:
        """Find the tensions of the coming step and apply what they pull beyond the actuators.

        The actuators' tensions, (t,) [N], are below zero where a driven tendon is slack.
        """
        (passive, *others), (slopes, velocity) = self._forces(data), self._rates(data)
        if self._whole:
            passive = passive - self._springs * velocity
        busy_spans(self._block, self._history, self._counts, actuator_tension)
        own = self._block, self._history, self._counts, self._places
        turn = self.turns(data, self._counts[1])
        solve_tensions(*own, slopes, actuator_tension, turn, velocity, passive, *others)

    def span_tension(self, data: mujoco.MjData, actuator_tension: Array) -> Array:
        """Return the tension of every tendon in every span after a step, shape (t, n) [N].

        Where several tendons act on one hinge that sticks, statics fixes only one sum of them.
        """
        inside = np.arange(1, self.spans + 1) <= self._counts[0][:, np.newaxis]
        return np.where(inside, self._history[0, :, : self.spans], np.nan)


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
            mu, paths, model, drive_stiffness: as of `CapstanFriction`.
            batch: copies of the model.
            ten_J: where the copies' tendon Jacobians are, shape (m, e); default: in the batch.
        """
        super().__init__(mu, paths, model, drive_stiffness)
        self._turn = np.zeros((batch.nsim, len(paths.names), self.spans))
        self._histories = np.zeros((batch.nsim, *self._history.shape))
        names = "qvel", "qfrc_passive", "qfrc_bias", "qfrc_constraint"
        self._motion = MotionOfCopies(*(batch.bind(name) for name in names))
        self._qpos, self._sites = batch.bind("qpos"), batch.bind("site_xpos")
        self._ten_J = batch.bind("ten_J") if ten_J is None else ten_J

    @property
    def tension(self) -> Array:
        """Tension of every tendon in every span after a step, shape (m, t, n) [N]; of use inside its end."""
        return self._histories[:, 0, :, : self.spans]

    def forget(self, copies: Index) -> None:
        """Forget the history of some copies."""
        self._histories[copies] = 0.0

    def apply_copies(self, copies: Index, entering: Array, applied: Array) -> None:
        """`apply` in some of m copies: tensions at the actuators (m, t) [N]; applied forces (m, nv)."""
        self.turns.of_copies(copies, self._qpos, self._sites, self._turn)
        own = self._block, self._histories, self._counts, self._places
        solve_tensions_of_copies(copies, *own, self._ten_J, entering, self._turn, self._motion, applied)
