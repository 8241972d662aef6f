"""Write a robot as a self-contained MJCF file that plain MuJoCo loads.

example:
  catheter-sim build neuroendoscope_section -o model.xml --set friction.mu=0.2

The file is in SI units, as MJCF is; the robot stands along +z. Effects that act on the robot are in
the file; effects on the way to or from it (a gain, a tracker's frame) cannot be, and are named.
A rod between disks is a chain of links_per_subsegment links; it is said how far its tip is from a rod's.
A .toml that does not say their number gets as many as keep it within 0.1 % of the length.
limits: 400 links, joints or rings in a row, 100 tendons, 10000 holes for them; dynamics.timestep_s from
1e-05 to 0.1.
settings: --set KEY=VALUE with the dotted keys of the robot's .toml form, units in the names:
segments.section.length_mm=55, stiffness_scale=1.1, effects.precurvature.x_per_m=2.
"""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

from catheter_sim.cli import arguments

if TYPE_CHECKING:
    from catheter_sim.robots.specification import ContinuumRobot


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    arguments.add_output(parser, "MODEL.xml", "file to write")


def run(options: argparse.Namespace) -> int:
    """Build, try the text in MuJoCo, then write it."""
    arguments.check_output_file(options.output)
    import mujoco

    from catheter_sim.cli.driven import load
    from catheter_sim.effects.apply import outside_the_robot
    from catheter_sim.errors import InputError
    from catheter_sim.mjcf.build import build_mjcf
    from catheter_sim.robots.links import tip_error_m
    from catheter_sim.robots.specification import ContinuumRobot
    from catheter_sim.tables import replaced_when_whole

    specified, robot = load(options.robot, options.settings)
    text = build_mjcf(robot)
    try:
        model = mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        raise InputError(f"{options.robot}: MuJoCo refuses the model: {error}") from None
    with replaced_when_whole(options.output) as file:
        file.write(text)
    size = f"{model.nbody} bodies, {model.nv} degrees of freedom, {model.ntendon} tendons"
    print(f"wrote {options.output}: {size}")
    if isinstance(robot, ContinuumRobot) and tip_error_m(robot) > 0.0:
        print(_links_line(robot))
    outside = outside_the_robot(specified)
    if outside:
        print(f"not in the file, as they act on inputs or outputs: {', '.join(outside)}")
    return 0


def _links_line(robot: ContinuumRobot) -> str:
    """Return what is printed on how well the chain of links stands for a rod."""
    from catheter_sim.robots.layout import links
    from catheter_sim.robots.links import BEND_RAD, tip_error_m

    error_m, length_m = tip_error_m(robot), sum(segment.length_m for segment in robot.segments)
    return (
        f"links: {robot.links_per_subsegment} per subsegment, {len(links(robot))} in all; with every segment "
        f"bent by {math.degrees(BEND_RAD):.0f} deg by its tendons alone the tip is {error_m * 1e3:.2g} mm "
        f"({100.0 * error_m / length_m:.1g} % of the length) off a rod's"
    )
