"""Times of the modelling benchmark's solvers (Rao et al. 2021, Figs 10C, 11C and 11F).

As in the paper one configuration, tendons 1 and 3, from a straight start; with a tip force both halved.
Solvers alone (`robots.continuum.solvers`), the median of many calls in which all take turns, processor's
time. The paper's are of a C++ program on an Intel Core i5-9600 at 3.10 GHz, means of 100. Times hang on
machine and implementation and are shown; judged are those of the paper's claims about them that lie far from
1.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Hashable, Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np

from catheter_sim.robots.continuum.solvers import solver_call
from catheter_sim.validation.drives import NO_GRAVITY, given
from catheter_sim.validation.lines import OUT_OF_REACH, Line, Validation
from catheter_sim.validation.tdcr_tips import SETS, TIP_FORCES_N, benchmark_robot, largest_tension_N

NAME = "spacer_disk"
MODELS = ("CC", "CC_sub", "PRB", "VC", "VC_ref")
DISKS = (1, 2, 3, 5, 8, 10, 13)
CONFIGURATION = 5  # of `SETS`: tendons 1 and 3
ROUNDS, REPEATS = 15, 4  # turns, and calls in each
CC_US, CC_SUB_LOADED_MS = 2.7, 10.0  # printed
PATH_ROWS = 7
OTHER_SIDE = 10  # of `SETS`: tendons 2 and 4
FAR = 0.2  # CC's time over that of the next model
_CLOCK = "a clock on this machine; the paper's is of C++ on an i5-9600"

Name = TypeVar("Name", bound=Hashable)
Times = Mapping[str, float]  # of one configuration, by model [s]


def validate_solver_times(folder: Path) -> Validation:
    """Show the times and check the claims; nothing is written."""
    by_disks = times_by_disks()
    loaded = {where: times(10, where, 0.5) for where in ("in plane", "across")}
    return Validation((*shown_lines(by_disks, loaded), *claim_lines(by_disks), warm_line()), ())


def times_by_disks() -> Mapping[int, Times]:
    """Return the times without a tip force at every number of disks, all in the same turns: what else the
    machine does meanwhile falls on all of them."""
    calls = {(disks, model): call for disks in DISKS for model, call in solvers(disks, "none").items()}
    spent = taken_s(calls)
    return {disks: {model: spent[at, model] for at, model in calls if at == disks} for disks in DISKS}


def times(disks: int, where: str, share: float = 1.0) -> Times:
    """Return the solvers' times of one configuration; arguments as for `solvers`."""
    return taken_s(solvers(disks, where, share))


def solvers(disks: int, where: str, share: float = 1.0) -> dict[str, Callable[[], object]]:
    """Return the solvers of one configuration, by model, those left out that do not carry its load.

    Args:
        disks: a segment.
        where: of `TIP_FORCES_N`.
        share: of both T_M and the tip force.
    """
    robot = benchmark_robot(disks)
    tension = share * SETS[CONFIGURATION] * largest_tension_N(robot)
    inputs = given(tension[None], "tension", share * np.array([TIP_FORCES_N[where]]))
    found = {model: solver_call(model, robot, inputs, NO_GRAVITY) for model in MODELS}
    return {model: call for model, call in found.items() if call is not None}


def taken_s(calls: Mapping[Name, Callable[[], object]]) -> dict[Name, float]:
    """Return each call's median time over rounds in which all take turns [s]; the first of each is no part
    of it."""
    for call in calls.values():
        call()
    spent: dict[Name, list[float]] = {name: [] for name in calls}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            began = time.process_time()
            for _ in range(REPEATS):
                call()
            spent[name].append((time.process_time() - began) / REPEATS)
    return {name: statistics.median(values) for name, values in spent.items()}


