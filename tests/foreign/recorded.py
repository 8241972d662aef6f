"""Recordings of the two links in MuJoCo alone, with something changed in them by hand."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

FILE = Path(__file__).parent / "two_link.xml"
OUTPUTS = ("joint_first_deg", "joint_second_deg", "site_end_x_mm", "site_end_z_mm")
_ROW_S, _ROWS = 0.02, 151


def write_dataset(
    folder: Path,
    change: Callable[[mujoco.MjSpec], None] = lambda spec: None,
    command: Callable[[np.ndarray], np.ndarray] = lambda controls: controls,
    seed: int = 0,
) -> Path:
    """Write two trials, the second held out, of links that are changed; return the folder.

    Args:
        folder: that gets them.
        change: of the model.
        command: what arrives, of what is written as commanded, (n, 2) at every step of a millisecond.
        seed: of commands and noise.
    """
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(FILE, folder / "two_link.xml")
    spec = mujoco.MjSpec.from_file(str(FILE))
    change(spec)
    spec.option.timestep = 0.001
    model = spec.compile()
    generator = np.random.default_rng(seed)
    for number in (1, 2):
        time_s = _ROW_S * np.arange(_ROWS)
        rates = generator.uniform(0.4, 1.3, (2, 2))
        phases = generator.uniform(0.0, 6.0, (2, 2))
        waves = np.sin(2.0 * np.pi * rates[:, :, None] * time_s + phases[:, :, None])
        controls = np.round(0.5 * waves.sum(axis=0).T * np.minimum(time_s / 0.3, 1.0)[:, None], 4)
        readings = _played(model, time_s, controls, command)
        readings += generator.normal(size=readings.shape) * (0.05, 0.05, 0.2, 0.2)
        table = np.column_stack([time_s, controls, readings])
        header = ",".join(("time_s", "control_one", "control_two", *OUTPUTS))
        np.savetxt(folder / f"trial_{number}.csv", table, "%.5f", ",", header=header, comments="")
    (folder / "dataset.toml").write_text(text_of())
    return folder


def text_of(
    robot: str = "two_link.xml", motion: str = "dynamic", inputs: str = '"control_one", "control_two"'
) -> str:
    """Return a `dataset.toml`."""
    outputs = ", ".join(f'"{name}"' for name in OUTPUTS)
    return (
        f'[dataset]\nname = "two links"\nrobot = "{robot}"\nsource = "simulated"\nlicence = "MIT"\n'
        f'[conditions]\ngravity_mps2 = [0.0, 0.0, -9.81]\nmotion = "{motion}"\n'
        f"[channels]\ninputs = [{inputs}]\noutputs = [{outputs}]\n"
        '[[trials]]\nfile = "trial_1.csv"\n[[trials]]\nfile = "trial_2.csv"\nrole = "heldout"\n'
    )


def _played(
    model: mujoco.MjModel,
    time_s: np.ndarray,
    controls: np.ndarray,
    command: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    data, found = mujoco.MjData(model), []
    steps = round(time_s[-1] / 0.001) + 1
    fine = 0.001 * np.arange(steps)
    arriving = command(np.stack([np.interp(fine, time_s, controls[:, k]) for k in range(2)], axis=1))
    for step in range(steps):
        data.ctrl[:] = arriving[step]
        if step % round(_ROW_S / 0.001) == 0:
            mujoco.mj_kinematics(model, data)
            place = 1e3 * data.site("end").xpos
            found.append([*np.degrees(data.qpos[:2]), place[0], place[2]])
        mujoco.mj_step(model, data)
    return np.array(found)
