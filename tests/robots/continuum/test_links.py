"""A chain of links is as good as the rod that it stands for, and says how good."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot, robot_toml, robots_of
from catheter_sim.cli.main import main
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import Friction
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.defaults import LARGEST_ERROR, tip_error_m, with_enough_links
from catheter_sim.robots.continuum.description import hinge_places, links
from catheter_sim.robots.continuum.picture import element_meshes
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import twin_for

EI_N_M2, GJ_N_M2 = 0.00424, 0.00326


def own(segments: int = 2, disks: int = 10, length_m: float = 0.05, radius_m: float = 8e-3) -> ContinuumRobot:
    """Return a robot of equal segments, each with a tendon at +x and one at -x."""
    names = [f"s{k}" for k in range(segments)]
    return ContinuumRobot(
        name="own",
        description="",
        segments=tuple(
            Segment(name, length_m, disks, 1.2 * radius_m, EI_N_M2, 2e-3, torsion_stiffness_N_m2=GJ_N_M2)
            for name in names
        ),
        tendons=tuple(
            Tendon(f"{name}{side}", radius_m, angle, name)
            for name in names
            for side, angle in (("p", 0.0), ("m", math.pi))
        ),
        friction=Friction(0.0),
    )


def pulled(robot: ContinuumRobot, turn_rad: float = 0.5 * math.pi) -> Inputs:
    """Return the tension on the tip's tendon at +x that bends each segment by about `turn_rad`."""
    segment, tendon = robot.segments[-1], robot.tendons[-2]
    h, turn = segment.length_m / segment.disks, turn_rad / segment.disks
    tension = np.zeros((1, len(robot.tendons)))
    # Of arcs: EI t / h = T (r cos(t / 2) - c'(t)), c' = -h t / 12.
    tension[0, -2] = EI_N_M2 * turn / h / (tendon.radius_m * math.cos(0.5 * turn) + h * turn / 12.0)
    return Inputs(np.zeros(1), "tension", tension, np.zeros((1, 3)), np.zeros((1, 3)))


def away_from_the_rod_m(robot: ContinuumRobot, gravity: tuple[float, ...] = (0.0, 0.0, 0.0)) -> float:
    """Return how far the simulated tip is from the rod model's, under the tension of `pulled`."""
    inputs, simulator = pulled(robot), Simulator(robot, gravity_mps2=gravity, inertia=False)
    simulator.set_inputs(inputs.tendon[0])
    assert simulator.settle(60.0)
    simulator.step(100)
    (rod,) = STATIC_MODELS["VC_ref_noproj"].solve(robot, inputs, np.array(gravity)).postures
    return float(np.linalg.norm(simulator.posture().p_w[-1] - rod.p_w[-1]))


@pytest.mark.slow
@pytest.mark.xdist_group("tdcr")
@pytest.mark.parametrize(
    ("segments", "disks", "length_m", "radius_m"),
    [(1, 10, 0.05, 8e-3), (2, 10, 0.05, 8e-3), (2, 5, 0.05, 8e-3), (3, 10, 0.06, 4.5e-3), (1, 20, 0.1, 4e-3)],
)
def test_the_estimate_is_the_simulations_error(
    segments: int, disks: int, length_m: float, radius_m: float
) -> None:
    """Against the rod model: one and two links, both ways to place hinges, within a fifth."""
    robot, length = own(segments, disks, length_m, radius_m), segments * length_m
    for count, hinges in ((1, "even"), (2, "even"), (2, "rod"), (3, "rod")):
        chain = replace(robot, links_per_subsegment=count, hinges=hinges)
        error = away_from_the_rod_m(chain)
        assert tip_error_m(chain) == pytest.approx(error, rel=0.2, abs=1e-5 * length), (count, hinges)
    # Across its weight: the same error of the chain, but that the rod model's weight is at its disks alone.
    for count in (1, 2):
        error = away_from_the_rod_m(replace(robot, links_per_subsegment=count), (9.81, 0.0, 0.0))
        assert 0.5 < tip_error_m(replace(robot, links_per_subsegment=count)) / error < 2.0
    enough = with_enough_links(robot)
    assert away_from_the_rod_m(enough) < LARGEST_ERROR * length
    assert away_from_the_rod_m(enough, (9.81, 0.0, 0.0)) < LARGEST_ERROR * length
    assert away_from_the_rod_m(robot) > 10.0 * LARGEST_ERROR * length  # one link each, as before


def test_hinges_that_bend_as_a_rod_keep_the_rods_length() -> None:
    """The variance of the turn along a subsegment is an arc's 1/12; with even links it is more by 2/n^2."""
    for count in (2, 3, 4, 7):
        for hinges, wanted in (("rod", 1.0 / 12.0), ("even", (1.0 + 2.0 / count**2) / 12.0)):
            robot = replace(own(), links_per_subsegment=count, hinges=hinges)
            places = [0.0, *hinge_places(robot), 1.0]
            share, turn = np.diff(places), np.arange(count + 1) / count
            assert share.min() > 0.0
            assert (share * turn).sum() == pytest.approx(0.5, abs=1e-12)
            assert (share * turn**2).sum() - 0.25 == pytest.approx(wanted, abs=1e-12)


