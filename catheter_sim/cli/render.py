"""Render the simulated robot, without a screen, to a video or a picture.

example:
  catheter-sim render neuroendoscope_section --inputs in.csv -o video.mp4
  catheter-sim render neuroendoscope --inputs in.csv -o last.png --width 1280 --height 960
  catheter-sim render neuroendoscope --inputs in.csv -o fifth.png --row 5

The video plays the whole file of inputs; the picture shows its last row, or the robot at --row or
--time, after all rows before it. Between two rows the inputs lie on the line from one to the other.
Inputs, units and settings are those of `catheter-sim simulate`. Width and height are in pixels.
cameras: overview (default), side (along +y, onto the bending plane).
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.files import check_output_file

CAMERAS = ("overview", "side")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    size = arguments.whole_number(16, 4096)
    arguments.add_robot(parser)
    arguments.add_inputs(parser)
    arguments.add_output(parser, "OUT.mp4|OUT.png", "file to write")
    parser.add_argument("--width", metavar="PX", type=size, default=1280, help="[pixels], default 1280")
    parser.add_argument("--height", metavar="PX", type=size, default=720, help="[pixels], default 720")
    moment = parser.add_mutually_exclusive_group()
    moment.add_argument(
        "--row", metavar="N", type=arguments.whole_number(1, 10**9), help="row of a picture; 1: the first"
    )
    moment.add_argument(
        "--time", metavar="S", type=arguments.number, help="time of a picture by the file's time_s [s]"
    )
    parser.add_argument("--camera", choices=CAMERAS, default=CAMERAS[0], help="where to look from")


def run(options: argparse.Namespace) -> int:
    """Simulate and render."""
    check_output_file(options.output)
    from catheter_sim.cli.driven import drive, inputs_until, lines_named
    from catheter_sim.errors import InputError
    from catheter_sim.pictures.images import PICTURE, suffix_of
    from catheter_sim.pictures.offscreen import render

    moment = (options.row, options.time)
    if suffix_of(options.output) != PICTURE and moment != (None, None):
        raise InputError(f"{options.output}: --row and --time choose what a picture shows; choices: .png")
    driven = drive(options)
    shown = inputs_until(driven, *moment)
    with lines_named(driven.table):
        render(
            driven.robot,
            shown,
            tuple(driven.gravity_mps2),
            options.output,
            options.width,
            options.height,
            options.camera,
            progress=True,
        )
    print(f"wrote {options.output}: {options.width} x {options.height} pixels")
    return 0
