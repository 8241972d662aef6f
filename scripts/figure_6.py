"""What three of Fig. 6's errors of Nayar 2023 say of the fourth. Writes docs/truth/figure_6.md and .csv.

    python scripts/figure_6.py [--jobs 2] [--only-page]

The paper prints four errors of the proximal joint, and neither trajectory nor slack. Three numbers are free:
the drive's slack, how far the joint swings (a share of the trajectory of `validation.mitral_control`) and how
long it takes (times that trajectory's). The four errors are computed on a grid of them; between its points
their logarithms are quadratic. Three printed errors are fitted, and the fourth is predicted, each in turn.
Rows that the CSV has are not computed again, so that a run that was stopped goes on.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from catheter_sim.arrays import Array
from catheter_sim.robots.catheter.published import mitral_4dof_measured
from catheter_sim.validation.mitral_control import CORNERS_DEG, FIGURE_6_DEG, LEGS_S, joint_control

OUT = Path(__file__).resolve().parent.parent / "docs" / "truth" / "figure_6.csv"
SLACKS_MM, SWINGS, TIMES = (0.4, 0.8, 1.2), (0.5, 0.75, 1.0), (0.25, 0.5, 1.0)
JOINT = "bending_proximal"
FREE = ("slack_mm", "swing", "time")
COLUMNS = (*FREE, *FIGURE_6_DEG)
_LEAST = CORNERS_DEG[1]  # the swings begin at it: below it the tendon is asked for no tension

Row = Mapping[str, float]


def errors_deg(slack_mm: float, swing: float, time: float) -> dict[str, float]:
    """Return the four errors of the proximal joint, as the tracker sees it."""
    corners = tuple(
        corner if corner < _LEAST else _LEAST + swing * (corner - _LEAST) for corner in CORNERS_DEG
    )
    robot = mitral_4dof_measured()
    tendons = tuple(
        replace(pair, slack_m=1e-3 * slack_mm) if pair.name == JOINT else pair for pair in robot.tendons
    )
    found = joint_control(replace(robot, tendons=tendons), corners, tuple(time * leg for leg in LEGS_S))
    return found.rmse_deg(JOINT)


def computed() -> list[dict[str, float]]:
    """Return the rows that the CSV has."""
    if not OUT.is_file():
        return []
    with OUT.open(newline="", encoding="utf-8") as file:
        return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]


def compute(jobs: int) -> None:
    """Add the rows that the CSV lacks, each as soon as it is there."""
    done = {tuple(row[name] for name in FREE) for row in computed()}
    wanted = [point for point in itertools.product(SLACKS_MM, SWINGS, TIMES) if point not in done]
    if not OUT.is_file():
        OUT.write_text(",".join(COLUMNS) + "\n", encoding="utf-8")
    with ProcessPoolExecutor(jobs) as pool:
        running = {pool.submit(errors_deg, *point): point for point in wanted}
        for future in as_completed(running):
            row = (*running[future], *(future.result()[name] for name in FIGURE_6_DEG))
            with OUT.open("a", encoding="utf-8") as file:
                file.write(",".join(f"{value:.6g}" for value in row) + "\n")
            print(f"{len(computed())} rows", file=sys.stderr)


def _terms(points: Array) -> Array:
    """Return the quadratic's terms at `points`, shape (r, 3): slack, logarithms of swing and time."""
    slack, swing, time = points[:, 0], np.log(points[:, 1]), np.log(points[:, 2])
    ones = np.ones_like(slack)
    return np.stack(
        [ones, slack, swing, time, slack**2, swing**2, time**2, slack * swing, slack * time, swing * time],
        axis=1,
    )


def surface(rows: Sequence[Row]) -> tuple[Array, float]:
    """Return the quadratics' coefficients, shape (10, 4), and the largest misfit at a grid point [share]."""
    points = np.array([[row[name] for name in FREE] for row in rows])
    wanted = np.log([[row[name] for name in FIGURE_6_DEG] for row in rows])
    terms = _terms(points)
    found = np.linalg.lstsq(terms, wanted, rcond=None)[0]
    return found, float(np.expm1(np.abs(terms @ found - wanted).max()))


