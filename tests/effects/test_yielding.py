"""A backbone part of which yields, by hand and in the simulation; a sensor that lies beside the tip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import load_robot
from catheter_sim.channels import QUATERNION, read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.effects.apply import outside_the_robot, with_built_in_effects, with_effects
from catheter_sim.errors import InputError
from catheter_sim.exporting.elements import LEFT, find_causes
from catheter_sim.robots.continuum.constant_curvature import constant_curvature
from catheter_sim.robots.continuum.spec import Segment, Tendon
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table
from catheter_sim.theory.twins import twin_for

LENGTH_M, RIGIDITY, ARM_M = 0.1, 4e-3, 5e-3
SHARE, YIELD_PER_M = 0.4, 2.0
NO_GRAVITY = np.zeros(3)
ROD = replace(
    load_robot("spacer_disk"),
    name="rod",
    actuation="tension",
    segments=(Segment("only", LENGTH_M, 10, 8e-3, RIGIDITY, 1e-3),),
    tendons=tuple(Tendon(f"t{k}", ARM_M, 0.5 * np.pi * k, "only") for k in range(4)),
)
YIELDING = with_effects(ROD, {"nonlinear_stiffness": {"plastic_share": SHARE, "yield_per_m": YIELD_PER_M}})


def pulled(x: np.ndarray, y: np.ndarray) -> Inputs:
    """Return inputs that pull toward +x and +y, or the other tendons where these are below zero [N]."""
    tension = np.stack([np.maximum(part, 0.0) for part in (x, y, -x, -y)], axis=1)
    nothing = np.zeros((len(x), 3))
    return Inputs(np.arange(float(len(x))), "tension", tension, nothing, nothing)


def bends(moments: np.ndarray) -> np.ndarray:
    """Return the curvatures (r,) under moments [N m] of a spring beside a spring with a slider, by hand.

    The slider's spring is bent by k - slipped, at most by the yield; what is sought is the root of a
    function that grows piece by piece, found by halving.
    """
    found, slipped = [], 0.0

    def carried(k: float) -> float:
        return RIGIDITY * (k + SHARE * min(max(k - slipped, -YIELD_PER_M), YIELD_PER_M))

    for moment in moments:
        low, high = -1e3, 1e3
        for _ in range(100):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if carried(middle) < moment else (low, middle)
        slipped = low - min(max(low - slipped, -YIELD_PER_M), YIELD_PER_M)
        found.append(low)
    return np.array(found)


def test_a_loop_by_hand() -> None:
    """Out beyond the yield, back to nothing, to the other side and back: it keeps a bend without load."""
    x = np.array([0.0, 1.0, 3.0, 8.0, 4.0, 0.0, -2.0, -8.0, -1.0, 0.0, 5.0])
    run = constant_curvature(with_built_in_effects(YIELDING), pulled(x, np.zeros_like(x)), NO_GRAVITY)
    expected = bends(x * ARM_M)
    turned = np.array([np.arctan2(item.R_w[-1, 0, 2], item.R_w[-1, 2, 2]) for item in run.postures])
    assert turned / LENGTH_M == pytest.approx(expected, abs=1e-6)
    assert abs(expected[5]) > 0.3 * YIELD_PER_M * SHARE


def test_in_space_it_slips_the_way_it_is_bent() -> None:
    """Bent far along x, then turned toward y at one size: what slips follows, and never carries more."""
    x, y = np.array([4.0, 8.0, 8.0, 0.0]), np.array([0.0, 0.0, 8.0, 8.0])
    robot = with_built_in_effects(YIELDING)
    for item, pull in zip(
        constant_curvature(robot, pulled(x, y), NO_GRAVITY).postures, zip(x, y, strict=True), strict=True
    ):
        angle = np.array(
            [np.sum(item.joint_angles[0::2]), np.sum(item.joint_angles[1::2])]
        )  # toward x, toward y
        carried = ARM_M * np.array(pull) - RIGIDITY * angle / LENGTH_M
        assert np.linalg.norm(carried) == pytest.approx(RIGIDITY * SHARE * YIELD_PER_M, rel=1e-6)


def test_the_simulation_does_the_same() -> None:
    """Loops in space: beside what yielding does, simulation and fast model differ by a few percent."""
    t = np.arange(24.0)
    inputs = pulled(6.0 * np.sin(t / 3.0), 5.0 * np.sin(t / 2.2))
    columns = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
    gravity = np.zeros(3)
    tips = twin_for(YIELDING, "tension", columns, gravity)([YIELDING, ROD], inputs)
    run = simulate(YIELDING, inputs, gravity)
    simulated = 1e3 * np.array([item.p_w[-1] for item in run.postures])
    done = np.linalg.norm(tips[0] - tips[1], axis=1)
    assert np.linalg.norm(simulated - tips[0], axis=1).max() < 0.05 * done.max()
    assert done.max() > 3.0


def test_a_simulator_forgets_at_reset() -> None:
    """Bent far and reset, the robot is straight again; without a reset it is not."""
    simulator = cs.Simulator(YIELDING)
    for tension in ([8.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]):
        simulator.set_inputs(tension)
        simulator.settle()
    assert simulator.posture().p_w[-1, 0] > 2e-3
    simulator.reset()
    assert simulator.posture().p_w[-1, 0] == pytest.approx(0.0, abs=1e-9)


def test_what_cannot_hold_it_says_so() -> None:
    """Rods' statics, an exported file, a segment that bends in one plane, and a number below zero."""
    (cause,) = find_causes(YIELDING)
    assert (cause.form, cause.way) == ("hysteretic", LEFT)
    assert outside_the_robot(YIELDING) == []
    inputs = Table(np.array([0.0]), {f"tension_t{k}_N": np.array([0.0]) for k in range(4)})
    assert len(read_inputs(YIELDING, inputs))
    with pytest.raises(InputError, match="a plastic part of the stiffness"):
        cs.statics(YIELDING, inputs, model="VC")
    for setting, said in (
        ("segments.distal.plastic_share=0.1", "must be 0 where bending_axes is x or y"),
        ("segments.distal.plastic_share=-0.1", "must not be negative"),
    ):
        with pytest.raises(InputError, match=said):
            load_robot("neuroendoscope", (setting,))


def test_a_sensor_ahead_of_the_tip_turns_with_it() -> None:
    """Bent by b a sensor 6 mm ahead and 2 mm aside lies by that further along and across the tip."""
    values = {"ahead_mm": 6.0, "aside_x_mm": 2.0}
    robot = with_effects(ROD, {"measurement_frame": values})
    inputs = pulled(np.array([0.0, 4.0]), np.zeros(2))
    columns = ("tip_x_mm", "tip_z_mm", "body_5_x_mm", *QUATERNION)
    there, here = twin_for(ROD, "tension", columns, NO_GRAVITY)([robot, ROD], inputs)
    bend = 2.0 * np.arctan2(here[1, 5], here[1, 3])
    away = [6.0 * np.sin(bend) + 2.0 * np.cos(bend), 6.0 * np.cos(bend) - 2.0 * np.sin(bend), 0.0]
    assert (there - here)[:, :3] == pytest.approx(np.array([[2.0, 6.0, 0.0], away]), abs=1e-6)
    assert there[:, 3:] == pytest.approx(here[:, 3:])
    assert bend == pytest.approx(4.0 * ARM_M / RIGIDITY * LENGTH_M, rel=0.01)
