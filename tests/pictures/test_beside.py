"""What stands beside the robot hides none of it; tendons of one hole, measured points, a joint's profile."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import mujoco
import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import RobotSpec
from catheter_sim.modelling.build import FOVY_DEG, View, remembered_mjcf
from catheter_sim.pictures import offscreen
from catheter_sim.pictures.beside import (
    GHOST_POINTS,
    Item,
    MeasuredPoints,
    free_place,
    free_places,
    ghost_line,
)
from catheter_sim.pictures.images import (
    MEASURED,
    Picture,
    PinholeCamera,
    Place,
    caption_size,
    legend_size,
    project,
    projection_matrix,
    pulled_tendons,
    round_end,
    scale_size,
)
from catheter_sim.pictures.offscreen import CAPTION, INSET, LEGEND, SCALE, DrawnState, Look
from catheter_sim.robots import kind_of

BENT = {
    "neuroendoscope_section": {"tension_right_N": 0.3},
    "chest_tube_section": {"tension_active_N": 24.0},
    "spacer_disk": {"tension_1_N": 2.0, "tension_3_N": 1.0},
}
SIZES = [(1000, 750), (400, 300)]
PLAIN = Look()


@cache
def held(name: str) -> tuple[RobotSpec, tuple[DrawnState, ...]]:
    """Return a robot, at rest and bent as `BENT` says."""
    robot = load_robot(name)
    run = cs.simulate(
        robot, {"time_s": [0.0, 1.0], **{key: [0.0, value] for key, value in BENT[name].items()}}
    )
    return robot, run.states


def model_of(robot: RobotSpec) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(remembered_mjcf(robot, "tension"))


Seen = list[tuple[Picture, Any]]


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Seen:
    """Keep each picture as it is before anything is written on it, and where things are to stand."""
    found: Seen = []
    finish = offscreen._finished

    def kept(image: Picture, layout: Any, caption: Any) -> Picture:
        found.append((image.copy(), layout))
        return finish(image, layout, caption)

    monkeypatch.setattr(offscreen, "_finished", kept)
    return found


def drawn(
    name: str,
    size: tuple[int, int],
    look: Look = PLAIN,
    state: Callable[[DrawnState], DrawnState] = lambda it: it,
) -> Picture:
    robot, states = held(name)
    words = [["t = 1.00 s", "tension 1 2.00 N"]]
    (image,) = offscreen.draw(robot, model_of(robot), [state(states[-1])], words, *size, look)
    return image


def box(image: Picture, place: Place, size: tuple[int, int]) -> Picture:
    return image[place[1] : place[1] + size[1], place[0] : place[0] + size[0]]


def empty(part: Picture) -> bool:
    """Return whether each row of a part of a picture shows the even background alone."""
    return bool(np.ptp(part.astype(int), axis=1).max() <= 12)


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", BENT)
def test_nothing_that_stands_beside_hides_a_pixel_of_the_robot(
    seen: Seen, name: str, size: tuple[int, int]
) -> None:
    """Boxes of the words, the scale and the tensions show the background alone; the middle shows more."""
    drawn(name, size)
    ((image, layout),) = seen
    height = size[1]
    sizes = {
        CAPTION: caption_size(["t = 1.00 s", "tension 1 2.00 N"], height),
        LEGEND: legend_size(height),
        SCALE: scale_size(height),
    }
    assert set(layout.places) == {*sizes, INSET}
    for item, extent in sizes.items():
        assert empty(box(image, layout.places[item], extent)), item
    assert not empty(image)


def test_room_is_found_near_a_corner_and_nowhere_else_than_on_free_pixels() -> None:
    """With the wanted corner taken, what needs room goes along an edge; a picture that is full has none."""
    taken = np.zeros((100, 200), bool)
    item = Item("any", (40, 20), (1, 1))
    assert free_place(taken, item) == (160, 80)
    taken[95, 195] = True
    left, top = free_place(taken, item) or (-1, -1)
    assert not taken[top : top + 20, left : left + 40].any()
    assert 0 in (left, top) or left + 40 == 200 or top + 20 == 100
    taken[::10, ::10] = True
    assert free_place(taken, item) is None
    assert free_place(np.zeros((10, 200), bool), item) is None


def test_what_finds_room_takes_it_from_what_comes_after() -> None:
    """Two that want one corner stand apart; a third that is too large is left out."""
    items = [Item("one", (40, 20), (0, 0)), Item("two", (40, 20), (0, 0)), Item("three", (180, 90), (0, 0))]
    places = free_places(np.zeros((100, 200), bool), items)
    assert set(places) == {"one", "two"}
    (left, top), (other_left, other_top) = places["one"], places["two"]
    assert abs(left - other_left) >= 40 or abs(top - other_top) >= 20


@pytest.mark.slow
def test_a_picture_without_room_says_what_it_leaves_out() -> None:
    """Of 64 pixels a side it keeps the robot alone; of 1000 it leaves out nothing."""
    robot, states = held("spacer_disk")
    left_out: list[str] = []
    for side in (64, 1000):
        list(
            offscreen.draw(
                robot, model_of(robot), states[-1:], [["t"]], side, side, on_left_out=left_out.extend
            )
        )
        if side == 64:
            assert LEGEND in left_out
            left_out.clear()
    assert left_out == []


def colours(image: Picture) -> tuple[int, int]:
    """Return how many pixels are red, and how many yellow."""
    red, green, blue = (image[:, :, k].astype(int) for k in range(3))
    warm = red - blue > 40
    return int((warm & (red - green > 60)).sum()), int((warm & (red - green < 40)).sum())


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES)
def test_tendons_of_one_hole_are_both_seen(monkeypatch: pytest.MonkeyPatch, size: tuple[int, int]) -> None:
    """2 N is red, 1 N yellow; drawn one over the other, the red one is hidden where they share holes."""
    look = Look(legend=False)
    red, yellow = colours(drawn("spacer_disk", size, look))
    assert min(red, yellow) > 20
    monkeypatch.setattr(
        offscreen, "pulled_tendons", lambda *given: replace(pulled_tendons(*given), groups=())
    )
    assert colours(drawn("spacer_disk", size, look))[0] < 0.2 * red


def test_tendons_that_share_holes_are_found() -> None:
    """The spacer-disk robot's first and third, second and fourth; none of the neuroendoscope's."""
    robot = load_robot("spacer_disk")
    assert set(pulled_tendons(model_of(robot), robot).groups) == {(0, 2), (1, 3)}
    other = load_robot("neuroendoscope_section")
    assert pulled_tendons(model_of(other), other).groups == ()


@pytest.mark.slow
def test_tendons_without_tension_have_no_colour() -> None:
    """The file's own colours, red and blue, are not shown: they would be read as tension."""
    robot, states = held("spacer_disk")
    rest = replace(states[0], tension=tuple(0.0 * row for row in states[0].tension))
    for state in (rest, replace(rest, tension=())):
        (image,) = offscreen.draw(
            robot, model_of(robot), [state], [()], 600, 450, Look(legend=False), close_up=False
        )
        assert int((image[..., 0].astype(int) - image[..., 2]).max()) < 10


