"""Can one specimen have both Fig. 11's and Fig. 13's figures of chest_tube_2025? Writes the front.

    python scripts/chest_tube_front.py [--only-page]

A specimen is a set of the printed balance's numbers and a modulus of its links, by which they give way along
their axis under the rods' tension. Of each: the three figures of Fig. 13 (even joints' medians), and what
constant curvature is off from its shapes at the thirteen measured tensions (Fig. 11: 11.45 %), for three ways
to fit the arcs: five numbers within the package's bounds, five within wider ones, and an arc of its own for
each tension. `both` is the root mean square of the four relative errors; the least is the best single set.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation import chest_tube, chest_tube_measured
from catheter_sim.validation.chest_tube_measured import PCC_PERCENT, PULLED, TENSIONS_N, model_error_percent
from catheter_sim.validation.lines import NO_GRAVITY, given

OUT = Path(__file__).resolve().parent.parent / "docs" / "truth" / "chest_tube_front.csv"
FIG_13 = (-1.4, 6.8, 20.0)  # deg, N, N: chest_tube_2025, Section IV-B
MODULI_MPA = (math.inf, 100.0, 50.0, 25.0, 15.0)  # of the links; 25 is the published calibration's
_SECTION = "chest_tube_section"
# Sets of the balance's numbers: Table II's, which were fitted to Fig. 13; another such; the published
# calibration; halfway between the first and the third.
SPECIMENS: Mapping[str, tuple[str, dict[str, float]]] = {
    "@table2": (_SECTION, {}),
    "@table2, EI x1.3, mu 0.2, c 0.33 mm": (
        _SECTION,
        {"stiffness_scale": 1.3, "friction.mu": 0.2, "clearance_mm": 0.33},
    ),
    "@prototype": (f"{_SECTION}@prototype", {}),
    "halfway from @table2 to @prototype": (
        _SECTION,
        {
            "stiffness_scale": 1.47,
            "friction.mu": 0.193,
            "clearance_mm": 0.468,
            "segments.section.larger_arm_mm": 3.49,
            "segments.section.smaller_arm_mm": 1.165,
            "segments.section.larger_radius_mm": 6.535,
            "segments.section.smaller_radius_mm": 3.04,
        },
    ),
}
WIDER = {
    chest_tube_measured.ARMS: (3.0, 5.6),  # the holes must lie inside the link
    "segments.section.smaller_arm_mm": (0.2, 2.6),
    "segments.section.larger_radius_mm": (4.0, 12.0),
    "segments.section.smaller_radius_mm": (1.2, 8.0),
}
LENGTH_MM, LINKS = 225.0, 15


def figure_13(robot: object) -> tuple[float, float, float]:
    """Return the medians over the even joints: largest bend back [deg], its tension, that of return [N]."""
    tensions = np.arange(0.0, 30.01, 0.5)
    postures = STATIC_MODELS["printed"].solve(robot, given(tensions[:, None]), NO_GRAVITY).postures
    even = np.degrees([posture.joint_angles for posture in postures])[:, 1::2]
    back = [chest_tube._crossing(tensions, column) for column in even.T]
    return (
        float(np.median(even.min(axis=0))),
        float(np.median(tensions[even.argmin(axis=0)])),
        float(np.nanmedian(back)),
    )


def shapes_mm(robot: object, modulus_MPa: float) -> Array:
    """Return the printed balance's shapes at the measured tensions, links given way, (13, 15, 3) [mm]."""
    inputs = given(TENSIONS_N[list(PULLED), None])
    postures = STATIC_MODELS["printed"].solve(robot, inputs, NO_GRAVITY).postures
    chain = rolling_chain(robot)  # type: ignore[arg-type]
    outer, length = 3.1e-3, float(chain.link_length[0])  # m: radius of 6.2 mm over two; Table II
    stiffness = modulus_MPa * 1e6 * math.pi * outer**2 / length  # of a solid link [N/m]
    found = []
    for posture in postures:
        short = posture.tendon_tension[0] / stiffness  # of each link [m]
        gone = np.cumsum(short[:, None] * posture.R_w[:, :, 2], axis=0)
        found.append((posture.p_w - gone) * 1e3)
    return np.array(found)


def own_arcs_percent(wanted_mm: Array) -> float:
    """Return what an arc of its own for each tension leaves [%]."""
    along = LENGTH_MM * np.arange(1, LINKS + 1) / LINKS

    def error(bend: float, shape: Array) -> float:
        turn = bend * along / LENGTH_MM
        x, z = (LENGTH_MM / bend) * (1.0 - np.cos(turn)), (LENGTH_MM / bend) * np.sin(turn)
        return model_error_percent(np.stack([x, z], axis=1), shape[:, [0, 2]])

    best = [
        minimize_scalar(error, bounds=(0.02, 2.0 * math.pi), args=(shape,), method="bounded").fun
        for shape in wanted_mm
    ]
    return float(np.mean(best))


def at_bounds(values: Mapping[str, float], ranges: Mapping[str, tuple[float, float]]) -> str:
    """Return which fitted numbers ended at a bound."""
    names = [
        name.rpartition(".")[2]
        for name, (low, high) in ranges.items()
        if min(values[name] - low, high - values[name]) < 1e-3 * (high - low)
    ]
    return " ".join(names)


