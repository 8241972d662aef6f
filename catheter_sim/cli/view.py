"""Show the simulated robot, with a slider for each input channel: in MuJoCo's window, or in a browser.

example:
  catheter-sim view neuroendoscope
  catheter-sim view chest_tube --web --set friction.mu=0.1 --gravity 0,0,-9.81
  catheter-sim view opencr_v4.toml --web --inputs val.csv
  catheter-sim view report

Where there is no screen, or with --web, the robot is shown in a browser: open the address that is printed. It
holds a random token, and the server listens on this machine alone. From another machine, use the tunnel that
is printed with it; --host ADDRESS lets others in your network reach the server. Ctrl+C ends it.
There are sliders for the channels in file units, the tip's force and gravity, and keys for the channels. With
--inputs a file of inputs is played, a trial's own file with its measured points. "Save CSV" writes what was
driven as a file of inputs.
In MuJoCo's window the sliders under "Control" bear the channels' names: tensions [N], displacements [m].
Tendons are coloured by tension: grey slack, yellow half, red full. "Reset" brings the robot back to rest.
The steps are this package's, friction included, in real time where the machine keeps up. Sliders reach as far
as bends each segment by 90 deg, a catheter's as far as its joints go.
A folder with a report.html in place of the robot opens that report.
"""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from catheter_sim.cli import arguments
from catheter_sim.errors import InputError

REPORT = "report.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    arguments.add_inputs(parser, required=False)
    parser.add_argument("--web", action="store_true", help="in a browser, where there is a screen, too")
    parser.add_argument("--host", metavar="ADDRESS", help="listen there: others can drive the robot")
    parser.add_argument(
        "--port", metavar="N", type=arguments.whole_number(0, 65535), default=0, help="default: a free one"
    )
    parser.add_argument("--no-browser", action="store_true", help="print the address, open nothing")


def run(options: argparse.Namespace) -> int:
    """Show; return when it is ended."""
    folder = Path(options.robot)
    if folder.name == REPORT and folder.is_file():
        folder = folder.parent
    if folder.is_dir():
        if options.inputs is not None or options.trial is not None:
            raise InputError(f"{folder}: a report plays no inputs; leave --inputs and --trial out")
        if not (folder / REPORT).is_file():
            raise InputError(f"{folder}: no {REPORT}; a robot or the folder of a report is needed")
        import webbrowser

        place = (folder / REPORT).resolve()
        print(place, flush=True)
        if not options.no_browser:
            webbrowser.open(place.as_uri())
        return 0
    if options.trial is not None and options.inputs is None:
        raise InputError(f"--trial {options.trial}: of which data set? Give its folder by --inputs")
    from catheter_sim.viewer import no_screen

    web = options.web or options.host is not None or options.inputs is not None or no_screen()
    return _in_browser(options) if web else _in_window(options)


def _in_window(options: argparse.Namespace) -> int:
    from catheter_sim.cli.driven import load
    from catheter_sim.effects.apply import outside_the_robot
    from catheter_sim.viewer import view

    specified, robot = load(options.robot, options.settings)
    _say_outside(outside_the_robot(specified))
    view(robot, arguments.gravity(options.gravity or "0,0,0"))
    return 0


def _in_browser(options: argparse.Namespace) -> int:
    from catheter_sim.cli.driven import drive, load
    from catheter_sim.effects.apply import outside_the_robot
    from catheter_sim.public.live import LOOPBACK, LiveServer, live_robot
    from catheter_sim.viewer import no_screen

    command = shlex.join([options.robot, *(part for item in options.settings for part in ("--set", item))])
    if options.inputs is None:
        specified, _ = load(options.robot, options.settings)
        live = live_robot(specified, arguments.gravity(options.gravity or "0,0,0"), command=command)
    else:
        driven = drive(options)
        specified = driven.specified
        x, y, z = driven.gravity_mps2.tolist()
        name = options.trial or Path(options.inputs).name
        live = live_robot(specified, (x, y, z), driven.recording, name, command)
    _say_outside(outside_the_robot(specified))
    server = LiveServer(live, options.host or LOOPBACK, options.port)
    server.begin()
    try:
        print(f"open {server.address}", flush=True)
        if options.host is None:
            port = server.server_port
            print(
                f"from another machine: ssh -L {port}:{LOOPBACK}:{port} USER@THIS-MACHINE, then open it there"
            )
        else:
            print(f"whoever reaches {options.host} and knows the address can see and drive this robot")
        print("Ctrl+C ends it", flush=True)
        if not (options.no_browser or no_screen()):
            import webbrowser

            webbrowser.open(server.address)
        server.stop.wait()
    except KeyboardInterrupt:
        pass
    finally:
        server.end()
    return 0


def _say_outside(names: list[str] | tuple[str, ...]) -> None:
    if names:
        print(f"the sliders leave out what acts on inputs or outputs: {', '.join(names)}", flush=True)
