"""Claims about further forms of causes, each in a case that is worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.effect import Role
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Observed
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import arriving_inputs, measured, with_built_in_effects, with_effects
from catheter_sim.effects.shared import places
from catheter_sim.theory.static_models import STATIC_MODELS

SECTION = load_robot("neuroendoscope_section")


def inputs_of(actuation: str, *columns: list[float]) -> Inputs:
    rows = np.array(columns).T
    nothing = np.zeros((len(rows), 3))
    return Inputs(np.arange(float(len(rows))), actuation, rows, nothing, nothing)


def test_a_response_that_creeps_comes_on_after_what_is_held() -> None:
    """After a step x' - x = c (x - x_first) (1 - exp(-t / T)); what was there at first has crept before."""
    time_s = np.array([0.0, 1e-9, 30.0, 90.0, 600.0])
    x = np.array([0.02, 0.05, 0.05, 0.05, 0.05])
    p_w = np.zeros((5, 1, 3))
    p_w[:, 0, 0] = x
    turn = np.tile(np.eye(3), (5, 1, 1, 1))
    look = Observed(time_s, p_w, turn, np.zeros((5, 0)), np.zeros((5, 2)))
    robot = with_effects(SECTION, {"drift": {"response_creep": 0.2, "response_creep_time_s": 30.0}})
    expected = x + 0.2 * (x - 0.02) * -np.expm1(-time_s / 30.0)
    assert measured(robot, look).p_w[:, 0, 0] == pytest.approx(expected, abs=1e-9)
    assert measured(robot, look).R_w == pytest.approx(turn)


def test_a_pair_lengthens_on_the_side_that_was_pulled() -> None:
    """Pulled 4 mm, a tenth stays: 2 mm then draw 1.6, -2 mm draw 1.8 of the other side."""
    robot = load_robot("mitral_transseptal")
    names = [item.name for item in robot.tendons]
    bending, torsion = names.index("bending"), names.index("torsion_proximal")
    rows = np.zeros((5, len(names)))
    rows[:, bending] = rows[:, torsion] = np.array([0.0, 4.0, 2.0, 0.2, -2.0]) * 1e-3
    inputs = inputs_of("displacement", *rows.T.tolist())
    arrived = arriving_inputs(with_effects(robot, {"tendon_elongation": {"set_share": 0.1}}), inputs).tendon
    assert 1e3 * arrived[:, bending] == pytest.approx([0.0, 3.6, 1.6, 0.0, -1.8])
    assert np.array_equal(arrived[:, torsion], rows[:, torsion])  # no tendon of it bends


def test_a_tendon_alone_stays_longer_whatever_is_let_out() -> None:
    """y = u - share max(u so far), below zero too: its end has gone out by that."""
    robot = load_robot("spacer_disk", {"actuation": "displacement"})
    way = np.array([0.0, 2.0, 1.0, -1.0]) * 1e-3
    columns = [way.tolist(), *([[0.0] * 4] * (len(robot.tendons) - 1))]
    inputs = inputs_of("displacement", *columns)
    arrived = arriving_inputs(with_effects(robot, {"tendon_elongation": {"set_share": 0.1}}), inputs).tendon
    assert 1e3 * arrived[:, 0] == pytest.approx([0.0, 1.8, 0.8, -1.2])


def test_a_path_holds_back_on_either_way() -> None:
    """Pulled, exp(-a) of the tension arrives; let go, it stays until exp(a) of what is left is less."""
    loss = 0.2
    pull = [0.0, 1.0, 0.9, 0.5, 0.0]
    robot = with_effects(SECTION, {"tendon_friction": {"path_loss": loss}})
    arrived = arriving_inputs(robot, inputs_of("tension", pull, [0.0] * 5)).tendon[:, 0]
    down, up = math.exp(-loss), math.exp(loss)
    assert arrived == pytest.approx([0.0, down, down, 0.5 * up, 0.0])


def test_a_camera_that_is_too_near_scales_from_its_zero() -> None:
    """Frame first, scale after it; what turns is not scaled."""
    look = Observed(
        np.zeros(1), np.array([[[0.01, 0.0, 0.1]]]), np.eye(3)[None, None], np.zeros((1, 0)), np.zeros((1, 2))
    )
    robot = with_effects(SECTION, {"measurement_frame": {"scale": 1.1, "translation_x_mm": 5.0}})
    found = measured(robot, look)
    assert found.p_w[0, 0] == pytest.approx([0.0165, 0.0, 0.11])
    assert np.array_equal(found.R_w, look.R_w)


def test_axes_that_are_not_at_right_angles_mix_what_is_seen() -> None:
    """x grows by a share of z and z by one of x, after frame and scale; what turns is not sheared."""
    look = Observed(
        np.zeros(1), np.array([[[0.01, 0.0, 0.1]]]), np.eye(3)[None, None], np.zeros((1, 0)), np.zeros((1, 2))
    )
    values = {"shear_xz": 0.02, "shear_zx": -0.1, "scale": 2.0, "translation_y_mm": 5.0}
    found = measured(with_effects(SECTION, {"measurement_frame": values}), look)
    assert found.p_w[0, 0] == pytest.approx([0.024, 0.01, 0.198])
    assert np.array_equal(found.R_w, look.R_w)


