"""The render check passes every robot as it is, and fails one that is slightly wrong in any way."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import ROBOTS, load_robot
from catheter_sim.core.posture import Posture
from catheter_sim.errors import InputError
from catheter_sim.robots import kind_of
from catheter_sim.robots.catheter.description import elements, hinge_counts, hinge_heights_m, turning
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.validation import render
from catheter_sim.validation.render import (
    BODY,
    CASES,
    KINDS,
    MEAN_PX,
    STRIPE,
    WORST_PX,
    DrawnCase,
    Offsets,
    _painted,
    about,
    cameras,
    compare,
    draw,
    mm_per_px,
    off_axis_m,
    with_rigid_rings,
)

SHARE = 0.02  # of advance and bending, that must be noticed
FAR_M, FAR = 5e-3, 0.08  # out of plane, and at most so much of a small robot's length
TWIST_RAD = math.radians(10.0)  # of the tip about its own axis
CATHETERS = ("mitral_transseptal", "mitral_4dof")


@cache
def drawn(name: str) -> DrawnCase:
    """Return every second row of a robot's case as it is drawn."""
    return draw(replace(CASES[name], tendon=rows(name)))


def rows(name: str) -> np.ndarray:
    return CASES[name].tendon[1::2]


def of_each(names: Sequence[str]) -> list[object]:
    """Return parameters that one worker runs a robot of, so that each robot is drawn once."""
    return [pytest.param(name, marks=pytest.mark.xdist_group(f"drawn {name}")) for name in names]


@cache
def statics(name: str, stiffness_scale: float = 1.0) -> list[Posture]:
    """Return what the case's model makes of its rows, by a robot that is so much stiffer."""
    return CASES[name].statics(replace(drawn(name).robot, stiffness_scale=stiffness_scale), rows(name))


# Perturbations: what the check sees of a robot whose analytic side is wrong.

Wrong = Callable[[str], list[Offsets]]


def pulled(name: str, prefix: str) -> list[int]:
    """Return the places of the tendons whose names begin with `prefix`."""
    return [k for k, tendon in enumerate(drawn(name).robot.tendons) if tendon.name.startswith(prefix)]


def times(prefix: str, factor: float) -> Wrong:
    """Return a perturbation: the displacements of some tendons are `factor` times as large."""

    def offsets(name: str) -> list[Offsets]:
        tendon = rows(name).copy()
        tendon[:, pulled(name, prefix)] *= factor
        return drawn(name).offsets(CASES[name].statics(drawn(name).robot, tendon))

    return offsets


def bent(factor: float) -> Wrong:
    """Return a perturbation: bending is off by `factor`; where tension pulls, by the stiffness."""

    def offsets(name: str) -> list[Offsets]:
        if name in CATHETERS:
            return times("bending", factor)(name)
        return drawn(name).offsets(statics(name, stiffness_scale=1.0 / factor))

    return offsets


def moved(change: Callable[[Posture], Posture]) -> Wrong:
    """Return a perturbation: each analytic posture is changed."""
    return lambda name: drawn(name).offsets([change(posture) for posture in statics(name)])


def lengths(posture: Posture) -> np.ndarray:
    """Return each face's length along the robot, shape (n,) [m]."""
    return np.cumsum(np.linalg.norm(np.diff(posture.p_w, axis=0, prepend=np.zeros((1, 3))), axis=1))


def out_of_plane(posture: Posture) -> Posture:
    """Return a posture whose tip is moved out of the plane of its bend, its other faces less."""
    along = lengths(posture)
    side = np.array([-posture.p_w[-1, 1], posture.p_w[-1, 0], 0.0])
    side = side / np.linalg.norm(side) * min(FAR_M, FAR * along[-1])
    return replace(posture, p_w=posture.p_w + (along[:, np.newaxis] / along[-1]) ** 2 * side)


