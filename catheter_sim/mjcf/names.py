"""How the parts of a model are called, whatever the robot's kind: who writes it and who looks them up agree.

Links, faces and holes count from 1 at the base (hole 0: the base's). What a kind has besides, its chain's
module explains.
"""

from __future__ import annotations

TIP = "tip"  # the site in the middle of the last face
TIP_MASS = "tip_mass"  # the body of a load that is fixed to the tip
MOUNT = "mount"  # the body that carries the base, and its slide, where the mount gives way


def link(number: int) -> str:
    """Return the name of a link's body."""
    return f"link_{number}"


def face(number: int) -> str:
    """Return the name of the site in the middle of an element's distal face."""
    return f"face_{number}"


def marker(name: str) -> str:
    """Return the name of the site of a marker."""
    return f"marker_{name}"


def tendon(name: str) -> str:
    """Return the name of a tendon in the model, and of the actuator that pulls it."""
    return f"tendon_{name}"


def hole(tendon_name: str, place: int | str) -> str:
    """Return the name of the site at which a tendon passes a link."""
    return f"hole_{tendon_name}_{place}"


def feed(tendon_name: str) -> str:
    """Return the name of the site in the world where a tendon's path begins, where the mount gives way."""
    return f"feed_{tendon_name}"
