"""The examples in the docstrings of the public names are right."""

from __future__ import annotations

import doctest
import inspect
from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs

SLOW = {
    *("Simulator", "attach", "render", "simulate", "Run", "list_robots", "statics", "diagnose", "Diagnosis"),
    *("Control", "control", "InverseKinematics", "inverse_kinematics", "which_model"),
    *("compare", "Comparison", "diagnose_model", "ModelDiagnosis"),
    *("Sensing", "sense", "Workspace", "workspace", "export", "to_pymjcf"),
}
LONG = {"Export", "ModelChoice"}  # what `export` and `which_model` return; their own examples stay
NAMES = [
    pytest.param(name, marks=pytest.mark.long if name in LONG else pytest.mark.slow)
    if name in SLOW | LONG
    else name
    for name in cs.__all__
    if name not in ("InputError", "RobotNote", "SimulationDiverged")
]


@pytest.mark.parametrize("name", NAMES)
def test_example_gives_what_it_says(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every public name has an example, and running it prints what stands below it."""
    if name == "to_pymjcf":
        pytest.importorskip("dm_control")
    monkeypatch.chdir(tmp_path)
    thing = getattr(cs, name)
    found = doctest.DocTestFinder(recurse=False).find(thing, name, module=inspect.getmodule(thing))
    (example,) = (item for item in found if item.name == name)
    assert example.examples, f"{name} has no example"
    told: list[str] = []
    with np.printoptions(legacy="1.25"):
        failed, tried = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(
            example, out=told.append
        )
    assert tried > 0
    assert failed == 0, "".join(told)
