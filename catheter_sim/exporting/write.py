"""A robot with its effects as one MJCF: built, fitted on loops, and run in MuJoCo alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import body_count, drives_of, input_channels
from catheter_sim.core.effect import Stage
from catheter_sim.core.inputs import Inputs, Quantity, pulls_alone, shares
from catheter_sim.core.published import DriveLevels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import built_in, check_effects
from catheter_sim.errors import SimulationDiverged, unknown
from catheter_sim.exporting.elements import (
    BUILT,
    FITTED,
    IN_LOOPS,
    LEFT,
    PLASTIC_SPRINGS,
    CarriedCause,
    HingeLaw,
    Shift,
    add_friction,
    add_sensors,
    add_shifts,
    add_springs,
    affine_of,
    command_actuators,
    count_samples,
    find_causes,
    find_shifts,
    fit_laws,
    missing_moments,
    quasi_static,
    timing_of,
    view_of,
    without,
)
from catheter_sim.mjcf.document import Element, read
from catheter_sim.modelling.build import build_mjcf, robot_length, taken_by_mujoco
from catheter_sim.progress import Stages, counted
from catheter_sim.robots import face_of
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator

# ----------------------------------------------------------------------------------------------------
# Histories of inputs on which an exported file is fitted, and others on which it is judged.
#
# Both are loops from rest and back, held row by row. Those that judge go to other levels, turn round half
# way, and pull one drive while another stands: nothing of them has been fitted.

ROWS_A_WAY = 12  # of a fitted loop's full way
# Corners of the loops as shares of a drive's range, from rest and back to it.
_FITTED = (0.0, 1.0, 0.0)
_JUDGED = (0.0, 0.8, 0.35, 0.65, 0.0)
_STANDING_SHARE = 0.3  # of a drive's range, at which it stands while the next one goes through its loop
_STANDING = (0.0, 0.6, 0.0)


def loop_drives(robot: RobotSpec, largest_bend_rad: float | None = None) -> DriveLevels:
    """Return what loops move: the robot's drives with their ranges, as environments know them.

    Args:
        robot: with its effects or without.
        largest_bend_rad: what a drive asks of a segment at the end of its range; default: a quarter turn.

    Raises:
        InputError: the robot's kind has none.
    """
    steering = face_of(robot, "steering", "export")
    drives: DriveLevels = steering.quick_model(robot, robot.actuation, largest_bend_rad).drives
    return drives


def fitted_loops(drives: DriveLevels) -> Inputs:
    """Return one whole loop of each drive after the other, to each end of its range."""
    count = len(drives.names)
    parts = []
    for drive in range(count):
        parts.append(_alone(_path(_FITTED, ROWS_A_WAY), drive, count))
        if drives.lowest[drive] < 0.0:
            parts.append(-parts[-1])
    return _inputs(drives, parts)


def judged_loops(drives: DriveLevels) -> tuple[Inputs, Inputs | None]:
    """Return loops with turns half way: of one drive at a time, and of one while its neighbour stands.

    The second is None where there is one drive alone.
    """
    count = len(drives.names)
    alone = []
    for drive in range(count):
        sides = (1.0, -1.0) if drives.lowest[drive] < 0.0 else (1.0,)
        alone += [side * _alone(_path(_JUDGED, 8), drive, count) for side in sides]
    together = []
    for drive in range(count if count > 1 else 0):
        standing = _STANDING_SHARE * _alone(np.ones(1), (drive + 1) % count, count)
        moved = _alone(_path(_STANDING, 8), drive, count)
        together += [standing, standing + moved, np.zeros((1, count))]
    return _inputs(drives, alone), _inputs(drives, together) if together else None


def _path(corners: tuple[float, ...], rows_a_way: int) -> Array:
    """Return rows along corners, a whole way in so many, without the first corner."""
    legs = []
    for start, end in pairwise(corners):
        rows = max(2, round(rows_a_way * abs(end - start)))
        legs.append(start + (end - start) * np.arange(1, rows + 1) / rows)
    return np.concatenate(legs)


def _alone(levels: Array, drive: int, count: int) -> Array:
    """Return the levels of `count` drives of which one moves, shape (r, d)."""
    found = np.zeros((len(levels), count))
    found[:, drive] = levels
    return found


def _inputs(drives: DriveLevels, parts: list[Array]) -> Inputs:
    count = len(drives.names)
    levels = np.concatenate([np.zeros((1, count)), *parts, np.zeros((1, count))])
    tendon = pulls_alone(drives.actuation, levels @ drives.tendon.T)
    nothing = np.zeros((len(levels), 3))
    return Inputs(np.arange(float(len(levels))), drives.actuation, tendon, nothing, nothing)


# ----------------------------------------------------------------------------------------------------
# Runs a written file in MuJoCo alone: what somebody sees who has the file and nothing of this package.
#
# Positions are read from the file's own sensors `position_<k>`, as an observer has them.

RAMP_S = 1.0  # simulated time from one held row to the next
LONGEST_REST_S = 1.0  # that is then waited for rest
_LOOK_S = 0.05
_REST_RAD_PER_S = 2e-3


class PlainRun:
    """A file in MuJoCo, from rest with zero inputs.

    Attributes:
        model, data: MuJoCo's.
        shares: the control of each actuator for the inputs, shape (nu, t): ctrl = shares @ inputs.
    """

    def __init__(self, text: str, shares: Array) -> None:
        """Load the file's text."""
        self.model = mujoco.MjModel.from_xml_string(text)
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # what diverges is to be seen
        self.model.actuator_ctrllimited[:] = 0
        self.data = mujoco.MjData(self.model)
        self.shares = shares
        names = [self.model.sensor(k).name for k in range(self.model.nsensor)]
        self._places = [self.model.sensor(name).adr[0] for name in names if name.startswith("position_")]
        if self.model.nkey:
            mujoco.mj_resetDataKeyframe(self.model, self.data, 0)

    def positions(self) -> Array:
        """Return where the elements' faces are seen, base to tip, shape (n, 3) [m]."""
        mujoco.mj_forward(self.model, self.data)
        return np.array([self.data.sensordata[place : place + 3] for place in self._places])

    def held(
        self,
        inputs: Array,
        progress: bool = False,
        on_row: Callable[[int], None] | None = None,
        ramp_s: float = RAMP_S,
    ) -> Array:
        """Return the positions at rest under rows of inputs, each approached slowly.

        Args:
            inputs: shape (r, t), SI.
            progress: show on standard error how many rows are done.
            on_row: called with the row's index when it is reached.
            ramp_s: simulated time from one row to the next [s].

        Returns:
            Shape (r, n, 3) [m]; NaN from the row on in which the motion diverges.
        """
        controls = inputs @ self.shares.T
        found = np.full((len(inputs), len(self._places), 3), np.nan)
        before = np.zeros(controls.shape[1])
        steps = max(1, round(ramp_s / self.model.opt.timestep))
        for row in counted(range(len(inputs)), len(inputs), "replaying", "row", progress):
            for step in range(1, steps + 1):
                share = 1.0 - (1.0 - step / steps) ** 3
                self.data.ctrl[:] = before + (controls[row] - before) * share
                mujoco.mj_step(self.model, self.data)
            self._rest()
            if not np.isfinite(self.data.qpos).all():
                break
            found[row] = self.positions()
            if on_row is not None:
                on_row(row)
            before = controls[row]
        return found

    def _rest(self) -> None:
        """Wait until next to nothing moves, or for so long."""
        block = max(1, round(_LOOK_S / self.model.opt.timestep))
        for _ in range(round(LONGEST_REST_S / _LOOK_S)):
            mujoco.mj_step(self.model, self.data, block)
            if not np.abs(self.data.qvel).max(initial=0.0) > _REST_RAD_PER_S:
                return

    def followed(self, time_s: Array, inputs: Array) -> Array:
        """Return the positions in motion along rows of inputs, shape (r, n, 3) [m].

        The motion begins at rest under the first row.

        Args:
            time_s: strictly increasing, shape (r,).
            inputs: straight from row to row, shape (r, t), SI.
        """
        controls = inputs @ self.shares.T
        found = np.full((len(inputs), len(self._places), 3), np.nan)
        self.held(inputs[:1])
        found[0] = self.positions()
        start = self.data.time - time_s[0]
        for row in range(1, len(inputs)):
            while self.data.time < start + time_s[row] - 0.5 * self.model.opt.timestep:
                share = np.clip(
                    (self.data.time - start - time_s[row - 1]) / (time_s[row] - time_s[row - 1]), 0.0, 1.0
                )
                self.data.ctrl[:] = controls[row - 1] + share * (controls[row] - controls[row - 1])
                mujoco.mj_step(self.model, self.data)
            found[row] = self.positions()
        return found


