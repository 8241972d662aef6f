"""On MuJoCo Warp's CPU backend every robot moves as it does on the C engine, friction included."""

from __future__ import annotations

import builtins
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.gpu.batch import WarpBatch
from catheter_sim.simulation.simulator import Simulator

LEVELS = (0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0)  # of the peak: loading and unloading
GRAVITY_MPS2 = (5.0, 0.0, -9.81)


@dataclass(frozen=True)
class Loop:
    """A robot's loading and unloading: inputs at the peak [N, m], and steps to each level and held there.

    The inputs move there in equal steps, as in `simulate` and the environments: a jump of 0.5 mm puts 6 kN
    into a catheter's cables for a step, and to round off one part in 2^24 of that moves its tip by 1e-5 m in
    the C engine too.
    """

    reference: str
    peak: tuple[float, ...]
    actuation: str = "tension"
    settings: tuple[str, ...] = ()
    gravity_mps2: tuple[float, float, float] = (0.0, 0.0, 0.0)
    steps: int = 30
    opens: bool = True  # whether it comes back on another way
    within: float = 1e-4  # of the length


LOOPS = (
    Loop("neuroendoscope_section", (0.4, 0.0), settings=("friction.mu=0.3",)),
    Loop("neuroendoscope", (0.2, 0.0, 0.0, 0.0, 0.2, 0.0), settings=("friction.mu=0.3",)),
    Loop(
        "spacer_disk",
        (3.0, 0.0, 3.0, 0.0),
        settings=("friction.mu=0.2", "disks_per_segment=4", "links_per_subsegment=1"),
    ),
    Loop(  # an elastic law of which MuJoCo's hinges hold a part alone
        "spacer_disk",
        (3.0, 0.0, 3.0, 0.0),
        settings=(
            "disks_per_segment=2",
            "links_per_subsegment=1",
            "segments.first.stiffness_quintic_mm4=2e8",  # a fifth more moment at the peak
            "segments.second.stiffness_quintic_mm4=2e8",
            "tendons.1.angle_deg=50",  # bends about both hinges
            "tendons.3.angle_deg=50",
        ),
        opens=False,
    ),
    Loop("chest_tube_section", (8.0,)),
    Loop("chest_tube_section@prototype", (15.0,), gravity_mps2=GRAVITY_MPS2),
    Loop(
        "chest_tube_section@prototype",
        (15.0,),
        settings=("friction.mu=0",),
        gravity_mps2=GRAVITY_MPS2,
        opens=False,
    ),
    Loop("chest_tube", (8.0, 0.0, 0.0, 6.0, 4.0, 0.0, 2.0, 0.0), gravity_mps2=GRAVITY_MPS2),
    Loop("mitral_transseptal", (5e-3, 2e-3, 2e-3, 20e-3), "displacement", opens=False),
    Loop("mitral_transseptal@tube", (5e-3, 2e-3, 2e-3, 20e-3), "displacement"),
    Loop("mitral_4dof", (2e-3, 2e-3, 2e-3, 20e-3), "displacement", opens=False),
    Loop("mitral_4dof", (2e-3, 2e-3, 2e-3, 20e-3), "displacement", ("friction.mu=0.06",), opens=False),
    Loop("mitral_4dof@elongation", (3e-3, 4e-3, 2e-3, 20e-3), "displacement", within=1e-3),
    Loop("neuroendoscope_section", (2e-3, -2e-3), "displacement", ("friction.mu=0.3",), opens=False),
)


def test_without_the_extra_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, with the extra's name."""
    find = builtins.__import__

    def without(name: str, *arguments: Any, **named: Any) -> Any:
        if name == "mujoco_warp":
            raise ImportError("No module named 'mujoco_warp'")
        return find(name, *arguments, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"pip install mujoco-warp warp-lang"):
        WarpBatch(load_robot("neuroendoscope_section"), 1)


def test_bad_arguments_are_one_line() -> None:
    """Said before Warp is asked for, so that it needs none."""
    robot = load_robot("chest_tube_section")
    with pytest.raises(InputError, match="copies = 0: at least 1 is needed"):
        WarpBatch(robot, 0)
    with pytest.raises(InputError, match=r"actuation.*displacement.*choices: tension"):
        WarpBatch(robot, 1, actuation="displacement")


