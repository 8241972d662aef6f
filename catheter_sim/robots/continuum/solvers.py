"""A face of its own: the solvers behind the rod models, as calls: arrays in, arrays out, nothing made of the
answer.

A model's function also makes inputs into loads and the answer into postures, in Python: some 0.4 ms a row, of
which the solver of CC takes a hundredth. Where models are compared by their time, as in the modelling
benchmark (Rao et al. 2021, Figs 10C, 11C, 11F), that is not what is asked about.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.robots.continuum import cc, four_bar, lumped, modal, rods
from catheter_sim.robots.continuum.lumped_kernels import ARC, LINKS, LINKS_MIDDLE, LINKS_ONE
from catheter_sim.robots.continuum.rods import is_rod, load, problem, unsupported_along
from catheter_sim.robots.continuum.spec import ContinuumRobot

LUMPED = {
    "CC_sub": ARC,
    "PRB": LINKS,
    "PRB_middle": LINKS_MIDDLE,
    "PRB_no_twist": LINKS,
    "PRB_one": LINKS_ONE,
}
MODAL = {basis.name: basis for basis in (modal.POLYNOMIAL, modal.HAAR, modal.TAYLOR)}
RODS = {
    "VC": "continuous",
    "VC_moment": "moment",
    "VC_tip_force": "tip_force",
    "VC_ref": "projected",
    "VC_ref_noproj": "eyelets",
}
BESIDE = ("VC", "VC_moment", "VC_tip_force", "four_bar")  # of tendons that run alike through all disks


def solver_call(
    model: str, robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array, threads: int = 1
) -> Callable[[], object] | None:
    """Return a model's solver on some rows, ready to be called; None where it does more than solve.

    Args:
        model: name of a static model.
        robot: with its effects built in.
        inputs: rows.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        threads: among which the rows are shared out, where the model does that.
    """
    if not is_rod(robot) or robot.friction.mu != 0.0 or robot.effects:
        return None
    if inputs.actuation != "tension" or (model in BESIDE and unsupported_along(robot)):
        return None
    body = problem(robot)
    loads = load(body, inputs, gravity_mps2)
    if model == "CC":
        if loads.force_N.any() or loads.moment_N_m.any():
            return None
        return partial(cc.poses, body, cc.bend_per_tension(body), np.ascontiguousarray(inputs.tendon))
    if model == "four_bar":  # the lengths are given
        found = rods.equilibria(body, loads, "projected")
        short = body.disk_z_m[body.last_disk] - rods.path_lengths(found)
        return partial(four_bar.linkages, body, loads, short, found.span_tension)
    if model in LUMPED:
        body = lumped.untwisted(body) if model == "PRB_no_twist" else body
        return partial(lumped.equilibria, body, loads, LUMPED[model], threads=threads)
    if model in MODAL:
        return partial(modal.equilibria, body, loads, MODAL[model], threads)
    return partial(rods.equilibria, body, loads, RODS[model], threads=threads) if model in RODS else None