# ----------------------------------------------------------------------------------------------------
# What a model must be like for engines that know less than MuJoCo: MJX and MuJoCo Warp.
#
# They have no plastic springs, no late controls or views, no implicit integration, and they regularise a
# constraint by the inertia that a joint or a tendon has at the straight robot at rest, as MuJoCo does
# without its flag `diagexact`: R = (1 - d) / d times what `dof_invweight0`, `tendon_invweight0` say. For a
# tie of a slide to a hinge that is 1 / inertia of the hinge, in 1 / (kg m^2), beside that of the slide, in
# 1 / kg, and a hinge alone in a light robot has next to no inertia: the tie gives way by a millimetre.
# Tendons tie them instead, the hinge's an angle times a short lever. For a friction loss it is nothing at
# all where the tendon has no slope at rest; `elements.add_friction` gives it some. A friction loss creeps
# by R times its force, the less the more inertia the hinge has: it gets its stiffness times `HINGE_TIME_S`
# squared. At rest nothing is felt of that.

HINGE_TIME_S = 0.01  # as `core.robot.Dynamics` gives held rows
_LEVER_M = 1e-3  # by which an angle is made a length
_TIE_STEPS = 2.0  # in which a tie closes: MuJoCo allows no fewer
_INTEGRATORS = ("Euler", "implicitfast")


