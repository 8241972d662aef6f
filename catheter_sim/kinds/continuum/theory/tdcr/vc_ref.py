"""The static models VC_ref and VC_ref_noproj: a Cosserat rod, its tendons straight from disk to disk.

Rao et al. 2021 (doi 10.3389/frobt.2020.630245, Eqs 30-41). VC_ref leaves out what the two spans of a
tendon together push a disk by along its own axis (Eq. 58): the benchmark's reference. That force is
not zero in an eyelet without friction, where the tension is the same on both sides; VC_ref_noproj
keeps it and is what MuJoCo's spatial tendons do.
"""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.static_run import StaticRun
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.kinds.continuum.theory.tdcr.rods import static_run


def vc_ref(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` with the disks' forces of Eq. 58; see `vc.vc`."""
    return static_run("VC_ref", "projected", robot, inputs, gravity_mps2)


def vc_ref_noproj(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of `robot` with tendons through eyelets; see `vc.vc`."""
    return static_run("VC_ref_noproj", "eyelets", robot, inputs, gravity_mps2)
