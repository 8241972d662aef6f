"""The procedure itself: a simulated robot goes through all steps in an anatomy."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.anatomy.anatomies import blocks, facings, shell
from catheter_sim.arrays import Array
from catheter_sim.effects.apply import wholly_built_in
from catheter_sim.errors import InputError
from catheter_sim.mjcf.document import ALL_DIGITS, Element, read
from catheter_sim.mjcf.names import link as link_name
from catheter_sim.mjcf.parts import GROUP
from catheter_sim.modelling.attach import (
    INSERTION,
    NO_MASS,
    add_mesh,
    carry,
    quaternion,
    text,
    touched,
    touched_block,
    touching,
)
from catheter_sim.modelling.build import remembered_mjcf
from catheter_sim.procedure import heart
from catheter_sim.procedure.heart import Anatomy, pose_error, random_anatomy, transform, wall
from catheter_sim.procedure.plan import (
    HOLD_S,
    Plan,
    ProcedureStep,
    between,
    displacements_m,
    duration_s,
    implant_turn_rad,
    plan,
    steps,
    tip_to_end_m,
)
from catheter_sim.robots.catheter.description import elements, ring_length_m
from catheter_sim.robots.catheter.kinematics import tool_frame, tool_jacobian
from catheter_sim.robots.catheter.picture import (
    ACTUATOR,
    ARMS,
    IMPLANT_M,
    arm_width_m,
    holder_length_m,
    pieces,
)
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.simulation.tissue import TISSUE

# ----------------------------------------------------------------------------------------------------
# What robot and anatomy do to each other: the wall as springs, the leaflets as MuJoCo's contacts.
#
# MuJoCo's own contacts have no stiffness that could be stated in N/m: it depends on the inertias and the
# posture, the more so under its discrete integrator. So the wall's contacts are only found by MuJoCo
# (`scene` gives its geoms a gap), and their forces are springs here: stiffness times depth, one for each
# element of the robot, at its deepest contact. Leaflets, which give way on their hinges, are MuJoCo's.
#
# A spring acts one step late. On the transseptal robot's straight end, as soft sideways as it gets, it
# comes to rest up to 200 N/m at the robot's time step of 5 ms; at 400 N/m it rattles.

WALL_N_PER_M = 200.0  # of the wall under one element of the robot; assumed: 0.2 N for each millimetre


@dataclass(frozen=True)
class Touch:
    """What the anatomy feels of the robot at one moment."""

    wall_N: float  # sum of the normal forces on the wall
    place: Array  # of the largest of them, valve frame, shape (3,) [m]; NaN where there is none
    leaflets: frozenset[
        tuple[str, str]
    ]  # names of geoms, of the robot and of a leaflet, that press each other
    leaflets_N: float  # sum of the normal forces on the leaflets


class Contacts:
    """Applies the wall's forces before every step and tells what the last step's were."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, wall_N_per_m: float = WALL_N_PER_M
    ) -> None:
        self._model, self._data, self._stiffness = model, data, wall_N_per_m
        self._names = names = [model.geom(geom).name for geom in range(model.ngeom)]
        self._wall = np.array([name.startswith("wall_") for name in names])
        self._robot = np.array([name.startswith("touch_") for name in names])

    def push_back(self) -> Touch:
        """Let the wall press on the robot at its present contacts; return all forces.

        The forces act in the following steps, until this is called again.
        """
        model, data = self._model, self._data
        data.xfrc_applied[:] = 0.0
        deepest: dict[int, int] = {}
        leaflets, pairs, wrench = 0.0, set(), np.zeros(6)
        for number in range(data.ncon):
            contact = data.contact[number]
            first, second = (int(geom) for geom in contact.geom)
            robot, other = (first, second) if self._robot[first] else (second, first)
            if self._wall[other]:
                if contact.dist < 0.0 and (
                    robot not in deepest or contact.dist < data.contact[deepest[robot]].dist
                ):
                    deepest[robot] = number
                continue
            mujoco.mj_contactForce(model, data, number, wrench)
            if wrench[0] > 0.0:
                leaflets += float(wrench[0])
                pairs.add((self._names[robot], self._names[other]))
        wall, largest, place = 0.0, 0.0, np.full(3, np.nan)
        for robot, number in deepest.items():
            contact = data.contact[number]
            size = -self._stiffness * float(contact.dist)
            # the frame's first axis points from the first geom to the second
            outward = contact.frame[:3] * (1.0 if contact.geom[0] == robot else -1.0)
            force = -size * outward
            body = int(model.geom_bodyid[robot])
            data.xfrc_applied[body, :3] += force
            data.xfrc_applied[body, 3:] += np.cross(contact.pos - data.xipos[body], force)
            wall += size
            if size > largest:
                largest, place = size, contact.pos.copy()
        return Touch(wall, place, frozenset(pairs), leaflets)


