"""The modelling benchmark's two scenarios (Rao et al. 2021, Sections 6.2 and 8, 10.3389/frobt.2020.630245).

Scenario 1: no load, disks per segment from 1 to 13. Scenario 2: ten disks, a tip force of 0.5 N in the
bending plane or across it, stiffness from a tenth to ten times, tensions in proportion. Every model, the
simulation among them, is compared with `VC_ref` over all sixteen sets of tensions, each 0 or T_M (Eq. 55),
by Eq. 57's mean errors of position, in % of the length, and of orientation.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from catheter_sim.tables import replaced_when_whole
from catheter_sim.validation.tdcr_tips import (
    PRB_PRINTED,
    SIMULATION,
    TIP_FORCES_N,
    Scores,
    benchmark_robot,
    rigid_along,
    scores,
    tips,
)

REFERENCE = "VC_ref"
MODELS = ("CC", "CC_sub", "PRB", "VC", "VC_ref_noproj", SIMULATION)
DISKS = tuple(range(1, 14))
STIFFNESS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
LOADED_MODELS = ("CC_sub", "PRB", "PRB_middle", "VC", "VC_ref_noproj", SIMULATION)
PRINTED_AT = (0.2, 1.0)  # stiffness at which the printed residual is solved; at a tenth it runs away, slowly
LINKS = (1, 2, 4)  # a subsegment, of the simulated chain

_COLUMNS = (
    *("scenario", "tip_force", "disks", "stiffness", "model"),
    *("e_p_percent", "e_R_deg", "solved_of_16", "time_ms"),
)

ByDisks = Mapping[tuple[str, int], Scores]
ByStiffness = Mapping[tuple[str, str, float], Scores]
ByLinks = Mapping[tuple[str, int], Scores]  # by direction of the tip force and links a subsegment


def scenario_1(disks: Sequence[int] = DISKS, models: Sequence[str] = MODELS) -> ByDisks:
    """Return the models' scores by name and number of disks a segment."""
    table = {}
    for n in disks:
        robot = benchmark_robot(n)
        reference = tips(robot, REFERENCE, TIP_FORCES_N["none"])
        table[REFERENCE, n] = scores(reference, reference)
        for model in models:
            table[model, n] = scores(tips(robot, model, TIP_FORCES_N["none"]), reference)
    return table


def scenario_2(stiffness: Sequence[float] = STIFFNESS, models: Sequence[str] = LOADED_MODELS) -> ByStiffness:
    """Return the models' scores by name, direction of the tip force and stiffness."""
    table = {}
    for where in ("in plane", "across"):
        for factor in stiffness:
            robot = benchmark_robot(10, factor)
            reference = tips(robot, REFERENCE, TIP_FORCES_N[where])
            table[REFERENCE, where, factor] = scores(reference, reference)
            printed = [PRB_PRINTED] if factor in PRINTED_AT else []
            for model in [*models, *printed]:
                table[model, where, factor] = scores(tips(robot, model, TIP_FORCES_N[where]), reference)
    return table


def by_links(links: Sequence[int] = LINKS) -> tuple[ByLinks, ByLinks]:
    """Return the simulated chain's scores against `VC_ref_noproj`, ten disks, nominal stiffness.

    First against the robot as it is, then against one whose backbone neither stretches nor shears: the
    chain's does not, so that this is what it converges to.

    Args:
        links: a subsegment.
    """
    as_it_is: dict[tuple[str, int], Scores] = {}
    rigid: dict[tuple[str, int], Scores] = {}
    for where, force in TIP_FORCES_N.items():
        robot = benchmark_robot()
        references = [tips(item, "VC_ref_noproj", force) for item in (robot, rigid_along(robot))]
        for count in links:
            found = tips(benchmark_robot(links=count), SIMULATION, force)
            as_it_is[where, count], rigid[where, count] = (scores(found, item) for item in references)
    return as_it_is, rigid


def write_scores(by_disks: ByDisks, by_stiffness: ByStiffness, path: Path) -> None:
    """Write every score of both scenarios as one CSV file."""
    with replaced_when_whole(path) as file:
        table = csv.writer(file)
        table.writerow(_COLUMNS)
        rows = [((1, "none", n, 1.0, model), found) for (model, n), found in by_disks.items()]
        rows += [
            ((2, where, 10, factor, model), found) for (model, where, factor), found in by_stiffness.items()
        ]
        for where, found in rows:
            figures = (found.position_percent, found.orientation_deg, found.solved, found.ms)
            table.writerow([*where, *(f"{figure:.6g}" for figure in figures)])
