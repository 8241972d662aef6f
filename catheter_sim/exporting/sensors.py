"""Sensors of what a tracker sees: the place of every element's distal face, of the tip and of markers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from scipy.spatial.transform import Rotation

from catheter_sim.core.robot import Marker
from catheter_sim.exporting.causes import View
from catheter_sim.mjcf import names
from catheter_sim.mjcf.document import Element

TRACKER = "tracker"


def add_sensors(root: Element, elements: int, view: View, markers: Sequence[Marker] = ()) -> None:
    """Add `position_<k>` of every face, `tip_position`, `tip_quat` and `position_marker_<name>`.

    They are seen from the site `tracker`.

    Args:
        root: the model.
        elements: how many faces it has.
        view: p' = R p + shift: the tracker's axes are the columns of R^T, its zero lies at -R^T shift.
        markers: of which it has sites.
    """
    turn, zero = view.R.T, -view.R.T @ view.shift
    quat = Rotation.from_matrix(turn).as_quat(scalar_first=True)
    root.part("worldbody").add("site", name=TRACKER, group=5, size=1e-4, pos=zero, quat=quat)
    block = root.part("sensor")
    seen: dict[str, Any] = {"objtype": "site", "reftype": "site", "refname": TRACKER}
    if view.delay_s > 0.0:
        seen |= {"delay": view.delay_s, "nsample": 0, "interp": "linear"}
    for k in range(1, elements + 1):
        block.add("framepos", **seen, name=f"position_{k}", objname=names.face(k))
    for marker in markers:
        name = names.marker(marker.name)
        block.add("framepos", **seen, name=f"position_{name}", objname=name)
    block.add("framepos", **seen, name="tip_position", objname=names.TIP)
    seen["interp"] = None
    block.add("framequat", **seen, name="tip_quat", objname=names.TIP)
