"""Claims about tissue's springs on a single ball: force and depth at rest, largest force, and forgetting."""

from __future__ import annotations

import mujoco
import pytest

from catheter_sim.simulation.tissue import Tissue

MASS_KG, GRAVITY = 2e-3, 9.81


def ball_on(stiffness: float) -> tuple[mujoco.MjData, Tissue, mujoco.MjModel]:
    """Return a ball of 2 g that was let go on the surface of tissue and has come to rest."""
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="2e-3" gravity="0 0 -{GRAVITY}"/><worldbody>
        <geom name="tissue_floor_0" type="box" size="1 1 0.1" pos="0 0 -0.1" margin="1e-3" condim="1"/>
        <body pos="0 0 0.01"><joint name="z" type="slide" axis="0 0 1" damping="0.2"/>
        <geom name="touch_ball" type="sphere" size="0.01" mass="{MASS_KG}" margin="1e-3" condim="1"/></body>
        </worldbody></mujoco>"""
    )
    tissue = Tissue(model, {"floor": stiffness})
    data = mujoco.MjData(model)
    for _ in range(3000):
        mujoco.mj_step1(model, data)
        tissue.finish_step(data)
    return data, tissue, model


@pytest.mark.parametrize("stiffness", [5.0, 50.0, 5000.0])
def test_depth_at_rest_is_weight_over_stiffness(stiffness: float) -> None:
    """The floor bears the ball's weight, at the depth at which its spring does."""
    data, tissue, _ = ball_on(stiffness)
    weight = MASS_KG * GRAVITY
    assert tissue.force_N[0] == pytest.approx(weight, rel=1e-6)
    assert -float(data.qpos[0]) == pytest.approx(weight / stiffness, rel=1e-4, abs=1e-9)


def test_largest_force_is_kept_until_it_is_forgotten() -> None:
    """Lifted off, nothing presses, and the largest force is still told; forgotten, it is nothing."""
    data, tissue, model = ball_on(50.0)
    data.qpos[0] = 0.05
    data.qvel[0] = 0.0
    mujoco.mj_step1(model, data)
    tissue.finish_step(data)
    assert tissue.force_N[0] == 0.0
    assert tissue.peak_N[0] >= MASS_KG * GRAVITY
    tissue.forget()
    assert tissue.peak_N[0] == 0.0