# ----------------------------------------------------------------------------------------------------
# Corrections by a tracker at the implant's holder: measured pose to a change of the commanded joints.

POSITION_M, TURN_RAD = 1e-3, math.radians(3.0)  # errors of equal weight: what the procedure allows


# An electromagnetic tracker's error after averaging, as root mean square over all directions; assumed: of the
# order of what averaging over a second leaves.
TRACKED_M, TRACKED_RAD = 0.3e-3, math.radians(0.5)
_MOST_CORRECTIONS = 15  # after one step of the procedure
_WITHIN_M, _WITHIN_RAD = 0.4e-3, math.radians(1.0)  # measured errors that need no correction
_SHARE = 0.7  # of the measured error that one correction takes away


def measured(pose: Array, rng: np.random.Generator) -> Array:
    """Return a tool frame, shape (4, 4), with the tracker's noise."""
    shift = rng.normal(size=3) * TRACKED_M / math.sqrt(3.0)
    turn = Rotation.from_rotvec(rng.normal(size=3) * TRACKED_RAD / math.sqrt(3.0)).as_matrix()
    return transform(turn @ pose[:3, :3], pose[:3, 3] + shift)


def good_enough(error: Array) -> bool:
    """Return whether a measured pose error, shape (6,), needs no correction."""
    return bool(np.linalg.norm(error[:3]) <= _WITHIN_M and np.linalg.norm(error[3:]) <= _WITHIN_RAD)


def corrected(
    robot: CatheterRobot,
    base: Array,
    wanted: ProcedureStep,
    command: ProcedureStep,
    reached: Array,
    target: Array,
    share: float,
) -> ProcedureStep:
    """Return the next command: resolved rates of the four joints and the insertion.

    Frames, shape (4, 4), are in the valve frame: the robot's base, the measured tool and the wanted one. The
    Jacobian is taken where the robot should be, `wanted`; this share of the error is taken away.
    """
    columns = np.zeros((6, 5))
    jacobian = tool_jacobian(robot, wanted.q)
    R = base[:3, :3]
    columns[:3, :4], columns[3:, :4] = R @ jacobian[:3], R @ jacobian[3:]
    columns[:3, 4] = base[:3, 2]
    weight = 1.0 / np.array([POSITION_M] * 3 + [TURN_RAD] * 3)
    scale = np.array([TURN_RAD, TURN_RAD, POSITION_M, TURN_RAD, POSITION_M])
    slope = weight[:, np.newaxis] * columns * scale
    error = weight * pose_error(target, reached)
    # slightly damped: near straight the two torsions do the same
    move = scale * np.linalg.solve(slope.T @ slope + 1e-2 * np.eye(5), slope.T @ error)
    return ProcedureStep(
        command.name, command.insertion_m + share * move[4], command.q + share * move[:4], command.opening
    )


# ----------------------------------------------------------------------------------------------------
# The robot in the anatomy as MJCF: the robot's own model, pushed through the septum, with contacts.
#
# What is added to the robot's model (`catheter_sim.modelling.build`), which is not changed otherwise:
#
# - the body `catheter`, which carries the robot's base on the slide `insertion` along the sheath, and the
#   actuator `insertion`, the last: control in m, from the place in which the robot waits outside the septum;
# - the body `implant_mount` in the holder, where the implant is turned in it (`plan.implant_turn_rad`);
# - geoms `touch_<k>` of every element, `touch_<arm>` and `touch_post` of the implant, not drawn;
# - geoms `wall_<k>`, convex blocks, not drawn, and `atrium`, the wall's closed mesh, only drawn;
# - bodies `scallop_<side>` and `margin_<side>` on hinges of the same names, with geoms of the same names;
#   geoms `leaflet_<side>_<k>` beside them, only drawn.
#
# The robot touches the anatomy, and nothing else touches anything (`catheter_sim.procedure.operate`). The
# exposed tube, which is thinner than everything before it, touches nothing. Contacts have no friction: wet
# tissue. Blood and the beating heart are left out.

