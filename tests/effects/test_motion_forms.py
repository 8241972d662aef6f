"""Forms that show in motion: a mass at the tip, viscous loss, memories that begin at a first row."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.channels import outputs_of
from catheter_sim.core.inputs import Inputs
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import arriving_inputs, with_built_in_effects, with_effects
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.simulation.replay import simulate
from catheter_sim.theory.twins import twin_for
from tests.simulation.moving import LENGTH_M, STIFFNESS_N_M2, pulled, swinging

MASS_KG = 0.005
SIDEWAYS = np.array([9.81, 0.0, 0.0])
WEIGHTLESS = np.zeros(3)


def light(damping_time_s: float = 0.0) -> ContinuumRobot:
    """Return an arm that weighs next to nothing beside a load at its tip."""
    return swinging(mu=0.0, damping_time_s=damping_time_s, mass_kg=1e-5, disks=8, motion_timestep_s=5e-4)


def let_go(robot: ContinuumRobot, seconds: float, force_N: float = 0.02) -> tuple[Array, Array]:
    """Return times and the tip's x after a small force across it has gone, shapes (r,)."""
    time_s = 0.002 * np.arange(round(seconds / 0.002) + 1)
    force = np.zeros((len(time_s), 3))
    force[0, 0] = force_N
    inputs = Inputs(time_s, "tension", np.zeros((len(time_s), 2)), force, np.zeros_like(force))
    run = simulate(robot, inputs, WEIGHTLESS, dynamic=True)
    return time_s, np.array([posture.p_w[-1, 0] for posture in run.postures])


def crossings_s(time_s: Array, x: Array) -> Array:
    """Return the times at which x falls through zero."""
    k = np.flatnonzero((x[:-1] > 0.0) & (x[1:] <= 0.0))
    return time_s[k] + (time_s[k + 1] - time_s[k]) * x[k] / (x[k] - x[k + 1])


@pytest.mark.slow
def test_a_mass_at_the_tip_swings_as_on_a_massless_beam() -> None:
    """A cantilever with a load at its end: f = sqrt(3 EI / (m L^3)) / (2 pi) (Blevins 1979, Table 8-8)."""
    robot = with_built_in_effects(with_effects(light(), {"payload": {"mass_g": 1e3 * MASS_KG}}))
    times = crossings_s(*let_go(robot, 0.9))
    expected_Hz = math.sqrt(3.0 * STIFFNESS_N_M2 / (MASS_KG * LENGTH_M**3)) / (2.0 * math.pi)
    assert 1.0 / float(np.diff(times).mean()) == pytest.approx(expected_Hz, rel=0.01)


def test_viscous_loss_takes_amplitude_as_kelvin_and_voigt_say() -> None:
    """A mode of angular frequency w decays with the rate T w^2 / 2, T the damping's time constant."""
    loaded = {"payload": {"mass_g": 1e3 * MASS_KG}}
    given_s = 0.004
    robot = with_built_in_effects(
        with_effects(light(0.002), {**loaded, "rate": {"damping_time_s": given_s - 0.002}})
    )
    time_s, x = let_go(robot, 0.9)
    omega = 2.0 * math.pi / float(np.diff(crossings_s(time_s, x)).mean())
    peaks = [k for k in range(1, len(x) - 1) if x[k] > x[k - 1] and x[k] >= x[k + 1] and x[k] > 0.0]
    rate = -np.polyfit(time_s[peaks], np.log(x[peaks]), 1)[0]
    assert rate == pytest.approx(0.5 * given_s * omega**2, rel=0.05)


def test_where_rows_are_held_a_mass_is_its_weight() -> None:
    """In the simulation and in the twin: the same posture as under a force m g, and another than without."""
    robot = swinging(mu=0.0)
    weighted = with_effects(robot, {"payload": {"mass_g": 20.0}})
    inputs = replace(pulled(), time_s=np.arange(2.0), tendon=np.zeros((2, 2)))
    inputs = replace(inputs, force_tip=np.zeros((2, 3)), moment_tip=np.zeros((2, 3)))
    pushed = replace(inputs, force_tip=np.tile(0.02 * SIDEWAYS, (2, 1)))

    def held(one: ContinuumRobot, given: Inputs) -> float:
        return float(simulate(one, given, SIDEWAYS).postures[-1].p_w[-1, 0])

    assert held(weighted, inputs) == pytest.approx(held(robot, pushed), abs=1e-6)
    assert held(weighted, inputs) - held(robot, inputs) > 1e-3
    twin = twin_for(robot, "tension", ("tip_x_mm",), SIDEWAYS)
    assert twin([weighted], inputs)[0] == pytest.approx(twin([robot], pushed)[0], abs=1e-9)


def test_forms_of_motion_are_tried_on_data_in_motion_alone() -> None:
    robot = swinging()
    assert ("damping_time_s",) not in EFFECTS["rate"].variants(robot)
    assert ("damping_time_s",) in EFFECTS["rate"].variants(robot, moving=True)
    assert ("mass_g",) not in EFFECTS["payload"].variants(robot)
    assert ("mass_g",) in EFFECTS["payload"].variants(robot, moving=True)


@pytest.mark.parametrize(
    "effects",
    [
        {"rate": {"lag_s": 0.1}},
        {"rate": {"delay_s": 0.1}},
        {"backlash": {"width_N": 0.2}},
    ],
)
def test_in_motion_the_first_row_has_been_there_for_long(effects: dict[str, dict[str, float]]) -> None:
    """What remembers begins at the first row, and not on the way to it from zero."""
    robot = with_effects(swinging(), effects)
    standing = replace(pulled(), tendon=np.tile([1.0, 0.5], (51, 1)))
    assert np.array_equal(arriving_inputs(robot, standing, moving=True).tendon, standing.tendon)
    assert not np.array_equal(arriving_inputs(robot, standing).tendon, standing.tendon)


@pytest.mark.slow
@pytest.mark.parametrize(
    "reference", ["chest_tube_section", "mitral_transseptal", "neuroendoscope", "notched_wrist"]
)
def test_a_robot_of_any_kind_carries_a_mass_at_its_tip(reference: str) -> None:
    """In the model the load is as heavy as stated, and its centre lies in the last element's distal face."""
    robot = load_robot(reference, ["tip_mass_g=2"])
    model, plain = (
        mujoco.MjModel.from_xml_string(build_mjcf(item)) for item in (robot, load_robot(reference))
    )
    assert model.body_mass.sum() - plain.body_mass.sum() == pytest.approx(2e-3, rel=1e-9)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    load, faces = data.body("tip_mass").xipos, outputs_of(robot).elements
    assert load == pytest.approx(data.site(f"face_{faces}").xpos, abs=1e-9)
    with pytest.raises(InputError, match=r"tip_mass_g = -1: must lie in 0 to"):
        load_robot(reference, ["tip_mass_g=-1"])
