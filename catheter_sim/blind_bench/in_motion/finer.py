"""A robot in motion with something hidden in it, by a finer model than the diagnosis has.

More links, a smaller step and another integrator than the robot's own simulation in motion; damping, a load
at the tip and what happens to commands and to measurements are written here once more, by other code than
that of the effects. Nothing of `effects` or `diagnosis` is imported.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.columns import posture_columns
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.simulation.friction import CapstanFriction
from catheter_sim.simulation.simulator import Simulator

STEP_S = 2.5e-4
FINER = 2  # times as many links as the robot itself has
_OVERDAMPED_S = 0.5  # damping by which a robot comes to rest before a trial begins
_REST_S, _REST_STEP_S = 4.0, 1e-3


@dataclass(frozen=True)
class Specimen:
    """What moves: a robot, and what its specification does not know.

    Attributes:
        robot: with its true stiffness, friction and curvature.
        damping_time_s: of its material, eta / E.
        tip_mass_kg: hung on its tip.
        tip_force_N: on its tip, base frame, shape (3,).
        gain: of each channel, shape (t,).
        play_N: width of a dead-band before the tendons.
        lag_s, delay_s: of what arrives at the tendons.
        tracker_rad: turn of the tracker about +z.
        tracker_mm: its shift, shape (3,).
    """

    robot: ContinuumRobot
    damping_time_s: float
    tip_mass_kg: float = 0.0
    tip_force_N: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gain: tuple[float, ...] = ()
    play_N: float = 0.0
    lag_s: float = 0.0
    delay_s: float = 0.0
    tracker_rad: float = 0.0
    tracker_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)


class WildMotion(Exception):
    """The motion diverged: another draw is needed."""


def measured(specimen: Specimen, inputs: Inputs, gravity_mps2: Array, columns: tuple[str, ...]) -> Array:
    """Return what a tracker shows at the rows, without noise, shape (r, o) [mm].

    Args:
        specimen: what moves.
        inputs: as commanded; tensions, which change linearly from row to row.
        gravity_mps2: shape (3,).
        columns: positions, as `tip_x_mm`.

    Raises:
        WildMotion: it diverged.
    """
    postures = moved(specimen, inputs.time_s - inputs.time_s[0], arriving(specimen, inputs), gravity_mps2)
    values = posture_columns(specimen.robot, postures, columns)
    return _tracked(specimen, values, columns)


def arriving(specimen: Specimen, inputs: Inputs) -> Array:
    """Return the tensions that arrive at the tendons at each row, shape (r, t) [N]."""
    tension, time_s = inputs.tendon.copy(), inputs.time_s - inputs.time_s[0]
    if specimen.gain:
        tension = tension * np.array(specimen.gain)
    if specimen.play_N:
        tension = _with_play(tension, specimen.play_N)
    if specimen.lag_s:
        tension = _with_lag(time_s, tension, specimen.lag_s)
    if specimen.delay_s:
        asked = time_s - specimen.delay_s  # what was before the first row stood still
        tension = np.stack([np.interp(asked, time_s, column) for column in tension.T], axis=1)
    return np.maximum(tension, 0.0)


def moved(specimen: Specimen, time_s: Array, tension: Array, gravity_mps2: Array) -> tuple[Posture, ...]:
    """Return the postures at the rows, from rest under the first one."""
    robot = specimen.robot
    finer = replace(
        robot,
        links_per_subsegment=FINER * robot.links_per_subsegment,
        dynamics=replace(robot.dynamics, damping_time_s=0.0, motion_timestep_s=STEP_S),
    )
    simulator = Simulator(finer, "tension", gravity_mps2, inertia=False)
    simulator.let_go()
    model, data = simulator.model, simulator.data
    if specimen.tip_mass_kg:
        _hang(model, int(simulator.faces[-1]), specimen.tip_mass_kg)
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
    hinges = model.jnt_dofadr[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]
    stiffness = model.jnt_stiffness[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]
    model.dof_armature[:] = 0.0
    force = np.array(specimen.tip_force_N)

    model.opt.timestep = _REST_STEP_S
    model.dof_damping[hinges] = _OVERDAMPED_S * stiffness
    _tell_friction(simulator)
    rise = round(0.5 * _REST_S / _REST_STEP_S)
    for step in range(2 * rise):
        simulator.set_inputs(tension[0] * min(1.0, (step + 1) / rise), force)
        simulator.step()
    data.qvel[:] = 0.0

    model.opt.timestep = STEP_S
    model.dof_damping[hinges] = specimen.damping_time_s * stiffness
    _tell_friction(simulator)
    postures = [simulator.posture()]
    for row in range(1, len(time_s)):
        span_s = time_s[row] - time_s[row - 1]
        steps = round(span_s / STEP_S)
        for step in range(steps):
            share = (step + 0.5) / steps
            simulator.set_inputs(tension[row - 1] + (tension[row] - tension[row - 1]) * share, force)
            simulator.step()
        if not (np.isfinite(data.qvel).all() and np.abs(data.qpos).max() < np.pi):
            raise WildMotion(f"at {time_s[row]:g} s")
        postures.append(simulator.posture())
    return tuple(postures)


def _tell_friction(simulator: Simulator) -> None:
    """Let the law of friction know that step and damping have changed."""
    law = simulator.laws.friction
    if isinstance(law, CapstanFriction):
        law.know_joints()


def _hang(model: mujoco.MjModel, site: int, mass_kg: float) -> None:
    """Add a point mass to the body of a site: its mass, the place of its centre, its inertia about that."""
    body = int(model.site_bodyid[site])
    own_kg, centre = float(model.body_mass[body]), model.body_ipos[body].copy()
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[body])
    turn = axes.reshape(3, 3)
    inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
    total_kg = own_kg + mass_kg
    middle = (own_kg * centre + mass_kg * model.site_pos[site]) / total_kg
    for part_kg, place in ((own_kg, centre), (mass_kg, model.site_pos[site])):
        away = place - middle
        inertia = inertia + part_kg * (away @ away * np.eye(3) - np.outer(away, away))
    sizes, directions = np.linalg.eigh(inertia)
    if np.linalg.det(directions) < 0.0:
        directions[:, 0] *= -1.0
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, directions.ravel())
    model.body_mass[body], model.body_ipos[body] = total_kg, middle
    model.body_inertia[body], model.body_iquat[body] = sizes, quat
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _with_play(tension: Array, width: float) -> Array:
    """Return what follows within half a dead-band, which stands in its middle at the first row."""
    now, found = tension[0].copy(), np.empty_like(tension)
    for row, pulled in enumerate(tension):
        now = np.minimum(np.maximum(now, pulled - 0.5 * width), pulled + 0.5 * width)
        found[row] = now
    return found


def _with_lag(time_s: Array, tension: Array, lag_s: float) -> Array:
    """Return a first-order lag's answer, by steps of a hundredth of the lag, at rest at the first row."""
    now, found = tension[0].copy(), np.empty_like(tension)
    found[0] = now
    for row in range(1, len(time_s)):
        span_s = float(time_s[row] - time_s[row - 1])
        count = max(1, int(np.ceil(100.0 * span_s / lag_s)))
        for step in range(count):
            target = tension[row - 1] + (tension[row] - tension[row - 1]) * (step + 0.5) / count
            now = now + (target - now) * (1.0 - np.exp(-span_s / count / lag_s))
        found[row] = now
    return found


def _tracked(specimen: Specimen, values: dict[str, Array], columns: tuple[str, ...]) -> Array:
    """Return positions as a tracker shows them that is turned about +z and shifted."""
    cos, sin = np.cos(specimen.tracker_rad), np.sin(specimen.tracker_rad)
    shown = []
    for name in columns:
        place, axis = name.removesuffix("_mm").rsplit("_", 1)
        x, y = (values.get(f"{place}_{letter}_mm", np.zeros(1)) for letter in "xy")
        turned = {"x": cos * x - sin * y, "y": sin * x + cos * y}
        shown.append(turned.get(axis, values[name]) + specimen.tracker_mm["xyz".index(axis)])
    return np.stack(shown, axis=1)
