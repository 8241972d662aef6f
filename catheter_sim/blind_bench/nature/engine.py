"""A specimen with what is planted in it along a trial: commands, the MuJoCo simulation, what is seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.nature.courses import Course
from catheter_sim.blind_bench.nature.form import Planted, Scale
from catheter_sim.blind_bench.nature.shapes import Shapes, shapes_of
from catheter_sim.blind_bench.nature.specimen import Specimen
from catheter_sim.channels import tendon_inputs
from catheter_sim.columns import posture_columns
from catheter_sim.core.drive import Quantity
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.markers import marker_points
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.robots import check_robot
from catheter_sim.simulation.replay import simulate

RAMP_S = 0.3  # simulated time from row to row


class CannotMake(Exception):
    """The simulation finds no posture, or nothing that was drawn could be sized: another draw is needed."""


def possible(specimen: Specimen, u: Array) -> Array:
    """Return inputs that an actuator can give: no tension below zero, no advance beyond its stroke."""
    found = np.array(u)
    for index, drive in enumerate(specimen.drives):
        if drive.quantity is not Quantity.DISPLACEMENT:
            found[:, index] = np.clip(found[:, index], drive.least, drive.most)
    return found


def arriving(specimen: Specimen, scale: Scale, planted: Sequence[Planted], course: Course) -> Array:
    """Return what arrives at the robot's channels, shape (r, c)."""
    u = course.commands
    for item in planted:
        if item.form.command is not None:
            u = possible(specimen, item.form.command(item.acting(specimen, scale), course, u))
    return u


def changed_robot(specimen: Specimen, scale: Scale, planted: Sequence[Planted]) -> RobotSpec:
    """Return the robot that is simulated."""
    robot = specimen.robot
    for item in planted:
        if item.form.robot is not None:
            robot = item.form.robot(item.acting(specimen, scale), robot)
    return robot


def simulated(
    specimen: Specimen,
    scale: Scale,
    planted: Sequence[Planted],
    course: Course,
    rows: Sequence[int] | None = None,
    without: Shapes | None = None,
) -> Shapes:
    """Return where the robot is at some rows of a trial (default: all), before anybody looks.

    Args:
        specimen: the robot.
        scale: what is large for it.
        planted: what is planted.
        course: the trial.
        rows: those that are simulated; what arrives at them is that of the whole trial.
        without: the same rows with nothing planted, for loads that depend on where the robot is.

    Raises:
        CannotMake: the simulation diverged, or an input goes beyond a joint's range.
    """
    index = list(range(len(course))) if rows is None else list(rows)
    u = arriving(specimen, scale, planted, course)
    try:
        robot = changed_robot(specimen, scale, planted)
        check_robot(robot, robot.name)
    except InputError as error:
        raise CannotMake(str(error)) from None
    gravity = np.array(specimen.gravity_mps2)
    force = np.zeros((len(index), 3))
    body_force: dict[int, Array] = {}
    body_moment: dict[int, Array] = {}
    for item in planted:
        acting, form = item.acting(specimen, scale), item.form
        if form.gravity is not None:
            gravity = gravity + form.gravity(acting)
        if form.tip_force is not None:
            force = force + form.tip_force(acting)
        if form.tether is not None and without is not None:
            force = force + form.tether(acting, without)
        if form.body_force is not None:
            place, on_body = form.body_force(acting, course)
            body_force[place] = body_force.get(place, np.zeros((len(index), 3))) + on_body[index]
        if form.moments is not None:
            places, moments = form.moments(acting, course, u)
            for number, place in enumerate(places):
                before = body_moment.get(place, np.zeros((len(index), 3)))
                body_moment[place] = before + moments[index, number]
    bodies = tuple(sorted({*body_force, *body_moment}))
    none = np.zeros((len(index), 3))
    inputs = Inputs(
        course.time_s[index],
        robot.actuation,
        tendon_inputs(robot, robot.actuation, u[index]),
        force,
        none,
        bodies,
        np.stack([body_force.get(k, none) for k in bodies], axis=1) if bodies else np.zeros((0, 0, 3)),
        np.stack([body_moment.get(k, none) for k in bodies], axis=1) if bodies else np.zeros((0, 0, 3)),
    )
    try:
        run = simulate(robot, inputs, gravity, ramp_s=RAMP_S)
    except InputError as error:
        raise CannotMake(str(error)) from None
    if run.failure:
        raise CannotMake(run.failure)
    return shapes_of(run.postures)


def looked_at(
    specimen: Specimen, scale: Scale, planted: Sequence[Planted], course: Course, shapes: Shapes
) -> Shapes:
    """Return what is seen of all rows of a trial: shapes that differ first, then a tracker that does."""
    for item in planted:
        if item.form.shape is not None:
            shapes = item.form.shape(item.acting(specimen, scale), course, shapes)
    if specimen.robot.markers:  # a tracker sees them as it sees any point
        points = marker_points(specimen.robot.markers, shapes.p, shapes.R)
        shapes = replace(shapes, p=np.concatenate([shapes.p, points], axis=1))
    for item in planted:
        if item.form.seen is not None:
            shapes = item.form.seen(item.acting(specimen, scale), course, shapes)
    return shapes


def columns_of(specimen: Specimen, shapes: Shapes) -> Array:
    """Return the measured columns, shape (r, o), in file units."""
    values = posture_columns(specimen.robot, shapes.postures(), specimen.columns)
    return np.stack([values[name] for name in specimen.columns], axis=1)
