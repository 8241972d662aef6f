"""On MuJoCo Warp's CPU backend a robot moves as it does on the C engine, friction included."""

from __future__ import annotations

import builtins
from typing import Any

import numpy as np
import pytest

from catheter_sim.errors import InputError
from catheter_sim.gpu.batch import WarpBatch
from catheter_sim.robots.catalogue import load_robot
from catheter_sim.simulation.simulator import Simulator

LEVELS = (0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0)  # of the peak: loading and unloading
# One robot in the plane, its two sections, and one that bends in space (with friction added); the tensions
# that are raised, and their peak [N].
LOOPS = (
    ("neuroendoscope_section", ["friction.mu=0.3"], (0,), 0.4),
    ("neuroendoscope", ["friction.mu=0.3"], (0, 4), 0.2),
    ("spacer_disk", ["friction.mu=0.2", "disks_per_segment=4", "links_per_subsegment=1"], (0, 2), 3.0),
)


def test_without_the_extra_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, with the extra's name."""
    find = builtins.__import__

    def without(name: str, *arguments: Any, **named: Any) -> Any:
        if name == "mujoco_warp":
            raise ImportError("No module named 'mujoco_warp'")
        return find(name, *arguments, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"pip install 'catheter-sim\[gpu\]'"):
        WarpBatch(load_robot("neuroendoscope_section"), 1)


@pytest.mark.parametrize(
    ("reference", "settings", "copies", "message"),
    [
        ("chest_tube", [], 1, "simulation on MuJoCo Warp does not know robots of kind 'rolling'"),
        ("mitral_4dof", [], 1, "simulation on MuJoCo Warp does not know robots of kind 'catheter'"),
        ("neuroendoscope", ["actuation=displacement"], 1, "choices: tension"),
        ("neuroendoscope", [], 0, "copies = 0: at least 1 is needed"),
    ],
)
def test_what_it_does_not_know_is_one_line(
    reference: str, settings: list[str], copies: int, message: str
) -> None:
    """Said before Warp is asked for, so that it needs none."""
    with pytest.raises(InputError, match=message):
        WarpBatch(load_robot(reference, settings), copies)


def test_a_law_that_warp_does_not_know_is_refused() -> None:
    """A fifth power of the curvature is applied as a force by the simulator alone."""
    pytest.importorskip("mujoco_warp", reason="needs the extra gpu")
    robot = load_robot("neuroendoscope_section", ["segments.section.stiffness_quintic_mm4=1e6"])
    with pytest.raises(InputError, match="stiffness_quintic_mm4"):
        WarpBatch(robot, 1)
    with pytest.raises(InputError, match="device 'no_such_device'"):
        WarpBatch(load_robot("neuroendoscope_section"), 1, "no_such_device")


@pytest.mark.slow
@pytest.mark.parametrize(("reference", "settings", "pulled", "peak_N"), LOOPS)
def test_a_loading_and_unloading_loop_agrees_with_the_c_engine(
    reference: str, settings: list[str], pulled: tuple[int, ...], peak_N: float
) -> None:
    """Tips within 1e-4 of the length; the second copy, pulled half as far, has a loop of its own."""
    pytest.importorskip("mujoco_warp", reason="needs the extra gpu")
    robot = load_robot(reference, settings)
    batch = WarpBatch(robot, 2, "cpu")
    alone = [Simulator(robot), Simulator(robot)]
    site = int(alone[0].model.site("tip").id)
    length = float(alone[0].data.site_xpos[site, 2])
    tension = np.zeros((2, len(robot.tendons)))
    tips: list[np.ndarray] = []
    for level in LEVELS:
        tension[:, pulled] = level * peak_N * np.array([[1.0], [0.5]])
        batch.set_inputs(tension)
        batch.step(40)
        for simulator, row in zip(alone, tension, strict=True):
            simulator.set_inputs(row)
            simulator.step(40)
        there = np.array([simulator.data.site_xpos[site] for simulator in alone])
        tips.append(batch.tips())
        assert np.linalg.norm(tips[-1] - there, axis=1).max() < 1e-4 * length
        assert batch.qpos() == pytest.approx(np.array([simulator.data.qpos for simulator in alone]), abs=1e-5)
    apart = np.linalg.norm(tips[0] - tips[6], axis=1)  # at a quarter of the peak, on the way out and back
    assert apart[0] > 5e-3 * length  # friction's loop is open
    assert apart[1] > 1e-3 * length
    assert np.linalg.norm(tips[3][0] - tips[3][1]) > 0.05 * length
    batch.reset()
    batch.step(1)
    assert batch.tips() == pytest.approx(np.array([[0.0, 0.0, length]] * 2), abs=1e-7)


def test_inputs_of_another_shape_are_refused() -> None:
    """The message names both shapes."""
    pytest.importorskip("mujoco_warp", reason="needs the extra gpu")
    batch = WarpBatch(load_robot("neuroendoscope_section"), 2, "cpu")
    with pytest.raises(InputError, match=r"shape \(2,\): \(2, 2\) is needed"):
        batch.set_inputs(np.zeros(2))
