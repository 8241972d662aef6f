"""Several robots in one scene: whichever is asked to move, all move as each does alone."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Callable, Sequence

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.modelling.attach import attach
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.simulation.together import settle_together, step_together

SECTION = "neuroendoscope_section"
PULLS = {SECTION: (0.4, 0.0), "chest_tube_section": (6.0,), "mitral_4dof": (2e-3, 1e-3, 1e-3, 10e-3)}
# Where one moves without its friction its tip is 5 to 9 mm off.
NEAR_M = 2e-5


def scene(*references: str, datas: int = 1) -> list[Simulator]:
    """Return simulators of robots beside one another, their states dealt out in turn."""
    spec = mujoco.MjSpec()
    spec.option.gravity = [0.0, 0.0, 0.0]
    step_s = min(load_robot(reference).dynamics.timestep_s for reference in references)
    for index, reference in enumerate(references):
        attach(spec, reference, spec.worldbody.add_frame(pos=[0.1 * index, 0.0, 0.0]), f"{index}_")
        spec.option.timestep = step_s
    model = spec.compile()
    states = [mujoco.MjData(model) for _ in range(datas)]
    return [
        Simulator(reference, model=model, data=states[index % datas], prefix=f"{index}_")
        for index, reference in enumerate(references)
    ]


def alone(reference: str, step_s: float) -> np.ndarray:
    """Return where the pulled robot's faces come to rest in a model of its own, shape (n, 3) [m]."""
    own = Simulator(reference)
    own.model.opt.timestep = step_s
    own.set_inputs(PULLS[reference])
    assert own.settle()
    return own.posture().p_w


def pulled(simulators: Sequence[Simulator]) -> None:
    for simulator in simulators:
        simulator.set_inputs(PULLS[simulator.robot.name])


WAYS: dict[str, Callable[[list[Simulator]], bool]] = {
    "settle together": settle_together,
    "settle one": lambda robots: robots[-1].settle(),
    "settle each": lambda robots: all(robot.settle() for robot in robots),
    "step one": lambda robots: robots[0].step(3000) is None,
    "step together": lambda robots: step_together(robots, 3000) is None,
    "step some": lambda robots: step_together(robots[:1], 3000) is None,
}


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_all_come_to_rest_where_each_does_alone(way: str) -> None:
    """Two sections, pulled apart: with the friction of both, whichever is settled or stepped."""
    one, other = scene(SECTION, SECTION)
    one.set_inputs([0.4, 0.0])
    other.set_inputs([0.0, 0.4])
    assert WAYS[way]([one, other])
    tip = alone(SECTION, one.model.opt.timestep)[-1]
    assert one.posture().p_w[-1] == pytest.approx(tip, abs=NEAR_M)
    assert other.posture().p_w[-1] == pytest.approx(tip * (-1.0, 1.0, 1.0), abs=NEAR_M)


@pytest.mark.slow
def test_three_robots_of_three_kinds() -> None:
    """One is settled; each is where it is alone."""
    robots = scene(*PULLS)
    pulled(robots)
    assert robots[1].settle()
    for robot in robots:
        expected = alone(robot.robot.name, robot.model.opt.timestep)
        assert robot.posture().p_w == pytest.approx(expected, abs=NEAR_M)


@pytest.mark.slow
def test_who_is_pulled_stays_while_another_settles() -> None:
    """The first is bent and at rest; settling the second, at zero, does not move it."""
    one, other = scene(SECTION, SECTION)
    one.set_inputs([0.4, 0.0])
    assert one.settle()
    before = one.posture().p_w
    assert other.settle()
    assert one.posture().p_w == pytest.approx(before, abs=1e-6)


def test_a_step_counts_once() -> None:
    """Time goes on by one step for each that is asked for, however many robots there are, or are named."""
    one, other = scene(SECTION, SECTION)
    one.step(3)
    step_together([other, one, other], 2)
    assert one.data.time == pytest.approx(5 * one.model.opt.timestep)


def test_other_states_are_left_alone() -> None:
    """Two simulators of one model, each with its own data: one moves, the other's time stands still."""
    one, other = scene(SECTION, SECTION, datas=2)
    one.set_inputs([0.4, 0.0])
    one.step(2)
    assert (one.data.time > 0.0, other.data.time) == (True, 0.0)
    with pytest.raises(InputError, match="not in one model with one state"):
        settle_together([one, other])


def test_a_simulator_that_nobody_keeps_is_gone_at_once() -> None:
    """Without the help of the collector; the others go on, and a new one takes its place."""
    one, other = scene(SECTION, SECTION)
    model, data, gone = other.model, other.data, weakref.ref(other)
    gc.disable()
    try:
        del other
        assert gone() is None
    finally:
        gc.enable()
    one.step()
    again = Simulator(SECTION, model=model, data=data, prefix="1_")
    again.set_inputs([0.4, 0.0])
    one.step(5)
    assert np.abs(again.posture().p_w[-1, 0]) > 1e-4


def test_of_two_with_one_prefix_the_newer_one_counts() -> None:
    """Laws never act twice: the older one refuses, alone and with others."""
    older, other = scene(SECTION, SECTION)
    newer = Simulator(SECTION, model=older.model, data=older.data, prefix="0_")
    for move in (older.step, older.settle, lambda: step_together([other, older])):
        with pytest.raises(InputError, match="a newer Simulator has the prefix '0_' in the same data"):
            move()
    newer.step()
    other.step()
    assert newer.data.time == pytest.approx(2 * newer.model.opt.timestep)


def test_what_is_no_simulator_or_no_state_of_the_model_is_one_line() -> None:
    """None at all, texts, a state of another model."""
    (one,) = scene(SECTION)
    for wrong in ([], "ab", [1, 2], None):
        with pytest.raises(InputError, match=r"step_together: simulators = .*a list of Simulators is needed"):
            step_together(wrong)  # type: ignore[arg-type]
    foreign = mujoco.MjData(mujoco.MjModel.from_xml_string("<mujoco/>"))
    with pytest.raises(InputError, match=r"data: is of another model: use mujoco.MjData\(model\)"):
        Simulator(SECTION, model=one.model, data=foreign, prefix="0_")
    with pytest.raises(InputError, match=r"model = 'x': a compiled mujoco.MjModel is needed"):
        Simulator(SECTION, model="x", prefix="0_")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"data = 5: a mujoco.MjData is needed"):
        Simulator(SECTION, model=one.model, data=5, prefix="0_")  # type: ignore[arg-type]


def test_one_alone_may_be_settled_too() -> None:
    """A list of one simulator in a model of its own is that simulator."""
    robot = Simulator(SECTION)
    robot.set_inputs([0.1, 0.0])
    step_together([robot], 2)
    assert robot.data.time == pytest.approx(2 * robot.model.opt.timestep)
    assert not settle_together([robot], longest_s=0.01)
