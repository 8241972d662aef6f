"""Claims about what is remembered of a simulation to draw it later."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.pictures.offscreen import put, state_of, swept_points
from catheter_sim.simulation.simulator import Simulator

SHORT_LINKS = ("segments.section.joints=3", "segments.section.length_mm=45", "friction.mu=0")


def bent() -> Simulator:
    """Return three rolling links under 20 N."""
    simulator = Simulator(load_robot("chest_tube_section", SHORT_LINKS), inertia=False)
    simulator.set_inputs(np.array([20.0]))
    simulator.step(300)
    return simulator


def test_remembered_links_come_back_where_they_had_rolled_to() -> None:
    """Bent, remembered, straight again, put back: faces to a micrometre, and some 10 mm from the straight."""
    simulator = bent()
    faces = [simulator.model.site(f"face_{k}").id for k in (1, 2, 3)]
    expected = simulator.posture().p_w
    state = state_of(simulator)
    simulator.reset()
    straight = simulator.posture().p_w
    data = mujoco.MjData(simulator.model)
    put(state, simulator.model, data)
    assert data.site_xpos[faces] == pytest.approx(expected, abs=1e-6)
    assert np.linalg.norm(expected[-1] - straight[-1]) > 5e-3


def test_swept_points_enclose_every_vertex_that_is_drawn() -> None:
    """In each of two states every mesh's corners lie within the points' extent along x, y and z."""
    simulator = bent()
    states = [state_of(simulator)]
    simulator.reset()
    states.append(state_of(simulator))
    model, data = simulator.model, mujoco.MjData(simulator.model)
    cloud = swept_points(model, states)
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    seen = 0
    for state in states:
        put(state, model, data)
        for geom in np.flatnonzero(model.geom_group < 3):
            mesh = model.geom_dataid[geom]
            if mesh < 0:
                continue
            begin = model.mesh_vertadr[mesh]
            vertices = model.mesh_vert[begin : begin + model.mesh_vertnum[mesh]].astype(float)
            placed = vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
            assert (placed >= low - 1e-9).all()
            assert (placed <= high + 1e-9).all()
            seen += len(placed)
    assert seen > 100