def make_plainer(root: Element, plain: mujoco.MjModel, laws: Sequence[HingeLaw]) -> None:
    """Take out of a model what such engines refuse, and let its ties and friction be hard without it.

    `plain` is the model without what laws add, loaded; `laws` are of its hinges.
    """
    for item in (*root.part("actuator").children, *root.part("sensor").children):
        item.set(delay=None, nsample=None, interp=None)
    option = root.part("option")
    if option.get("integrator") not in _INTEGRATORS:
        option.set(integrator="implicitfast")
    option.part("flag").set(diagexact=None)
    option.set(solver="Newton")  # with friction losses it is the faster one
    _tie_by_lengths(root, plain.opt.timestep)
    stiffness = {law.joint: abs(law.stiffness) + float(plain.joint(law.joint).stiffness[0]) for law in laws}
    for joint in root.part("worldbody").every("joint"):
        if own := stiffness.get(joint.get("name", ""), 0.0):
            joint.set(armature=max(own * HINGE_TIME_S**2, *joint.numbers("armature", 0.0)))


def _tie_by_lengths(root: Element, timestep_s: float) -> None:
    """Let tendons tie slides to hinges, so that a hinge's angle counts as a length."""
    tendons = root.part("tendon")
    made: set[str] = set()
    for tie in root.part("equality").every("joint"):
        slide, hinge = tie.get("joint1"), tie.get("joint2")
        for joint, coefficient in ((slide, 1.0), (hinge, _LEVER_M)):
            if joint not in made:
                made.add(joint)
                tendon = tendons.add("fixed", name=f"tie_{joint}")
                tendon.add("joint", joint=joint, coef=coefficient)
        powers = [value / _LEVER_M**power for power, value in enumerate(tie.numbers("polycoef"))]
        tie.tag = "tendon"
        tie.set(joint1=None, joint2=None, tendon1=f"tie_{slide}", tendon2=f"tie_{hinge}")
        tie.set(polycoef=powers, solref=(_TIE_STEPS * timestep_s, 1.0))


