"""What drives a robot, row by row and column by column: inputs, loads, and which tendons share them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import lru_cache, partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import R, by_identity
from catheter_sim.errors import InputError

# ----------------------------------------------------------------------------------------------------
# What drives a robot, row by row: the one value that goes from files to the simulation and every model.


@dataclass(frozen=True)
class Inputs:
    """What drives a robot, row by row, in SI units.

    Attributes:
        time_s: since the first row, shape (r,), strictly increasing.
        actuation: "tension" or "displacement".
        tendon: tension [N] or displacement [m] of each tendon in the robot's order, shape (r, t); of
            a catheter each pair's displacement and the tube's advance.
        force_tip: on the tip, base frame, shape (r, 3) [N].
        moment_tip: on the tip, base frame, shape (r, 3) [N m].
        bodies: numbers of the elements (1 at the base) on whose distal faces forces act beside the tip's.
        force_body: on these, base frame, shape (r, b, 3) [N].
        moment_body: on these, base frame, shape (r, b, 3) [N m].
    """

    time_s: Array
    actuation: str
    tendon: Array
    force_tip: Array
    moment_tip: Array
    bodies: tuple[int, ...] = ()
    force_body: Array = field(default_factory=partial(np.zeros, (0, 0, 3)))
    moment_body: Array = field(default_factory=partial(np.zeros, (0, 0, 3)))

    def __len__(self) -> int:
        return len(self.time_s)


def slice_inputs(inputs: Inputs, rows: slice) -> Inputs:
    """Return the given rows of `inputs`."""
    return replace(
        inputs,
        time_s=inputs.time_s[rows],
        tendon=inputs.tendon[rows],
        force_tip=inputs.force_tip[rows],
        moment_tip=inputs.moment_tip[rows],
        force_body=inputs.force_body[rows],
        moment_body=inputs.moment_body[rows],
    )


def numbers_of(inputs: Inputs) -> tuple[object, ...]:
    """Return what two inputs share if they are the same, number by number; fit for a dictionary's key."""
    names = ("time_s", "tendon", "force_tip", "moment_tip", "force_body", "moment_body")
    return inputs.actuation, inputs.bodies, *(getattr(inputs, name).tobytes() for name in names)


def row_name(inputs: Inputs, row: int) -> str:
    """Return what to call a row of inputs in errors."""
    return f"row {row + 1} (time_s = {inputs.time_s[row]:g})"


def require_tip_loads_alone(inputs: Inputs, what: str) -> None:
    """Raise `InputError` where forces act on elements and `what` knows forces on the tip alone."""
    if inputs.bodies:
        names = ", ".join(str(body) for body in inputs.bodies)
        raise InputError(f"force or moment on body {names}: {what} knows those on the tip alone")


# ----------------------------------------------------------------------------------------------------
# Forces on a robot's elements that the statics of rolling joints and the simulation both take.


@dataclass(frozen=True)
class LinkForce:
    """A force on one link, and a moment, that keep their directions in the base frame.

    Attributes:
        link: counted from 1 at the base.
        point_m: where it acts, in the link's frame (z on the axis, the flat top at z = the link's
            length), shape (3,); None: in the middle of its distal face.
        force_N: in the base frame, shape (3,).
        moment_Nm: the same, for the simulation; the statics of rolling joints take a moment at the tip only.
    """

    link: int
    point_m: tuple[float, float, float] | None
    force_N: tuple[float, float, float]
    moment_Nm: tuple[float, float, float] = (0.0, 0.0, 0.0)


def check_links(others: Sequence[LinkForce], links: int) -> None:
    """Raise `InputError` where one of `others` names a link that a robot of `links` links does not have."""
    for item in others:
        if not 1 <= item.link <= links:
            raise InputError(f"force on link {item.link}: the robot's links are 1 to {links}")


def with_tip_weight(inputs: Inputs, tip_mass_kg: float, gravity_mps2: Array) -> Inputs:
    """Return `inputs` with the weight of a mass at the tip added to the force there.

    For static models and twins; the simulation's model holds the mass itself.
    """
    if tip_mass_kg == 0.0:
        return inputs
    return replace(inputs, force_tip=inputs.force_tip + tip_mass_kg * gravity_mps2)


# ----------------------------------------------------------------------------------------------------
# What drives a robot, column by column: what an input is, what it moves, and which tendons share it.

READ_WITH = ".channel_gain"  # ends the keys of numbers by which columns of inputs become those of tendons


class Quantity(Enum):
    """What an input column gives, in SI units."""

    TENSION = "N"  # of its tendons together; never below zero
    DISPLACEMENT = "m"  # of each of its tendons, or of an antagonistic pair
    ADVANCE = "m, along the axis"  # of a tube that is pushed out

    @property
    def file_unit(self) -> str:
        """The unit of its columns in files."""
        return "N" if self is Quantity.TENSION else "mm"

    @property
    def file_size(self) -> float:
        """That unit in SI."""
        return 1.0 if self is Quantity.TENSION else 1e-3


