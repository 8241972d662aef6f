"""MK, PI and their hybrid as static models of the transseptal robot (Nayar 2022, Section IV-C).

`mk`: Eqs 25-28 with the printed parameters. `hybrid`: MK for the bending joint, PI for both torsion
joints. `pi`: PI for all three. The paper prints no weights for PI: here they are identified from two
cycles of the MK loops of the same joints (`training_loop`), so that `pi` and `hybrid` say what a PI
model makes of those loops, not what the paper's PI model was. In particular a PI model has no offset
at rest, and a loop where MK's bending has none.

The advance is as it is commanded. Formulas without an equation to solve: the run's residual is zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.static_run import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.drives import drives
from catheter_sim.kinds.catheter.layout import moved_segment
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory import modified
from catheter_sim.kinds.catheter.theory.mount import require_rigid_mount
from catheter_sim.kinds.catheter.theory.prandtl_ishlinskii import PrandtlIshlinskii, identify
from catheter_sim.kinds.catheter.theory.pure import beyond, require_unloaded, run_of
from catheter_sim.kinds.catheter.theory.tendons import largest_angle_rad

BENDING_LOOP_M = 6e-3  # the largest displacement of the paper's Fig. 8(a)
_STEPS = 120  # of a training loop, each way
_CYCLES = 2

# (robot, inputs, index of a pair, name of the model) -> angle per row, shape (r,) [rad]
Law = Callable[[CatheterRobot, Inputs, int, str], Array]


def mk(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures by modified kinematics, row after row.

    Args:
        robot: of the transseptal design.
        inputs: displacements of 0 or more and advance; no tip force or moment.
        gravity_mps2: none where the robot has a mass, shape (3,) [m/s^2].

    Raises:
        InputError: a load that the model does not have, or a displacement out of its range.
    """
    return _run(robot, inputs, gravity_mps2, "mk", {"bending": _modified, "torsion": _modified})


def pi(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures by Prandtl-Ishlinskii models, row after row; arguments as of `mk`.

    Displacements may be negative: the model is odd.
    """
    return _run(robot, inputs, gravity_mps2, "pi", {"bending": _plays, "torsion": _plays})


def hybrid(robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures by MK for bending and PI for torsion, row after row; arguments as of `mk`."""
    return _run(robot, inputs, gravity_mps2, "hybrid", {"bending": _modified, "torsion": _plays})


def training_loop(robot: CatheterRobot, pair: int) -> tuple[Array, Array]:
    """Return the loop from which a joint's PI model is identified: displacement [m], angle [rad].

    From zero to 6 mm of bending, or to the upper plateau of torsion, and back, twice; angles by MK.
    """
    segment = robot.segments[moved_segment(robot, pair)]
    top = BENDING_LOOP_M
    if segment.joint == "torsion":
        top = modified.plateau_displacement_m(segment, _torsion_calibration(robot, pair))
    ramp = np.linspace(0.0, top, _STEPS + 1)
    loop = np.concatenate([ramp[:1], *_CYCLES * (ramp[1:], ramp[-2::-1])])
    return loop, _by_mk(robot, pair, loop)


def identified(robot: CatheterRobot, pair: int) -> PrandtlIshlinskii:
    """Return the PI model of the joint that a pair moves, identified from `training_loop`."""
    return identify(*training_loop(robot, pair))


def _run(
    robot: CatheterRobot, inputs: Inputs, gravity_mps2: Array, model: str, laws: Mapping[str, Law]
) -> StaticRun:
    require_unloaded(robot, inputs, gravity_mps2, model)
    require_rigid_mount(robot, model)
    values = []
    for pair in range(len(robot.tendons)):
        segment = robot.segments[moved_segment(robot, pair)]
        if segment.joint == "prismatic":
            values.append(inputs.tendon[:, pair])
            continue
        angle = laws[segment.joint](robot, inputs, pair, model)
        if np.isnan(angle).any():
            raise beyond(robot, inputs, int(np.argmax(np.isnan(angle))), pair, segment, model)
        values.append(angle)
    return run_of(robot, inputs, gravity_mps2, model, values, np.zeros(len(inputs)))


def _modified(robot: CatheterRobot, inputs: Inputs, pair: int, model: str) -> Array:
    displacement = inputs.tendon[:, pair]
    below = displacement < 0.0
    if below.any():
        row = int(np.argmax(below))
        name = f"{drives(robot, inputs.actuation)[pair].column} = {displacement[row] * 1e3:g}"
        raise InputError(
            f"{row_name(inputs, row)}: static model {model!r}: {name}: calibrated for 0 or more only"
        )
    return _by_mk(robot, pair, displacement)


def _by_mk(robot: CatheterRobot, pair: int, displacement: Array) -> Array:
    segment = robot.segments[moved_segment(robot, pair)]
    if segment.joint == "bending":
        angle = modified.bending_rad(segment, displacement)
        return np.where(angle <= largest_angle_rad(segment), angle, np.nan)
    return modified.torsion_rad(segment, displacement, _torsion_calibration(robot, pair))


def _plays(robot: CatheterRobot, inputs: Inputs, pair: int, model: str) -> Array:
    segment = robot.segments[moved_segment(robot, pair)]
    angle = identified(robot, pair)(inputs.tendon[:, pair])
    return np.where(np.abs(angle) <= largest_angle_rad(segment), angle, np.nan)


def _torsion_calibration(robot: CatheterRobot, pair: int) -> modified.TorsionCalibration:
    return modified.TORSION_PROXIMAL if moved_segment(robot, pair) == 0 else modified.TORSION_DISTAL
