"""This package's rod: the static model VC, the simulated chain, and the same chain by MuJoCo alone."""

from __future__ import annotations

from importlib.metadata import version

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Dynamics, Friction
from catheter_sim.robots.continuum.rods import vc
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.speed.peers.rod import (
    AREA_M2,
    DENSITY,
    ELEMENTS,
    LENGTH_M,
    POISSON,
    RADIUS_M,
    SECOND_MOMENT_M4,
    SHEAR_PA,
    YOUNG_PA,
    Program,
)

_STEPS = 2000
_AT_REST_M_PER_S = 1e-6  # of the tip, on average over a hundred steps
_NO_GRAVITY = np.zeros(3)


def rod(scale: float = 1.0) -> ContinuumRobot:
    """Return the rod as a robot with a tendon that nobody pulls."""
    bending = scale * YOUNG_PA * SECOND_MOMENT_M4
    segment = Segment(
        name="rod",
        length_m=LENGTH_M,
        disks=ELEMENTS,
        outer_radius_m=RADIUS_M,
        bending_stiffness_N_m2=bending,
        mass_kg=DENSITY * AREA_M2 * LENGTH_M,
        torsion_stiffness_N_m2=bending / (1.0 + POISSON),
        axial_stiffness_N=scale * YOUNG_PA * AREA_M2,
        shear_stiffness_N=scale * SHEAR_PA * AREA_M2,
    )
    return ContinuumRobot(
        name="rod",
        description="rod of TPU",
        segments=(segment,),
        tendons=(Tendon("1", 0.8 * RADIUS_M, 0.0, "rod"),),
        friction=Friction(0.0),
        dynamics=Dynamics(),
    )


def _pushed(forces: Array) -> Inputs:
    """Return inputs with a force across the tip in each row."""
    rows = len(forces)
    force = np.zeros((rows, 3))
    force[:, 0] = forces
    return Inputs(np.arange(float(rows)), "tension", np.zeros((rows, 1)), force, np.zeros((rows, 3)))


def static_model() -> Program:
    """Return the static model VC."""
    nominal = rod()

    def tip(scale: float, force_N: float) -> tuple[float, float]:
        found = vc(rod(scale), _pushed(np.array([force_N])), _NO_GRAVITY).postures[0].p_w[-1]
        return float(found[0]), float(found[2])

    return Program(
        "catheter-sim, statics VC", tip, None, None,
        lambda forces: vc(nominal, _pushed(forces), _NO_GRAVITY), 1000, "Cosserat rod, Newton's method",
    )  # fmt: skip


def simulation() -> Program:
    """Return the simulated chain."""
    kept: dict[float, Simulator] = {}

    def tip(scale: float, force_N: float) -> tuple[float, float]:
        if scale not in kept:
            kept.clear()
            kept[scale] = Simulator(rod(scale), inertia=False)
        simulator = kept[scale]
        simulator.reset()
        simulator.set_inputs(np.zeros(1), (force_N, 0.0, 0.0))
        simulator.settle(60.0)
        place = simulator.posture().p_w[-1]
        return float(place[0]), float(place[2])

    moving = Simulator(rod())
    moving.set_inputs(np.zeros(1), (0.1, 0.0, 0.0))

    def step() -> int:
        moving.step(_STEPS)
        return _STEPS

    return Program(
        "catheter-sim, simulation", tip, step, float(moving.model.opt.timestep), None, 0,
        "hinges, settled without inertia",
    )  # fmt: skip


def plain_mujoco() -> Program:
    """Return the same chain stepped by MuJoCo alone until it is at rest."""
    kept: dict[float, mujoco.MjModel] = {}
    place = mujoco.mjtObj.mjOBJ_SITE

    def pushed(model: mujoco.MjModel, data: mujoco.MjData, force_N: float, steps: int) -> None:
        site = mujoco.mj_name2id(model, place, "tip")
        force, none = np.array([force_N, 0.0, 0.0]), np.zeros(3)
        for _ in range(steps):
            data.qfrc_applied[:] = 0.0
            mujoco.mj_applyFT(
                model, data, force, none, data.site_xpos[site], model.site_bodyid[site], data.qfrc_applied
            )
            mujoco.mj_step(model, data)

    def tip(scale: float, force_N: float) -> tuple[float, float]:
        if scale not in kept:
            kept.clear()
            kept[scale] = Simulator(rod(scale), inertia=False).model
        model = kept[scale]
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        found = data.site("tip").xpos
        for _ in range(1000):
            before = found.copy()
            pushed(model, data, force_N, 100)
            if np.abs(found - before).max() < _AT_REST_M_PER_S * 100 * model.opt.timestep:
                break
        return float(found[0]), float(found[2])

    moving = Simulator(rod()).model
    data = mujoco.MjData(moving)
    mujoco.mj_forward(moving, data)

    def step() -> int:
        pushed(moving, data, 0.1, _STEPS)
        return _STEPS

    return Program(
        f"mujoco {version('mujoco')}, plain", tip, step, float(moving.opt.timestep), None, 0,
        "the same chain, mj_step until at rest",
    )  # fmt: skip
