"""Render the simulated robot, without a screen, to a video or a picture.

example:
  catheter-sim render neuroendoscope_section --inputs in.csv -o video.mp4
  catheter-sim render neuroendoscope --inputs in.csv -o last.png --width 1280 --height 960
  catheter-sim render neuroendoscope --inputs in.csv -o fifth.png --row 5
  catheter-sim render neuroendoscope --inputs in.csv -o three.png --rows 1,5,9
  catheter-sim render neuroendoscope_section --inputs in.csv -o loops.gif --curves --width 640 --height 360

The video (.mp4, or .gif) plays the whole file of inputs, with --curves beside it their curves. The
picture shows its last row, or the robot at --row or --time, after all rows before it, or several
--rows in one. Between two rows the inputs lie on the line from one to the other. Tendons are
coloured by their tension along their length; one without tension is grey. Measured points in the file
of inputs are blue balls, with a line from each computed point; three or more bodies (with the tip)
make a see-through robot.
Inputs, units and settings are those of `catheter-sim simulate`. Width and height are in pixels.
cameras: overview (default: from above, onto the plane in which the robot bends most), side (along +y). Or
give the looking direction by --azimuth and --elevation.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.files import check_output_file

CAMERAS = ("overview", "side")
_UPRIGHT_DEG = 90.0
_STEEPEST_DEG = 89.99  # straight down, the picture would have no upper side


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    size = arguments.whole_number(16, 4096)
    arguments.add_robot(parser)
    arguments.add_inputs(parser)
    arguments.add_output(parser, "OUT.mp4|OUT.gif|OUT.png", "file to write")
    parser.add_argument("--width", metavar="PX", type=size, default=1280, help="[pixels], default 1280")
    parser.add_argument("--height", metavar="PX", type=size, default=720, help="[pixels], default 720")
    moment = parser.add_mutually_exclusive_group()
    moment.add_argument(
        "--row", metavar="N", type=arguments.whole_number(1, 10**9), help="row of a picture, from 1"
    )
    moment.add_argument(
        "--time", metavar="S", type=arguments.number, help="time of a picture by the file's time_s [s]"
    )
    moment.add_argument(
        "--rows", metavar="N,N,...", type=_row_numbers, help="rows in one picture, the last in full colours"
    )
    parser.add_argument("--curves", action="store_true", help="the inputs' curves beside the video")
    parser.add_argument("--camera", choices=CAMERAS, default=CAMERAS[0], help="where to look from")
    parser.add_argument(
        "--azimuth", metavar="DEG", type=arguments.number, help="of the looking direction; 90 is along +y"
    )
    parser.add_argument(
        "--elevation", metavar="DEG", type=_elevation, help="of the looking direction; below 0 is downwards"
    )
    parser.add_argument(
        "--zoom", metavar="K", type=arguments.positive, default=1.0, help="larger by this factor; default 1"
    )
    parser.add_argument("--look-at", metavar="X,Y,Z", help="point in the picture's middle [mm]")
    parser.add_argument("--transparent", action="store_true", help="nothing behind the robot, in a picture")
    parser.add_argument("--no-legend", action="store_true", help="the robot alone: no scale, colours, inputs")
    parser.add_argument("--no-inset", action="store_true", help="no close-up of a joint, or of the base")


def _row_numbers(text: str) -> tuple[int, ...]:
    """Return numbers of rows, 1 for the first, from text like "1,5,9"."""
    number = arguments.whole_number(1, 10**9)
    return tuple(number(part.strip()) for part in text.split(","))


def _elevation(text: str) -> float:
    value = arguments.number(text)
    if abs(value) > _UPRIGHT_DEG:
        raise argparse.ArgumentTypeError(f"{text!r}: an angle from -90 to 90 is needed")
    return min(max(value, -_STEEPEST_DEG), _STEEPEST_DEG)


def run(options: argparse.Namespace) -> int:
    """Simulate and render."""
    check_output_file(options.output)
    from catheter_sim.cli.driven import drive, inputs_until, lines_named
    from catheter_sim.errors import InputError
    from catheter_sim.pictures.beside import MeasuredPoints
    from catheter_sim.pictures.images import PICTURE, suffix_of
    from catheter_sim.pictures.offscreen import Look, render

    several = options.rows or ()
    picture = suffix_of(options.output) == PICTURE
    if not picture and (options.row, options.time, options.rows) != (None, None, None):
        raise InputError(
            f"{options.output}: --row, --rows and --time choose what a picture shows; choices: .png"
        )
    if picture and options.curves:
        raise InputError(f"{options.output}: --curves stand beside a video; choices: .mp4, .gif")
    driven = drive(options)
    shown = inputs_until(driven, max(several, default=options.row), options.time)
    places = driven.recording.points_at(shown.time_s)
    measured = None if places is None else MeasuredPoints(driven.recording.point_names, places)
    with lines_named(driven.table):
        left_out = render(
            driven.robot,
            shown,
            tuple(driven.gravity_mps2),
            options.output,
            options.width,
            options.height,
            Look(
                options.camera,
                options.azimuth,
                options.elevation,
                options.zoom,
                None if options.look_at is None else arguments.vector(options.look_at, "--look-at", "mm"),
                options.transparent,
                not options.no_legend,
                not options.no_inset,
            ),
            progress=True,
            rows=[row - 1 for row in several],
            curves=options.curves,
            measured=measured,
        )
    if left_out:
        print(f"no room beside the robot for {', '.join(left_out)}; give a larger picture")
    if measured is not None:
        print(measured.words())
    print(f"wrote {options.output}: {options.width} x {options.height} pixels")
    return 0
