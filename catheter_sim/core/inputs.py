"""What drives a robot, row by row: the one value that goes from files to the simulation and every model."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError


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
