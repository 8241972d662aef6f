"""The static model CC_sub: one arc of constant curvature per subsegment, with twist.

Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Eqs. 8, 30-33, 43-47, 58). Every arc's moment is that
about its base; where tendon forces or a load make the moment vary along the subsegment, this is where
the model errs: by the length of a subsegment, to first order.
"""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.static_run import StaticRun
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.kinds.continuum.theory.tdcr.lumped import static_run
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.models import ARC


def cc_sub(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` under `inputs`, row by row; see the module's text.

    Args:
        robot: any robot that `problem.is_rod` accepts; shear and stretch of the backbone are not in
            the model, and its `effects` are not read.
        inputs: tensions or displacements, and loads on the tip.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: see `lumped.static_run`.
    """
    return static_run("CC_sub", ARC, robot, inputs, gravity_mps2)