def test_a_device_that_does_not_exist_is_refused() -> None:
    """The message names it and those that do."""
    pytest.importorskip("mujoco_warp", reason="needs the extra gpu")
    with pytest.raises(InputError, match=r"device 'no_such_device'.*choices: .*cpu"):
        WarpBatch(load_robot("neuroendoscope_section"), 1, "no_such_device")


def name_of(loop: Loop) -> str:
    return f"{loop.reference} by {loop.actuation}"


@pytest.mark.slow
@pytest.mark.parametrize("loop", LOOPS, ids=name_of)
def test_a_loading_and_unloading_loop_agrees_with_the_c_engine(loop: Loop) -> None:
    """Tips are one; the second copy is pulled half as far and goes its own way."""
    pytest.importorskip("mujoco_warp", reason="needs the extra gpu")
    robot = load_robot(loop.reference, loop.settings)
    batch = WarpBatch(robot, 2, "cpu", loop.gravity_mps2, loop.actuation)
    alone = [Simulator(robot, loop.actuation, loop.gravity_mps2) for _ in range(2)]
    site = int(alone[0].model.site("tip").id)
    length = float(np.linalg.norm(alone[0].data.site_xpos[site]))
    tips: list[np.ndarray] = []
    before = 0.0
    for level in LEVELS:
        way = np.linspace(before, level, loop.steps + 1)[1:]
        for share in [*way, *[level] * loop.steps]:
            inputs = share * np.array(loop.peak) * np.array([[1.0], [0.5]])
            batch.set_inputs(inputs)
            batch.step(1)
            for simulator, row in zip(alone, inputs, strict=True):
                simulator.set_inputs(row)
                simulator.step()
        before = level
        there = np.array([simulator.data.site_xpos[site] for simulator in alone])
        tips.append(batch.tips())
        assert np.linalg.norm(tips[-1] - there, axis=1).max() < loop.within * length
    assert np.linalg.norm(tips[3][0] - tips[3][1]) > 0.05 * length
    if loop.opens:  # at a quarter of the peak, on the way out and back
        apart = np.linalg.norm(tips[0] - tips[6], axis=1)
        assert apart[0] > 1e-3 * length
    batch.reset()
    batch.step(1)
    alone[0].reset()
    alone[0].step(1)
    there = np.array([alone[0].data.site_xpos[site]] * 2)
    assert batch.tips() == pytest.approx(there, abs=1e-6 * length)  # single precision


def test_bad_inputs_are_refused() -> None:
    """The message names both shapes, or the channel and its range."""
    pytest.importorskip("mujoco_warp", reason="needs the extra gpu")
    batch = WarpBatch(load_robot("mitral_4dof"), 2, "cpu")
    with pytest.raises(InputError, match=r"shape \(4,\): \(2, 4\) is needed"):
        batch.set_inputs(np.zeros(4))
    with pytest.raises(InputError, match=r"displacement_bending_distal_mm: beyond its joint's range"):
        batch.set_inputs(np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]))


@pytest.mark.slow
def test_a_copy_that_diverges_is_named() -> None:
    """A pull of 1e9 N on the second copy is no answer for either; one beyond what MuJoCo takes is refused."""
    pytest.importorskip("mujoco_warp", reason="needs the extra gpu")
    batch = WarpBatch(load_robot("neuroendoscope_section", ["friction.mu=0"]), 2, "cpu")
    with pytest.raises(InputError, match=r"neuroendoscope_section: an input is not finite, or beyond 1e\+10"):
        batch.set_inputs(np.array([[0.0, 0.0], [1e13, 0.0]]))
    batch.set_inputs(np.array([[0.1, 0.0], [1e9, 0.0]]))
    batch.step(50)
    for look in (batch.qpos, batch.tips, batch.require_finite):
        with pytest.raises(SimulationDiverged, match=r"within 0\.250 simulated seconds, in 1 of 2 copies"):
            look()
    batch.reset()
    batch.step(1)
    assert batch.tips() == pytest.approx(np.array([[0.0, 0.0, 0.06]] * 2), abs=1e-6)
