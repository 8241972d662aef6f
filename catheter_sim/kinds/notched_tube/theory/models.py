"""The public static models of a notched tube: `york`, as printed, and `kinetostatic`, complete."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.posture import Posture
from catheter_sim.core.static_run import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.kinds.notched_tube.layout import notches
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot
from catheter_sim.kinds.notched_tube.theory import york as printed
from catheter_sim.kinds.notched_tube.theory.section import closing_angle, section
from catheter_sim.kinds.notched_tube.theory.solve import FaceLoads, solve_rows


def kinetostatic(
    robot: NotchedTubeRobot, inputs: Inputs, gravity_mps2: Array, loads: FaceLoads | None = None
) -> StaticRun:
    """Return the postures by virtual work: superelastic notches, capstan friction with history, all loads.

    Args:
        robot: a notched tube.
        inputs: its tendon's tension or displacement, and optionally tip force and moment.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        loads: further loads.

    Raises:
        InputError: nothing balances a row.
    """
    states = solve_rows([robot], [inputs], gravity_mps2, loads)
    lost = np.isnan(states.residual[0])
    if lost.any():
        row = row_name(inputs, int(np.argmax(lost)))
        raise InputError(f"{robot.name}: static model 'kinetostatic' finds no equilibrium at {row}")
    (p_w,), (R_w,) = states.faces()
    found = tuple(
        Posture(
            p_w=p_w[row],
            R_w=R_w[row],
            joint_angles=angles,
            actuator_tension=states.tension[0, row : row + 1],
            tendon_tension=states.notch_tension[0, row : row + 1],
        )
        for row, angles in enumerate(states.joint_angles()[0])
    )
    return StaticRun("kinetostatic", inputs, np.asarray(gravity_mps2), found, states.residual[0])


def york(robot: NotchedTubeRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures as printed by York 2015: all notches bend alike; every row stands alone.

    A displacement bends by the kinematics alone; a tension by the printed statics, loading only.

    Args:
        robot: a notched tube of one segment, straight without load.
        inputs: its tendon's tension or displacement.
        gravity_mps2: none, shape (3,) [m/s^2].

    Raises:
        InputError: a load that the model does not have, or several segments.
    """
    _require_printed(robot, inputs, gravity_mps2)
    segment, tendon = robot.segments[0], robot.tendons[0]
    count, centroid = segment.notches, section(segment).centroid_m
    drive = inputs.tendon[:, 0]
    if inputs.actuation == "displacement":
        each = np.maximum(drive, 0.0) / count
        bend = printed.bend_of_displacement(each, segment.notch_height_m, centroid, tendon.radius_m)
        bend = np.minimum(bend, closing_angle(segment))
        tension = _tension(robot, bend)
    else:
        bend = _bend(robot, drive)
        tension = drive
    found = tuple(_posture(robot, angle, force) for angle, force in zip(bend, tension, strict=True))
    return StaticRun("york", inputs, np.asarray(gravity_mps2), found, np.zeros(len(inputs)))


def _require_printed(robot: NotchedTubeRobot, inputs: Inputs, gravity_mps2: Array) -> None:
    if len(robot.segments) > 1:
        raise InputError(f"{robot.name}: static model 'york' takes one segment; take 'kinetostatic'")
    segment = robot.segments[0]
    rest = (segment.rest_curvature_x_per_m, segment.rest_curvature_y_per_m, segment.rest_twist_rad_per_m)
    if any(rest) or segment.stiffness_cubic_m2 or segment.stiffness_quintic_m4:
        raise InputError(
            f"{robot.name}: static model 'york' takes a straight tube of its metal's law; take 'kinetostatic'"
        )
    if np.any(gravity_mps2):
        raise InputError("static model 'york': has no weight, so gravity must be 0; take 'kinetostatic'")
    loaded = inputs.force_tip.any(axis=1) | inputs.moment_tip.any(axis=1)
    if loaded.any():
        row = row_name(inputs, int(np.argmax(loaded)))
        raise InputError(f"{row}: static model 'york': has no tip force or moment; take 'kinetostatic'")


def _bend(robot: NotchedTubeRobot, tension_N: Array) -> Array:
    segment = robot.segments[0]
    metal_tension = np.asarray(tension_N, dtype=float) / robot.stiffness_scale
    return printed.bend_of_tension(segment, robot.material, robot.friction.mu, segment.notches, metal_tension)


def _tension(robot: NotchedTubeRobot, bend_rad: Array) -> Array:
    segment = robot.segments[0]
    found = printed.tension_of_bend(segment, robot.material, robot.friction.mu, segment.notches, bend_rad)
    return robot.stiffness_scale * found


def _posture(robot: NotchedTubeRobot, bend: float, tension: float) -> Posture:
    """Return equal arcs of the tube's axis, s = h - ybar theta long, with the uncut pieces between them."""
    here, heading, faces = np.zeros(3), 0.0, []
    row = notches(robot)
    for item in row:
        length = item.segment.notch_height_m - section(item.segment).centroid_m * bend
        chord, middle = length * np.sinc(0.5 * bend / np.pi), heading + 0.5 * bend
        heading += bend
        here = here + chord * np.array([np.sin(middle), 0.0, np.cos(middle)])
        here = here + item.uncut_m * np.array([np.sin(heading), 0.0, np.cos(heading)])
        faces.append(here)
    turns = np.arange(1, len(row) + 1) * bend
    zero, one = np.zeros_like(turns), np.ones_like(turns)
    R_w = np.array(
        [[np.cos(turns), zero, np.sin(turns)], [zero, one, zero], [-np.sin(turns), zero, np.cos(turns)]]
    ).transpose(2, 0, 1)
    shift = np.array([0.0, 0.0, -tension / robot.mount.axial_stiffness_N_per_m])
    angles = np.full(len(row), bend)
    if robot.bending_axes == "xy":
        angles = np.concatenate([angles, np.zeros(2 * len(row))])
    loss = printed.corner_loss(bend, robot.friction.mu) ** (2 * len(row))
    return Posture(
        p_w=np.array(faces) + shift,
        R_w=R_w,
        joint_angles=angles,
        actuator_tension=np.array([tension]),
        tendon_tension=np.full((1, len(row)), tension * loss),
    )
