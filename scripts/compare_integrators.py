"""How near integrators and steps keep a rod that is let go to SoRoSim's, and at what cost.

    python scripts/compare_integrators.py [RELEASE ...]

Each line, of the TPU rod in 50 links, stepped by MuJoCo alone from rest: integrator, step, mean distance of
mid-length and tip over 3 s [% of the length], processor time over simulated time, and the rod's energy after
10 s of swinging without damping, of that at first. Each integrator has the damping and the armature that
`core.motion` gives it; "implicit" has those of "implicitfast".
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import mujoco
import numpy as np

from catheter_sim.core.motion import IMPLICIT_SPRINGS, LEAPFROG, SMOOTH, Integration, in_motion
from catheter_sim.core.robot import Dynamics
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.simulation.replay import Commands
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation.rod import (
    LENGTH_M,
    LINKS,
    RELEASES,
    Release,
    energies_of,
    release_case,
    release_inputs,
    tpu_rod,
)

CHOICES = (
    (IMPLICIT_SPRINGS, 1e-3),
    (IMPLICIT_SPRINGS, 5e-4),
    (LEAPFROG, 1e-3),
    (LEAPFROG, 5e-4),
    (LEAPFROG, 2.5e-4),
    ("implicit", 5e-4),
    (SMOOTH, 1e-3),
    (SMOOTH, 5e-4),
)
NUMBERS = {
    IMPLICIT_SPRINGS: mujoco.mjtIntegrator.mjINT_DISCRETE,
    LEAPFROG: mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    SMOOTH: mujoco.mjtIntegrator.mjINT_RK4,
}


def model_of(robot: ContinuumRobot, integrator: str, step_s: float) -> mujoco.MjModel:
    """Return the model of `robot` that an integrator would get with a step [s]."""
    rule = LEAPFROG if integrator == "implicit" else integrator
    stepped = replace(robot, dynamics=replace(robot.dynamics, motion_timestep_s=step_s))
    model = mujoco.MjModel.from_xml_string(build_mjcf(in_motion(stepped, Integration(rule))))
    model.opt.integrator, model.opt.timestep = NUMBERS[integrator], step_s
    return model


def from_rest(case: Release) -> np.ndarray:
    """Return the rod's joints at rest under the release's wrenches and gravity."""
    simulator = Simulator(tpu_rod(), gravity_mps2=case.gravity, inertia=False)
    commands = Commands(release_inputs(case, LINKS))
    commands.set(simulator, commands.rows[0])
    simulator.settle(60.0)
    return simulator.data.qpos.copy()


def error_and_cost(model: mujoco.MjModel, case: Release, rest: np.ndarray) -> tuple[float, float]:
    """Return the mean distance [% of the length] and processor time over simulated time."""
    data = mujoco.MjData(model)
    model.opt.gravity[:], data.qpos[:] = case.gravity, rest
    sites = [model.site(f"face_{k}").id for k in (LINKS // 2, LINKS)]
    found, begun, done = [], time.process_time(), 0
    for moment in case.time_s:
        steps = round(moment / model.opt.timestep) - done
        mujoco.mj_step(model, data, steps)
        done += steps
        mujoco.mj_kinematics(model, data)
        found.append(data.site_xpos[sites].copy())
    taken = (time.process_time() - begun) / case.time_s[-1]
    away = np.linalg.norm(np.array(found) - case.points, axis=2)
    return float(away.mean() / LENGTH_M * 100.0), taken


def main() -> int:
    """Print the table; return the exit status."""
    chosen = [int(word) for word in sys.argv[1:]] or [1]
    if not set(chosen) <= set(RELEASES):
        print("compare_integrators: releases are 1 to 10", file=sys.stderr)
        return 2
    cases = [release_case(number) for number in chosen]
    starts = [from_rest(case) for case in cases]
    print(f"{'integrator':<14}{'step ms':>8}{'mean %':>8}{'cost':>7}{'energy':>8}")
    for integrator, step_s in CHOICES:
        each = []
        for case, rest in zip(cases, starts, strict=True):
            robot = tpu_rod(dynamics=Dynamics(damping_time_s=case.damping_time_s))
            each.append(error_and_cost(model_of(robot, integrator, step_s), case, rest))
        error, cost = np.mean(each, axis=0)
        rod = tpu_rod()
        left = energies_of(model_of(rod, integrator, step_s), rod, 10.0)[-1]
        print(f"{integrator:<14}{1e3 * step_s:>8g}{error:>8.3f}{cost:>7.2f}{left:>8.3f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
