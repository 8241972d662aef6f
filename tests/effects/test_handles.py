"""Where a kind says that causes act: the places are numbers of its robots, and the effects reach them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from catheter_sim.catalogue import ROBOTS, load_robot
from catheter_sim.core.document import from_file, number, number_at, si_of, with_number, with_values
from catheter_sim.core.effect import Role
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import causes_same_as, with_built_in_effects, with_effects
from catheter_sim.effects.shared import places
from catheter_sim.robots import kind_of

NO_NUMBERS = (Role.TIP_FORCE, Role.ELEMENT_TURN)  # of the inputs and of the shape
# Of every kind, what a cause acts on there: effect, parameter and value, the role, and the number before
# and after in the file's unit.
ACTS = [
    ("neuroendoscope", "stiffness", "scale", 1.5, Role.ELASTIC_SCALE, lambda now: 1.5 * now),
    ("chest_tube", "stiffness", "scale", 1.5, Role.ELASTIC_SCALE, lambda now: 1.5 * now),
    ("mitral_4dof", "stiffness", "scale", 1.5, Role.ELASTIC_SCALE, lambda now: 1.5 * now),
    ("neuroendoscope", "tendon_friction", "mu", 0.17, Role.FRICTION, lambda now: 0.17),
    ("chest_tube", "tendon_friction", "mu", 0.17, Role.FRICTION, lambda now: 0.17),
    ("mitral_4dof@elongation", "tendon_friction", "mu", 0.17, Role.FRICTION, lambda now: 0.17),
    ("mitral_4dof@elongation", "tendon_friction", "path_deg", 90.0, Role.PATH, lambda now: now + 90.0),
    ("neuroendoscope", "nonlinear_stiffness", "cubic_mm2", 30.0, Role.CUBIC, lambda now: now + 30.0),
    ("chest_tube", "nonlinear_stiffness", "cubic_mm2", 30.0, Role.CUBIC, lambda now: now + 30.0),
    ("spacer_disk", "twist", "rate_deg_per_m", 20.0, Role.HOLE_TWIST, lambda now: now + 20.0),
    ("neuroendoscope", "axial_compression", "stiffness_N_per_mm", 9.0, Role.MOUNT, lambda now: 9.0),
    ("chest_tube", "axial_compression", "stiffness_N_per_mm", 9.0, Role.MOUNT, lambda now: 9.0),
    ("mitral_4dof", "tendon_elongation", "stiffness_N_per_mm", 9.0, Role.TENDON_STIFFNESS, lambda now: 9.0),
    ("mitral_4dof", "tendon_elongation", "cyclic_length_mm", 300.0, Role.TENDON_LENGTH, lambda now: 300.0),
    ("mitral_4dof", "backlash", "slack_bending_distal_mm", 0.4, Role.SLACK, lambda now: now + 0.4),
    ("mitral_4dof", "payload", "mass_g", 3.0, Role.TIP_MASS, lambda now: now + 3.0),
    ("mitral_transseptal@tube", "payload", "mass_g", 3.0, Role.TIP_MASS, lambda now: now + 3.0),
    ("mitral_4dof", "precurvature", "bending_distal_deg", 4.0, Role.REST_BEND, lambda now: now + 4.0),
    ("mitral_4dof", "precurvature", "curvature_y_per_m", 4.0, Role.REST_CURVATURE, lambda now: now + 4.0),
    ("spacer_disk", "precurvature", "curvature_y_per_m", 4.0, Role.REST_CURVATURE, lambda now: now + 4.0),
    ("chest_tube", "precurvature", "curvature_x_per_m", 4.0, Role.REST_CURVATURE, lambda now: now + 4.0),
]


def of(reference: str) -> RobotSpec:
    return load_robot(reference)


@pytest.mark.parametrize("reference", ROBOTS)
def test_every_place_is_a_number_of_the_robot(reference: str) -> None:
    """Its key leads to the number that the robot's file has there; no place is listed twice under a name."""
    robot = of(reference)
    handles = kind_of(robot).handles.handles(robot)
    for item in handles:
        if item.role in NO_NUMBERS:
            continue
        in_file = number_at(robot, item.key)
        assert from_file(robot, item.key, in_file) == pytest.approx(number(robot, item.key), rel=1e-12)
        changed = with_values(robot, {item.key: from_file(robot, item.key, 1.25)})
        assert changed == with_number(robot, item.key, 1.25)
        assert set(item.along) <= {item.key.rpartition(".")[0] + ".law"}
    assert len({(item.role, item.key, item.parameter) for item in handles}) == len(handles)


@pytest.mark.parametrize("reference", ROBOTS)
def test_only_what_a_cause_names_moves(reference: str) -> None:
    """Without values an effect leaves the robot as it is; a wrong key is no place."""
    robot = of(reference)
    nothing = {name: {} for name, effect in EFFECTS.items() if effect.parameters(robot)}
    assert with_built_in_effects(with_effects(robot, nothing)) == robot
    for key in ("friction.my", "segments.nowhere.length_mm", "tendons"):
        with pytest.raises((KeyError, TypeError)):
            number(robot, key)


