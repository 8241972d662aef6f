"""What MuJoCo warns of is logged, and leaves no file behind."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

PROGRAM = """
import logging, mujoco
import catheter_sim.modelling.build
logging.basicConfig()
body = "<body><joint/><geom size='1'/></body>"
model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
data = mujoco.MjData(model)
data.qvel[0] = float("nan")
mujoco.mj_step(model, data)
"""


def test_a_warning_of_mujoco_is_logged_and_no_file_is_written(tmp_path: Path) -> None:
    """Of a speed that is not finite, where a robot could be built; in a process of its own, since dm_control
    sends MuJoCo's warnings elsewhere once it is imported."""
    ran = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "QVEL" in ran.stderr
    assert not list(tmp_path.iterdir())