MOUNT = "implant_mount"
WAITING_M = 3e-3  # of the implant before the septum at the start
# assumed: leaflets follow what presses on them with a few hundredths of a newton
HINGE_N_M_PER_RAD = {"scallop": 1e-3, "margin": 2e-4}
# What a scene of tissue is made of; every plate of a leaflet is felt for itself.
FOUND_M = 0.5e-3  # before it presses a contact with tissue is known: more than the way of a step
REGIONS = ("wall", *(f"{plate}_{side}" for plate in HINGE_N_M_PER_RAD for side in heart.SIDES))
_WALL_RGBA, _LEAFLET_RGBA = "0.86 0.47 0.45 0.18", "0.93 0.72 0.60 1"
_FOUND_ONLY = {"margin": -0.05, "gap": 0.05}  # MuJoCo finds these contacts; `contact` has their forces


@dataclass(frozen=True)
class Scene:
    """A robot in an anatomy."""

    robot: CatheterRobot
    plan: Plan
    text: str  # the model as MJCF; opens in any MuJoCo viewer
    waiting_m: float  # insertion of the base at which the slide `insertion` is 0


def build_scene(robot: CatheterRobot, plan: Plan, tissue: bool = False) -> Scene:
    """Return the scene in which the robot waits outside the septum, valve frame.

    As `tissue` what is touched presses back as `simulation.tissue` has it, not as `Contacts` and MuJoCo do:
    the regions of `REGIONS`, geoms `tissue_<region>_<k>` in place of the names above.
    """
    length = sum(segment.length_m for segment in robot.segments) + tip_to_end_m(robot)
    waiting = -length - WAITING_M
    root = read(remembered_mjcf(robot))
    root.part("statistic").set(center=(0, 0, 0.02))
    world = root.part("worldbody")
    carry(root, robot.dynamics, plan.base(waiting))
    _turn_implant(robot, world)
    _add_touches(robot, world)
    around = wall(plan.anatomy, plan.puncture, plan.direction)
    add_mesh(root, "atrium", shell(around), _WALL_RGBA)
    for number, (corners, facing) in enumerate(zip(blocks(around), facings(around), strict=True)):
        if tissue:
            touched_block(root, f"{TISSUE}wall_{number}", corners, facing, margin=FOUND_M)
        else:
            touched_block(root, f"wall_{number}", corners, None, **_FOUND_ONLY)
    for side, sign in heart.SIDES.items():
        if tissue:
            _add_leaflet(robot, plan, root, side, sign, f"{TISSUE}{{}}_0", FOUND_M)
        else:
            _add_leaflet(robot, plan, root, side, sign)
    return Scene(robot, plan, root.text(ALL_DIGITS), waiting)


def _turn_implant(robot: CatheterRobot, world: Element) -> None:
    """Put the implant, where it is turned in its holder, into the body `implant_mount`."""
    turn = implant_turn_rad(robot)
    if turn == 0.0:
        return
    holder = world.find("site", "implant").parent
    held = [child for child in holder.children if child.get("name", "").startswith("implant")]
    turned = text((math.cos(0.5 * turn), 0.0, 0.0, math.sin(0.5 * turn)))
    mount = holder.add("body", name=MOUNT, quat=turned)
    mount.add("inertial", **NO_MASS)
    for child in held:
        mount.append(child)


def _add_touches(robot: CatheterRobot, world: Element) -> None:
    """Add to every element what touches: balls around the middles of rings, cylinders for modules."""
    bodies = {body.get("name"): body for body in world.every("body")}
    parts = elements(robot)
    for piece in pieces(robot):
        if not piece.element:
            continue
        segment = robot.segments[piece.segment]
        radius, top = segment.outer_radius_m, parts[piece.element - 1].face_m - piece.origin_m
        bottom = top - (ring_length_m(segment) if piece.gap else segment.length_m)
        if piece.segment == len(robot.segments) - 1:
            top = holder_length_m(robot)
        middle = text((0, 0, 0.5 * (bottom + top)))
        shape: dict[str, Any] = {"type": "sphere", "size": radius, "pos": middle}
        if not piece.gap:  # one module goes on where the other ends: no notch in which a leaflet would catch
            shape = {"type": "cylinder", "size": radius, "fromto": text((0, 0, bottom, 0, 0, top))}
        touching(bodies[piece.name], name=f"touch_{piece.element}", **shape)
    outer, width = robot.segments[-1].outer_radius_m, 0.5 * arm_width_m(robot)
    holder = bodies[link_name(len(parts))]
    middle = text((0, 0, holder_length_m(robot) + 0.5 * IMPLANT_M))
    size = text((0.1 * outer, 0.5 * width, 0.45 * IMPLANT_M))
    touching(bodies.get(MOUNT, holder), name="touch_post", type="box", size=size, pos=middle)
    for arm, side in ARMS.items():
        place = (side * 0.17 * outer, 0.0, -0.38 * IMPLANT_M)
        size = text((0.17 * outer, width, 0.40 * IMPLANT_M))
        touching(bodies[arm], name=f"touch_{arm}", type="box", size=size, pos=text(place))


