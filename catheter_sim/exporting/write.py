"""A robot with its effects as one MJCF: built, fitted on loops, judged on others."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import body_count, drives_of, input_channels
from catheter_sim.core.drive import Quantity, shares
from catheter_sim.core.effect import Stage
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.quick_model import DriveLevels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import built_in, check_effects
from catheter_sim.errors import SimulationDiverged, unknown
from catheter_sim.exporting import loops
from catheter_sim.exporting.actuators import command_actuators, count_samples
from catheter_sim.exporting.causes import (
    BUILT,
    FITTED,
    IN_LOOPS,
    LEFT,
    Cause,
    affine_of,
    find_causes,
    quasi_static,
    timing_of,
    view_of,
    without,
)
from catheter_sim.exporting.elements import add_friction, add_shifts, add_springs
from catheter_sim.exporting.moments import HingeLaw, fit_laws, missing_moments
from catheter_sim.exporting.other_engines import make_plainer
from catheter_sim.exporting.paths import Shift, find_shifts
from catheter_sim.exporting.plain import PlainRun
from catheter_sim.exporting.sensors import add_sensors
from catheter_sim.mjcf.document import Element, read
from catheter_sim.modelling.build import build_mjcf, taken_by_mujoco
from catheter_sim.modelling.scene import robot_length
from catheter_sim.progress import Stages
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator

ENGINES = ("mujoco", "mjx", "warp")
_RANGE_MORE = 0.1  # of what hinges turn on the loops, by which their paths are known beyond it
_CLEARLY = 0.5  # of the distance without it: what joints are to show of a cause to be said to carry it
IN_MOMENTS = "in the moments that the joints' springs are fitted to"
_NOT_SHOWN = "springs and friction of joints do not give it"
_NO_GRAVITY = np.zeros(3)


@dataclass(frozen=True)
class Control:
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
class Model:
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
    controls: tuple[Control, ...]
    shares: Array
    causes: tuple[Cause, ...]
    laws: tuple[HingeLaw, ...]
    shifts: tuple[Shift, ...]
    drives: DriveLevels


def write_model(
    robot: RobotSpec,
    engine: str = "mujoco",
    largest_bend_rad: float | None = None,
    progress: bool = False,
) -> Model:
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
    drives = loops.drives_of(robot, largest_bend_rad)
    causes = _by_joints(robot, find_causes(robot))
    inputs = loops.fitted_loops(drives)
    with Stages("exporting", progress) as stages:
        stages.say("simulating loops")
        found = _fitted(robot, quasi_static(robot, causes), engine, causes, drives, inputs, progress)
        hidden = tuple(cause for cause in causes if cause.how == IN_LOOPS)
        if hidden:
            stages.say("trying whether joints can show what actuators cannot")
            found = _nearer(found, hidden, inputs, progress)
    return found


def _by_joints(robot: RobotSpec, causes: tuple[Cause, ...]) -> tuple[Cause, ...]:
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
    causes: tuple[Cause, ...],
    drives: DriveLevels,
    inputs: Inputs,
    progress: bool,
) -> Model:
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
    return Model(robot, engine, text, bare, controls, row_shares, causes, laws, shifts, drives)


def _nearer(model: Model, hidden: tuple[Cause, ...], inputs: Inputs, progress: bool) -> Model:
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
    add_friction(root, plain, laws, plastic=engine == "mujoco")
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


def _controls(robot: RobotSpec, root: Element, rows: Array) -> tuple[Control, ...]:
    """Return what each actuator follows, by the input columns of files."""
    by_column = rows @ shares(drives_of(robot), rows.shape[1])
    columns = input_channels(robot)
    found = []
    for item, row in zip(root.part("actuator").children, by_column, strict=True):
        place = int(np.argmax(np.abs(row)))
        there = bool(row.any())
        found.append(
            Control(
                item.get("name", ""), columns[place] if there else "", float(row[place]) if there else 0.0
            )
        )
    return tuple(found)


def _say_inputs(root: Element, controls: tuple[Control, ...]) -> None:
    """Write into the file itself what its controls are."""
    block = root.part("custom")
    for control in controls:
        data = f"{control.share:g} * {control.column}, SI" if control.column else "no input"
        block.add("text", name=f"control_{control.actuator}", data=data)
