"""Commands' causes as actuators: gains, biases, couplings, a force on the tip, lag, delay and creep.

A robot's actuators have MuJoCo's affine law, force = gain ctrl + bias + b1 length; a gain g and an offset
o of the input make it gain g ctrl + (bias + gain o) + b1 length. Where one input reaches another's tendon,
that tendon gets one more actuator; creep is one more with a lag of its own. All of them take inputs as
they are commanded: `shares` says which.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Timing
from catheter_sim.exporting.causes import Affine
from catheter_sim.mjcf.document import Element

_LEAST = 1e-9  # smaller numbers of a matrix are rounding
TIP_FORCE = "force_tip"
BASE = "base"


def command_actuators(root: Element, shares: Array, affine: Affine, timing: Timing, tensions: bool) -> Array:
    """Change the model's actuators, and add some; return the shares of all, shape (nu, t).

    Args:
        root: the model; its actuators are those of the robot as it was built, in their order.
        shares: ctrl = shares @ what arrives, shape (k, t); further actuators have none.
        affine: what arrives of inputs.
        timing: how late.
        tensions: whether controls are tensions: none is below zero.
    """
    block = root.part("actuator")
    own = list(block.children)
    for item in own:
        item.tag = "general"  # a `motor` has a gain of 1 and no dynamics
    rows = [np.zeros(shares.shape[1]) for _ in own]
    for k, item in enumerate(own[: len(shares)]):
        if not shares[k].any():  # no input's
            continue
        through, bias = shares[k] @ affine.matrix, float(shares[k] @ affine.bias)
        main = int(np.argmax(np.abs(shares[k])))
        gain = item.numbers("gainprm", 1.0)[0]
        main_gain = through[main] / shares[k][main]
        item.set(gainprm=gain * main_gain)
        if bias != 0.0:
            before = item.numbers("biasprm", 0.0)
            item.set(biastype="affine", biasprm=(before[0] + gain * bias, *before[1:]))
        if tensions:
            item.set(forcerange=(0.0, 1e9))
        rows[k][main] = shares[k][main]
        for other in np.flatnonzero(np.abs(through) > _LEAST):
            if int(other) == main:
                continue
            extra = _beside(
                block, item, f"coupled_{item.get('name')}_{other + 1}", gain * through[other], tensions
            )
            _late(extra, timing)
            rows.append(np.eye(shares.shape[1])[other])
        if timing.creep:
            slow = _beside(
                block, item, f"creep_{item.get('name')}", gain * main_gain * timing.creep, tensions
            )
            slow.set(dyntype="filterexact", dynprm=timing.creep_time_s)
            rows.append(rows[k])
    for k, item in enumerate(own[: len(shares)]):
        if shares[k].any():
            _late(item, timing)
    if affine.force_tip.any():
        _push_tip(root, block, affine.force_tip)
        rows.append(np.zeros(shares.shape[1]))
    return np.array(rows)


def _beside(block: Element, item: Element, name: str, gain: float, tensions: bool) -> Element:
    """Add an actuator that pulls what another one pulls, with a gain and nothing else."""
    kept = {key: item.get(key) for key in ("tendon", "joint", "gear")}
    forces = (0.0, 1e9) if tensions and gain > 0.0 else None
    return block.add("general", **kept, name=name, gainprm=gain, forcerange=forces)


def _late(item: Element, timing: Timing) -> None:
    """Let an actuator follow its control by a lag and a delay."""
    if timing.lag_s > 0.0:
        item.set(dyntype="filterexact", dynprm=timing.lag_s)
    if timing.delay_s > 0.0:
        # How many samples is known once the step is: see `count_samples`.
        item.set(delay=timing.delay_s, interp="linear", nsample=0)


def count_samples(root: Element, timestep_s: float) -> None:
    """Give what is late the samples that its delay needs."""
    for item in (*root.part("actuator").children, *root.part("sensor").children):
        for delay_s in item.numbers("delay"):
            item.set(nsample=math.ceil(delay_s / timestep_s) + 2)


def _push_tip(root: Element, block: Element, force: Sequence[float] | Array) -> None:
    """Push on the tip with a constant force [N] along axes that stand still; the control does nothing."""
    world = root.part("worldbody")
    if not any(site.get("name") == BASE for site in world.every("site")):
        world.add("site", name=BASE, group=5, size=1e-4)
    block.add(
        "general",
        name=TIP_FORCE,
        site="tip",
        refsite=BASE,
        gear=(*force, 0.0, 0.0, 0.0),
        gainprm=0,
        biastype="affine",
        biasprm=1,
    )
