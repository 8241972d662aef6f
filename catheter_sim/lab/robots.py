"""The robots of the hidden-effect bench: how each is driven, what is measured, who makes its data.

The data come from the MuJoCo simulation, of the spacer-disk robot from a Cosserat rod where that knows what
is hidden; the diagnosis fits an analytic twin (`robots/<kind>/twin.py`). They share no code that solves for
equilibrium. Where the twin bends in arcs, the simulated chain has other links than the robot's own
simulation, too, with which a diagnosis confirms what it found. What is done with a robot, its kind says
(`core.published.Trials`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from catheter_sim.catalogue import PUBLISHED, load_robot
from catheter_sim.channels import body_count
from catheter_sim.core.published import Drawn, Trials
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import unknown
from catheter_sim.robots import KINDS

FILE_REFERENCE = "robot.toml"  # of a robot that has no id: its file lies in the data set's folder
# In the order in which a seed deals them; what is not named here comes after.
_FIRST = (
    "neuroendoscope_section",
    "neuroendoscope",
    "chest_tube_section",
    "chest_tube_section@prototype",
    "chest_tube",
    "mitral_transseptal",
    "mitral_4dof",
    "spacer_disk",
)


@dataclass(frozen=True)
class BenchRobot:
    """A robot as the bench uses it.

    A data set names it by `reference`; `trials` say how it is driven, what is measured and who makes its
    data.
    """

    reference: str
    robot: RobotSpec
    trials: Trials

    @property
    def bodies(self) -> tuple[int, ...]:
        """Elements at a third, half and two thirds of the robot."""
        return tuple(max(1, round(body_count(self.robot) * share)) for share in (1 / 3, 1 / 2, 2 / 3))


def bench_robot(name: str, generator: np.random.Generator) -> BenchRobot:
    """Return a robot of the bench; one that stands in a file has drawn dimensions.

    Raises:
        InputError: no such robot.
    """
    if name not in BENCH_ROBOTS:
        raise unknown("robot of the bench", name, BENCH_ROBOTS)
    return BENCH_ROBOTS[name](generator)


def _by_id(reference: str, trials: Trials) -> Callable[[np.random.Generator], BenchRobot]:
    def make(generator: np.random.Generator) -> BenchRobot:
        return BenchRobot(reference, load_robot(reference), trials)

    return make


def _from_file(draw: Drawn) -> Callable[[np.random.Generator], BenchRobot]:
    def make(generator: np.random.Generator) -> BenchRobot:
        return BenchRobot(FILE_REFERENCE, *draw(generator))

    return make


def _all() -> Mapping[str, Callable[[np.random.Generator], BenchRobot]]:
    trials = {name: item.trials for name, item in PUBLISHED.items() if item.trials is not None}
    found = {name: _by_id(name, trials[name]) for name in dict.fromkeys((*_FIRST, *trials))}
    drawn = {name: _from_file(draw) for kind in KINDS.values() for name, draw in kind.robots.DRAWN.items()}
    return found | drawn


BENCH_ROBOTS = _all()
