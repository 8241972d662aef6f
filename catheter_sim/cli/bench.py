"""Measure the simulation's speed, as ratios against plain MuJoCo in the same run.

example:
  catheter-sim bench
  catheter-sim bench --json

Each robot, and a chain of 60 degrees of freedom with nine tendons, is simulated with tendon friction on and
off (catheters that are specified without: off only). Tensions bend it to and fro, of a catheter displacements
and an advance:
  steps/s         steps of the simulator in a second of one core
  real time       simulated seconds in a second of one core
  of plain        simulator's time over that of a plain loop of mj_step on the same model without
                  friction, fed with the same inputs. This is what the package adds in all. (Robots of
                  rolling joints: the model at rest, as by mj_step alone links do not roll nor rods
                  resist. A catheter's torsion joints: on tendons of the model's linear law.)
  friction cost   simulator with friction over simulator without; to be at most 1.5
  Python cost     simulator without friction over the plain loop; below 1 where the paths of tendons,
                  which this package computes itself, cost more than all Python
  batch 1, 2      mujoco.batch of eight copies of the plain model on one and two threads, as a share of
                  the time of a step of one copy. Without any cost of batching it would be 1 and 0.5

Then the cost of a step over the number of cells, 10 to 120, of neuroendoscope_section, and the exponent
of the power that fits it; to be at most 1.3.

The loops take turns, each figure is a median over the turns, and seconds are the processor's (of two
threads the wall clock's), so that whatever else the machine does counts little. Ratios travel from
machine to machine; steps/s do not.
Friction on means the specified coefficient, or 0.3 where the specification of another robot has none.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

from catheter_sim.cli import arguments


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument("--json", action="store_true", help="for programs")
    parser.add_argument(
        "--turns", metavar="N", type=arguments.whole_number(1, 1000), default=9, help="default 9"
    )


def run(options: argparse.Namespace) -> int:
    """Measure and print."""
    import json

    from catheter_sim.progress import EVERY_S, Stages
    from catheter_sim.speed.benchmark import ROBOTS, Speed, as_dict, measure, measure_growth, table_text
    from catheter_sim.speed.chain import GROWTH_ROBOT

    speeds: list[Speed] = []
    with Stages("bench", True, EVERY_S) as stages:
        for reference in ROBOTS:
            stages.say(reference)
            speeds.append(measure(reference, turns=options.turns))
        if GROWTH_ROBOT in ROBOTS:
            stages.say("growth of a step's cost")
            growth = measure_growth(turns=options.turns)
            speeds = [replace(item, growth=growth) if item.robot == GROWTH_ROBOT else item for item in speeds]
    print(json.dumps([as_dict(speed) for speed in speeds], indent=2) if options.json else table_text(speeds))
    return 0