def rows() -> list[dict[str, str]]:
    """Return the front, a row for each specimen, modulus and way to fit the arcs."""
    found = []
    for name, (reference, settings) in SPECIMENS.items():
        robot = load_robot(reference, settings)
        thirteen = figure_13(robot)
        for modulus in MODULI_MPA:
            wanted = shapes_mm(robot, modulus)
            for fit, ranges in (("package's bounds", {}), ("wider bounds", WIDER), ("own arcs", None)):
                ended = ""
                if ranges is None:
                    percent = own_arcs_percent(wanted)
                else:
                    bounds = {**chest_tube_measured.RANGES["pcc"], **ranges}
                    pcc = chest_tube_measured.fit_shapes("pcc", wanted, ranges=bounds)
                    percent, ended = pcc.error_percent, at_bounds(pcc.values, bounds)
                off = [a / b - 1.0 for a, b in zip((*thirteen, percent), (*FIG_13, PCC_PERCENT), strict=True)]
                row = {
                    "specimen": name,
                    "link_modulus_MPa": f"{modulus:g}",
                    "arc_fit": fit,
                    "fig_13_back_deg": f"{thirteen[0]:.2f}",
                    "fig_13_at_N": f"{thirteen[1]:.2f}",
                    "fig_13_return_N": f"{thirteen[2]:.1f}",
                    "fig_11_percent": f"{percent:.2f}",
                    "fig_13_off": f"{float(np.sqrt(np.mean(np.square(off[:3])))):.3f}",
                    "fig_11_off": f"{abs(off[3]):.3f}",
                    "both": f"{float(np.sqrt(np.mean(np.square(off)))):.3f}",
                    "at_bounds": ended,
                }
                found.append(row)
                print(*row.values(), sep=", ", flush=True)
    return found


def page(found: Sequence[Mapping[str, str]]) -> Iterator[str]:
    """Yield the page's lines: what was asked, the best single set, every row."""
    best = min(found, key=lambda row: float(row["both"]))
    yield _TOP
    met = any(max(float(row["fig_13_off"]), float(row["fig_11_off"])) < 0.1 for row in found)
    yield (
        f"The best single set is `{best['specimen']}`, with a link modulus of {best['link_modulus_MPa']} MPa "
        f'and the arc fit "{best["arc_fit"]}". It gives:\n'
    )
    yield f"- Fig. 11: {best['fig_11_percent']} %, where {PCC_PERCENT} % is printed"
    yield (
        f"- Fig. 13: {best['fig_13_back_deg']} deg at {best['fig_13_at_N']} N, back at "
        f"{best['fig_13_return_N']} N\n"
    )
    yield f"{'Some row has' if met else 'No row has'} both figures within a tenth.\n"
    yield "## All rows\n\nThe table begins with the row whose `both` is least.\n"
    yield "| " + " | ".join(found[0]) + " |"
    yield "|---" * len(found[0]) + "|"
    for row in sorted(found, key=lambda row: float(row["both"])):
        yield "| " + " | ".join(cell or "-" for cell in row.values()) + " |"
    yield "\n## Bounds of the arc fit\n\n| number | package's bounds | wider bounds |\n|---|---|---|"
    for key, own in chest_tube_measured.RANGES["pcc"].items():
        both = (f"{low:g} to {high:g}" for low, high in (own, WIDER.get(key, own)))
        yield f"| {key.rpartition('.')[2]} | {' | '.join(both)} |"


_TOP = """\
# Fig. 11 against Fig. 13 of the chest tube, on one specimen

The paper chest_tube_2025 measures one prototype and prints two results of it:

- Fig. 11: constant curvature, calibrated, is 11.45 % off the prototype's shapes.
- Fig. 13: the even joints bend back by 1.4 deg near 6.8 N and return near 20 N.

Can one specimen have both? The shapes are not published. A set of the printed balance's numbers therefore
stands in for the prototype. Each row of the table below combines:

- `specimen`: such a set of numbers
- `link_modulus_MPa`: the modulus of its links. The published calibration has 25 MPa, the printed balance has
  rigid links (`inf`).
- `arc_fit`: the way to fit the arcs. With "own arcs" each tension has an arc of its own.

The other columns are:

- `fig_13_back_deg`: how far the even joints bend back, as their median
- `fig_13_at_N` and `fig_13_return_N`: at which tension they do, and at which they return
- `fig_11_percent`: how far constant curvature is off the set's shapes
- `fig_13_off` and `fig_11_off`: relative errors
- `both`: the root mean square of all four relative errors
- `at_bounds`: fitted numbers that ended at a bound

`scripts/chest_tube_front.py` made the table. Sets and fits that are not listed were not run.
"""


def main() -> int:
    """Write the front and name the best single set."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only-page", action="store_true", help="no runs; write the page")
    options = parser.parse_args()
    if not options.only_page:
        found = rows()
        with OUT.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(found[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(found)
    with OUT.open(newline="", encoding="utf-8") as file:
        kept = list(csv.DictReader(file))
    OUT.with_suffix(".md").write_text("\n".join(page(kept)) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