def _add_leaflet(
    robot: CatheterRobot,
    plan: Plan,
    root: Element,
    side: str,
    sign: float,
    named: str = "{}",
    margin: float = 0.0,
) -> None:
    """Add a leaflet: its middle scallop on hinges, its geoms so named, and what lies beside it."""
    carrier, place, R = root.part("worldbody"), np.zeros(3), np.eye(3)
    for name, plate in zip(HINGE_N_M_PER_RAD, heart.scallop(plan.anatomy, sign), strict=True):
        stiffness = HINGE_N_M_PER_RAD[name]
        carrier = carrier.add(
            "body",
            name=f"{name}_{side}",
            pos=text(R.T @ (plate.hinge - place)),
            quat=quaternion(R.T @ plate.R),
        )
        place, R = plate.hinge, plate.R
        carrier.add(
            "joint",
            name=f"{name}_{side}",
            type="hinge",
            axis=(0, 1, 0),
            stiffness=stiffness,
            damping=stiffness * robot.dynamics.relaxation_time_s,
            armature=stiffness * robot.dynamics.inertia_time_s**2,
        )
        carrier.add("inertial", **NO_MASS)
        size = 0.5 * np.array([plate.length_m, plate.width_m, plate.thickness_m])
        touched(
            carrier,
            name=named.format(f"{name}_{side}"),
            type="box",
            size=text(size),
            pos=text((size[0], 0, 0)),
            rgba=_LEAFLET_RGBA,
            margin=margin,
        ).set(group=GROUP)
    for number, mesh in enumerate(heart.beside(plan.anatomy, sign)):
        add_mesh(root, f"leaflet_{side}_{number}", mesh, _LEAFLET_RGBA)


# ----------------------------------------------------------------------------------------------------
# The procedure itself: a simulated robot goes through all steps in an anatomy, and how it ends.

POSITION_MM, ANGLE_DEG = 1.0, 3.0  # what counts as success
_CORRECTED = ("bend", "advance", "orient", "clip")
_PORTIONS = {"bend": 4}  # with corrections after each: the robot is pushed on only as far as it has bent
_PRESSES_N = 0.01  # a contact that holds

Watch = Callable[[Simulator, ProcedureStep, Touch], None]


@dataclass(frozen=True)
class StepReport:
    """What happened in a step."""

    name: str  # of the step
    insertion_mm: float  # of the base at its end, as commanded
    joints: tuple[float, ...]  # values at its end as planned, base to tip [deg, mm]
    displacement_mm: tuple[float, ...]  # of the pairs at its end, in the robot's order
    position_error_mm: float  # of the tool frame at its end, true
    angle_error_deg: float
    wall_peak_N: float  # of the sum of normal forces on the atrium's wall
    wall_mean_N: float
    wall_place_mm: tuple[float, ...]  # of the largest single force, valve frame; NaN where there is none
    leaflets_peak_N: float  # of the sum of normal forces on the leaflets
    corrections: int  # how many the tracker asked for


@dataclass(frozen=True)
class Outcome:
    """How a procedure ended."""

    robot: str  # its name
    plan: Plan  # what was planned
    steps: tuple[StepReport, ...]  # what happened
    position_error_mm: float  # of the middle of the implant, true
    angle_error_deg: float  # whole angle by which the implant is turned from its target
    arms_deg: tuple[float, ...]  # how far each arm stayed open
    holds: bool  # whether each arm presses on a leaflet of its own

    @property
    def succeeded(self) -> bool:
        """Whether the implant is within `POSITION_MM` and `ANGLE_DEG` of its target."""
        return bool(self.position_error_mm <= POSITION_MM and self.angle_error_deg <= ANGLE_DEG)

    @property
    def wall_peak_N(self) -> float:
        """The largest sum of normal forces on the atrium's wall [N]."""
        return max(step.wall_peak_N for step in self.steps)


