"""Make what is judged wrong by a fifth, and count which judged lines of `validate` notice.

    python scripts/perturb_validation.py [ROBOT ...] [--checks NAME ...] [--all] [--only-page]

A check that cannot fail says nothing. So the robot that is judged is changed, one number at a time, and the
check is run again: its stiffness, its friction, the gain of its inputs (as a moment arm would be), its
length, each by 20 %. What it is judged against stays as it is: where the simulation is judged, statics and
the nested reference are not changed; where static models are judged, those that they are compared with are
not. Two more changes are for lines that none of these touches: damping of a fifth of a polymer's, and a
rest curvature of a fifth over the length. What is said of solvers' times no robot changes: there
each model takes the times of the next one, or each number of disks those of another, in the opposite order.

Each change is made of the simulation, then of static models, then of models that others are compared
with (not where a line's source names them). A line that has turned red is left; `--all` makes every change
of the simulation all the same. Results go into docs/truth/perturbed_lines.csv, run by run, and a run that
stands there is not made again; docs/truth/perturbed_lines.md is written from it.
"""

from __future__ import annotations

import argparse
import csv
import inspect
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unittest.mock import patch

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import DAMPING_TIME_S, Friction, RobotSpec, with_segments
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter import measured as modified
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.theory.static_models import STATIC_MODELS, TheoryModel
from catheter_sim.validation import (
    mitral,
    tdcr_readings,
)
from catheter_sim.validation import (
    rod as rod_motion,
)
from catheter_sim.validation.lines import Line
from catheter_sim.validation.report import CHECKS

TRUTH = Path(__file__).resolve().parent.parent / "docs" / "truth"
TABLE, PAGE = TRUTH / "perturbed_lines.csv", TRUTH / "perturbed_lines.md"
SHARE = 0.2
AS_IT_IS = "as it is"
REFERENCES = ("VC_ref", "VC_ref_noproj", "complete", "complete_sliding", "fkm_sliding", "printed")
_KEYS = ("robot", "check", "line", "quantity", "unit", "tolerance", "source")


def stiffer(robot: Any) -> Any:
    """Return the robot with every elastic constant a fifth larger."""
    return replace(robot, stiffness_scale=robot.stiffness_scale * (1.0 + SHARE))


def rougher(robot: Any) -> Any:
    """Return the robot with a fifth more friction."""
    return replace(robot, friction=Friction(robot.friction.mu * (1.0 + SHARE)))


def smoother(robot: Any) -> Any:
    """Return the robot with a fifth less friction."""
    return replace(robot, friction=Friction(robot.friction.mu * (1.0 - SHARE)))


def longer(robot: Any) -> Any:
    """Return the robot with every segment a fifth longer."""
    parts = tuple(replace(part, length_m=part.length_m * (1.0 + SHARE)) for part in robot.segments)
    return replace(robot, segments=parts)


def damped(robot: Any) -> Any:
    """Return the robot with a fifth of a polymer's damping besides its own."""
    time_s = robot.dynamics.damping_time_s + SHARE * DAMPING_TIME_S
    return replace(robot, dynamics=replace(robot.dynamics, damping_time_s=time_s))


def curved(robot: Any) -> Any:
    """Return the robot with a rest curvature of a fifth over its length, or its joints bent so at rest."""
    length = sum(part.length_m for part in robot.segments)
    if hasattr(robot.segments[0], "rest_curvature_x_per_m"):
        return with_segments(robot, [{"rest_curvature_x_per_m": SHARE / length} for _ in robot.segments])
    bending = [part.joint == "bending" for part in robot.segments]
    return with_segments(robot, [{"rest_rad": SHARE} if own else {} for own in bending])


@dataclass(frozen=True)
class Change:
    """What is made wrong: the robot, or the gain of its inputs."""

    robot: Callable[[Any], Any] | None = None
    gain: float = 1.0


