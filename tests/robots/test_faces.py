"""Every face of every kind answers, in the shapes that the protocols promise, and the answers agree.

That a face has every function of its protocol, mypy checks (in each kind's `__init__`).
"""

from __future__ import annotations

import importlib
import math
import pickle

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import PUBLISHED, load_robot
from catheter_sim.channels import output_channels
from catheter_sim.core.document import number_at
from catheter_sim.core.inputs import Quantity, shares, sums
from catheter_sim.core.kind import Kind
from catheter_sim.core.law import Law, RobotInModel
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.robots import KINDS, face_of, kind_of
from catheter_sim.simulation.copies import copied_together
from catheter_sim.simulation.simulator import Simulator

ROBOTS = ("spacer_disk", "neuroendoscope", "chest_tube", "mitral_transseptal", "mitral_4dof", "notched_wrist")
EVERY = [pytest.param(load_robot(name), id=name) for name in PUBLISHED]


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_kind_has_its_name_its_robots_and_can_be_pickled(kind: Kind[RobotSpec]) -> None:
    """A kind's robots are of its class; a process that gets a kind gets the same one."""
    assert pickle.loads(pickle.dumps(kind)) is importlib.import_module(kind.package).KIND
    assert kind.package.endswith(kind.name)
    for item in kind.robots.PUBLISHED:
        assert type(item.build()) is kind.spec
        assert kind_of(item.build()) is kind
    for draw in kind.robots.DRAWN.values():
        assert type(draw(np.random.default_rng(1))[0]) is kind.spec


@pytest.mark.parametrize("robot", EVERY)
def test_drives_cover_every_tendon_once(robot: RobotSpec) -> None:
    """Each tendon has one drive, columns differ and carry their unit, and shares undo sums."""
    face = kind_of(robot).drives
    assert robot.actuation in face.actuations(robot)
    for actuation in face.actuations(robot):
        drives = face.drives(robot, actuation)
        covered = [index for drive in drives for index in drive.tendons]
        assert sorted(covered) == list(range(len(robot.tendons)))
        assert len({drive.column for drive in drives}) == len(drives)
        for drive in drives:
            assert drive.column.endswith("_N" if drive.quantity is Quantity.TENSION else "_mm")
            assert drive.channel in drive.column
            assert drive.moves in [segment.name for segment in robot.segments]
            assert math.hypot(*drive.side) == pytest.approx(1.0) or drive.side == (0.0, 0.0)
            assert drive.least <= 0.0 < drive.most
        there = shares(drives, len(robot.tendons))
        back = sums(drives, len(robot.tendons))
        assert np.allclose(there.T @ back, np.eye(len(drives)))


@pytest.mark.slow
@pytest.mark.parametrize("robot", EVERY)
def test_outputs_are_the_models(robot: RobotSpec) -> None:
    """The model has a face for each element, a joint of each name, an actuator for each tendon, first."""
    outputs = kind_of(robot).drives.outputs(robot)
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot))
    for number in range(1, outputs.elements + 1):
        assert model.site(f"face_{number}").id >= 0
    with pytest.raises(KeyError):
        model.site(f"face_{outputs.elements + 1}")
    assert model.site("tip").id >= 0
    joints = [model.joint(name).id for name in outputs.joints]
    swapped = ("continuum", "notched_tube")  # whose axes swap places; whose angles come axis by axis
    assert joints == sorted(set(joints)) or kind_of(robot).name in swapped
    for index, tendon in enumerate(robot.tendons):
        assert model.actuator(f"tendon_{tendon.name}").id == index
    assert set(outputs.tensions) <= set(range(len(robot.tendons)))
    shared = [index for part in outputs.angles.values() for index in range(len(outputs.joints))[part]]
    assert len(shared) == len(set(shared))
    assert len(output_channels(robot)) == len(set(output_channels(robot)))


