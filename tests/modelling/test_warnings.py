"""What MuJoCo warns of is logged, and leaves no file behind."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

import catheter_sim.modelling.build  # noqa: F401


def test_a_warning_of_mujoco_is_logged_and_no_file_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Of a speed that is not finite, where a robot has been built before."""
    monkeypatch.chdir(tmp_path)
    body = "<body><joint/><geom size='1'/></body>"
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    data.qvel[0] = float("nan")
    mujoco.mj_step(model, data)
    assert "QVEL" in caplog.text
    assert not list(tmp_path.iterdir())
