"""Claims about the kinetostatic model: limits, energy, friction, loads, drives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from notched_cases import LINEAR, WRIST, changed, inputs

from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.robots.notched_tube.description import notches
from catheter_sim.robots.notched_tube.section import closing_angle, section, torsion_stiffness
from catheter_sim.robots.notched_tube.spec import NotchedTubeRobot
from catheter_sim.robots.notched_tube.statics import FaceLoads, TubeStates, kinetostatic, solve_rows
from reference.printed_formulas import curvature_of_bend, tendon_displacement

SEGMENT = WRIST.segments[0]
SHAPE = section(SEGMENT)
HEIGHT = SEGMENT.notch_height_m
ARM = SHAPE.centroid_m + WRIST.tendons[0].radius_m
STIFFNESS = 60e9 * SHAPE.second_moment_m4 / HEIGHT  # of one notch [N m/rad]
NONE = np.zeros(3)


def solved(robot: NotchedTubeRobot, rows: Inputs, gravity: np.ndarray = NONE) -> TubeStates:
    """Return one robot's states, all of which balance."""
    states = solve_rows([robot], [rows], gravity)
    assert np.all(states.residual < 1e-8), "a row does not balance"
    return states


def bends(robot: NotchedTubeRobot, rows: Inputs, gravity: np.ndarray = NONE) -> np.ndarray:
    """Return the notches' bends toward +x, shape (r, n) [rad]."""
    return solved(robot, rows, gravity).w[0, :, :, 1]


def test_small_tension_bends_by_arm_over_stiffness() -> None:
    """A small tension without friction bends every notch by T arm / (E I / h)."""
    found = bends(changed(mu=0.0), inputs([1e-3]))
    assert found == pytest.approx(np.full((1, 5), 1e-3 * ARM / STIFFNESS), rel=1e-4)


def test_large_bend_of_a_linear_metal_is_that_of_the_straight_span() -> None:
    """Without friction E I theta / h = -T dl/dtheta, l the straight span; the strip shortens a little."""
    tension = 6.0
    robot = changed(mu=0.0, metal=LINEAR)
    states = solved(robot, inputs([tension]))
    bend = states.w[0, 0, :, 1]
    step = 1e-6
    lost = [
        tendon_displacement(
            curvature_of_bend(bend + half, HEIGHT, SHAPE.centroid_m),
            HEIGHT,
            SHAPE.centroid_m,
            0.43e-3,
        )
        for half in (-step, step)
    ]
    arm = (lost[1] - lost[0]) / (2.0 * step)
    assert tension * arm == pytest.approx(STIFFNESS * bend, rel=1e-3)
    assert bend == pytest.approx(bend[0], rel=1e-9)
    # The tendon's pull along the strip, nearly all of T, presses it together.
    assert states.stretch[0, 0] == pytest.approx(-tension / (60e9 * SHAPE.area_m2), rel=0.02)


def test_no_depth_bends_as_the_straight_tube() -> None:
    """Notches of no depth bend under a tip moment by M h / (E I of the ring)."""
    ring = math.pi / 4.0 * (0.58e-3**4 - 0.43e-3**4)
    robot = changed(metal=LINEAR, notch_depth_m=0.0)
    found = bends(robot, inputs([0.0], moment=(0.0, 0.01, 0.0)))
    assert found == pytest.approx(np.full((1, 5), 0.01 * HEIGHT / (60e9 * ring)), rel=1e-4)


def test_pulling_stores_the_energy_that_it_takes() -> None:
    """Without friction the tension's work over the displacement is what a tip moment's would be stored back:
    pulled in and let out, the work adds up to nothing, past the plateau and past closing."""
    way = np.concatenate([np.linspace(0.0, 2.0e-3, 201), np.linspace(2.0e-3, 0.0, 201)])
    tension = solved(changed(mu=0.0), inputs(way, "displacement")).tension[0]
    work = np.concatenate([[0.0], np.cumsum(0.5 * (tension[1:] + tension[:-1]) * np.diff(way))])
    assert work[200] > 3e-3
    assert abs(work[-1]) < 1e-6 * work[200]
    lossy = solved(WRIST, inputs(way, "displacement")).tension[0]
    taken = np.sum(0.5 * (lossy[1:] + lossy[:-1]) * np.diff(way))
    assert 0.2 * work[200] < taken < work[200]


