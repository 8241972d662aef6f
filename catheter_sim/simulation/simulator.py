"""A robot in MuJoCo: inputs in, steps, posture out, with the laws that run beside the step."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array
from catheter_sim.catalogue import robot_of
from catheter_sim.channels import checked_actuation
from catheter_sim.core.inputs import Drive, LinkForce, Outputs, Quantity, check_links, driven_by
from catheter_sim.core.law import Controls, FrictionLaw, Law, Pulls, RobotInModel, Step
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import wholly_built_in
from catheter_sim.errors import InputError, SimulationDiverged, require_type, shown, unknown
from catheter_sim.mechanics.hysteresis import clamp_slack
from catheter_sim.mjcf import names
from catheter_sim.modelling.build import remembered_mjcf
from catheter_sim.robots import KINDS, kind_of
from catheter_sim.simulation.friction import CapstanFriction
from catheter_sim.simulation.motion import (
    LARGEST_INPUT,
    MotionNumbers,
    ServoLag,
    Watch,
    motion_numbers,
    put_numbers,
)
from catheter_sim.simulation.site_tendons import SiteTendons, applies
from catheter_sim.simulation.tissue import Tissue
from catheter_sim.simulation.together import settle_together, share, sharing, take_steps

# ----------------------------------------------------------------------------------------------------
# A simulated robot's inputs on their way to its actuators, and the tensions that come of them.

ROUNDING_N = 1e-9  # by which a tension may lie below zero


def checked_numbers(where: str, value: Any, shape: tuple[int, ...], needed: str) -> Array:
    """Return `value` as an array of numbers of `shape`, none of which MuJoCo would put a zero in place of.

    Raises:
        InputError: it is none; `needed` says what would be one.
    """
    try:
        numbers = np.asarray(value)
        real = numbers.dtype.kind in "iuf" and numbers.shape == shape
    except ValueError:  # rows of different lengths
        real = False
    if not real:
        raise InputError(f"{where} = {shown(value)}: {needed}")
    if not (np.abs(numbers) <= LARGEST_INPUT).all():  # false of what is not a number
        raise InputError(f"{where} = {shown(value)}: finite numbers within {LARGEST_INPUT:g} are needed")
    return np.asarray(numbers, dtype=float)


def checked_inputs(robot: RobotSpec, drives: Sequence[Drive], value: Any) -> Array:
    """Return inputs of a robot's tendons as an array, shape (t,), SI.

    Raises:
        InputError: other than one finite number for each tendon, or a tension below zero.
    """
    names = [item.name for item in robot.tendons]
    listed = f" ({', '.join(names)})" if names else ""
    needed = f"{len(names)} numbers are needed, one for each of its tendons{listed}"
    where = f"{robot.name}: set_inputs: tendon"
    numbers = checked_numbers(where, value, (len(names),), needed)
    for drive in drives:
        for place in drive.tendons:
            if drive.quantity is Quantity.TENSION and numbers[place] < -ROUNDING_N:
                raise InputError(f"{where} {names[place]}: {numbers[place]:g} N: a tendon cannot push")
    return numbers


class Actuation:
    """The actuators of a robot in a model.

    Attributes:
        controls: what stands between inputs and actuators.
        pulls: the actuators that pull tendons.
        arrived: what arrives at the tendons now, shape (t,).
    """

    def __init__(self, place: RobotInModel, data: mujoco.MjData, controls: Controls, given: bool) -> None:
        """Prepare; `given`: whether the inputs are tensions."""
        model = place.model
        self._model, self._data, self.controls = model, data, controls
        pulls = controls.pulls
        bias, length_gain = model.actuator_biasprm[pulls, :2].T.copy()
        self.pulls = Pulls(
            pulls,
            model.actuator_trnid[pulls, 0].astype(np.int64),
            given,
            model.actuator_gainprm[pulls, 0].copy(),
            bias,
            length_gain,
        )
        # Control ranges are for sliders; a simulation takes what it is given.
        model.actuator_ctrllimited[place.actuators()] = 0
        self.arrived = np.zeros(len(controls.spans))
        self._ctrl_before = np.zeros(len(pulls))

    def reset(self) -> None:
        """Return to inputs of zero that have always been so."""
        self.arrived = np.zeros(len(self.controls.spans))
        self.set(self.arrived)
        self._ctrl_before[:] = 0.0

    def set(self, inputs: Array) -> None:
        """Set the controls of the following steps, by inputs of shape (t,).

        Raises:
            InputError: an input that the robot cannot follow.
        """
        controls = self.controls
        self.arrived = controls.arriving(self.arrived, inputs)
        self._data.ctrl[controls.actuators] = controls.controls(self.arrived)

    def tension(self) -> Array:
        """Return the tension of each input at the actuator, shape (t,) [N]; of a pair the tauter one's."""
        data = self._data
        pulled = np.maximum(self.pulls.tension(data), 0.0)
        return self.controls.tension(data.qpos, data.ctrl, pulled)

    def let_taut_tendons_slacken(self) -> None:
        """Clamp at zero only the tensions of tendons that were slack before the command changed.

        See `mechanics.hysteresis`; to be called once a step, where tendons are driven.
        """
        pulls, data = self.pulls, self._data
        pulling = pulls.actuators, pulls.tendons, pulls.gain, pulls.bias, pulls.length_gain
        state = data.ten_length, data.ctrl, self._ctrl_before, self._model.actuator_forcerange
        clamp_slack(*pulling, *state)


