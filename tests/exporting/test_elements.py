"""What is written for a hinge does in MuJoCo what its law says."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from catheter_sim.exporting.elements import (
    _STEEP_ARM,
    PLASTIC_SPRINGS,
    ExportRows,
    HingeLaw,
    add_friction,
    add_springs,
    fit_laws,
    slope_of,
)
from catheter_sim.mjcf.document import read

HINGE = """<mujoco><compiler angle="radian"/>
<option timestep="0.0005" integrator="discrete" gravity="0 0 0"/>
<worldbody><body name="link" pos="0 0 0.01"><joint name="x" type="hinge" axis="0 1 0"
damping="1e-3" armature="10"/>
<inertial pos="0 0 0.01" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/></body></worldbody>
<actuator><motor joint="x"/></actuator></mujoco>"""


def built(law: HingeLaw) -> mujoco.MjModel:
    root = read(HINGE)
    add_springs(root, [law])
    add_friction(root, mujoco.MjModel.from_xml_string(HINGE), [law])
    return mujoco.MjModel.from_xml_string(root.text())


def passive(model: mujoco.MjModel, way: np.ndarray) -> np.ndarray:
    """Return the hinge's moment along a way of angles, shape (r,) [N m]."""
    data = mujoco.MjData(model)
    found = []
    for angle in way:
        data.qpos[0], data.qvel[0] = angle, 0.0
        mujoco.mj_forward(model, data)
        found.append(data.qfrc_passive[0])
        mujoco.mj_step(model, data)  # what yields does so at a step's end
    return np.array(found)


@pytest.mark.skipif(not PLASTIC_SPRINGS, reason="MuJoCo before 4 has no plastic springs")
def test_friction_has_the_width_of_its_law_at_every_angle() -> None:
    """Up and down differ by twice c + w |x| + v |x|^3; springs add nothing to that."""
    law = HingeLaw("x", 0.4, 0.01, ((0.2, 0.05),), 1e-3, 4e-3, 2e-3, 0.0)
    way = np.linspace(0.0, 0.4, 40001)
    forth, back = passive(built(law), np.concatenate([way, way[::-1]])).reshape(2, -1)
    for angle in (0.1, 0.2, 0.3):
        row = round(angle / 0.4 * 40000)
        width = 1e-3 + 4e-3 * angle / 0.4 + 2e-3 * (angle / 0.4) ** 3
        assert back[::-1][row] - forth[row] == pytest.approx(2.0 * width, rel=0.04)
        springs = -0.01 * angle - 0.05 * max(0.0, angle - 0.2)
        assert 0.5 * (back[::-1][row] + forth[row]) == pytest.approx(springs, rel=0.02, abs=2e-5)


def test_a_steep_arm_grows_with_the_third_power_of_the_angle() -> None:
    """Its two chords' slopes cancel but for that; either alone is not steep."""
    small, large = (slope_of(_STEEP_ARM, angle) for angle in (0.05, 0.1))
    assert large / small == pytest.approx(8.0, rel=0.05)
    for chord in _STEEP_ARM:
        small, large = (slope_of((chord,), angle) for angle in (0.05, 0.1))
        assert large / small == pytest.approx(2.0, rel=0.05)


def test_a_width_that_grows_with_the_square_is_met() -> None:
    """As capstan friction's does, whose turn grows with the angle: to 5 % of its largest."""
    angle = np.concatenate([np.linspace(0.0, 0.3, 40), np.linspace(0.3, 0.0, 40)[1:]])
    way = np.sign(np.diff(angle, prepend=0.0))
    column = -(way * 1e-3 * (angle / 0.3) ** 2)[:, np.newaxis]
    (law,) = fit_laws(ExportRows(angle[:, np.newaxis], column, column), ["x"], [True])
    share = np.linspace(0.0, 1.0, 11)
    found = law.constant + law.width * share + law.cubic * share**3
    assert np.abs(found - 1e-3 * share**2).max() < 5e-5


def test_what_is_fitted_is_what_was_planted() -> None:
    """A law's own moments give its springs and its friction back; no moment gives no law."""
    angle = np.concatenate([np.linspace(0.0, 0.3, 40), np.linspace(0.3, 0.0, 40)[1:]])
    way = np.sign(np.diff(angle, prepend=0.0))
    moment = -(0.02 * angle + way * (1e-3 + 2e-3 * angle / 0.3 + 4e-3 * (angle / 0.3) ** 3))
    column = moment[:, np.newaxis]
    (law,) = fit_laws(ExportRows(angle[:, np.newaxis], column, 10.0 * column), ["x"], [True])
    assert (law.constant, law.width, law.cubic) == pytest.approx((1e-3, 2e-3, 4e-3), rel=0.05)
    assert law.left < 1e-3
    assert fit_laws(ExportRows(angle[:, np.newaxis], 0.0 * column, column), ["x"], [True]) == ()