# ----------------------------------------------------------------------------------------------------
# A robot with its effects as one MJCF: built, fitted on loops, judged on others.

ENGINES = ("mujoco", "mjx", "warp")
_RANGE_MORE = 0.1  # of what hinges turn on the loops, by which their paths are known beyond it
_CLEARLY = 0.5  # of the distance without it: what joints are to show of a cause to be said to carry it
IN_MOMENTS = "in the moments that the joints' springs are fitted to"
_NOT_SHOWN = "springs and friction of joints do not give it"
_NO_GRAVITY = np.zeros(3)


@dataclass(frozen=True)
class ExportedControl:
    """What an actuator of the file is to be given.

    Attributes:
        actuator: its name.
        column: the input column that it follows; "": it needs none.
        share: control = share * the column's input, in SI units.
    """

    actuator: str
    column: str
    share: float


@dataclass(frozen=True)
class ExportedModel:
    """A robot as MJCF that needs nothing beside it.

    Attributes:
        robot: as it was specified, effects named.
        engine: for which it is written, one of `ENGINES`.
        text: the MJCF.
        bare: the same without what is fitted, or worked out, in the place of laws: as `build` has the robot.
        controls: of its actuators, in their order.
        shares: ctrl = shares @ tendon inputs in SI, shape (nu, t).
        causes: the robot's, and how each is carried.
        laws: of the hinges, fitted.
        shifts: of bodies that hinges move.
        drives: whose ranges the loops went through.
    """

    robot: RobotSpec
    engine: str
    text: str
    bare: str
    controls: tuple[ExportedControl, ...]
    shares: Array
    causes: tuple[CarriedCause, ...]
    laws: tuple[HingeLaw, ...]
    shifts: tuple[Shift, ...]
    drives: DriveLevels


def write_model(
    robot: RobotSpec,
    engine: str = "mujoco",
    largest_bend_rad: float | None = None,
    progress: bool = False,
) -> ExportedModel:
    """Return a robot with its effects as MJCF.

    Args:
        robot: as it is specified.
        engine: one of `ENGINES`.
        largest_bend_rad: to which drives bend a segment on the loops of the fit; default: a quarter turn.
        progress: show on standard error what is being done.

    Raises:
        InputError: an unknown engine, an effect that is not possible, a robot that cannot be built or whose
            kind has no drives with a range.
        SimulationDiverged: the package's own simulation does, on the loops.
    """
    if engine not in ENGINES:
        raise unknown("engine", engine, ENGINES)
    check_effects(robot)
    drives = loop_drives(robot, largest_bend_rad)
    causes = _by_joints(robot, find_causes(robot))
    inputs = fitted_loops(drives)
    with Stages("exporting", progress) as stages:
        stages.say("simulating loops")
        found = _fitted(robot, quasi_static(robot, causes), engine, causes, drives, inputs, progress)
        hidden = tuple(cause for cause in causes if cause.how == IN_LOOPS)
        if hidden:
            stages.say("trying whether joints can show what actuators cannot")
            found = _nearer(found, hidden, inputs, progress)
    return found


def _by_joints(robot: RobotSpec, causes: tuple[CarriedCause, ...]) -> tuple[CarriedCause, ...]:
    """Return the causes, those of the specification that the built model does not show as fitted ones."""

    def shown(own: RobotSpec) -> str:
        root = read(build_mjcf(built_in(own), motion=True))
        for block in ("custom", "option"):
            root.part(block).remove()
        for joint in root.every("joint"):  # of how it comes to rest, not where
            joint.set(damping=None, armature=None)
        return root.text()

    built = [cause for cause in causes if cause.how == BUILT and not cause.timed]
    if not built:
        return causes
    whole = shown(robot)
    same = {id(cause) for cause in built if shown(without(robot, (cause,))) == whole}
    return tuple(replace(c, way=FITTED, how=IN_MOMENTS) if id(c) in same else c for c in causes)