@pytest.mark.slow
@pytest.mark.parametrize("robot", EVERY)
def test_laws_fit_the_model(robot: RobotSpec) -> None:
    """Controls are of actuators that are there, tendons and hinges that rub are those of the model."""
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot))
    place, face, tendons = RobotInModel(model), kind_of(robot).laws, len(robot.tendons)
    controls = face.controls(robot, place)
    assert controls.spans.shape == (tendons,)
    assert len(set(controls.actuators)) == len(controls.actuators) <= model.nu
    assert set(controls.pulls) <= set(controls.actuators)
    arriving = controls.arriving(np.zeros(tendons), np.zeros(tendons))
    assert not controls.controls(arriving).any()
    rest = controls.tension(np.zeros(model.nq), np.zeros(model.nu), np.zeros(len(controls.pulls)))
    assert rest.shape == (tendons,)
    assert all(isinstance(law, Law) for law in face.laws(robot, place))
    paths = face.tendon_paths(robot, place)
    assert len(paths.names) == len(paths.ends) == len(controls.pulls)
    pulled = [model.tendon(k).name for k in model.actuator_trnid[controls.pulls, 0]]
    assert paths.names == pulled, "in the order of the actuators that pull them"
    assert paths.ends.max() <= paths.spans
    assert max(paths.span_of_dof.values()) < paths.spans
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert paths.turns(data).shape == (len(paths.ends), paths.spans)
    for name in face.sliding_joints(robot):
        assert model.joint(name).id >= 0
    copied = kind_of(robot).batched
    if copied is not None and copied.covers(robot):
        assert (robot.friction.mu == 0 or copied.rubs(robot)) == copied_together(Simulator(robot))


@pytest.mark.parametrize("robot", EVERY)
def test_model_says_how_large_the_robot_is(robot: RobotSpec) -> None:
    """The straight robot is as long as its parts at least; the close-up lies on it."""
    face = kind_of(robot).model
    length = face.length_m(robot)
    middle, shown = face.close_up(robot)
    assert length >= sum(segment.length_m for segment in robot.segments) * (1.0 - 1e-12)
    assert 0.0 < middle < length
    assert 0.0 < shown <= 1.5 * length
    assert all("\n" not in line for line in face.remarks(robot))


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_what_is_drawn_is_there(name: str) -> None:
    """Parts name meshes that exist, geoms are called after them, and some lie about the robot's axis."""
    robot = load_robot(name)
    face = kind_of(robot).picture
    meshes = face.meshes(robot)
    model = mujoco.MjModel.from_xml_string(build_mjcf(robot))
    named = [model.geom(index).name for index in range(model.ngeom)]
    for element in range(2):
        for part in face.parts(robot, element):
            assert part.mesh_key in meshes
            assert f"{part.name_prefix}_{element}" in named
    assert any(text.startswith(tuple(f"{item}_" for item in face.CENTRELINE_PARTS)) for text in named)
    assert face.geom_places(robot, model) == pytest.approx(model.geom_pos)


@pytest.mark.parametrize("name", ROBOTS)
def test_quick_model_has_a_drive_for_each_input(name: str) -> None:
    """At rest the quick model stands on the axis; its drives' tendons are the robot's."""
    robot = load_robot(name)
    model = kind_of(robot).steering.quick_model(robot, robot.actuation, None)
    drives = model.drives
    count = len(drives.names)
    assert drives.tendon.shape == (len(robot.tendons), count)
    assert drives.lowest.shape == (count,)
    tips, _ = model.reach(np.zeros((1, count)), np.zeros(model.bend_unit.shape))
    assert np.abs(tips[0, :2]).max() < 1e-9
    slopes = model.tip_slopes(np.zeros(count), np.zeros(model.bend_unit.shape))
    assert slopes.shape == (3, count)
    assert np.isfinite(slopes).all()
    least, most = kind_of(robot).steering.input_range(robot)
    assert least.shape == most.shape == (len(robot.tendons),)
    assert (least < most).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_speed_case_moves_every_tendon(name: str) -> None:
    """Its inputs have a row for each level, rest among them, and none of the tendons is idle."""
    robot = load_robot(name)
    case = kind_of(robot).steering.speed_case(robot, 40)
    assert case.inputs.shape == (40, len(robot.tendons))
    assert (np.ptp(case.inputs, axis=0) > 0.0).all()
    assert case.inputs[0] == pytest.approx(np.zeros(len(robot.tendons)))
    assert case.links >= 1


def test_missing_face_is_one_line_that_names_who_has_it() -> None:
    """A kind without a face is refused by robot, kind and the kinds that have it."""
    robot = load_robot("chest_tube")
    assert not kind_of(robot).has("friction_tails")
    with pytest.raises(
        Exception, match="chest_tube: no such law for robots of kind 'rolling'; choices: contin"
    ):
        face_of(robot, "friction_tails", "such law")
    with pytest.raises(InputError, match=r"choices: \(none\)"):
        face_of(robot, "wings", "flight")


@pytest.mark.parametrize("name", PUBLISHED)
def test_uncertain_numbers_are_the_robots_own(name: str) -> None:
    """Every number that is calibrated of a specimen is one of the robot's, and above zero."""
    robot = PUBLISHED[name].build()
    for item in PUBLISHED[name].uncertain:
        assert 0.0 < item.half < 1.0
        for key in item.keys:
            assert number_at(robot, key) >= 0.0