# ----------------------------------------------------------------------------------------------------
# The laws that run beside a robot's step, in the order of their turns; friction comes last.

FRICTION_ROUTES = ("capstan", "nested", "none")
_REFERENCE = "reference_friction"  # a function that only some kinds' `laws.py` have


class LawList:
    """A robot's laws.

    Attributes:
        laws: all of them.
        friction: the last one, where tendons rub; else None.
        before, place, actuate, between: what they do at each point of a step (`core.law`).
    """

    def __init__(self, laws: tuple[Law, ...], friction: FrictionLaw | None) -> None:
        self.laws: tuple[Law | FrictionLaw, ...] = laws if friction is None else (*laws, friction)
        self.friction = friction
        self.before: tuple[Callable[[Step], None], ...] = self._acts("before")
        self.place: tuple[Callable[[mujoco.MjData], None], ...] = self._acts("place")
        self.actuate: tuple[Callable[[Step], None], ...] = self._acts("actuate")
        self.between: tuple[Callable[[Step], None], ...] = self._acts("between")

    def reset(self) -> None:
        """Forget the history."""
        for law in self.laws:
            law.reset()

    def _acts(self, name: str) -> tuple[Callable[[Any], None], ...]:
        """Return the methods of a name that do anything."""
        idle = getattr(Law, name)
        return tuple(getattr(law, name) for law in self.laws if getattr(type(law), name) is not idle)


def find_laws(robot: RobotSpec, place: RobotInModel, actuation: Actuation, friction: str) -> LawList:
    """Return the laws of a robot in a model; `friction` is one of `FRICTION_ROUTES`."""
    face = kind_of(robot).laws
    laws = face.laws(robot, place)
    if robot.friction.mu == 0 or friction == "none":
        return LawList(laws, None)
    if friction == "nested":
        return LawList(laws, getattr(face, _REFERENCE)(robot, place))
    paths = face.tendon_paths(robot, place)
    stiffness = actuation.pulls.drive_stiffness()
    return LawList(laws, CapstanFriction(robot.friction.mu, paths, place.model, stiffness))


def needs_reference_friction(robot: RobotSpec, friction: str) -> bool:
    """Return whether the robot's model must carry what the reference law of friction needs.

    Raises:
        InputError: `friction` is unknown, or the robot's kind has no reference law.
    """
    if friction not in FRICTION_ROUTES:
        raise unknown("friction route", friction, FRICTION_ROUTES)
    if friction != "nested" or robot.friction.mu == 0:
        return False
    kind = kind_of(robot)
    if not hasattr(kind.laws, _REFERENCE):
        having = " or ".join(name for name, other in KINDS.items() if hasattr(other.laws, _REFERENCE))
        raise InputError(
            f"{robot.name}: the nested reference of friction does not know robots of kind {kind.name!r}; "
            f"choices: a {having} robot"
        )
    return True


# ----------------------------------------------------------------------------------------------------
# Forces and moments on a robot's elements, which keep their directions in the base frame.


