"""Make the constant that a judged line of `validate` is about wrong by a tenth, and see whether it notices.

    python scripts/perturb_validation.py [ROBOT ...] [--checks NAME ...] [--only-page]

A check that cannot fail says nothing. Every judged line names the constant that it is about, and whose it is
(`Line.about`): "simulation: stiffness". That number is made a tenth larger, then a tenth smaller, of that
model alone, and the check is run again; what it is judged against stays as it is. Numbers: all elastic
constants alike, friction, the gain of the inputs (as a moment arm's), the length, the damping time. A line
that another change would turn red is not shown by it. What is said of solvers' times no robot changes: there
each model takes the times of the next one, or each number of disks those of another, in the opposite order.

Results go into docs/truth/perturbed_lines.csv, check by check, and a run that stands there is not made again;
docs/truth/perturbed_lines.md is written from it, with the lines that survive and why (`SURVIVORS`).
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
from catheter_sim.core.robot import Friction, RobotSpec
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
AS_IT_IS = "as it is"
SIDES = {"+10 %": 1.1, "-10 %": 0.9}  # of the constant that a line is about
REFERENCES = ("VC_ref", "VC_ref_noproj", "complete", "complete_sliding", "fkm_sliding", "printed")
_KEYS = ("robot", "check", "line", "quantity", "unit", "tolerance", "about")
# Why a line survives a tenth, by a part of its quantity.
SURVIVORS: Mapping[str, str] = {
    "solver times": "a claim about a clock's ratios that lie far from 1; no constant of a robot is in it",
    "without damping": "its constant is zero: a tenth of nothing is nothing",
    "loads turned by": "a symmetry: it holds for every stiffness",
    "errors of CC and VC apart": "one-sided, and an order of magnitude: VC's stretch, not its stiffness",
}


def stiffer(robot: Any, factor: float) -> Any:
    """Return the robot with every elastic constant so many times as large."""
    return replace(robot, stiffness_scale=robot.stiffness_scale * factor)


def rougher(robot: Any, factor: float) -> Any:
    """Return the robot with so many times the friction."""
    return replace(robot, friction=Friction(robot.friction.mu * factor))


def longer(robot: Any, factor: float) -> Any:
    """Return the robot with every segment so many times as long."""
    parts = tuple(replace(part, length_m=part.length_m * factor) for part in robot.segments)
    return replace(robot, segments=parts)


def damped(robot: Any, factor: float) -> Any:
    """Return the robot with so many times the damping time."""
    time_s = robot.dynamics.damping_time_s * factor
    return replace(robot, dynamics=replace(robot.dynamics, damping_time_s=time_s))


@dataclass(frozen=True)
class Change:
    """What is made wrong: the robot, or the gain of its inputs."""

    robot: Callable[[Any], Any] | None = None
    gain: float = 1.0


NUMBERS: Mapping[str, Callable[[Any, float], Any]] = {
    "stiffness": stiffer,
    "friction": rougher,
    "length": longer,
    "damping": damped,
}


def change_of(number: str, factor: float) -> Change:
    """Return the change that makes a number so many times as large."""
    if number == "gain":
        return Change(gain=factor)
    return Change(lambda robot: NUMBERS[number](robot, factor))


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
def changed_statics(change: Change, names: Sequence[str]) -> Iterator[None]:
    """Let the named static models solve the changed robot, wherever the checks call them."""
    own = TheoryModel.law.fget
    assert own is not None

    def solve(function: Callable[..., Any], robot: Any, inputs: Any, *args: Any, **kwargs: Any) -> Any:
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


def models_of(robot: str, whose: str) -> tuple[str, ...]:
    """Return the static models that are changed: one by its name, or all that no other is judged by."""
    if whose != "static models":
        return (whose,)
    known = load_robot(robot)
    names = (name for name, model in STATIC_MODELS.items() if model.applies_to(known))
    return tuple(name for name in names if name not in REFERENCES)


def changing(robot: str, about: str, factor: float) -> Any:
    """Return the context in which the constant `about` names is so many times as large."""
    whose, _, number = about.partition(": ")
    if whose == "times":
        return changed_times(of_the_next_model if factor > 1.0 else in_opposite_order)
    if whose == "simulation":
        return changed_simulation(change_of(number, factor))
    return changed_statics(change_of(number, factor), models_of(robot, whose))


class Results:
    """The table: a row for each judged line, a column for each run."""

    def __init__(self, path: Path) -> None:
        """Read what stands there."""
        self._path = path
        self.rows: list[dict[str, str]] = []
        if path.is_file():
            with path.open(newline="", encoding="utf-8") as file:
                reader = csv.DictReader(file)
                self.rows = list(reader)

    def of(self, robot: str, check: str) -> list[dict[str, str]]:
        """Return a check's rows."""
        return [row for row in self.rows if (row["robot"], row["check"]) == (robot, check)]

    def put(self, robot: str, check: str, lines: Sequence[Line]) -> None:
        """Add a check's judged lines as they are."""
        for k, line in enumerate(lines):
            told = (robot, check, str(k), line.quantity, line.unit, repr(line.tolerance), line.about)
            row = dict(zip(_KEYS, told, strict=True))
            self.rows.append(row | {AS_IT_IS: _said(line.error)} | dict.fromkeys(SIDES, ""))

    def write(self) -> None:
        """Write what stands there now."""
        with self._path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, (*_KEYS, AS_IT_IS, *SIDES), restval="", lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows)