def _fitted(
    robot: RobotSpec,
    quasi: RobotSpec,
    engine: str,
    causes: tuple[CarriedCause, ...],
    drives: DriveLevels,
    inputs: Inputs,
    progress: bool,
) -> ExportedModel:
    """Return the model whose joints are fitted to what `quasi`, the robot or less, does on loops."""
    positions, truth = _loop_rows(quasi, inputs, progress)
    base, simulator = _base_model(robot, engine), Simulator(built_in(robot))
    plain = mujoco.MjModel.from_xml_string(base)
    root = read(base)
    shifts = _shifts(robot, simulator, plain, positions)
    add_shifts(root, shifts)
    own = _own_shares(simulator, inputs.tendon.shape[1])
    laws = _laws(robot, root, plain, shifts, positions, inputs, own)
    lacking = read(root.text())
    text, row_shares = _finished(robot, engine, root, plain, own, shifts, laws)
    if laws:  # what was fitted to moments need not be nearer in posture
        less, _ = _finished(robot, engine, lacking, plain, own, shifts, ())
        if not _off(text, row_shares, inputs, truth, progress) < _off(
            less, row_shares, inputs, truth, progress
        ):
            text, laws = less, ()
    bare, _ = _finished(robot, engine, read(base), plain, own, (), ())
    controls = _controls(robot, read(text), row_shares)
    return ExportedModel(robot, engine, text, bare, controls, row_shares, causes, laws, shifts, drives)


def _nearer(
    model: ExportedModel, hidden: tuple[CarriedCause, ...], inputs: Inputs, progress: bool
) -> ExportedModel:
    """Return the model fitted with the causes in `hidden`, or without, whichever is nearer to the package."""
    robot, causes = model.robot, model.causes
    whole = without(robot, tuple(cause for cause in causes if cause.timed))
    _, truth = _loop_rows(whole, inputs, progress)
    left = tuple(replace(c, way=LEFT, how=_NOT_SHOWN) if c in hidden else c for c in causes)
    less = without(quasi_static(robot, causes), hidden)
    other = _fitted(robot, less, model.engine, left, model.drives, inputs, progress)
    first, second = (_off(item.text, item.shares, inputs, truth, progress) for item in (model, other))
    return model if first < _CLEARLY * second else other


def _off(text: str, row_shares: Array, inputs: Inputs, truth: Array, progress: bool) -> float:
    """Return the largest distance of a file alone from the package's faces `truth` on loops [m]."""
    got = PlainRun(text, row_shares).held(inputs.tendon, progress)
    return float(np.nan_to_num(np.linalg.norm(got - truth, axis=2), nan=np.inf).max())


def _finished(
    robot: RobotSpec,
    engine: str,
    root: Element,
    plain: mujoco.MjModel,
    own: Array,
    shifts: tuple[Shift, ...],
    laws: tuple[HingeLaw, ...],
) -> tuple[str, Array]:
    """Return the text of a model, which has its `shifts`, with the rest added; and its actuators' shares.

    Raises:
        InputError: MuJoCo refuses it.
    """
    tensions = all(drive.quantity is Quantity.TENSION for drive in drives_of(robot))
    rows = command_actuators(root, own, affine_of(robot), timing_of(robot, Stage.COMMAND), tensions)
    add_springs(root, laws)
    add_friction(root, plain, laws, plastic=engine == "mujoco" and PLASTIC_SPRINGS)
    add_sensors(root, body_count(robot), view_of(robot), robot.markers)
    count_samples(root, float(plain.opt.timestep))
    _rest(root, plain, shifts)
    if engine != "mujoco":
        make_plainer(root, plain, laws)
    _say_inputs(root, _controls(robot, root, rows))
    return taken_by_mujoco(root, robot), rows


def _base_model(robot: RobotSpec, engine: str) -> str:
    """Return the robot as it moves; engines that know no implicit springs get it without friction's step."""
    own = built_in(robot)
    if engine != "mujoco":
        own = replace(own, friction=replace(own.friction, mu=0.0))
    return build_mjcf(own, motion=True)


