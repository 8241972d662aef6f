"""The robot in space along a trial, computed before and after: what the report's page turns and plays.

The predictions that make a trial's series know where every element is. They are asked for all of them, so
that a shape costs no prediction of its own. A page gets whole hundredths of a millimetre; of each trial so
many rows, evenly chosen, that it stays small.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import body_count, shown_by
from catheter_sim.core.posture import Observed
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.fit import Fit, as_measured, robot_with
from catheter_sim.diagnosis.noise import outputs_of
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.result import Centrelines, DiagnosisResult, TrialFit
from catheter_sim.diagnosis.trials import Trial, place_along, points_of
from catheter_sim.diagnosis.words import errors_of
from catheter_sim.effects.apply import measured
from catheter_sim.effects.varying import without_variations
from catheter_sim.page.render import page_numbers
from catheter_sim.simulation.moving_twin import MovingTwin
from catheter_sim.tables import Table
from catheter_sim.theory.twins import Prediction

MOST_SHAPES = 2_000
"""[rows] Of a trial, the shape is kept at this many. Why: that is some 3 MB a trial, and a page takes fewer
of them."""
MOST_CHARACTERS = 800_000
"""[characters] A page holds at most this many for the robot in space. Why: with pictures of 0.4 MB and words
of 0.1 MB it stays below 1.5 MB."""
MOST_ERRORS = 4_000
"""[rows] A page holds the error of this many. Why: no screen has more columns to draw in."""
MOST_ON_LINE = 25
"""[points] A page draws a centreline with this many. Why: a bend of half a turn is drawn with corners of 8
degrees."""
_BASE = "body_0"  # the face that the first element stands on
_PER_MM, _PER_ERROR_MM, _PER_S = 100.0, 1e4, 1e4  # parts of a page's places, errors and times
_ROUNDS = 5  # of leaving rows out; fewer rows take a little more each

# ----------------------------------------------------------------------------------------------------
# Where the robot is in a hypothesis, as it would be measured.


def computed_along(
    problem: Problem, trial: Trial, before: Fit, after: Fit
) -> tuple[Array, Array, Centrelines | None]:
    """Return the outputs of two hypotheses along a trial, shape (r, o), and where the robot is in them.

    None: no twin of ours computes them. Of data in motion both are simulated once more, with all elements.
    """
    if not isinstance(problem.twin, Prediction):
        return outputs_of(problem, trial, before), outputs_of(problem, trial, after), None
    count = body_count(problem.robot)
    markers = [name for name in points_of(problem.columns) if name.startswith("marker_")]
    points = (*(f"body_{k + 1}" for k in range(count)), *markers)
    series, places = _with_points(problem, trial, before, points)
    others = (series, places) if after is before else _with_points(problem, trial, after, points)
    rows = _thinned(_measured_rows(trial.outputs), MOST_SHAPES)
    shapes = Centrelines(rows, (_BASE, *points), places[rows], others[1][rows])
    return series, others[0], shapes


def _with_points(problem: Problem, trial: Trial, result: Fit, points: Sequence[str]) -> tuple[Array, Array]:
    """Return outputs, shape (r, o), and the base and points, shape (r, 1 + p, 3) [mm], as measured."""
    assert isinstance(problem.twin, Prediction)
    own, asked = len(problem.columns), _coordinates(points)
    twin = replace(problem.twin, shown=shown_by(problem.robot, (*problem.columns, *asked)))
    if isinstance(twin.twin, MovingTwin):
        twin = replace(twin, twin=replace(twin.twin, remembers=False))
    robot = robot_with(problem, result.numbers, result.x)
    found = twin([robot], trial.inputs)[0]
    series = as_measured(problem, result.numbers, result.x, found[:, :own])
    seen = replace(problem, columns=(*_coordinates([_BASE]), *asked))
    places = np.concatenate([_base_seen(robot, trial), found[:, own:]], axis=1)
    places = as_measured(seen, result.numbers, result.x, places)
    return series, places.reshape(len(places), -1, 3)


def _coordinates(points: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"{point}_{axis}_mm" for point in points for axis in "xyz")


def _base_seen(robot: RobotSpec, trial: Trial) -> Array:
    """Return where the base would be measured, shape (r, 3) [mm]: effects act on what is seen of it, too."""
    rows = len(trial.inputs)
    at = Observed(
        trial.inputs.time_s,
        np.zeros((rows, 1, 3)),
        np.tile(np.eye(3), (rows, 1, 1, 1)),
        np.zeros((rows, 0)),
        trial.inputs.tendon,
    )
    return 1e3 * measured(without_variations(robot), at).p_w[:, 0]


def _measured_rows(outputs: Table) -> np.ndarray:
    """Return the rows in which anything was measured, shape (k,)."""
    return np.flatnonzero(np.any([np.isfinite(values) for values in outputs.columns.values()], axis=0))


def _thinned(rows: np.ndarray, most: int) -> np.ndarray:
    """Return up to `most` of rows, evenly chosen, the first and the last among them."""
    if len(rows) <= most:
        return rows
    return rows[np.round(np.linspace(0, len(rows) - 1, most)).astype(int)]


# ----------------------------------------------------------------------------------------------------
# What a page is given: of some rows of each trial the measured points and the shapes, and all its errors.


def in_space(diagnosis: DiagnosisResult, files: Sequence[str]) -> dict[str, Any] | None:
    """Return what a page needs to show the robot in space; None where no point was measured in two axes.

    Numbers are as `page_numbers` gives them; `files` are the names of the trials' series.
    """
    points = {name: "".join(axes) for name, axes in points_of(diagnosis.dataset.output_channels).items()}
    points = {name: points[name] for name in sorted(points, key=place_along) if len(points[name]) > 1}
    if not points or not diagnosis.was_fitted:
        return None
    share, trials = 1.0, _of_trials(diagnosis, files, points, 1.0)
    for _ in range(_ROUNDS):
        size = sum(len(json.dumps(trial)) for trial in trials)
        if size <= MOST_CHARACTERS:
            break
        share *= 0.95 * MOST_CHARACTERS / size
        trials = _of_trials(diagnosis, files, points, share)
    shown = max(range(len(trials)), key=lambda index: _worth(trials[index]), default=None)
    if shown is None:
        return None
    return {"trials": trials, "first": shown}


def _of_trials(
    diagnosis: DiagnosisResult, files: Sequence[str], points: dict[str, str], share: float
) -> list[dict[str, Any]]:
    """Return what a page has of each trial in which anything was measured, in a share of the rows."""
    of_errors = min(1.0, MOST_ERRORS / max(1, sum(len(fit.time_s) for fit in diagnosis.fits)))
    found = []
    for fit, file in zip(diagnosis.fits, files, strict=True):
        rows = _measured_rows(fit.measured) if fit.shapes is None else fit.shapes.rows
        if len(rows):
            kept = _thinned(rows, max(2, int(share * min(len(rows), MOST_SHAPES))))
            found.append(_of_trial(diagnosis, fit, file, points, kept, of_errors))
    return found


def words_on_rows(space: dict[str, Any]) -> str:
    """Return what a page says of rows and shapes that it leaves out."""
    said = []
    shown, known = (sum(trial[name] for trial in space["trials"]) for name in ("shown_rows", "measured_rows"))
    if shown < known:
        said.append(
            f"To keep this page small, it shows {shown} of {known} rows, evenly chosen. The CSV files beside "
            "it hold all."
        )
    if all(trial["line"] is None for trial in space["trials"]):
        said.append("The shape between the points is not at hand for this model.")
    return " ".join(said)


def _worth(trial: dict[str, Any]) -> tuple[bool, int]:
    """Return what decides which trial is shown first: held out, then with most rows measured."""
    return trial["role"] == "heldout", trial["measured_rows"]


def _of_trial(
    diagnosis: DiagnosisResult,
    fit: TrialFit,
    file: str,
    points: dict[str, str],
    rows: np.ndarray,
    of_errors: float,
) -> dict[str, Any]:
    known = len(_measured_rows(fit.measured))
    return {
        "file": fit.file,
        "role": fit.role,
        "series": file,
        "measured_rows": known,
        "shown_rows": len(rows),
        "rows": page_numbers(rows + 1, 1),
        "time_s": page_numbers(fit.time_s[rows] - fit.time_s[0], _PER_S),
        "points": [_of_point(fit, name, axes, rows) for name, axes in points.items()],
        "line": _line(diagnosis, fit, rows),
        "error": _errors(fit, points, max(2, int(of_errors * known))),
    }


def _of_point(fit: TrialFit, name: str, axes: str, rows: np.ndarray) -> dict[str, Any]:
    """Return a point's course in rows, measured and computed; the axes that were not measured, computed."""
    found: dict[str, Any] = {"name": name}
    for stage, table in (("measured", fit.measured), ("before", fit.before), ("after", fit.after)):
        own = {axis: table.columns[f"{name}_{axis}_mm"][rows] for axis in axes}
        if stage != "measured" and fit.shapes is not None:
            places = getattr(fit.shapes, stage)[np.searchsorted(fit.shapes.rows, rows), _place(fit, name)]
            own = {axis: own.get(axis, places[:, index]) for index, axis in enumerate("xyz")}
        found[stage] = {axis: page_numbers(values, _PER_MM) for axis, values in own.items()}
    return found


