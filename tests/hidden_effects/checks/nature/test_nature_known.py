"""A known form is the diagnosis's own: written twice, with the same numbers, it gives the same data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.channels import tendon_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.effects.apply import with_effects
from catheter_sim.lab.engine import RAMP_S, Planted, looked_at, shapes_of, simulated
from catheter_sim.lab.forms import FORMS
from catheter_sim.simulation.replay import simulate

ROBOTS = (
    "mitral_transseptal",
    "mitral_4dof",
    "neuroendoscope_section",
    "file_displacement",
    "file_tension",
    "chest_tube_section",
)
KNOWN = [form for form in FORMS if form.known]
# With every change each form on the two robots of which one takes it at least, and one form on every robot.
WITH_EVERY_CHANGE = ("mitral_transseptal", "file_tension")
ON_EVERY_ROBOT = "backlash.play"
CASES = [
    pytest.param(
        form,
        robot,
        id=f"{form.key}-{robot}",
        marks=[] if robot in WITH_EVERY_CHANGE or form.key == ON_EVERY_ROBOT else [pytest.mark.long],
    )
    for form in KNOWN
    for robot in ROBOTS
]
SIZES = {"mount": 5.0, "quintic": 200.0}  # all channels together bend little: the fifth power needs more
# Play and friction follow the rows of whoever writes them; both read the same rows.
_SAME_M = 2e-6


@pytest.mark.slow
@pytest.mark.parametrize(("form", "robot"), CASES)
def test_known_form_gives_the_data_of_the_effect(form, robot, grounds):
    """The parameters that an interval is compared with are those that made the data."""
    ground = grounds[robot]
    gravity = np.array([0.0, 0.0, 9.81]) if form.name == "mass" else np.zeros(3)
    specimen = replace(ground.specimen, gravity_mps2=gravity)
    if not form.applies(specimen):
        pytest.skip("makes no sense for this robot")
    moved = [0.7**k * ground.courses[k].commands for k in range(len(specimen.reach))]
    course = replace(ground.courses[0], commands=0.6 * np.sum(moved, axis=0))  # all channels, unevenly
    numbers = form.draw(specimen, ground.scale, np.random.default_rng(6))
    planted = Planted(form, SIZES.get(form.name, form.start), numbers)
    inside = simulated(specimen, ground.scale, [planted], course)
    ours = looked_at(specimen, ground.scale, [planted], course, inside)
    values = form.parameters(planted.acting(specimen, ground.scale))
    base = specimen.robot
    if form.key == "stiffness.scale":  # the diagnosis scales the specification's number, not the specimen's
        base = replace(base, stiffness_scale=specimen.bench.robot.stiffness_scale)
    nothing = np.zeros((len(course), 3))
    inputs = Inputs(
        course.time_s,
        base.actuation,
        tendon_inputs(base, base.actuation, course.commands),
        nothing,
        nothing,
    )
    run = simulate(with_effects(base, {form.cause: values}), inputs, gravity, ramp_s=RAMP_S)
    assert run.failure is None
    theirs = shapes_of(run.postures)
    plain = simulated(specimen, ground.scale, (), course)
    np.testing.assert_allclose(ours.p, theirs.p, atol=_SAME_M)
    np.testing.assert_allclose(ours.angles, theirs.angles, atol=1e-4)
    # What all tendons have alike bends a robot little or not at all.
    assert np.abs(ours.p - plain.p).max() > (0.0 if form.name in ("common", "zero") else 10.0 * _SAME_M)
