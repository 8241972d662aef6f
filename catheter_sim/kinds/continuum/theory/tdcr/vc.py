"""The static model VC: a Cosserat rod whose tendons are held to its shape everywhere.

Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Eqs 24-41; after Rucker and Webster 2011). Torsion,
shear and extension included; exact for tendons in lumens, for spacer disks an approximation that
improves with their number.
"""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.static_run import StaticRun
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.kinds.continuum.theory.tdcr.rods import static_run


def vc(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` under `inputs`, row after row.

    Args:
        robot: any linear robot, straight at rest; its `effects` are not read.
        inputs: tensions or displacements, and loads on the tip.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: the robot or the inputs are not for this model, or a row has no equilibrium.
    """
    return static_run("VC", "continuous", robot, inputs, gravity_mps2)