@pytest.mark.parametrize(
    ("largest", "end"), [(0.383, 0.5), (2.0, 2.0), (2.004, 2.0), (2.1, 5.0), (56.8, 100.0), (0.0999, 0.1)]
)
def test_colours_end_at_a_round_tension(largest: float, end: float) -> None:
    """1, 2 or 5 times a power of ten, at most a step of the colours below the largest tension."""
    assert round_end(largest) == pytest.approx(end)


def test_the_inputs_are_those_of_the_channels_that_change() -> None:
    """A channel that stays 0 has no line."""
    robot = load_robot("spacer_disk")
    inputs = cs.simulate(robot, {"time_s": [0.0], "tension_3_N": [1.0]}).inputs
    assert offscreen.caption(robot, inputs, 0) == ["t = 0.00 s", "tension 3 1.00 N"]
    loaded = replace(inputs, force_tip=np.array([[-0.02, 0.0, 0.0]]))
    assert offscreen.caption(robot, loaded, 0)[-1] == "force tip x -0.02 N"
    many = replace(loaded, moment_tip=np.ones((1, 3)), bodies=(1, 2), force_body=np.ones((1, 2, 3)))
    many = replace(many, moment_body=np.zeros((1, 2, 3)))
    said = offscreen.caption(robot, many, 0)
    assert (len(said), said[-1]) == (10, "and 3 more")


