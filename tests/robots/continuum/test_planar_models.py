from dataclasses import replace

import numpy as np
import pytest
from planar_cases import NO_GRAVITY, section, single, tensions, tips_mm

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import joint_names
from catheter_sim.errors import InputError
from catheter_sim.theory.static_models import STATIC_MODELS

pytestmark = pytest.mark.slow

PLANAR = ("fkm", "fkm_stick", "fkm_exact_arm", "fkm_sliding", "pcca")
planar_models = pytest.mark.parametrize("model", [STATIC_MODELS[name] for name in PLANAR], ids=PLANAR)


def change_segment(**changes):
    """Return the section with its segment changed."""
    robot = section()
    return replace(robot, segments=(replace(robot.segments[0], **changes),))


@planar_models
def test_planar_models_apply_to_planar_robots_alone(model):
    """They know both neuroendoscopes and not the spatial benchmark robot, by test and by error."""
    assert model.applies_to(load_robot("neuroendoscope"))
    assert model.applies_to(section())
    assert not model.applies_to(load_robot("spacer_disk"))
    with pytest.raises(InputError, match=r"^static model .*bending_axes"):
        model.solve(load_robot("spacer_disk"), tensions([[0.0] * 4]), NO_GRAVITY)


@planar_models
def test_postures_have_the_agreed_shapes(model):
    """One posture a row; faces, joints and tensions in the robot's order; NaN beyond a tendon's end."""
    robot = load_robot("neuroendoscope")
    inputs = tensions([[0.1, 0.12, 0.05, 0.05, 0.0, 0.0], [0.1, 0.0, 0.05, 0.05, 0.0, 0.0]])
    run = model.solve(robot, inputs, NO_GRAVITY)
    assert run.model == model.name
    assert len(run.postures) == len(run.residual) == 2
    for posture, row in zip(run.postures, inputs.tendon, strict=True):
        assert posture.p_w.shape == (60, 3)
        assert posture.R_w.shape == (60, 3, 3)
        assert posture.joint_angles.shape == (len(joint_names(robot)),)
        np.testing.assert_array_equal(posture.actuator_tension, row)
        assert posture.tendon_tension.shape == (6, 60)
        np.testing.assert_array_equal(
            np.isnan(posture.tendon_tension), [[j > 1 and k > 29 for k in range(60)] for j in range(6)]
        )
        np.testing.assert_allclose(
            posture.R_w @ posture.R_w.transpose(0, 2, 1), np.eye(3)[None].repeat(60, 0), atol=1e-14
        )


@planar_models
def test_a_twistable_backbone_of_a_planar_robot_stays_untwisted(model):
    """Twist joints, where the robot has them, stand at zero between the bending joints."""
    robot = change_segment(torsion_stiffness_N_m2=1e-5)
    posture = model.solve(robot, single(0.3), NO_GRAVITY).postures[0]
    angles = dict(zip(joint_names(robot), posture.joint_angles, strict=True))
    assert angles["t7"] == 0.0
    assert angles["x7"] > 0.0


@planar_models
@pytest.mark.parametrize(
    ("robot", "named"),
    [
        (replace(section(), links_per_subsegment=2), "links_per_subsegment = 2"),
        (change_segment(rest_curvature_y_per_m=1.0), "rest_curvature_y"),
        (change_segment(rest_twist_rad_per_m=1.0), "rest_twist"),
    ],
)
def test_robots_outside_the_plane_are_refused_by_name(model, robot, named):
    """One line names the model and the key."""
    with pytest.raises(InputError, match=named) as error:
        model.solve(robot, single(0.1), NO_GRAVITY)
    assert "\n" not in str(error.value)
    assert model.name in str(error.value)


@planar_models
def test_displacements_are_refused(model):
    """Displacement inputs end in one line that says what takes them."""
    inputs = replace(single(0.1), actuation="displacement")
    with pytest.raises(InputError, match=r"tension inputs only.*simulation"):
        model.solve(section(), inputs, NO_GRAVITY)


@pytest.mark.parametrize("name", ["fkm", "fkm_stick", "pcca"])
def test_printed_models_refuse_loads_that_they_leave_out(name):
    """Weight and tip load in the plane are refused with the row and the model that has them."""
    solve = STATIC_MODELS[name].solve
    with pytest.raises(InputError, match=r"no weight.*fkm_exact_arm"):
        solve(section(), single(0.1), np.array([0.0, 0.0, -9.81]))
    with pytest.raises(InputError, match=r"^row 2 \(time_s = 1\).*no tip force.*fkm_exact_arm"):
        solve(section(), tensions([[0.1, 0], [0.1, 0]], [[0, 0, 0], [0.01, 0, 0]]), NO_GRAVITY)
    across = solve(section(), tensions([[0.1, 0]], [[0, 0.01, 0]]), np.array([0.0, 9.81, 0.0]))
    np.testing.assert_array_equal(tips_mm(across), tips_mm(solve(section(), single(0.1), NO_GRAVITY)))


@pytest.mark.parametrize("name", ["fkm", "fkm_stick", "fkm_exact_arm", "fkm_sliding"])
def test_a_tension_beyond_all_bounds_names_its_row(name):
    """50 N on a robot made for 0.5 N is refused at the row where no posture balances it."""
    with pytest.raises(InputError, match=r"^row 2 \(time_s = 1\): static model") as error:
        STATIC_MODELS[name].solve(section(), single(0.1, 50.0), NO_GRAVITY)
    assert "\n" not in str(error.value)
