"""Compare the simulation in motion with a real hanging trunk that swings, with three weights at its end.

    python scripts/trunk_motion.py SOURCE_FOLDER [--seconds 60]

SOURCE_FOLDER holds `moving_000g.csv`, `moving_100g.csv`, `moving_300g.csv`, of
github.com/StanfordASL/trunk-stack (commit 8b4b923, MIT): 100 rows a second, the same random commands for
every weight. The robot is that of
`assets/examples/trunk`, fitted by hand to postures at rest without a weight; a weight is added to its tip.
Nothing is fitted to motion but the damping, of which three values are tried. Motors' angles are logged anew
at every fifth row or so: the mean of the three recordings is taken, over nine rows.

Printed is a table in Markdown: the tip's distance, root mean square, the mean offset taken out, for the
simulation in motion and for the robot at rest under each row's inputs; how far the tip moves about its
mean; at how many hertz the simulated trunk swings when it is let go; and where what the tip does beyond the
robot at rest has its largest peak above 1.2 Hz, measured and simulated with the most damping.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
from convert_trunk import AXIS_MM, DEFAULT_OUTPUT, MASSES, PULLS, SPOOL_MM, tendons
from scipy.signal import welch

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.cli.arguments import whole_number
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.simulation.replay import simulate

GRAVITY_MPS2 = np.array([0.0, 0.0, 9.81])
DAMPING_S = (0.0, 0.01, 0.02)  # of the stiffness
STEP_ROWS, SMOOTHED_ROWS = 4, 9
AWAY_S = 2.0  # at the start, which the motion before it still moves
SLOWEST_SWING_HZ = 1.2  # what is slower follows the commands


def main() -> int:
    """Print the table; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("source", type=Path, metavar="SOURCE_FOLDER")
    parser.add_argument("--seconds", type=whole_number(4, 150), default=60, help="of each; default 60")
    options = parser.parse_args()
    try:
        recordings = {mass: recording_of(options.source / f"moving_{mass}.csv") for mass in MASSES}
    except InputError as error:
        print(f"trunk_motion: error: {error}", file=sys.stderr)
        return 2
    rows = slice(0, 100 * options.seconds, STEP_ROWS)
    inputs = common_inputs(list(recordings.values()), rows)
    names = [
        "weight",
        "tip moves by",
        "at rest",
        *(f"damping {value:g} s" for value in DAMPING_S),
        "swings at",
        "peak measured",
        "peak simulated",
    ]
    print(f"| {' | '.join(names)} |\n" + "|---" * len(names) + "|")
    for mass, recording in recordings.items():
        measured = tip_of(recording)[rows]
        robots = [trunk(float(mass[:3]), damping) for damping in DAMPING_S]
        rest = computed_tip(robots[0], inputs, dynamic=False)
        moving = [computed_tip(robot, inputs, dynamic=True) for robot in robots]
        told_mm = [apart(path, measured) for path in (np.zeros(3), rest, *moving)]
        told_hz = [swings_hz(robots[0], inputs.tendon[len(inputs) // 2])]
        told_hz += [peak_hz(path - rest, inputs.time_s[1]) for path in (measured, moving[-1])]
        cells = [*(f"{value:.1f} mm" for value in told_mm), *(f"{value:.2f} Hz" for value in told_hz)]
        print(f"| {mass} | {' | '.join(cells)} |", flush=True)
    return 0


def recording_of(path: Path) -> np.ndarray:
    """Return a recording's columns by name."""
    try:
        return np.genfromtxt(path, delimiter=",", names=True)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None


def common_inputs(recordings: list[np.ndarray], rows: slice) -> Inputs:
    """Return what the motors did in all of them, as travels of the twelve tendons."""
    window = np.ones(SMOOTHED_ROWS) / SMOOTHED_ROWS
    travel = {}
    for motor in PULLS:
        angle = np.mean([item[f"motor_{motor}_deg"] for item in recordings], axis=0)
        smooth = np.convolve(np.pad(angle, SMOOTHED_ROWS // 2, mode="edge"), window, "valid")
        travel[motor] = 1e-3 * SPOOL_MM * np.radians(smooth[rows])
    signed = [
        (1.0 if name.endswith("_in") else -1.0) * travel[int(name.split("_")[1])] for name, _, _ in tendons()
    ]
    time_s = recordings[0]["time_s"][rows]
    nothing = np.zeros((len(time_s), 3))
    return Inputs(time_s - time_s[0], "displacement", np.array(signed).T, nothing, nothing)


def tip_of(recording: np.ndarray) -> Array:
    """Return the tip in the robot's base frame, z down, shape (r, 3) [mm]."""
    x, y, z = (recording[f"tip_{axis}_mm"] for axis in "xyz")
    return np.array([x - AXIS_MM[0], z - AXIS_MM[1], -y]).T


def trunk(weight_g: float, damping_s: float) -> RobotSpec:
    """Return the trunk with a weight at its tip and a damping in the place of its file's."""
    file = DEFAULT_OUTPUT / "trunk.toml"
    own_g = tomllib.loads(file.read_text(encoding="utf-8"))["tip_mass_g"]
    return load_robot(file, {"tip_mass_g": own_g + weight_g, "dynamics.damping_time_s": damping_s})


def computed_tip(robot: RobotSpec, inputs: Inputs, dynamic: bool) -> Array:
    """Return the simulated tip, shape (r, 3) [mm]."""
    run = simulate(robot, inputs, GRAVITY_MPS2, dynamic=dynamic)
    if run.failure is not None:
        raise SystemExit(f"trunk_motion: {run.failure}")
    return 1e3 * np.array([posture.p_w[-1] for posture in run.postures])


def apart(one: Array, other: Array) -> float:
    """Return the root mean square distance of two paths after `AWAY_S`, the mean taken out [mm]."""
    away = round(100 * AWAY_S / STEP_ROWS)
    error = (one - other)[away:]
    return float(np.sqrt(np.nanmean(np.sum((error - np.nanmean(error, axis=0)) ** 2, axis=1))))


def peak_hz(beyond: Array, step_s: float) -> float:
    """Return where the spectrum of a path across the axis, shape (r, 3), is largest above the commands."""
    across = beyond[round(AWAY_S / step_s) :, :2]
    frequency_hz, power = welch(across, 1.0 / step_s, nperseg=256, axis=0)
    fast = frequency_hz > SLOWEST_SWING_HZ
    return float(frequency_hz[fast][power.sum(axis=1)[fast].argmax()])


def swings_hz(robot: RobotSpec, pulled: Array) -> float:
    """Return how often the trunk swings when half of a pull is let go, by where its tip crosses its rest."""
    time_s = np.arange(0.0, 6.0, 0.02)
    tendon = np.where(time_s[:, np.newaxis] < 0.1, 0.5 * pulled, 0.0)
    nothing = np.zeros((len(time_s), 3))
    held = Inputs(time_s, "displacement", tendon, nothing, nothing)
    path = computed_tip(replace(robot, effects={}), held, dynamic=True)[10:, :2]
    along = path @ np.linalg.svd(path - path[-1], full_matrices=False)[2][0]
    side = np.sign(along - along[-50:].mean())
    crossed = np.flatnonzero(np.diff(side) != 0.0)
    return float(0.5 * (len(crossed) - 1) / (0.02 * (crossed[-1] - crossed[0])))


if __name__ == "__main__":
    sys.exit(main())