def is_red(row: Mapping[str, str], side: str) -> bool:
    """Return whether a line is out of its tolerance with its constant wrong to that side."""
    error = row.get(side) or "-"
    return error == "nan" or (error not in ("-", "stopped") and float(error) > float(row["tolerance"]))


def judged(check: Callable[[Path], Any]) -> list[Line]:
    """Return the judged lines of a check; what it draws is thrown away."""
    with tempfile.TemporaryDirectory() as folder:
        return [line for line in check(Path(folder)).lines if line.tolerance is not None]


def perturb(robot: str, check: Callable[[Path], Any], results: Results) -> None:
    """Run one check as it is, and with the constants of its lines wrong to both sides."""
    name = check.__name__
    if not results.of(robot, name):
        began = time.process_time()
        lines = judged(check)
        print(f"{robot} {name}: {len(lines)} judged, {time.process_time() - began:.0f} s", flush=True)
        results.put(robot, name, lines)
        results.write()
    rows = results.of(robot, name)
    for about in dict.fromkeys(row["about"] for row in rows):
        for side, factor in SIDES.items():
            own = [row for row in rows if row["about"] == about]
            if all(row[side] for row in own):
                continue
            with changing(robot, about, factor):
                try:
                    errors = [_said(line.error) for line in judged(check)]
                except (InputError, ValueError, AssertionError, ArithmeticError, IndexError) as error:
                    print(f"{robot} {name}, {about} {side}: stopped: {error}", flush=True)
                    errors = []
            found = errors if len(errors) == len(rows) else ["stopped"] * len(rows)
            for row in own:
                row[side] = found[int(row["line"])]
            results.write()
            red = sum(is_red(row, side) for row in own)
            print(f"{robot} {name}, {about} {side}: {red} of {len(own)} red", flush=True)


def _said(error: float) -> str:
    return f"{error:.4g}" if math.isfinite(error) else "nan"


def reason_of(row: Mapping[str, str]) -> str:
    """Return why a line survives; "" where nobody has said it."""
    return next((why for part, why in SURVIVORS.items() if part in row["quantity"]), "")


def page(results: Results) -> str:
    """Return the page: a row for each judged line, and what its constant's change does to it."""
    tried = [row for row in results.rows if all(row[side] for side in SIDES)]
    both = [row for row in tried if all(is_red(row, side) for side in SIDES)]
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True)
    text = [
        "# Every judged line can fail",
        "",
        "Each judged line of `validate` names one constant and the model that it belongs to.",
        "`scripts/perturb_validation.py` makes this constant a tenth larger, then a tenth smaller, in this",
        "model alone. Each time it runs the check again. What the line is judged against stays as it is.",
        "",
        "A line fails where its error is then larger than its tolerance. An error of `nan` fails, too.",
        "A line that only another change would make fail counts as one that survives. Checks without a",
        "judged line are not listed. All figures are in `docs/truth/perturbed_lines.csv`.",
        "",
        f"Made {datetime.now(UTC):%Y-%m-%d} with commit {commit.stdout.strip()}.",
        "",
        f"{len(both)} of the {len(tried)} lines tried fail both ways "
        f"({100.0 * len(both) / max(len(tried), 1):.1f} %). "
        f"{len(results.rows) - len(tried)} lines are not tried yet.",
        "",
        "## Lines that survive, and why",
        "",
    ]
    survivors = [row for row in tried if row not in both]
    if survivors:
        text += ["| robot | line | about | + 10 % | - 10 % | why |", "|---" * 6 + "|"]
    else:
        text += ["No line that was tried survives."]
    for row in survivors:
        sides = " | ".join("red" if is_red(row, side) else "green" for side in SIDES)
        why = reason_of(row) or "**not said**"
        text.append(f"| {row['robot']} | {row['quantity']} | {row['about']} | {sides} | {why} |")
    text += [
        "",
        "## All lines",
        "",
        "- about: the model, and its constant that is made wrong",
        "- as it is: the error without a change",
        "- + 10 %, - 10 %: the error with the constant a tenth larger, and a tenth smaller",
        "",
        "| robot | line | about | tolerance | as it is | + 10 % | - 10 % |",
        "|---" * 7 + "|",
    ]
    for row in results.rows:
        most = f"{float(row['tolerance']):.3g} {row['unit']}"
        errors = " | ".join(row[run] or "not tried" for run in (AS_IT_IS, *SIDES))
        text.append(f"| {row['robot']} | {row['quantity']} | {row['about']} | {most} | {errors} |")
    return "\n".join(text) + "\n"


def main() -> int:
    """Make the runs that are missing and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("robots", nargs="*", choices=[*CHECKS, []], help="default: all")
    parser.add_argument("--checks", nargs="+", help="names of check functions; default: all of the robots'")
    parser.add_argument("--only-page", action="store_true", help="no runs; write the page")
    options = parser.parse_args()
    results = Results(TABLE)
    for robot in () if options.only_page else options.robots or CHECKS:
        for check in CHECKS[robot]:
            if options.checks is None or check.__name__ in options.checks:
                perturb(robot, check, results)
    PAGE.write_text(page(results), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