def _place(fit: TrialFit, point: str) -> int:
    """Return the place of a measured point among those of the shapes: the tip is the last element."""
    assert fit.shapes is not None
    names = fit.shapes.points
    elements = [name for name in names if name.startswith("body_")]
    return names.index(elements[-1] if point == "tip" else point)


def _on_line(fit: TrialFit) -> np.ndarray:
    """Return which of a trial's points are drawn as its centreline: base and tip, and elements between."""
    if fit.shapes is None:
        return np.arange(0)
    count = sum(name.startswith("body_") for name in fit.shapes.points)
    return _thinned(np.arange(count), MOST_ON_LINE)


def _line(diagnosis: DiagnosisResult, fit: TrialFit, rows: np.ndarray) -> dict[str, Any] | None:
    """Return centrelines in rows: the base, then from each point to the next; NaN where one is missing.

    Coordinate by coordinate, each in all rows: from row to row they change little.
    """
    if fit.shapes is None:
        return None
    points, own = _on_line(fit), np.searchsorted(fit.shapes.rows, rows)
    radii = radii_mm(diagnosis.dataset.robot, points)
    found: dict[str, Any] = {"radius_mm": [round(value, 2) for value in radii.tolist()]}
    for stage in ("before", "after"):
        places = np.round(_PER_MM * getattr(fit.shapes, stage)[own][:, points]) / _PER_MM
        steps = np.diff(places, axis=1, prepend=0.0).reshape(len(rows), -1)
        steps[~np.isfinite(steps).all(axis=1)] = np.nan
        found[stage] = page_numbers(steps.T, _PER_MM)
    return found


