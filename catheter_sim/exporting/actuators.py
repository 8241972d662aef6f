"""Commands' causes as actuators: gains, biases, couplings, a force on the tip, lag, delay and creep.

A robot's actuators have MuJoCo's affine law, force = gain ctrl + bias + b1 length; a gain g and an offset
o of the input make it gain g ctrl + (bias + gain o) + b1 length. Where one input reaches another's tendon,
that tendon gets one more actuator; creep is one more with a lag of its own. All of them take inputs as
they are commanded: `shares` says which.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

import numpy as np

from catheter_sim.core.effect import Timing
from catheter_sim.core.posture import Array
from catheter_sim.exporting.causes import Affine
from catheter_sim.exporting.elements import child, text_of

_LEAST = 1e-9  # smaller numbers of a matrix are rounding
TIP_FORCE = "force_tip"
BASE = "base"


def command_actuators(
    root: ElementTree.Element, shares: Array, affine: Affine, timing: Timing, tensions: bool
) -> Array:
    """Change the model's actuators, and add some; return the shares of all, shape (nu, t).

    Args:
        root: the model; its actuators are those of the robot as it was built, in their order.
        shares: ctrl = shares @ what arrives, shape (k, t); further actuators have none.
        affine: what arrives of inputs.
        timing: how late.
        tensions: whether controls are tensions: none is below zero.
    """
    block = child(root, "actuator")
    own = [_as_general(item) for item in block]
    rows = [np.zeros(shares.shape[1]) for _ in own]
    for k, item in enumerate(own[: len(shares)]):
        if not shares[k].any():  # no input's
            continue
        through, bias = shares[k] @ affine.matrix, float(shares[k] @ affine.bias)
        main = int(np.argmax(np.abs(shares[k])))
        gain = float(item.get("gainprm", "1").split()[0])
        main_gain = through[main] / shares[k][main]
        item.set("gainprm", text_of(gain * main_gain))
        if bias != 0.0:
            before = [float(value) for value in item.get("biasprm", "0").split()]
            item.set("biastype", "affine")
            item.set("biasprm", text_of(before[0] + gain * bias, *before[1:]))
        if tensions:
            item.set("forcerange", "0 1e9")
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
            slow.set("dyntype", "filterexact")
            slow.set("dynprm", text_of(timing.creep_time_s))
            rows.append(rows[k])
    for k, item in enumerate(own[: len(shares)]):
        if shares[k].any():
            _late(item, timing)
    if affine.force_tip.any():
        _push_tip(root, block, affine.force_tip)
        rows.append(np.zeros(shares.shape[1]))
    return np.array(rows)


def _as_general(item: ElementTree.Element) -> ElementTree.Element:
    """Return an actuator as a `general` one: a `motor` has a gain of 1 and no dynamics."""
    item.tag = "general"
    item.attrib.pop("class", None)
    return item


def _beside(
    block: ElementTree.Element, item: ElementTree.Element, name: str, gain: float, tensions: bool
) -> ElementTree.Element:
    """Add an actuator that pulls what another one pulls, with a gain and nothing else."""
    kept = {key: item.get(key, "") for key in ("tendon", "joint", "gear") if item.get(key)}
    extra = ElementTree.SubElement(block, "general", kept, name=name, gainprm=text_of(gain))
    if tensions and gain > 0.0:
        extra.set("forcerange", "0 1e9")
    return extra


def _late(item: ElementTree.Element, timing: Timing) -> None:
    """Let an actuator follow its control by a lag and a delay."""
    if timing.lag_s > 0.0:
        item.set("dyntype", "filterexact")
        item.set("dynprm", text_of(timing.lag_s))
    if timing.delay_s > 0.0:
        item.set("delay", text_of(timing.delay_s))
        item.set("interp", "linear")
        item.set("nsample", "0")  # known once the step is: see `count_samples`


def count_samples(root: ElementTree.Element, timestep_s: float) -> None:
    """Give what is late the samples that its delay needs."""
    for item in (*child(root, "actuator"), *child(root, "sensor")):
        if item.get("delay"):
            item.set("nsample", str(math.ceil(float(item.get("delay", "0")) / timestep_s) + 2))


def _push_tip(root: ElementTree.Element, block: ElementTree.Element, force: Sequence[float] | Array) -> None:
    """Push on the tip with a constant force [N] along axes that stand still; the control does nothing."""
    world = child(root, "worldbody")
    if not any(site.get("name") == BASE for site in world.iter("site")):
        ElementTree.SubElement(world, "site", name=BASE, group="5", size="0.0001")
    ElementTree.SubElement(
        block,
        "general",
        name=TIP_FORCE,
        site="tip",
        refsite=BASE,
        gear=text_of(*force, 0.0, 0.0, 0.0),
        gainprm="0",
        biastype="affine",
        biasprm="1",
    )
