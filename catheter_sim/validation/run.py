"""Runs the checks of chosen robots and leaves a page, table, JSON and plots in a folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from catheter_sim.errors import InputError, unknown
from catheter_sim.progress import EVERY_S, Stages
from catheter_sim.validation.chest_tube import validate_section as validate_chest_tube
from catheter_sim.validation.chest_tube_calibration import validate_calibration
from catheter_sim.validation.chest_tube_design import validate_design
from catheter_sim.validation.chest_tube_full import validate_full as validate_full_chest_tube
from catheter_sim.validation.chest_tube_loads import (
    validate_full_sleeve,
    validate_loads,
    validate_section_sleeve,
)
from catheter_sim.validation.chest_tube_printed_shapes import validate_printed_shapes, validate_times
from catheter_sim.validation.chest_tube_repeats import validate_repeats
from catheter_sim.validation.chest_tube_requirements import (
    validate_full_requirements,
    validate_section_requirements,
)
from catheter_sim.validation.chest_tube_terms import validate_terms
from catheter_sim.validation.lines import Validation, merge
from catheter_sim.validation.mitral import validate_4dof, validate_transseptal
from catheter_sim.validation.mitral_control import validate_control_4dof, validate_control_transseptal
from catheter_sim.validation.mitral_cycles import validate_cycles
from catheter_sim.validation.mitral_elongation import validate_elongation
from catheter_sim.validation.mitral_flow import validate_flow
from catheter_sim.validation.mitral_joints import validate_joints
from catheter_sim.validation.mitral_motion import validate_motion
from catheter_sim.validation.mitral_procedure import validate_procedure
from catheter_sim.validation.mitral_render import validate_render_4dof, validate_render_transseptal
from catheter_sim.validation.mitral_sizing import validate_sizing
from catheter_sim.validation.mitral_whole import validate_whole
from catheter_sim.validation.neuroendoscope import validate_full, validate_section
from catheter_sim.validation.neuroendoscope_figures import validate_figures, validate_printed_full
from catheter_sim.validation.render import validate_render, validate_render_chest_tube
from catheter_sim.validation.report import write_report
from catheter_sim.validation.rod import validate_rod
from catheter_sim.validation.rod_motion import validate_rod_motion
from catheter_sim.validation.spacer_disk import validate_spacer_disk
from catheter_sim.validation.tdcr_lines import validate_scenarios
from catheter_sim.validation.tdcr_readings import validate_readings
from catheter_sim.validation.tdcr_times import validate_solver_times

Check = Callable[[Path], Validation]

CHECKS: Mapping[str, tuple[Check, ...]] = {
    "neuroendoscope_section": (validate_section, validate_figures, validate_render),
    "neuroendoscope": (validate_full, validate_printed_full),
    "spacer_disk": (
        validate_spacer_disk,
        validate_scenarios,
        validate_readings,
        validate_solver_times,
        validate_rod,
        validate_rod_motion,
    ),
    "chest_tube_section": (
        validate_chest_tube,
        validate_terms,
        validate_loads,
        validate_section_sleeve,
        validate_section_requirements,
        validate_calibration,
        validate_printed_shapes,
        validate_times,
        validate_design,
        validate_repeats,
        validate_render_chest_tube,
    ),
    "chest_tube": (validate_full_chest_tube, validate_full_sleeve, validate_full_requirements),
    "mitral_transseptal": (
        validate_transseptal,
        validate_cycles,
        validate_joints,
        validate_flow,
        validate_motion,
        validate_control_transseptal,
        validate_procedure,
        validate_render_transseptal,
    ),
    "mitral_4dof": (
        validate_4dof,
        validate_elongation,
        validate_control_4dof,
        validate_whole,
        validate_sizing,
        validate_render_4dof,
    ),
}


def validate(robots: Sequence[str], folder: Path, progress: bool = False) -> Validation:
    """Run the checks of `robots` (default: all that have checks) and write the results into `folder`.

    Args:
        robots: ids.
        folder: made where it does not exist.
        progress: show what is being done, on standard error.

    Raises:
        InputError: a robot has no checks, or the folder cannot be made.
    """
    for robot in robots:
        if robot not in CHECKS:
            raise unknown("robot with checks", robot, CHECKS)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror or error}") from None
    before, done = _pictures(folder), []
    with Stages("validate", progress, EVERY_S) as stages:
        for robot in robots or CHECKS:
            for number, check in enumerate(CHECKS[robot], 1):
                stages.say(f"{robot}: check {number} of {len(CHECKS[robot])}")
                done.append(check(folder))
    validation = merge(done)
    validation.write(folder)
    drawn = [path for path, written in _pictures(folder).items() if before.get(path) != written]
    write_report(validation, folder, drawn)
    return validation


def _pictures(folder: Path) -> dict[Path, int]:
    """Return the folder's pictures and when they were written [ns]."""
    return {path: path.stat().st_mtime_ns for path in folder.glob("*.png")}