def predicted(coefficients: Array, left_out: str) -> dict[str, float]:
    """Return the free numbers fitted to three printed errors, the four errors, and the largest misfit."""
    names = list(FIGURE_6_DEG)
    used = [k for k, name in enumerate(names) if name != left_out]
    printed = np.log(list(FIGURE_6_DEG.values()))
    lower = np.array([SLACKS_MM[0], SWINGS[0], TIMES[0]])
    upper = np.array([SLACKS_MM[-1], SWINGS[-1], TIMES[-1]])

    def apart(point: Array) -> Array:
        return (_terms(point[None]) @ coefficients)[0][used] - printed[used]

    starts = itertools.product(
        *zip(lower + 0.1 * (upper - lower), upper - 0.1 * (upper - lower), strict=True)
    )
    fits = [least_squares(apart, start, bounds=(lower, upper)) for start in starts]
    best = min(fits, key=lambda item: item.cost)
    ours = np.exp(_terms(best.x[None]) @ coefficients)[0]
    ends = np.isclose(best.x, lower, rtol=1e-3) | np.isclose(best.x, upper, rtol=1e-3)
    return (
        dict(zip(FREE, best.x, strict=True))
        | dict(zip(names, ours, strict=True))
        | {"misfit": float(np.expm1(np.abs(best.fun).max())), "at_bounds": float(ends.sum())}
    )


_TOP = """\
# Three of Fig. 6's errors, and the fourth

Nayar 2023 prints four errors of the proximal joint in its Fig. 6. It prints neither the trajectory nor the
slack of the tendons. So three numbers are free here:

- the slack;
- how far the joint swings, as a share of our trajectory (10 to 60 deg);
- how long it takes, times our trajectory's 75 s.

Each row is fitted to three printed errors and predicts the one that is left out. The tracker's noise and its
turned frame are assumed, as in [the validation](validation.md).

| left out | slack [mm] | swing | time | printed [deg] | predicted [deg] | off | fitted, off | at an edge |
|---|---|---|---|---|---|---|---|---|"""
_END = """
`off` is the prediction's error, `fitted, off` the largest of the three that were fitted. Where it is not near
zero, no slack, swing and time within the grid give the three errors, and one of these ended at an edge.
The grid has {points} points. Its slacks are {slacks} mm, its swings {swings} and its times {times}.
Between the points the logarithm of each error is quadratic. At the points this is at most {misfit:.0f} % off.
All of them are in `docs/truth/figure_6.csv`. The page is made by `scripts/figure_6.py`."""


def page(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the page's lines."""
    yield _TOP
    coefficients, misfit = surface(rows)
    for name, printed in FIGURE_6_DEG.items():
        found = predicted(coefficients, name)
        cells = (
            name,
            *(f"{found[free]:.2f}" for free in FREE),
            f"{printed:g}",
            f"{found[name]:.2f}",
            f"{100.0 * (found[name] / printed - 1.0):+.0f} %",
            f"{100.0 * found['misfit']:.0f} %",
            "yes" if found["at_bounds"] else "no",
        )
        yield f"| {' | '.join(cells)} |"
    slacks, swings, times = (", ".join(f"{value:g}" for value in part) for part in (SLACKS_MM, SWINGS, TIMES))
    yield _END.format(points=len(rows), slacks=slacks, swings=swings, times=times, misfit=100.0 * misfit)


def main() -> int:
    """Compute what is missing, and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes; default 2")
    parser.add_argument("--only-page", action="store_true", help="compute nothing")
    options = parser.parse_args()
    if not options.only_page:
        compute(options.jobs)
    rows = computed()
    OUT.with_suffix(".md").write_text("\n".join(page(rows)) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
