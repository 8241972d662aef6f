"""Checks of the full chest-tube robot (chest_tube_2025, doi 10.1109/LRA.2025.3597860): eight rods, 25 joints.

Where rods work against one another, friction goes by how a rod slides through each link, which the
robot beyond decides: so do the simulation and, with code of their own, the complete statics. A rule on
each rod's own tensions, by which the tension behind a link keeps its value unless the capstan's interval
pushes it, is shown beside them; it agrees where a rod is pulled alone. Which is right is counted by
`chest_tube_coulomb`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import Friction
from catheter_sim.robots.rolling.complete import complete, postures, solve_history_by_virtual_work
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.robots.rolling.published import chest_tube
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation import plots
from catheter_sim.validation.chest_tube_coulomb import moment_left, violations
from catheter_sim.validation.chest_tube_loads import compare, compared_lines
from catheter_sim.validation.drives import NO_GRAVITY, history, largest_distance, tips_mm
from catheter_sim.validation.lines import Line, Validation
from catheter_sim.validation.shown import Against

FULL = "chest_tube"


TIP_MM, JOINT_DEG = 0.375, 0.05  # 0.1 % of 375 mm


LEFT_NMM = 0.01  # moment that may be left at a joint at rest: 1e-4 of what 10 N does at 10 mm


# Tensions of the rods base right, left, middle right, left, tip right, left, front, back [N]: base,
# middle and tip each way, in both planes.
SETS_N = np.array(
    [
        (20, 0, 0, 0, 0, 0, 0, 0),
        (20, 0, 10, 0, 0, 0, 0, 0),
        (0, 15, 15, 0, 0, 0, 0, 0),
        (0, 15, 0, 10, 0, 0, 10, 0),
        (30, 0, 0, 0, 15, 0, 0, 0),
        (30, 0, 0, 0, 10, 0, 15, 0),
        (0, 30, 0, 0, 0, 15, 0, 10),
        (10, 10, 0, 0, 0, 0, 0, 20),
        (0, 0, 20, 0, 0, 20, 0, 0),
        (0, 0, 0, 20, 10, 0, 0, 10),
        (15, 0, 0, 10, 0, 0, 15, 0),
        (0, 10, 5, 0, 0, 10, 5, 2),
    ],
    dtype=float,
)


ACROSS = {"+x": np.array([9.81, 0.0, 0.0]), "+y": np.array([0.0, 9.81, 0.0])}


# Corners of histories with friction, from zero, in which rods work against one another.
AGAINST = {
    "base left held at 5 N, base right to 25 N and back": ((0, 5), (25, 5), (0, 5)),
    "base right to 20 N, tip right to 15 N then": ((20, 0, 0, 0, 0), (20, 0, 0, 0, 15)),
}


_ROW_N = 1.0  # between rows of a history


_EVERY = 5  # rows of which one is put on the scales


_RAMP_S = 0.25  # for one such small step


def validate_full(folder: Path) -> Validation:
    """Check the full robot; plots go into `folder`."""
    histories = [_against(name, np.array(corners, dtype=float)) for name, corners in AGAINST.items()]
    lines = _frictionless_lines() + _alone_lines()
    lines += [line for item in histories for line in _against_lines(item)]
    plots.histories(histories, folder / f"{FULL}_friction.png")
    return Validation(tuple(lines), tuple(_finding(item) for item in histories))


def _frictionless_lines() -> list[Line]:
    robot, lines = replace(chest_tube(), friction=Friction(0.0)), []
    for name, gravity in ACROSS.items():
        what = f"mu 0, {len(SETS_N)} sets of tensions, both planes, gravity {name}"
        lines += compared_lines(FULL, what, compare(robot, SETS_N, gravity), (TIP_MM, JOINT_DEG))
    return lines


def _alone_lines() -> list[Line]:
    """Compare, with friction, the ways of single rods to 30 N and back."""
    robot, lines = chest_tube(), []
    for index in (0, 3, 4, 6):  # base, middle, tip in both planes
        rows = np.zeros((3, len(robot.tendons)))
        rows[:, index] = (30.0, 10.0, 0.0)
        what = f"friction, {robot.tendons[index].name} alone to 30 N and back"
        lines += compared_lines(FULL, what, compare(robot, rows), (TIP_MM, JOINT_DEG))
    return lines


def _against(name: str, corners: Array) -> Against:
    robot = chest_tube()
    every = np.zeros((len(corners) + 1, len(robot.tendons)))
    every[1:, : corners.shape[1]] = corners
    inputs = history(every.tolist(), _ROW_N)
    return Against(
        name,
        inputs.tendon,
        simulate(robot, inputs, NO_GRAVITY, ramp_s=_RAMP_S).postures,
        complete(robot, inputs, NO_GRAVITY).postures,
        _by_tensions(inputs),
    )


def _by_tensions(inputs: Inputs) -> tuple[Posture, ...]:
    chain = rolling_chain(chest_tube())
    solved = solve_history_by_virtual_work(chain, inputs, NO_GRAVITY)
    return tuple(postures(chain, inputs, NO_GRAVITY, solved.theta, solved.at_joint, solved.link_length))


def _against_lines(item: Against) -> list[Line]:
    robot, lines = chest_tube(), []
    far = largest_distance(tips_mm(item.simulated), tips_mm(item.analytic))
    lines.append(Line(FULL, f"friction, {item.name}: tip, largest", "mm", far, TIP_MM, "complete statics"))
    for name, seen, tolerance in (
        ("simulation", item.simulated, 0.0),
        ("complete", item.analytic, 0.0),
        ("rods' own tensions", item.by_tensions, None),
    ):
        wrong, slides = violations(robot, seen)
        what = f"{item.name}, {name}: times that a rod slides in a link without full friction, of {slides}"
        source = "Coulomb's law, from the postures alone"
        lines.append(Line(FULL, what, "-", float(wrong), tolerance, source, ours=float(wrong)))
    left = moment_left(robot, item.simulated[::_EVERY], NO_GRAVITY) * 1e3
    what = f"{item.name}, simulation: moment left at a joint under its own tensions, largest"
    lines.append(Line(FULL, what, "N mm", left, LEFT_NMM, "complete Newton-Euler balance", ours=left))
    return lines


def _finding(item: Against) -> str:
    robot = chest_tube()
    theirs, slides = violations(robot, item.by_tensions)
    ours, _ = violations(robot, item.simulated)
    far = np.linalg.norm(tips_mm(item.simulated) - tips_mm(item.by_tensions), axis=1)
    k = int(far.argmax())
    return (
        f"{FULL}, {item.name}: the simulated tip lies up to {far[k]:.1f} mm from statics whose rods keep "
        f"their own tensions. The simulation is right: every link of it is in balance, and its rods slide "
        f"without full friction {ours} times, those of such statics {theirs} times of {slides}. A "
        f"held rod that the robot's motion draws through its holes must turn its friction round, which its "
        f"own history does not know."
    )