class Loads:
    """What acts now on the tip and on other points of a robot.

    The point of a force on an element is given in the frame of the body that carries the element's distal
    face: for a link with a rolling joint as in `LinkForce`. For a continuum robot's element its origin is the
    element's last hinge.

    Attributes:
        force_tip: on the tip, world frame, shape (3,) [N].
        per_element: sum of the other forces on each element, base to tip, world frame, shape (n, 3) [N].
    """

    def __init__(self, place: RobotInModel, elements: int) -> None:
        """Prepare for a robot of so many elements, without loads."""
        self._base = place.base
        self._body = [int(place.site(names.face(k)).bodyid.item()) for k in range(1, elements + 1)]
        self._face = [int(place.site(names.face(k)).id) for k in range(1, elements + 1)]
        self._tip, self._tip_body = int(place.site(names.TIP).id), int(place.site(names.TIP).bodyid.item())
        self._force, self._moment = np.zeros(3), np.zeros(3)  # base frame
        self._others: tuple[LinkForce, ...] = ()
        # element from 0, point in its body's frame or None for its face, force and moment in the world frame
        self._acting: list[tuple[int, Array | None, Array, Array]] = []
        self.force_tip, self._moment_tip = self._force, self._moment
        if self._base is not None:
            self.force_tip, self._moment_tip = np.zeros(3), np.zeros(3)
        self.per_element = np.zeros((elements, 3))
        self._any = False
        self._given: set[int] = set()  # bodies that `put` has given something

    def set(self, force_tip: ArrayLike, moment_tip: ArrayLike, others: Sequence[LinkForce] = ()) -> None:
        """Let these act from now on, and no others; base frame.

        Raises:
            InputError: a force on an element that the robot does not have.
        """
        self._force[:], self._moment[:] = force_tip, moment_tip
        if others or self._others:
            check_links(others, len(self._body))
            self._others = tuple(others)
            self._point_others(None)
        self._any = bool(self._force.any() or self._moment.any() or others)

    def turn(self, data: mujoco.MjData) -> None:
        """Turn the loads with the base where it moves."""
        if self._base is None or not self._any:
            return
        R_wb = data.xmat[self._base].reshape(3, 3)
        self.force_tip[:], self._moment_tip[:] = R_wb @ self._force, R_wb @ self._moment
        self._point_others(R_wb)

    def apply(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Add the forces and moments to `data.qfrc_applied`."""
        if self._any:
            for body, place, force, moment in self._now(data):
                mujoco.mj_applyFT(model, data, force, moment, place, body, data.qfrc_applied)

    def put(self, data: mujoco.MjData) -> None:
        """Give the forces and moments to the bodies, in `data.xfrc_applied`: for a step of several stages.

        Within a step they keep their arms about the bodies' centres of mass.
        """
        if not (self._any or self._given):
            return
        given = data.xfrc_applied
        for body in self._given:
            given[body] = 0.0
        acting = self._now(data)
        for body, place, force, moment in acting:
            given[body, :3] += force
            given[body, 3:] += moment + np.cross(place - data.xipos[body], force)
        self._given = {body for body, *_ in acting}

    def _now(self, data: mujoco.MjData) -> list[tuple[int, Array, Array, Array]]:
        """Return body, place, force and moment of all that acts, world frame."""
        acting = [(self._tip_body, data.site_xpos[self._tip], self.force_tip, self._moment_tip)]
        for element, point, force, moment in self._acting:
            acting.append((self._body[element], self._place(data, element, point), force, moment))
        return acting

    def _place(self, data: mujoco.MjData, element: int, point: Array | None) -> Array:
        """Return where an element's point is in the world, (3,); None: the middle of its distal face."""
        if point is None:
            return data.site_xpos[self._face[element]]
        body = self._body[element]
        return np.asarray(data.xpos[body] + data.xmat[body].reshape(3, 3) @ point)

    def _point_others(self, R_wb: Array | None) -> None:
        """Find the other forces in the world frame; None: it is the base frame."""
        self._acting = []
        for item in self._others:
            force, moment = np.array(item.force_N, float), np.array(item.moment_Nm, float)
            if R_wb is not None:
                force, moment = R_wb @ force, R_wb @ moment
            point = None if item.point_m is None else np.array(item.point_m, float)
            self._acting.append((item.link - 1, point, force, moment))
        self.per_element[:] = 0.0
        for item, (_, _, force, _) in zip(self._others, self._acting, strict=True):
            self.per_element[item.link - 1] += force


# ----------------------------------------------------------------------------------------------------
# Reads a simulated robot's posture and tensions out of MuJoCo's state.


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
        """Prepare; `slides` name joints that stand still besides where the robot rests."""
        self._model, self._data, self._base = place.model, data, place.base
        self._angles = np.array([place.joint(name).qposadr[0] for name in outputs.joints])
        self.dofs = np.array([place.joint(name).dofadr[0] for name in [*outputs.joints, *slides]])
        self.faces = np.array([place.site(names.face(k)).id for k in range(1, outputs.elements + 1)])
        self._beyond = np.ones((0, 0), dtype=bool)  # of each tendon the spans beyond its end, where known

    def span_tension(self, actuation: Actuation, laws: LawList) -> Array:
        """Return the tension of every tendon between its holes, NaN beyond its end, shape (t, n) [N].

        NaN of an input that is no single tendon, such as a catheter's pair.
        """
        tension, ends = actuation.tension(), actuation.controls.spans
        if laws.friction is not None and ends.any():
            return laws.friction.span_tension(self._data, tension)
        if len(self._beyond) != len(ends):
            self._beyond = np.arange(1, len(self.faces) + 1) > ends[:, np.newaxis]
        spans = np.empty(self._beyond.shape)
        spans[:] = tension[:, np.newaxis]
        spans[self._beyond] = np.nan
        return spans

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


# ----------------------------------------------------------------------------------------------------
# A robot in MuJoCo: inputs in, steps, posture out.

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
            InputError: other than one finite number for each tendon, a tension below zero, or a catheter's
                displacement beyond its joint's range.
            InputError: a force or moment of other than three finite numbers, or a force on an element that
                the robot does not have.
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
            with self._paths.instead_of_the_engine(self.data):
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
        moves, applied = self.place.base is not None, data.qfrc_applied
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
            applied[:] = 0.0
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
