"""Many planar robots at once: the same as the exact-arm statics, one at a time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planar_cases import NO_GRAVITY, SIDEWAYS, section, tensions

from catheter_sim.robots.catalogue import load_robot
from catheter_sim.statics import planar_batch, planar_chain
from catheter_sim.statics.exact_arm import fkm_exact_arm
from catheter_sim.statics.planar import hinge_chain

pytestmark = pytest.mark.slow

# Out, back a little, out, all the way back to the other side, a partial loop there, slack.
LOOP = [(0.0, 0.0), (0.12, 0.12), (0.5, 0.12), (0.4, 0.12), (0.55, 0.12), (0.12, 0.12)]
LOOP += [(0.12, 0.5), (0.12, 0.3), (0.12, 0.45), (0.3, 0.3), (0.0, 0.0)]


def largest_gap_mm(robot, gravity, force=None, rows=LOOP):
    """Return how far the batch's faces are from the exact-arm statics' [mm]."""
    inputs = tensions(rows, force_tip=force)
    exact = np.array([item.p_w for item in fkm_exact_arm(robot, inputs, gravity).postures])
    angles, shift = planar_batch.solve_pairs([robot], [inputs], gravity)
    p_w, _ = hinge_chain(angles, planar_chain.planar_chain(robot, "test").cell_length)
    p_w[..., 2] += shift[..., None]
    return 1e3 * np.abs(p_w[0] - exact).max()


@pytest.mark.parametrize("mu", [0.0, 0.3, 0.6])
def test_same_steps_same_postures(mu, monkeypatch):
    """With the exact-arm statics' own steps the two agree to a nanometre scale, history included."""
    monkeypatch.setattr(planar_batch, "STEP_BEND_RAD", planar_chain.STEP_BEND_RAD)
    assert largest_gap_mm(section(mu), NO_GRAVITY) < 1e-4


def test_shipped_steps_are_small_enough():
    """With the shipped, longer steps they agree within 0.05 mm, the smallest noise that is expected."""
    assert largest_gap_mm(section(), NO_GRAVITY) < 0.05


def test_weight_and_tip_force(monkeypatch):
    """Weight and a force on the tip bend the batch like the single robot."""
    monkeypatch.setattr(planar_batch, "STEP_BEND_RAD", planar_chain.STEP_BEND_RAD)
    short = LOOP[1:5]
    assert largest_gap_mm(section(), SIDEWAYS, rows=short) < 0.01
    # The single robot also cuts the first row's force into steps, the batch only its tensions.
    push = [(0.004, 0.0, -0.002)] * len(short)
    assert largest_gap_mm(section(), NO_GRAVITY, push, short) < 0.05


def test_law_rest_and_mount_count():
    """Cubic law, rest curvature and a soft mount act as in the single robot."""
    base = section()
    robot = replace(
        base,
        segments=(replace(base.segments[0], stiffness_cubic_m2=2e-5, rest_curvature_x_per_m=4.0),),
        mount=replace(base.mount, axial_stiffness_N_per_m=1e3),
    )
    assert largest_gap_mm(robot, NO_GRAVITY) < 0.05


def test_robots_of_a_batch_do_not_mix():
    """Each robot of a batch is what it is alone (to what the shared number of steps changes)."""
    robots = [replace(section(mu), stiffness_scale=scale) for mu, scale in ((0.2, 0.9), (0.4, 1.2))]
    inputs = tensions(LOOP)
    together, _ = planar_batch.solve_pairs(robots, [inputs] * 2, NO_GRAVITY)
    for index, robot in enumerate(robots):
        alone, _ = planar_batch.solve_pairs([robot], [inputs], NO_GRAVITY)
        np.testing.assert_allclose(together[index], alone[0], atol=2e-4)


def test_knows_only_what_it_can():
    """One pair of tendons to the tip in a planar robot, and nothing else."""
    assert planar_batch.knows(section())
    assert not planar_batch.knows(load_robot("neuroendoscope"))
    assert not planar_batch.knows(load_robot("spacer_disk"))
    assert not planar_batch.knows(replace(section(), tendons=section().tendons[:1]))