def ideal(robot: CatheterRobot) -> CatheterRobot:
    """Return what pure kinematics takes the robot for: drives without slack, play or stretch."""
    pairs = [
        replace(pair, slack_m=0.0, play_m=0.0, stiffness_N_per_m=math.inf, law="linear")
        for pair in robot.tendons
    ]
    return replace(robot, tendons=tuple(pairs), friction=replace(robot.friction, mu=0.0))


def is_ideal(robot: CatheterRobot) -> bool:
    """Return whether displacements alone place the robot: nothing slack, elastic or rubbing in its drive."""
    return ideal(robot) == robot


def operate(
    robot: CatheterRobot,
    plan: Plan,
    rng: np.random.Generator,
    known: CatheterRobot | None = None,
    feedback: bool | None = None,
    watch: Watch | None = None,
) -> Outcome:
    """Go through all steps and return how they ended.

    Args:
        robot: the catheter; such of its `effects` as act on the robot itself are built in.
        plan: of `plan.plan`.
        rng: for the tracker's noise.
        known: what the controller takes the robot for; default: `ideal`, nothing of its drives' losses.
        feedback: correct by the tracker; default: where the robot is not ideal (`is_ideal`).
        watch: called after every step of the simulation, with the command and the contacts.

    Raises:
        InputError: an effect acts on inputs or outputs.
        SimulationDiverged: the state is not finite.
    """
    robot = wholly_built_in(robot)
    theatre = _Theatre(known or ideal(robot), build_scene(robot, plan), watch)
    corrects = not is_ideal(robot) if feedback is None else feedback
    reports = []
    offset = ProcedureStep("", 0.0, np.zeros(4), 0.0)  # what the corrections have added so far
    before = ProcedureStep("wait", plan.straight_m, np.zeros(4), 0.0)
    for step in steps(plan):
        count, portions = 0, _PORTIONS.get(step.name, 1) if corrects else 1
        for portion in range(1, portions + 1):
            stage = between(before, step, portion / portions)
            target = plan.base(stage.insertion_m) @ tool_frame(robot, stage.q)
            theatre.go(_added(stage, offset))
            for _ in range(_MOST_CORRECTIONS if corrects and step.name in _CORRECTED else 0):
                reached = measured(theatre.frame("tip"), rng)
                if good_enough(pose_error(target, reached)):
                    break
                command = _added(stage, offset)
                base = plan.base(stage.insertion_m)
                after = corrected(robot, base, stage, command, reached, target, _SHARE)
                offset = ProcedureStep("", after.insertion_m - stage.insertion_m, after.q - stage.q, 0.0)
                theatre.go(after)
                count += 1
        reports.append(theatre.report(step, target, count))
        before = step
    theatre.hold(1.0)
    aim = plan.target.copy()
    aim[:3, 3] += theatre.middle_ahead_m * plan.target[:3, 2]
    error = pose_error(aim, theatre.frame("implant"))
    return Outcome(
        robot.name,
        plan,
        tuple(reports),
        1e3 * float(np.linalg.norm(error[:3])),
        math.degrees(float(np.linalg.norm(error[3:]))),
        tuple(math.degrees(float(theatre.simulator.data.joint(arm).qpos[0])) for arm in ARMS),
        _holds(theatre.last),
    )


