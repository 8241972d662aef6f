"""Write a robot as a self-contained MJCF file that plain MuJoCo loads.

example:
  catheter-sim build neuroendoscope_section -o model.xml --set friction.mu=0.2

The file is in SI units, as MJCF is; the robot stands along +z, and moves as it is: time step, integrator and
damping are those of `simulate --dynamic` (dynamics.motion_timestep_s, dynamics.damping_time_s). Effects that
act on the robot are in the file; effects on the way to or from it (a gain, a tracker's frame) cannot be, and
are named.
A rod between disks is a chain of links_per_subsegment links; it is said how far its tip is from a rod's.
A .toml that does not say their number gets as many as keep it within 0.1 % of the length.
limits: 400 links, joints or rings in a row, 100 tendons, 10000 holes for them; dynamics.timestep_s from
1e-05 to 0.1.
settings: --set KEY=VALUE with the dotted keys of the robot's .toml form, units in the names:
segments.section.length_mm=55, stiffness_scale=1.1, effects.precurvature.x_per_m=2.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.files import check_output_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    arguments.add_output(parser, "MODEL.xml", "file to write")


def run(options: argparse.Namespace) -> int:
    """Build, try the text in MuJoCo, then write it."""
    check_output_file(options.output)
    import mujoco

    from catheter_sim.cli.driven import load
    from catheter_sim.effects.apply import outside_the_robot
    from catheter_sim.errors import InputError
    from catheter_sim.modelling.build import build_mjcf
    from catheter_sim.robots import kind_of
    from catheter_sim.tables import replaced_when_whole

    specified, robot = load(options.robot, options.settings)
    text = build_mjcf(robot, motion=True)
    try:
        model = mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        raise InputError(f"{options.robot}: MuJoCo refuses the model: {error}") from None
    with replaced_when_whole(options.output) as file:
        file.write(text)
    size = f"{model.nbody} bodies, {model.nv} degrees of freedom, {model.ntendon} tendons"
    print(f"wrote {options.output}: {size}")
    for remark in kind_of(robot).model.remarks(robot):
        print(remark)
    outside = outside_the_robot(specified)
    if outside:
        print(f"not in the file, as they act on inputs or outputs: {', '.join(outside)}")
    return 0