def test_a_drum_that_grows_pulls_by_the_square() -> None:
    """One channel's scale grows by a tenth of a newton's share over each newton, beside the common one."""
    robot = with_effects(SECTION, {"actuation_gain": {"curve_per_N": 0.2, "curve_left_per_N": -0.1}})
    arrived = arriving_inputs(robot, inputs_of("tension", [0.0, 0.5, 1.0], [0.0, 1.0, 2.0])).tendon
    assert arrived[:, 0] == pytest.approx([0.0, 0.55, 1.2])
    assert arrived[:, 1] == pytest.approx([0.0, 1.1, 2.4])
    both_ways = with_effects(load_robot("mitral_4dof"), {"actuation_gain": {"curve_per_mm": 0.01}})
    rows = inputs_of("displacement", [0.0, 3e-3, -3e-3], *3 * [[0.0] * 3])
    assert 1e3 * arriving_inputs(both_ways, rows).tendon[:, 0] == pytest.approx([0.0, 3.09, -3.09])


def test_a_coupling_that_grows_moves_the_other_by_the_square() -> None:
    """2 mm of one joint move the other's tendons by 0.05 / mm x 2 mm x 2 mm, either way."""
    values = {"bending_proximal_to_bending_distal_per_mm": 0.05}
    robot = with_effects(load_robot("mitral_4dof"), {"coupling": values})
    rows = inputs_of("displacement", [0.0, 2e-3, -2e-3], *3 * [[0.0] * 3])
    arrived = 1e3 * arriving_inputs(robot, rows).tendon
    assert arrived[:, 1] == pytest.approx([0.0, 0.2, -0.2])
    assert arrived[:, 0] == pytest.approx([0.0, 2.0, -2.0])


def test_a_spring_lets_a_share_through_a_dead_band() -> None:
    """A quarter of each step arrives at once, three quarters behind the play; row by row as in one go."""
    robot = with_effects(SECTION, {"backlash": {"soft_width_N": 0.4, "soft_through": 0.25}})
    pull = [0.0, 0.1, 1.0, 0.9, 0.0]
    played = np.array([0.0, 0.0, 0.8, 0.8, 0.2])
    expected = 0.25 * np.array(pull) + 0.75 * played
    arrived = arriving_inputs(robot, inputs_of("tension", pull, [0.0] * 5)).tendon[:, 0]
    assert arrived == pytest.approx(expected)
    memory = next(form.memory for form in EFFECTS["backlash"].forms if form.name == "soft")
    assert memory is not None
    state = memory.start(robot, robot.effects["backlash"], np.zeros(2))
    seen_rows = []
    for before, after in zip([0.0, *pull], pull, strict=False):
        state, out = memory.step(state, np.array([before, 0.0]), np.array([after, 0.0]), 1.0)
        seen_rows.append(out[0])
    assert seen_rows == pytest.approx(expected)


def test_plays_of_channels_differ() -> None:
    """Each channel follows with its own dead-band, beside the common one."""
    robot = with_effects(SECTION, {"backlash": {"width_N": 0.1, "width_left_N": 0.2}})
    rise = [0.0, 1.0, 0.0]
    arrived = arriving_inputs(robot, inputs_of("tension", rise, rise)).tendon
    assert arrived[:, 0] == pytest.approx([0.0, 0.95, 0.05])
    assert arrived[:, 1] == pytest.approx([0.0, 0.85, 0.15])


def test_one_section_alone_is_softer() -> None:
    """Twice as soft, a section turns twice as far under the same tension, the one before it as before."""
    robot = load_robot("neuroendoscope")
    names = [item.parameter for item in places(robot, Role.ELASTIC_CONSTANT)]
    assert names == [f"scale_{segment.name}" for segment in robot.segments]
    last = robot.segments[-1].name
    changed = with_built_in_effects(with_effects(robot, {"stiffness": {f"scale_{last}": 0.5}}))
    factors = [
        after.bending_stiffness_N_m2 / before.bending_stiffness_N_m2
        for before, after in zip(robot.segments, changed.segments, strict=True)
    ]
    assert factors == pytest.approx([1.0, 0.5])
    assert EFFECTS["stiffness"].form_of(robot, (f"scale_{last}",)).name == "section"
    assert [item.name for item in EFFECTS["stiffness"].parameters(SECTION)] == ["scale"]


def test_a_quintic_term_acts_at_large_bends_only() -> None:
    """Without friction and weight one tendon's moment is EI (k + q k^5): k is its root, in every cell."""
    robot = load_robot("neuroendoscope_section", {"friction.mu": 0.0})
    radius_m, segment = robot.tendons[0].radius_m, robot.segments[0]
    pulls = [0.05, 0.3]
    quintic = 1e6  # mm^4
    changed = with_effects(robot, {"nonlinear_stiffness": {"quintic_mm4": quintic}})
    inputs = {"time_s": np.arange(2.0), "tension_right_N": pulls, "tension_left_N": [0.0, 0.0]}
    bend = [
        np.abs(np.array([np.sum(posture.joint_angles) for posture in statics_of(item, inputs)]))
        for item in (robot, changed)
    ]
    assert bend[1][0] == pytest.approx(bend[0][0], rel=0.02)
    assert bend[1][1] < 0.9 * bend[0][1]
    curvature = bend[1] / segment.length_m
    moment = segment.bending_stiffness_N_m2 * (curvature + 1e-12 * quintic * curvature**5)
    assert moment == pytest.approx(radius_m * np.array(pulls), rel=0.03)


def statics_of(robot, inputs):
    rows = np.stack([inputs["tension_right_N"], inputs["tension_left_N"]], axis=1)
    model = STATIC_MODELS["fkm_exact_arm"]
    return model.solve(robot, inputs_of("tension", *rows.T.tolist()), np.zeros(3)).postures