def quantity_of(actuation: str) -> Quantity:
    """Return what tendons are given where a robot is driven by "tension" or by "displacement"."""
    return Quantity[actuation.upper()]


def driven_by(robot: R, actuation: str) -> R:
    """Return `robot` driven by "tension" or "displacement": the units of its effects are those."""
    return robot if robot.actuation == actuation else replace(robot, actuation=actuation)


@dataclass(frozen=True)
class Drive:
    """One input column of a robot.

    Attributes:
        column: its name in files, with its unit (`tension_right_N`).
        channel: the name that its tendons share.
        quantity: what it gives.
        tendons: places among the robot's tendons of those that share it.
        moves: name of the segment, section or joint that it moves.
        side: unit vector in the xy plane toward which it bends what it moves; (0, 0): it moves a joint of
            its own, to either side.
        least, most: what a file may ask of it, SI.
        gains: how far each of its tendons is pulled while the column is pulled by 1; below zero: let out.
            (): as far, each of them.
    """

    column: str
    channel: str
    quantity: Quantity
    tendons: tuple[int, ...]
    moves: str
    side: tuple[float, float] = (0.0, 0.0)
    least: float = -math.inf
    most: float = math.inf
    gains: tuple[float, ...] = ()

    @property
    def share(self) -> float:
        """What of the column's input each of its tendons gets: a tension is their sum."""
        return 1.0 / len(self.tendons) if self.quantity is Quantity.TENSION else 1.0

    @property
    def parts(self) -> tuple[float, ...]:
        """What of the column's input each of its tendons gets, `gains` included."""
        share = self.share
        return tuple(share * gain for gain in self.gains) if self.gains else (share,) * len(self.tendons)


@dataclass(frozen=True)
class Outputs:
    """What a robot's output columns are besides the tip's.

    Attributes:
        elements: number of cells, links, rings or disks, the base's fixed one not counted.
        joints: the joints' names, base to tip (`joint_<name>_deg`).
        angles: of each column of an angle that several joints share (`angle_bending_deg`), these joints.
        tensions: names of what has a tension, by its place among the tendons.
    """

    elements: int
    joints: tuple[str, ...]
    tensions: Mapping[int, str]
    angles: Mapping[str, slice] = field(default_factory=dict)


def of_tendons(
    tendons: tuple[tuple[str, str, tuple[float, float]], ...], actuation: str, gains: tuple[float, ...] = ()
) -> tuple[Drive, ...]:
    """Return the drives of a robot whose tendons are pulled: one for those that share a channel's name.

    Args:
        tendons: the channel of each, what it moves, and the unit vector toward which it bends that.
        actuation: "tension" or "displacement".
        gains: of each in its channel (`Drive.gains`); (): 1 each.
    """
    return _of_tendons(tendons, quantity_of(actuation), gains)


@lru_cache(maxsize=256)  # a fit asks for the same of every robot
def _of_tendons(
    tendons: tuple[tuple[str, str, tuple[float, float]], ...], quantity: Quantity, gains: tuple[float, ...]
) -> tuple[Drive, ...]:
    places: dict[str, list[int]] = {}
    for index, (channel, _, _) in enumerate(tendons):
        places.setdefault(channel, []).append(index)
    found = []
    for channel, own in places.items():
        parts = tuple(gains[index] for index in own) if gains else ()
        pulled = zip(own, parts or (1.0,) * len(own), strict=True)
        toward = sum((gain * np.array(tendons[index][2]) for index, gain in pulled), np.zeros(2))
        x, y = (toward / max(float(np.linalg.norm(toward)), 1e-12)).tolist()
        pulls = quantity is Quantity.TENSION
        column = f"tension_{channel}_N" if pulls else f"displacement_{channel}_mm"
        least = 0.0 if pulls else -math.inf
        moves = tendons[own[-1]][1]
        found.append(Drive(column, channel, quantity, tuple(own), moves, (x, y), least, gains=parts))
    return tuple(found)


def pulls_alone(actuation: str, tendon: Array) -> Array:
    """Return inputs of tendons, in which no tension is below zero: a tendon cannot push."""
    return np.maximum(tendon, 0.0) if quantity_of(actuation) is Quantity.TENSION else tendon


@by_identity(1)
def shares(drives: tuple[Drive, ...], tendons: int) -> Array:
    """Return what of 1 in each column each tendon gets, shape (tendons, drives): a tension is their sum."""
    found = np.zeros((tendons, len(drives)))
    for column, drive in enumerate(drives):
        found[list(drive.tendons), column] = drive.parts
    return found


@by_identity(1)
def sums(drives: tuple[Drive, ...], tendons: int) -> Array:
    """Return what makes columns' values of tendons', inputs @ it, shape (tendons, drives).

    That is the sum of tensions that share a column, and the mean of what else shares one, by its gains.
    """
    found = np.zeros((tendons, len(drives)))
    for column, drive in enumerate(drives):
        found[list(drive.tendons), column] = 1.0 / (len(drive.tendons) * np.array(drive.parts))
    return found
