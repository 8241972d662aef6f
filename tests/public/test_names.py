"""The public names are all there, load late, and nothing else in the package takes them."""

from __future__ import annotations

import importlib
import pkgutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import catheter_sim as cs

ROOT = Path(__file__).resolve().parents[2]
PROMISED = (
    "load_robot",
    "inputs",
    "read_inputs",
    "simulate",
    "statics",
    "attach",
    "build",
    "Simulator",
    "render",
    "settle_together",
    "step_together",
    "to_pymjcf",
    "load_dataset",
    "dataset",
    "diagnose",
    "list_robots",
    "list_models",
    "list_effects",
    "list_environments",
    "Run",
    "Diagnosis",
    "InputError",
    "SimulationDiverged",
)


def test_every_promised_name_is_public() -> None:
    """What the package promises is in `__all__`, in `dir`, and can be had; `__all__` is in order."""
    assert set(PROMISED) <= set(cs.__all__)
    assert list(cs.__all__) == sorted(cs.__all__)
    assert set(cs.__all__) <= set(dir(cs))
    assert not [name for name in cs.__all__ if getattr(cs, name) is None]


def test_dir_shows_no_tools() -> None:
    """`dir` names what is public: not the modules and helpers by which the names are found."""
    assert not [name for name in dir(cs) if name in ("importlib", "Any", "TYPE_CHECKING", "annotations")]


def test_no_module_has_a_public_name() -> None:
    """No sub-package or module may be called as a public name: once imported, it would take its place."""
    modules = {item.name for item in pkgutil.iter_modules(cs.__path__)}
    assert modules.isdisjoint(cs.__all__)


def test_a_public_name_stays_what_it_is_when_everything_is_imported() -> None:
    """Importing the modules behind the names does not change what the names are."""
    before = {name: getattr(cs, name) for name in cs.__all__}
    for module in (
        "theory.static_models",
        "simulation.replay",
        "pictures.offscreen",
        "diagnosis.pipeline",
        "public.data",
    ):
        importlib.import_module(f"catheter_sim.{module}")
    assert all(getattr(cs, name) is value for name, value in before.items())


def test_unknown_name_is_an_attribute_error() -> None:
    """A name that is not public is refused as by any module."""
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        cs.simulat  # type: ignore[attr-defined]  # noqa: B018


def test_installing_runs_nothing_when_an_interpreter_starts() -> None:
    """The project installs no start-up file and declares nothing that Gymnasium would load by itself."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    placed = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    assert not [name for name in (*placed, *placed.values()) if name.endswith(".pth")]
    assert "entry-points" not in project["project"]
    assert not list((ROOT / "catheter_sim").rglob("*.pth"))


@pytest.mark.slow
def test_import_takes_less_than_a_second() -> None:
    """`import catheter_sim` takes under a second of processor time, whatever else the machine does."""
    code = "import time; start = time.process_time(); import catheter_sim; print(time.process_time() - start)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 0.0 < float(ran.stdout) < 1.0
