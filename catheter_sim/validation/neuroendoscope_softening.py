"""Does a softening backbone explain what is printed of the neuroendoscope (Kato 2016, Discussion)?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from catheter_sim.arrays import Array
from catheter_sim.core.robot import Friction, with_segments
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.kato import fkm, fkm_stick_by_rows, pcca
from catheter_sim.robots.continuum.published import neuroendoscope_section
from catheter_sim.robots.continuum.spec import ContinuumRobot
from catheter_sim.validation.lines import FITTED, NO_GRAVITY, Line, Validation, given, tips_mm

# ----------------------------------------------------------------------------------------------------
# Kato et al. 2016 (doi 10.1007/s11548-015-1310-2) found that its mapping bends too far at low and too little
# at high tension, in arching and extending alike, and expected the backbone's soft spring to be the cause. No
# stress-strain curve is printed, but eleven distances between the measured tip and two models are. The
# mapping with cells that may stick stands for the measured robot; three numbers are free (its friction, its
# stiffness, the friction that the authors put into their mapping), and with a softening backbone a fourth:
# the cubic term of its elastic law. Where extending started is not printed: from 0.65 N, the largest
# tension named.
#
# Both are fitted to all eleven figures, and to all but one, which is then predicted.

SECTION = "neuroendoscope_section"
START_N = 0.65  # Kato 2016: largest tension that it names of this robot; assumed for both layouts
OTHER_N = 0.12  # of the other tendon in the antagonistic layout
SINGLE_N, ANTAGONISTIC_N = (0.1, 0.2, 0.3, 0.4), (0.12, 0.24, 0.36, 0.48, 0.65)


@dataclass(frozen=True)
class PrintedDistance:
    """One printed figure.

    Attributes:
        name: what it is.
        mm: as printed, or from a printed share of another figure [mm].
        place: where in Kato 2016.
    """

    name: str
    mm: float
    place: str


PRINTED = (
    PrintedDistance("measured to PCCA, single, arching, 0.2 N", 5.1, "Results"),
    PrintedDistance("measured to PCCA, single, arching, 0.4 N", 5.9, "Results"),
    PrintedDistance("measured to PCCA, single, extending, 0.3 N", 5.0, "Results"),
    PrintedDistance("measured to PCCA, antagonistic, arching, 0.24 N", 6.0, "Results"),
    PrintedDistance("measured to PCCA, antagonistic, arching, 0.48 N", 10.1, "Results"),
    PrintedDistance("measured to PCCA, antagonistic, arching, 0.65 N", 14.6, "Results"),
    PrintedDistance("measured to mapping, single, largest", 2.9, "Results"),
    PrintedDistance("measured to mapping, antagonistic, arching, 0.48 N", 10.1 * (1.0 - 0.81), "81 % better"),
    PrintedDistance("measured to mapping, antagonistic, arching, 0.65 N", 5.5, "Results"),
    PrintedDistance("opening, single, 0.4 N", 9.8, "Results"),
    PrintedDistance("opening, antagonistic, 0.48 N", 13.2, "Results"),
)
# Free numbers, with the ranges that they are sought in. The cubic term is over the stiffness, in mm^2:
# a cell of 2 mm that bends by 3.8 deg has a curvature of 0.033 per mm.
RANGES: Mapping[str, tuple[float, float]] = {
    "friction": (0.02, 0.8),
    "stiffness_scale": (0.7, 1.4),
    "mapping_friction": (0.02, 0.8),
    "cubic_mm2": (-120.0, 120.0),
}
LINEAR, SOFTENING = ("friction", "stiffness_scale", "mapping_friction"), tuple(RANGES)
_STARTS = ((0.25, 1.0, 0.3, 0.0), (0.15, 1.1, 0.3, -40.0))


@dataclass(frozen=True)
class DistanceFit:
    """A fit to printed distances.

    Attributes:
        values: free numbers, by name.
        ours_mm: of `PRINTED`, shape (11,) [mm].
        rms_mm: over what it was fitted to [mm].
    """

    values: Mapping[str, float]
    ours_mm: Array
    rms_mm: float


def rows_N(layout: str) -> Array:
    """Return arching from rest, the start of extending, and extending, shape (r, 2) [N]."""
    other = OTHER_N if layout == "antagonistic" else 0.0
    up = ANTAGONISTIC_N if layout == "antagonistic" else SINGLE_N
    right = (other, *(v for v in up if v > other), START_N, *(v for v in up[::-1] if v < START_N))
    return np.array([(value, other) for value in right])


def distances_mm(values: Mapping[str, float]) -> Array:
    """Return what the printed distances are with these numbers, shape (11,) [mm].

    Raises:
        InputError: a cell bends beyond what the elastic law or the mapping knows.
    """
    nominal = neuroendoscope_section()
    soft = with_segments(nominal, [{"stiffness_cubic_m2": 1e-6 * values.get("cubic_mm2", 0.0)}])
    measured = replace(soft, friction=Friction(values["friction"]), stiffness_scale=values["stiffness_scale"])
    mapped = replace(nominal, friction=Friction(values["mapping_friction"]))
    single, pair = (_tips(layout, measured, mapped, nominal) for layout in ("single", "antagonistic"))
    levels = {"single": SINGLE_N, "antagonistic": ANTAGONISTIC_N}

    def up(layout: str, tension: float) -> int:
        return levels[layout].index(tension) + (layout == "single")

    def down(layout: str, tension: float) -> int:
        return -1 - levels[layout].index(tension)

    def to(tips: Mapping[str, Array], model: str, row: int) -> float:
        return float(np.linalg.norm(tips["measured"][row] - tips[model][row]))

    def opening(tips: Mapping[str, Array], layout: str, tension: float) -> float:
        rows = up(layout, tension), down(layout, tension)
        return float(np.linalg.norm(tips["measured"][rows[0]] - tips["measured"][rows[1]]))

    both_ways = [at("single", tension) for tension in SINGLE_N for at in (up, down)]
    return np.array(
        [
            to(single, "even", up("single", 0.2)),
            to(single, "even", up("single", 0.4)),
            to(single, "even", down("single", 0.3)),
            *(to(pair, "even", up("antagonistic", tension)) for tension in (0.24, 0.48, 0.65)),
            max(to(single, "mapped", row) for row in both_ways),
            *(to(pair, "mapped", up("antagonistic", tension)) for tension in (0.48, 0.65)),
            opening(single, "single", 0.4),
            opening(pair, "antagonistic", 0.48),
        ]
    )


def _tips(
    layout: str, measured: ContinuumRobot, mapped: ContinuumRobot, even: ContinuumRobot
) -> dict[str, Array]:
    """Return the tips of the robot, the mapping and constant curvature, shape (r, 3) each [mm]."""
    inputs = given(rows_N(layout))
    runs = {
        "measured": fkm_stick_by_rows(measured, inputs, NO_GRAVITY),
        "mapped": fkm(mapped, inputs, NO_GRAVITY),
        "even": pcca(even, inputs, NO_GRAVITY),
    }
    return {name: tips_mm(run.postures) for name, run in runs.items()}


def fit_distances(
    names: Sequence[str],
    kept: Sequence[int] | None = None,
    starts: Sequence[Sequence[float]] = _STARTS,
) -> DistanceFit:
    """Return the best fit of free numbers to the printed distances.

    Args:
        names: of `RANGES`, free.
        kept: positions in `PRINTED` that are fitted to; default: all.
        starts: values to start from, in the order of `RANGES`.
    """
    printed = np.array([item.mm for item in PRINTED])
    rows = np.arange(len(PRINTED)) if kept is None else np.array(kept)
    low, high = np.array([RANGES[name] for name in names]).T

    def residual(x: Array) -> Array:
        try:
            return (distances_mm(dict(zip(names, x, strict=True))) - printed)[rows]
        except InputError:
            return np.full(len(rows), 50.0)  # mm: farther than any robot is

    found = min(
        (
            least_squares(
                residual, start[: len(names)], bounds=(low, high), x_scale=high - low, diff_step=1e-4
            )
            for start in starts
        ),
        key=lambda item: float(item.cost),
    )
    values = {name: float(value) for name, value in zip(names, found.x, strict=True)}
    ours = distances_mm(values)
    return DistanceFit(values, ours, float(np.sqrt(((ours - printed)[rows] ** 2).mean())))


def left_out_rms_mm(names: Sequence[str], whole: DistanceFit) -> float:
    """Return the RMS over the printed distances, each predicted by a fit to the ten others [mm].

    Each fit starts from `whole`'s values.
    """
    errors = []
    for out, item in enumerate(PRINTED):
        kept = [k for k in range(len(PRINTED)) if k != out]
        found = fit_distances(names, kept, [tuple(whole.values.values())])
        errors.append(float(found.ours_mm[out]) - item.mm)
    return float(np.sqrt(np.mean(np.square(errors))))


def validate_softening(folder: Path) -> Validation:
    """Fit the eleven distances with and without a softening backbone; nothing is written."""
    fits = {"linear": fit_distances(LINEAR), "softening": fit_distances(SOFTENING)}
    left = {name: left_out_rms_mm(tuple(found.values), found) for name, found in fits.items()}
    source = "Kato 2016, Results and Discussion, eleven distances; extending from 0.65 N, assumed"
    lines = []
    for name, found in fits.items():
        start = f"eleven printed distances, {name} backbone, {len(found.values)} free numbers"
        lines += [
            Line(SECTION, f"{start}: RMS", "mm", found.rms_mm, None, source, found.rms_mm, kind=FITTED),
            Line(
                SECTION,
                f"{start}: RMS, each left out",
                "mm",
                left[name],
                None,
                source,
                left[name],
                kind=FITTED,
            ),
        ]
    for k, item in enumerate(PRINTED):
        ours = float(fits["softening"].ours_mm[k])
        what = f"softening backbone: {item.name}"
        where = f"Kato 2016, {item.place}"
        lines.append(Line(SECTION, what, "mm", abs(ours - item.mm), None, where, ours, None, item.mm, FITTED))
    return Validation(tuple(lines), (_finding(fits, left),))


def _finding(fits: Mapping[str, DistanceFit], left: Mapping[str, float]) -> str:
    gain = left["linear"] - left["softening"]
    told = ", ".join(f"{name} {value:.3g}" for name, value in fits["softening"].values.items())
    verdict = (
        f"lowers the error of what was left out by {gain:.2f} mm"
        if gain > 0.0
        else f"does not: of what was left out the error grows by {-gain:.2f} mm"
    )
    return (
        f"{SECTION}: a cubic term ({told}) lowers the RMS over eleven printed distances from "
        f"{fits['linear'].rms_mm:.2f} to {fits['softening'].rms_mm:.2f} mm; as a prediction it {verdict}."
    )