def pinhole(view: View, size: tuple[int, int]) -> PinholeCamera:
    right, up = view.axes
    axes = np.column_stack([right, up, view.backward])
    return PinholeCamera(view.position, axes, math.radians(FOVY_DEG), *size)


def balls(image: Picture) -> np.ndarray:
    """Return which pixels are blue as a measured point, thin lines eroded away."""
    share = image / np.maximum(image.max(axis=-1, keepdims=True), 1.0)
    wanted = np.asarray(MEASURED[:3]) / max(MEASURED[:3])
    blue = (np.abs(share - wanted) < 0.2).all(axis=-1) & (image.max(axis=-1) > 60)
    for axis in (0, 1):
        for _ in range(2):
            blue = blue & np.roll(blue, 1, axis) & np.roll(blue, -1, axis)
    return blue


@pytest.mark.slow
def test_a_measured_tip_is_a_ball_where_it_is_projected(seen: Seen) -> None:
    """Within 1.5 pixels; a line leads there from the computed tip."""
    tip = np.array([[-0.02, 0.004, 0.09]])

    def measured(state: DrawnState) -> DrawnState:
        return replace(state, points=tip, point_names=("tip",))

    size = (1000, 750)
    image = drawn("spacer_disk", size, Look(legend=False), measured)
    ((_, layout),) = seen
    expected = project(projection_matrix(pinhole(layout.view, size)), tip)[0]
    found = np.argwhere(balls(image))[:, ::-1].mean(axis=0) + 0.5
    assert np.linalg.norm(found - expected) < 1.5
    robot, states = held("spacer_disk")
    model, data = model_of(robot), mujoco.MjData(model_of(robot))
    offscreen.put(states[-1], model, data)
    start = project(projection_matrix(pinhole(layout.view, size)), data.site("tip").xpos[np.newaxis])[0]
    middle = (0.5 * (start + expected)).astype(int)
    around = image[middle[1] - 3 : middle[1] + 4, middle[0] - 3 : middle[0] + 4].astype(int)
    assert (around[..., 2] - around[..., 0]).max() > 80


def test_a_ghost_goes_through_measured_bodies_and_needs_several() -> None:
    """It starts at the base along z and meets each point, in their order along the robot; a tip has none."""
    names = ("tip", "body_10", "marker_a", "body_5")
    points = np.array([[0.02, 0.0, 0.09], [0.008, 0.0, 0.06], [0.5, 0.5, 0.5], [0.001, 0.0, 0.03]])
    line = ghost_line(names, points)
    assert np.abs(line[0]).max() == 0.0
    assert line[1, 2] > 20.0 * np.abs(line[1, :2]).max()
    nearest = [np.linalg.norm(line - points[index], axis=1) for index in (3, 1, 0)]
    assert [float(distance.min()) for distance in nearest] == pytest.approx([0.0] * 3, abs=1e-9)
    assert np.all(np.diff([int(distance.argmin()) for distance in nearest]) > 0)
    assert ghost_line(names[:1], points[:1]).shape == (0, 3)
    missing = points.copy()
    missing[3] = np.nan
    assert len(ghost_line(names, missing)) == 0
    said = MeasuredPoints(names, points[np.newaxis]).words()
    assert GHOST_POINTS == 3
    assert "see-through robot" in said
    assert "see-through" not in MeasuredPoints(("tip",), points[np.newaxis, :1]).words()


