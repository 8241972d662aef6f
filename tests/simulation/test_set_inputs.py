"""`Simulator.set_inputs` takes what a robot can follow, and says in one line what is wrong with the rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from catheter_sim.core.inputs import LinkForce
from catheter_sim.errors import InputError
from catheter_sim.simulation.simulator import Simulator

NAN, INF = float("nan"), float("inf")
COUNT = r"2 numbers are needed, one for each of its tendons \(right, left\)"
FINITE = r"finite numbers within 1e\+10 are needed"


@pytest.fixture(scope="module")
def section() -> Simulator:
    return Simulator("neuroendoscope_section")


@pytest.mark.parametrize(
    ("tendon", "said"),
    [
        ([NAN, 0.0], FINITE),
        ([0.0, -INF], FINITE),
        (np.array([1e30, 0.0]), FINITE),
        ([1.1e10, 0.0], FINITE),
        ([-1.0, 0.0], " right: -1 N: a tendon cannot push"),
        ([0.0, -1e-6], " left: -1e-06 N: a tendon cannot push"),
        ([1.0, 2.0, 3.0], COUNT),
        ([0.4], COUNT),
        (0.4, COUNT),
        ([[0.4, 0.0]], COUNT),
        ([], COUNT),
        ("ab", COUNT),
        (["0.4", "0"], COUNT),
        (None, COUNT),
        ([True, False], COUNT),
        ([[1.0], [1.0, 2.0]], COUNT),
        ([1j, 0.0], COUNT),
        ({"right": 0.4}, COUNT),
    ],
)
def test_what_no_tendon_can_follow_is_refused(section: Simulator, tendon: Any, said: str) -> None:
    """The line names the robot; the inputs stay as they were."""
    section.set_inputs([0.1, 0.0])
    with pytest.raises(InputError, match=f"neuroendoscope_section: set_inputs: tendon.*{said}") as caught:
        section.set_inputs(tendon)
    assert "\n" not in str(caught.value)
    assert section.actuator_tension() == pytest.approx([0.1, 0.0])


@pytest.mark.parametrize(
    "tendon",
    [[0.4, 0], (1, 0), np.array([0.4, 0.0], np.float32), np.array([1, 0]), [0.4, -1e-12], [9e9, 0.0]],
)
def test_numbers_of_any_type_are_taken(section: Simulator, tendon: Any) -> None:
    """Whole ones, single precision, a rounding below zero, the largest that MuJoCo takes."""
    section.set_inputs(tendon)
    assert section.actuator_tension() == pytest.approx(np.maximum(np.asarray(tendon, float), 0.0))


@pytest.mark.parametrize(
    ("loads", "said"),
    [
        ({"force_tip": (NAN, 0.0, 0.0)}, "force_tip = .*finite numbers"),
        ({"force_tip": 1.0}, "force_tip = 1.0: three numbers are needed"),
        ({"moment_tip": (0.0, 0.0)}, "moment_tip = .*three numbers are needed"),
        ({"moment_tip": "xyz"}, "moment_tip = 'xyz': three numbers are needed"),
        ({"others": [(1, 2)]}, "others: .*a LinkForce is needed"),
        ({"others": [LinkForce(2, None, (INF, 0.0, 0.0))]}, "force on element 2 = .*finite numbers"),
        (
            {"others": [LinkForce(99, None, (0.0, 0.0, 0.0))]},
            "force on link 99: the robot's links are 1",
        ),
    ],
)
def test_loads_are_looked_at_too(section: Simulator, loads: dict[str, Any], said: str) -> None:
    """Forces and moments on the tip and on elements."""
    with pytest.raises(InputError, match=said):
        section.set_inputs([0.0, 0.0], **loads)


def test_displacements_may_have_either_sign() -> None:
    """Those of a catheter's pairs; one beyond its joint's range is refused as before."""
    robot = Simulator("mitral_transseptal")
    robot.set_inputs([-1e-3, 1e-3, -1e-3, 60e-3])
    with pytest.raises(InputError, match="bending"):
        robot.set_inputs([20e-3, 0.0, 0.0, 0.0])


def test_what_is_no_robot_and_no_way_to_drive_one_is_one_line() -> None:
    """Neither a robot, nor an id; an actuation, gravity."""
    with pytest.raises(InputError, match=r"robot = 5: a robot, its id or the path of its .toml is needed"):
        Simulator(5)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="unknown robot 'scorpion'; choices: neuroendoscope"):
        Simulator("scorpion")
    with pytest.raises(InputError, match="unknown actuation 'push'; choices: tension, displacement"):
        Simulator("neuroendoscope_section", "push")
    with pytest.raises(InputError, match=r"gravity_mps2 = .*three numbers are needed"):
        Simulator("neuroendoscope_section", gravity_mps2=(0.0, 9.81))
