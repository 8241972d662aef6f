"""Do the tests notice faults? Plants small faults one by one and runs the tests of their area.

    python scripts/mutants.py --jobs 2 -o results/mutants.json
    python scripts/mutants.py --only statics --fast-only
    python scripts/mutants.py --only tip_force_sign,simulation -o results/mutants.json

The faults stand in tests/mutants/*.toml as patches by text. Each is planted in a copy of the package, where
the fast tests of its area run until one fails, then, if none did, the slow ones. A test that fails without
the fault too proves nothing: the tests run once unmutated before. -o FILE keeps what was found: a later run
repeats only what changed since, and adds to it. Exit status 1 where under 95 % of the faults are noticed, or
under 80 % by the fast tests.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PACKAGE, TESTS = "catheter_sim", "tests"
COPIED = (
    *(PACKAGE, TESTS, "assets", "models", "scripts", "docs", "mkdocs.yml", "README.md", "LICENSE"),
    *("CONTRIBUTING.md", "pyproject.toml"),
)
LEFT_OUT = {".hypothesis", ".pytest_cache"}
FAST, SLOW = "fast", "slow"
MARKS = {FAST: "not slow and not long", SLOW: "slow or long"}
NEEDED = {"killed": 0.95, "killed_fast": 0.80}  # shares of the faults
KILLED = ("killed_fast", "killed_slow")
NOT_COUNTED = ("unknown",)  # of --fast-only: noticed by no fast test, slow ones not asked
# pytest's exit statuses
PASSED, FAILED, NO_TESTS = 0, 1, 5
TIME_LIMIT_S, TIME_FACTOR = 240.0, 6.0  # kernels of a mutant's file are compiled anew; times the tests' own
_LOOK_S = 1.0  # between two looks whether a run has taken too long
SHOWN = 100  # characters of a failed test's name


class MutantError(Exception):
    """A fault that cannot be planted, or a file of faults that cannot be read."""


@dataclass(frozen=True)
class Mutant:
    """A fault to plant: `old` in `file` becomes `new`; `tests` should notice.

    Attributes:
        survives: why no test can or need notice; empty where one should.
        source: name of the file of faults, without its ending.
    """

    name: str
    file: str
    old: str
    new: str
    fault: str
    tests: tuple[str, ...]
    survives: str
    source: str


@dataclass(frozen=True)
class Outcome:
    """How one run of tests ended: pytest's exit status (None: stopped), what failed, how long it took [s]."""

    status: int | None
    told: str
    seconds: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Plant the faults, print a table, return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", metavar="NAMES", help="comma-separated names of faults or of their files")
    parser.add_argument("--jobs", type=int, default=1, help="processes; default 1")
    parser.add_argument("--fast-only", action="store_true", help="leave the slow tests out")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, help="JSON to keep and to go on from")
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parents[1], help="source tree")
    options = parser.parse_args(arguments)
    try:
        mutants = chosen(read_mutants(options.root), options.only)
        found = run_all(options.root, mutants, options.jobs, options.fast_only, options.output)
    except MutantError as error:
        print(f"mutants: error: {error}", file=sys.stderr)
        return 2
    print(table(mutants, found))
    return 0 if enough(found, options.fast_only) else 1


def read_mutants(root: Path) -> list[Mutant]:
    """Return the faults in tests/mutants/*.toml, by file and place.

    Raises:
        MutantError: a file is no TOML, a key is missing, unknown or of the wrong kind, a name stands twice.
    """
    keys = {field.name for field in dataclasses.fields(Mutant)} - {"source"}
    mutants: list[Mutant] = []
    for path in sorted((root / TESTS / "mutants").glob("*.toml")):
        try:
            entries = tomllib.loads(path.read_text(encoding="utf-8")).get("mutants", [])
        except tomllib.TOMLDecodeError as error:
            raise MutantError(f"{path}: {error}") from None
        for entry in entries:
            where = f"{path}: {entry.get('name', 'a mutant without a name')}"
            wrong = (keys - {"survives"} - set(entry)) | (set(entry) - keys)
            if wrong:
                raise MutantError(f"{where}: missing or unknown: {', '.join(sorted(wrong))}")
            tests = entry.pop("tests")
            if not tests or not isinstance(tests, list):
                raise MutantError(f"{where}: tests is a list of test files")
            for test in tests:
                if not (root / test.partition("::")[0]).exists():
                    raise MutantError(f"{where}: no test file {test}")
            mutants.append(Mutant(**{"survives": "", **entry}, tests=tuple(tests), source=path.stem))
    for name, count in Counter(mutant.name for mutant in mutants).items():
        if count > 1:
            raise MutantError(f"{name}: the name of {count} mutants")
    return mutants


