"""Runs the checks of chosen robots and leaves a page, table, JSON and plots in a folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from catheter_sim.diagnosis.words import listed, spoken, words
from catheter_sim.errors import InputError, unknown
from catheter_sim.page.render import png_source, rendered
from catheter_sim.progress import EVERY_S, Stages
from catheter_sim.tables import replaced_when_whole
from catheter_sim.validation.chest_tube import validate_design, validate_surface, validate_terms
from catheter_sim.validation.chest_tube import validate_section as validate_chest_tube
from catheter_sim.validation.chest_tube_full import validate_full as validate_full_chest_tube
from catheter_sim.validation.chest_tube_full import (
    validate_full_requirements,
    validate_full_sleeve,
    validate_loads,
    validate_section_requirements,
    validate_section_sleeve,
)
from catheter_sim.validation.chest_tube_measured import (
    validate_calibration,
    validate_printed_shapes,
    validate_repeats,
    validate_times,
)
from catheter_sim.validation.lines import Line, Validation, merge
from catheter_sim.validation.mitral import (
    validate_4dof,
    validate_cycles,
    validate_elongation,
    validate_joints,
    validate_sizing,
    validate_transseptal,
)
from catheter_sim.validation.mitral_control import (
    validate_control_4dof,
    validate_control_transseptal,
    validate_flow,
    validate_procedure,
    validate_whole,
)
from catheter_sim.validation.mitral_tables import validate_motion
from catheter_sim.validation.neuroendoscope import (
    validate_figures,
    validate_full,
    validate_printed_full,
    validate_section,
)
from catheter_sim.validation.neuroendoscope_softening import validate_softening
from catheter_sim.validation.papers import Paper, load_paper, printed_and_ours
from catheter_sim.validation.render import (
    validate_render_4dof,
    validate_render_chest_tube,
    validate_render_chest_tube_section,
    validate_render_neuroendoscope,
    validate_render_neuroendoscope_section,
    validate_render_spacer_disk,
    validate_render_transseptal,
    validate_render_wrist,
)
from catheter_sim.validation.rod import validate_rod, validate_rod_motion
from catheter_sim.validation.spacer_disk import validate_scenarios, validate_spacer_disk
from catheter_sim.validation.tdcr_readings import validate_readings, validate_solver_times

# ----------------------------------------------------------------------------------------------------
# The validation as a page, of the same hand as a diagnosis's report.

REPORT = "report.html"

# What the pictures show, by the end of their names.
CAPTIONS = {
    "body_stages": "Force of a string at the tip over the tip's place, for three bodies",
    "bare": "Loops of the joints without the tube",
    "buckling": "Angles of all joints over the tension, by the printed and by the complete balance",
    "constant_curvature": "Distance from constant curvature over the tension, loading and unloading",
    "control_4dof": "Joints under control, asked and reached",
    "control_transseptal": "The servo of the transseptal catheter, asked and reached",
    "convergence": "Mean error of the tip over the links a subsegment",
    "design": "Bend over the tension by where the rods' levers are, and what rods hold that tendons do not",
    "elongation": "Stretch of the tendon over its tension, law and simulation",
    "friction": "Place of the tip over histories with friction, simulation over statics",
    "loops": "Place of the tip over the right tendon's tension, simulation over static models",
    "motion": "Motions of the tip, simulation over kinematic models",
    "postures": "Backbones in arching and extending, simulation over constant curvature",
    "printed_shapes": "Shapes of the printed balance, simulation and constant curvature fitted to them",
    "release": "Distance of a released rod from the reference, over time",
    "repeats": "Bend of drawn tests, one over the other",
    "scenario_1": "Errors of the tip by model and number of disks",
    "scenario_2": "Errors of the tip by model and stiffness",
    "shapes": "Backbones in the bending plane, simulation over the static model",
    "tension": "Tension along the tendon in arching and extending",
    "tensions": "Tension along the tendons, with friction and by constant curvature",
    "terms": "Bend of the even joints over the tension, by choice of terms",
    "tube": "Loops of the joints with the tube",
    "whole_robot": "The whole robot along its trajectory, asked and reached",
}


def validation_html(validation: Validation, pictures: Sequence[Path] = (), paper: Paper | None = None) -> str:
    """Return a validation as one HTML text that needs no network; of a paper with all that it prints."""
    judged = [line for line in validation.lines if line.tolerance is not None]
    out = [line for line in validation.lines if not line.passed]
    ids = list(dict.fromkeys(line.robot for line in validation.lines))
    context = {
        "names": listed([words(name) for name in ids]) or "no robot",
        "passed": validation.passed,
        "sentence": _sentence(validation, len(judged), len(out)),
        "judged": {"within": len(judged) - len(out), "all": len(judged)},
        "informing": len(validation.lines) - len(judged),
        "out": [_shown(line) for line in out],
        "robots": [_robot(name, [line for line in validation.lines if line.robot == name]) for name in ids],
        "findings": validation.findings,
        "paper": paper,
        "printed": [] if paper is None else printed_and_ours(paper, validation.lines),
        "pictures": [
            {"words": caption(path), "data": png_source(path.read_bytes())} for path in sorted(pictures)
        ],
    }
    return rendered("catheter_sim.validation", "report_template.html", context, {"spoken": spoken})


def write_report(
    validation: Validation, folder: Path, pictures: Sequence[Path] = (), paper: Paper | None = None
) -> None:
    """Write `report.html` into `folder`."""
    with replaced_when_whole(folder / REPORT) as file:
        file.write(validation_html(validation, pictures, paper))


def caption(path: Path) -> str:
    """Return what a picture shows, by its file's name: of what, then what of it."""
    for ending, said in CAPTIONS.items():
        if path.stem.endswith(ending):
            of = words(path.stem.removesuffix(ending)).strip()
            return f"{said} ({of})" if of else said
    return f"Picture of {words(path.stem)}"