def test_friction_takes_tension_from_edge_to_edge() -> None:
    """While it is pulled, notch i has T exp(-mu (bends before it + half its own)), so that it bends less."""
    states = solved(WRIST, inputs([0.5, 1.5]))
    bend = states.w[0, 1, :, 1]
    expected = 1.5 * np.exp(-0.2 * (np.cumsum(bend) - 0.5 * bend))
    assert states.notch_tension[0, 1] == pytest.approx(expected, rel=1e-9)
    assert np.all(np.diff(bend) < 0.0)
    without = solved(changed(mu=1e-9), inputs([0.5, 1.5]))
    assert np.ptp(without.w[0, 1, :, 1]) < 1e-8


def test_friction_remembers() -> None:
    """Let back to the same tension the tube is bent more than on the way in; a loop repeats."""
    rows = [0.5, 1.0, 1.5, 2.0, 1.5, 1.0, 0.5, 1.0, 1.5, 2.0, 1.5, 1.0, 0.5]
    total = bends(WRIST, inputs(rows)).sum(axis=1)
    for up, down in ((0, 6), (1, 5), (2, 4)):
        assert total[down] > 1.01 * total[up]
    assert total[9:] == pytest.approx(total[3:7], rel=1e-6)
    plain = bends(changed(mu=0.0), inputs(rows)).sum(axis=1)
    assert plain[6] == pytest.approx(plain[0], rel=1e-8)


def test_rows_apart_make_the_same_history() -> None:
    """Without loads, tensions that move one way between rows lead to the same bends in any number of rows."""
    coarse = bends(WRIST, inputs([3.0, 1.0]))
    fine = bends(WRIST, inputs([*np.linspace(0.0, 3.0, 61)[1:], *np.linspace(3.0, 1.0, 41)[1:]]))
    assert fine[[59, 99]] == pytest.approx(coarse, abs=1e-7)


@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_displacement_and_tension_agree(mu: float) -> None:
    """Displacements by what tensions shorten the tendon's path lead to the same bends and tensions.

    Where a tendon sticks throughout, its displacement says nothing of the tension at the actuator.
    """
    tension = np.concatenate([np.linspace(0.1, 2.6, 26), np.linspace(2.5, 0.2, 24)])
    robot = changed(mu=mu)
    first = solved(robot, inputs(tension))
    length = (1.0 + first.stretch[0]) * HEIGHT
    bend = first.w[0, :, :, 1]
    span = length * np.sinc(0.5 * bend / np.pi) - 2.0 * ARM * np.sin(0.5 * bend)
    second = solved(robot, inputs((HEIGHT - span).sum(axis=1), "displacement"))
    assert second.w[0, :, :, 1] == pytest.approx(bend, abs=2e-6)
    assert second.notch_tension[0] == pytest.approx(first.notch_tension[0], rel=1e-4)
    moving = np.abs(np.diff(bend.sum(axis=1), prepend=0.0)) > 1e-9
    assert 44 < moving.sum() <= (50 if mu == 0.0 else 49)
    assert second.tension[0, moving] == pytest.approx(tension[moving], rel=1e-4)


def test_stiff_tendon_becomes_inextensible_and_soft_one_follows_its_spring() -> None:
    """T = p + k (d - path lost) of an elastic tendon, and as k grows the bends of an inextensible one."""
    way = np.concatenate([np.linspace(0.05e-3, 1.2e-3, 24), np.linspace(1.15e-3, 0.1e-3, 22)])
    soft = changed(tendon={"stiffness_N_per_m": 5e3, "pretension_N": 0.3})
    states = solved(soft, inputs(way, "displacement"))
    bend, length = states.w[0, :, :, 1], (1.0 + states.stretch[0]) * HEIGHT
    span = length * np.sinc(0.5 * bend / np.pi) - 2.0 * ARM * np.sin(0.5 * bend)
    spring = 0.3 + 5e3 * (way - (HEIGHT - span).sum(axis=1))
    assert states.tension[0] == pytest.approx(spring, abs=1e-6)
    stiff = bends(changed(tendon={"stiffness_N_per_m": 1e8}), inputs(way, "displacement"))
    rigid = bends(WRIST, inputs(way, "displacement"))
    assert stiff == pytest.approx(rigid, abs=2e-4)