def chosen(mutants: list[Mutant], only: str | None) -> list[Mutant]:
    """Return the faults that are named, or whose file is; all without names.

    Raises:
        MutantError: a name is neither a fault's nor a file's.
    """
    if only is None:
        return mutants
    names = set(only.split(","))
    for name in sorted(names - {m.name for m in mutants} - {m.source for m in mutants}):
        raise MutantError(f"{name}: no mutant, and no file tests/mutants/{name}.toml")
    return [mutant for mutant in mutants if names & {mutant.name, mutant.source}]


def planted(mutant: Mutant, root: Path) -> str:
    """Return the text of the mutant's file with the fault in it.

    Raises:
        MutantError: there is no such file, or the text to replace does not stand there exactly once.
    """
    try:
        text = (root / mutant.file).read_text(encoding="utf-8")
    except OSError as error:
        raise MutantError(f"{mutant.file}: {error.strerror}") from None
    count = text.count(mutant.old)
    if count != 1:
        raise MutantError(f"the text to replace stands {count} times in {mutant.file}")
    if mutant.new == mutant.old:
        raise MutantError("the new text is the old one")
    return text.replace(mutant.old, mutant.new)


# --- runs ---


class Record:
    """What earlier runs and this one found, by keys; written to its file after every entry."""

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self.entries: dict[str, Any] = {}
        self._lock = threading.Lock()
        if path is not None and path.exists():
            try:
                self.entries = json.loads(path.read_text(encoding="utf-8"))["entries"]
            except (ValueError, KeyError, TypeError):
                raise MutantError(f"{path}: holds no results of this script") from None

    def keep(self, key: str, entry: dict[str, Any]) -> None:
        with self._lock:
            self.entries[key] = entry
            if self.path is not None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                temporary = self.path.with_suffix(".part")
                temporary.write_text(json.dumps({"entries": self.entries}, indent=1), encoding="utf-8")
                temporary.replace(self.path)


def run_all(
    root: Path, mutants: list[Mutant], jobs: int, fast_only: bool, output: Path | None
) -> dict[str, dict[str, Any]]:
    """Return, by name of the fault, its verdict and what told it; known ones are not run again."""
    record, stopped = Record(output), threading.Event()
    package = digest(sorted((root / PACKAGE).rglob("*.py")))
    keys = {mutant.name: key_of(mutant, root, package) for mutant in mutants}
    verdicts: dict[str, dict[str, Any]] = {}
    baselines = Baselines(root, package, record, stopped)

    def one(mutant: Mutant) -> dict[str, Any]:
        entry = record.entries.get(keys[mutant.name])
        if entry is None or (entry["verdict"] in NOT_COUNTED and not fast_only):
            entry = {"name": mutant.name, **verdict(mutant, root, baselines, fast_only, stopped)}
            record.keep(keys[mutant.name], entry)
        return entry

    with ThreadPoolExecutor(max(jobs, 1)) as pool:
        waiting = {pool.submit(one, mutant): mutant.name for mutant in mutants}
        try:
            for number, done in enumerate(as_completed(waiting), start=1):
                name, entry = waiting[done], done.result()
                verdicts[name] = entry
                told = f"{entry['verdict']:12} {entry['seconds']:5.0f} s  {name}"
                print(f"{number}/{len(mutants)} {told}", file=sys.stderr, flush=True)
        except BaseException:  # what runs is ended, and its copies go
            stopped.set()
            pool.shutdown(cancel_futures=True)
            raise
    return verdicts