CHANGES: Mapping[str, Change] = {
    "stiffness": Change(stiffer),
    "gain": Change(gain=1.0 - SHARE),
    "friction": Change(rougher),
    "length": Change(longer),
    "less friction": Change(smoother),
    "damping": Change(damped),
    "rest curvature": Change(curved),
}
MORE = ("damping", "rest curvature")  # for lines that nothing else touches


@contextmanager
def changed_simulation(change: Change) -> Iterator[None]:
    """Let every simulated robot be the changed one, but the nested reference and robots in a scene.

    What is judged without a simulation gets the gain, too: a tendon by itself, printed lines, moments.
    """
    made, given, build = Simulator.__init__, Simulator.put_inputs, rod_motion.build_mjcf
    bend, sections = modified.bending_rad, tdcr_readings.section_moments
    signature = inspect.signature(made)

    def init(self: Simulator, *args: Any, **kwargs: Any) -> None:
        named = signature.bind(self, *args, **kwargs)
        alone = named.arguments.get("model") is None and named.arguments.get("model_text") is None
        self.judged = named.arguments.get("friction") != "nested"  # type: ignore[attr-defined]
        if change.robot and alone and self.judged:  # type: ignore[attr-defined]
            named.arguments["robot"] = _with(change, named.arguments["robot"])
        made(*named.args, **named.kwargs)

    def put_inputs(self: Simulator, tendon: Any, *args: Any, **kwargs: Any) -> None:
        given(self, tendon * (change.gain if self.judged else 1.0), *args, **kwargs)  # type: ignore[attr-defined]

    def build_changed(robot: Any, **kwargs: Any) -> str:
        return build(_with(change, robot), **kwargs)

    class ChangedTendon(mitral.StretchingTendon):
        """A tendon by itself, drawn by too much or too little."""

        def at(self, stretch_m: float) -> Any:
            return super().at(stretch_m * change.gain)

    first, *others = modified.BENDING.alpha
    calibrated = replace(modified.BENDING, alpha=(first * change.gain, *others))

    def bending_rad(segment: Any, displacement_m: Any, calibration: Any = calibrated) -> Any:
        return bend(segment, displacement_m, calibration)

    def section_moments(rod: Any, tension: Any, *args: Any) -> Any:
        return sections(rod, tension * change.gain, *args)

    with (
        patch.object(modified, "bending_rad", bending_rad),
        patch.object(tdcr_readings, "section_moments", section_moments),
        patch.object(Simulator, "__init__", init),
        patch.object(Simulator, "put_inputs", put_inputs),
        patch.object(rod_motion, "build_mjcf", build_changed),
        patch.object(mitral, "StretchingTendon", ChangedTendon),
    ):
        yield


@contextmanager
def changed_statics(change: Change, names: Sequence[str], called: list[str]) -> Iterator[None]:
    """Let the named static models solve the changed robot, wherever the checks call them.

    Args:
        called: gets a word for each call, so that models that a check does not ask are seen.
    """
    own = TheoryModel.law.fget
    assert own is not None

    def solve(function: Callable[..., Any], robot: Any, inputs: Any, *args: Any, **kwargs: Any) -> Any:
        called.append(function.__name__)
        return function(
            _with(change, robot), replace(inputs, tendon=inputs.tendon * change.gain), *args, **kwargs
        )

    def law(self: TheoryModel) -> Callable[..., Any]:
        found = own(self)
        return (lambda *a, **k: solve(found, *a, **k)) if self.name in names else found

    with ExitStack() as stack:
        stack.enter_context(patch.object(TheoryModel, "law", property(law)))
        for module in [m for n, m in sys.modules.items() if n.startswith("catheter_sim.validation.")]:
            for name, value in list(vars(module).items()):
                if inspect.isfunction(value) and value.__name__ in names and ".robots." in value.__module__:

                    def wrapped(*a: Any, function: Callable[..., Any] = value, **k: Any) -> Any:
                        return solve(function, *a, **k)

                    stack.enter_context(patch.object(module, name, wrapped))
        yield


