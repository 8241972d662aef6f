"""Say which figures of the README rest on code that has changed since they were measured, and measure again.

    python scripts/figures.py                 # a line a figure: fresh, stale, or not as the page says
    python scripts/figures.py --run           # measure what is stale, one after the other
    python scripts/figures.py --run rod_shapes ik --jobs 2

A figure names its page, the text that stands there, the command that measures it, and the program from which
that command starts. It is stale where any file of the package that this program imports is another than when
it was measured. docs/truth/figures.json keeps each result with the digest of those files, commit, date and
duration, as soon as it is measured; a run that was stopped goes on where it was. Exit status 1: one is stale
or is not what its page says.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs" / "truth" / "figures.json"
WORK = "results/figures"  # where commands write


@dataclass(frozen=True)
class Figure:
    """A figure of a page.

    Attributes:
        shows: the text on the page, its number first.
        command: what measures it; {work} is a folder of its own, {jobs} how many processes.
        program: the file, below the root, whose imports it rests on.
        reads: a pattern whose first group is the value, in what the command prints or in `file`.
        file: below the figure's folder, where the value does not stand in what is printed.
        largest: of several matches the largest counts.
        page: on which it stands.
    """

    shows: str
    command: str
    program: str
    reads: str
    file: str = ""
    largest: bool = False
    page: str = "README.md"


_DIAGNOSE, _VALIDATE = "catheter_sim/diagnosis/pipeline.py", "catheter_sim/validation/report.py"
FIGURES = {
    "rod_shapes": Figure(
        "0.017 %",
        "python scripts/validate_rod.py",
        "scripts/validate_rod.py",
        r"mean ([\d.]+) % of the length",
    ),
    "rod_released": Figure(
        "0.038 %",
        "python scripts/validate_rod.py --released",
        "scripts/validate_rod.py",
        r"mean ([\d.]+) % of the length",
    ),
    "friction_of_tendons": Figure(
        "0.02 mm",
        "catheter-sim validate neuroendoscope_section -o {work}",
        _VALIDATE,
        r"shipped friction, tip, largest +mm +(?:- +)+([\d.e-]+)",
        largest=True,
    ),
    "benchmark_vc": Figure(
        "0.148 %",
        "catheter-sim validate spacer_disk -o {work}",
        _VALIDATE,
        r"scenario 1, 10 disks, VC: mean tip position error +% +([\d.]+)",
    ),
    "ik": Figure(
        "0.096 %",
        "python scripts/check_ik.py --targets 1000 -o {work}",
        "scripts/check_ik.py",
        r"([\d.]+) %$",
        largest=True,
    ),
    "opencr_v4": Figure(
        "5.19 mm",
        "catheter-sim diagnose assets/examples/opencr_v4 -o {work} --jobs {jobs}",
        _DIAGNOSE,
        r'"heldout_tip_distance_rmse_aligned_after_mm_as_chosen_in_training": ([\d.]+)',
        file="diagnosis.json",
    ),
}


def main() -> int:
    """Print a line for each figure, after measuring what was asked for; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--readme", action="store_true", help="of the README alone (all are, so far)")
    parser.add_argument(
        "--run", nargs="*", metavar="NAME", help="measure these; without a name all that are stale"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes of a command; default 2")
    options = parser.parse_args()
    wrong = [name for name in options.run or () if name not in FIGURES]
    if wrong:
        print(f"figures: error: {wrong[0]}: choices: {', '.join(FIGURES)}", file=sys.stderr)
        return 2
    if options.run is not None:
        for name in options.run or [name for name in FIGURES if state(name) == "stale"]:
            measure(name, options.jobs)
    states = {name: state(name) for name in FIGURES}
    for name, found in states.items():
        item, kept = FIGURES[name], results().get(name, {})
        when = (
            f"{kept['value']:g} at {kept['commit'][:8]}, {kept['date']}, {kept['seconds']:.0f} s"
            if kept
            else "never"
        )
        print(f"{found:6} {name:20} {item.page} says {item.shows}; measured: {when}")
    return int(any(found != "fresh" for found in states.values()))


def state(name: str) -> str:
    """Return "fresh", "stale", or "wrong" where the page says something else than what was measured."""
    item, kept = FIGURES[name], results().get(name)
    if kept is None or kept["digest"] != digest(item):
        return "stale"
    return "fresh" if agrees(item, kept["value"]) else "wrong"


def agrees(item: Figure, value: float) -> bool:
    """Return whether a page shows a figure, and the figure is the value to the digits that it shows."""
    number = item.shows.split()[0]
    digits = len(number.partition(".")[2])
    on_page = item.shows in (ROOT / item.page).read_text(encoding="utf-8")
    return on_page and f"{value:.{digits}f}" == number


def results() -> dict[str, dict]:
    """Return what was measured, by the figures' names."""
    return json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}


def measure(name: str, jobs: int) -> None:
    """Run a figure's command and keep what it says.

    Raises:
        RuntimeError: the command fails, or does not say the value.
    """
    item, start = FIGURES[name], time.monotonic()
    own = f"{WORK}/{name}"
    words = shlex.split(item.command.format(work=own, jobs=jobs))
    program = {"python": [sys.executable], "catheter-sim": [sys.executable, "-m", "catheter_sim"]}[words[0]]
    before = digest(item)
    ran = subprocess.run([*program, *words[1:]], cwd=ROOT, capture_output=True, text=True, check=False)
    text = (ROOT / own / item.file).read_text(encoding="utf-8") if item.file else ran.stdout
    values = [float(value) for value in re.findall(item.reads, text, re.MULTILINE | re.DOTALL)]
    if not values or (ran.returncode and not item.file):
        raise RuntimeError(f"{name}: {item.command}: status {ran.returncode}: {(ran.stderr or text)[-300:]}")
    head = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True)
    kept = {
        "value": max(values) if item.largest else values[0],
        "digest": before,
        "commit": head.stdout.strip(),
        "date": date.today().isoformat(),
        "seconds": round(time.monotonic() - start, 1),
    }
    RESULTS.write_text(json.dumps(results() | {name: kept}, indent=1) + "\n", encoding="utf-8")


def digest(item: Figure) -> str:
    """Return the digest of the files that a figure's program imports, itself included."""
    whole = hashlib.sha256()
    for path in sorted(imported(ROOT / item.program)):
        whole.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return whole.hexdigest()[:12]


def imported(program: Path) -> set[Path]:
    """Return a program's file and those of the package that it imports, directly or through others."""
    found, left = set(), [program]
    while left:
        path = left.pop()
        if path not in found:
            found.add(path)
            left += list(_imports(path))
    return found


def _imports(path: Path) -> Iterator[Path]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("catheter_sim"):
            assert node.module is not None
            for name in (node.module, *(f"{node.module}.{item.name}" for item in node.names)):
                stem = ROOT / name.replace(".", "/")
                yield from (
                    file for file in (stem.with_suffix(".py"), stem / "__init__.py") if file.is_file()
                )


if __name__ == "__main__":
    sys.exit(main())
