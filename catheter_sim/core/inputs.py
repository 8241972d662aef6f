"""What drives a robot, row by row: the one value that goes from files to the simulation and every model."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.core.posture import Array


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
    """

    time_s: Array
    actuation: str
    tendon: Array
    force_tip: Array
    moment_tip: Array

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
    )


def same_inputs(one: Inputs, other: Inputs) -> bool:
    """Return whether two inputs of one kind of actuation are the same, number by number."""
    if one is other:
        return True
    names = ("time_s", "tendon", "force_tip", "moment_tip")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def row_name(inputs: Inputs, row: int) -> str:
    """Return what to call a row of inputs in errors."""
    return f"row {row + 1} (time_s = {inputs.time_s[row]:g})"
