"""Show the simulated robot in MuJoCo's interactive viewer, with sliders for its inputs.

example:
  catheter-sim view neuroendoscope
  catheter-sim view chest_tube --set friction.mu=0.1 --gravity 0,0,-9.81

The sliders under "Control" bear the names of the input channels: tensions [N] or displacements [m],
of a catheter the pairs' displacements and the tube's advance; they reach as far as bends each
segment by 90 deg, a catheter's as far as its joints go. The steps are this package's, friction
included, in real time where the machine keeps up. Tendons are coloured along their length by
tension: grey slack, yellow half, red full. "Reset" brings the robot back to rest. Without a screen:
one line on stderr, exit status 2.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    arguments.add_gravity(parser)


def run(options: argparse.Namespace) -> int:
    """Open the viewer; return when it is closed."""
    gravity_mps2 = arguments.gravity(options.gravity)
    from catheter_sim.cli.driven import load
    from catheter_sim.effects.apply import outside_the_robot
    from catheter_sim.viewer import view

    specified, robot = load(options.robot, options.settings)
    outside = outside_the_robot(specified)
    if outside:
        print(f"not shown, as they act on inputs or outputs: {', '.join(outside)}", flush=True)
    view(robot, gravity_mps2)
    return 0
