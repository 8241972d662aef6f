"""How a file's document says of which kind its robot is."""

from __future__ import annotations

from typing import Any

from catheter_sim.core.document import ALL_DIGITS, Document, from_document, to_document
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import unknown
from catheter_sim.robots import KINDS

_DEFAULT = "continuum"  # of a file without the key `kind`


def robot_from_document(document: Document, where: str) -> RobotSpec:
    """Return the robot in a document in file units; without the key `kind` it is a continuum robot.

    Raises:
        InputError: an unknown kind, or a key or value that this kind does not have.
    """
    name = document.get("kind", _DEFAULT)
    if not isinstance(name, str) or name not in KINDS:
        raise unknown("kind", str(name), KINDS, where)
    if name == _DEFAULT:
        document = {key: item for key, item in document.items() if key != "kind"}
    robot: RobotSpec = from_document(KINDS[name].spec, document, where)
    return robot


def complete_document(document: Document, where: str) -> dict[str, Any]:
    """Return `document` with every key that it leaves out, so that --set reaches them all.

    What stands for other keys (a material, for a stiffness), the robot's kind replaces by them.
    """
    kind = KINDS.get(str(document.get("kind", _DEFAULT)))
    if kind is not None and kind.has("defaults"):
        document = kind.face("defaults", "defaults").expanded(document, where)
    return to_document(robot_from_document(document, where), ALL_DIGITS)
