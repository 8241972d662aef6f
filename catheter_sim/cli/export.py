"""Write a robot with its effects as one MJCF that plain MuJoCo runs, and say what it costs.

example:
  catheter-sim export neuroendoscope_section -o model.xml
  catheter-sim export report/robot.toml -o model.xml --for mujoco

`build` writes the robot without what runs beside the package's steps. `export` puts that in, as far as
MuJoCo has it:
  joints that roll         slides that their hinges move
  friction, rods, metal    springs and plastic springs (springyield, MuJoCo 4) of the hinges, fitted to loops
                           of the simulation
  gains, offsets, couplings, lags, delays, creep, a constant force on the tip    actuators
  a tracker's frame and delay    the sensors'
outputs: MODEL.xml, in SI units, with a keyframe `rest`, sensors `position_<k>`, `tip_position` [m] and
`tip_quat`, and a text `control_<actuator>` that says what each control is. MODEL_export.json beside it has
what this command prints: how each cause travelled, and what did not, with its cost in mm. It also has how far
the file in MuJoCo alone is from `simulate`, on loops that were not fitted, in mm and % of the length.
--for mjx, --for warp: without plastic springs (friction losses in their place), delays and implicit springs.
The file is written before it is judged; a robot of many disks may take minutes for either.
exit status: 1 where the file is more than 2 % of the length off; it is written all the same.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.files import check_output_file

_ENGINES = ("mujoco", "mjx", "warp")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    arguments.add_output(parser, "MODEL.xml", "file to write; its report goes beside it")
    parser.add_argument(
        "--no-judge", action="store_true", help="write the file alone, without measuring how far it is off"
    )
    parser.add_argument(
        "--for", dest="engine", choices=_ENGINES, default="mujoco", help="engine that is to run it"
    )


def run(options: argparse.Namespace) -> int:
    """Fit, judge, write, and say what was found."""
    from catheter_sim.public.laboratories import Export, report_path

    check_output_file(options.output)
    check_output_file(report_path(options.output))
    from catheter_sim.catalogue import load_robot
    from catheter_sim.exporting.judge import PERCENT, judge
    from catheter_sim.exporting.write import write_model
    from catheter_sim.progress import note
    from catheter_sim.tables import replaced_when_whole

    robot = load_robot(options.robot, options.settings, "--set")
    model = write_model(robot, options.engine, progress=True)
    with replaced_when_whole(options.output) as file:
        file.write(model.text)
    if options.no_judge:
        print(f"wrote {options.output}; how far it is off was not measured")
        return 0
    note(f"wrote {options.output}; now it is judged on loops that were not fitted")
    found = Export(model, judge(model, progress=True))
    report = found.save(options.output)
    print(found.report(), end="")
    print(f"wrote {options.output}, {report}")
    if found.percent <= PERCENT:
        return 0
    print(f"not within {PERCENT:g} % of the length")
    return 1