@pytest.mark.slow
def test_a_ghost_is_seen_through_beside_the_robot() -> None:
    """Measured bodies 20 mm aside give a pale blue band there; two of them give none."""
    names = ("body_5", "body_10", "body_15", "tip")
    line = np.array([[0.02, 0.0, z] for z in (0.03, 0.05, 0.07, 0.09)])
    look = Look("side", legend=False)

    def pale(chosen: slice) -> int:
        image = drawn(
            "spacer_disk",
            (400, 300),
            look,
            lambda it: replace(it, points=line[chosen], point_names=names[chosen]),
        ).astype(int)
        return int(((image[..., 2] - image[..., 0] > 45) & (image[..., 0] > 110)).sum())

    assert pale(slice(None)) > 1500
    assert pale(slice(2, None)) < 100


@pytest.mark.parametrize("name", ["chest_tube_section", "chest_tube"])
def test_the_close_up_shows_the_joint_that_turned_most_with_its_two_arcs(name: str) -> None:
    """Each arc has its radius; the arcs touch the flat face of the link below and do not enter it."""
    robot = load_robot(name)
    model = model_of(robot)
    data = mujoco.MjData(model)
    angles = np.zeros(model.nq)
    angles[3] = -0.1
    data.qpos[:] = angles
    mujoco.mj_forward(model, data)
    shown = kind_of(robot).profile.close_up(robot, model, data, angles)
    assert shown.words[0] == "joint 4"
    (larger, _), (smaller, _), (flat, _) = shown.lines
    radii = sorted(circle_radius_m(points) for points in (larger, smaller))
    segment = robot.segments[0]
    assert radii == pytest.approx(sorted({segment.smaller_radius_m, segment.larger_radius_m}), rel=1e-3)
    along = np.cross(shown.across, flat[1] - flat[0])
    along *= np.sign(along[2]) / np.linalg.norm(along)
    heights = (np.concatenate([larger, smaller]) - flat[0]) @ along
    assert abs(float(heights.min())) < 0.05e-3 + 0.1 * 0.1 * max(radii)  # hinges at the first contact
    assert heights.max() > 0.3e-3


def circle_radius_m(points: np.ndarray) -> float:
    """Return the radius of the circle through the first, middle and last of `points` [m]."""
    a, b, c = points[0], points[len(points) // 2], points[-1]
    sides = [float(np.linalg.norm(one - two)) for one, two in ((a, b), (b, c), (c, a))]
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a)))
    return math.prod(sides) / (4.0 * area)


@pytest.mark.slow
def test_rolled_arcs_touch_the_face_below_and_the_inset_shows_them(seen: Seen) -> None:
    """Simulated at 24 N: the gap closes in a point, to 10 micrometres; the inset has both arcs' colours."""
    robot, states = held("chest_tube_section")
    model = model_of(robot)
    data = mujoco.MjData(model)
    offscreen.put(states[-1], model, data)
    shown = kind_of(robot).profile.close_up(robot, model, data, states[-1].qpos)
    flat = shown.lines[2][0]
    along = np.cross(flat[1] - flat[0], shown.across)
    along *= np.sign(along[2]) / np.linalg.norm(along)
    heights = (np.concatenate([points for points, _ in shown.lines[:2]]) - flat[0]) @ along
    assert abs(float(heights.min())) < 1e-5
    for inset in (True, False):
        seen.clear()
        drawn("chest_tube_section", (1000, 750), Look(inset=inset))
        ((image, layout),) = seen
        assert (INSET in layout.places) == inset
        red, green, blue = (image[..., k].astype(int) for k in range(3))
        purple = (np.minimum(red, blue) - green > 35).sum()
        dark_green = ((green - red > 40) & (green > blue)).sum()
        assert (purple > 60, dark_green > 60) == (inset, inset)
