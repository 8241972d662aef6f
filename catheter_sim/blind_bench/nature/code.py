"""Which code made a draw, and which diagnosed it: draws of other code do not count."""

from __future__ import annotations

import hashlib
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGE = Path(__file__).parents[2]
# What data are made by, besides this folder: robots and their simulation, and how files are written.
_MAKERS = (
    "blind_bench/nature",
    "blind_bench/robots.py",
    "blind_bench/places.py",
    "channels.py",
    "columns.py",
    "core",
    "kinds",
    "mechanics",
    "mjcf",
    "modelling",
    "simulation",
    "tables.py",
)
_JUDGES = (
    "score.py",
    "table.py",
    "run.py",
    "code.py",
    "rivals.py",
    "listing.py",
)  # of this folder: they make no data
# What neither a diagnosis nor its score imports: a change there leaves draws as they are.
NOT_JUDGED = (
    "anatomy",
    "closed_loop",
    "comparison.py",
    "controllers",
    "envs",
    "examples.py",
    "exporting",
    "importing",
    "lab",
    "procedure",
    "public",
    "signals.py",
    "skeletons.py",
    "speed",
    "validation",
    "viewer.py",
)
COMPARING = ("interventions", "since")  # folders: of a diagnosis with --since alone, and of its bench
_NOT_SIMULATED = ("theory", "twin.py", "statics.py", "warp", "gpu", "picture.py")


def code_of(parts: tuple[str, ...] = ("",), without: tuple[str, ...] = ()) -> str:
    """Return a short digest of the package's Python files below some parts of it."""
    found = hashlib.sha256()
    files: set[Path] = set()
    for part in parts:
        place = PACKAGE / part
        files |= set(place.rglob("*.py")) if place.is_dir() else {place}
    for path in sorted(files):
        name = path.relative_to(PACKAGE)
        if set(name.parts).isdisjoint(without):
            found.update(str(name).encode() + b"\0" + path.read_bytes())
    return found.hexdigest()[:12]


def making_code(*more: str) -> str:
    """Return the digest of what makes data; `more`: further parts of the package that do."""
    return code_of((*_MAKERS, *more), (*_JUDGES, *_NOT_SIMULATED))


def judging_code(comparing: bool = False) -> str:
    """Return the digest of what diagnoses and scores: the package without what neither imports.

    `comparing`: and of what compares two recordings, which a diagnosis of one does not import.
    """
    parts = tuple(path.name for path in PACKAGE.iterdir() if path.name not in NOT_JUDGED)
    return code_of(parts, () if comparing else COMPARING)


def whole_code() -> str:
    """Return the digest of the whole package."""
    return code_of()


def commit() -> str:
    """Return the commit of the working tree, "+" where files differ from it; else the package's version."""
    try:
        head, changes = (
            subprocess.run(
                ["git", *command], cwd=PACKAGE, capture_output=True, text=True, check=True
            ).stdout.strip()
            for command in (("rev-parse", "HEAD"), ("status", "--porcelain", "--untracked-files=no"))
        )
        return head + ("+" if changes else "")
    except (OSError, subprocess.CalledProcessError):
        try:
            return version("catheter_sim")
        except PackageNotFoundError:
            return "unknown"
