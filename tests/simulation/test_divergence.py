"""What MuJoCo cannot simulate ends as a failure with its row and time, never as a robot at rest."""

from __future__ import annotations

import re

import mujoco
import numpy as np
import pytest
from drive import rows_to_inputs

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.diagnosis.verdict import replay
from catheter_sim.errors import SimulationDiverged
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.simulation.copies import Copies
from catheter_sim.simulation.motion import LARGEST_INPUT
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.tables import Table

NO_GRAVITY = np.zeros(3)
TOO_MUCH_N = 1e13


def test_mujoco_puts_zeros_in_the_place_of_a_huge_input_and_goes_on() -> None:
    """What is guarded against: without a look at the warnings the robot is straight and at rest."""
    model = mujoco.MjModel.from_xml_string(build_mjcf(load_robot("neuroendoscope_section")))
    model.actuator_ctrllimited[:] = 0
    data = mujoco.MjData(model)
    data.ctrl[0] = TOO_MUCH_N
    mujoco.mj_step(model, data, 10)
    assert not data.qpos.any()
    assert data.warning.number[int(mujoco.mjtWarning.mjWARN_BADCTRL)] == 10
    data.ctrl[0] = 0.9 * LARGEST_INPUT
    before = data.warning.number.copy()
    mujoco.mj_step1(model, data)
    mujoco.mj_fwdActuation(model, data)
    assert np.array_equal(data.warning.number, before)


@pytest.mark.slow
@pytest.mark.parametrize("dynamic", [False, True], ids=["held", "dynamic"])
@pytest.mark.parametrize("friction", ["capstan", "nested", "none"])
@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid value")
def test_a_tension_that_mujoco_ignores_ends_the_simulation(friction: str, dynamic: bool) -> None:
    """A pull of 1e13 N leaves no straight robot: row, time and MuJoCo's reason; the row before it is kept.

    In motion smaller pulls come before it, which MuJoCo takes and the reference friction does not stand.
    """
    inputs = rows_to_inputs([(0.05, 0.0), (TOO_MUCH_N, 0.0), (0.0, 0.0)])
    robot = load_robot("neuroendoscope_section", ["dynamics.timestep_s=0.01"])
    run = simulate(robot, inputs, NO_GRAVITY, dynamic, friction, ramp_s=0.05)
    assert len(run.postures) == 1
    assert run.failure is not None
    why = r"MuJoCo: (an input is not finite, or beyond 1e\+10|a position is not finite, or huge)"
    assert re.search(why, run.failure)
    assert "at row 2 (time_s = 1)" in run.failure


@pytest.mark.slow
@pytest.mark.parametrize("dynamic", [False, True], ids=["held", "dynamic"])
def test_a_tube_that_flies_off_ends_the_simulation(dynamic: bool) -> None:
    """A push of 1e13 N on a catheter's tip moves its tube a thousand kilometres: no posture of a robot."""
    inputs = rows_to_inputs([(0.0,) * 4] * 2, "displacement", [(0, 0, 0), (0, 0, TOO_MUCH_N)])
    run = simulate(load_robot("mitral_transseptal"), inputs, NO_GRAVITY, dynamic, ramp_s=0.05)
    assert run.failure is not None
    assert "diverged" in run.failure
    assert "row 2" in run.failure


def test_a_law_without_a_solution_is_a_divergence() -> None:
    """The stretch of a catheter's tendons is solved outside MuJoCo, and meets its infinities first."""
    inputs = rows_to_inputs([(0.0,) * 4] * 2, "displacement", [(0, 0, 0), (0, TOO_MUCH_N, 0)])
    run = simulate(load_robot("mitral_4dof@elongation"), inputs, NO_GRAVITY, ramp_s=0.05)
    assert run.failure is not None
    assert "row 2" in run.failure


def test_a_reset_forgets_what_mujoco_warned_of() -> None:
    """After a divergence the simulator is as good as new."""
    simulator = Simulator(load_robot("neuroendoscope_section"))
    simulator.put_inputs(np.array([TOO_MUCH_N, 0.0]))
    simulator.step()
    with pytest.raises(SimulationDiverged, match=r"diverged at 0\.005 simulated seconds"):
        simulator.require_finite()
    simulator.set_inputs(np.zeros(2))
    with pytest.raises(SimulationDiverged):  # of an earlier step, too
        simulator.settle()
    simulator.reset()
    simulator.step()
    simulator.require_finite()


def test_no_state_is_put_back_behind_the_back() -> None:
    """MuJoCo's own return to rest is off: time never runs backwards, and what is not finite stays."""
    simulator = Simulator(load_robot("neuroendoscope_section"))
    simulator.data.qvel[3] = np.nan
    times = []
    for _ in range(5):
        simulator.step()
        times.append(float(simulator.data.time))
    assert (np.diff(times) > 0.0).all()
    assert not np.isfinite(simulator.data.qpos).all()


@pytest.mark.parametrize("friction_mu", [0.0, 0.3])
def test_of_copies_those_are_named_whose_input_mujoco_ignores(friction_mu: float) -> None:
    """A batch keeps no warnings that can be read: the inputs are looked at; a reset heals."""
    robot = load_robot("neuroendoscope_section", [f"friction.mu={friction_mu}"])
    copies = Copies(Simulator(robot, inertia=False), 3)
    everyone = np.arange(3)
    wanted = np.array([[0.05, 0.0], [TOO_MUCH_N, 0.0], [0.0, 0.05]])
    copies.ramp(everyone, np.zeros((3, 2)), wanted, 0.05)
    assert copies.finite(everyone).tolist() == [True, False, True]
    copies.reset(np.array([1]))
    assert copies.finite(everyone).all()


def test_a_diagnosis_replay_says_where_it_ended() -> None:
    """Rows before it are replayed, the others are missing, and the reason is kept."""
    inputs = rows_to_inputs([(0.05, 0.0), (TOO_MUCH_N, 0.0)])
    table = Table(inputs.time_s, {"tip_x_mm": np.zeros(2)})
    robot = load_robot("neuroendoscope_section", ["dynamics.timestep_s=0.01"])
    result = replay(robot, Trial("a.csv", "heldout", inputs, table), ["tip_x_mm"], NO_GRAVITY)
    assert result.failure is not None
    assert "row 2" in result.failure
    assert np.isfinite(result.outputs[:, 0]).tolist() == [True, False]
