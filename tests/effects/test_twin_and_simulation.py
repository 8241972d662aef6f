"""Under every cause that is in the robot or loads it, twin and simulation go the same way.

They share no code that solves for equilibrium, so that a cause that means one thing to the one and another to
the other shows here, whatever a bench may make of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.core.effect import Form, Stage
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import with_effects
from catheter_sim.lab.robots import BENCH_ROBOTS, BenchRobot, bench_robot
from hidden_effects.first_draws import history, simulated, twin_outputs

pytestmark = pytest.mark.slow

TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
NO_GRAVITY = np.zeros(3)
# Robots that run apart; a smaller one of each kind stays.
LONG = ("neuroendoscope", "chest_tube", "chest_tube_section@prototype", "spacer_disk", "file_displacement")
SCALES = 3.0  # of each parameter
SHARE, FLOOR_MM = 0.1, 0.1  # of what the cause does; below it differences of the plain robots count
FORMS = [
    (effect.name, form)
    for effect in EFFECTS.values()
    for form in effect.forms
    if form.stage is Stage.SPECIFICATION or (effect.name, form.name) == ("payload", "force")
]


def values_of(form: Form, robot: RobotSpec) -> dict[str, float]:
    """Return values of a form's parameters, all different."""
    return {
        item.name: item.from_fit(
            float(np.clip(item.to_fit(item.null) + (0.8 + 0.1 * k) * SCALES * item.scale, *item.fit_bounds))
        )
        for k, item in enumerate(form.parameters(robot))
    }


def apart_and_moved(
    bench: BenchRobot, robot: RobotSpec, inputs: Inputs, plain: np.ndarray
) -> tuple[float, float]:
    """Return how far the twin is from the simulation at the tip, and that from `plain` [mm]."""
    seen = simulated(bench, robot, inputs, NO_GRAVITY).columns(TIP)
    found = twin_outputs([robot], [inputs], TIP, NO_GRAVITY)[0][0]
    return tuple(float(np.linalg.norm(seen - other, axis=1).max()) for other in (found, plain))


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.long] if name in LONG else []) for name in BENCH_ROBOTS],
)
def test_twin_and_simulation_go_the_same_way(name: str) -> None:
    """To a tenth of what the cause does, beside what they differ by without."""
    bench = bench_robot(name, np.random.default_rng(3))
    bench = replace(bench, trials=replace(bench.trials, rows=16))
    inputs = history(bench, np.random.default_rng(4), rich=True)
    plain = simulated(bench, bench.robot, inputs, NO_GRAVITY).columns(TIP)
    floor, _ = apart_and_moved(bench, bench.robot, inputs, plain)
    assert floor < 0.2
    most_moved, wrong = 0.0, {}
    for effect, form in FORMS:
        values = values_of(form, bench.robot)
        if not values:
            continue
        robot = with_effects(bench.robot, {effect: values})
        apart, moved = apart_and_moved(bench, robot, inputs, plain)
        most_moved = max(most_moved, moved)
        if apart > max(SHARE * moved, FLOOR_MM) + floor:
            wrong[f"{effect}.{form.name}"] = (apart, moved)
    assert not wrong
    assert most_moved > 20.0 * FLOOR_MM