def verdict(
    mutant: Mutant, root: Path, baselines: Baselines, fast_only: bool, stopped: threading.Event
) -> dict[str, Any]:
    """Return what becomes of the fault: `verdict`, the test that noticed or the reason, seconds."""
    started = time.monotonic()

    def entry(result: str, told: str = "") -> dict[str, Any]:
        return {"verdict": result, "told": told, "seconds": round(time.monotonic() - started, 1)}

    try:
        text = planted(mutant, root)
    except MutantError as error:
        return entry("broken", str(error))
    for mark in (FAST,) if fast_only else (FAST, SLOW):
        unmutated = baselines.outcome(mutant.tests, mark)
        if unmutated.status == NO_TESTS:
            continue
        if unmutated.status != PASSED:
            return entry("red", f"unmutated: {unmutated.told or f'pytest ended with {unmutated.status}'}")
        with copy_of(root) as copy:
            plant(copy, mutant.file, text)
            limit_s = TIME_LIMIT_S + TIME_FACTOR * unmutated.seconds
            outcome = run_tests(copy, mutant.tests, mark, limit_s, stopped)
        if outcome.status is None:
            return entry(f"killed_{mark}", "by its time")
        if outcome.status == FAILED:
            return entry(f"killed_{mark}", outcome.told)
        if outcome.status not in (PASSED, NO_TESTS):
            return entry("broken", f"pytest ended with {outcome.status}: {outcome.told}")
    return entry("unknown" if fast_only else "survived")


class Baselines:
    """How tests end without a fault; each set of tests runs once."""

    def __init__(self, root: Path, package: str, record: Record, stopped: threading.Event) -> None:
        self._root, self._package, self._record, self._stopped = root, package, record, stopped
        self._red: dict[str, dict[str, Any]] = {}  # for this run only: tests may be mended
        self._locks: dict[str, threading.Lock] = {}
        self._lock = threading.Lock()

    def outcome(self, tests: tuple[str, ...], mark: str) -> Outcome:
        """Return how the tests of one mark end in the tree as it is."""
        key = f"unmutated:{mark}:{digest_of_tests(tests, self._root, self._package)}"
        with self._lock:
            lock = self._locks.setdefault(key, threading.Lock())
        with lock:
            kept = self._record.entries.get(key) or self._red.get(key)
            if kept is None:
                # In the tree itself, so that kernels compiled on the way serve the mutants too.
                outcome = run_tests(self._root, tests, mark, math.inf, self._stopped)
                kept = {"name": " ".join(tests), "verdict": mark, **dataclasses.asdict(outcome)}
                if outcome.status in (PASSED, NO_TESTS):
                    self._record.keep(key, kept)
                else:
                    self._red[key] = kept
            return Outcome(kept["status"], kept["told"], kept["seconds"])