class _Theatre:
    """The simulated robot in its scene, and what has been felt since the last report."""

    def __init__(self, known: CatheterRobot, scene: Scene, watch: Watch | None) -> None:
        self.known, self.scene, self.watch = known, scene, watch
        self.simulator = Simulator(scene.robot, inertia=False, model_text=scene.text)
        self.contacts = Contacts(self.simulator.model, self.simulator.data)
        self.place = ProcedureStep("wait", scene.waiting_m, np.zeros(4), 0.0)
        self.way = np.zeros(4)
        self.last = Touch(0.0, np.full(3, np.nan), frozenset(), 0.0)
        self.felt: list[Touch] = []
        data = self.simulator.data
        tip, middle = data.site("tip").xpos, data.site("implant").xpos
        self.middle_ahead_m = float(np.linalg.norm(middle - tip))

    def go(self, place: ProcedureStep) -> None:
        """Move to a place at the stated speeds and hold it."""
        seconds = duration_s(self.known, self.place, place)
        count = max(1, round(seconds / self.simulator.model.opt.timestep))
        moved = np.sign(place.q - self.place.q)
        self.way = np.where(np.abs(place.q - self.place.q) > 1e-9, moved, self.way)
        start = self.place
        for k in range(1, count + 1):
            self._step(between(start, place, k / count))
        self.place = place
        self.hold(HOLD_S)

    def hold(self, seconds: float) -> None:
        """Stay."""
        for _ in range(round(seconds / self.simulator.model.opt.timestep)):
            self._step(self.place)
        self.simulator.require_finite()

    def frame(self, site: str) -> Array:
        """Return the tool frame ("tip"), or that in the implant's middle, true, valve frame, shape (4, 4)."""
        found = self.simulator.data.site(site)
        return transform(found.xmat.reshape(3, 3).copy(), found.xpos.copy())

    def report(self, step: ProcedureStep, target: Array, corrections: int) -> StepReport:
        """Return the report on what happened since the last one."""
        error = pose_error(target, self.frame("tip"))
        forces = np.array([touch.wall_N for touch in self.felt])
        worst = self.felt[int(forces.argmax())]
        leaflets = max(touch.leaflets_N for touch in self.felt)
        self.felt = []
        q = step.q
        joints = (math.degrees(q[0]), math.degrees(q[1]), 1e3 * q[2], math.degrees(q[3]))
        moved = 1e3 * displacements_m(self.known, self.place.q, self.way)
        return StepReport(
            step.name,
            1e3 * self.place.insertion_m,
            tuple(float(value) for value in joints),
            tuple(float(value) for value in moved),
            1e3 * float(np.linalg.norm(error[:3])),
            math.degrees(float(np.linalg.norm(error[3:]))),
            float(forces.max()),
            float(forces.mean()),
            tuple(float(value) for value in 1e3 * worst.place),
            leaflets,
            corrections,
        )

    def _step(self, place: ProcedureStep) -> None:
        simulator, data = self.simulator, self.simulator.data
        simulator.set_inputs(displacements_m(self.known, place.q, self.way))
        data.actuator(INSERTION).ctrl = place.insertion_m - self.scene.waiting_m
        data.actuator(ACTUATOR).ctrl = place.opening
        self.last = self.contacts.push_back()
        self.felt.append(self.last)
        simulator.step()
        if self.watch is not None:
            self.watch(simulator, place, self.last)


def _added(step: ProcedureStep, offset: ProcedureStep) -> ProcedureStep:
    return ProcedureStep(step.name, step.insertion_m + offset.insertion_m, step.q + offset.q, step.opening)


def _holds(touch: Touch) -> bool:
    """Return whether both arms press on leaflets, and not on the same one."""
    held = {
        arm: {leaflet.split("_")[1] for part, leaflet in touch.leaflets if part == f"touch_{arm}"}
        for arm in ARMS
    }
    first, second = held.values()
    return bool(touch.leaflets_N > _PRESSES_N and first and second and first | second > first & second)


# ----------------------------------------------------------------------------------------------------
# The procedure in many random anatomies.


@dataclass(frozen=True)
class Attempt:
    """One anatomy of a series."""

    number: int  # in the series, from 0
    anatomy: Anatomy
    outcome: Outcome | None  # how it ended; None where it did not
    failure: str | None  # the line that says why it did not

    @property
    def succeeded(self) -> bool:
        """Whether the implant reached its target."""
        return self.outcome is not None and self.outcome.succeeded


def attempt(robot: CatheterRobot, known: CatheterRobot | None, seed: int, number: int) -> Attempt:
    """Plan and operate in anatomy `number` of the series `seed`; `known` as in `operate`."""
    rng = np.random.default_rng([seed, number])
    anatomy = random_anatomy(rng)
    try:
        return Attempt(number, anatomy, operate(robot, plan(robot, anatomy), rng, known), None)
    except InputError as error:  # no plan, or a simulation that diverged
        return Attempt(number, anatomy, None, str(error))


def run_series(
    robot: CatheterRobot, count: int, seed: int, known: CatheterRobot | None = None, jobs: int = 1
) -> list[Attempt]:
    """Return the attempts of a series, in order; they do not depend on `jobs`, the number of processes."""
    one = partial(attempt, robot, known, seed)
    if jobs == 1:
        return [one(number) for number in range(count)]
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        return list(pool.map(one, range(count)))