def of_the_next_model(times: Mapping[int, tdcr_readings.Times]) -> dict[int, tdcr_readings.Times]:
    """Return solvers' times by numbers of disks, each model with the next one's, the last the first's."""
    following = dict(
        zip(
            tdcr_readings.TIMED_MODELS,
            (*tdcr_readings.TIMED_MODELS[1:], tdcr_readings.TIMED_MODELS[0]),
            strict=True,
        )
    )
    return {disks: {model: found[following[model]] for model in found} for disks, found in times.items()}


def in_opposite_order(times: Mapping[int, tdcr_readings.Times]) -> dict[int, tdcr_readings.Times]:
    """Return solvers' times in which the most disks have those of the fewest, and so on."""
    return dict(zip(times, reversed(list(times.values())), strict=True))


@contextmanager
def changed_times(change: Callable[[Any], Any]) -> Iterator[None]:
    """Let the times that are told be changed ones."""
    measured = tdcr_readings.times_by_disks
    with patch.object(tdcr_readings, "times_by_disks", lambda: change(measured())):
        yield


def _with(change: Change, robot: RobotSpec) -> RobotSpec:
    return robot if change.robot is None else change.robot(robot)


def runs_of_statics(robot: str) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield what is changed together among a robot's static models: all but references, then each alone."""
    known = load_robot(robot)
    names = [name for name, model in STATIC_MODELS.items() if model.applies_to(known)]
    yield "static models", tuple(name for name in names if name not in REFERENCES)
    for name in sorted(names, key=lambda name: name not in REFERENCES):
        yield name, (name,)


class Results:
    """The table: a row for each judged line, a column for each run."""

    def __init__(self, path: Path) -> None:
        """Read what stands there."""
        self._path = path
        self.rows: list[dict[str, str]] = []
        self.runs: list[str] = []
        if path.is_file():
            with path.open(newline="", encoding="utf-8") as file:
                reader = csv.DictReader(file)
                self.rows = list(reader)
                self.runs = [name for name in reader.fieldnames or () if name not in _KEYS]

    def of(self, robot: str, check: str) -> list[dict[str, str]]:
        """Return a check's rows."""
        return [row for row in self.rows if (row["robot"], row["check"]) == (robot, check)]

    def put(self, robot: str, check: str, run: str, errors: Sequence[str], lines: Sequence[Line]) -> None:
        """Add a run; lines are those of the check as it is, where this is their first."""
        if run not in self.runs:
            self.runs.append(run)
        if not self.of(robot, check):
            for k, line in enumerate(lines):
                told = (robot, check, str(k), line.quantity, line.unit, repr(line.tolerance), line.source)
                self.rows.append(dict(zip(_KEYS, told, strict=True)))
        for row, error in zip(self.of(robot, check), errors, strict=True):
            row[run] = error
        with self._path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, (*_KEYS, *self.runs), restval="", lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows)


def red_by(row: Mapping[str, str], runs: Sequence[str]) -> list[str]:
    """Return the runs in which a line is out of its tolerance, those left out that change its reference."""
    return [run for run in runs if run != AS_IT_IS and _red(row, run) and not _is_reference(row, run)]


def _red(row: Mapping[str, str], run: str) -> bool:
    error = row.get(run) or "-"
    return error == "nan" or (error not in ("-", "stopped") and float(error) > float(row["tolerance"]))


def _is_reference(row: Mapping[str, str], run: str) -> bool:
    what = run.partition(": ")[0]
    return what in REFERENCES and (what in row["source"].replace(",", " ").replace(";", " ").split())


def judged(check: Callable[[Path], Any]) -> list[Line]:
    """Return the judged lines of a check; what it draws is thrown away."""
    with tempfile.TemporaryDirectory() as folder:
        return [line for line in check(Path(folder)).lines if line.tolerance is not None]


