"""A file for MJX or MuJoCo Warp has nothing that they refuse, and is as hard as MuJoCo's own."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from catheter_sim.exporting.elements import PLASTIC_SPRINGS, HingeLaw, Shift, add_friction, add_shifts
from catheter_sim.exporting.write import make_plainer
from catheter_sim.mjcf.document import read

STEP_S = 0.0005
ROLLING = f"""<mujoco><compiler angle="radian"/>
<option timestep="{STEP_S}" integrator="implicit" gravity="0 0 0"/>
<worldbody><site name="ground"/>
<body name="link"><joint name="x" type="hinge" axis="0 1 0" stiffness="0.1" damping="1e-3"/>
<inertial pos="0 0 0" mass="0.003" diaginertia="1e-10 1e-10 1e-10"/></body></worldbody>
<actuator><motor name="turn" joint="x"/></actuator>
<sensor><framepos name="seen" objtype="site" objname="ground" nsample="4" delay="0.001"/></sensor></mujoco>"""
SHIFT = Shift("x", "link", 0, np.array([8e-3, -1e-3, 2e-3, 1e-3]), 0.0)
RANGE_RAD, RUBS_N_M = 0.4, 8e-3


def rolling() -> mujoco.MjModel:
    """Return a link whose hinge moves a slide and rubs, for another engine."""
    root = read(ROLLING)
    plain = mujoco.MjModel.from_xml_string(ROLLING)
    laws = (HingeLaw("x", RANGE_RAD, 0.0, (), 0.0, RUBS_N_M, 0.0, 0.0),)
    add_shifts(root, (SHIFT,))
    add_friction(root, plain, laws, plastic=False)
    make_plainer(root, plain, laws)
    return mujoco.MjModel.from_xml_string(root.text())


def held(data: mujoco.MjData, model: mujoco.MjModel, moment_N_m: float, seconds: float = 1.0) -> float:
    """Return the hinge's angle after a moment has come slowly and stood [rad]."""
    before = data.ctrl[0]
    for share in np.linspace(0.0, 1.0, round(seconds / STEP_S)):
        data.ctrl[0] = before + share * (moment_N_m - before)
        mujoco.mj_step(model, data)
    mujoco.mj_step(model, data, round(seconds / STEP_S))
    return float(data.joint("x").qpos[0])


def test_nothing_is_left_that_other_engines_refuse() -> None:
    model = rolling()
    assert not model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_DIAGEXACT
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    if PLASTIC_SPRINGS:
        assert not model.tendon_springyield.any()
    assert not model.sensor_delay.any()


def test_a_slide_stays_at_its_hinge_under_a_force() -> None:
    """To a micrometre at 2 N, where a tie by joints gives way by 0.08 mm."""
    model = rolling()
    data = mujoco.MjData(model)
    data.xfrc_applied[1, 0] = 2.0
    angle = held(data, model, 0.02)
    assert abs(angle) > 0.05
    assert float(data.joint(SHIFT.slide).qpos[0]) == pytest.approx(SHIFT.at(angle), abs=1e-6)


def test_friction_holds_what_its_law_says() -> None:
    """At 0.2 rad it is 4 mN m to either side: within, the hinge stands for 2 s; beyond, it turns."""
    model = rolling()
    data = mujoco.MjData(model)
    share = 1.0 / RANGE_RAD * RUBS_N_M
    there = held(data, model, 0.2 * (0.1 + share))
    assert there == pytest.approx(0.2, rel=0.02)
    assert held(data, model, there * 0.1) == pytest.approx(there, abs=5e-4)
    assert held(data, model, there * (0.1 - 0.9 * share)) == pytest.approx(there, abs=5e-4)
    back = held(data, model, 0.1 * (0.1 - share))
    assert back == pytest.approx(0.1, rel=0.03)


def test_mujoco_warp_goes_where_mujoco_goes() -> None:
    """In single precision, the ties and friction of one joint."""
    warp = pytest.importorskip("mujoco_warp", reason="needs the extra gpu")
    model = rolling()
    data = mujoco.MjData(model)
    model_there, data_there = warp.put_model(model), warp.put_data(model, data, njmax=16)
    for moment in np.concatenate([np.linspace(0.0, 0.02, 200), np.linspace(0.02, 0.01, 100)]):
        data.ctrl[0] = moment
        data_there.ctrl.assign(np.array([data.ctrl], dtype=np.float32))
        mujoco.mj_step(model, data)
        warp.step(model_there, data_there)
    np.testing.assert_allclose(data_there.qpos.numpy()[0], data.qpos, atol=1e-5)