def _sentence(validation: Validation, judged: int, out: int) -> str:
    if validation.passed:
        return (
            f"The simulation agrees with static models and published values: all {judged} lines that are "
            "judged are within their tolerance."
        )
    if not validation.lines:
        return "Nothing was compared, which is no agreement."
    return (
        f"{out} of {judged} judged lines are out of their tolerance: the simulation, or what it is held to, "
        "is wrong."
    )


def _robot(name: str, lines: Sequence[Line]) -> dict[str, Any]:
    judged = [line for line in lines if line.tolerance is not None]
    used = [(line.error / line.tolerance, line.quantity) for line in judged if line.tolerance and line.passed]
    most = max(used, default=(0.0, "-"))
    return {
        "id": name,
        "name": words(name),
        "lines": [_shown(line) for line in lines],
        "judged": len(judged),
        "within": sum(line.passed for line in judged),
        "informing": len(lines) - len(judged),
        "used": f"{100.0 * most[0]:.0f} %" if used else "-",
        "by": most[1],
    }


def _shown(line: Line) -> dict[str, str]:
    """Return a line as it is read: its numbers with four digits, "-" where there is none."""
    numbers = {
        name: "-" if value is None else f"{value:.4g}"
        for name, value in (
            ("ours", line.ours),
            ("analytic", line.analytic),
            ("published", line.published),
            ("error", line.error),
            ("tolerance", line.tolerance),
        )
    }
    return numbers | {
        "robot": words(line.robot),
        "quantity": line.quantity,
        "unit": line.unit,
        "kind": line.kind,
        "verdict": line.verdict,
        "source": line.source,
    }


# ----------------------------------------------------------------------------------------------------
# Runs the checks of chosen robots and leaves a page, table, JSON and plots in a folder.

Check = Callable[[Path], Validation]

CHECKS: Mapping[str, tuple[Check, ...]] = {
    "neuroendoscope_section": (
        validate_section,
        validate_figures,
        validate_softening,
        validate_render_neuroendoscope_section,
    ),
    "neuroendoscope": (validate_full, validate_printed_full, validate_render_neuroendoscope),
    "spacer_disk": (
        validate_spacer_disk,
        validate_scenarios,
        validate_readings,
        validate_solver_times,
        validate_rod,
        validate_rod_motion,
        validate_render_spacer_disk,
    ),
    "chest_tube_section": (
        validate_chest_tube,
        validate_terms,
        validate_surface,
        validate_loads,
        validate_section_sleeve,
        validate_section_requirements,
        validate_calibration,
        validate_printed_shapes,
        validate_times,
        validate_design,
        validate_repeats,
        validate_render_chest_tube_section,
    ),
    "chest_tube": (
        validate_full_chest_tube,
        validate_full_sleeve,
        validate_full_requirements,
        validate_render_chest_tube,
    ),
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
    "notched_wrist": (validate_render_wrist,),
}


def validate(robots: Sequence[str], folder: Path, progress: bool = False, paper: str = "") -> Validation:
    """Run the checks of `robots` (default: all that have checks) and write the results into `folder`.

    Args:
        robots: ids.
        folder: made where it does not exist.
        progress: show what is being done, on standard error.
        paper: a paper's name; then the robots are its own, and the report has all that it prints.

    Raises:
        InputError: a robot has no checks, there is no such paper, or the folder cannot be made.
    """
    about = load_paper(paper) if paper else None
    if about is not None:
        robots = about.robots
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
    write_report(validation, folder, drawn, about)
    return validation


def _pictures(folder: Path) -> dict[Path, int]:
    """Return the folder's pictures and when they were written [ns]."""
    return {path: path.stat().st_mtime_ns for path in folder.glob("*.png")}
