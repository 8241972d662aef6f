"""The list of forms is what is promised of it, and every form does nothing at size zero."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.effects import EFFECTS
from catheter_sim.lab.engine import Planted, Scale, changed_robot, possible
from catheter_sim.lab.forms import BY_KEY, CAUSES, FORMS, OUTSIDE
from catheter_sim.lab.forms.inputs import crossed
from hidden_effects.natural import STORIES, story_of
from hidden_effects.planting import forms_for, outside_for

SCALE = Scale(0.1, 50.0, 0.5, 30.0, 0.2, 0.04)


def test_every_cause_of_the_closed_list_has_three_forms():
    """The names are those of the list; each has a known form and a foreign one for either purpose."""
    assert set(CAUSES) == set(EFFECTS)
    for cause in CAUSES:
        forms = [form for form in FORMS if form.cause == cause]
        assert len(forms) >= 3, cause
        assert any(form.known for form in forms), cause
        for purpose in ("tune", "judge"):
            assert any(not form.known for form in forms_for(purpose, cause)), (cause, purpose)


def test_no_foreign_form_serves_both_purposes():
    """What judges has never been tuned on; known forms serve both."""
    assert {form.purpose for form in FORMS} == {"both", "tune", "judge"}
    assert {form.purpose for form in OUTSIDE} == {"tune", "judge"}
    assert not set(outside_for("tune")) & set(outside_for("judge"))
    assert min(len(outside_for("tune")), len(outside_for("judge"))) >= 3
    assert len(BY_KEY) == len(FORMS) + len(OUTSIDE)


def test_every_choice_of_a_known_form_has_the_numbers_that_a_draw_has(plain_ground, pulled_ground):
    """So that it can be laid beside another cause; one that lacked a number ended a whole run."""
    for ground in (plain_ground, pulled_ground):
        specimen = ground.specimen
        for form in FORMS:
            if not (form.known and form.applies(specimen)):
                continue
            drawn = form.draw(specimen, SCALE, np.random.default_rng(2))
            choices = list(form.every(specimen, SCALE))
            assert choices, form.key
            assert all(set(numbers) == set(drawn) for numbers in choices), form.key


def test_known_forms_name_parameters_of_the_diagnosis(plain_ground, pulled_ground):
    """What is compared with an interval is a parameter that the cause has for that robot."""
    for ground in (plain_ground, pulled_ground):
        specimen = ground.specimen
        for form in FORMS:
            if not (form.known and form.applies(specimen)) or form.name == "mass":
                continue
            numbers = form.draw(specimen, SCALE, np.random.default_rng(2))
            named = form.parameters(Planted(form, 2.0, numbers).acting(specimen, SCALE))
            own = {item.name for item in EFFECTS[form.cause].parameters(specimen.bench.robot)}
            assert set(named) <= own, form.key
            assert named, form.key


@pytest.mark.slow
@pytest.mark.parametrize("key", BY_KEY)
def test_size_zero_does_nothing(key, plain_ground, pulled_ground):
    """Commands, robot, loads and shapes stay as they are, wherever the form makes sense."""
    form = BY_KEY[key]
    for ground in (plain_ground, pulled_ground):
        specimen, course = ground.specimen, ground.courses[0]
        if not form.applies(specimen):
            continue
        numbers = form.draw(specimen, SCALE, np.random.default_rng(2))
        planted = Planted(form, 0.0, numbers)
        acting = planted.acting(specimen, SCALE)
        if form.command is not None:
            same = form.command(acting, course, course.commands)
            np.testing.assert_allclose(same, course.commands, atol=1e-7)
        if form.robot is not None:
            assert changed_robot(specimen, SCALE, [planted]) == specimen.robot
        if form.gravity is not None:
            assert not form.gravity(acting).any()
        if form.moments is not None:
            np.testing.assert_allclose(form.moments(acting, course, course.commands)[1], 0.0, atol=1e-15)
        for hook in (form.shape, form.seen):
            if hook is not None:
                shapes = ground.plain[0]
                np.testing.assert_allclose(hook(acting, course, shapes).p, shapes.p, atol=1e-9)


def test_stories_are_dealt_in_their_shares():
    """Of 450 draws of any seed: 150, 200, 60 and 40; the purposes have their own order."""
    told = [story_of("judge", 7, index) for index in range(450)]
    assert [told.count(name) for name in ("none", "single", "pair", "outside")] == [150, 200, 60, 40]
    assert len(STORIES) == 45
    assert told != [story_of("tune", 7, index) for index in range(450)]


def test_no_actuator_pushes(pulled_ground):
    """Tensions below zero do not arrive."""
    assert possible(pulled_ground.specimen, np.array([[-1.0, 0.2]])).tolist() == [[0.0, 0.2]]


def test_coupling_goes_to_the_other_part_alone(plain_ground):
    """One unit of one channel arrives as one unit at the other joint's channel."""
    matrix = crossed(plain_ground.specimen, "bending", "torsion_distal")
    assert matrix.sum() == 1.0
    names = [drive.channel for drive in plain_ground.specimen.drives]
    assert matrix[names.index("torsion_distal"), names.index("bending")] == 1.0


def test_constant_friction_leaves_each_joint_its_own_tension(pulled_ground):
    """The moments above a joint add up to the arm times what its tension has lost."""
    form = BY_KEY["tendon_friction.constant"]
    specimen = pulled_ground.specimen
    course = pulled_ground.courses[0]
    u = np.linspace(0.0, 0.4, 9)[:, np.newaxis] * np.array([1.0, 0.0])
    places, moments = form.moments(Planted(form, 10.0, {}).acting(specimen, SCALE), course, u)
    arm = specimen.bench.robot.tendons[0].radius_m
    lost = moments[-1, :, 1][::-1].cumsum()[::-1] / arm
    np.testing.assert_allclose(lost, -0.1 * 0.4 * np.arange(1, 6) / 5)
    assert places == (6, 12, 18, 24, 30)
