"""Claims about the printed model: its kinematics against geometry, its statics against measured tensions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from notched_cases import LINEAR, WRIST, changed, inputs

from catheter_sim.errors import InputError
from catheter_sim.robots.notched_tube import statics
from catheter_sim.robots.notched_tube.published import MEASURED_BEND_DEG, MEASURED_TENSION_N
from catheter_sim.robots.notched_tube.section import closing_angle, section
from catheter_sim.robots.notched_tube.statics import york
from reference import printed_formulas

SEGMENT = WRIST.segments[0]
HEIGHT, CENTROID = SEGMENT.notch_height_m, section(SEGMENT).centroid_m
INNER = WRIST.tendons[0].radius_m
NONE = np.zeros(3)


@pytest.mark.parametrize("bend", [1e-6, 0.05, 0.2, 0.45])
def test_displacement_is_that_of_the_straight_line_between_turned_edges(bend: float) -> None:
    """The printed formula gives what the tendon loses when the neutral plane becomes an arc of its length."""
    radius = HEIGHT / bend  # of the neutral plane, at x = -ybar; the arc's centre is at x = radius - ybar
    centre = np.array([radius - CENTROID, 0.0])
    lower = np.array([INNER, 0.0])
    cosine, sine = math.cos(bend), math.sin(bend)
    upper = centre + np.array([[cosine, sine], [-sine, cosine]]) @ (lower - centre)
    lost = HEIGHT - np.linalg.norm(upper - lower)
    curvature = printed_formulas.curvature_of_bend(bend, HEIGHT, CENTROID)
    as_printed = HEIGHT - 2.0 * (1.0 / curvature - INNER) * math.sin(
        curvature * HEIGHT / (2.0 * (1.0 + CENTROID * curvature))
    )
    assert lost == pytest.approx(as_printed, rel=1e-6, abs=1e-14)
    ours = printed_formulas.tendon_displacement(curvature, HEIGHT, CENTROID, INNER)
    assert ours == pytest.approx(lost, rel=1e-6, abs=1e-14)
    assert statics.bend_of_displacement(ours, HEIGHT, CENTROID, INNER) == pytest.approx(bend, rel=1e-9)


def test_printed_approximation_is_the_tendon_along_the_arc() -> None:
    """kappa = dl / (h (r_i + ybar) - dl ybar) bends by dl / (r_i + ybar); the straight line by 0.4 % less."""
    displacement = 0.4e-3
    curvature = printed_formulas.curvature_of_displacement(displacement, HEIGHT, CENTROID, INNER)
    bend = curvature * printed_formulas.arc_length(curvature, HEIGHT, CENTROID)
    assert bend == pytest.approx(displacement / (INNER + CENTROID))
    exact = statics.bend_of_displacement(displacement, HEIGHT, CENTROID, INNER)
    assert 1e-3 < abs(bend / exact - 1.0) < 1e-2


def test_corners_lose_as_a_capstan() -> None:
    """The printed loss at a corner is exp(-mu theta / 2) to second order, and 1 without friction."""
    for bend in (0.05, 0.2, 0.48):
        share = statics.corner_loss(bend, 0.2)
        assert share == pytest.approx(math.exp(-0.1 * bend), abs=3e-4)
    assert share > math.exp(-0.2 * 0.48) + 0.04  # two corners a notch, each half its bend
    assert statics.corner_loss(0.48, 0.0) == 1.0


def test_linear_metal_bends_by_its_second_moment() -> None:
    """Without plateaus the elastic moment is E I theta / h."""
    bend = np.array([0.01, 0.1, 0.4])
    moment = statics.elastic_moment(SEGMENT, LINEAR, bend)
    assert moment == pytest.approx(60e9 * section(SEGMENT).second_moment_m4 * bend / HEIGHT, rel=1e-4)


def test_statics_meet_the_measured_tensions() -> None:
    """To 0.07 N in the root mean square below closing, mu fitted to these data by the authors.

    The last two rows, where the measured notches close, are missed by more than 0.3 N.
    """
    bend = np.radians(np.array(MEASURED_BEND_DEG) - MEASURED_BEND_DEG[0]) / 5
    found = statics.tension_of_bend(SEGMENT, WRIST.material, WRIST.friction.mu, 5, bend)
    error = found - np.array(MEASURED_TENSION_N)
    assert np.sqrt(np.mean(error[:-3] ** 2)) < 0.07
    assert np.all(error[-2:] < -0.3)


def test_tension_model_inverts_its_statics() -> None:
    """The bend at a tension needs that tension, and no tension bends further than closing."""
    run = york(WRIST, inputs([0.0, 1.0, 2.5, 9.0]), NONE)
    bends = np.array([posture.joint_angles[0] for posture in run.postures])
    back = statics.tension_of_bend(SEGMENT, WRIST.material, WRIST.friction.mu, 5, bends[:3])
    assert back == pytest.approx([0.0, 1.0, 2.5], abs=2e-3)
    assert bends[3] == pytest.approx(closing_angle(SEGMENT))


def test_displacement_model_shortens_the_tendon_by_the_input() -> None:
    """The postures' tendon, measured from edge to edge in space, is shorter by the displacement."""
    run = york(WRIST, inputs([0.0, 0.5e-3, 2.0e-3], "displacement"), NONE)
    lengths = []
    for posture in run.postures:
        faces = np.concatenate([[np.zeros(3)], posture.p_w])
        frames = np.concatenate([[np.eye(3)], posture.R_w])
        total = 0.0
        for k in range(5):
            uncut = SEGMENT.spacing_m if k < 4 else WRIST.tip_length_m
            low = faces[k] + INNER * frames[k][:, 0]
            high = faces[k + 1] - uncut * frames[k + 1][:, 2] + INNER * frames[k + 1][:, 0]
            total += float(np.linalg.norm(high - low))
        lengths.append(total)
    assert lengths[0] - np.array(lengths) == pytest.approx([0.0, 0.5e-3, 2.0e-3], abs=1e-9)


def test_refuses_what_it_does_not_have() -> None:
    """Loads, weight and a bent or mixed tube are refused in a line that names the other model."""
    for robot, rows, gravity in (
        (WRIST, inputs([1.0], force=(0.1, 0.0, 0.0)), NONE),
        (WRIST, inputs([1.0]), np.array([9.81, 0.0, 0.0])),
        (changed(rest_curvature_x_per_m=5.0), inputs([1.0]), NONE),
    ):
        with pytest.raises(InputError, match="kinetostatic"):
            york(robot, rows, gravity)
