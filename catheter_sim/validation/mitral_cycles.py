"""The transseptal catheter's joints without the tube, and ten cycles of each (Nayar 2022, Fig. 6, Section
IV-A).

Fig. 6 prints two R^2 of pure kinematics for each joint, and neither the friction nor the dead-band of the
specimen without the tube; d_b is printed with it alone. Read as the displacement growing and falling, the
two R^2 leave two
numbers: the drive's dead-band, and where the displacement has its zero. They are fitted, `DEAD_BANDS_MM`.
With prestressed springs, as in the paper, there is no dead-band.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.robots.catheter import measured as modified
from catheter_sim.robots.catheter.description import moved_segment
from catheter_sim.robots.catheter.kinematics import angle_rad, pulled_m
from catheter_sim.robots.catheter.published import mitral_transseptal, mitral_transseptal_tube
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation import mitral_plots
from catheter_sim.validation.drives import NO_GRAVITY
from catheter_sim.validation.lines import FITTED, PREDICTED, Line, Validation
from catheter_sim.validation.mitral import joint_angles_deg
from catheter_sim.validation.mitral_loops import (
    JOINTS,
    LEG_S,
    ROWS_PER_S,
    JointLoops,
    largest_displacement_m,
    loops_of,
    moving,
    pure,
    r_squared,
    waves,
    with_play,
)

NAME = "mitral_transseptal"
FIGURE_6 = {"bending": (0.9972, 0.995), "torsion_proximal": (0.962, 0.9134)}  # R^2 without the springs
DEAD_BANDS_MM = {"bending": (0.290, -0.027), "torsion_proximal": (0.842, -0.135)}  # whole width; zero. Fitted
_FITTED = "Nayar 2022, Fig. 6(a); dead-band and zero of the drive are from these two"
CYCLES = 10


@dataclass(frozen=True)
class Bare:
    """A joint's loops without the tube: with springs, and without; the zero of the latter's displacement
    [m]."""

    sprung: JointLoops
    slack: JointLoops
    zero_m: float


def validate_cycles(folder: Path) -> Validation:
    """Check the loops without the tube and the ten cycles; draws `mitral_loops_bare.png` (Fig. 6)."""
    found = {joint: bare_loops(joint) for joint in FIGURE_6}
    lines = [line for joint in FIGURE_6 for line in bare_lines(joint, found[joint])]
    lines += [repeat_line(joint, ten_cycles(joint)) for joint in JOINTS]
    robot = mitral_transseptal()
    shown = [
        (f"{joint}, no tube, {name}", item, {"PK": pure(robot, item)})
        for joint, bare in found.items()
        for name, item in (("springs", bare.sprung), ("no springs", bare.slack))
    ]
    mitral_plots.loops(shown, folder / "mitral_loops_bare.png")
    return Validation(tuple(lines), (_finding(),))


def bare_loops(joint: str) -> Bare:
    """Return a joint's simulated loops to both limits without the tube."""
    robot = mitral_transseptal()
    segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
    top = float(pulled_m(segment, segment.limit_rad))
    width_mm, zero_mm = DEAD_BANDS_MM[joint]
    sprung, slack = (
        loops_of(with_play(robot, joint, way), joint, True, top) for way in (0.0, width_mm * 1e-3)
    )
    return Bare(sprung, slack, zero_mm * 1e-3)


def bare_lines(joint: str, bare: Bare) -> list[Line]:
    """Return how much of each branch pure kinematics leaves unexplained, with springs and without."""
    robot, lines = mitral_transseptal(), []
    segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
    item = bare.slack
    limit = float(pulled_m(segment, segment.limit_rad))
    told = angle_rad(segment, np.clip(item.displacement_m + bare.zero_m, -limit, limit))
    names = ("displacement growing", "displacement falling")
    for name, rows, printed in zip(names, growing_falling(item), FIGURE_6[joint], strict=True):
        left = 1.0 - r_squared(item.angle_rad[rows], told[rows])
        what = f"{joint}, no tube, without the spring, {name}: 1 - R^2 of pk"
        wanted = 1.0 - printed
        lines.append(Line(NAME, what, "-", abs(left - wanted), None, _FITTED, left, None, wanted, FITTED))
    for name, rows in zip(names, growing_falling(bare.sprung), strict=True):
        left = 1.0 - r_squared(bare.sprung.angle_rad[rows], pure(robot, bare.sprung)[rows])
        what = f"{joint}, no tube, with the spring, {name}: 1 - R^2 of pk"
        lines.append(Line(NAME, what, "-", left, 1e-4, "no slack, so Eqs 3 and 6", left, kind=PREDICTED))
    return lines


def growing_falling(item: JointLoops) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows in which the displacement grows and falls, after the first leg, each (r,)."""
    step = np.diff(item.displacement_m, prepend=item.displacement_m[0])
    later = np.arange(len(step)) > round(LEG_S * ROWS_PER_S)
    return later & (step > 0.0), later & (step < 0.0)


def ten_cycles(joint: str) -> Array:
    """Return a joint's angle with the tube in ten equal cycles to its largest displacement, (10, r) [deg]."""
    robot = mitral_transseptal_tube()
    corners = np.zeros(2 * CYCLES + 1)
    corners[1::2] = largest_displacement_m(robot, joint)
    way = waves(corners)
    rows = np.zeros((len(way), 4))
    rows[:, JOINTS.index(joint)] = way
    postures = simulate(robot, moving(rows), NO_GRAVITY, dynamic=True).postures
    return joint_angles_deg(robot, postures)[joint][1:].reshape(CYCLES, -1)


def repeat_line(joint: str, angle_deg: Array) -> Line:
    """Return how far the second to the tenth cycle lie apart at one displacement."""
    apart = float(np.ptp(angle_deg[1:], axis=0).max())
    what = f"with the tube, {joint}, ten cycles: second to tenth, largest spread at one displacement"
    source = (
        "dry friction and dead-bands forget no cycle and add none; Nayar 2022, Section IV-A, ten cycles; "
        "shown, not judged: no robot that is wrong by a fifth changes it"
    )
    return Line(NAME, what, "deg", apart, None, source, ours=apart)


def _finding() -> str:
    width = DEAD_BANDS_MM["torsion_proximal"][0]
    printed = modified.TORSION_PROXIMAL.width_m * 1e3
    return (
        f"{NAME}: Fig. 6's two R^2 of the torsion joint without the tube ask for a dead-band of {width:g} "
        "mm, less "
        f"than the {printed:g} mm that are printed with it, as the paper's words have it."
    )