def test_links_lie_where_hinges_do() -> None:
    """Two hinges at a sixth and five sixths of each subsegment; disks stay where they were."""
    robot = replace(own(1, 4), links_per_subsegment=2, hinges="rod")
    chain, even = links(robot), links(replace(robot, hinges="even"))
    h = 0.05 / 4
    expected = [h * (k + place) for k in range(4) for place in (1 / 6, 5 / 6)]
    assert [link.hinge_z_m for link in chain] == pytest.approx(expected, abs=1e-15)
    assert [link.face_z_m for link in chain] == [link.face_z_m for link in even]
    assert [link.disk for link in chain] == [link.disk for link in even]
    one = replace(own(), hinges="rod")
    assert links(one) == links(own())  # a single hinge has one place


def test_drawn_rods_reach_from_hinge_to_hinge() -> None:
    """Base, within, across a disk, tip: the stretches that are drawn add up to the robot."""
    for count, hinges in ((2, "rod"), (3, "rod"), (3, "even")):
        robot = replace(own(1, 4), links_per_subsegment=count, hinges=hinges)
        high = {key: mesh.bounds[:, 2] for key, mesh in element_meshes(robot).items()}
        base, tip = -high["backbone.base"][0], high["backbone.tip"][1]
        across = high["backbone_s0"][1]
        within = high["backbone_s0.within"][1] if hinges == "rod" else across
        drawn = base + tip + 3 * across + 4 * (count - 1) * within
        dome = 4 * count * (high["backbone.tip"][1] - base)  # rods end in a dome
        assert drawn == pytest.approx(0.05 + dome, abs=1e-4)


def test_the_default_keeps_the_error_below_a_thousandth(tmp_path: Path) -> None:
    """Of files that do not say their links: two for a usual robot, more only for few disks; rods by name."""
    for robot, count in ((own(), 2), (own(3, 10, 0.06, 4.5e-3), 2), (own(2, 3), 3)):
        path = tmp_path / "own.toml"
        path.write_text(without_links(robot))
        read = load_robot(path)
        assert isinstance(read, ContinuumRobot)
        assert (read.links_per_subsegment, read.hinges) == (count, "rod")
        length = sum(segment.length_m for segment in read.segments)
        assert 0.0 < tip_error_m(read) <= LARGEST_ERROR * length
        assert tip_error_m(replace(read, links_per_subsegment=1)) > 10.0 * LARGEST_ERROR * length


def without_links(robot: ContinuumRobot) -> str:
    lines = robot_toml(robot).splitlines()
    return "\n".join(line for line in lines if not line.startswith(("links_per_subsegment", "hinges")))


def test_whoever_says_a_number_keeps_it(tmp_path: Path) -> None:
    """In the file, by a setting, or as a published robot; other settings are in force when it is chosen."""
    path = tmp_path / "own.toml"
    path.write_text(robot_toml(own()))
    assert load_robot(path) == own()
    path.write_text(without_links(own()))
    stated = load_robot(path, ["links_per_subsegment=1"])
    assert (stated.links_per_subsegment, stated.hinges) == (1, "even")
    assert load_robot(path, ["disks_per_segment=3"]).links_per_subsegment == 3
    for name in ("neuroendoscope", "neuroendoscope_section", "spacer_disk"):
        read, made = load_robot(name), robots_of("continuum")[name]()
        assert isinstance(read, ContinuumRobot)
        assert (read.links_per_subsegment, read.hinges) == (made.links_per_subsegment, "even")


def test_a_cell_is_one_flexure(tmp_path: Path) -> None:
    """A robot of cells is its own chain: one link each, and no error of discretisation."""
    robot = replace(own(), appearance="wire_guides")
    (tmp_path / "own.toml").write_text(without_links(robot))
    assert load_robot(tmp_path / "own.toml") == robot
    assert tip_error_m(robot) == 0.0


def test_links_are_never_more_than_can_be_built() -> None:
    """A robot whose disks alone are as many as there may be links keeps one each."""
    robot = own(1, 1500, 0.05, 1e-5)
    assert with_enough_links(robot).links_per_subsegment == 1


def test_unknown_hinges_name_the_choices() -> None:
    """One line."""
    with pytest.raises(InputError, match="unknown hinges 'gauss'; choices: even, rod"):
        load_robot("spacer_disk", ["hinges=gauss"])


@pytest.mark.slow
def test_build_says_how_good_the_chain_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Links, error in mm and in percent; nothing of it for cells."""
    (tmp_path / "own.toml").write_text(without_links(own()))
    assert main(["build", str(tmp_path / "own.toml"), "-o", str(tmp_path / "m.xml")]) == 0
    said = capsys.readouterr().out.splitlines()[1]
    assert said == (
        "links: 2 per subsegment, 40 in all; with every segment bent by 90 deg by its tendons alone "
        "the tip is 0.0021 mm (0.002 % of the length) off a rod's"
    )
    assert main(["build", "neuroendoscope_section", "-o", str(tmp_path / "m.xml")]) == 0
    assert "links:" not in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("axes", ["x", "xy"])
def test_the_diagnosis_twin_stands_for_the_chain_of_the_default(axes: str) -> None:
    """Also of a robot that bends in a plane: its twin is no model of cells; within 0.2 %."""
    robot = own()
    segments = tuple(
        replace(item, bending_axes=axes, torsion_stiffness_N_m2=math.inf) for item in robot.segments
    )
    robot = with_enough_links(replace(robot, segments=segments))
    inputs, columns = pulled(robot, math.pi / 3.0), ["tip_x_mm", "tip_z_mm"]
    twin = twin_for(robot, "tension", columns, np.zeros(3))([robot], inputs, 1)[0, 0]
    posture = simulate(robot, inputs, np.zeros(3)).postures[0]
    assert twin == pytest.approx(posture.p_w[-1, [0, 2]] * 1e3, abs=0.2)
