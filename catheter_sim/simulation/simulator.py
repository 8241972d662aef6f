"""A robot in MuJoCo: inputs in, steps, posture out."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array
from catheter_sim.catalogue import robot_of
from catheter_sim.channels import checked_actuation
from catheter_sim.core.drive import Quantity, driven_by
from catheter_sim.core.law import RobotInModel, Step
from catheter_sim.core.loads import LinkForce
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import wholly_built_in
from catheter_sim.errors import InputError, SimulationDiverged, require_type, shown
from catheter_sim.modelling.model_cache import remembered_mjcf
from catheter_sim.robots import kind_of
from catheter_sim.simulation.actuation import Actuation, checked_inputs, checked_numbers
from catheter_sim.simulation.divergence import Watch
from catheter_sim.simulation.law_list import find_laws, needs_reference_friction
from catheter_sim.simulation.loads import Loads
from catheter_sim.simulation.motion import MotionNumbers, motion_numbers, put_numbers
from catheter_sim.simulation.readout import Readout
from catheter_sim.simulation.servo_lag import ServoLag
from catheter_sim.simulation.site_tendons import SiteTendons, applies
from catheter_sim.simulation.tissue import Tissue
from catheter_sim.simulation.together import settle_together, share, sharing, take_steps

# Reference friction law only. MuJoCo softens a friction constraint by R = (1 - d)/d A, where d is at
# most 0.9999 and A the inverse inertia at the constraint: a stuck tendon of tiny inertia creeps. R is
# made smaller by this factor, through A. A hundredth stops the creep; at a ten-thousandth the solver
# no longer converges.
FRICTION_SOFTNESS = 0.01
LIGHTER = 1e3  # by which a quasi-static run makes the masses smaller and gravity larger
SETTLED_ANGLE_RAD = 2e-6  # at rest: what a hinge would still move in one relaxation time
ZERO_WRENCH = (0.0, 0.0, 0.0)
_RK4 = int(mujoco.mjtIntegrator.mjINT_RK4)


def _take_inertia_away(model: mujoco.MjModel) -> None:
    """Make all masses smaller and gravity larger by one factor: the same weights, next to no inertia."""
    model.body_mass[:] /= LIGHTER
    model.body_inertia[:] /= LIGHTER
    model.opt.gravity[:] *= LIGHTER
    mujoco.mj_setConst(model, mujoco.MjData(model))


class Simulator:
    """A robot's MuJoCo model and state, with the laws that run beside each step.

    The robot is at rest under zero inputs after construction and after `reset`. Laws that need the
    state run between `mj_step1` and `mj_step2` (`core.law`).

    Attributes:
        robot: with the effects that act on it built in.
        actuation: what the inputs are, "tension" or "displacement".
        model, data: MuJoCo's, free to be read.
        place: the robot in the model.
        laws: what runs beside each step.
        controls, pulls: what stands between inputs and actuators, and those that pull tendons.
        faces: sites of the elements' distal faces, base to tip, shape (n,).
        dofs: degrees of freedom that are at rest where the robot is.
        tissue: the surroundings' regions and what they feel; None where none are.
        moving: whether the robot moves as it is, with inertia and its own damping (`let_go`).
        shares: whether it stands in a model that holds more.

    Examples:
        >>> import catheter_sim as cs
        >>> simulator = cs.Simulator(cs.load_robot("neuroendoscope_section"))
        >>> simulator.set_inputs([0.4, 0.0])
        >>> simulator.settle()
        True
        >>> (1e3 * simulator.posture().p_w[-1]).round(1)
        array([40.5,  0. , 36. ])
    """

    def __init__(
        self,
        robot: RobotSpec | str | os.PathLike[str],
        actuation: str | None = None,
        gravity_mps2: ArrayLike = ZERO_WRENCH,
        friction: str = "capstan",
        inertia: bool = True,
        model_text: str | None = None,
        tissue_N_per_m: Mapping[str, float] | None = None,
        model: mujoco.MjModel | None = None,
        data: mujoco.MjData | None = None,
        prefix: str = "",
    ) -> None:
        """Build the model, or find the robot in one that holds more (`modelling.attach`).

        In such a model several robots may be simulated at once: one simulator each, all with the same `data`.
        A step of one of them takes the others along; keep them all, since a robot whose simulator is gone
        moves without its laws.
        Gravity, masses and contacts are the model's; the base frame is that of the body
        `<prefix>base_frame`, which may move.

        Args:
            robot: the robot, its id or its file; such of its `effects` as act on the robot itself are built
                in.
            actuation: "tension" or "displacement"; default: the robot's own.
            gravity_mps2: gravity in the base frame [m/s^2].
            friction: "capstan" (shipped), "nested" (reference) or "none".
            inertia: False takes the masses' inertia away and keeps their weight, for motion that is
                meant to be quasi-static.
            model_text: MJCF of the robot in surroundings, with the names and the order of `build_mjcf`;
                default: that of the robot alone.
            tissue_N_per_m: of surroundings whose regions press back as springs (`Tissue`), each region's
                stiffness; default: what contacts do is left to MuJoCo.
            model: one to which `robot` has been attached; of the arguments before only `actuation` and
                `friction` are then to be given, and not "nested". The laws change the robot's part of it:
                one simulator for each robot in each model.
            data: its state, the same for all robots of a scene; default: a new one, in which only this
                robot's laws act.
            prefix: of the robot's elements in it.

        Raises:
            InputError: the robot cannot be built, `friction` is unknown, or not for this kind of robot, an
                effect acts on inputs or outputs: that needs their whole history, which steps have not; or
                the model does not hold the robot, or arguments are given that it has no use for.
        """
        robot = robot_of(robot)
        self.actuation = checked_actuation(robot, actuation)
        self.moving = self.shares = False
        self._held: MotionNumbers | None = None
        self._free: MotionNumbers | None = None
        self._lag = ServoLag(0.0, 0.0)
        if robot.effects and model_text is not None:
            raise InputError(f"{robot.name}: effects: build them in before the model's text is written")
        self.robot = robot = _built_in(robot, self.actuation)
        gravity_mps2 = checked_numbers("gravity_mps2", gravity_mps2, (3,), "three numbers are needed")
        nested = needs_reference_friction(robot, friction)
        if model is not None:
            alone = not (nested or model_text or tissue_N_per_m) and inertia and not np.any(gravity_mps2)
            self._join(model, data, prefix, friction, alone)
            return
        text = remembered_mjcf(robot, self.actuation, nested) if model_text is None else model_text
        self._alone, self._nested, self._gravity = model_text is None, nested, np.array(gravity_mps2)
        self.model = mujoco.MjModel.from_xml_string(text)
        self.model.opt.gravity[:] = gravity_mps2
        if not inertia:
            _take_inertia_away(self.model)
        # A state that is not finite must be seen, not reset to zero.
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.model.tendon_invweight0[:] *= FRICTION_SOFTNESS
        self.data = mujoco.MjData(self.model)
        self.tissue = None if tissue_N_per_m is None else Tissue(self.model, tissue_N_per_m)
        self._find_robot(RobotInModel(self.model), friction)
        # Stiff antagonists would make 1e-8 of what the two ways differ by: driven tendons keep the engine's.
        own_paths = self.pulls.given and applies(self.model)
        self._paths = SiteTendons(self.model) if own_paths else None
        self.reset()

    def _join(
        self, model: mujoco.MjModel, data: mujoco.MjData | None, prefix: str, friction: str, alone: bool
    ) -> None:
        """Find the robot in a model that holds more; `alone`: nothing is asked for that changes the rest."""
        if not alone or not prefix:
            raise InputError(
                f"{self.robot.name}: in a model of its own only: gravity_mps2, inertia=False, model_text, "
                "tissue_N_per_m, friction='nested' or no prefix"
            )
        require_type("model", model, mujoco.MjModel, "a compiled mujoco.MjModel")
        require_type("prefix", prefix, str, "a text")
        if data is not None:
            require_type("data", data, mujoco.MjData, "a mujoco.MjData")
            if data.signature != model.signature:
                raise InputError(f"{self.robot.name}: data: is of another model: use mujoco.MjData(model)")
        self.model, self.data = model, mujoco.MjData(model) if data is None else data
        self._alone, self._nested, self._gravity = False, False, np.zeros(3)
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.tissue, self._paths = None, None
        try:
            place = RobotInModel(model, prefix)
            self._find_robot(place, friction)
        except KeyError as error:
            what = f"{self.robot.name}: not in the model with prefix {prefix!r}"
            raise InputError(f"{what}: attach it first ({error.args[0]})") from None
        model.tendon_invweight0[place.tendons()] *= FRICTION_SOFTNESS
        self.reset()
        self.shares = True
        share(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take over what was copied or pickled."""
        self.__dict__.update(state)
        if self.shares:
            share(self)

    def _find_robot(self, place: RobotInModel, friction: str) -> None:
        """Prepare what is done beside MuJoCo's own step for the robot in the model."""
        robot, data = self.robot, self.data
        face, outputs = kind_of(robot).laws, kind_of(robot).drives.outputs(robot)
        self.place = place
        self._watch = Watch(place, data)
        self._readout = Readout(place, data, outputs, face.sliding_joints(robot))
        self.faces, self.dofs = self._readout.faces, self._readout.dofs
        self._loads = Loads(place, outputs.elements)
        self._drives = kind_of(robot).drives.drives(robot, self.actuation)
        given = all(drive.quantity is Quantity.TENSION for drive in self._drives)
        self._actuation = Actuation(place, data, face.controls(robot, place), given)
        self.controls, self.pulls = self._actuation.controls, self._actuation.pulls
        self.laws = find_laws(robot, place, self._actuation, friction)
        # Not `self.span_tension`: a simulator that nobody keeps has to go at once.
        span_tension = partial(self._readout.span_tension, self._actuation, self.laws)
        self._now = Step(data, self.pulls, self._loads.force_tip, self._loads.per_element, span_tension)

    def reset(self) -> None:
        """Return to rest: the unloaded shape, zero inputs, no friction history; held, as at first.

        In a model that holds more, the rest of it stays where it is.
        """
        positions: slice | np.ndarray = slice(None)
        self.hold()
        if self.place.base is None:
            mujoco.mj_resetData(self.model, self.data)
        else:
            positions, dofs = self.place.positions(), self.place.dofs()
            self.data.qvel[dofs] = self.data.qfrc_applied[dofs] = self.data.qacc_warmstart[dofs] = 0.0
            self.data.ctrl[self.place.actuators()] = 0.0
        self.laws.reset()
        self._loads.set(ZERO_WRENCH, ZERO_WRENCH)
        self._actuation.reset()
        self.data.qpos[positions] = self.model.qpos_spring[positions]
        for place in self.laws.place:
            place(self.data)
        if self.tissue is not None:
            self.tissue.forget()
        mujoco.mj_forward(self.model, self.data)

    def set_inputs(
        self,
        tendon: ArrayLike,
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
            others: further forces, at points of elements (`Loads` says in which frame).

        Raises:
            InputError: other than one finite number for each tendon, a tension below zero, a catheter's
                displacement beyond its joint's range, a force or moment of other than three finite numbers,
                or a force on an element that the robot does not have.
        """
        inputs = checked_inputs(self.robot, self._drives, tendon)
        where = f"{self.robot.name}: set_inputs:"
        loads = [("force_tip", force_tip), ("moment_tip", moment_tip)]
        for item in others:
            if not isinstance(item, LinkForce):
                raise InputError(f"{where} others: {shown(item)}: a LinkForce is needed")
            loads += [(f"force on element {item.link}", item.force_N), ("its moment", item.moment_Nm)]
        for name, value in loads:
            if value is not ZERO_WRENCH:
                checked_numbers(f"{where} {name}", value, (3,), "three numbers are needed")
        self.put_inputs(inputs, force_tip, moment_tip, others)

    def put_inputs(
        self,
        tendon: Array,
        force_tip: ArrayLike = ZERO_WRENCH,
        moment_tip: ArrayLike = ZERO_WRENCH,
        others: Sequence[LinkForce] = (),
    ) -> None:
        """Set inputs that have been checked before: `set_inputs` without its checks of numbers."""
        self._actuation.set(self._lag.arriving(tendon))
        self._loads.set(force_tip, moment_tip, others)

    def let_go(self) -> None:
        """Let the robot move as it is from now on: masses have inertia, damping is the robot's own.

        Posture, history and inputs stay. Until then, and again after `hold`, aids for coming to rest act in
        place of the robot's own damping, and with `inertia=False` its masses have weight alone. In motion
        `settle` waits for as long as the robot's own damping needs.

        Raises:
            InputError: the robot is not alone in its model.
        """
        if self.moving:
            return
        if not self._alone:
            raise InputError(f"{self.robot.name}: let_go: in a model of its own only")
        if self._free is None:
            self._held = motion_numbers(self.model)
            text = remembered_mjcf(self.robot, self.actuation, self._nested, motion=True)
            model = mujoco.MjModel.from_xml_string(text)
            model.opt.gravity[:] = self._gravity
            model.tendon_invweight0[:] *= FRICTION_SOFTNESS
            self._free = motion_numbers(model)
        self._take_over(self._free)
        self.moving = self._now.moving = True
        times = self.robot.dynamics
        self._lag = ServoLag(times.servo_lag_s, self.model.opt.timestep, self._actuation.arrived)

    def hold(self) -> None:
        """Let aids for coming to rest act from now on, as before `let_go`; speeds are taken away."""
        if not self.moving or self._held is None:
            return
        self._take_over(self._held)
        self.moving = self._now.moving = False
        self._lag = ServoLag(0.0, 0.0)
        self.data.qvel[:] = 0.0

    def _take_over(self, numbers: MotionNumbers) -> None:
        """Let the model have `numbers`, and the laws learn them."""
        put_numbers(numbers, self.model)
        self._now.joints_changed = self._now.pulls_changed = True
        self.data.xfrc_applied[:], self.data.qfrc_applied[:] = 0.0, 0.0
        own_paths = self.pulls.given and applies(self.model) and self.model.opt.integrator != _RK4
        self._paths = SiteTendons(self.model) if own_paths else None

    def actuator_tension(self) -> Array:
        """Return the tendons' tensions at the actuator, shape (t,) [N]; of a pair the tauter one's."""
        return self._actuation.tension()

    def step(self, count: int = 1) -> None:
        """Take `count` steps of the whole model under the present inputs.

        The other robots' simulators that stand on the same model and data are taken along (`step_together`).

        Raises:
            InputError: a newer simulator has this one's prefix in the same data.
            SimulationDiverged: a law beside MuJoCo's own fails on a state that is not finite; otherwise
                only `require_finite` looks.
        """
        everyone = sharing(self)
        try:
            if len(everyone) > 1:
                take_steps(everyone, count)
                return
            if self._paths is None:
                self._step(count)
                return
            with self._paths.instead_of_the_engine():
                self._step(count)
        except Exception:
            for item in everyone:
                item.require_finite()  # what failed may be no more than the first to meet a NaN
            raise

    def _step(self, count: int) -> None:
        model, data, now, laws = self.model, self.data, self._now, self.laws
        if model.opt.integrator == _RK4:
            self._step_whole(count)
            return
        moves = self.place.base is not None
        for _ in range(count):
            if moves:
                self._loads.turn(data)
            for act in laws.before:
                act(now)
            for place in laws.place:
                place(data)
            mujoco.mj_step1(model, data)
            if self._paths is not None:
                self._paths.find(data)
            data.qfrc_applied[:] = 0.0
            if moves:
                self._loads.turn(data)
            self._add_forces()
            if self.tissue is None:
                mujoco.mj_step2(model, data)
            else:
                self.tissue.finish_step(data)

    def _step_whole(self, count: int) -> None:
        """Take steps of several stages, which no law can look into: there are none (`core.motion`)."""
        for _ in range(count):
            mujoco.mj_fwdPosition(self.model, self.data)
            self._loads.put(self.data)
            mujoco.mj_step(self.model, self.data)

    def before_step(self) -> None:
        """Do what comes before `mj_step1`, where somebody else steps the model; see `step_together`."""
        self._loads.turn(self.data)
        for act in self.laws.before:
            act(self._now)
        for place in self.laws.place:
            place(self.data)

    def between(self) -> None:
        """Do what comes between `mj_step1` and `mj_step2`: add the robot's forces to `data.qfrc_applied`.

        Whoever steps the model makes these zero before.
        """
        self._loads.turn(self.data)
        self._add_forces()

    def _add_forces(self) -> None:
        """Let actuators, loads and laws act between the two halves of a step."""
        now = self._now
        for act in self.laws.actuate:
            act(now)
        if not self.pulls.given:
            self._actuation.let_taut_tendons_slacken()
        self._loads.apply(self.model, self.data)
        for act in self.laws.between:
            act(now)

    def require_finite(self) -> None:
        """Raise `SimulationDiverged` if the state is not to be trusted, and say since when and why.

        `divergence.Watch` says where it is not.
        """
        reason = self._watch.complaint()
        if reason is not None:
            when = f"at {self.data.time:.3f} simulated seconds"
            raise SimulationDiverged(f"{self.robot.name}: the simulation diverged {when}{reason}")

    def settle(self, longest_s: float = 5.0) -> bool:
        """Step under the present inputs until the robot is at rest; return whether it came to rest.

        The other robots' simulators that stand on the same model and data are taken along, and have to come
        to rest too (`settle_together`).

        Raises:
            InputError, SimulationDiverged: as `step`.
        """
        return settle_together([self], longest_s)

    def at_rest(self) -> bool:
        """Return whether the robot is at rest.

        So is a robot whose fastest hinge would move by less than `SETTLED_ANGLE_RAD` in one relaxation time,
        and a tube that is advanced by as many meters.
        """
        slowest = SETTLED_ANGLE_RAD / self.robot.dynamics.relaxation_time_s
        return bool(np.abs(self.data.qvel[self.dofs]).max() < slowest)

    def span_tension(self) -> Array:
        """Return the tension of every tendon between its holes, NaN beyond its end, shape (t, n) [N].

        NaN of a catheter: its pairs are two tendons each.
        """
        return self._readout.span_tension(self._actuation, self.laws)

    def posture(self, ahead_s: float = 0.0) -> Posture:
        """Return where the robot is now, or at its present speed so many seconds later (less than a step)."""
        if ahead_s == 0.0:
            return self._readout.posture(self._actuation, self.laws)
        data, now = self.data, self.data.qpos.copy()
        mujoco.mj_integratePos(self.model, data.qpos, data.qvel, ahead_s)
        try:
            return self._readout.posture(self._actuation, self.laws)
        finally:
            data.qpos[:] = now


def _built_in(robot: RobotSpec, actuation: str) -> RobotSpec:
    """Return the robot with its effects built in."""
    return wholly_built_in(driven_by(robot, actuation)) if robot.effects else robot