def perturb(robot: str, check: Callable[[Path], Any], results: Results, every: bool) -> None:
    """Run one check as it is and changed, until each of its lines has turned red."""
    name = check.__name__
    if not results.of(robot, name):
        began = time.process_time()
        lines = judged(check)
        print(f"{robot} {name}: {len(lines)} judged, {time.process_time() - began:.0f} s", flush=True)
        if not lines:
            return
        results.put(robot, name, AS_IT_IS, [_said(line.error) for line in lines], lines)

    def still_green() -> bool:
        return any(not red_by(row, results.runs) for row in results.of(robot, name))

    def once(run: str, changing: Any) -> bool:
        rows = results.of(robot, name)
        if any(row.get(run) for row in rows):
            return False
        with changing:
            try:
                errors = [_said(line.error) for line in judged(check)]
            except (InputError, ValueError, AssertionError, ArithmeticError, IndexError) as error:
                print(f"{robot} {name}, {run}: stopped: {error}", flush=True)
                errors = ["stopped"] * len(rows)
        if len(errors) != len(rows):
            errors = ["stopped"] * len(rows)
        results.put(robot, name, run, errors, ())
        green = sum(not red_by(row, results.runs) for row in results.of(robot, name))
        print(f"{robot} {name}, {run}: {green} of {len(rows)} still green", flush=True)
        return True

    def of_statics(models: str, names: Sequence[str], what: str) -> bool:
        """Change models' robot, where lines are still green; return whether the check asks these models."""
        called: list[str] = []
        made = still_green() and once(f"{models}: {what}", changed_statics(CHANGES[what], names, called))
        return not made or bool(called)

    if check is tdcr_readings.validate_solver_times:
        once("times: of the next model", changed_times(of_the_next_model))
        once("times: disks in the opposite order", changed_times(in_opposite_order))
        return
    (models, names), *references = runs_of_statics(robot)
    asked = True
    for what, change in CHANGES.items():
        if still_green() or (every and what not in MORE):
            once(f"simulation: {what}", changed_simulation(change))
        if asked and what not in MORE:
            asked = of_statics(models, names, what)
    for models, names in references:
        for what in CHANGES:
            if what not in MORE and not of_statics(models, names, what):
                break


def _said(error: float) -> str:
    return f"{error:.4g}" if math.isfinite(error) else "nan"


def page(results: Results) -> str:
    """Return the page: a row for each judged line, and what turned it red."""
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True)
    rows = [(row, red_by(row, results.runs)) for row in results.rows]
    never = [row for row, runs in rows if not runs]
    text = [
        "# Every judged line can fail",
        "",
        "`scripts/perturb_validation.py` makes what is judged wrong by 20 %, one number at a time, and",
        "runs the checks again; what it is judged against stays as it is. Each row is a judged line of",
        "`validate`: its error as it is, its tolerance, and the changes that turned it red, with its error",
        "then.",
        "Once all lines of a check are red no further change of it is tried. All figures are in",
        "`docs/truth/perturbed_lines.csv`. A check that has no line here has none that is judged: what no",
        "change turned is shown by `validate`, and not judged.",
        f"Made {datetime.now(UTC):%Y-%m-%d} with commit {commit.stdout.strip()}.",
        "",
        f"{len(rows) - len(never)} of {len(rows)} lines turn red.",
        "",
        "| line | as it is | tolerance | turned red by |",
        "|---|---|---|---|",
    ]
    for row, runs in rows:
        reds = ", ".join(f"{run} ({row[run]})" for run in runs) or "**nothing**"
        most = f"{float(row['tolerance']):.3g} {row['unit']}"
        text.append(f"| {row['robot']}: {row['quantity']} | {row[AS_IT_IS]} | {most} | {reds} |")
    return "\n".join(text) + "\n"


def main() -> int:
    """Make the runs that are missing and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("robots", nargs="*", choices=[*CHECKS, []], help="default: all")
    parser.add_argument("--checks", nargs="+", help="names of check functions; default: all of the robots'")
    parser.add_argument("--all", action="store_true", help="every change of the simulation")
    parser.add_argument("--only-page", action="store_true", help="no runs; write the page")
    options = parser.parse_args()
    results = Results(TABLE)
    for robot in () if options.only_page else options.robots or CHECKS:
        for check in CHECKS[robot]:
            if options.checks is None or check.__name__ in options.checks:
                perturb(robot, check, results, options.all)
    PAGE.write_text(page(results), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