def test_a_tendon_does_not_push() -> None:
    """A displacement below zero leaves the tube straight, a force that closes notches leaves it slack."""
    states = solved(WRIST, inputs([-1e-3, 0.0], "displacement"))
    assert np.all(states.tension == 0.0)
    assert np.abs(states.w).max() < 1e-12
    pushed = solved(WRIST, inputs([0.1e-3], "displacement", force=(0.4, 0.0, 0.0)))
    assert pushed.tension[0, 0] == 0.0
    free = solved(WRIST, inputs([0.0], force=(0.4, 0.0, 0.0)))
    assert pushed.w == pytest.approx(free.w, abs=1e-8)


def test_held_tendon_resists_opening() -> None:
    """With the tendon held at zero, a force that opens the notches bends the tube less, or not its mean."""
    held = bends(WRIST, inputs([0.0], "displacement", force=(-0.05, 0.0, 0.0)))
    free = bends(WRIST, inputs([0.0], force=(-0.05, 0.0, 0.0)))
    assert np.all(free < 0.0)
    assert abs(held.sum()) < 0.05 * abs(free.sum())


def test_small_tip_forces_bend_as_beams() -> None:
    """The tip moves by F z^2 h / (E I) of all notches; at right angles by their twist about the strip too."""
    force = 1e-4
    lever = np.array([notches(WRIST)[-1].face_z_m - item.low_z_m - 0.5 * HEIGHT for item in notches(WRIST)])
    own = HEIGHT**2 / 12.0  # of an evenly bent notch about its middle
    for axis, bending in ((0, STIFFNESS), (1, 60e9 * SHAPE.lateral_second_moment_m4 / HEIGHT)):
        direction = np.eye(3)[axis]
        states = solved(WRIST, inputs([0.0], force=force * direction))
        p_w, _ = states.faces()
        expected = force * np.sum(lever**2) / bending
        if axis == 1:
            expected += 5 * force * SHAPE.centroid_m**2 / torsion_stiffness(SEGMENT, 60e9, 0.33)
        assert p_w[0, 0, -1, axis] == pytest.approx(expected, rel=own / np.mean(lever**2) + 2e-3)


def test_moment_about_the_tube_twists_it() -> None:
    """A small moment about the tube twists each notch by M over its torsion stiffness, and bends none."""
    states = solved(WRIST, inputs([0.0], moment=(0.0, 0.0, 1e-5)))
    assert states.w[0, 0, :, 2] == pytest.approx(1e-5 / torsion_stiffness(SEGMENT, 60e9, 0.33), rel=1e-3)
    assert np.abs(states.w[0, 0, :, :2]).max() < 1e-6


def test_mirrored_loads_mirror_the_tube() -> None:
    """A force toward -y leads to the mirror image of one toward +y: y, turn and twist change sign."""
    for force in (0.02, 0.2):
        pair = [solved(WRIST, inputs([1.0, 2.0], force=(0.05, sign * force, 0.0))) for sign in (1.0, -1.0)]
        assert pair[0].w == pytest.approx(pair[1].w * [-1.0, 1.0, -1.0], abs=1e-8)
        assert np.abs(pair[0].w[..., 2]).max() > 1e-4


def test_planar_solution_is_the_spatial_one() -> None:
    """A push out of plane that is next to nothing changes the planar solution by next to nothing."""
    rows = [1.0, 2.5, 1.5]
    planar = solved(WRIST, inputs(rows, force=(0.1, 0.0, -0.1)))
    spatial = solved(WRIST, inputs(rows, force=(0.1, 1e-9, -0.1)))
    assert planar.chains.tubes.axes == 1 != spatial.chains.tubes.axes
    assert spatial.w == pytest.approx(planar.w, abs=1e-6)
    stiff = replace(WRIST, bending_axes="x")
    held = solved(stiff, inputs(rows, force=(0.1, 0.5, -0.1)))
    assert held.w == pytest.approx(planar.w, abs=1e-9)


def test_weight_is_force_in_the_middle_of_the_uncut_pieces() -> None:
    """Weight bends as the same forces hung at the elements, which lie half an uncut piece off the faces."""
    gravity = np.array([2e4, 0.0, 0.0])
    hung = solved(WRIST, inputs([0.5]), gravity)
    row = notches(WRIST)
    mass = np.array([item.mass_kg for item in row])
    force = np.zeros((1, 1, 5, 3))
    force[0, 0, :, 0] = mass * gravity[0]
    moment = np.zeros_like(force)
    _, R_w = hung.faces()
    back = np.array([-0.5 * item.uncut_m * R_w[0, 0, k, :, 2] for k, item in enumerate(row)])
    moment[0, 0] = np.cross(back, force[0, 0])
    loads = FaceLoads(np.arange(1, 6), force, moment)
    rows = inputs([0.5])
    pulled = solve_rows([WRIST], [rows], NONE, loads)
    assert np.abs(hung.w[0, 0, :, 1]).max() > 0.03
    assert pulled.w == pytest.approx(hung.w, abs=1e-6)