def run_tests(
    folder: Path, tests: Sequence[str], mark: str, limit_s: float, stopped: threading.Event
) -> Outcome:
    """Return how pytest ends in `folder`; what it started is ended with it at the time limit.

    Raises:
        MutantError: all runs were stopped.
    """
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", MARKS[mark]]
    path = os.pathsep.join(filter(None, (str(folder), os.environ.get("PYTHONPATH"))))
    environment = os.environ | {"PYTHONPATH": path}
    started = time.monotonic()
    process = subprocess.Popen(
        [*command, *tests],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    printed, status = "", None
    try:
        while time.monotonic() - started < limit_s and not stopped.is_set():
            with suppress(subprocess.TimeoutExpired):
                printed, _ = process.communicate(timeout=_LOOK_S)
                status = process.returncode
                break
    finally:  # also what tests left behind
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    if stopped.is_set():
        raise MutantError("stopped")
    failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", printed, flags=re.MULTILINE)
    return Outcome(status, failed[0][:SHOWN] if failed else "", round(time.monotonic() - started, 1))


# --- copies ---


@contextmanager
def copy_of(root: Path) -> Iterator[Path]:
    """Yield a temporary copy of the source tree; its files are hard links where they can be."""
    with tempfile.TemporaryDirectory(prefix="mutant_") as folder:
        copy = Path(folder)
        for name in COPIED:
            if (root / name).is_dir():
                for here, folders, files in os.walk(root / name):
                    folders[:] = [folder for folder in folders if folder not in LEFT_OUT]
                    there = copy / Path(here).relative_to(root)
                    there.mkdir(parents=True, exist_ok=True)
                    for file in files:
                        _link(Path(here) / file, there / file)
            elif (root / name).exists():
                _link(root / name, copy / name)
        yield copy


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except FileNotFoundError:  # a cache's temporary file, gone again
        return
    except OSError:  # another file system
        target.write_bytes(source.read_bytes())
        os.utime(target, ns=(source.stat().st_atime_ns, source.stat().st_mtime_ns))


def plant(copy: Path, file: str, text: str) -> None:
    """Write the changed file, and drop the compiled kernels that may hold what it said before."""
    path = copy / file
    path.unlink()  # or the tree's own file changed with it
    path.write_text(text, encoding="utf-8")
    module = file.removesuffix(".py").replace("/", ".")
    parent, _, last = module.rpartition(".")
    imports = re.compile(
        rf"from {re.escape(module)} import|import {re.escape(module)}\b"
        rf"|from {re.escape(parent)} import[^\n]*\b{last}\b"
    )
    for user in (copy / PACKAGE).rglob("*.py"):
        if user == path or imports.search(user.read_text(encoding="utf-8")):
            for kept in (user.parent / "__pycache__").glob(f"{user.stem}.*.nb[ic]"):
                kept.unlink()


# --- keys ---


def digest(files: Sequence[Path]) -> str:
    """Return a hash of the files' names and contents."""
    found = hashlib.sha256()
    for file in files:
        found.update(f"{file.name}\0".encode() + file.read_bytes() + b"\0")
    return found.hexdigest()


def digest_of_tests(tests: Sequence[str], root: Path, package: str) -> str:
    """Return a hash of the package, the test files or folders, and every helper of the tests."""
    files = set()
    for test in tests:
        path = root / test.partition("::")[0]
        files |= set(path.rglob("*.py")) if path.is_dir() else {path}
    files |= {file for file in (root / TESTS).rglob("*.py") if not file.name.startswith("test_")}
    return hashlib.sha256(f"{package} {digest(sorted(files))} {' '.join(tests)}".encode()).hexdigest()


def key_of(mutant: Mutant, root: Path, package: str) -> str:
    """Return the key under which the mutant's verdict is kept."""
    patch = json.dumps([mutant.file, mutant.old, mutant.new])
    return hashlib.sha256(f"{patch} {digest_of_tests(mutant.tests, root, package)}".encode()).hexdigest()


# --- report ---


def shares(found: dict[str, dict[str, Any]]) -> dict[str, float]:
    """Return which share of the faults was noticed, and which by the fast tests; 0 without faults."""
    verdicts = Counter(entry["verdict"] for entry in found.values())
    total = max(verdicts.total(), 1)
    killed = sum(verdicts[name] for name in KILLED)
    return {"killed": killed / total, "killed_fast": verdicts["killed_fast"] / total}


def enough(found: dict[str, dict[str, Any]], fast_only: bool) -> bool:
    """Return whether enough faults were noticed; of the fast tests' share alone if `fast_only`."""
    names = ("killed_fast",) if fast_only else tuple(NEEDED)
    return all(shares(found)[name] >= NEEDED[name] for name in names)


def table(mutants: list[Mutant], found: dict[str, dict[str, Any]]) -> str:
    """Return a line for each fault, then totals by file, then what was not noticed and why."""
    lines = []
    for mutant in mutants:
        entry = found[mutant.name]
        lines.append(f"{mutant.source:12} {mutant.name:40} {entry['verdict']:12} {entry['told']}")
    lines.append("")
    for source in sorted({mutant.source for mutant in mutants}):
        part = {m.name: found[m.name] for m in mutants if m.source == source}
        lines.append(_totals(source, part))
    lines.append(_totals("all", found))
    for mutant in mutants:
        entry = found[mutant.name]
        if entry["verdict"] not in KILLED:
            reason = mutant.survives or entry["told"] or "no reason is stated"
            lines.append(f"not killed: {mutant.name} ({mutant.fault}): {entry['verdict']}: {reason}")
        elif mutant.survives:
            lines.append(f"killed here: {mutant.name}, of which its file says: {mutant.survives}")
    return "\n".join(lines)


def _totals(name: str, found: dict[str, dict[str, Any]]) -> str:
    verdicts = Counter(entry["verdict"] for entry in found.values())
    share = shares(found)
    counts = ", ".join(f"{count} {verdict}" for verdict, count in sorted(verdicts.items()))
    percent = f"{100 * share['killed']:.0f} % killed, {100 * share['killed_fast']:.0f} % by the fast tests"
    return f"{name:12} {len(found)} mutants: {counts}; {percent}"


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    sys.exit(main())
