"""Play inputs on a bench, simulated or real, or let it find out by itself which cause is at work.

examples:
  catheter-sim lab mitral_4dof --hide backlash.play=8 --play in.csv -o out.csv
  catheter-sim lab mitral_4dof --hide random --seed 3 --loop -o found --reveal hidden.json
  catheter-sim lab mitral_4dof --data my_data --recordings inbox --columns tip_x_mm,tip_z_mm --loop -o found

The bench is a robot that starts at rest, plays a file of inputs row by row, each held until it rests, and
measures. It refuses what goes beyond its limits: --limit INPUT=LEAST,MOST in the unit of the column (tension
[N], travel [mm]; force_tip_z_N where a known mass can be hung), --longest [s] for one play.

A simulated bench hides what --hide says: CAUSE, CAUSE.FORM or CAUSE.FORM=SIZE by the names in
docs/truth/independent_bench.md, or `random`. These are laws that the diagnosis does not share. A size that is
left out is drawn so that it shows; the tracker's noise and the specimen's errors are drawn too (--seed).
--reveal writes what is hidden.

A real bench is a folder, --recordings: the loop puts NAME_inputs.csv there and reads NAME.csv (time_s and
--columns) when it has arrived whole. Files may come half-written, twice, or in any order.

--loop diagnoses, proposes the programme that best tells apart the causes that are still likely, plays it in
six sizes, and diagnoses everything together. It ends when one cause has a probability of 0.95, or with the
budget (--experiments, --minutes). It begins with --data, a data set, or by playing the loops of each
channel. DIR gets story.md and story.html, which tell it, data/ (a data set for `diagnose`), diagnosis/
(the last report), experiments/ and steps.json; started again with the same DIR it goes on.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

from catheter_sim.cli import arguments
from catheter_sim.errors import InputError
from catheter_sim.files import check_output_file, check_output_folder

if TYPE_CHECKING:
    from catheter_sim.lab.rig import Rig
    from catheter_sim.lab.simulated import SimulatedRig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument("robot", metavar="ROBOT", help="robot id (see `list`) or path of a robot .toml")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--play", metavar="IN.csv", help="inputs to play once; -o is a file")
    what.add_argument("--loop", action="store_true", help="find out which cause is at work; -o is a folder")
    arguments.add_output(parser, "OUT", "file of the recording (--play), or folder (--loop)")
    parser.add_argument(
        "--hide",
        metavar="CAUSE",
        action="append",
        help="what is wrong with the simulated robot; may be repeated",
    )
    parser.add_argument(
        "--seed",
        type=arguments.whole_number(0, 2**31),
        default=0,
        help="of specimen, sizes and noise; default 0",
    )
    parser.add_argument("--reveal", metavar="FILE.json", help="write what is hidden")
    parser.add_argument("--recordings", metavar="FOLDER", help="a real bench: where its recordings arrive")
    arguments.add_columns(parser)
    parser.add_argument(
        "--gravity", metavar="GX,GY,GZ", help="of a real bench, base frame [m/s^2]; default 0,0,0"
    )
    arguments.add_limits(parser)
    parser.add_argument(
        "--longest",
        metavar="SECONDS",
        type=arguments.positive,
        default=3600.0,
        help="one play may take; default 3600",
    )
    parser.add_argument("--data", metavar="DATASET", help="recordings that there are already (--loop)")
    parser.add_argument(
        "--experiments",
        metavar="N",
        type=arguments.whole_number(0, 1000),
        default=5,
        help="that may be made; default 5",
    )
    parser.add_argument(
        "--minutes",
        metavar="MIN",
        type=arguments.positive,
        default=math.inf,
        help="of the bench's time; default no end",
    )
    parser.add_argument(
        "--wait",
        metavar="SECONDS",
        type=arguments.not_negative,
        default=0.0,
        help="for a recording to arrive; default 0, which says what is missing and ends",
    )
    arguments.add_jobs(parser)


def run(options: argparse.Namespace) -> int:
    """Play once, or run the loop."""
    _check_together(options)
    if options.reveal is not None:
        check_output_file(options.reveal)
    if options.play is not None:
        return _play(options)
    return _loop(options)


def _check_together(options: argparse.Namespace) -> None:
    if options.recordings is not None:
        for name in ("hide", "reveal", "play"):
            if getattr(options, name):
                raise InputError(
                    f"--{name}: a real bench (--recordings) hides nothing and is played by --loop"
                )
        if not options.columns or not options.limits:
            raise InputError(
                "--recordings: --columns and --limit are needed: what the bench measures and can do"
            )
    elif options.gravity is not None:
        raise InputError("--gravity: of a real bench alone; a simulated one draws its own")
    if options.play is not None and options.data is not None:
        raise InputError("--data: is where --loop begins; --play plays one file")


def _play(options: argparse.Namespace) -> int:
    check_output_file(options.output)
    from catheter_sim.tables import read_table, write_table

    inputs = read_table(options.play)
    rig = _simulated(options)
    rig.reset()
    rig.play(inputs, Path(options.play).stem)
    found = rig.read(arguments.columns(options.columns))
    write_table(found, options.output)
    print(f"wrote {options.output}: {len(found.time_s)} rows")
    _reveal(options, rig)
    return 0


def _loop(options: argparse.Namespace) -> int:
    folder = check_output_folder(options.output)
    from catheter_sim.closed_loop.loop import Budget, begun_with, run_loop
    from catheter_sim.closed_loop.story import PAGE, STORY, title_of, write_story
    from catheter_sim.diagnosis.dataset import load_dataset
    from catheter_sim.diagnosis.workers import Workers

    rig = _recorded(options) if options.recordings is not None else _simulated(options)
    first = []
    if options.data is not None:
        first = begun_with(rig, load_dataset(options.data), options.data)
    budget = Budget(options.experiments, options.minutes, wait_s=options.wait)
    outcome = run_loop(
        rig, folder, first, budget, Workers(options.jobs), True, lambda line: print(line, flush=True)
    )
    write_story(outcome, rig.robot.name, folder)
    print(f"{title_of(outcome, rig.robot.name)}: {outcome.words}")
    print(f"wrote {folder / STORY}, {PAGE}, data, diagnosis and steps.json")
    if options.recordings is None:
        _reveal(options, _simulated(options))
    return 0


def _simulated(options: argparse.Namespace) -> SimulatedRig:
    from catheter_sim.lab.simulated import stand_in

    return stand_in(
        options.robot,
        options.hide or (),
        options.seed,
        arguments.limits(options.limits) or None,
        options.longest,
        further=arguments.columns(options.columns) or (),
    )


def _recorded(options: argparse.Namespace) -> Rig:
    import numpy as np

    from catheter_sim.lab.recorded import recorded_rig

    return recorded_rig(
        Path(options.recordings),
        options.robot,
        tuple(arguments.columns(options.columns) or ()),
        arguments.limits(options.limits),
        options.longest,
        np.array(arguments.gravity(options.gravity or "0,0,0")),
    )


def _reveal(options: argparse.Namespace, rig: SimulatedRig) -> None:
    if options.reveal is None:
        return
    from catheter_sim.tables import replaced_when_whole

    with replaced_when_whole(options.reveal) as file:
        file.write(json.dumps(rig.answer(), indent=1, default=float) + "\n")
    print(f"wrote {options.reveal}: what is hidden")
