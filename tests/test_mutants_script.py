"""Claims about `scripts/mutants.py`: what counts as noticed, what does not, and what is refused."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[1]

TOY = "def force(mass, gravity):\n    return mass * gravity\n"
TESTS = """
import pytest
from catheter_sim.toy import force

def test_mass():
    assert force(2.0, 1.0) == 2.0

@pytest.mark.slow
def test_gravity():
    assert force(1.0, 9.81) == 9.81
"""
RED = "def test_red():\n    assert False\n"


def _script() -> ModuleType:
    specification = importlib.util.spec_from_file_location("mutants_script", ROOT / "scripts" / "mutants.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules["mutants_script"] = module
    specification.loader.exec_module(module)
    return module


mutants = _script()


def mutant(
    name: str, new: str, old: str = "mass * gravity", test: str = "test_toy.py", more: str = ""
) -> str:
    return (
        f'[[mutants]]\nname = "{name}"\nfile = "catheter_sim/toy.py"\nold = "{old}"\nnew = "{new}"\n'
        f'fault = "a fault"\ntests = ["tests/{test}"]\n{more}\n'
    )


@pytest.fixture
def toy(tmp_path: Path) -> Path:
    """A source tree of one function and its tests."""
    for folder in ("catheter_sim", "tests/mutants"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "catheter_sim" / "__init__.py").write_text("")
    (tmp_path / "catheter_sim" / "toy.py").write_text(TOY)
    (tmp_path / "tests" / "test_toy.py").write_text(TESTS)
    (tmp_path / "tests" / "test_red.py").write_text(RED)
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\nmarkers = ['slow']\n")
    return tmp_path


def verdicts(toy: Path, *arguments: str) -> tuple[int, dict[str, str]]:
    output = toy / "out.json"
    status = mutants.main(["--root", str(toy), "-o", str(output), *arguments])
    entries = json.loads(output.read_text())["entries"]
    return status, {e["name"]: e["verdict"] for key, e in entries.items() if not key.startswith("unmutated")}


@pytest.mark.slow
def test_verdicts(toy, capsys):
    """Noticed fast, noticed slow, not noticed, text gone, cannot be imported, red without a fault."""
    (toy / "tests" / "mutants" / "toy.toml").write_text(
        mutant("fast", "gravity")
        + mutant("slow", "mass")
        + mutant("equal", "gravity * mass", more='survives = "products commute"')
        + mutant("gone", "0", old="no such text")
        + mutant("twice", "0", old="mass")
        + mutant("crash", "return +", old="return mass * gravity")
        + mutant("red", "mass", test="test_red.py")
    )
    status, found = verdicts(toy, "--jobs", "2")
    assert found == {
        "fast": "killed_fast",
        "slow": "killed_slow",
        "equal": "survived",
        "gone": "broken",
        "twice": "broken",
        "crash": "broken",
        "red": "red",
    }
    assert status == 1
    printed = capsys.readouterr().out
    assert "not killed: equal (a fault): survived: products commute" in printed
    assert "the text to replace stands 0 times" in printed
    assert "tests/test_toy.py::test_mass" in printed
    assert (toy / "catheter_sim" / "toy.py").read_text() == TOY  # the tree itself is left alone


@pytest.mark.slow
def test_later_run_adds_to_the_record(toy, monkeypatch):
    """What is known is not run again, until the package changes; fast alone leaves the slow for later."""
    (toy / "tests" / "mutants" / "toy.toml").write_text(mutant("fast", "gravity") + mutant("slow", "mass"))
    assert verdicts(toy, "--fast-only") == (1, {"fast": "killed_fast", "slow": "unknown"})
    assert verdicts(toy, "--only", "slow") == (1, {"fast": "killed_fast", "slow": "killed_slow"})
    with monkeypatch.context() as patch:
        patch.setattr(mutants, "run_tests", None)
        assert verdicts(toy, "--only", "fast")[0] == 0
    (toy / "catheter_sim" / "toy.py").write_text(TOY + "\n")
    ran = []
    patched = mutants.run_tests
    monkeypatch.setattr(mutants, "run_tests", lambda *a: ran.append(a) or patched(*a))
    assert verdicts(toy, "--only", "fast")[0] == 0
    assert len(ran) == 2  # without the fault and with it


@pytest.mark.long
def test_endless_loop_is_noticed_by_its_time(toy, monkeypatch):
    monkeypatch.setattr(mutants, "TIME_LIMIT_S", 2.0)
    monkeypatch.setattr(mutants, "TIME_FACTOR", 0.0)
    endless = mutant("endless", "while True: pass", old="return mass * gravity")
    (toy / "tests" / "mutants" / "toy.toml").write_text(endless)
    assert verdicts(toy) == (0, {"endless": "killed_fast"})


@pytest.mark.long
def test_stopped_it_leaves_nothing_behind(toy, tmp_path_factory):
    """Told to end while tests run: they end too, their copy goes, and nothing is kept of them."""
    endless = mutant("endless", "while True: pass", old="return mass * gravity")
    (toy / "tests" / "mutants" / "toy.toml").write_text(endless)
    temporary = tmp_path_factory.mktemp("copies")
    script = [sys.executable, str(ROOT / "scripts" / "mutants.py"), "--root", str(toy), "-o", "out.json"]
    process = subprocess.Popen(script, cwd=toy, env=os.environ | {"TMPDIR": str(temporary)})
    until = time.monotonic() + 120.0
    while not list(temporary.glob("mutant_*/tests")) and time.monotonic() < until:
        time.sleep(0.2)
    time.sleep(2.0)
    process.terminate()
    assert process.wait(60.0) == 128 + signal.SIGTERM
    assert not list(temporary.glob("mutant_*"))
    assert "endless" not in (toy / "out.json").read_text()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[[mutants]\n", "toy.toml"),
        (mutant("a", "1") + mutant("a", "2"), "a: the name of 2 mutants"),
        (mutant("a", "1", more="kills = 1"), "missing or unknown: kills"),
        (mutant("a", "1").replace("fault =", "faults ="), "missing or unknown: fault, faults"),
        (mutant("a", "1", test="test_other.py"), "no test file tests/test_other.py"),
    ],
)
def test_bad_file_of_faults_is_refused(toy, capsys, text, told):
    (toy / "tests" / "mutants" / "toy.toml").write_text(text)
    assert mutants.main(["--root", str(toy)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("mutants: error: ")
    assert told in error


def test_unknown_name_is_refused(toy, capsys):
    assert mutants.main(["--root", str(toy), "--only", "nothing"]) == 2
    assert "nothing: no mutant" in capsys.readouterr().err


def test_shares_that_are_enough():
    """95 % noticed and 80 % by the fast tests; a broken patch or red tests count as not noticed."""

    def found(**counts: int) -> dict[str, dict[str, str]]:
        names = [verdict for verdict, count in counts.items() for _ in range(count)]
        return {str(index): {"verdict": verdict} for index, verdict in enumerate(names)}

    assert mutants.enough(found(killed_fast=80, killed_slow=15, survived=5), fast_only=False)
    assert not mutants.enough(found(killed_fast=80, killed_slow=14, survived=6), fast_only=False)
    assert not mutants.enough(found(killed_fast=80, killed_slow=14, broken=6), fast_only=False)
    assert not mutants.enough(found(killed_fast=79, killed_slow=21), fast_only=False)
    assert mutants.enough(found(killed_fast=80, unknown=20), fast_only=True)


def test_every_fault_can_be_planted():
    """The text that each fault replaces stands exactly once in its file, and its tests exist."""
    for each in mutants.read_mutants(ROOT):
        mutants.planted(each, ROOT)
