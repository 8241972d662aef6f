"""Five repeated loadings of the chest-tube section, drawn: what Fig. 14 of chest_tube_2025 shows, measured.

doi 10.1109/LRA.2025.3597860, Section IV-B: five tests, fourteen tensions, points along the backbone; errors
of the authors' model over its length. Here the measured robot is `@printed_shapes` by the complete balance,
the model the printed balance with the published calibration. **Everything that differs from test to test is
assumed**: friction of each test even within 20 %, each tension off by 2 % (standard deviation), each point
by 0.5 mm along each axis. So the spread is no prediction; that an error over the distance from the base is
largest at the base follows from any noise of the points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.robots.rolling.complete import complete
from catheter_sim.robots.rolling.published import chest_tube_section_printed_shapes
from catheter_sim.validation import paper_plots
from catheter_sim.validation.chest_tube_calibration import NOISE_MM, TENSIONS_N
from catheter_sim.validation.chest_tube_printed_shapes import SECTION, STAND_IN, shapes_mm
from catheter_sim.validation.drives import NO_GRAVITY, given
from catheter_sim.validation.lines import ASSUMED, Line, Validation

TESTS, SEED = 5, 0
FRICTION_SHARE, TENSION_SHARE = 0.2, 0.02  # assumed
LENGTH_MM = 225.0
PRINTED = {"tip": (2.88, 1.22), "shape": (2.55, 0.72)}  # mean and standard deviation [% of length]


@dataclass(frozen=True)
class Repeats:
    """Errors of the model in the repeated tests.

    Attributes:
        away_mm: distance of every point, shape (tests, 14, 15) [mm].
        over_distance: the same over each point's distance from the base, shape (tests, 14, 15) [%].
    """

    away_mm: Array
    over_distance: Array

    def mean_and_spread(self, which: str) -> tuple[float, float]:
        """Return the mean and the standard deviation of the tip's or the shape's error [% of length]."""
        every = self.away_mm[:, :, -1] if which == "tip" else self.away_mm.mean(axis=2)
        return float(100.0 * every.mean() / LENGTH_MM), float(100.0 * every.std() / LENGTH_MM)


def repeats(tests: int = TESTS, seed: int = SEED) -> Repeats:
    """Return the errors of so many drawn tests."""
    draw = np.random.default_rng(seed)
    model = shapes_mm(load_robot(STAND_IN), "printed", range(len(TENSIONS_N)))
    robot = chest_tube_section_printed_shapes()
    away = []
    for _ in range(tests):
        mu = robot.friction.mu * draw.uniform(1.0 - FRICTION_SHARE, 1.0 + FRICTION_SHARE)
        tension = TENSIONS_N * (1.0 + TENSION_SHARE * draw.normal(size=TENSIONS_N.shape))
        one = replace(robot, friction=Friction(mu))
        run = complete(one, given(tension[:, None]), NO_GRAVITY)
        measured = np.array([posture.p_w for posture in run.postures]) * 1e3
        measured += NOISE_MM * draw.normal(size=measured.shape)
        away.append(np.linalg.norm(model - measured, axis=-1))
    every = np.array(away)
    return Repeats(every, 100.0 * every / np.linalg.norm(model, axis=-1))


def validate_repeats(folder: Path) -> Validation:
    """Show the spread of five drawn tests; the picture goes into `folder`."""
    found = repeats()
    along = found.over_distance.mean(axis=(0, 1))
    paper_plots.repeats(found, TENSIONS_N, folder / f"{SECTION}_repeats.png")
    source = "chest_tube_2025, Fig. 14; what differs from test to test is assumed"
    lines = []
    for which, printed in PRINTED.items():
        for name, ours, theirs in zip(
            ("mean", "standard deviation"), found.mean_and_spread(which), printed, strict=True
        ):
            what = f"five drawn tests, printed balance: error of the {which} over length, {name}"
            lines.append(
                Line(SECTION, what, "%", abs(ours - theirs), None, source, ours, None, theirs, ASSUMED)
            )
    what = (
        "five drawn tests: error over the distance from the base, first link over the least along the section"
    )
    ratio = float(along[0] / along.min())
    lines.append(
        Line(SECTION, what, "-", np.nan, None, f"{source}; printed: worst there", ratio, kind=ASSUMED)
    )
    return Validation(tuple(lines), ())
