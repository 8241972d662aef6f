"""Claims about rows that go on from where a robot stands: nothing is forgotten, nothing is solved twice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from rolling_cases import NO_GRAVITY, pulls

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs, slice_inputs
from catheter_sim.robots.rolling import twin as rolling_twin
from catheter_sim.robots.rolling.complete import solve_history
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.robots.rolling.twin import RollingTwin

WAY = (5.0, 25.0, 12.0, 12.0, 30.0)
GIVES = (1e-7, 1e-6)
HANGING = np.array([0.0, 0.0, 9.81])


def along(*ends: float) -> list[Inputs]:
    """Return histories that begin with `WAY` and end in each of some tensions."""
    return [pulls([*WAY, end]) for end in ends]


def solved(twin: RollingTwin, histories: Sequence[Inputs]) -> np.ndarray:
    """Return the joint angles along histories of the chest tube's section, from rest under its weight."""
    robot = load_robot("chest_tube_section")
    assert isinstance(robot, RollingRobot)
    return twin.solve([robot] * len(histories), histories, HANGING, [], 1).joint_angles()


@pytest.mark.parametrize("gives", [(), GIVES], ids=["tensions kept", "by sliding"])
@pytest.mark.parametrize("gravity", [NO_GRAVITY, HANGING], ids=["weightless", "hanging"])
def test_rows_go_on_from_where_the_robot_stands(gives: tuple[float, ...], gravity: np.ndarray) -> None:
    """A history in two parts is the history in one, number by number; another memory is another history."""
    chain, inputs = rolling_chain(load_robot("chest_tube_section")), pulls(WAY)
    whole = solve_history(chain, inputs, gravity, pre_sliding_m=gives)
    begun = solve_history(chain, slice_inputs(inputs, slice(3)), gravity, pre_sliding_m=gives)
    rest = slice_inputs(inputs, slice(3, None))
    after = solve_history(chain, rest, gravity, pre_sliding_m=gives, after=begun.end)
    np.testing.assert_array_equal(np.concatenate([begun.theta, after.theta]), whole.theta)
    np.testing.assert_array_equal(after.at_joint, whole.at_joint[3:])
    assert whole.end is not None
    assert after.end is not None
    np.testing.assert_array_equal(after.end.memory, whole.end.memory)
    from_rest = solve_history(chain, rest, gravity, pre_sliding_m=gives)
    assert np.abs(from_rest.theta[0] - whole.theta[3]).max() > 1e-3


def test_histories_that_begin_alike_are_each_as_alone() -> None:
    """What rows share does not mix the rows that follow."""
    histories = along(10.0, 40.0, 0.0)
    together = solved(RollingTwin(), histories)
    alone = [solved(RollingTwin(), [item])[0] for item in histories]
    np.testing.assert_allclose(together, alone, atol=1e-9)
    assert np.ptp(together[:, -1], axis=0).max() > 0.1


def test_what_histories_share_is_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also of histories that are asked for one after another."""
    rows: list[int] = []

    def counted(chain: object, inputs: Inputs, *args: object, **settings: object) -> object:
        rows.append(len(inputs))
        return solve_history(chain, inputs, *args, **settings)  # type: ignore[arg-type]

    monkeypatch.setattr(rolling_twin, "solve_history", counted)
    twin = RollingTwin()
    solved(twin, along(10.0, 40.0))
    solved(twin, along(20.0))
    assert rows == [len(WAY), 1, 1, 1]
    solved(twin, [pulls([*WAY[:-1], 1.0, 20.0])])  # another way
    assert rows[4:] == [len(WAY), 1]


def test_robots_that_differ_share_nothing() -> None:
    """Each goes its own whole way."""
    histories = along(10.0, 40.0)
    one, other = load_robot("chest_tube_section"), load_robot("chest_tube_section@printed_shapes")
    assert isinstance(one, RollingRobot)
    assert isinstance(other, RollingRobot)
    found = RollingTwin().solve([one, other], histories, HANGING, [], 1).joint_angles()
    alone = RollingTwin().solve([other], histories[1:], HANGING, [], 1).joint_angles()
    np.testing.assert_allclose(found[1], alone[0], atol=1e-9)
    twin = RollingTwin()
    twin.solve([one], histories[:1], HANGING, [], 1)
    after_another = twin.solve([other], histories[1:], HANGING, [], 1).joint_angles()
    np.testing.assert_array_equal(after_another, alone)
