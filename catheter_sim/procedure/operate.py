"""The procedure itself: a simulated robot goes through all steps in an anatomy, and how it ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.effects.apply import wholly_built_in
from catheter_sim.modelling.surroundings import INSERTION
from catheter_sim.procedure.contact import Contacts, Touch
from catheter_sim.procedure.feedback import Corrections, Tracker, corrected, good_enough, measured
from catheter_sim.procedure.frames import pose_error, transform
from catheter_sim.procedure.plan import Plan
from catheter_sim.procedure.scene import Scene, build_scene
from catheter_sim.procedure.steps import HOLD_S, Step, between, displacements_m, duration_s, steps
from catheter_sim.robots.catheter.kinematics import tool_frame
from catheter_sim.robots.catheter.picture import ACTUATOR, ARMS
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator

POSITION_MM, ANGLE_DEG = 1.0, 3.0  # what counts as success
_CORRECTED = ("bend", "advance", "orient", "clip")
_PORTIONS = {"bend": 4}  # with corrections after each: the robot is pushed on only as far as it has bent
_PRESSES_N = 0.01  # a contact that holds

Watch = Callable[[Simulator, Step, Touch], None]


@dataclass(frozen=True)
class StepReport:
    """What happened in a step.

    Attributes:
        name: of the step.
        insertion_mm: of the base at its end, as commanded.
        joints: values at its end as planned, base to tip [deg, mm].
        displacement_mm: of the pairs at its end, in the robot's order.
        position_error_mm, angle_error_deg: of the tool frame at its end, true.
        wall_peak_N, wall_mean_N: of the sum of normal forces on the atrium's wall.
        wall_place_mm: of the largest single force, valve frame; NaN where there is none.
        leaflets_peak_N: of the sum of normal forces on the leaflets.
        corrections: how many the tracker asked for.
    """

    name: str
    insertion_mm: float
    joints: tuple[float, ...]
    displacement_mm: tuple[float, ...]
    position_error_mm: float
    angle_error_deg: float
    wall_peak_N: float
    wall_mean_N: float
    wall_place_mm: tuple[float, ...]
    leaflets_peak_N: float
    corrections: int


@dataclass(frozen=True)
class Outcome:
    """How a procedure ended.

    Attributes:
        robot: its name.
        plan: what was planned.
        steps: what happened.
        position_error_mm: of the middle of the implant, true.
        angle_error_deg: whole angle by which the implant is turned from its target.
        arms_deg: how far each arm stayed open.
        holds: whether each arm presses on a leaflet of its own.
    """

    robot: str
    plan: Plan
    steps: tuple[StepReport, ...]
    position_error_mm: float
    angle_error_deg: float
    arms_deg: tuple[float, ...]
    holds: bool

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
    tracker: Tracker | None = None,
    rule: Corrections | None = None,
) -> Outcome:
    """Go through all steps and return how they ended.

    Args:
        robot: the catheter; such of its `effects` as act on the robot itself are built in.
        plan: of `plan.plan`.
        rng: for the tracker's noise.
        known: what the controller takes the robot for; default: `ideal`, nothing of its drives' losses.
        feedback: correct by the tracker; default: where the robot is not ideal (`is_ideal`).
        watch: called after every step of the simulation, with the command and the contacts.
        tracker, rule: of the corrections.

    Raises:
        InputError: an effect acts on inputs or outputs.
        SimulationDiverged: the state is not finite.
    """
    robot = wholly_built_in(robot)
    theatre = _Theatre(known or ideal(robot), build_scene(robot, plan), watch)
    corrects = not is_ideal(robot) if feedback is None else feedback
    tracker, rule = tracker or Tracker(), rule or Corrections()
    reports = []
    offset = Step("", 0.0, np.zeros(4), 0.0)  # what the corrections have added so far
    before = Step("wait", plan.straight_m, np.zeros(4), 0.0)
    for step in steps(plan):
        count, portions = 0, _PORTIONS.get(step.name, 1) if corrects else 1
        for portion in range(1, portions + 1):
            stage = between(before, step, portion / portions)
            target = plan.base(stage.insertion_m) @ tool_frame(robot, stage.q)
            theatre.go(_added(stage, offset))
            for _ in range(rule.most if corrects and step.name in _CORRECTED else 0):
                reached = measured(theatre.tool(), tracker, rng)
                if good_enough(pose_error(target, reached), rule):
                    break
                command = _added(stage, offset)
                base = plan.base(stage.insertion_m)
                after = corrected(robot, base, stage, command, reached, target, rule.share)
                offset = Step("", after.insertion_m - stage.insertion_m, after.q - stage.q, 0.0)
                theatre.go(after)
                count += 1
        reports.append(theatre.report(step, target, count))
        before = step
    theatre.hold(1.0)
    end = theatre.middle()
    aim = plan.target.copy()
    aim[:3, 3] = plan.target[:3, 3] + theatre.middle_ahead_m * plan.target[:3, 2]
    error = pose_error(aim, end)
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
        self.simulator = _simulator(scene)
        self.contacts = Contacts(self.simulator.model, self.simulator.data)
        self.place = Step("wait", scene.waiting_m, np.zeros(4), 0.0)
        self.way = np.zeros(4)
        self.last = Touch(0.0, np.full(3, np.nan), frozenset(), 0.0)
        self.felt: list[Touch] = []
        data = self.simulator.data
        tip, middle = data.site("tip").xpos, data.site("implant").xpos
        self.middle_ahead_m = float(np.linalg.norm(middle - tip))

    def go(self, place: Step) -> None:
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

    def tool(self) -> Array:
        """Return the tool frame, true, valve frame, shape (4, 4)."""
        return self._site("tip")

    def middle(self) -> Array:
        """Return the frame in the middle of the implant, true, valve frame, shape (4, 4)."""
        return self._site("implant")

    def report(self, step: Step, target: Array, corrections: int) -> StepReport:
        """Return the report on what happened since the last one."""
        error = pose_error(target, self.tool())
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

    def _site(self, name: str) -> Array:
        site = self.simulator.data.site(name)
        return transform(site.xmat.reshape(3, 3).copy(), site.xpos.copy())

    def _step(self, place: Step) -> None:
        simulator, data = self.simulator, self.simulator.data
        simulator.set_inputs(displacements_m(self.known, place.q, self.way))
        data.actuator(INSERTION).ctrl = place.insertion_m - self.scene.waiting_m
        data.actuator(ACTUATOR).ctrl = place.opening
        self.last = self.contacts.push_back()
        self.felt.append(self.last)
        simulator.step()
        if self.watch is not None:
            self.watch(simulator, place, self.last)


def _simulator(scene: Scene) -> Simulator:
    """Return the simulator of the scene's robot, with the scene's model in place of the robot's own."""
    return Simulator(scene.robot, inertia=False, model_text=scene.text)


def _added(step: Step, offset: Step) -> Step:
    return Step(step.name, step.insertion_m + offset.insertion_m, step.q + offset.q, step.opening)


def _holds(touch: Touch) -> bool:
    """Return whether both arms press on leaflets, and not on the same one."""
    held = {
        arm: {leaflet.split("_")[1] for part, leaflet in touch.leaflets if part == f"touch_{arm}"}
        for arm in ARMS
    }
    first, second = held.values()
    return bool(touch.leaflets_N > _PRESSES_N and first and second and first | second > first & second)