def _loop_rows(robot: RobotSpec, inputs: Inputs, progress: bool) -> tuple[Array, Array]:
    """Return the package's model at rest under each row: all positions (r, nq), and its faces (r, n, 3)."""
    found: list[Array] = []
    keep = found.append
    run = simulate(
        robot, inputs, _NO_GRAVITY, progress=progress, on_row=lambda now, _: keep(now.data.qpos.copy())
    )
    if run.failure is not None:
        raise SimulationDiverged(run.failure)
    return np.array(found), np.array([posture.p_w for posture in run.postures])


def _shifts(
    robot: RobotSpec, simulator: Simulator, plain: mujoco.MjModel, positions: Array
) -> tuple[Shift, ...]:
    more = _RANGE_MORE * np.ptp(positions, axis=0)
    least, most = positions.min(axis=0) - more, positions.max(axis=0) + more
    place = plain.jnt_qposadr
    return find_shifts(
        simulator, plain, np.minimum(least, 0.0)[place], np.maximum(most, 0.0)[place], robot_length(robot)
    )


def _own_shares(simulator: Simulator, tendons: int) -> Array:
    """Return the controls of the robot's own actuators for what arrives, shape (k, t), about rest."""
    small = 1e-4
    controls = simulator.controls
    found = np.zeros((simulator.model.nu, tendons))
    found[controls.actuators] = controls.controls(small * np.eye(tendons)).T / small
    return found


def _laws(
    robot: RobotSpec,
    root: Element,
    plain: mujoco.MjModel,
    shifts: tuple[Shift, ...],
    positions: Array,
    inputs: Inputs,
    own: Array,
) -> tuple[HingeLaw, ...]:
    """Return what hinges lack, fitted along the loops."""
    affine = affine_of(robot)
    trial = read(root.text())
    drives = drives_of(robot)
    pulls = all(drive.quantity is Quantity.TENSION for drive in drives)
    arriving = inputs.tendon @ affine.matrix.T + affine.bias
    if pulls:
        arriving = np.maximum(arriving, 0.0)
    still = replace(affine, matrix=np.eye(own.shape[1]), bias=np.zeros(own.shape[1]))
    count = command_actuators(trial, own, still, timing_of(replace(robot, effects={}), Stage.COMMAND), pulls)
    model = mujoco.MjModel.from_xml_string(trial.text())
    joints = [plain.joint(k).name for k in range(plain.njnt)]
    hinges = plain.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE)
    rows = missing_moments(model, joints, shifts, positions, arriving @ count.T)
    return fit_laws(rows, joints, hinges)


def _rest(root: Element, plain: mujoco.MjModel, shifts: tuple[Shift, ...]) -> None:
    """Add a keyframe `rest`: the unloaded shape, in which the file is to be started."""
    model = mujoco.MjModel.from_xml_string(root.text())
    pose = model.qpos_spring.copy()
    for shift in shifts:
        angle = float(plain.qpos_spring[plain.joint(shift.joint).qposadr[0]])
        pose[model.joint(shift.slide).qposadr[0]] = shift.at(angle)
    root.part("keyframe").add("key", name="rest", qpos=pose)


def _controls(robot: RobotSpec, root: Element, rows: Array) -> tuple[ExportedControl, ...]:
    """Return what each actuator follows, by the input columns of files."""
    by_column = rows @ shares(drives_of(robot), rows.shape[1])
    columns = input_channels(robot)
    found = []
    for item, row in zip(root.part("actuator").children, by_column, strict=True):
        place = int(np.argmax(np.abs(row)))
        there = bool(row.any())
        found.append(
            ExportedControl(
                item.get("name", ""), columns[place] if there else "", float(row[place]) if there else 0.0
            )
        )
    return tuple(found)


def _say_inputs(root: Element, controls: tuple[ExportedControl, ...]) -> None:
    """Write into the file itself what its controls are."""
    block = root.part("custom")
    for control in controls:
        data = f"{control.share:g} * {control.column}, SI" if control.column else "no input"
        block.add("text", name=f"control_{control.actuator}", data=data)
