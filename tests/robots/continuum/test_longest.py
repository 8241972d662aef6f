"""The longest robots that the checks let through can be built; MuJoCo would not read a longer one."""

from __future__ import annotations

import mujoco
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import MAX_LINKS
from catheter_sim.modelling.build import build_mjcf


def _deeper(calls: int, reference: str, settings: list[str]) -> str:
    """Build from a place as deep in calls as a test runner or a notebook may be."""
    if calls:
        return _deeper(calls - 1, reference, settings)
    return build_mjcf(load_robot(reference, settings))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("reference", "settings", "bodies"),
    [
        ("neuroendoscope_section", ["disks_per_segment={}"], 401),
        pytest.param(
            "mitral_transseptal",
            ["segments.bending.rings={}", "segments.bending.length_mm=2000"],
            407,
            marks=pytest.mark.long,
        ),
    ],
)
def test_the_longest_robot_can_be_built(reference: str, settings: list[str], bodies: int) -> None:
    """As many links as are allowed make a file that MuJoCo loads, also from deep inside a program."""
    text = _deeper(300, reference, [item.format(MAX_LINKS) for item in settings])
    assert mujoco.MjModel.from_xml_string(text).nbody == bodies
