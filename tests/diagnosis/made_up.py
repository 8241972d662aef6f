"""Data sets whose inputs and outputs are made up, for tests of what is done with residuals."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.trials import Dataset, Trial
from catheter_sim.tables import Table


def pulled_by(pull: Array, measured: Mapping[str, Array]) -> Dataset:
    """Return one held-out trial of the section, its right tendon pulled, a row a second.

    Args:
        pull: tension of the right tendon, shape (r,) [N].
        measured: outputs by column, shape (r,) each.
    """
    time_s = np.arange(float(len(pull)))
    zeros = np.zeros((len(pull), 3))
    inputs = Inputs(time_s, "tension", np.stack([pull, np.zeros_like(pull)], axis=1), zeros, zeros)
    return Dataset(
        folder=Path("made_up"),
        name="made up",
        robot=load_robot("neuroendoscope_section"),
        robot_reference="neuroendoscope_section",
        source="made up",
        licence="none",
        gravity_mps2=np.zeros(3),
        input_channels=("tension_right_N",),
        output_channels=tuple(measured),
        trials=(Trial("a.csv", "heldout", inputs, Table(time_s, dict(measured))),),
    )
