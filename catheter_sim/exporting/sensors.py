"""Sensors of what a tracker sees: the place of every element's distal face, of the tip and of markers."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

from scipy.spatial.transform import Rotation

from catheter_sim.core.robot import Marker
from catheter_sim.exporting.causes import View
from catheter_sim.exporting.elements import child, text_of
from catheter_sim.mjcf import names

TRACKER = "tracker"


def add_sensors(root: ElementTree.Element, elements: int, view: View, markers: Sequence[Marker] = ()) -> None:
    """Add `position_<k>` of every face, `tip_position`, `tip_quat` and `position_marker_<name>`.

    They are seen from the site `tracker`.

    Args:
        root: the model.
        elements: how many faces it has.
        view: p' = R p + shift: the tracker's axes are the columns of R^T, its zero lies at -R^T shift.
        markers: of which it has sites.
    """
    turn, zero = view.R.T, -view.R.T @ view.shift
    ElementTree.SubElement(
        child(root, "worldbody"),
        "site",
        name=TRACKER,
        group="5",
        size="0.0001",
        pos=text_of(*zero),
        quat=text_of(*Rotation.from_matrix(turn).as_quat(scalar_first=True)),
    )
    block = child(root, "sensor")
    seen = {"objtype": "site", "reftype": "site", "refname": TRACKER}
    if view.delay_s > 0.0:
        seen |= {"delay": text_of(view.delay_s), "nsample": "0", "interp": "linear"}
    for k in range(1, elements + 1):
        ElementTree.SubElement(block, "framepos", seen, name=f"position_{k}", objname=names.face(k))
    for marker in markers:
        name = names.marker(marker.name)
        ElementTree.SubElement(block, "framepos", seen, name=f"position_{name}", objname=name)
    ElementTree.SubElement(block, "framepos", seen, name="tip_position", objname=names.TIP)
    late = {key: value for key, value in seen.items() if key != "interp"}
    ElementTree.SubElement(block, "framequat", late, name="tip_quat", objname=names.TIP)