def along_y(posture: Posture) -> Posture:
    """Return a posture that is moved along what the first camera looks along."""
    far = min(FAR_M, FAR * lengths(posture)[-1])
    return replace(posture, p_w=posture.p_w + np.array([0.0, far, 0.0]))


def twisted(posture: Posture) -> Posture:
    """Return a posture whose elements are turned about their axes, the more the further out."""
    shares = np.arange(1, len(posture.R_w) + 1) / len(posture.R_w)
    turns = np.array([about((0.0, 0.0, 1.0), TWIST_RAD * share) for share in shares])
    return replace(posture, R_w=posture.R_w @ turns)


def camera_off(axis: int) -> Wrong:
    """Return a perturbation: both cameras stand a pixel aside (0: a column, 1: a row)."""

    def offsets(name: str) -> list[Offsets]:
        pixel = 1e-3 * mm_per_px(drawn(name).robot)
        views = [
            replace(view, target=view.target + pixel * view.axes[axis]) for view in cameras(drawn(name).robot)
        ]
        return drawn(name).offsets(statics(name), views)

    return offsets


def previous_row(name: str) -> list[Offsets]:
    """Each posture is held against the row before it."""
    postures = statics(name)
    return drawn(name).offsets([postures[-1], *postures[:-1]])


def cameras_exchanged(name: str) -> list[Offsets]:
    """Each picture is held against the other camera's."""
    return drawn(name).offsets(statics(name), cameras(drawn(name).robot)[::-1])


OF_ALL: dict[str, Wrong] = {
    "bending 2 % too large": bent(1.0 + SHARE),
    "bending 2 % too small": bent(1.0 - SHARE),
    "tip out of plane": moved(out_of_plane),
    "along the first camera's view": moved(along_y),
    "twisted": moved(twisted),
    "camera a pixel sideways": camera_off(0),
    "camera a row off": camera_off(1),
    "previous row": previous_row,
    "cameras exchanged": cameras_exchanged,
}
OF_CATHETERS: dict[str, Wrong] = {
    "torsion reversed": times("torsion", -1.0),
    "torsion 20 % too small": times("torsion", 0.8),
    "torsion 20 % too large": times("torsion", 1.2),
    "advance 2 % too small": times("advance", 1.0 - SHARE),
    "advance 2 % too large": times("advance", 1.0 + SHARE),
}
OF_TRANSSEPTAL: dict[str, Wrong] = {
    f"torsion {which} {word}": times(f"torsion_{which}", factor)
    for which in ("proximal", "distal")
    for word, factor in (("reversed", -1.0), ("20 % too small", 0.8))
}


def applying() -> Iterator[object]:
    """Yield every perturbation of every robot to which it applies."""
    for name in CASES:
        known = OF_ALL | (OF_CATHETERS if name in CATHETERS else {})
        known |= OF_TRANSSEPTAL if name == "mitral_transseptal" else {}
        for words, wrong in known.items():
            group = pytest.mark.xdist_group(f"drawn {name}")
            yield pytest.param(name, wrong, id=f"{name}: {words}", marks=group)


def test_every_robot_is_drawn() -> None:
    """Each published robot has a case, and so has the parameter set whose links are soft."""
    assert {name for name in ROBOTS if "@" not in name} <= set(CASES)
    assert "chest_tube_section@prototype" in CASES


@pytest.mark.slow
@pytest.mark.parametrize("name", of_each(list(CASES)))
def test_right_model_passes(name: str) -> None:
    """Each posture is within both tolerances; all but a few parts of it are seen by either camera."""
    found = drawn(name).offsets(statics(name))
    print(name, [(round(one.mean_px, 3), round(one.worst_px, 3)) for one in found])
    assert all(one.passed for one in found)
    for one in found:
        assert one.judged[:, KINDS.index(BODY)].any(axis=0).all()
        assert one.judged[:, KINDS.index(STRIPE), 1:].any(axis=0).mean() > 0.8