def radii_mm(robot: RobotSpec, points: np.ndarray) -> Array:
    """Return the outer radius at the base (0) and after some elements, by their share of the length [mm]."""
    ends = np.cumsum([segment.length_m for segment in robot.segments])
    share = np.maximum(points - 0.5, 0.0) / max(1, body_count(robot))
    which = np.minimum(np.searchsorted(ends / ends[-1], share), len(ends) - 1)
    return 1e3 * np.array([robot.segments[index].outer_radius_m for index in which])


def _errors(fit: TrialFit, points: dict[str, str], most: int) -> dict[str, Any]:
    """Return the distance from measured to computed over time, of several points their root mean square."""
    columns = [f"{name}_{axis}_mm" for name, axes in points.items() for axis in axes]
    known = np.isfinite([fit.measured.columns[name] for name in columns])
    rows = _thinned(np.flatnonzero(known.any(axis=0)), most)
    seen = np.maximum(
        1, sum(known[[name.startswith(f"{point}_") for name in columns]].any(axis=0) for point in points)
    )
    found = {"time_s": page_numbers(fit.time_s[rows] - fit.time_s[0], _PER_S)}
    for stage in ("before", "after"):
        squares = np.where(known, errors_of(fit, columns, stage) ** 2, 0.0).sum(axis=0)
        found[stage] = page_numbers(np.sqrt(squares / seen)[rows], _PER_ERROR_MM)
    return found
