"""A robot in MuJoCo: inputs in, steps, posture out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from catheter_sim.effects.apply import driven_by, wholly_built_in
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.mjcf.catheter_tube import tube_joint_names
from catheter_sim.mjcf.remembered import remembered_mjcf
from catheter_sim.robots.catheter import CatheterRobot, CatheterSegment
from catheter_sim.robots.catheter_layout import bending_tubes, moving
from catheter_sim.robots.channels import body_count, joint_names
from catheter_sim.robots.kinds import Robot, require_continuum
from catheter_sim.robots.posture import Array, Posture
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.simulation.catheter import CatheterDrive
from catheter_sim.simulation.elastic_law import ElasticRemainder
from catheter_sim.simulation.friction import CapstanFriction, Friction
from catheter_sim.simulation.link_forces import LinkForces
from catheter_sim.simulation.nested_friction import NestedFriction
from catheter_sim.simulation.rolling import RodElasticity, Rolling
from catheter_sim.simulation.site_tendons import SiteTendons, applies
from catheter_sim.simulation.tendon_spans import span_counts
from catheter_sim.simulation.tissue import Tissue
from catheter_sim.statics.rolling.loads import LinkForce

FRICTION_ROUTES = ("capstan", "nested", "none")
# Reference friction law only. MuJoCo softens a friction constraint by R = (1 - d)/d A, where d is at
# most 0.9999 and A the inverse inertia at the constraint: a stuck tendon of tiny inertia creeps. R is
# made smaller by this factor, through A. A hundredth stops the creep; at a ten-thousandth the solver
# no longer converges.
FRICTION_SOFTNESS = 0.01
LIGHTER = 1e3  # by which a quasi-static run makes the masses smaller and gravity larger
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
SETTLE_BLOCK_S = 0.05  # simulated time between two looks whether the robot is at rest
SETTLED_ANGLE_RAD = 2e-6  # at rest: what a hinge would still move in one relaxation time
ZERO_WRENCH = (0.0, 0.0, 0.0)


def _take_inertia_away(model: mujoco.MjModel) -> None:
    """Make all masses smaller and gravity larger by one factor: the same weights, next to no inertia."""
    model.body_mass[:] /= LIGHTER
    model.body_inertia[:] /= LIGHTER
    model.opt.gravity[:] *= LIGHTER
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _slides(robot: CatheterRobot) -> list[CatheterSegment]:
    """Return the segments that are pushed out along their axes."""
    return [robot.segments[k] for k in moving(robot) if robot.segments[k].joint == "prismatic"]


def farthest(model: mujoco.MjModel) -> Array:
    """Return how far each position may be from zero in a robot that has not come apart, shape (nq,) [rad, m].

    Positions of other joints than hinges and slides may be anywhere.
    """
    limit = np.full(model.nq, np.inf)
    for kind, most in (
        (mujoco.mjtJoint.mjJNT_HINGE, FARTHEST_RAD),
        (mujoco.mjtJoint.mjJNT_SLIDE, FARTHEST_M),
    ):
        limit[model.jnt_qposadr[model.jnt_type == int(kind)]] = most
    return limit


def clamp_of_slack(force_before: Array) -> Array:
    """Return the largest forces of actuators: none push, but those are left alone that pulled before."""
    return np.where(force_before < 0.0, 1e9, 0.0)


@dataclass(frozen=True)
class Parts:
    """What a simulator does beside MuJoCo's own step, and where, for `copies.Copies`.

    Attributes:
        angles: where in the positions the robot's hinges are, shape (m,).
        dofs: degrees of freedom that are at rest where the robot is.
        faces: sites of the elements' distal faces, base to tip, shape (n,).
        pulls, tendons: actuators of the tendons that are pulled, and these, shape (k,).
        gain, bias, length_gain: of these actuators: force = gain control + bias + length_gain length.
        catheter, rolling, elastic, friction: None where the robot has no need of them.
        splits: whether forces are added between a step's two halves.
    """

    angles: np.ndarray
    dofs: np.ndarray
    faces: np.ndarray
    pulls: np.ndarray
    tendons: np.ndarray
    gain: Array
    bias: Array
    length_gain: Array
    catheter: CatheterDrive | None
    rolling: Rolling | None
    elastic: ElasticRemainder | RodElasticity | None
    friction: Friction | None

    @property
    def splits(self) -> bool:
        return not (self.catheter is self.elastic is self.friction is None)


class Simulator:
    """One robot's model and state.

    Attributes:
        robot: what is simulated, effects built in.
        actuation: "tension" or "displacement".
        model, data: MuJoCo's, free to be read.
        tissue: the surroundings' regions and what they feel; None where none are.
    """

    def __init__(
        self,
        robot: Robot,
        actuation: str | None = None,
        gravity_mps2: ArrayLike = ZERO_WRENCH,
        friction: str = "capstan",
        inertia: bool = True,
        model_text: str | None = None,
        tissue_N_per_m: Mapping[str, float] | None = None,
    ) -> None:
        """Build the model.

        Args:
            robot: the robot; such of its `effects` as act on the robot itself are built in.
            actuation: "tension" or "displacement"; default: the robot's own.
            gravity_mps2: gravity in the base frame [m/s^2].
            friction: "capstan" (shipped), "nested" (reference) or "none".
            inertia: False takes the masses' inertia away and keeps their weight, for motion that is
                meant to be quasi-static.
            model_text: MJCF of the robot in surroundings, with the names and the order of `build_mjcf`;
                default: that of the robot alone.
            tissue_N_per_m: of surroundings whose regions press back as springs (`Tissue`), each region's
                stiffness; default: what contacts do is left to MuJoCo.

        Raises:
            InputError: the robot cannot be built, `friction` is unknown, or not for this kind of robot, or
                an effect acts on inputs or outputs: that needs their whole history, which steps have not.
        """
        if friction not in FRICTION_ROUTES:
            raise unknown("friction route", friction, FRICTION_ROUTES)
        self.actuation = actuation or robot.actuation
        if robot.effects:
            if model_text is not None:
                raise InputError(f"{robot.name}: effects: build them in before the model's text is written")
            robot = wholly_built_in(driven_by(robot, self.actuation))
        nested = friction == "nested" and robot.friction.mu > 0
        if nested:
            require_continuum(robot, "the nested reference of friction")
        self.robot = robot
        text = remembered_mjcf(robot, self.actuation, nested) if model_text is None else model_text
        self.model = mujoco.MjModel.from_xml_string(text)
        self.model.opt.gravity[:] = gravity_mps2
        if not inertia:
            _take_inertia_away(self.model)
        # A state that is not finite must be seen, not reset to zero.
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.model.tendon_invweight0[:] *= FRICTION_SOFTNESS
        self.data = mujoco.MjData(self.model)
        self._farthest = farthest(self.model)
        self._warned: NDArray[np.int32] = self.data.warning.number  # a view: MuJoCo counts on
        self._tension_driven = self.actuation == "tension"
        names = joint_names(robot)
        self._angles = np.array([self.model.joint(name).qposadr[0] for name in names])
        if isinstance(robot, CatheterRobot):
            names = names + [segment.name for segment in _slides(robot)]
            names += [name for segment in bending_tubes(robot) for name in tube_joint_names(segment)]
        self._dofs = np.array([self.model.joint(name).dofadr[0] for name in names])
        self._faces = np.array([self.model.site(f"face_{k}").id for k in range(1, body_count(robot) + 1)])
        self._inside = np.arange(1, len(self._faces) + 1) <= span_counts(robot)[:, np.newaxis]
        self._tip_body = int(self.model.site("tip").bodyid.item())
        self._tip = int(self.model.site("tip").id)
        self._force, self._moment = np.zeros(3), np.zeros(3)
        self._others = LinkForces(robot, self.model)
        self._pushed = False
        self.tissue = None if tissue_N_per_m is None else Tissue(self.model, tissue_N_per_m)
        self._catheter: CatheterDrive | None = None
        pulls = np.flatnonzero(self.model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON))
        if isinstance(robot, CatheterRobot):
            self._catheter = CatheterDrive(robot, self.model)
            pulls = self._catheter.pulls  # a catheter has other actuators too
        self._pulls, self._tendons = pulls, self.model.actuator_trnid[pulls, 0]
        self._gain = self.model.actuator_gainprm[pulls, 0].copy()
        self._bias, self._length_gain = self.model.actuator_biasprm[pulls, :2].T.copy()
        self._ctrl_before = np.zeros(len(pulls))
        self._rolling: Rolling | None = None
        self._elastic: ElasticRemainder | RodElasticity | None = None
        if isinstance(robot, RollingRobot):
            self._rolling = Rolling(robot, self.model)
            self._elastic = RodElasticity(robot, self.model)
        elif not isinstance(robot, CatheterRobot):
            remainder = ElasticRemainder(robot, self.model)
            self._elastic = remainder if remainder.needed else None
        # Control ranges are for sliders; a simulation takes what it is given.
        self.model.actuator_ctrllimited[:] = 0
        self._friction: Friction | None = None
        self._capstan: CapstanFriction | None = None
        if robot.friction.mu > 0 and friction != "none":
            drive = np.zeros(len(pulls)) if self._tension_driven else -self._length_gain
            if nested:
                self._friction = NestedFriction(require_continuum(robot, "nested"), self.model)
            else:
                self._friction = self._capstan = CapstanFriction(robot, self.model, drive)
        # Stiff antagonists would make 1e-8 of what the two ways differ by: driven tendons keep the engine's.
        own_paths = self._tension_driven and applies(self.model)
        self._paths = SiteTendons(self.model) if own_paths else None
        self.reset()

    def reset(self) -> None:
        """Return to rest: the unloaded shape, zero inputs, no friction history."""
        mujoco.mj_resetData(self.model, self.data)
        if self._catheter is not None:
            self._catheter.reset()
        self.set_inputs(np.zeros(len(self.robot.tendons)))
        self._ctrl_before[:] = 0.0
        if self._friction is not None:
            self._friction.reset()
        self.data.qpos[:] = self.model.qpos_spring
        if self._rolling is not None:
            self._rolling.reset()
            self._rolling.place(self.data)
        if self.tissue is not None:
            self.tissue.forget()
        mujoco.mj_forward(self.model, self.data)

    def set_inputs(
        self,
        tendon: Array,
        force_tip: ArrayLike = ZERO_WRENCH,
        moment_tip: ArrayLike = ZERO_WRENCH,
        others: Sequence[LinkForce] = (),
    ) -> None:
        """Set the inputs of the following steps.

        Args:
            tendon: tension [N] or displacement [m] of each tendon, of a catheter each pair's displacement
                and the tube's advance, shape (t,).
            force_tip: on the tip, base frame, shape (3,) [N].
            moment_tip: on the tip, base frame, shape (3,) [N m].
            others: further forces, at points of elements (`LinkForces` says in which frame).

        Raises:
            InputError: a force on an element that the robot does not have, or a catheter's displacement
                beyond its joint's range.
        """
        if self._catheter is None:
            self.data.ctrl[self._pulls] = tendon
        else:
            controls = self._catheter.controls(tendon)
            self.data.ctrl[: len(controls)] = controls
        self._force[:], self._moment[:] = force_tip, moment_tip
        if others or self._others:
            self._others.set(others)
        self._pushed = bool(self._force.any() or self._moment.any() or others)

    def actuator_tension(self) -> Array:
        """Return the tendons' tensions at the actuator, shape (t,) [N]; of a pair the tauter one's."""
        tension = np.maximum(self._tension_now(), 0.0)
        if self._catheter is None:
            return tension
        return self._catheter.pair_tension(self.data.qpos, self.data.ctrl, tension)

    @property
    def driven(self) -> np.ndarray:
        """The controls that the inputs set, in their order, shape (k,)."""
        if self._catheter is None:
            return self._pulls
        return np.arange(self._catheter.control_count)

    def parts(self) -> Parts:
        """Return what is done beside MuJoCo's own step."""
        return Parts(
            self._angles,
            self._dofs,
            self._faces,
            self._pulls,
            self._tendons,
            self._gain,
            self._bias,
            self._length_gain,
            self._catheter,
            self._rolling,
            self._elastic,
            self._friction,
        )

    def step(self, count: int = 1) -> None:
        """Take `count` steps under the present inputs.

        Raises:
            SimulationDiverged: a law beside MuJoCo's own fails on a state that is not finite; otherwise
                only `require_finite` looks.
        """
        try:
            if self._paths is None:
                self._step(count)
                return
            with self._paths.instead_of_the_engine():
                self._step(count)
        except Exception:
            self.require_finite()  # what failed may be no more than the first to meet a NaN
            raise

    def _step(self, count: int) -> None:
        model, data, friction = self.model, self.data, self._friction
        for _ in range(count):
            if self._rolling is not None:
                if self._rolling.compressible:
                    self._rolling.compress(data, self.span_tension(), self._force, self._others.per_element)
                self._rolling.place(data)
            if self._catheter is not None:
                self._catheter.bend_tubes(data)
                if self._catheter.resist(data) and self._capstan is not None:
                    self._capstan.know_joints()
            mujoco.mj_step1(model, data)
            if self._paths is not None:
                self._paths.find(data)
            if self._catheter is not None:
                self._catheter.turn(data)
                arrays = self._gain, self._bias, self._length_gain
                if self._catheter.stretch(data, *arrays) and self._capstan is not None:
                    self._capstan.set_drive(-self._length_gain)
            if not self._tension_driven:
                self._let_taut_tendons_slacken()
            data.qfrc_applied[:] = 0.0
            if self._pushed:
                mujoco.mj_applyFT(
                    model,
                    data,
                    self._force,
                    self._moment,
                    data.site_xpos[self._tip],
                    self._tip_body,
                    data.qfrc_applied,
                )
                self._others.apply(model, data)
            if self._elastic is not None:
                self._elastic.apply(data)
            if friction is not None:
                friction.apply(data, self._tension_now())
            if self.tissue is None:
                mujoco.mj_step2(model, data)
            else:
                self.tissue.finish_step(data)

    def _let_taut_tendons_slacken(self) -> None:
        """Clamp at zero only the tensions of tendons that were slack before the command changed.

        MuJoCo clamps an actuator's force at the start of a step and then leaves its stiffness out of
        the implicit solution: a stiff tendon that is paid out would jump between taut and slack at
        every step. Left unclamped for the step in which it slackens, it ends near zero by itself.
        """
        before = self._gain * self._ctrl_before + self._bias
        before += self._length_gain * self.data.ten_length[self._tendons]
        self.model.actuator_forcerange[self._pulls, 1] = clamp_of_slack(before)
        self._ctrl_before[:] = self.data.ctrl[self._pulls]

    def _tension_now(self) -> Array:
        """Return the tensions of what actuators pull, below zero where a driven tendon is slack [N]."""
        data = self.data
        if self._tension_driven:
            return data.ctrl[self._pulls]
        force = (
            self._gain * data.ctrl[self._pulls]
            + self._bias
            + self._length_gain * data.ten_length[self._tendons]
        )
        return -force

    def require_finite(self) -> None:
        """Raise `SimulationDiverged` if the state is not to be trusted, and say since when and why.

        So it is where a position is not finite, a hinge has wound up or a slide has flown off, and where
        MuJoCo has warned in any step since `reset`: it warns and goes on, having put zeros in the place of
        an input that it finds too large, say.
        """
        reason = next((text for kind, text in _COMPLAINTS.items() if self._warned[int(kind)]), "")
        if reason:  # a scene with too many geoms to draw is warned of, too, and is no matter here
            reason = f" (MuJoCo: {reason})"
        elif (np.abs(self.data.qpos) <= self._farthest).all():  # false of what is not a number
            return
        raise SimulationDiverged(
            f"{self.robot.name}: the simulation diverged at {self.data.time:.3f} simulated seconds{reason}"
        )

    def settle(self, longest_s: float = 5.0) -> bool:
        """Step under the present inputs until the robot is at rest; return whether it came to rest.

        At rest is a robot whose fastest hinge would move by less than `SETTLED_ANGLE_RAD` in one
        relaxation time, and a tube that is advanced by as many meters.
        """
        steps = max(1, round(SETTLE_BLOCK_S / self.model.opt.timestep))
        slowest = SETTLED_ANGLE_RAD / self.robot.dynamics.relaxation_time_s
        for _ in range(max(1, round(longest_s / (steps * self.model.opt.timestep)))):
            self.step(steps)
            self.require_finite()
            if np.abs(self.data.qvel[self._dofs]).max() < slowest:
                return True
        return False

    def span_tension(self) -> Array:
        """Return the tension of every tendon between its holes, NaN beyond its end, shape (t, n) [N].

        NaN of a catheter: its pairs are two tendons each.
        """
        tension = self.actuator_tension()
        if self._friction is not None and self._catheter is None:
            return self._friction.span_tension(self.data, tension)
        return np.where(self._inside, tension[:, np.newaxis], np.nan)

    def posture(self) -> Posture:
        """Return where the robot is now."""
        spans = self.span_tension()
        if self._rolling is not None:
            self._rolling.place(self.data)
        mujoco.mj_fwdPosition(self.model, self.data)
        return Posture(
            p_w=self.data.site_xpos[self._faces].copy(),
            R_w=self.data.site_xmat[self._faces].reshape(-1, 3, 3).copy(),
            joint_angles=self.data.qpos[self._angles].copy(),
            actuator_tension=self.actuator_tension(),
            tendon_tension=spans,
        )
