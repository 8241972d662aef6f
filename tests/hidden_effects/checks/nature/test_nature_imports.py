"""The data are made without the code that diagnoses them."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import pytest

import catheter_sim
import hidden_effects
from catheter_sim.effects import EFFECTS, apply
from catheter_sim.lab import engine
from hidden_effects.natural import COMPARING, NOT_JUDGED

PACKAGE = Path(catheter_sim.__file__).parent
NATURE = PACKAGE / "lab"
BENCHES = Path(hidden_effects.__file__).parent
FILES = sorted((*NATURE.rglob("*.py"), BENCHES / "natural.py", BENCHES / "interventions.py"))
FORBIDDEN = ("effects", "diagnosis", "theory")
# The engine and what describes robots to it. The simulation's own modules import `effects.apply`, and a
# kind's folder its statics: that cannot be avoided, and is not followed. A robot without effects passes
# `effects.apply` unchanged, which the last test here holds.
ENGINE = ("simulation", "modelling", "robots", "mjcf", "mechanics", "core", "catalogue", "channels")


pytestmark = pytest.mark.xdist_group("nature_imports")  # whose worker reads every file once


@cache
def imported(path: Path) -> tuple[str, ...]:
    """Return the package's modules that a file imports, without the package's name."""
    found: list[str] = []
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("catheter_sim"):
            names = [f"{node.module}.{item.name}" for item in node.names]
        elif isinstance(node, ast.Import):
            names = [item.name for item in node.names if item.name.startswith("catheter_sim")]
        found += (name.removeprefix("catheter_sim.") for name in names)
    return tuple(found)


@cache
def file_of(module: str) -> Path | None:
    """Return the file in which an imported name stands."""
    parts = module.split(".")
    for count in (len(parts), len(parts) - 1):
        place = PACKAGE.joinpath(*parts[:count])
        for path in (place.with_suffix(".py"), place / "__init__.py"):
            if count and path.is_file():
                return path
    return None


def followed(starts: Iterable[Path]) -> set[Path]:
    """Return some files and all that they import."""
    waiting = list(starts)
    found = set(waiting)
    while waiting:
        nearest = {file_of(module) for module in imported(waiting.pop())} - {None}
        waiting += nearest - found
        found |= nearest
    return found


def is_forbidden(module: str) -> bool:
    parts = module.split(".")
    in_kind = parts[0] == "robots" and not {"twin", "statics"}.isdisjoint(parts)
    return in_kind or any(module == name or module.startswith(f"{name}.") for name in FORBIDDEN)


def reached(start: Path) -> dict[str, Path]:
    """Return the modules reached from a file, the engine's own not followed, and where each is imported."""
    found: dict[str, Path] = {}
    waiting = [start]
    seen = set()
    while waiting:
        path = waiting.pop()
        if path in seen:
            continue
        seen.add(path)
        for module in imported(path):
            found.setdefault(module, path)
            nearest = file_of(module)
            if nearest is not None and module.split(".")[0] not in ENGINE:
                waiting.append(nearest)
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_no_file_reaches_what_diagnoses(path):
    """No effect, no statics, no fit: neither by itself nor by what it imports."""
    wrong = {module: place.name for module, place in reached(path).items() if is_forbidden(module)}
    assert wrong == {}


@pytest.mark.slow
def test_a_forbidden_import_would_be_seen(tmp_path):
    """The walk notices an import of the other bench, directly and through a file between."""
    direct = tmp_path / "direct.py"
    direct.write_text("from catheter_sim.effects.backlash import EFFECT\n")
    assert any(is_forbidden(module) for module in reached(direct))
    through = tmp_path / "through.py"
    through.write_text("from catheter_sim.closed_loop.loop import loop\n")
    assert any(module.startswith("effects") for module in reached(through))
    assert is_forbidden("robots.rolling.twin.twin")


@pytest.mark.slow
def test_what_a_score_does_not_depend_on_is_not_imported():
    """A kept draw stays one of this code where only `NOT_JUDGED` changed: what made it imports none of it."""
    waiting = [
        PACKAGE / "cli" / "diagnose.py",
        *(PACKAGE / "diagnosis").rglob("*.py"),
        *FILES,
        BENCHES / "spoiled.py",
        BENCHES / "other_methods.py",
    ]
    found = followed(waiting)
    parts = {path.relative_to(PACKAGE).parts[0] for path in found if path.is_relative_to(PACKAGE)}
    assert {"diagnosis", "effects", "robots", "simulation", "core"} <= parts
    assert parts.isdisjoint(set(NOT_JUDGED) - {"lab"})  # which makes the data, and has a digest of its own
    assert {name for name in NOT_JUDGED if not (PACKAGE / name).exists()} == set()


@pytest.mark.slow
def test_a_diagnosis_of_one_recording_imports_nothing_that_compares_two():
    """But for the verb, where --since is given: so `COMPARING` is in the comparisons' digest alone."""
    verb = PACKAGE / "cli" / "diagnose.py"
    asked_for = {module for module in imported(verb) if module.startswith("diagnosis.changes.")}
    assert asked_for
    starts = [
        *(file_of(module) for module in set(imported(verb)) - asked_for),
        *NATURE.rglob("*.py"),
        *(path for path in (PACKAGE / "diagnosis").rglob("*.py") if "changes" not in path.parts),
    ]
    found = followed(starts) - {verb}
    assert [path for path in found if not set(COMPARING).isdisjoint(path.parts)] == []


@pytest.mark.slow
def test_simulated_robots_have_no_effects(monkeypatch, plain_ground):
    """The engine gets no effect to apply, and would not find one on its list."""
    handed = []
    simulate = engine.simulate
    monkeypatch.setattr(
        engine, "simulate", lambda robot, *a, **k: handed.append(robot) or simulate(robot, *a, **k)
    )
    with_list = engine.simulated(plain_ground.specimen, plain_ground.scale, (), plain_ground.courses[1])
    monkeypatch.setattr(apply, "EFFECTS", {})
    assert EFFECTS
    without = engine.simulated(plain_ground.specimen, plain_ground.scale, (), plain_ground.courses[1])
    assert len(handed) >= 2
    assert not any(robot.effects for robot in handed)  # a run that does not rest is made again, slower
    assert (with_list.p == without.p).all()