@pytest.mark.parametrize(("reference", "effect", "parameter", "value", "role", "expected"), ACTS)
def test_a_cause_acts_at_the_places_of_its_role(
    reference: str, effect: str, parameter: str, value: float, role: Role, expected
) -> None:
    """The numbers of the role are what the cause makes of them, and no others have changed."""
    robot = of(reference)
    if parameter == "stiffness_N_per_mm":  # in series with what gives way already: nothing here
        rigid = {item.key: math.inf for item in places(robot, role)}
        robot = with_values(robot, rigid)
    built = with_built_in_effects(with_effects(robot, {effect: {parameter: value}}))
    named = [item for item in places(robot, role) if item.parameter in ("", parameter)]
    assert named
    back = {}
    for item in named:
        now = number_at(robot, item.key)
        assert number_at(built, item.key) == pytest.approx(expected(now), rel=1e-12)
        back[item.key] = number(robot, item.key)
        for key in item.along:
            head, name, leaf = key.split(".")
            back[key] = next(getattr(part, leaf) for part in getattr(robot, head) if part.name == name)
    assert with_values(built, back) == replace(robot, effects={})


def test_many_numbers_of_one_robot_change_at_once() -> None:
    """Numbers of the robot itself, of what it holds and of its parts, each in its own unit."""
    robot = of("mitral_4dof")
    pair = robot.tendons[0].name
    changed = with_values(
        robot,
        {
            "stiffness_scale": 2.0,
            "friction.mu": 0.3,
            f"tendons.{pair}.play_mm": 1e-3,
            f"tendons.{pair}.law": "uhmwpe",
            "segments.bending_distal.rest_deg": 0.1,
        },
    )
    assert (changed.stiffness_scale, changed.friction.mu) == (2.0, 0.3)
    assert (changed.tendons[0].play_m, changed.tendons[0].law) == (1e-3, "uhmwpe")
    assert changed.tendons[1:] == robot.tendons[1:]
    assert number(changed, "segments.bending_distal.rest_deg") == 0.1
    assert si_of(robot, "segments.bending_distal.rest_deg", 180.0) == math.pi


@pytest.mark.parametrize(
    ("reference", "key", "causes"),
    [
        ("spacer_disk", "friction.mu", ("tendon_friction",)),
        ("chest_tube_section", "passive_rods", ("stiffness",)),
        ("spacer_disk", "stiffness_scale", ("stiffness",)),
        ("spacer_disk", "tendons.1.stiffness_N_per_mm", ("tendon_elongation",)),
        ("mitral_4dof", "tendons.torsion.stiffness_N_per_mm", ("tendon_elongation",)),
        ("mitral_4dof", "tendons.torsion.play_mm", ()),
        ("chest_tube_section", "mount.axial_stiffness_N_per_mm", ("axial_compression",)),
        ("spacer_disk", "segments.proximal.rest_curvature_y_per_m", ("precurvature",)),
        ("spacer_disk", "segments.proximal.length_mm", ()),
    ],
)
def test_a_calibrated_number_is_a_cause_already(reference: str, key: str, causes: tuple[str, ...]) -> None:
    """Which causes are not tried beside the calibration of a number, by what the number is."""
    robot = of(reference)
    if key == "passive_rods":
        key = f"passive_rods.{robot.passive_rods[0].name}.bending_stiffness_N_mm2"  # type: ignore[attr-defined]
    names = [segment.name for segment in robot.segments]
    key = key if "proximal" not in key or "proximal" in names else key.replace("proximal", names[0])
    assert causes_same_as(robot, [key]) == causes


@pytest.mark.parametrize("reference", ROBOTS)
def test_every_kind_says_what_bends_it(reference: str) -> None:
    """Finite sizes above zero, and one mover for each input channel."""
    robot = of(reference)
    face = kind_of(robot).handles
    sizes = face.sizes(robot)
    for value in (sizes.length_m, sizes.tip_force_N, sizes.tension_N, sizes.curvature_per_m):
        assert 0.0 < value < math.inf
    movers = face.movers(robot)
    assert len({item.channel for item in movers}) == len(movers)


def test_loads_on_catheters_are_offered_where_their_statics_carry_them() -> None:
    """In space, and as a mass; not beside laws that were measured. The sizes are finite forces."""
    for reference, names in (
        ("mitral_transseptal", ["force_x_N", "force_y_N", "force_z_N"]),
        ("mitral_transseptal@tube", ["force_x_N", "force_y_N", "force_z_N"]),
        ("mitral_4dof", ["force_x_N", "force_y_N", "force_z_N"]),
        ("mitral_4dof@elongation", []),
        ("mitral_4dof@measured", []),
    ):
        robot = of(reference)
        assert [item.parameter for item in places(robot, Role.TIP_FORCE)] == names
        assert len(places(robot, Role.TIP_MASS)) == bool(names)
        unit = kind_of(robot).handles.sizes(robot).tip_force_N
        assert 0.01 < unit < 1.0
