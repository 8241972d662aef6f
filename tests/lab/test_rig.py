"""Claims about what any bench promises: limits in one clear line, and no knowledge of the diagnosis."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

import catheter_sim
from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.lab.recorded import RecordedRig
from catheter_sim.lab.rig import Limits, Rig, completed, drive_limits
from catheter_sim.lab.simulated import SimulatedRig
from catheter_sim.tables import Table

ROOT = Path(catheter_sim.__file__).parent


def imported(path: Path) -> set[str]:
    """Return the package's modules that a file names in its imports, wherever they stand."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{item.name}" for item in node.names)}
        elif isinstance(node, ast.Import):
            found |= {item.name for item in node.names}
    return {name for name in found if name.startswith("catheter_sim")}


def files_of(module: str) -> Path | None:
    place = ROOT.joinpath(*module.split(".")[1:])
    if place.is_dir():
        return place / "__init__.py"
    return place.with_suffix(".py") if place.with_suffix(".py").is_file() else None


@pytest.mark.slow
def test_a_bench_knows_nothing_of_the_diagnosis() -> None:
    """Neither its files nor what they import, nor what that imports, is a file of `diagnosis`."""
    waiting = {f"catheter_sim.lab.{path.stem}" for path in (ROOT / "lab").glob("*.py")}
    seen: set[str] = set()
    while waiting:
        module = waiting.pop()
        seen.add(module)
        path = files_of(module)
        if path is not None and module != "catheter_sim":
            waiting |= imported(path) - seen
    assert "catheter_sim.lab.engine" in seen  # the walk goes further than the first files
    wrong = {name for name in seen if name.startswith(("catheter_sim.diagnosis", "catheter_sim.closed_loop"))}
    assert wrong == set()


def protocol_is_met(simulated: SimulatedRig, recorded: RecordedRig) -> tuple[Rig, Rig]:
    """Types alone: both backends are benches."""
    return simulated, recorded


@pytest.mark.parametrize(
    ("columns", "time_s", "line"),
    [
        ({"a_N": [0.0, 6.0]}, [0.0, 1.0], "in.csv: line 3: a_N = 6: the bench gives 0 to 5"),
        ({"a_N": [0.0, -1.0]}, [0.0, 1.0], "in.csv: line 3: a_N = -1: the bench gives 0 to 5"),
        ({"a_N": [0.0, np.nan]}, [0.0, 1.0], "in.csv: line 3: a_N = nan: the bench gives 0 to 5"),
        ({"b_N": [1.0, 0.0]}, [0.0, 1.0], "in.csv: line 2: unknown input of this bench 'b_N'"),
        ({"a_N": [0.0, 5.0]}, [0.0, 61.0], "in.csv: takes 61 s; a play may take 60 s"),
        ({"a_N": [0.0, 5.0]}, [1.0, 1.0], "in.csv: line 3: time_s = 1 does not come after 1"),
    ],
)
def test_limits_name_row_column_and_range(columns, time_s, line) -> None:
    """What goes beyond is refused by one line; a column that cannot be driven may stand there as zero."""
    limits = Limits({"a_N": (0.0, 5.0)}, 60.0)
    table = Table(np.array(time_s), {name: np.array(values) for name, values in columns.items()}, "in.csv")
    with pytest.raises(InputError) as caught:
        limits.check(table)
    assert str(caught.value).startswith(line)
    limits.check(Table(np.array([0.0, 60.0]), {"a_N": np.array([0.0, 5.0]), "b_N": np.zeros(2)}, "in.csv"))


def test_reach_becomes_limits_in_file_units() -> None:
    """A pair of tendons goes either way, a tension and an advance do not."""
    catheter, endoscope = load_robot("mitral_4dof"), load_robot("neuroendoscope_section")
    found = drive_limits(catheter, (0.001, 0.002, 0.0015, 0.03))
    assert found["displacement_bending_proximal_mm"] == pytest.approx((-1.0, 1.0))
    assert found["advance_mm"] == pytest.approx((0.0, 30.0))
    assert drive_limits(endoscope, {"tension_right_N": 0.3, "tension_left_N": 0.2}) == {
        "tension_right_N": (0.0, 0.3),
        "tension_left_N": (0.0, 0.2),
    }


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"speed_mm": (0.0, 1.0)}, "--limit: unknown input 'speed_mm'"),
        ({"tension_right_N": (0.1, 1.0)}, "--limit tension_right_N=0.1,1: a range with 0 within is needed"),
        ({"tension_right_N": (-1.0, 1.0)}, "--limit tension_right_N=-1,1: the robot takes 0 to inf"),
        ({"force_tip_x_N": (-1.0, 1.0)}, "--limit: a range of at least one input is needed"),
    ],
)
def test_impossible_limits_are_refused(given, line) -> None:
    """By one line that names the limit and what is possible."""
    with pytest.raises(InputError) as caught:
        completed(load_robot("neuroendoscope_section"), given, "--limit")
    assert str(caught.value).startswith(line)