def test_mount_gives_way_under_all_that_presses() -> None:
    """An elastic mount shifts the whole tube by tension and force over its stiffness."""
    soft = replace(WRIST, mount=replace(WRIST.mount, axial_stiffness_N_per_m=1e4))
    rows = inputs([2.0], force=(0.0, 0.0, 0.5))
    shifted, fixed = (solved(robot, rows).faces()[0] for robot in (soft, WRIST))
    assert shifted - fixed == pytest.approx(np.broadcast_to([0.0, 0.0, -1.5e-4], shifted.shape))


def test_closed_notches_stop() -> None:
    """No tension bends a notch beyond closing by more than its uncut tube would give."""
    found = bends(WRIST, inputs([3.0, 10.0]))
    assert found.max() < closing_angle(SEGMENT) + 10.0 * 2.0 * ARM / 7.0
    assert found[1] == pytest.approx(closing_angle(SEGMENT), rel=3e-3)


def test_rest_shape_is_where_nothing_acts() -> None:
    """Rest curvatures and twist are the unloaded shape, and stiffness does not act there."""
    bent = changed(rest_curvature_x_per_m=20.0, rest_curvature_y_per_m=-10.0, rest_twist_rad_per_m=15.0)
    states = solved(bent, inputs([0.0]))
    pitch = np.array([item.pitch_m for item in notches(bent)])
    assert states.w[0, 0] == pytest.approx(np.outer(pitch, [10.0, 20.0, 15.0]), abs=1e-9)


def test_polynomial_law_multiplies_the_moment() -> None:
    """With c3 a small tension bends by the moment over E I / h times 1 + c3 k^2."""
    plain, curved = (
        bends(changed(mu=0.0, metal=LINEAR, stiffness_cubic_m2=c3, spacing_m=1.5e-3), inputs([0.5]))[0]
        for c3 in (0.0, 4e-3)
    )
    law = 1.0 + 4e-3 * (curved / (HEIGHT + 1.5e-3)) ** 2
    assert curved * law == pytest.approx(plain, rel=1e-3)
    assert np.all(curved < 0.9 * plain)


def test_stiffness_scale_scales_the_metal() -> None:
    """Twice the stiffness needs twice the tension for the same bends, beyond the plateau as well."""
    twice = bends(replace(WRIST, stiffness_scale=2.0), inputs([2.0, 5.0]))
    assert twice == pytest.approx(bends(WRIST, inputs([1.0, 2.5])), rel=1e-6)


def test_batch_is_each_alone() -> None:
    """Robots solved together come out as each alone, to the last bit."""
    robots = [changed(mu=mu, notch_height_m=height) for mu, height in ((0.1, 0.5e-3), (0.3, 0.6e-3))]
    rows = inputs([1.0, 2.0, 0.5])
    together = solve_rows(robots, [rows, rows], NONE)
    for index, robot in enumerate(robots):
        assert np.array_equal(together.w[index], solve_rows([robot], [rows], NONE).w[0])


def test_no_equilibrium_is_an_error_with_the_row() -> None:
    """A tendon that is pulled in further than the metal bears is refused, and the batch marks it NaN."""
    rows = inputs([0.5e-3, 5e-3], "displacement")
    states = solve_rows([WRIST], [rows], NONE)
    assert np.isfinite(states.w[0, 0]).all()
    assert np.isnan(states.w[0, 1]).all()
    with pytest.raises(InputError, match="no equilibrium at row 2"):
        kinetostatic(WRIST, rows, NONE)


def test_public_model_gives_the_states() -> None:
    """The postures are the states' faces, angles and tensions."""
    rows = inputs([1.0, 2.0], force=(0.0, 0.05, 0.0))
    run = kinetostatic(WRIST, rows, NONE)
    states = solve_rows([WRIST], [rows], NONE)
    p_w, R_w = states.faces()
    for row, posture in enumerate(run.postures):
        assert np.array_equal(posture.p_w, p_w[0, row])
        assert np.array_equal(posture.R_w, R_w[0, row])
        assert posture.joint_angles.shape == (15,)
        assert posture.tendon_tension.shape == (1, 5)
        assert np.linalg.det(posture.R_w) == pytest.approx(np.ones(5))