@pytest.mark.slow
@pytest.mark.parametrize(("name", "wrong"), list(applying()))
def test_slightly_wrong_model_fails(name: str, wrong: Wrong) -> None:
    """An analytic side, or a camera, that is a little wrong puts a posture out of a tolerance."""
    found = wrong(name)
    print(name, [(round(one.mean_px, 3), round(one.worst_px, 3)) for one in found])
    assert not all(one.passed for one in found)


@pytest.mark.slow
@pytest.mark.parametrize("name", of_each(["neuroendoscope_section", "chest_tube_section"]))
def test_roll_is_seen_by_the_stripe_alone(name: str) -> None:
    """Of a round robot that is twisted the parts' own pixels say nothing; the stripe's do."""
    for one in drawn(name).offsets([twisted(posture) for posture in statics(name)]):
        body = replace(one, judged=one.judged & (np.arange(2) == KINDS.index(BODY))[:, np.newaxis])
        assert body.mean_px < 0.25 * MEAN_PX
        stripe = replace(one, judged=one.judged & (np.arange(2) == KINDS.index(STRIPE))[:, np.newaxis])
        assert stripe.mean_px > 3.0 * body.mean_px


@pytest.mark.slow
@pytest.mark.parametrize("name", of_each(list(CASES)))
def test_straight_robots_parts_lie_about_its_axis(name: str) -> None:
    """To a micrometre; a part that is moved by 0.1 mm is noticed."""
    here = drawn(name)
    assert off_axis_m(here) < 1e-6
    prefix = f"{kind_of(here.robot).picture.CENTRELINE_PARTS[0]}_"
    geom = next(k for k in here.marks.triangles if here.marks.model.geom(k).name.startswith(prefix))
    aside = here.marks.triangles | {geom: here.marks.triangles[geom] + np.array([1e-4, 0.0, 0.0])}
    assert off_axis_m(replace(here, marks=replace(here.marks, triangles=aside))) == pytest.approx(
        1e-4, rel=0.02
    )


