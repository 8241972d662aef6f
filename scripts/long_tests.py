"""Run the tests that take too long for every change, and keep what they said in docs/truth/long_tests.md.

    python scripts/long_tests.py [FILE ...] [--jobs N]

Without FILE all of them (marker "long"). The rows of the files that ran replace those kept before, each with
the commit on which it ran; a file that is gone, or has no long test any more, leaves the table. The exit
status is 1 where a test failed: the table then says so, and the fast tests fail until it does not.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.cli.arguments import whole_number
from hidden_effects.natural import commit

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "truth" / "long_tests.md"
BEGIN, END = "<!-- long tests: by scripts/long_tests.py -->\n", "<!-- long tests end -->\n"
HEAD = "| file | cases | passed | skipped | failed | minutes of one core | commit |\n" + 7 * "|---" + "|\n"


@dataclass
class Row:
    """What the long tests of one file came to."""

    file: str
    commit: str
    cases: int = 0
    skipped: int = 0
    failed: int = 0
    seconds: float = 0.0

    def text(self) -> str:
        """Return its line of the table."""
        counts = (self.cases, self.cases - self.skipped - self.failed, self.skipped, self.failed)
        cells = (f"`{self.file}`", *map(str, counts), f"{self.seconds / 60.0:.1f}", f"`{self.commit}`")
        return f"| {' | '.join(cells)} |\n"


def files_with_long_tests(root: Path = ROOT) -> list[str]:
    """Return the test files that mark a test as long, relative to the project."""
    paths = sorted((root / "tests").rglob("test_*.py"))
    return [path.relative_to(root).as_posix() for path in paths if "mark.long" in path.read_text("utf-8")]


def rows_of(report: Path, head: str) -> dict[str, Row]:
    """Return the rows of a run, by file, from its JUnit report."""
    rows: dict[str, Row] = {}
    known = {file.removesuffix(".py").replace("/", "."): file for file in files_with_long_tests()}
    for case in ElementTree.parse(report).iter("testcase"):
        name = case.get("classname", "") or case.get("name", "")
        file = next((file for module, file in known.items() if f"{name}.".startswith(f"{module}.")), name)
        row = rows.setdefault(file, Row(file, head))
        row.cases += 1
        row.seconds += float(case.get("time", 0.0))
        row.skipped += case.find("skipped") is not None
        row.failed += case.find("failure") is not None or case.find("error") is not None
    return rows


def kept_lines() -> dict[str, str]:
    """Return the table's lines by file."""
    text = PAGE.read_text("utf-8").split(BEGIN)[1].split(END)[0]
    lines = [line for line in text.splitlines(keepends=True) if line.startswith("| `")]
    return {line.split("`")[1]: line for line in lines}


def main() -> int:
    """Run the tests; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", nargs="*", metavar="FILE", help="of tests; default all with long ones")
    parser.add_argument("--jobs", type=whole_number(1, 256), default=2, help="processes; default 2")
    options = parser.parse_args()
    known = files_with_long_tests()
    wanted = options.file or known
    for name in wanted:
        if name not in known:
            print(f"long_tests: {name}: no long test there; choices: {', '.join(known)}", file=sys.stderr)
            return 2
    head = commit()[:10]
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        command = [sys.executable, "-m", "pytest", "-q", "-m", "long", "-n", str(options.jobs)]
        command += ["--dist", "loadgroup", f"--junitxml={report}", *wanted]
        status = subprocess.run(command, cwd=ROOT, check=False).returncode
        if status not in (0, 1) or not report.is_file():
            return 2
        rows = rows_of(report, head)
    lines = kept_lines() | {file: row.text() for file, row in rows.items()}
    before, rest = PAGE.read_text("utf-8").split(BEGIN)
    table = "".join(lines[file] for file in sorted(lines) if file in known)
    PAGE.write_text(before + BEGIN + HEAD + table + END + rest.split(END)[1], "utf-8")
    return status


if __name__ == "__main__":
    sys.exit(main())
