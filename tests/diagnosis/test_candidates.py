"""Which effects a diagnosis tries, and how it speaks of those of time and coupling."""

from __future__ import annotations

import numpy as np
from planted import as_inputs, small_robot

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.search import candidates_for
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.diagnosis.words import name_and_unit
from catheter_sim.effects import EFFECTS
from catheter_sim.tables import Table
from catheter_sim.theory.twins import twin_for


def problem(robot: RobotSpec, trials: int) -> Problem:
    """Return a problem with trials at rest."""
    inputs = as_inputs(np.zeros((3, len(robot.tendons))), robot.actuation)
    outputs = Table(inputs.time_s, {"tip_x_mm": np.zeros(3)})
    twin = twin_for(robot, robot.actuation, ["tip_x_mm"], np.zeros(3))
    made = tuple(Trial(f"{index}.csv", "train", inputs, outputs) for index in range(trials))
    return Problem(robot, (), made, ("tip_x_mm",), np.ones(1), twin)


def test_drift_is_tried_where_several_trials_begin_anew() -> None:
    """A zero that wanders from each trial's start is not looked for in a single trial; a lag is."""
    assert {"drift", "rate"} <= set(candidates_for(problem(small_robot(), 2)))
    alone = candidates_for(problem(small_robot(), 1))
    assert "drift" not in alone
    assert "rate" in alone


def test_coupling_is_tried_where_there_is_something_to_couple() -> None:
    """Several sections or joints, not one section."""
    assert "coupling" not in candidates_for(problem(small_robot(), 2))
    for name in ("neuroendoscope", "mitral_4dof"):
        assert "coupling" in candidates_for(problem(load_robot(name), 2))


def test_rates_have_their_units() -> None:
    """A number's name ends in its unit, also a minute's."""
    assert name_and_unit("zero_bending_mm_per_min") == ("zero bending", "mm/min")
    assert name_and_unit("zero_N_per_min") == ("zero", "N/min")
    assert name_and_unit("lag_s") == ("lag", "s")
    assert name_and_unit("distal_to_proximal") == ("distal to proximal", "")


def test_a_load_on_a_catheter_can_be_set_and_is_not_tried() -> None:
    """Its statics carry it, and a search with it would take too long."""
    robot = load_robot("mitral_transseptal")
    assert EFFECTS["payload"].parameters(robot)
    assert EFFECTS["payload"].variants(robot, moving=True) == ()
    assert "payload" not in candidates_for(problem(robot, 2))
    assert EFFECTS["payload"].variants(load_robot("spacer_disk"))