def test_check_that_cannot_draw_says_so_and_is_not_a_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without OpenGL there is no line, and one sentence of why"""

    def refuse(*_: object) -> None:
        raise InputError("no OpenGL here")

    monkeypatch.setattr(render, "open_renderer", refuse)
    found = render.validate_render_4dof(Path("."))
    assert found.findings == ("mitral_4dof: render check not run: no OpenGL here",)
    assert not found.passed


# Made-up pictures.

SECTIONS = np.array([-1, 0, 0, 1])


def pictures(shift_px: Sequence[int] = (0, 0, 0, 0), gone: Sequence[int] = ()) -> list[np.ndarray]:
    """Return four pictures of four parts, each part shifted to the right; some are nowhere."""
    one = np.full((24, 30), -1)
    for part, shift in enumerate(shift_px):
        if part not in gone:
            one[6 * part : 6 * part + 6, 10 + shift : 19 + shift] = part
    return [one] * 4


def test_offset_is_by_how_much_pixels_are_shifted() -> None:
    """All parts two pixels to the right: two pixels off, signed; the other way round, the same size."""
    there = compare(pictures((2, 2, 2, 2)), pictures(), SECTIONS)
    back = compare(pictures(), pictures((2, 2, 2, 2)), SECTIONS)
    assert there.offset_px[..., 0] == pytest.approx(np.full((2, 2, 4), 2.0))
    assert back.offset_px[..., 0] == pytest.approx(np.full((2, 2, 4), -2.0))
    assert there.mean_px == back.mean_px == there.worst_px == back.worst_px == 2.0
    assert not there.passed


def test_mean_is_signed_and_of_each_section() -> None:
    """Offsets of opposite signs cancel within a section, and not between sections."""
    assert compare(pictures((0, 1, -1, 0)), pictures(), SECTIONS).mean_px == 0.0
    assert compare(pictures((0, 1, 0, -1)), pictures(), SECTIONS).mean_px == 1.0
    assert compare(pictures((0, 1, -1, 0)), pictures(), SECTIONS).worst_px == 1.0 == WORST_PX
    assert not compare(pictures((0, 2, -2, 0)), pictures(), SECTIONS).passed


def test_what_should_be_seen_and_is_not_does_not_pass() -> None:
    """A part that is drawn nowhere, or nothing at all: undefined. One that hides in both is not compared."""
    lost = compare(pictures(gone=[2]), pictures(), SECTIONS)
    assert math.isnan(lost.mean_px)
    assert math.isnan(lost.worst_px)
    assert not lost.passed
    assert not compare(pictures(gone=range(4)), pictures(gone=range(4)), SECTIONS).passed
    both = compare(pictures(gone=[2]), pictures(gone=[2]), SECTIONS)
    assert both.passed
    assert not both.judged[..., 2].any()


def test_triangles_are_painted_at_pixels_centres_and_the_nearest_is_seen() -> None:
    """A square of two triangles covers the pixels whose centres it holds; what is nearer hides it."""

    def square(low: float, high: float, near: float) -> list[list[tuple[float, float, float]]]:
        a, b, c, d = (low, low, near), (high, low, near), (high, high, near), (low, high, near)
        return [[a, b, c], [a, c, d]]

    corners = np.array([*square(1.4, 5.6, 1.0), *square(3.0, 8.0, 2.0)])
    shown = _painted(corners, np.array([0, 0, 1, 1]), 7, 9)
    expected = np.full((9, 7), -1)
    expected[1:6, 1:6] = 0
    expected[3:8, 3:7] = 1
    assert np.array_equal(shown, expected)
    back = _painted(corners[::-1].copy(), np.array([1, 1, 0, 0]), 7, 9)
    assert np.array_equal(back, expected)


@pytest.mark.parametrize("name", CATHETERS)
def test_rigid_rings_turn_by_a_hinge_each_and_reach_the_arcs_end(name: str) -> None:
    """Between two rings lies a hinge's angle; beyond the last a joint ends where pure kinematics has it."""
    robot = load_robot(name)
    assert isinstance(robot, CatheterRobot)
    even = replace(CASES[name], as_built=None).statics(robot, CASES[name].tendon)
    last = {part.segment: k for k, part in enumerate(elements(robot))}
    for posture in even:
        rigid = with_rigid_rings(robot, posture)
        bends = np.split(posture.joint_angles, list(np.cumsum(np.array(hinge_counts(robot))))[:-1])
        for segment, angles in zip(turning(robot), bends, strict=True):
            index = robot.segments.index(segment)
            if segment.joint != "bending":
                assert np.array_equal(rigid.p_w[last[index]], posture.p_w[last[index]])
                continue
            first = last[index] - segment.rings + 1
            axis = (0.0, 1.0, 0.0) if segment.bends_toward == "x" else (-1.0, 0.0, 0.0)
            hinge = about(axis, float(angles[0]))
            for k in range(first + 1, last[index] + 1):
                assert rigid.R_w[k] == pytest.approx(rigid.R_w[k - 1] @ hinge, abs=1e-9)
            k, heights = last[index], hinge_heights_m(segment)
            face = elements(robot)[k].face_m
            at_hinge = rigid.p_w[k] + (heights[-1] - face) * rigid.R_w[k][:, 2]
            beyond = rigid.R_w[k] @ hinge
            end = at_hinge + (segment.length_m - heights[-1]) * beyond[:, 2]
            following = elements(robot)[k + 1]
            if robot.segments[following.segment].joint == "rigid":
                promised = posture.p_w[k + 1] - following.face_m * posture.R_w[k + 1][:, 2]
                assert end == pytest.approx(promised, abs=0.1e-3)
                assert beyond == pytest.approx(posture.R_w[k + 1], abs=1e-9)
