"""Many planar robots at once: the same as the exact-arm statics, one at a time."""

from __future__ import annotations

import math
import zlib
from dataclasses import replace

import numpy as np
import pytest
from planar_cases import NO_GRAVITY, SIDEWAYS, section, tensions, tips_mm

from catheter_sim.catalogue import load_robot
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import arriving_inputs, with_built_in_effects, with_effects
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum import planar, planar_batch
from catheter_sim.robots.continuum.exact_arm import fkm_exact_arm
from catheter_sim.robots.continuum.planar import hinge_faces
from catheter_sim.robots.continuum.published import neuroendoscope
from catheter_sim.robots.continuum.spec import Tendon

pytestmark = pytest.mark.slow

# Out, back a little, out, all the way back to the other side, a partial loop there, slack.
LOOP = [(0.0, 0.0), (0.12, 0.12), (0.5, 0.12), (0.4, 0.12), (0.55, 0.12), (0.12, 0.12)]
LOOP += [(0.12, 0.5), (0.12, 0.3), (0.12, 0.45), (0.3, 0.3), (0.0, 0.0)]
SEEDS = range(15, 23)  # of random robots, most of which have a balance in every row
ROBOTS = {"one section": section(), "two sections": neuroendoscope()}


def loop(robot, rows=LOOP):
    """Return inputs that bend every section to and fro, the proximal one later than the distal one."""
    pair = np.array(rows)
    if len(robot.tendons) == 2:
        return tensions(pair)
    other = 0.15 * np.concatenate([pair[:1], np.roll(pair[1:], 3, axis=0)])
    return tensions(np.column_stack([0.6 * pair, other[:, [0, 0, 1, 1]]]))


def use_steps(monkeypatch, bend_rad):
    """Make the models and the batch go from row to row in the same steps."""
    monkeypatch.setattr(planar, "STEP_BEND_RAD", bend_rad)
    monkeypatch.setattr(planar_batch, "STEP_BEND_RAD", bend_rad)
    monkeypatch.setattr(planar_batch, "ALONE_STEP_BEND_RAD", None)


def tips_of_batch_mm(robot, inputs, gravity):
    """Return the tip's x and z by the batch, shape (r, 2) [mm]."""
    angles, shift = planar_batch.solve_planar([robot], [inputs], gravity)
    faces = hinge_faces(angles, planar.planar_chain(robot, "test").cell_length)[0, :, -1]
    faces[:, 2] += shift[0]
    return 1e3 * faces[:, [0, 2]]


def with_random_effects(robot, seed):
    """Return `robot` with about half of its effects, each of a few changes that matter.

    Each number has a generator of its own: a new form of one effect leaves every other number as it was.
    """
    effects = {}
    for name, effect in EFFECTS.items():
        if own_generator(seed, name).random() < 0.5:
            continue
        effects[name] = {
            item.name: random_value(item, own_generator(seed, f"{name}.{item.name}"))
            for item in effect.parameters(robot)
        }
    return with_effects(robot, {name: values for name, values in effects.items() if values})


