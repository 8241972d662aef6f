"""Copies of one robot stepped together by MuJoCo Warp, with the laws of the simulator."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import partial
from typing import Any

import mujoco
import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array
from catheter_sim.channels import actuations
from catheter_sim.core.law import Pulls
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.gpu.device import Copies, DeviceLaw, Gpu, TurnsKernel, find_device, require_warp, vec10
from catheter_sim.mechanics.capstan import LEAST_RESPONSE
from catheter_sim.mechanics.hysteresis import clamp_of_slack
from catheter_sim.robots import kind_of
from catheter_sim.simulation.friction import SWEEP_TOLERANCE, SWEEPS, CapstanFriction
from catheter_sim.simulation.motion import LARGEST_INPUT, farthest
from catheter_sim.simulation.simulator import Simulator

# ----------------------------------------------------------------------------------------------------
# Tensions and clamps of actuators that pull tendons, as Warp kernels, one thread for each copy and
# actuator.
#
# As in `catheter_sim.simulation.simulator`, in double precision; what MuJoCo Warp hands over and takes is
# single.

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.


_ZERO = wp.constant(wp.float64(0.0))


@wp.kernel(enable_backward=False)
def given(pulls: wp.array(dtype=int), ctrl: wp.array2d(dtype=float), entering: wp.array2d(dtype=wp.float64)):
    """Write the tensions of tendons whose tension is the control into `entering`, shape (m, k) [N]."""
    world, place = wp.tid()
    entering[world, place] = wp.float64(ctrl[world, pulls[place]])


@wp.kernel(enable_backward=False)
def slacken(
    timestep: wp.float64,
    unlimited: float,
    pulls: wp.array(dtype=int),
    tendons: wp.array(dtype=int),
    gainprm: wp.array2d(dtype=vec10),
    biasprm: wp.array2d(dtype=vec10),
    ten_length: wp.array2d(dtype=float),
    ctrl: wp.array2d(dtype=float),
    ctrl_before: wp.array2d(dtype=float),
    forcerange: wp.array2d(dtype=wp.vec2),
    entering: wp.array2d(dtype=wp.float64),
    drive: wp.array2d(dtype=wp.float64),
):
    """Clamp the forces of tendons that were slack, and find the tensions of all.

    Args:
        timestep: [s].
        unlimited: largest force of a tendon that was taut (`mechanics.hysteresis.clamp_of_slack`).
        pulls, tendons: actuators of the driven tendons and these, shape (k,).
        gainprm, biasprm, ten_length, ctrl: MuJoCo Warp's.
        ctrl_before: in and out: the controls of the step before, shape (m, k).
        forcerange: out.
        entering: out: tensions, below zero where slack, shape (m, k) [N].
        drive: out: what they grow by per unit of the rate of lengthening in a step, shape (m, k) [N s/m].
    """
    world, place = wp.tid()
    actuator = pulls[place]
    gain = wp.float64(gainprm[world % gainprm.shape[0], actuator][0])
    affine = biasprm[world % biasprm.shape[0], actuator]
    length_gain = wp.float64(affine[1])
    passive = wp.float64(affine[0]) + length_gain * wp.float64(ten_length[world, tendons[place]])
    largest = float(0.0)  # noqa: UP018 - a literal would be a constant to Warp
    if gain * wp.float64(ctrl_before[world, place]) + passive < _ZERO:
        largest = unlimited
    clamp = forcerange[world, actuator]
    clamp[1] = largest
    forcerange[world, actuator] = clamp
    control = ctrl[world, actuator]
    ctrl_before[world, place] = control
    entering[world, place] = -(gain * wp.float64(control) + passive)
    drive[world, place] = -length_gain * timestep


# ----------------------------------------------------------------------------------------------------
# What pulls the tendons of all copies, as the simulator's actuators do.


class Drive(DeviceLaw):
    """The tendons' actuators: tensions that are given, or springs that only pull.

    Attributes:
        entering: tensions at the actuators, below zero where a driven tendon is slack, shape (m, k) [N].
        drive: what they grow by per unit of the rate of lengthening in one step, shape (m, k) [N s/m].
    """

    def __init__(self, copies: Copies, model: mujoco.MjModel, pulls: Pulls) -> None:
        """Prepare.

        Args:
            copies: where it runs.
            model: MuJoCo's.
            pulls: the simulator's.
        """
        self._copies, self._driven = copies, not pulls.given
        tendons = len(pulls.actuators)
        self.entering, self.drive = copies.room(tendons), copies.room(tendons)
        self._shape = (tendons,)
        self._pulls, self._tendons = copies.whole(pulls.actuators), copies.whole(pulls.tendons)
        self._before = copies.room(tendons, dtype=float)
        if self._driven:
            self._clamp = copies.own("actuator_forcerange")
            self._timestep = copies.wp.float64(model.opt.timestep)
            self._unlimited = float(clamp_of_slack(np.array([-1.0]))[0])

    def between(self) -> None:
        """Find the tensions; let driven tendons that were taut slacken without a clamp."""
        copies, data = self._copies, self._copies.data
        if not self._driven:
            copies.launch(given, self._shape, self._pulls, data.ctrl, self.entering)
            return
        model = copies.model
        fixed = self._timestep, self._unlimited, self._pulls, self._tendons
        fields = model.actuator_gainprm, model.actuator_biasprm, data.ten_length, data.ctrl, self._before
        copies.launch(slacken, self._shape, *fixed, *fields, self._clamp, self.entering, self.drive)

    def reset(self) -> None:
        """Forget the controls."""
        self._before.zero_()


# ----------------------------------------------------------------------------------------------------
# The capstan law of `catheter_sim.mechanics.capstan` as a Warp kernel, one thread for each copy.
#
# The numbers are those of `solve_tensions` in double precision, to its tolerance. What saves passes there
# without changing where they end (`start_from_last_change`, `extrapolate_passes`, `slip_as_before`) is left
# out. MuJoCo Warp's own arrays are in single precision.

# mypy: disable-error-code="valid-type"
# Warp states the type of an array by a call.


_LEAST_RESPONSE = wp.constant(wp.float64(LEAST_RESPONSE))


@wp.func
def _span_tensions(
    world: int,
    tendon: int,
    count: int,
    entering: wp.float64,
    drive: wp.float64,
    drawn: wp.float64,
    factor: wp.array3d(dtype=wp.float64),
    response: wp.array3d(dtype=wp.float64),
    rate: wp.array2d(dtype=wp.float64),
    knots: wp.array2d(dtype=wp.float64),
    steps: wp.array2d(dtype=wp.float64),
    goal: wp.array2d(dtype=wp.float64),
    tension: wp.array3d(dtype=wp.float64),
):
    """Update one tendon's tensions and return the actuator's, as `mechanics.capstan.span_tensions` does."""
    width = knots.shape[1]
    left = int(0)  # noqa: UP018, RUF046 - a literal would be a constant to Warp
    right = int(width)
    left_shift = wp.float64(0.0)
    right_shift = wp.float64(0.0)
    reached = wp.float64(entering)
    rounds = count
    if drive > _ZERO:
        rounds = count + 1
    for k in range(rounds):
        span = count - 1 - k
        slope = wp.float64(0.0)
        offset = wp.float64(0.0)
        if span >= 0:
            slope = response[world, tendon, span]
            offset = -(slope * tension[world, tendon, span] + rate[world, span])
        else:
            slope = wp.float64(1.0) / drive
            offset = -entering / drive
        while left > 0:
            knot = knots[world, left - 1] + left_shift
            if slope * knot + offset <= _ZERO:
                break
            left -= 1
            right -= 1
            step = steps[world, left]
            slope += step
            offset -= step * knot
            knots[world, right] = knot - right_shift
            steps[world, right] = -step
        while right < width:
            knot = knots[world, right] + right_shift
            if slope * knot + offset >= _ZERO:
                break
            step = steps[world, right]
            slope += step
            offset -= step * knot
            knots[world, left] = knot - left_shift
            steps[world, left] = -step
            left += 1
            right += 1
        wish = -offset / slope
        if span < 0:
            reached = wish
        else:
            goal[world, span] = wish
            right -= 1
            knots[world, left] = wish - left_shift
            steps[world, left] = slope
            knots[world, right] = wish - right_shift
            steps[world, right] = slope
            left += 1
            before = wp.float64(drawn)
            if span > 0:
                before = tension[world, tendon, span - 1]
            left_shift -= before * factor[world, tendon, span] - before
            right_shift -= before / factor[world, tendon, span] - before
    reached = wp.max(reached, _ZERO)
    below = wp.float64(reached)
    for k in range(count):
        held = factor[world, tendon, k]
        below = wp.min(wp.max(goal[world, k], below / held), below * held)
        tension[world, tendon, k] = below
    return reached


@wp.func
def _couple_driven(
    world: int,
    drive: wp.array2d(dtype=wp.float64),
    row_start: wp.array(dtype=int),
    entry: wp.array(dtype=int),
    dof: wp.array(dtype=int),
    yielding: wp.array2d(dtype=wp.float64),
    ten_J: wp.array2d(dtype=float),
    shared: wp.array3d(dtype=wp.float64),
):
    """As `mechanics.capstan.couple_driven`."""
    tendons = drive.shape[1]
    first = 2 * tendons + 4
    driven = int(0)  # noqa: UP018, RUF046 - a literal would be a constant to Warp
    for j in range(tendons):
        if drive[world, j] > _ZERO:
            driven += 1
    if driven > 1:
        for i in range(yielding.shape[1]):
            for j in range(tendons):
                shared[world, first + i, j] = _ZERO
        for j in range(tendons):
            if drive[world, j] > _ZERO:
                for place in range(row_start[j], row_start[j + 1]):
                    row = first + dof[place]
                    shared[world, row, j] = shared[world, row, j] + wp.float64(ten_J[world, entry[place]])
        for j in range(tendons):
            if drive[world, j] > _ZERO:
                for other in range(tendons):
                    shared[world, j, other] = _ZERO
                for place in range(row_start[j], row_start[j + 1]):
                    i = dof[place]
                    gain = yielding[world, i] * wp.float64(ten_J[world, entry[place]])
                    for other in range(tendons):
                        shared[world, j, other] = (
                            shared[world, j, other] + gain * shared[world, first + i, other]
                        )
                shared[world, j, j] = shared[world, j, j] + wp.float64(1.0) / drive[world, j]
    return driven


@wp.func
def _raise_together(
    world: int,
    ends: wp.array(dtype=int),
    row_start: wp.array(dtype=int),
    entry: wp.array(dtype=int),
    dof: wp.array(dtype=int),
    span: wp.array(dtype=int),
    entering: wp.array2d(dtype=wp.float64),
    drive: wp.array2d(dtype=wp.float64),
    yielding: wp.array2d(dtype=wp.float64),
    ten_J: wp.array2d(dtype=float),
    shared: wp.array3d(dtype=wp.float64),
    reached: wp.array2d(dtype=wp.float64),
    tension: wp.array3d(dtype=wp.float64),
    ahead: wp.array2d(dtype=wp.float64),
):
    """As `mechanics.capstan.raise_together`."""
    tendons = drive.shape[1]
    slope = 2 * tendons
    goal = slope + 1
    shift = slope + 2
    held = slope + 3
    for j in range(tendons):
        shared[world, slope, j] = _ZERO
        shared[world, shift, j] = _ZERO
        shared[world, held, j] = wp.float64(1.0)
        if drive[world, j] > _ZERO:
            shared[world, held, j] = _ZERO
            fall = (reached[world, j] - entering[world, j]) / drive[world, j]
            for place in range(row_start[j], row_start[j + 1]):
                fall -= wp.float64(ten_J[world, entry[place]]) * ahead[world, dof[place]]
            shared[world, slope, j] = fall
    rounds = int(4 * tendons)
    while rounds > 0:
        rounds -= 1
        for j in range(tendons):
            free = shared[world, held, j] == _ZERO
            for other in range(tendons):
                value = wp.float64(0.0)
                if free and drive[world, other] > _ZERO:
                    value = shared[world, j, other]
                shared[world, tendons + j, other] = value
            shared[world, goal, j] = -shared[world, slope, j]
            if not free:
                shared[world, tendons + j, j] = wp.float64(1.0)
                shared[world, goal, j] = shared[world, shift, j]
        for j in range(tendons):
            for below in range(j + 1, tendons):
                ratio = shared[world, tendons + below, j] / shared[world, tendons + j, j]
                for other in range(j + 1, tendons):
                    shared[world, tendons + below, other] = (
                        shared[world, tendons + below, other] - ratio * shared[world, tendons + j, other]
                    )
                shared[world, goal, below] = shared[world, goal, below] - ratio * shared[world, goal, j]
        for back in range(tendons):
            j = tendons - 1 - back
            found = wp.float64(shared[world, goal, j])
            for other in range(j + 1, tendons):
                found -= shared[world, tendons + j, other] * shared[world, goal, other]
            shared[world, goal, j] = found / shared[world, tendons + j, j]
        part = wp.float64(1.0)
        first = int(-1)  # noqa: UP018, RUF046
        for j in range(tendons):
            if shared[world, held, j] == _ZERO and shared[world, goal, j] < -reached[world, j]:
                way = shared[world, goal, j] - shared[world, shift, j]
                share = (-reached[world, j] - shared[world, shift, j]) / way
                if share < part or first < 0:
                    part = wp.float64(share)
                    first = int(j)
        for j in range(tendons):
            way = shared[world, goal, j] - shared[world, shift, j]
            shared[world, shift, j] = shared[world, shift, j] + part * way
        if first >= 0:
            shared[world, shift, first] = -reached[world, first]
            shared[world, held, first] = wp.float64(1.0)
        else:
            strongest = wp.float64(0.0)
            for j in range(tendons):
                if drive[world, j] > _ZERO and shared[world, held, j] > _ZERO:
                    push = wp.float64(shared[world, slope, j])
                    for other in range(tendons):
                        if drive[world, other] > _ZERO:
                            push += shared[world, j, other] * shared[world, shift, other]
                    if push < strongest:
                        strongest = wp.float64(push)
                        first = int(j)
            if first >= 0:
                shared[world, held, first] = _ZERO
            else:
                rounds = int(0)  # noqa: UP018, RUF046
    change = wp.float64(0.0)
    for j in range(tendons):
        if drive[world, j] > _ZERO:
            rise = shared[world, shift, j]
            reached[world, j] = wp.max(reached[world, j] + rise, _ZERO)
            for place in range(row_start[j], row_start[j + 1]):
                i = dof[place]
                gain = yielding[world, i] * wp.float64(ten_J[world, entry[place]])
                ahead[world, i] = ahead[world, i] - gain * wp.max(rise, -tension[world, j, span[place]])
            for k in range(ends[j]):
                risen = wp.max(rise, -tension[world, j, k])
                tension[world, j, k] = tension[world, j, k] + risen
                change = wp.max(change, wp.abs(risen))
    return change


@wp.kernel(enable_backward=False)
def know_joints(
    timestep: wp.float64,
    jnt_dofadr: wp.array(dtype=int),
    armature: wp.array(dtype=wp.float64),
    damping: wp.array(dtype=wp.float64),
    jnt_stiffness: wp.array2d(dtype=float),
    yielding: wp.array2d(dtype=wp.float64),
):
    """As `friction.CapstanFriction.know_joints`, one thread for each copy and joint."""
    world, joint = wp.tid()
    i = jnt_dofadr[joint]
    stiffness = wp.float64(jnt_stiffness[world % jnt_stiffness.shape[0], joint])
    yielding[world, i] = timestep / (armature[i] + timestep * (damping[i] + timestep * stiffness))


@wp.kernel(enable_backward=False)
def solve_tensions(
    mu: wp.float64,
    ends: wp.array(dtype=int),
    row_start: wp.array(dtype=int),
    entry: wp.array(dtype=int),
    dof: wp.array(dtype=int),
    span: wp.array(dtype=int),
    sweeps: int,
    tolerance: wp.float64,
    entering: wp.array2d(dtype=wp.float64),
    drive: wp.array2d(dtype=wp.float64),
    turn: wp.array3d(dtype=wp.float64),
    yielding: wp.array2d(dtype=wp.float64),
    ten_J: wp.array2d(dtype=float),
    qvel: wp.array2d(dtype=float),
    passive: wp.array2d(dtype=float),
    bias: wp.array2d(dtype=float),
    constraint: wp.array2d(dtype=float),
    tension: wp.array3d(dtype=wp.float64),
    factor: wp.array3d(dtype=wp.float64),
    response: wp.array3d(dtype=wp.float64),
    rate: wp.array2d(dtype=wp.float64),
    ahead: wp.array2d(dtype=wp.float64),
    old: wp.array2d(dtype=wp.float64),
    knots: wp.array2d(dtype=wp.float64),
    steps: wp.array2d(dtype=wp.float64),
    goal: wp.array2d(dtype=wp.float64),
    reached: wp.array2d(dtype=wp.float64),
    shared: wp.array3d(dtype=wp.float64),
    applied: wp.array2d(dtype=float),
):
    """Update all copies' tensions, and apply what they pull beyond the actuators'; as `solve_tensions` does.

    An axis of m before those of `entering`, `drive`, `turn` and `yielding` there.
    """
    world = wp.tid()
    tendons = ends.shape[0]
    for i in range(qvel.shape[1]):
        force = wp.float64(passive[world, i]) - wp.float64(bias[world, i]) + wp.float64(constraint[world, i])
        force += wp.float64(applied[world, i])
        ahead[world, i] = wp.float64(qvel[world, i]) + yielding[world, i] * force
    largest = wp.float64(0.0)
    for j in range(tendons):
        largest = wp.max(largest, entering[world, j])
        reached[world, j] = wp.max(entering[world, j], _ZERO)
        for k in range(ends[j]):
            factor[world, j, k] = wp.exp(mu * turn[world, j, k])
            response[world, j, k] = _LEAST_RESPONSE
        for place in range(row_start[j], row_start[j + 1]):
            i = dof[place]
            k = span[place]
            arm = wp.float64(ten_J[world, entry[place]])
            response[world, j, k] = response[world, j, k] + yielding[world, i] * arm * arm
            ahead[world, i] = ahead[world, i] - yielding[world, i] * arm * tension[world, j, k]
    driven = _couple_driven(world, drive, row_start, entry, dof, yielding, ten_J, shared)
    sweep = int(0)  # noqa: UP018, RUF046
    while sweep < sweeps:
        change = wp.float64(0.0)
        for j in range(tendons):
            for k in range(ends[j]):
                rate[world, k] = wp.float64(0.0)
                old[world, k] = tension[world, j, k]
            for place in range(row_start[j], row_start[j + 1]):
                k = span[place]
                arm = wp.float64(ten_J[world, entry[place]])
                rate[world, k] = rate[world, k] + arm * ahead[world, dof[place]]
            reached[world, j] = _span_tensions(
                world,
                j,
                ends[j],
                entering[world, j],
                drive[world, j],
                reached[world, j],
                factor,
                response,
                rate,
                knots,
                steps,
                goal,
                tension,
            )
            for k in range(ends[j]):
                old[world, k] = tension[world, j, k] - old[world, k]
                change = wp.max(change, wp.abs(old[world, k]))
            for place in range(row_start[j], row_start[j + 1]):
                i = dof[place]
                arm = wp.float64(ten_J[world, entry[place]])
                ahead[world, i] = ahead[world, i] - yielding[world, i] * arm * old[world, span[place]]
        if driven > 1:
            risen = _raise_together(
                world,
                ends,
                row_start,
                entry,
                dof,
                span,
                entering,
                drive,
                yielding,
                ten_J,
                shared,
                reached,
                tension,
                ahead,
            )
            change = wp.max(change, risen)
        sweep += 1
        if change <= tolerance * largest:
            sweep = sweeps
    for j in range(tendons):
        for place in range(row_start[j], row_start[j + 1]):
            i = dof[place]
            beyond = tension[world, j, span[place]] - reached[world, j]
            applied[world, i] = applied[world, i] - float(wp.float64(ten_J[world, entry[place]]) * beyond)


# ----------------------------------------------------------------------------------------------------
# The simulator's capstan friction of all copies.


class Friction(DeviceLaw):
    """`simulation.friction.CapstanFriction` in every copy.

    Attributes:
        tension: of every tendon in every span, shape (m, t, n) [N].
        ends: number of spans of each tendon.
        joints_change: whether the copies' joints change their stiffness on the way.
        find_turns: what finds the turns; to be set before the first step.
    """

    joints_change: bool
    find_turns: TurnsKernel

    def __init__(
        self,
        copies: Copies,
        model: mujoco.MjModel,
        law: CapstanFriction,
        drive: Drive,
    ) -> None:
        """Prepare the law.

        Args:
            copies: where it runs.
            model: MuJoCo's.
            law: the simulator's own.
            drive: what knows the tensions at the actuators; it must go first.
        """
        self._copies, self._drive = copies, drive
        layout, wp = law.layout(), copies.wp
        spans, tendons, nv = layout.spans, len(layout.ends), model.nv
        self.ends = copies.whole(layout.ends)
        self.tension = copies.room(tendons, spans)
        self._turn = copies.room(tendons, spans)
        self._yielding = copies.each(layout.yielding)
        rows = layout.starts, layout.entries, layout.dofs, layout.span
        self._fixed = [wp.float64(layout.mu), self.ends, *(copies.whole(item) for item in rows)]
        self._fixed += [SWEEPS, wp.float64(SWEEP_TOLERANCE)]
        sizes = [(tendons, spans), (tendons, spans), (spans,), (nv,), (spans,)]
        sizes += [(2 * spans,), (2 * spans,), (spans,), (tendons,), (2 * tendons + 4 + nv, tendons)]
        self._room = [copies.room(*size) for size in sizes]
        timestep = wp.float64(model.opt.timestep)
        self._joints = [timestep, copies.whole(model.jnt_dofadr)]
        self._joints += [copies.real(model.dof_armature), copies.real(model.dof_damping)]

    def before(self) -> None:
        """Take over the stiffness of the joints where it has changed."""
        if self.joints_change:
            stiffness = self._copies.model.jnt_stiffness
            shape = (stiffness.shape[1],)
            kernel = know_joints
            self._copies.launch(kernel, shape, *self._joints, stiffness, self._yielding)

    def between(self) -> None:
        """Add what friction changes."""
        copies, data, drive = self._copies, self._copies.data, self._drive
        kernel, shape, arguments = self.find_turns
        copies.launch(kernel, shape, *arguments, self._turn)
        state = data.ten_J, data.qvel, data.qfrc_passive, data.qfrc_bias, data.qfrc_constraint
        inputs = *self._fixed, drive.entering, drive.drive, self._turn, self._yielding, *state
        copies.launch(solve_tensions, (), *inputs, self.tension, *self._room, data.qfrc_applied)

    def reset(self) -> None:
        """Forget the history."""
        self.tension.zero_()


# ----------------------------------------------------------------------------------------------------
# The laws of a simulator for its copies on a device, in the order of their turns; friction comes last.


def laws_of(simulator: Simulator, copies: Copies) -> list[DeviceLaw]:
    """Return the laws of a simulator for its copies.

    Args:
        simulator: at rest.
        copies: where they run.

    Raises:
        InputError: its kind has no laws for a device.
    """
    # Their kernels need Warp, which is an extra.

    robot, place = simulator.robot, simulator.place
    package = f"{__package__}.{kind_of(robot).package.rpartition('.')[2]}"
    if importlib.util.find_spec(package) is None:
        what = f"no simulation on MuJoCo Warp for robots of kind {kind_of(robot).name!r}"
        raise InputError(f"{robot.name}: {what}")
    face: Gpu[Any] = importlib.import_module(package)
    drive = Drive(copies, simulator.model, simulator.pulls)
    friction: Friction | None = None
    if isinstance(simulator.laws.friction, CapstanFriction):
        friction = Friction(copies, simulator.model, simulator.laws.friction, drive)
        friction.find_turns = face.turns(robot, place, copies, friction.ends)
    tension = None if friction is None else friction.tension
    laws = list(face.laws(robot, place, copies, drive, tension))
    changed = any(law.changes_joints for law in laws)
    if friction is not None or not simulator.pulls.given:
        laws.append(drive)
    if friction is not None:
        friction.joints_change = changed
        laws.append(friction)
    return laws


# ----------------------------------------------------------------------------------------------------
# Copies of one robot stepped together by MuJoCo Warp, with the laws of the simulator.

_ROWS = 64  # of constraints at least; the same for all robots, so that the same kernels serve them
# What a step reads of the one before, besides the laws' own histories.
_STATE: tuple[str, ...] = ("qpos", "qvel", "time", "ctrl", "xmat", "qacc_warmstart")
_STATE += tuple(f"qfrc_{kind}" for kind in ("applied", "constraint", "smooth", "passive", "actuator"))


class WarpBatch:
    """Copies of a robot under inputs of their own, without forces from outside but gravity.

    The model is the simulator's own, and so are the laws that it adds to its step (`gpu.batch`).
    MuJoCo Warp computes in single precision, the laws in double.

    Attributes:
        copies: how many.
        device: Warp's name of where they are, as "cuda:0" or "cpu".
    """

    def __init__(
        self,
        robot: RobotSpec,
        copies: int,
        device: str | None = None,
        gravity_mps2: ArrayLike = (0.0, 0.0, 0.0),
        actuation: str | None = None,
    ) -> None:
        """Put the copies on the device, at rest; the first step compiles, which takes minutes, once.

        Args:
            robot: of any kind; such of its `effects` as act on the robot itself are built in.
            copies: at least 1.
            device: default: a GPU where there is one.
            gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
            actuation: "tension" or "displacement"; default: the robot's own.

        Raises:
            InputError: MuJoCo Warp is not installed, the device or the actuation does not exist, or an
                effect acts on inputs or outputs.
        """
        if copies < 1:
            raise InputError(f"copies = {copies}: at least 1 is needed")
        actuation = actuation or robot.actuation
        if actuation not in actuations(robot):
            raise unknown("actuation", actuation, actuations(robot))
        self._mjw, self._wp = require_warp()
        simulator = Simulator(robot, actuation, gravity_mps2)
        self.copies, self.robot = copies, simulator.robot
        self._model = simulator.model
        self._farthest = farthest(simulator.place)
        # MuJoCo Warp never resets a state by itself, and refuses the flag that says so.
        self._model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        self._device = find_device(self._wp, device)
        self.device = str(self._device)
        with self._wp.ScopedDevice(self._device):
            self._warp_model = self._mjw.put_model(self._model)
            rows = int(self._model.jnt_limited.sum() + self._model.tendon_limited.sum())
            self._data = self._mjw.put_data(
                self._model, simulator.data, nworld=copies, njmax=max(rows, _ROWS), nconmax=0
            )
            place = Copies(self._wp, copies, self._warp_model, self._data)
            self._laws = laws_of(simulator, place)
        if self._laws:
            self._warp_model.callback.control = self._between
        self._controls = simulator.controls
        self._start = {name: getattr(self._data, name).numpy().copy() for name in _STATE}
        self._ctrl = self._start["ctrl"].copy()
        self._arrived = np.zeros((copies, len(robot.tendons)))

    def reset(self) -> None:
        """Return all copies to rest, without inputs and history."""
        for name, value in self._start.items():
            getattr(self._data, name).assign(value)
        self._arrived = np.zeros_like(self._arrived)
        for law in self._laws:
            law.reset()

    def set_inputs(self, tendon: Array) -> None:
        """Set the tensions [N] or displacements [m] of the following steps, shape (copies, t).

        A catheter's displacements pass through their pairs' plays.

        Raises:
            InputError: another shape, a catheter's displacement beyond its joint's range, or an input
                that MuJoCo does not take (`LARGEST_INPUT`).
        """
        wanted = (self.copies, len(self.robot.tendons))
        if np.shape(tendon) != wanted:
            raise InputError(f"inputs of shape {np.shape(tendon)}: {wanted} is needed (copies, tendons)")
        controls = np.asarray(tendon, dtype=float)
        if not (np.abs(controls) <= LARGEST_INPUT).all():
            raise InputError(f"{self.robot.name}: an input is not finite, or beyond {LARGEST_INPUT:g}")
        self._arrived = self._controls.arriving(self._arrived, controls)
        self._ctrl[:, self._controls.actuators] = self._controls.controls(self._arrived)
        self._data.ctrl.assign(self._ctrl)

    def step(self, count: int = 1) -> None:
        """Take `count` steps."""
        with self._wp.ScopedDevice(self._device):
            for _ in range(count):
                self._step()

    def repeated(self, count: int) -> Callable[[], None]:
        """Return what takes `count` steps, compiled: on a GPU a graph, recorded here once.

        The steps that compiling takes have been taken when this returns.
        """
        self.step(1)
        if not self._device.is_cuda:
            return partial(self.step, count)
        with self._wp.ScopedDevice(self._device), self._wp.ScopedCapture() as capture:
            for _ in range(count):
                self._step()
        return partial(self._wp.capture_launch, capture.graph)

    def synchronise(self) -> None:
        """Wait until the device has done what it was asked for."""
        self._wp.synchronize_device(self._device)

    def qpos(self) -> Array:
        """Return MuJoCo's positions of all copies, shape (copies, nq).

        Raises:
            SimulationDiverged: see `require_finite`.
        """
        value = self._data.qpos.numpy().astype(np.float64)
        diverged = np.flatnonzero(~(np.abs(value) <= self._farthest).all(axis=1))
        if len(diverged):
            time_s = float(self._data.time.numpy()[diverged[0]])
            raise SimulationDiverged(
                f"{self.robot.name}: the simulation on MuJoCo Warp diverged within {time_s:.3f} simulated "
                f"seconds, in {len(diverged)} of {self.copies} copies: the first is {diverged[0]}"
            )
        return value

    def require_finite(self) -> None:
        """Raise `SimulationDiverged` if a copy's position is not finite or beyond what a robot can reach."""
        self.qpos()

    def tips(self) -> Array:
        """Return the tips at the start of the last step, base frame, shape (copies, 3) [m].

        Raises:
            SimulationDiverged: see `require_finite`.
        """
        self.require_finite()
        site = int(self._model.site("tip").id)
        return self._data.site_xpos.numpy()[:, site].astype(np.float64)

    def _step(self) -> None:
        for law in self._laws:
            law.before()
        self._mjw.step(self._warp_model, self._data)

    def _between(self, model: Any, data: Any) -> None:
        """Let the laws act between a step's two halves; MuJoCo Warp's callback for controls."""
        data.qfrc_applied.zero_()
        for law in self._laws:
            law.between()