def shown_lines(by_disks: Mapping[int, Times], loaded: Mapping[str, Times]) -> list[Line]:
    """Return every time beside what is printed of it."""
    lines = [_order(where, found) for where, found in loaded.items()]
    for disks, found in by_disks.items():
        for model, spent in found.items():
            printed = CC_US * 1e-3 if model == "CC" else None
            lines.append(_time(f"no tip force, {disks} disks, {model}", spent, printed, "Fig. 10C"))
    for where, found in loaded.items():
        figure = "Fig. 11C" if where == "in plane" else "Fig. 11F"
        for model, spent in found.items():
            printed = CC_SUB_LOADED_MS if model == "CC_sub" else None
            lines.append(_time(f"tip force {where}, 10 disks, {model}", spent, printed, figure))
    return lines


def claim_lines(by_disks: Mapping[int, Times]) -> list[Line]:
    """Return the paper's claims about the times without load as ratios."""
    fastest = max(found["CC"] / min(found[m] for m in MODELS if m != "CC") for found in by_disks.values())
    slower = min(found["PRB"] / found["VC"] for disks, found in by_disks.items() if disks > 4)
    grown = by_disks[13]["PRB"] / by_disks[2]["PRB"]
    coarse = by_disks[1]["VC_ref"] / by_disks[3]["VC_ref"]
    source = "Rao 2021, Section 8.1"
    return [
        Line(NAME, "solver times, 1 to 13 disks: CC over the next fastest, largest", "-", fastest, FAR,
             f"{source}: by far the fastest", fastest),
        Line(NAME, "solver times, more than 4 disks: PRB over VC, least", "-", max(1.0 - slower, 0.0), 0.0,
             f"{source}: PRB is the slower one for n > 4", slower),
        Line(NAME, "solver times: PRB at 13 disks over 2", "-", max(1.0 - grown, 0.0), 0.0,
             f"{source}: grows with the number of disks", grown),
        Line(NAME, "solver times: VC_ref at 1 disk over 3", "-", max(1.0 - coarse, 0.0), 0.0,
             f"{source}: longer for n < 3, whose subsegments bend more", coarse),
    ]  # fmt: skip


def warm_line() -> Line:
    """Return what VC_ref takes along a path, each point from the one before, over straight starts (Section
    9.2).

    The points of the other run change sides each time, so that each is far from the one before; by symmetry
    they are as hard. Both are solved in one call of fewer rows than go together.
    """
    robot = benchmark_robot()
    shares = np.linspace(0.9, 1.0, PATH_ROWS)[:, None] * largest_tension_N(robot)
    sides = np.where(np.arange(PATH_ROWS)[:, None] % 2, SETS[OTHER_SIDE], SETS[CONFIGURATION])
    calls = {}
    for name, pulled in (("along", SETS[CONFIGURATION]), ("far", sides)):
        call = solver_call("VC_ref", robot, given(shares * pulled, "tension"), NO_GRAVITY)
        assert call is not None
        calls[name] = call
    spent = taken_s(calls)
    ratio = spent["along"] / spent["far"]
    what = f"solver times, VC_ref, a path of {PATH_ROWS} points: from the point before over from straight"
    source = "Rao 2021, Section 9.2: shorter, without a figure"
    return Line(NAME, what, "-", max(ratio - 1.0, 0.0), None, source, ratio)


def _order(where: str, found: Times) -> Line:
    ratio = min(found["PRB"], found["VC_ref"]) / max(found["CC_sub"], found["VC"])
    what = (
        f"solver times, tip force {where}, 10 disks: the faster of PRB and VC_ref over the slower of CC_sub "
        "and VC"
    )
    source = (
        "Rao 2021, Section 8.2: an order of magnitude; hangs on the implementation: ours follow the reference"
    )
    return Line(NAME, what, "-", abs(ratio - 10.0), None, source, ratio, None, 10.0, OUT_OF_REACH)


def _time(what: str, spent_s: float, printed_ms: float | None, figure: str) -> Line:
    ours = spent_s * 1e3
    gap = float("nan") if printed_ms is None else abs(ours - printed_ms)
    return Line(
        NAME,
        f"time of one configuration, solver alone, {what}",
        "ms",
        gap,
        None,
        f"Rao 2021, {figure}; {_CLOCK}",
        ours,
        None,
        printed_ms,
        OUT_OF_REACH,
    )