def own_generator(seed, name):
    """Return the generator of what is called `name`."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


def random_value(item, generator):
    """Return a value of a parameter of an effect that matters, within its bounds."""
    if not math.isfinite(item.null):
        return float(generator.uniform(1.0, 5.0))
    return float(np.clip(item.null + 2.0 * item.scale * generator.normal(), item.lower, item.upper))


def random_case(robot, seed):
    """Return a robot with effects, inputs that arrive at it, with loads on every other one, and gravity."""
    generator = np.random.default_rng(seed)
    robot = with_random_effects(robot, seed)
    rows = np.abs(generator.normal(0.0, 0.4 / len(robot.tendons), (8, len(robot.tendons))))
    rows[generator.random(rows.shape) < 0.2] = 0.0
    force, gravity = np.zeros((8, 3)), np.zeros(3)
    moment = np.zeros((8, 3))
    if seed % 2:
        force = generator.normal(0.0, 5e-4, (8, 3))
        moment = generator.normal(0.0, 3e-5, (8, 3))
        gravity = np.array([generator.normal(0.0, 5.0), 0.0, 0.0])
    inputs = tensions(rows, force, moment)
    return with_built_in_effects(robot), arriving_inputs(robot, inputs), gravity


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", ROBOTS)
def test_same_steps_same_angles(name, seed, monkeypatch):
    """In the models' steps every angle is theirs to 1e-9 rad, and where they find no balance there is none.

    Random robots with random effects, random tensions, and on every other one weight and tip loads.
    """
    use_steps(monkeypatch, 0.4)
    robot, inputs, gravity = random_case(ROBOTS[name], seed)
    angles, shift = planar_batch.solve_planar([robot], [inputs], gravity)
    balanced = np.isfinite(angles[0]).all(axis=1)
    if not balanced.all():
        assert not balanced[int(np.argmin(balanced)) :].any()
        with pytest.raises(InputError, match=rf"^row {int(np.argmin(balanced)) + 1} "):
            fkm_exact_arm(robot, inputs, gravity)
        return
    run = fkm_exact_arm(robot, inputs, gravity)
    expected = np.array([posture.joint_angles for posture in run.postures])
    np.testing.assert_allclose(angles[0], expected, rtol=0, atol=1e-9)
    tips = np.array([posture.p_w[-1, 2] for posture in run.postures])
    faces = hinge_faces(expected, planar.planar_chain(robot, "test").cell_length)
    np.testing.assert_allclose(shift[0], tips - faces[:, -1, 2], atol=1e-12)


def test_most_random_robots_have_a_balance():
    """Most of the random robots above are compared to the last row."""
    for robot in ROBOTS.values():
        cases = [random_case(robot, seed) for seed in SEEDS]
        found = [planar_batch.solve_planar([item], [inputs], gravity)[0] for item, inputs, gravity in cases]
        assert sum(bool(np.isfinite(angles).all()) for angles in found) >= 6


@pytest.mark.parametrize("gravity", [NO_GRAVITY, SIDEWAYS], ids=["weightless", "heavy"])
@pytest.mark.parametrize("name", ROBOTS)
def test_shipped_steps_are_small_enough(name, gravity):
    """With the shipped, longer steps they agree within 0.05 mm, the smallest noise that is expected."""
    robot = ROBOTS[name]
    inputs = loop(robot)
    expected = tips_mm(fkm_exact_arm(robot, inputs, gravity))
    np.testing.assert_allclose(tips_of_batch_mm(robot, inputs, gravity), expected, atol=0.05)


@pytest.mark.parametrize("name", ROBOTS)
def test_robots_of_a_batch_do_not_mix(name, monkeypatch):
    """In the same steps each robot of a batch is what it is alone, whatever became of the one before."""
    use_steps(monkeypatch, 1e3)  # one step a row
    base = ROBOTS[name]
    robots = [replace(base, stiffness_scale=scale) for scale in (0.02, 0.9, 1.2)]
    inputs = [loop(base), loop(base, LOOP[::-1]), loop(base)]
    together, shifts = planar_batch.solve_planar(robots, inputs, SIDEWAYS)
    assert np.isnan(together[0, -1]).all()
    for index, (robot, item) in enumerate(zip(robots, inputs, strict=True)):
        alone, shift = planar_batch.solve_planar([robot], [item], SIDEWAYS)
        np.testing.assert_array_equal(together[index], alone[0])
        np.testing.assert_array_equal(shifts[index], shift[0])


def test_a_buckling_robot_is_followed(monkeypatch):
    """Two upright sections that buckle under weight and tension end where the model ends, to 0.1 um.

    The way there is a snap, on which the tolerances of both grow.
    """
    use_steps(monkeypatch, 0.3)
    rows = [
        [0.12, 0.12, 0, 0, 0, 0],
        [0.4, 0.12, 0.05, 0.05, 0.05, 0.05],
        [0.4, 0.12, 0.05, 0.05, 0.25, 0.25],
        [0.3, 0.12, 0.05, 0.05, 0.25, 0.25],
    ]
    upright = np.array([0.0, 0.0, -9.81])
    expected = tips_mm(fkm_exact_arm(neuroendoscope(), tensions(rows), upright))
    assert expected[2, 0] > 50 > 0 > expected[3, 0]
    found = tips_of_batch_mm(neuroendoscope(), tensions(rows), upright)
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_eyelets_remember_nothing_of_the_sag(monkeypatch):
    """A heavy robot lies in its sag without friction: equal first tensions find every eyelet unslipped."""
    use_steps(monkeypatch, 0.3)
    inputs = tensions([[0.05, 0.05, 0.02, 0.02, 0.02, 0.02]])
    expected = tips_mm(fkm_exact_arm(neuroendoscope(), inputs, SIDEWAYS))
    np.testing.assert_allclose(tips_of_batch_mm(neuroendoscope(), inputs, SIDEWAYS), expected, atol=1e-6)


def test_tendons_side_by_side_may_be_pulled_unevenly(monkeypatch):
    """The proximal tendons of one side slip alike, so that only the sum of their tensions counts."""
    use_steps(monkeypatch, 0.3)
    even = loop(neuroendoscope(), LOOP[:6])
    uneven = replace(even, tendon=even.tendon * [1, 1, 1.5, 0.5, 0.2, 1.8])
    expected = tips_mm(fkm_exact_arm(neuroendoscope(), uneven, NO_GRAVITY))
    for inputs in (even, uneven):
        np.testing.assert_allclose(
            tips_of_batch_mm(neuroendoscope(), inputs, NO_GRAVITY), expected, atol=1e-6
        )


def test_tendons_at_radii_of_their_own(monkeypatch):
    """Six tendons of six offsets, their order mixed, bend the robot as in the model."""
    use_steps(monkeypatch, 0.3)
    base = neuroendoscope()
    order = (3, 0, 5, 1, 2, 4)
    tendons: list[Tendon] = [
        replace(base.tendons[j], radius_m=base.tendons[j].radius_m * (1.0 - 0.03 * j)) for j in order
    ]
    robot = replace(base, tendons=tuple(tendons))
    inputs = loop(base, LOOP[:6])
    inputs = replace(inputs, tendon=inputs.tendon[:, order])
    expected = tips_mm(fkm_exact_arm(robot, inputs, NO_GRAVITY))
    np.testing.assert_allclose(tips_of_batch_mm(robot, inputs, NO_GRAVITY), expected, atol=1e-6)


def test_knows_only_what_it_can():
    """One pair of tendons to the tip, or tendons that end in several segments, in a planar robot."""
    assert planar_batch.knows(section())
    assert planar_batch.knows(neuroendoscope())
    assert not planar_batch.knows(load_robot("spacer_disk"))
    assert not planar_batch.knows(replace(section(), tendons=section().tendons[:1]))
    assert not planar_batch.knows(replace(neuroendoscope(), links_per_subsegment=2))
