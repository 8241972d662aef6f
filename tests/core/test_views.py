"""Arrays of the engine that are looked up once."""

from __future__ import annotations

import copy

import mujoco
import numpy as np

from catheter_sim.core.law import Views


def test_a_copy_looks_its_own_arrays_up() -> None:
    """Copied together with a state, it sees the copy's arrays and no longer the original's."""
    data = mujoco.MjData(mujoco.MjModel.from_xml_string("<mujoco><worldbody/></mujoco>"))
    views = Views("xpos", one_copy=True)
    assert np.shares_memory(views(data)[0], data.xpos)
    there, again = copy.deepcopy((data, views))
    assert np.shares_memory(again(there)[0], there.xpos)
    assert not np.shares_memory(again(there)[0], data.xpos)
