"""The planar twin in a fit: what the static model says, in the columns that are asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted import as_inputs, pair_history

from catheter_sim.catalogue import load_robot
from catheter_sim.core.statics import OneByOne
from catheter_sim.effects.apply import with_effects
from catheter_sim.robots.continuum.twin import PlanarTwin
from catheter_sim.theory.twins import by_static_model, twin_for

NO_GRAVITY = np.zeros(3)
COLUMNS = ("tip_x_mm", "tip_z_mm", "body_15_x_mm", "tip_qy", "joint_x3_deg")


def inputs_of(robot):
    """Return a history that every section takes part in."""
    pair = pair_history(3, cycles=2).tendon[:14]
    if len(robot.tendons) == 2:
        return as_inputs(pair, "tension")
    other = 0.15 * np.concatenate([0.0 * pair[:4], pair[:-4]])
    return as_inputs(np.column_stack([0.6 * pair, other[:, [0, 0, 1, 1]]]), "tension")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["neuroendoscope_section", "neuroendoscope"])
def test_outputs_are_the_static_model_s(name):
    """Robots of other lengths, mounts and frames in one batch, every third row: the model's to 0.05."""
    base = load_robot(name)
    longer = tuple(replace(segment, length_m=1.1 * segment.length_m) for segment in base.segments)
    robots = [
        with_effects(base, {"axial_compression": {"stiffness_N_per_mm": 2.0}}),
        with_effects(
            replace(base, segments=longer),
            {"measurement_frame": {"translation_x_mm": 3.0, "rotation_y_deg": 5.0}},
        ),
    ]
    inputs = inputs_of(base)
    columns = (*COLUMNS, f"tension_{base.tendons[0].name}_N")
    twin = twin_for(base, "tension", columns, NO_GRAVITY)
    assert isinstance(twin.twin, PlanarTwin)
    one_by_one = by_static_model("fkm_exact_arm", base, columns, NO_GRAVITY)
    np.testing.assert_allclose(twin(robots, inputs, 3), one_by_one(robots, inputs, 3), atol=0.05)


def test_other_planar_robots_are_solved_one_by_one():
    """A planar robot with a single tendon has a twin, too: the static model itself."""
    base = load_robot("neuroendoscope_section")
    robot = replace(base, tendons=base.tendons[:1])
    twin = twin_for(robot, "tension", ("tip_x_mm",), NO_GRAVITY)
    assert isinstance(twin.twin, OneByOne)
    found = twin([robot], as_inputs(np.array([[0.0], [0.2]]), "tension"))
    assert found[0, 0, 0] == 0.0
    assert found[0, 1, 0] > 10.0
